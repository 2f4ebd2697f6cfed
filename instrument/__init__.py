"""WHAT a printed unit measures: compression tests, calibration, presses and firmware."""
