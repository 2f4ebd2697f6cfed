"""A printed unit: its own springs, what its forces tell, and its firmware."""
