"""WHAT the part is: solids, drawings, files."""
