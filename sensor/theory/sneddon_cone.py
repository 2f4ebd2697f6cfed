"""A sharp rigid cone pressed into a half-space.

I. N. Sneddon, Int. J. Engng Sci. 3 (1965) 47, doi:10.1016/0020-7225(65)90019-4. The half angle alpha is measured from
the axis to the flank; E* = E / (1 - nu^2).
"""

import math


def cone_force(depth: float, half_angle_deg: float, reduced_modulus: float) -> float:
    """Return the force F = 2 E* d^2 tan(alpha) / pi [N from mm, deg, MPa]."""
    return 2.0 / math.pi * reduced_modulus * depth**2 * math.tan(math.radians(half_angle_deg))


def cone_contact_radius(depth: float, half_angle_deg: float) -> float:
    """Return the contact radius a = 2 d tan(alpha) / pi [mm from mm, deg]."""
    return 2.0 / math.pi * depth * math.tan(math.radians(half_angle_deg))


def cone_mean_pressure(half_angle_deg: float, reduced_modulus: float) -> float:
    """Return the mean pressure F / (pi a^2) = E* / (2 tan(alpha)) [MPa from deg, MPa], the same at every depth."""
    return 0.5 * reduced_modulus / math.tan(math.radians(half_angle_deg))
