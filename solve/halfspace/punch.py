"""Rigid frictionless flat punches on a half-space: nodal forces for a given displacement under the punch.

A punch table holds the symmetric matrix Y in F = Y U, where U are nodal displacements and F nodal forces. It applies to
a footprint of unit size and E* = E / (1 - nu^2) = 1, so it does not depend on E or nu. The displacement under the punch
is the polynomial through the nodal values U. The nodal forces are the moments F_k = int p l_k of the pressure p with
the nodal polynomials l_k.

The nodes are the Gauss points of the pressure under a flat punch. Three nodes per side therefore represent its moments
exactly up to the fifth order.
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

CELLS = (16, 32)  # boundary elements per side of the coarse grid and of the fine grid
GRADING = 4.0  # exponent with which the cells become smaller towards the edges of the square
ORDER = 3.0  # order of convergence in the number of cells, for a pressure that is singular along the edges
ROUND_OFF = 1e-12  # relative error of a table that is exact except for rounding


@dataclass(frozen=True)
class Punch:
    """A punch table: the matrix Y, called `stiffness` (n, n) [E* side], and its relative `error` [1].

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
        """Return F / (E* d side) [1] for a flat punch without tilt, where d is its indentation under the force F."""
        return float(self.stiffness.sum())


def _products(along_x: NDArray[Any], along_y: NDArray[Any]) -> Floats:
    """Return the products of each function of x with each function of y, shape (points, n^2); both are (points, n)."""
    return np.asarray(along_x[:, :, None] * along_y[:, None, :]).reshape(len(along_x), -1)


def lagrange(nodes: Floats, x: Floats) -> Floats:
    """Return the Lagrange polynomials of nodes (n,) between -1/2 and 1/2, at coordinates x (m,), shape (m, n).

    Each polynomial is 1 at its own node and 0 at the others. They are computed in the basis of Legendre polynomials,
    because powers of x would be ill-conditioned.
    """
    degree = len(nodes) - 1
    values = np.linalg.solve(legendre.legvander(2.0 * nodes, degree).T, legendre.legvander(2.0 * x, degree).T)
    return np.asarray(values.T, dtype=np.float64)


# Cached, because a scene uses three tables hundreds of times, with 1 to 25 nodes per side. Each takes 0.1 s.
@functools.lru_cache(maxsize=16)
def square_punch(nodes_per_side: int) -> Punch:
    """Return the punch table of a square of side 1, by Galerkin boundary elements graded towards its edges.

    The table has `nodes_per_side`^2 nodes. The pressure is constant in each cell. The results of two grids are
    extrapolated with convergence order 3. The relative error is a tenth of the extrapolation step of the force under a
    flat punch. The exact F / (E* d) is 1.15230: pi times 0.36679, the capacitance of a square plate of side 1 in units
    of 4 pi epsilon_0 (Read 1997).
    """
    coarse_work, _ = _square_mutual_work(CELLS[0], nodes_per_side)
    fine_work, flat_forces = _square_mutual_work(CELLS[1], nodes_per_side)
    step = (fine_work - coarse_work) / ((CELLS[1] / CELLS[0]) ** ORDER - 1.0)  # from the fine grid to the limit
    # The nodes are the Gauss points for the pressure of the flat punch.
    along_x = _gauss_points(flat_forces.sum(axis=1), nodes_per_side)
    along_y = _gauss_points(flat_forces.sum(axis=0), nodes_per_side)
    # The first polynomial is a uniform displacement of 1, so entry [0, 0] is the force of a flat punch.
    error = 0.1 * abs(step[0, 0] / fine_work[0, 0])
    return Punch(stiffness=_nodal_stiffness(fine_work + step, along_x, along_y), error=error, x=along_x, y=along_y)


@functools.lru_cache(maxsize=16)
def circle_punch(nodes_per_side: int) -> Punch:
    """Return the punch table of a circle of diameter 1 with `nodes_per_side`^2 nodes, exact to rounding.

    The harmonics P_l^m(sqrt(1 - r^2)) cos m phi with even l - m are eigenfunctions of the unit disc. The pressure for
    such a displacement is proportional to the displacement divided by sqrt(1 - r^2). The eigenvalues are from
    J. Boersma and E. Danicki, SIAM J. Appl. Math. 53 (1993) 925.
    """
    n = nodes_per_side
    x, y, weights = _disc_quadrature(n)
    polynomials = _products(legendre.legvander(x, n - 1), legendre.legvander(y, n - 1))  # (points, n^2)

    # A polynomial displacement is the sum of its projections onto the harmonics. Each projection contributes the work
    # of its pressure: the outer product of the moments, divided by the eigenvalue and the squared norm. The products of
    # polynomials have degrees up to 2 n - 2, so no further harmonics contribute.
    degree_count = 2 * n - 1
    work = np.zeros((n * n, n * n))
    for eigenvalue, harmonic in _disc_harmonics(x, y, degree_count):
        moments = polynomials.T @ (weights * harmonic)
        work += np.outer(moments, moments) / eigenvalue / (weights @ harmonic**2)
    # The nodes lie on a square grid, as for a square punch, so some are outside the disc. The factor 0.5 pi comes from
    # the displacement 1 / (pi r) under a unit force, and from scaling the disc of radius 1 to diameter 1.
    gauss_points, _ = legendre.leggauss(n)
    node_coordinates = 0.5 * gauss_points
    stiffness = _nodal_stiffness(0.5 * np.pi * work, node_coordinates, node_coordinates)
    return Punch(stiffness=stiffness, error=ROUND_OFF, x=node_coordinates, y=node_coordinates)


