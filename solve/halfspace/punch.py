"""Rigid frictionless flat punches on a half-space: the pressure for a given shape of indentation.

For a footprint of unit size and E* = E / (1 - nu^2) = 1, a table has the symmetric matrix Y of nodal forces per nodal
displacements, F = Y U. The displacement is the polynomial through the nodal values U. The nodal forces are the moments
of the pressure with the nodal polynomials l_k, F_k = int p l_k. Nodes are the Gauss points of the flat punch's own
pressure, so three per side represent the moments of a flat punch up to the fifth order. Tables do not depend on E or
nu.
"""

import functools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve
from scipy.special import gamma, lpmv

from sensor.arrays import Floats, Ints

CELLS = (16, 32)  # boundary elements per side of the coarse and of the fine grid
GRADING = 4.0  # exponent by which the cells are graded towards the edges of the square
ORDER = 3.0  # order of the error in the number of cells, for a pressure that is singular along an edge
ROUND_OFF = 1e-12  # relative error of a table that is exact except for rounding


@dataclass(frozen=True)
class Punch:
    """A punch table: Y (n, n) [E* side], its relative error, and the coordinates of the nodes along x and y [side]."""

    stiffness: Floats
    error: float
    x: Floats
    y: Floats

    @property
    def nodes(self) -> Floats:
        """Return the nodes, shape (n, 2) [side]."""
        return np.stack(np.meshgrid(self.x, self.y, indexing="ij"), axis=-1).reshape(-1, 2)

    def interpolate(self, points: Floats) -> Floats:
        """Return the nodal polynomials at points (m, 2) [side], shape (m, n)."""
        return _products(lagrange(self.x, points[:, 0]), lagrange(self.y, points[:, 1]))

    @property
    def flat_stiffness(self) -> float:
        """Return F / (E* d side) of the flat punch at indentation d without tilt [1]."""
        return float(self.stiffness.sum())


def _products(along_x: NDArray[Any], along_y: NDArray[Any]) -> Floats:
    """Return the products of all pairs of functions at each point, shape (points, functions^2)."""
    return np.asarray(along_x[:, :, None] * along_y[:, None, :]).reshape(len(along_x), -1)


def lagrange(nodes: Floats, x: Floats) -> Floats:
    """Return the nodal polynomials of nodes (n,) on (-1/2, 1/2) at coordinates x (m,), shape (m, n).

    Each polynomial is 1 at its own node and 0 at the others.
    """
    degree = len(nodes) - 1
    values = np.linalg.solve(legendre.legvander(2.0 * nodes, degree).T, legendre.legvander(2.0 * x, degree).T)
    return np.asarray(values.T, dtype=np.float64)


# One scene uses three tables, of 1 to 25 nodes per side, hundreds of times; each takes 0.1 s.
@functools.lru_cache(maxsize=16)
def square_punch(nodes_per_side: int) -> Punch:
    """Return the punch table of a square of side 1, by Galerkin boundary elements graded to its edges.

    Pressure is constant in each cell. Two grids are extrapolated with order 3; a tenth of the extrapolation is the
    error estimate. F / (E* d) = 1.15230, from the capacity 0.36679 pi of the electrified plate (Read 1997).
    """
    coarse, _ = _square_moments(CELLS[0], nodes_per_side)
    fine, flat_forces = _square_moments(CELLS[1], nodes_per_side)
    step = (fine - coarse) / ((CELLS[1] / CELLS[0]) ** ORDER - 1.0)
    # The nodes are the Gauss points for the pressure of the flat punch.
    along_x = _gauss_points(flat_forces.sum(axis=1), nodes_per_side)
    along_y = _gauss_points(flat_forces.sum(axis=0), nodes_per_side)
    error = 0.1 * abs(step[0, 0] / fine[0, 0])
    return Punch(_nodal_stiffness(fine + step, along_x, along_y), error, along_x, along_y)


