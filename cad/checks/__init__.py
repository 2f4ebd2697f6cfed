"""Verdicts on solids and files, measured on their geometry instead of computed from the lengths of the design."""
