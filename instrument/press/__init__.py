"""A printed unit with its own springs, and the readings of its presses."""
