"""The rigid tips that touch the fruit. Each kind of shape has its own file, and `shapes.py` lists all shapes."""
