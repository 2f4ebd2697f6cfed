"""A printed unit: its own springs, and what its forces tell."""