@functools.lru_cache(maxsize=16)
def circle_punch(nodes_per_side: int) -> Punch:
    """Return the punch table of a circle of diameter 1, exact to rounding.

    Harmonics P_l^m(sqrt(1 - r^2)) cos m phi with l - m even are eigenfunctions of the unit disc: the pressure for such
    a displacement is proportional to it / sqrt(1 - r^2). The eigenvalues are from J. Boersma and E. Danicki, SIAM J.
    Appl. Math. 53 (1993) 925.
    """
    n = nodes_per_side
    # Quadrature over the half-sphere above the disc, on which a density / sqrt(1 - r^2) is smooth: Gauss points in
    # height, equal steps of the angle.
    height, weight = legendre.leggauss(2 * n)
    radius = np.sqrt(1.0 - 0.25 * (height + 1.0) ** 2)
    angle = np.pi / (2 * n) * np.arange(4 * n)
    x = np.outer(radius, np.cos(angle)).ravel()
    y = np.outer(radius, np.sin(angle)).ravel()
    weights = np.repeat(0.5 * np.pi / (2 * n) * weight, 4 * n)
    polynomials = _products(legendre.legvander(x, n - 1), legendre.legvander(y, n - 1))

    # A displacement is the sum of its projections on the harmonics, and each adds the work of its pressure, moments (x)
    # moments / (eigenvalue * norm).
    work = np.zeros((n * n, n * n))
    for eigenvalue, harmonic in _disc_harmonics(x, y, 2 * n - 1):
        moments = polynomials.T @ (weights * harmonic)
        work += np.outer(moments, moments) / eigenvalue / (weights @ harmonic**2)
    # The nodes lie on a square grid, like the nodes of a square, some of them outside the disc. The influence of a unit
    # force is 1 / (pi r); the disc of radius 1 is scaled to diameter 1.
    line = 0.5 * legendre.leggauss(n)[0]
    return Punch(_nodal_stiffness(0.5 * np.pi * work, line, line), ROUND_OFF, line, line)


def _disc_harmonics(x: Floats, y: Floats, degrees: int) -> Iterator[tuple[float, Floats]]:
    """Yield eigenvalue and values at points x, y (n,) of the harmonics of the unit disc below degree `degrees`."""
    cosine = np.sqrt(1.0 - (x**2 + y**2))
    phi = np.arctan2(y, x)
    for degree in range(degrees):
        for order in range(degree % 2, degree + 1, 2):
            eigenvalue = np.pi * gamma((degree + order + 1) / 2) * gamma((degree - order + 1) / 2)
            eigenvalue /= gamma((degree + order + 2) / 2) * gamma((degree - order + 2) / 2)
            radial = lpmv(order, degree, cosine)
            yield eigenvalue, radial * np.cos(order * phi)
            if order > 0:
                yield eigenvalue, radial * np.sin(order * phi)


def _nodal_stiffness(moments: Floats, along_x: Floats, along_y: Floats) -> Floats:
    """Return the symmetric matrix of nodal forces, from the matrix for products of Legendre polynomials.

    Both have shape (n^2, n^2); the n nodes along x and along y lie on (-1/2, 1/2).
    """
    degree = len(along_x) - 1
    values = np.kron(legendre.legvander(2.0 * along_x, degree), legendre.legvander(2.0 * along_y, degree))
    inverse = np.linalg.inv(values)
    stiffness = inverse.T @ moments @ inverse
    return 0.5 * (stiffness + stiffness.T)


def graded_edges(cells: int, grading: float = GRADING) -> Floats:
    """Return the edges of cells on (-1/2, 1/2), (cells + 1,), steps ~ (distance to the end)^(1 - 1/grading)."""
    line = np.linspace(-1.0, 1.0, cells + 1)
    t = 0.5 * (line - line[::-1])  # symmetric to the last bit, so that mirrored scenes have mirrored matrices
    return 0.5 * np.sign(t) * (1.0 - (1.0 - np.abs(t)) ** grading)


