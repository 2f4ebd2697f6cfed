"""Rigid frictionless flat punches on a half-space: nodal forces for a given displacement under the punch.

A punch table is for a footprint of unit size and E* = E / (1 - nu^2) = 1. It does not depend on E or nu. It has the
symmetric matrix Y in F = Y U, where U are nodal displacements and F nodal forces. The displacement under the punch is
the polynomial through the nodal values U. The nodal forces are the moments F_k = int p l_k of the pressure p with the
nodal polynomials l_k. The nodes are the Gauss points of the pressure under a flat punch. So three nodes per side
represent its moments exactly up to the fifth order.
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
GRADING = 4.0  # exponent of the grading of cells towards the edges of the square
ORDER = 3.0  # order of convergence in the number of cells, for a pressure that is singular along the edges
ROUND_OFF = 1e-12  # relative error of a table that is exact except for rounding


@dataclass(frozen=True)
class Punch:
    """A punch table: the matrix Y, `stiffness` (n, n) [E* side], with its relative error, and the nodes.

    `x` and `y` are the coordinates of the nodes along each axis [side].
    """

    stiffness: Floats
    error: float
    x: Floats
    y: Floats

    @property
    def nodes(self) -> Floats:
        """Return the positions of the nodes [side], shape (n, 2)."""
        return np.stack(np.meshgrid(self.x, self.y, indexing="ij"), axis=-1).reshape(-1, 2)

    def interpolate(self, points: Floats) -> Floats:
        """Return the nodal polynomials at points (m, 2) [side], shape (m, n)."""
        return _products(lagrange(self.x, points[:, 0]), lagrange(self.y, points[:, 1]))

    @property
    def flat_stiffness(self) -> float:
        """Return F / (E* d side) [1] for a flat punch that indents by d under the force F without tilt."""
        return float(self.stiffness.sum())


def _products(along_x: NDArray[Any], along_y: NDArray[Any]) -> Floats:
    """Return the products of each function of x with each function of y, both (points, n), shape (points, n^2)."""
    return np.asarray(along_x[:, :, None] * along_y[:, None, :]).reshape(len(along_x), -1)


def lagrange(nodes: Floats, x: Floats) -> Floats:
    """Return the Lagrange polynomials of nodes (n,) between -1/2 and 1/2 at coordinates x (m,), shape (m, n).

    Each polynomial is 1 at its own node and 0 at the others. Legendre polynomials are the basis of the computation,
    because powers of x would be ill-conditioned.
    """
    degree = len(nodes) - 1
    values = np.linalg.solve(legendre.legvander(2.0 * nodes, degree).T, legendre.legvander(2.0 * x, degree).T)
    return np.asarray(values.T, dtype=np.float64)


# A scene uses three tables, with 1 to 25 nodes per side, hundreds of times; each takes 0.1 s to compute.
@functools.lru_cache(maxsize=16)
def square_punch(nodes_per_side: int) -> Punch:
    """Return the punch table of a square of side 1, by Galerkin boundary elements that are graded to its edges.

    Pressure is constant in each cell. The results of two grids are extrapolated with order 3, and a tenth of the
    extrapolation is the error estimate. The exact F / (E* d) is 1.15230, which follows from the capacity 0.36679 pi of
    an electrified square plate (Read 1997).
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

    The harmonics P_l^m(sqrt(1 - r^2)) cos m phi with even l - m are eigenfunctions of the unit disc. The pressure for
    such a displacement is proportional to the displacement divided by sqrt(1 - r^2). The eigenvalues are from
    J. Boersma and E. Danicki, SIAM J. Appl. Math. 53 (1993) 925.
    """
    n = nodes_per_side
    # Integrals with the weight 1 / sqrt(1 - r^2) over the disc are integrals over the half-sphere above it, where the
    # integrands are smooth. The quadrature has Gauss points in height and equal steps of the angle.
    height, weight = legendre.leggauss(2 * n)
    radius = np.sqrt(1.0 - 0.25 * (height + 1.0) ** 2)
    angle = np.pi / (2 * n) * np.arange(4 * n)
    x = np.outer(radius, np.cos(angle)).ravel()
    y = np.outer(radius, np.sin(angle)).ravel()
    weights = np.repeat(0.5 * np.pi / (2 * n) * weight, 4 * n)
    polynomials = _products(legendre.legvander(x, n - 1), legendre.legvander(y, n - 1))

    # A polynomial displacement is the sum of its projections on the harmonics. Each projection adds the work of its
    # pressure: the outer product of the moments, over eigenvalue times norm.
    work = np.zeros((n * n, n * n))
    for eigenvalue, harmonic in _disc_harmonics(x, y, 2 * n - 1):
        moments = polynomials.T @ (weights * harmonic)
        work += np.outer(moments, moments) / eigenvalue / (weights @ harmonic**2)
    # The nodes lie on a square grid, as for a square, and some of them outside the disc. The factor is from the
    # displacement 1 / (pi r) under a unit force, and from scaling the disc of radius 1 to diameter 1.
    line = 0.5 * legendre.leggauss(n)[0]
    return Punch(_nodal_stiffness(0.5 * np.pi * work, line, line), ROUND_OFF, line, line)


def _disc_harmonics(x: Floats, y: Floats, degrees: int) -> Iterator[tuple[float, Floats]]:
    """Yield the eigenvalue and the values at points x, y (n,) of each harmonic of the unit disc below degree `degrees`.

    See `circle_punch`.
    """
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
    """Convert `moments`, the work between products of Legendre polynomials, to the matrix Y of nodal forces.

    Both matrices are (n^2, n^2). `along_x` and `along_y` (n,) are the nodes, between -1/2 and 1/2.
    """
    degree = len(along_x) - 1
    values = np.kron(legendre.legvander(2.0 * along_x, degree), legendre.legvander(2.0 * along_y, degree))
    inverse = np.linalg.inv(values)
    stiffness = inverse.T @ moments @ inverse
    return 0.5 * (stiffness + stiffness.T)


def graded_edges(cells: int, grading: float = GRADING) -> Floats:
    """Return the boundaries (cells + 1,) of cells from -1/2 to 1/2, which are small at both ends.

    The size of a cell is proportional to its distance from the nearer end to the power 1 - 1 / grading.
    """
    line = np.linspace(-1.0, 1.0, cells + 1)
    t = 0.5 * (line - line[::-1])  # symmetric to the last bit, so that mirrored scenes have mirrored matrices
    return 0.5 * np.sign(t) * (1.0 - (1.0 - np.abs(t)) ** grading)


def _square_moments(cells: int, n: int) -> tuple[Floats, Floats]:
    """Return the work between polynomial displacements of a square, and the cell forces of a flat punch.

    The work int P_a A^-1 P_b has shape (n^2, n^2). The P_a are the products of the first n Legendre polynomials in x
    and in y. A is the displacement due to uniform pressures on `cells` x `cells` cells. The forces are (cells, cells).
    """
    # The integrals of P_0(2 x) to P_n-1(2 x) over each cell, by the recurrence of their antiderivatives.
    polynomials = legendre.legvander(2.0 * graded_edges(cells), n).T
    antiderivatives = [polynomials[1]]
    for k in range(1, n):
        antiderivatives.append((polynomials[k + 1] - polynomials[k - 1]) / (2 * k + 1))
    integrals = 0.5 * np.diff(antiderivatives, axis=1)
    displacements = np.einsum("ai,bj->ijab", integrals, integrals).reshape(cells**2, n * n)
    pressures = lu_solve(_influence_factor(cells), displacements)
    flat_force = pressures[:, 0] * displacements[:, 0]  # the first displacement is 1 everywhere
    return displacements.T @ pressures, flat_force.reshape(cells, cells)


@functools.lru_cache(maxsize=2)
def _influence_factor(cells: int) -> tuple[Floats, Ints]:
    """Return the LU factors of `influence` between the cells of a square, cached for both grids.

    The cells at an edge are so small that, on a fine grid, round-off prevents a Cholesky factorisation.
    """
    edges = graded_edges(cells)
    matrix = influence(edges, edges).transpose(0, 2, 1, 3).reshape(cells**2, cells**2)
    factors, pivots = lu_factor(matrix)
    return factors, pivots


def influence(x: Floats, y: Floats) -> Floats:
    """Return the influence int int 1 / (pi r) between all pairs of cells, shape (n_x, n_x, n_y, n_y).

    r is the distance between a point of one cell and a point of the other. The n_x times n_y cells lie between the
    coordinates `x` and `y` [any length]. The double integral over two rectangles is the fourth difference of a function
    G with G,xxyy = 1 / r.
    """
    dx = np.abs(x[:, None] - x)[:, :, None, None]
    dy = np.abs(y[:, None] - y)[None, None]
    r = np.hypot(dx, dy)
    # Where dx or dy is 0, its logarithm has the factor 0 in G, and may have any finite value.
    log_x = np.where(dx > 0.0, np.arcsinh(dy / np.where(dx > 0.0, dx, 1.0)), 0.0)
    log_y = np.where(dy > 0.0, np.arcsinh(dx / np.where(dy > 0.0, dy, 1.0)), 0.0)
    G = 0.5 * dx * dy * (dx * log_x + dy * log_y) - r**3 / 6.0
    for axis in range(4):  # between the two edges of each cell of a pair, in x and in y
        G = np.diff(G, axis=axis)
    return np.asarray(G / np.pi)


def _gauss_points(weight: Floats, n: int) -> Floats:
    """Return the n Gauss points, between -1/2 and 1/2, of a symmetric measure that is given as weights of graded cells.

    They are the eigenvalues of the measure's Jacobi matrix (Golub and Welsch). The Lanczos recurrence constructs this
    matrix, by making each power of x orthogonal to the previous ones. Its diagonal is 0 because of the symmetry.
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
