"""Calibration of a printed unit: its springs from weights, a plate or a coupon, and its readings with them."""
