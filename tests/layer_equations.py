"""Layers in closed form: one on a rigid base, and the integral equation of a flat circle on any.

N. N. Lebedev, Y. S. Ufliand, J. Appl. Math. Mech. 22 (1958) 442; K. L. Johnson, Contact Mechanics (1985), section 5.8.
"""

import numpy as np


def bonded(u, poisson):
    """Return the compliance of a layer bonded to a rigid base over that of a half-space, at wave number times height.

    L(u) = (2 k sinh 2u - 4 u) / (2 k cosh 2u + 4 u^2 + 1 + k^2),  k = 3 - 4 nu.
    """
    k = 3.0 - 4.0 * poisson
    top = 2.0 * k * np.sinh(2.0 * u) - 4.0 * u
    return top / (2.0 * k * np.cosh(2.0 * u) + 4.0 * u**2 + 1.0 + k**2)


def circle_stiffness(change, radius_over_height):
    """Return the force of a flat circle over that on a half-space [1], which is the integral of phi over (0, 1).

    phi(t) + 2 a / (pi h) int_0^1 phi(s) int_0^inf change(u) cos(u t a / h) cos(u s a / h) du ds = 1, where `change` is
    the compliance at u over that of the half-space, less 1. Gauss points take both integrals.
    """
    point, weight = np.polynomial.legendre.leggauss(200)
    u, du = 15.0 * (point + 1.0), 15.0 * weight
    point, weight = np.polynomial.legendre.leggauss(40)
    t, dt = 0.5 * (point + 1.0), 0.5 * weight
    waves = np.cos(np.outer(t, u) * radius_over_height)
    kernel = 2.0 * radius_over_height / np.pi * (waves * (change(u) * du)) @ waves.T
    return float(dt @ np.linalg.solve(np.eye(len(t)) + kernel * dt, np.ones(len(t))))
