"""Calibration of a printed unit with weights, a hard plate, a reference ball or fruit, and of its material."""
