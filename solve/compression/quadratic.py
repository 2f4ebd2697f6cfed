"""Quadratic Lagrange polynomials with the nodes -1, 0 and 1. Their products are the shape functions of Q9 elements."""

import numpy as np

from sensor.arrays import Floats


def tensor_product(along: Floats, up: Floats) -> Floats:
    """Return the products of each function `along` with each function `up`, shape (points, 9). Both are (points, 3)."""
    return (along[:, :, None] * up[:, None, :]).reshape(len(along), 9)


def quadratic(x: Floats) -> Floats:
    """Return the three Lagrange polynomials at points x (points,), shape (points, 3)."""
    return np.stack([0.5 * x * (x - 1.0), 1.0 - x**2, 0.5 * x * (x + 1.0)], axis=1)


def quadratic_slope(x: Floats) -> Floats:
    """Return the derivatives of the three Lagrange polynomials at points x (points,), shape (points, 3)."""
    return np.stack([x - 0.5, -2.0 * x, x + 0.5], axis=1)