def _square_moments(cells: int, n: int) -> tuple[Floats, Floats]:
    """Return the work of the pressures for polynomial displacements of a square, and the flat punch's forces.

    The work is int P_a A^-1 P_b, shape (n^2, n^2), for the products P_a of the first n Legendre polynomials in x and in
    y. A is the influence of `cells` x `cells` uniform pressures. The forces of the flat punch are (cells, cells).
    """
    # Integrals of P_0(2 x) ... P_n-1(2 x) over each cell, by the recurrence of their antiderivatives
    powers = legendre.legvander(2.0 * graded_edges(cells), n).T
    antiderivatives = [powers[1]]
    for k in range(1, n):
        antiderivatives.append((powers[k + 1] - powers[k - 1]) / (2 * k + 1))
    along = 0.5 * np.diff(antiderivatives, axis=1)
    loads = np.einsum("ai,bj->ijab", along, along).reshape(cells**2, n * n)
    forces = lu_solve(_influence_factor(cells), loads)
    flat_force = forces[:, 0] * loads[:, 0]
    return loads.T @ forces, flat_force.reshape(cells, cells)


@functools.lru_cache(maxsize=2)
def _influence_factor(cells: int) -> tuple[Floats, Ints]:
    """Return the LU factors of the influence of uniform pressures on the cells of a square, cached for both grids.

    The cells at an edge are so small that round-off prevents a Cholesky factor of a fine grid.
    """
    edges = graded_edges(cells)
    matrix = influence(edges, edges).transpose(0, 2, 1, 3).reshape(cells**2, cells**2)
    factors, pivots = lu_factor(matrix)
    return factors, pivots


def influence(x: Floats, y: Floats) -> Floats:
    """Return int int 1 / (pi r) over all pairs of cells between edges, shape (cells x, cells x, cells y, cells y).

    r is the distance between a point of one cell and a point of the other; `x` and `y` are the edges [any length]. The
    double integral over two rectangles is the fourth difference, along all edges, of G with G,xxyy = 1 / r.
    """
    dx = np.abs(x[:, None] - x)[:, :, None, None]
    dy = np.abs(y[:, None] - y)[None, None]
    r = np.hypot(dx, dy)
    # If dx or dy is 0, its logarithm has the factor 0 in G.
    log_x = np.where(dx > 0.0, np.arcsinh(dy / np.where(dx > 0.0, dx, 1.0)), 0.0)
    log_y = np.where(dy > 0.0, np.arcsinh(dx / np.where(dy > 0.0, dy, 1.0)), 0.0)
    G = 0.5 * dx * dy * (dx * log_x + dy * log_y) - r**3 / 6.0
    for axis in range(4):
        G = np.diff(G, axis=axis)
    return np.asarray(G / np.pi)


def _gauss_points(weight: Floats, n: int) -> Floats:
    """Return the n Gauss points on (-1/2, 1/2) of a symmetric measure, given as weights of graded cells.

    They are the eigenvalues of its Jacobi matrix (Golub and Welsch), which the Lanczos recurrence constructs: each
    power of x is made orthogonal to the previous ones. The diagonal of a symmetric measure is 0.
    """
    edges = graded_edges(len(weight))
    points = 0.5 * (edges[1:] + edges[:-1])
    root = np.sqrt(weight)
    basis = [root / np.linalg.norm(root)]
    off_diagonal: list[float] = []
    for _ in range(n - 1):
        vector = points * basis[-1]
        for earlier in basis:
            vector = vector - (earlier @ vector) * earlier
        off_diagonal.append(float(np.linalg.norm(vector)))
        basis.append(vector / off_diagonal[-1])
    nodes = np.linalg.eigvalsh(np.diag(off_diagonal, 1) + np.diag(off_diagonal, -1))
    return 0.5 * (nodes - nodes[::-1])  # symmetric to the last bit
