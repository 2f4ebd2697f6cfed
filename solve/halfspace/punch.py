"""Rigid frictionless flat punches on a half-space: what pressure answers a given shape of indentation.

A table holds, for a footprint of unit size and E* = E / (1 - nu^2) = 1, the symmetric matrix Y of nodal forces that
answer nodal displacements, F = Y U: a displacement that is a polynomial through its nodal values U is answered by a
pressure whose moments against the nodal polynomials l_k are F_k = int p l_k. Nodes are the Gauss points of the flat
punch's own pressure, so that three a side carry the moments of a flat punch up to the fifth order.
Tables depend neither on E nor on nu and are computed once per process.
"""

import functools
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.special import gamma, lpmv

Floats = NDArray[np.float64]

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
        along_x, along_y = (self.along(axis, points[:, axis]) for axis in (0, 1))
        values: Floats = (along_x[:, :, None] * along_y[:, None, :]).reshape(len(points), -1)
        return values

    def along(self, axis: int, x: Floats) -> Floats:
        """Return the nodal polynomials of one axis at coordinates x (m,) [side], shape (m, nodes along the axis)."""
        return _lagrange(self.lines[axis], x)

    @property
    def flat_stiffness(self) -> float:
        """Return F / (E* d side) of the flat punch pressed in without tilt [1]."""
        return float(self.stiffness.sum())

    @property
    def tilt_stiffness(self) -> float:
        """Return M / (E* theta side^3) of the punch turned about its y axis [1]."""
        x = self.nodes[:, 0]
        return float(x @ self.stiffness @ x)


def _lagrange(line: Floats, x: Floats) -> Floats:
    degree = len(line) - 1
    values = np.linalg.solve(legendre.legvander(2.0 * line, degree).T, legendre.legvander(2.0 * x, degree).T)
    return np.asarray(values.T, dtype=np.float64)


@functools.cache
def rectangle_punch(aspect: float, nodes_per_side: int) -> Punch:
    """Return the table of a rectangle 1 x `aspect`, by Galerkin boundary elements graded to its edges.

    Two grids are extrapolated with the order 3 of piecewise constant pressure under an edge singularity; the
    error is a tenth of that step. Square: 1.15230 (capacity 0.36679 pi of the electrified plate, Read 1997).
    """
    coarse, _ = _rectangle_moments(CELLS[0], aspect, nodes_per_side)
    fine, marginals = _rectangle_moments(CELLS[1], aspect, nodes_per_side)
    step = (fine - coarse) / ((CELLS[1] / CELLS[0]) ** ORDER - 1.0)
    lines = tuple(_gauss_points(x, weight, nodes_per_side) for x, weight in marginals)
    return _table(fine + step, (lines[0], lines[1]), aspect, 0.1 * abs(step[0, 0] / fine[0, 0]))


def square_punch(nodes_per_side: int) -> Punch:
    """Return the table of a square of side 1."""
    return rectangle_punch(1.0, nodes_per_side)


