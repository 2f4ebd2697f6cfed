"""The rigid tips that touch the fruit: one file for each shape, all of them in `shapes.py`."""
