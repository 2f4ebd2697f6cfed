"""Rigid frictionless flat punches on a half-space: what pressure answers a given shape of indentation.

A table holds, for a footprint of unit size and E* = E / (1 - nu^2) = 1, the symmetric matrix Y of nodal forces that
answer nodal displacements, F = Y U: a displacement that is a polynomial through its nodal values U is answered by a
pressure whose moments against the nodal polynomials l_k are F_k = int p l_k. Nodes are the Gauss points of the flat
punch's own pressure, so that three a side carry the moments of a flat punch up to the fifth order.
Tables depend neither on E nor on nu.
"""

import functools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import lu_factor, lu_solve
from scipy.special import gamma, lpmv

from solve.arrays import Floats, Ints

CELLS = (16, 32)
GRADING = 4.0
ORDER = 3.0


@dataclass(frozen=True)
class Punch:
    """A punch table: nodes (n, 2) [side], Y (n, n) [E* side], relative error of Y, line of nodes along each axis."""

    nodes: Floats
    stiffness: Floats
    error: float
    lines: tuple[Floats, Floats]

    def interpolate(self, points: Floats) -> Floats:
        """Return the nodal polynomials at points (m, 2) [side], shape (m, n)."""
        return _products(*(self.along(axis, points[:, axis]) for axis in (0, 1)))

    def along(self, axis: int, x: Floats) -> Floats:
        """Return the nodal polynomials of one axis at coordinates x (m,) [side], shape (m, nodes along the axis)."""
        return _lagrange(self.lines[axis], x)

    @property
    def flat_stiffness(self) -> float:
        """Return F / (E* d side) of the flat punch pressed in without tilt [1]."""
        return float(self.stiffness.sum())


def _products(along_x: Floats, along_y: Floats) -> Floats:
    """Return the products of all pairs of functions at each point, shape (points, functions^2)."""
    return (along_x[:, :, None] * along_y[:, None, :]).reshape(len(along_x), -1)


def _lagrange(line: Floats, x: Floats) -> Floats:
    degree = len(line) - 1
    values = np.linalg.solve(legendre.legvander(2.0 * line, degree).T, legendre.legvander(2.0 * x, degree).T)
    return np.asarray(values.T, dtype=np.float64)


# One scene takes three tables, of 1 to 25 nodes a side, hundreds of times; each costs 0.1 s.
@functools.lru_cache(maxsize=16)
def rectangle_punch(aspect: float, nodes_per_side: int) -> Punch:
    """Return the table of a rectangle 1 x `aspect` [1], by Galerkin boundary elements graded to its edges.

    Two grids are extrapolated with the order 3 of piecewise constant pressure under an edge singularity; the
    error is a tenth of that step. Square: 1.15230 (capacity 0.36679 pi of the electrified plate, Read 1997).
    """
    coarse, _ = _rectangle_moments(CELLS[0], aspect, nodes_per_side)
    fine, flat = _rectangle_moments(CELLS[1], aspect, nodes_per_side)
    step = (fine - coarse) / ((CELLS[1] / CELLS[0]) ** ORDER - 1.0)
    lines = _gauss_points(flat.sum(axis=1), nodes_per_side), _gauss_points(flat.sum(axis=0), nodes_per_side)
    return _table(fine + step, lines, aspect, 0.1 * abs(step[0, 0] / fine[0, 0]))


def square_punch(nodes_per_side: int) -> Punch:
    """Return the table of a square of side 1."""
    return rectangle_punch(1.0, nodes_per_side)


@functools.lru_cache(maxsize=16)
def circle_punch(nodes_per_side: int) -> Punch:
    """Return the table of a circle of diameter 1, exact to rounding, its error relative [1].

    Harmonics P_l^m(sqrt(1 - r^2)) cos m phi with l - m even are eigenfunctions of the single-layer operator on the
    disc with density / sqrt(1 - r^2); eigenvalues from Boersma and Danicki, SIAM J. Appl. Math. 53 (1993) 925.
    """
    n = nodes_per_side
    points, weights = _disc_quadrature(2 * n)
    polynomials = _products(_legendre(points[0], n), _legendre(points[1], n))
    moments = np.zeros((n * n, n * n))
    for harmonic, eigenvalue in _harmonics(2 * n - 1, points):
        moment = polynomials.T @ (weights * harmonic)
        moments += np.outer(moment, moment) / eigenvalue / (weights @ harmonic**2)
    line = 0.5 * legendre.leggauss(n)[0]
    return _table(0.5 * np.pi * moments, (line, line), 1.0, 1e-12)


def _disc_quadrature(n: int) -> tuple[Floats, Floats]:
    """Return places (2, q) on a disc of radius 1 and weights (q,) that integrate over the half-sphere above it."""
    cosine, weight = legendre.leggauss(n)
    radius = np.sqrt(1.0 - 0.25 * (cosine + 1.0) ** 2)
    phi = np.pi / n * np.arange(2 * n)
    points = np.stack([np.outer(radius, np.cos(phi)).ravel(), np.outer(radius, np.sin(phi)).ravel()])
    return points, np.repeat(0.5 * np.pi / n * weight, 2 * n)


def _legendre(x: Floats, n: int) -> Floats:
    return np.asarray(legendre.legvander(x, n - 1), dtype=np.float64)


