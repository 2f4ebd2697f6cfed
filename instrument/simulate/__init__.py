"""Simulated units with random errors, and the files that they write in presses solved by boundary elements."""
