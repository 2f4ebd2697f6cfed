"""Simulated units with random errors, pressed on fruit by boundary elements; they write the files that units write."""
