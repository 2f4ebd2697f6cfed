"""Verdicts on solids and files; most are measured on the geometry instead of computed from lengths of the design."""
