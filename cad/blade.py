"""Guided-beam law of a parallel pair of leaves, both ways: the first guess of every flexure."""

import math


def pair_stiffness(E: float, depth: float, thickness: float, length: float) -> float:
    """Return K = 24 E I / L^3 = 2 E w t^3 / L^3 of two clamped-guided leaves [N/mm from MPa, mm].

    Euler-Bernoulli, rigid ends. S. Timoshenko, Strength of Materials I, 1930, art. 34.
    """
    return 2.0 * E * depth * (thickness / length) ** 3


def pair_length(E: float, depth: float, thickness: float, stiffness: float) -> float:
    """Return the leaf length [mm] at which a pair has the given stiffness [N/mm]."""
    return thickness * math.cbrt(2.0 * E * depth / stiffness)


def root_strain(thickness: float, length: float, deflection: float) -> float:
    """Return the bending strain 3 t d / L^2 at the root of a clamped-guided leaf [1 from mm]."""
    return 3.0 * thickness * deflection / length**2


def parasitic_shift(length: float, deflection: float) -> float:
    """Return the shift 0.6 d^2 / L of the platform along its leaves at deflection d [mm]."""
    return 0.6 * deflection**2 / length
