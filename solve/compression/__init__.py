"""Compression of a whole fruit at finite strain: the force as a function of the travel of a plate or a plunger.

This is the only solver for finite strain. It uses hyperelastic material laws, quadratic elements and Newton's method.
"""
