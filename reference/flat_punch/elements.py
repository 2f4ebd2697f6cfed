"""Shape functions, weights and pressure functions of quadratic elements in a body of revolution.

All elements are rectangles: one table of shape functions serves them all, scaled by each one's width and height.
Arrays have the elements last, so that a sum over shape functions is one matrix product for the whole body.
"""

from dataclasses import dataclass

import numpy as np

from reference.flat_punch.grid import Grid
from sensor.arrays import Floats
from solve.compression.quadratic import quadratic, quadratic_slope, tensor_product

POINTS = 3  # Gauss points along each direction
DOFS = 18  # of an element
# Parts of F whose second derivatives of an isotropic energy are not zero; the hoop couples with no other part.
PAIRS = (*((i, j) for i in range(4) for j in range(i, 4)), (4, 4))
ROWS, COLUMNS = np.tril_indices(DOFS)  # of the entries of an element's matrix that are kept


@dataclass(frozen=True, kw_only=True, eq=False)
class Elements:
    """What the energy needs of every element at its Gauss points.

    `gradient` (5, points, 18) turns displacements into F less its value at rest, up to `scale` (5, points, elements) [1
    / tip side]. `squares` (entries, pairs times points) turns second derivatives by pairs of parts of F into the
    entries of a matrix below and on its diagonal. `weights` (points, elements) are volumes [tip sides^3], `pressures`
    (functions, points, elements) are orthonormal in them.
    """

    gradient: Floats
    scale: Floats
    squares: Floats
    weights: Floats
    pressures: Floats


def quadratic_elements(grid: Grid) -> Elements:
    """Return the elements of a grid."""
    points, gauss = np.polynomial.legendre.leggauss(POINTS)
    x = np.repeat(points, POINTS)
    y = np.tile(points, POINTS)

    rows = len(grid.z) - 1
    columns = len(grid.r) - 1
    width = np.repeat(np.diff(grid.r), rows)
    height = np.tile(np.diff(grid.z), columns)  # negative: z falls
    r = np.repeat(grid.r[:-1], rows) + np.outer(0.5 * (1.0 + x), width)
    weights = 0.5 * np.pi * r * np.outer(np.outer(gauss, gauss), np.abs(width * height))  # 2 pi r dr dz
    by_r = np.broadcast_to(2.0 / width, r.shape)
    by_z = np.broadcast_to(2.0 / height, r.shape)

    parts = np.zeros((5, len(x), 9, 2))  # the last index is the component, radial or up
    d_dx = tensor_product(quadratic_slope(x), quadratic(y))
    d_dy = tensor_product(quadratic(x), quadratic_slope(y))
    parts[0, :, :, 0] = d_dx
    parts[1, :, :, 0] = d_dy
    parts[2, :, :, 1] = d_dx
    parts[3, :, :, 1] = d_dy
    parts[4, :, :, 0] = tensor_product(quadratic(x), quadratic(y))
    gradient = parts.reshape(5, len(x), DOFS)

    squares = []
    for i, j in PAIRS:
        product = gradient[i][:, ROWS] * gradient[j][:, COLUMNS]
        if i != j:
            product = product + gradient[j][:, ROWS] * gradient[i][:, COLUMNS]
        squares.append(product)

    # 1, x and y in each element, made orthonormal by the weights
    linear = np.stack([np.ones_like(x), x, y])
    mass = np.einsum("kq,qe,lq->ekl", linear, weights, linear)
    orthonormal = np.linalg.solve(np.linalg.cholesky(mass), linear[None])
    return Elements(
        gradient=gradient,
        scale=np.stack([by_r, by_z, by_r, by_z, 1.0 / r]),
        squares=np.ascontiguousarray(np.concatenate(squares).T),
        weights=weights,
        pressures=np.ascontiguousarray(orthonormal.transpose(1, 2, 0)),
    )
