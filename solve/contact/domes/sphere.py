"""A rigid sphere pressed into a half-space, with its own profile and not that of a paraboloid.

C. M. Segedin, Mathematika 4 (1957) 156, doi:10.1112/S0025579300001224; I. N. Sneddon, Int. J. Engng Sci. 3 (1965) 47,
doi:10.1016/0020-7225(65)90019-4: with contact radius a, sphere r and a surface that falls away by rho^2 / (2 R),

    depth = a artanh(a / r) + a^2 / R,    force / E* = (r^2 + a^2) artanh(a / r) - a r + 4 a^3 / (3 R),

and d force / d depth = 2 a E*. Hertz is what remains for a much smaller than r.
"""

import numpy as np

from solve.arrays import Floats

STEPS = 12  # of Newton's method from above, on a convex function
SMALL = 0.1  # below, artanh(x) - x is a series: the difference would lose its digits
TERMS = 9


def sphere_contact_radius(depth: Floats, sphere: float, curvature: Floats) -> Floats:
    """Return the contact radius [mm] at a depth of at least 0 [mm]; `curvature` is that of the surface [1/mm]."""
    sunk = depth / sphere
    beside = sphere * curvature  # curvature of the surface over that of the sphere
    # Both are upper bounds: the paraboloid's radius, and artanh(x) <= 1.25 sunk where x is above 0.8.
    x = np.minimum(np.sqrt(sunk / (1.0 + beside)), np.maximum(0.8, np.tanh(1.25 * sunk)))
    for _ in range(STEPS):
        slope = x + _artanh_less(x) + x / (1.0 - x**2) + 2.0 * x * beside
        above = x * (x + _artanh_less(x)) + x**2 * beside - sunk
        x = x - np.divide(above, slope, out=np.zeros_like(x), where=x > 0.0)
    return sphere * x


def sphere_force(contact_radius: Floats, sphere: float, curvature: Floats) -> Floats:
    """Return the force over E* [mm^2] at a contact radius [mm]; `curvature` [1/mm] is that of the surface."""
    x = contact_radius / sphere
    return sphere**2 * ((1.0 + x**2) * _artanh_less(x) + x**3 * (1.0 + 4.0 / 3.0 * sphere * curvature))


def paraboloid_force(contact_radius: Floats, radius: Floats) -> Floats:
    """Return the force over E* [mm^2] at a contact radius [mm] of a relative radius of curvature [mm]: Hertz's law.

    F / E* = 4/3 a^3 / R: Johnson (4.22) with (4.23).
    """
    return 4.0 / 3.0 * contact_radius**3 / radius


def _artanh_less(x: Floats) -> Floats:
    """Return artanh(x) - x for 0 <= x < 1."""
    powers = np.arange(1, TERMS + 1)
    few = np.minimum(x, SMALL)
    series = ((few[..., None] ** (2 * powers + 1)) / (2 * powers + 1)).sum(axis=-1)
    return np.where(x < SMALL, series, np.arctanh(x) - x)