def _disc_quadrature(n: int) -> tuple[Floats, Floats, Floats]:
    """Return the points x, y and the weights of a quadrature on the unit disc with the weight 1 / sqrt(1 - r^2).

    The arrays have shape (8 n^2,). Integrals with this weight are integrals over the hemisphere above the disc, where
    the integrands are smooth. The quadrature has 2 n Gauss points along the height and 4 n equal steps of the angle.
    The quadrature is exact for a product of a polynomial and a harmonic in a table with n nodes per side.
    """
    point, weight = legendre.leggauss(2 * n)
    # The Gauss points lie between -1 and 1, so the height is (point + 1) / 2, and r^2 = 1 - height^2.
    radius = np.sqrt(1.0 - 0.25 * (point + 1.0) ** 2)
    angle = np.pi / (2 * n) * np.arange(4 * n)
    x = np.outer(radius, np.cos(angle)).ravel()
    y = np.outer(radius, np.sin(angle)).ravel()
    # d(height) is d(point) / 2, and each step of the angle is pi / (2 n).
    weights = np.repeat(0.5 * np.pi / (2 * n) * weight, 4 * n)
    return x, y, weights


def _disc_harmonics(x: Floats, y: Floats, degree_count: int) -> Iterator[tuple[float, Floats]]:
    """Yield each harmonic of the unit disc: its eigenvalue [1], and its values at points x, y (n,) of the disc.

    The harmonics P_l^m(sqrt(1 - r^2)) cos m phi and sin m phi have degrees l below `degree_count` and even l - m. The
    pressure harmonic / sqrt(1 - r^2) displaces the disc by the eigenvalue times the harmonic, where the displacement is
    the integral of pressure / distance. With the gamma function G, the eigenvalue is

        pi G((l + m + 1) / 2) G((l - m + 1) / 2) / (G((l + m + 2) / 2) G((l - m + 2) / 2)).
    """
    cosine = np.sqrt(1.0 - (x**2 + y**2))
    phi = np.arctan2(y, x)
    for degree in range(degree_count):
        for order in range(degree % 2, degree + 1, 2):  # degree - order is even
            eigenvalue = np.pi * gamma((degree + order + 1) / 2) * gamma((degree - order + 1) / 2)
            eigenvalue /= gamma((degree + order + 2) / 2) * gamma((degree - order + 2) / 2)
            radial = lpmv(order, degree, cosine)
            yield eigenvalue, radial * np.cos(order * phi)
            if order > 0:  # for m = 0 the sine is 0 everywhere
                yield eigenvalue, radial * np.sin(order * phi)


def _nodal_stiffness(mutual_work: Floats, along_x: Floats, along_y: Floats) -> Floats:
    """Return the matrix Y (n^2, n^2) that maps nodal displacements to nodal forces.

    `mutual_work` W (n^2, n^2) is the work of the products of Legendre polynomials on one another. `along_x` and
    `along_y` (n,) are the coordinates of the nodes, between -1/2 and 1/2. If the columns of V are the products at the
    nodes, Y = V^-T W V^-1.
    """
    degree = len(along_x) - 1
    values = np.kron(legendre.legvander(2.0 * along_x, degree), legendre.legvander(2.0 * along_y, degree))
    inverse = np.linalg.inv(values)
    stiffness = inverse.T @ mutual_work @ inverse
    return 0.5 * (stiffness + stiffness.T)  # removes the asymmetry due to round-off


def graded_edges(cells: int, grading: float = GRADING) -> Floats:
    """Return the boundaries (cells + 1,) of cells from -1/2 to 1/2, which are smaller towards both ends.

    The size of a cell is proportional to the power 1 - 1 / grading of its distance from the nearer end.
    """
    line = np.linspace(-1.0, 1.0, cells + 1)
    t = 0.5 * (line - line[::-1])  # symmetric to the last bit, so that mirrored scenes have mirrored matrices
    return 0.5 * np.sign(t) * (1.0 - (1.0 - np.abs(t)) ** grading)


