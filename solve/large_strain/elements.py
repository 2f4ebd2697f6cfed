"""Gradients, weights and pressure functions of quadratic elements in a body of revolution."""

from dataclasses import dataclass

import numpy as np

from solve.arrays import Floats
from solve.large_strain.grid import Grid

POINTS = 3  # Gauss points along each direction


@dataclass(frozen=True, kw_only=True, eq=False)
class Elements:
    """What the energy needs of every element at its Gauss points.

    `operator` (elements, points, 5, 18) turns displacements into F less its value at rest, `weights` (elements,
    points) are volumes [tip sides^3], `projection` (elements, points, points) takes values to the linear functions that
    are nearest to them.
    """

    operator: Floats
    weights: Floats
    projection: Floats


def quadratic_elements(grid: Grid) -> Elements:
    """Return the elements of a grid."""
    places, gauss = np.polynomial.legendre.leggauss(POINTS)
    x, y = np.repeat(places, POINTS), np.tile(places, POINTS)
    start, width, height = _rectangles(grid)
    r = start[:, None] + np.outer(width, 0.5 * (1.0 + x))
    weights = 0.5 * np.pi * r * np.outer(np.abs(width * height), np.outer(gauss, gauss))
    hoop = _products(_quadratic(x), _quadratic(y)) / r[..., None]
    operator = _operator(_gradient(x, y, width, height), hoop)
    return Elements(operator=operator, weights=weights, projection=_projection(x, y, weights))


def _rectangles(grid: Grid) -> tuple[Floats, Floats, Floats]:
    """Return the inner radius, the width and the (negative) height of each element [tip sides]."""
    rows, columns = len(grid.z) - 1, len(grid.r) - 1
    return np.repeat(grid.r[:-1], rows), np.repeat(np.diff(grid.r), rows), np.tile(np.diff(grid.z), columns)


def _gradient(x: Floats, y: Floats, width: Floats, height: Floats) -> tuple[Floats, Floats]:
    """Return the derivatives by r and z of nine functions, each (elements, points, 9) [1 / tip side]."""
    by_r = 2.0 / width[:, None, None] * _products(_quadratic_slope(x), _quadratic(y))
    by_z = 2.0 / height[:, None, None] * _products(_quadratic(x), _quadratic_slope(y))
    return by_r, by_z


def _operator(gradient: tuple[Floats, Floats], hoop: Floats) -> Floats:
    """Return the operator of gradients and values over r of nine functions, each (elements, points, 9)."""
    by_r, by_z = gradient
    operator = np.zeros((*hoop.shape[:2], 5, 9, 2))
    operator[:, :, 0, :, 0], operator[:, :, 1, :, 0] = by_r, by_z
    operator[:, :, 2, :, 1], operator[:, :, 3, :, 1] = by_r, by_z
    operator[:, :, 4, :, 0] = hoop
    return operator.reshape(*hoop.shape[:2], 5, 18)


def _products(along: Floats, up: Floats) -> Floats:
    """Return the products of three functions each way, both (points, 3), shape (points, 9)."""
    return (along[:, :, None] * up[:, None, :]).reshape(len(along), 9)


def _projection(x: Floats, y: Floats, weights: Floats) -> Floats:
    """Return the projection on 1, x and y in the mean over each element; weights (elements, points)."""
    linear = np.stack([np.ones_like(x), x, y])
    weighted = linear * weights[:, None, :]
    mass = weighted @ linear.T
    return np.asarray(linear.T @ np.linalg.solve(mass, weighted))


def _quadratic(x: Floats) -> Floats:
    """Return the Lagrange functions of -1, 0, 1 at places x, shape (places, 3)."""
    return np.stack([0.5 * x * (x - 1.0), 1.0 - x**2, 0.5 * x * (x + 1.0)], axis=1)


def _quadratic_slope(x: Floats) -> Floats:
    return np.stack([x - 0.5, -2.0 * x, x + 0.5], axis=1)
