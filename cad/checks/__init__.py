"""Verdicts on solids and files: measured on the geometry, not read from its dimensions."""
