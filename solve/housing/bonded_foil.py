"""Thin foils bonded to the leaves: what they add to the stiffness matrix, and the mean strain under their grids.

A foil is a membrane in plane stress on a level face; its own distance from the face is left out. Facets there are
rectangles along x and y, so a foil that ends inside an element is integrated over its exact part of the facet.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix
from skfem import CellBasis

from mesh.cell_facets import ReferenceFacet
from mesh.cells import cell_places
from solve.arrays import Floats
from solve.elasticity import scattered
from solve.linear import SolveError
from solve.surface import SurfacePatch, patch_inside, surface_facets

Rectangle = tuple[tuple[float, float], tuple[float, float]]  # ends in x and in y [mm]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)  # strain is quadratic along a facet at most
_NEAR = 1e-6  # [mm]


@dataclass(frozen=True, kw_only=True)
class BondedFoil:
    """A layer on the level z of the surface `name` [mm]: its rectangle, its E t [N/mm], its Poisson's ratio.

    One with a grid senses the force on the tip of its index; `sign` is that of its arm of the bridge.
    """

    name: str
    z: float
    place: Rectangle
    stiffness: float
    poisson: float
    tip: int
    sign: float
    grid: Rectangle | None = None


def membrane_matrix(basis: CellBasis, foils: Sequence[BondedFoil]) -> csc_matrix:
    """Return what the foils add to the stiffness matrix [N/mm], shape (dofs, dofs); raises SolveError."""
    total = csc_matrix((basis.N, basis.N))
    for foil in foils:
        nu = foil.poisson
        D = foil.stiffness / (1.0 - nu**2) * np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - nu)]])
        for patch in _patches(basis, foil, foil.place):
            total = total + _membrane(patch, D, basis.N)
    return total


def _membrane(patch: SurfacePatch, D: Floats, size: int) -> csc_matrix:
    """Return int B^T D B over a patch, D (3, 3) [N/mm] on the strains xx, yy and 2 xy."""
    x, y = patch.gradients[:, 0], patch.gradients[:, 1]  # (nodes, facets, points)
    zero = np.zeros_like(x)
    B = np.array([[x, zero], [zero, y], [y, x]])  # (strains, components, nodes, facets, points)
    blocks = np.einsum("sanep,st,tbmep,ep->enamb", B, D, B, patch.weights, optimize=True)
    dofs = patch.dofs[:, :2].transpose(2, 0, 1).reshape(len(blocks), -1)
    return scattered(blocks, dofs, size)


def bridge_strains(basis: CellBasis, foils: Sequence[BondedFoil], u: Floats) -> tuple[float, ...]:
    """Return the mean strain along x under the grids of each tip's bridge for its own load [1], u (dofs, tips)."""
    arms: list[list[float]] = [[] for _ in range(u.shape[1])]
    for foil in foils:
        if foil.grid is not None:
            arms[foil.tip].append(foil.sign * _mean_strain(_patches(basis, foil, foil.grid), u[:, foil.tip]))
    return tuple(abs(float(np.mean(strains))) for strains in arms)


def _mean_strain(patches: Sequence[SurfacePatch], u: Floats) -> float:
    strains = [np.einsum("nep,ne->ep", patch.gradients[:, 0], u[patch.dofs[:, 0]]) for patch in patches]
    total = sum(float((strain * patch.weights).sum()) for strain, patch in zip(strains, patches, strict=True))
    return total / sum(float(patch.weights.sum()) for patch in patches)


def _patches(basis: CellBasis, foil: BondedFoil, rectangle: Rectangle) -> list[SurfacePatch]:
    """Return the parts of the half y >= 0 of a rectangle; raises SolveError where the mesh does not carry all of it."""
    (x0, x1), (y0, y1) = (sorted(ends) for ends in rectangle)
    window = np.array([[x0, x1], [max(y0, 0.0), y1]])
    facets = surface_facets(basis, foil.name)
    patches = [patch for facet in facets for patch in _clipped(basis, facet, foil.z, window)]
    area, wanted = sum(float(patch.weights.sum()) for patch in patches), float(np.prod(window[:, 1] - window[:, 0]))
    if not abs(area - wanted) <= 1e-6 * wanted:
        msg = (
            f"bonded foil on {foil.name!r}: the mesh carries {area:.6g} mm^2 of it: must be {wanted:.6g} mm^2; "
            "place it on the straight part of a leaf"
        )
        raise SolveError(msg)
    return patches


def _clipped(basis: CellBasis, facet: ReferenceFacet, z: float, window: Floats) -> Iterator[SurfacePatch]:
    """Yield the parts of some facets inside a window (x and y, ends) on the level z [mm]."""
    ends = np.array([facet.corner, facet.corner + facet.along, facet.corner + facet.across]).T
    at = cell_places(basis.mesh, ends, facet.elements)  # (3, facets, ends)
    level = np.abs(at[2] - z).max(axis=1) < _NEAR
    corner, along, across = at[:2, level].transpose(2, 0, 1)
    first, length = _gauss_shares(corner, along - corner, window)
    second, width = _gauss_shares(corner, across - corner, window)
    inside = length * width > 0.0
    if not inside.any():
        return
    weights = 0.25 * np.outer((length * width)[inside], np.outer(_WEIGHTS, _WEIGHTS))
    points = _points(facet, first[inside], second[inside])
    yield patch_inside(basis, facet.elements[level][inside], points, weights)


def _points(facet: ReferenceFacet, first: Floats, second: Floats) -> Floats:
    """Return all pairs of shares (facets, 3) of both edges as points of the unit cube [1], shape (3, facets, 9)."""
    along = np.multiply.outer(facet.along, np.repeat(first, len(_NODES), axis=1))
    across = np.multiply.outer(facet.across, np.tile(second, len(_NODES)))
    return np.asarray(facet.corner[:, None, None] + along + across)


def _gauss_shares(corner: Floats, edge: Floats, window: Floats) -> tuple[Floats, Floats]:
    """Return the shares of edges (x and y, facets) at the Gauss points inside a window, and their lengths inside it."""
    along = np.argmax(np.abs(edge), axis=0)[None]
    if (np.abs(np.take_along_axis(edge, 1 - along, axis=0)) > _NEAR).any():
        msg = "bonded foil: a facet below it is no rectangle along x and y; make a fresh mesh"
        raise SolveError(msg)
    start, long = (np.take_along_axis(place, along, axis=0)[0] for place in (corner, edge))
    shares = np.sort(np.clip((window[along[0]] - start[:, None]) / long[:, None], 0.0, 1.0), axis=1)
    first, reach = shares[:, :1], np.diff(shares, axis=1)
    return first + 0.5 * reach * (1.0 + _NODES), reach[:, 0] * np.abs(long)
