"""The program of a unit: a C header, and a MicroPython module."""