def _square_mutual_work(cells: int, n: int) -> tuple[Floats, Floats]:
    """Return the mutual work of polynomial displacements of a square, and the cell forces under a flat punch.

    The displacements P_a are the products of the first n Legendre polynomials in x with the first n in y. Let A map
    uniform pressures on `cells` x `cells` cells to displacements. The mutual work, shape (n^2, n^2), is

        W_ab = int P_a A^-1 P_b.

    It is the work that the pressure of displacement P_b does on displacement P_a. The forces have the shape
    (cells, cells). The side of the square and E* are 1.
    """
    integrals = _legendre_integrals(graded_edges(cells), n)
    displacement_integrals = np.einsum("ai,bj->ijab", integrals, integrals).reshape(cells**2, n * n)
    pressures = lu_solve(_influence_factor(cells), displacement_integrals)
    # The first displacement is 1 everywhere, so its integrals are the areas of the cells.
    flat_force = pressures[:, 0] * displacement_integrals[:, 0]
    return displacement_integrals.T @ pressures, flat_force.reshape(cells, cells)


def _legendre_integrals(edges: Floats, n: int) -> Floats:
    """Return the integrals of the Legendre polynomials P_0(2 x) to P_n-1(2 x) over each cell, shape (n, cells).

    `edges` (cells + 1,) are the boundaries of the cells, from -1/2 to 1/2. The antiderivative of P_k is
    (P_k+1 - P_k-1) / (2 k + 1), and the antiderivative of P_0 is P_1.
    """
    polynomials = legendre.legvander(2.0 * edges, n).T
    antiderivatives = [polynomials[1]]
    for k in range(1, n):
        antiderivatives.append((polynomials[k + 1] - polynomials[k - 1]) / (2 * k + 1))
    return np.asarray(0.5 * np.diff(antiderivatives, axis=1))  # the factor 0.5 is dx / d(2 x)


@functools.lru_cache(maxsize=2)
def _influence_factor(cells: int) -> tuple[Floats, Ints]:
    """Return the LU factors of the matrix `influence` between the cells of a square, cached for the two grids.

    On a fine grid, the cells at the edges are so small that round-off prevents a Cholesky factorisation.
    """
    edges = graded_edges(cells)
    matrix = influence(edges, edges).transpose(0, 2, 1, 3).reshape(cells**2, cells**2)
    factors, pivots = lu_factor(matrix)
    return factors, pivots


def influence(x: Floats, y: Floats) -> Floats:
    """Return the influence int int 1 / (pi r) between all pairs of cells, shape (n_x, n_x, n_y, n_y).

    For E* = 1, it is the integral of the displacement over one cell under a unit pressure on the other. r is the
    distance between a point of one cell and a point of the other. `x` (n_x + 1,) and `y` (n_y + 1,) are the boundaries
    of the cells, in any unit of length. The double integral over two rectangles is the fourth difference of a function
    with G,xxyy = 1 / r. It is G = x y (x arsinh(y / x) + y arsinh(x / y)) / 2 - r^3 / 6.
    """
    dx = np.abs(x[:, None] - x)[:, :, None, None]
    dy = np.abs(y[:, None] - y)[None, None]
    r = np.hypot(dx, dy)
    # If dx or dy is 0, G multiplies its logarithm by 0, so the logarithm may have any finite value.
    log_x = np.where(dx > 0.0, np.arcsinh(dy / np.where(dx > 0.0, dx, 1.0)), 0.0)
    log_y = np.where(dy > 0.0, np.arcsinh(dx / np.where(dy > 0.0, dy, 1.0)), 0.0)
    G = 0.5 * dx * dy * (dx * log_x + dy * log_y) - r**3 / 6.0
    for axis in range(4):  # difference between the two edges of each cell in the pair, along x and along y
        G = np.diff(G, axis=axis)
    return np.asarray(G / np.pi)


def _gauss_points(weight: Floats, n: int) -> Floats:
    """Return the n Gauss points between -1/2 and 1/2 of a symmetric measure, given by the weights of graded cells.

    `weight` (cells,) is the measure of each cell between `graded_edges`, concentrated at the middle of the cell. The
    points are the eigenvalues of the measure's Jacobi matrix (Golub and Welsch). The Lanczos recurrence constructs this
    matrix by making each power of x orthogonal to the previous ones. The diagonal is 0 because the measure is
    symmetric.
    """
    edges = graded_edges(len(weight))
    points = 0.5 * (edges[1:] + edges[:-1])
    # The vectors are values of polynomials times the square root of the weight, so that their products are integrals.
    root_weight = np.sqrt(weight)
    basis = [root_weight / np.linalg.norm(root_weight)]
    off_diagonal: list[float] = []
    for _ in range(n - 1):
        vector = points * basis[-1]
        for earlier in basis:
            vector = vector - (earlier @ vector) * earlier
        off_diagonal.append(float(np.linalg.norm(vector)))
        basis.append(vector / off_diagonal[-1])
    nodes = np.linalg.eigvalsh(np.diag(off_diagonal, 1) + np.diag(off_diagonal, -1))
    return 0.5 * (nodes - nodes[::-1])  # symmetric to the last bit
