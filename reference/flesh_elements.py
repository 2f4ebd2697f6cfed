"""Tetrahedra and triangles of second order, and neo-Hookean flesh at finite strain in tensor form."""

from collections.abc import Sequence

import numpy as np

from sensor.arrays import Floats, Ints

EDGES = ((0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3))  # ends of the edges with nodes 4 to 9 in gmsh's tetrahedron


def shapes(points: Floats, edges: Sequence[tuple[int, int]]) -> tuple[Floats, Floats]:
    """Return the quadratic shape functions of a simplex, (nodes, points), and their gradients, (nodes, points, dim).

    `points` (dim, points) are local coordinates; `edges` are the corners at the ends of the edges with midpoints.
    """
    dim, count = points.shape
    corners = np.concatenate([1.0 - points.sum(axis=0, keepdims=True), points])
    steep = np.concatenate([-np.ones((1, dim)), np.eye(dim)])[:, None] * np.ones((count, 1))
    values = [corner * (2.0 * corner - 1.0) for corner in corners]
    slopes = [(4.0 * corner - 1.0)[:, None] * slope for corner, slope in zip(corners, steep, strict=True)]
    for i, j in edges:
        values.append(4.0 * corners[i] * corners[j])
        slopes.append(4.0 * (corners[i][:, None] * steep[j] + corners[j][:, None] * steep[i]))
    return np.array(values), np.array(slopes)


def flesh(u: Floats, solid: Ints, slope: Floats, weight: Floats, poisson: float) -> tuple[Floats, Floats]:
    """Return nodal forces (m, 30) and tangent stiffness (m, 30, 30) of neo-Hookean elements with E = 1.

    `u` (n, 3) are displacements of nodes, and `solid` (10, m) the elements. `slope` (m, points, 10, 3) are gradients of
    shape functions and `weight` (m, points) volumes at quadrature points, both in the undeformed state. Raises
    ArithmeticError if an element is inverted.
    """
    mu = 0.5 / (1.0 + poisson)
    lam = poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    # indices: node n, element e, point q, component k, axis d
    F = np.eye(3) + np.einsum("nek,eqnd->eqkd", u[solid], slope)
    J = np.linalg.det(F)
    if J.min() <= 0.0:
        raise ArithmeticError(J.min())
    log = np.log(J)
    now = slope @ np.linalg.inv(F)  # gradients in the deformed state
    P = mu * slope @ F.swapaxes(-1, -2) + (lam * log - mu)[..., None, None] * now
    forces = np.einsum("eq,eqni->eni", weight, P).reshape(-1, 30)
    flat = now.reshape(*J.shape, 30)
    swelling = (flat * (lam * weight)[..., None]).swapaxes(1, 2) @ flat
    turning = (flat * ((mu - lam * log) * weight)[..., None]).swapaxes(1, 2) @ flat
    K = swelling.reshape(-1, 10, 3, 10, 3) + turning.reshape(-1, 10, 3, 10, 3).transpose(0, 1, 4, 3, 2)
    K[:, :, range(3), :, range(3)] += np.einsum("eq,eqnk,eqmk->enm", mu * weight, slope, slope)
    return forces, K.reshape(-1, 30, 30)
