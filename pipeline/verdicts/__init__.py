"""Verdicts on a sensor in the scene of its design, and hints that would make it pass."""
