"""Tetrahedra and triangles of second order, and neo-Hookean flesh at finite strain in them, in the tensor form."""

from collections.abc import Sequence

import numpy as np

from sensor.arrays import Floats, Ints

EDGES = ((0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3))  # of the nodes 4 to 9 of a tetrahedron of gmsh


def shapes(points: Floats, edges: Sequence[tuple[int, int]]) -> tuple[Floats, Floats]:
    """Return the functions of second order of a simplex and their slopes, (nodes, points) and (nodes, points, dim)."""
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
    """Return the forces at the nodes of neo-Hookean elements and their stiffness, (m, 30) and (m, 30, 30), E = 1.

    `u` (n, 3) are displacements, `solid` (10, m) the elements. At their points they have slopes of their functions
    `slope` (m, points, 10, 3) and volumes `weight` (m, points). Raises ArithmeticError where one is turned inside out.
    """
    mu = 0.5 / (1.0 + poisson)
    lam = poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    # indices: node n, element e, point q, component k, axis d
    F = np.eye(3) + np.einsum("nek,eqnd->eqkd", u[solid], slope)
    J = np.linalg.det(F)
    if J.min() <= 0.0:
        raise ArithmeticError(J.min())
    log = np.log(J)
    now = slope @ np.linalg.inv(F)  # slopes over the places where the flesh is now
    P = mu * slope @ F.swapaxes(-1, -2) + (lam * log - mu)[..., None, None] * now
    forces = np.einsum("eq,eqni->eni", weight, P).reshape(-1, 30)
    flat = now.reshape(*J.shape, 30)
    swelling = (flat * (lam * weight)[..., None]).swapaxes(1, 2) @ flat
    turning = (flat * ((mu - lam * log) * weight)[..., None]).swapaxes(1, 2) @ flat
    K = swelling.reshape(-1, 10, 3, 10, 3) + turning.reshape(-1, 10, 3, 10, 3).transpose(0, 1, 4, 3, 2)
    K[:, :, range(3), :, range(3)] += np.einsum("eq,eqnk,eqmk->enm", mu * weight, slope, slope)
    return forces, K.reshape(-1, 30, 30)
