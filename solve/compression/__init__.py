"""A whole fruit compressed at finite strain: the force against the travel of a plate or a plunger.

This is the only solver for finite strain: laws of flesh, principal stretches, quadratic elements and Newton's method.
"""
