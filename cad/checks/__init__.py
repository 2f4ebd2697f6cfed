"""Verdicts on solids and files. Most are measured on the geometry, not computed from the dimensions of the design."""