def _harmonics(degrees: int, points: Floats) -> Iterator[tuple[Floats, float]]:
    """Yield the harmonics at points of the disc, shape (q,), each with its eigenvalue."""
    cosine, phi = np.sqrt(1.0 - (points**2).sum(axis=0)), np.arctan2(points[1], points[0])
    for degree in range(degrees):
        for m in range(degree % 2, degree + 1, 2):
            eigenvalue = np.pi * gamma((degree + m + 1) / 2) * gamma((degree - m + 1) / 2)
            eigenvalue /= gamma((degree + m + 2) / 2) * gamma((degree - m + 2) / 2)
            radial = lpmv(m, degree, cosine)
            for angular in (np.cos, np.sin) if m else (np.cos,):
                yield radial * angular(m * phi), float(eigenvalue)


def _table(moments: Floats, lines: tuple[Floats, Floats], aspect: float, error: float) -> Punch:
    """Turn moments of Legendre polynomials over the footprint into nodal forces."""
    degree = len(lines[0]) - 1
    values = np.kron(legendre.legvander(2.0 * lines[0], degree), legendre.legvander(2.0 * lines[1], degree))
    inverse = np.linalg.inv(values)
    stiffness = inverse.T @ moments @ inverse
    lines = (lines[0], aspect * lines[1])
    nodes = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2)
    return Punch(nodes, 0.5 * (stiffness + stiffness.T), error, lines)


def graded_edges(cells: int, grading: float = GRADING) -> Floats:
    """Return the edges of cells on (-1/2, 1/2), shape (cells + 1,), steps ~ (distance to the end)^(1 - 1/grading)."""
    line = np.linspace(-1.0, 1.0, cells + 1)
    t = 0.5 * (line - line[::-1])  # a mirror image to the last bit, so that mirrored scenes have mirrored matrices
    return 0.5 * np.sign(t) * (1.0 - (1.0 - np.abs(t)) ** grading)


def _rectangle_moments(cells: int, aspect: float, n: int) -> tuple[Floats, Floats]:
    """Return int P_a A^-1 P_b for the products P_a of Legendre polynomials, and the flat punch's forces of cells.

    A is the influence of uniform pressures on the cells.
    """
    along = _legendre_integrals(graded_edges(cells), n)
    loads = np.einsum("ai,bj->ijab", along, aspect * along).reshape(cells**2, n * n)
    pressure = lu_solve(_influence_factor(cells, aspect), loads)
    return loads.T @ pressure, (pressure[:, 0] * loads[:, 0]).reshape(cells, cells)


@functools.lru_cache(maxsize=2)
def _influence_factor(cells: int, aspect: float) -> tuple[Floats, Ints]:
    """Return the LU factors of the influence of uniform pressures on the cells, kept for both grids of a rectangle.

    Cells at an edge are so small that round-off leaves the influence of a fine grid not positive definite.
    """
    x = graded_edges(cells)
    factors, pivots = lu_factor(influence(x, aspect * x).transpose(0, 2, 1, 3).reshape(cells**2, cells**2))
    return factors, pivots


def influence(x: Floats, y: Floats) -> Floats:
    """Return int int 1 / (pi r) over all pairs of cells, shape (cells x, cells x, cells y, cells y)."""
    total = _four_fold(np.abs(x[:, None] - x)[:, :, None, None], np.abs(y[:, None] - y)[None, None])
    for axis in range(4):
        total = np.diff(total, axis=axis)
    return total / np.pi


def _four_fold(x: Floats, y: Floats) -> Floats:
    """Return G with G,xxyy = 1 / r: the potential between two rectangles is its fourth difference."""
    r = np.hypot(x, y)
    with np.errstate(divide="ignore"):
        log_x = np.where(x > 0.0, np.arcsinh(y / np.where(x > 0.0, x, 1.0)), 0.0)
        log_y = np.where(y > 0.0, np.arcsinh(x / np.where(y > 0.0, y, 1.0)), 0.0)
    return 0.5 * x * y * (x * log_x + y * log_y) - r**3 / 6.0


def _legendre_integrals(edges: Floats, n: int) -> Floats:
    """Return the integrals of P_0(2 x) ... P_n-1(2 x) over each cell, shape (n, cells)."""
    powers = legendre.legvander(2.0 * edges, n).T
    rows = [powers[1]] + [(powers[k + 1] - powers[k - 1]) / (2 * k + 1) for k in range(1, n)]
    return 0.5 * np.diff(np.stack(rows), axis=1)


def _gauss_points(weight: Floats, n: int) -> Floats:
    """Return the n Gauss points of a symmetric measure, given on graded cells, by the Lanczos recurrence."""
    edges = graded_edges(len(weight))
    points, root = 0.5 * (edges[1:] + edges[:-1]), np.sqrt(weight)
    basis = [root / np.linalg.norm(root)]
    off: list[float] = []
    for _ in range(n - 1):
        following = points * basis[-1]
        for earlier in basis:
            following = following - (earlier @ following) * earlier
        off.append(float(np.linalg.norm(following)))
        basis.append(following / off[-1])
    nodes = np.linalg.eigvalsh(np.diag(off, 1) + np.diag(off, -1))
    return 0.5 * (nodes - nodes[::-1])