@functools.cache
def circle_punch(nodes_per_side: int) -> Punch:
    """Return the table of a circle of diameter 1, exact to rounding.

    Harmonics P_l^m(sqrt(1 - r^2)) cos m phi with l - m even are eigenfunctions of the single-layer operator on the
    disc with density / sqrt(1 - r^2); eigenvalues from Boersma and Danicki, SIAM J. Appl. Math. 53 (1993) 925.
    """
    n = nodes_per_side
    cosine, weight = legendre.leggauss(2 * n)
    cosine, weight = 0.5 * (cosine + 1.0), 0.5 * weight
    phi = 2.0 * np.pi * np.arange(4 * n) / (4 * n)
    radius = np.sqrt(1.0 - cosine**2)[:, None]
    x, y = (radius * np.cos(phi)).ravel(), (radius * np.sin(phi)).ravel()
    area = np.repeat(weight * 2.0 * np.pi / (4 * n), 4 * n)
    powers_x, powers_y = legendre.legvander(x, n - 1), legendre.legvander(y, n - 1)
    polynomials = (powers_x[:, :, None] * powers_y[:, None, :]).reshape(-1, n * n)
    moments = np.zeros((n * n, n * n))
    for degree in range(2 * n - 1):
        for m in range(degree % 2, degree + 1, 2):
            eigenvalue = np.pi * gamma((degree + m + 1) / 2) * gamma((degree - m + 1) / 2)
            eigenvalue /= gamma((degree + m + 2) / 2) * gamma((degree - m + 2) / 2)
            radial = np.repeat(lpmv(m, degree, cosine), 4 * n)
            for angular in (np.cos, np.sin) if m else (np.cos,):
                harmonic = radial * angular(m * np.tile(phi, len(cosine)))
                along = polynomials.T @ (area * harmonic)
                moments += (np.pi / eigenvalue / (area @ harmonic**2)) * np.outer(along, along)
    line = 0.5 * legendre.leggauss(n)[0]
    return _table(0.5 * moments, (line, line), 1.0, 1e-12)


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
    """Return the edges of cells on (-1/2, 1/2), steps ~ (distance to the end)^(1 - 1/grading)."""
    line = np.linspace(-1.0, 1.0, cells + 1)
    t = 0.5 * (line - line[::-1])  # a mirror image to the last bit, so that mirrored scenes have mirrored matrices
    return 0.5 * np.sign(t) * (1.0 - (1.0 - np.abs(t)) ** grading)


def _rectangle_moments(cells: int, aspect: float, n: int) -> tuple[Floats, list[tuple[Floats, Floats]]]:
    """Return int P_a A^-1 P_b for the products P_a of Legendre polynomials, and the flat punch's marginal pressures."""
    x = graded_edges(cells)
    half = cells // 2
    pairs = influence(x, aspect * x)
    moments = np.zeros((n, n, n, n))
    cell_moments = _legendre_integrals(x[half:], n)
    marginals: list[tuple[Floats, Floats]] = []
    for px in (0, 1):
        for py in (0, 1):
            quarter = pairs[half:, half:] + (-1) ** px * pairs[half:, half - 1 :: -1]
            quarter = quarter[:, :, half:, half:] + (-1) ** py * quarter[:, :, half:, half - 1 :: -1]
            A = quarter.transpose(0, 2, 1, 3).reshape(half * half, half * half)
            loads = np.einsum("ai,bj->ijab", cell_moments[px::2], aspect * cell_moments[py::2])
            right = loads.reshape(half * half, -1)
            pressure = np.linalg.solve(A, right)
            shape = (*loads.shape[2:], *loads.shape[2:])
            moments[px::2, py::2, px::2, py::2] = 4.0 * (right.T @ pressure).reshape(shape)
            if px == py == 0:
                force = (pressure[:, 0] * right[:, 0]).reshape(half, half)
                centre = 0.5 * (x[half:-1] + x[half + 1 :])
                marginals = [(centre, force.sum(axis=1)), (centre, force.sum(axis=0))]
    return moments.reshape(n * n, n * n), marginals


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


def _gauss_points(x: Floats, weight: Floats, n: int) -> Floats:
    """Return the n Gauss points of a symmetric measure given on its positive half, by the Lanczos recurrence."""
    points = np.concatenate([-x[::-1], x])
    root = np.sqrt(np.concatenate([weight[::-1], weight]))
    basis = [root / np.linalg.norm(root)]
    off: list[float] = []
    for _ in range(n - 1):
        following = points * basis[-1]
        for earlier in basis:
            following = following - (earlier @ following) * earlier
        off.append(float(earlier_norm := np.linalg.norm(following)))
        basis.append(following / earlier_norm)
    found = np.linalg.eigvalsh(np.diag(off, 1) + np.diag(off, -1))
    return 0.5 * (found - found[::-1])
