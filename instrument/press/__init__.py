"""A printed unit: its own springs, and readings of its forces."""
