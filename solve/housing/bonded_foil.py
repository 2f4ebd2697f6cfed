"""Thin foils bonded to the leaves: what they add to the stiffness matrix, and the mean strain under their grids.

A foil is a membrane in plane stress on a level face; its own distance from the face is left out. Facets there are
rectangles along x and y, so a foil that ends inside an element is integrated over its exact part of the facet.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix
from skfem import CellBasis

from mesh.cells import ReferenceFacet, cell_points
from sensor.arrays import Floats
from solve.elasticity import assemble_elements
from solve.linear import SolveError
from solve.surface import SurfacePatch, patch_inside, surface_facets

Rectangle = tuple[tuple[float, float], tuple[float, float]]  # ends in x and in y [mm]

_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(3)  # on (-1, 1); strain is quadratic along a facet at most
_NEAR = 1e-6  # [mm]
_AREA_TOLERANCE = 1e-6  # relative: round-off of the parts of facets


@dataclass(frozen=True, kw_only=True)
class BondedFoil:
    """A layer on the level z of the surface `name` [mm]: its outline, its E t [N/mm], its Poisson's ratio.

    One with a grid senses the force on the tip of its index; `sign` is that of its arm of the bridge.
    """

    name: str
    z: float
    outline: Rectangle
    stiffness: float
    poisson: float
    tip: int
    sign: float
    grid: Rectangle | None = None


def membrane_matrix(basis: CellBasis, foils: Sequence[BondedFoil]) -> csc_matrix:
    """Return the stiffness matrix of the foils alone [N/mm], shape (dofs, dofs).

    Each adds int B^T D B over its outline, with D of plane stress and B the strains of its level in x and y. Raises
    SolveError where the mesh does not carry all of a foil.
    """
    total = csc_matrix((basis.N, basis.N))
    for foil in foils:
        nu = foil.poisson
        plane_stress = np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - nu)]])
        D = foil.stiffness / (1.0 - nu**2) * plane_stress  # on the strains xx, yy and 2 xy
        for patch in _patches(basis, foil, foil.outline):
            x = patch.gradients[:, 0]  # (nodes, facets, points)
            y = patch.gradients[:, 1]
            zero = np.zeros_like(x)
            B = np.array([[x, zero], [zero, y], [y, x]])  # (strains, components, nodes, facets, points)
            # indices: strains s and t, components a and b, nodes n and m, facet e, point p
            blocks = np.einsum("sanep,st,tbmep,ep->enamb", B, D, B, patch.weights, optimize=True)
            dofs = patch.dofs[:, :2].transpose(2, 0, 1).reshape(len(blocks), -1)
            total = total + assemble_elements(blocks.reshape(*dofs.shape, -1), dofs, basis.N)
    return total


def bridge_strains(basis: CellBasis, foils: Sequence[BondedFoil], u: Floats) -> tuple[float, ...]:
    """Return the mean strain along x that each tip's bridge senses for its own load [1].

    u (dofs, tips) [mm] are the displacements for a load on each tip. The strain of a grid counts with the sign of its
    arm, and the mean of the arms without a sign.
    """
    arms: list[list[float]] = [[] for _ in range(u.shape[1])]
    for foil in foils:
        if foil.grid is None:
            continue
        integral = 0.0
        area = 0.0
        for patch in _patches(basis, foil, foil.grid):
            strain = np.einsum("nep,ne->ep", patch.gradients[:, 0], u[patch.dofs[:, 0], foil.tip])
            integral += float((strain * patch.weights).sum())
            area += float(patch.weights.sum())
        arms[foil.tip].append(foil.sign * (integral / area))
    return tuple(abs(float(np.mean(strains))) for strains in arms)


def _patches(basis: CellBasis, foil: BondedFoil, rectangle: Rectangle) -> list[SurfacePatch]:
    """Return the parts of the half y >= 0 of a rectangle; raises SolveError where the mesh does not carry all of it."""
    window = np.sort(np.array(rectangle), axis=1)  # ends in x and in y
    window[1, 0] = max(window[1, 0], 0.0)
    patches = []
    for facet in surface_facets(basis, foil.name):
        patch = _clipped(basis, facet, foil.z, window)
        if patch is not None:
            patches.append(patch)
    area = sum(float(patch.weights.sum()) for patch in patches)
    wanted = float(np.prod(window[:, 1] - window[:, 0]))
    if not abs(area - wanted) <= _AREA_TOLERANCE * wanted:
        msg = (
            f"bonded foil on {foil.name!r}: the mesh carries {area:.6g} mm^2 of it: must be {wanted:.6g} mm^2; "
            "place it on the straight part of a leaf"
        )
        raise SolveError(msg)
    return patches


def _clipped(basis: CellBasis, facet: ReferenceFacet, z: float, window: Floats) -> SurfacePatch | None:
    """Return the quadrature of the parts of facets inside a window (x and y, ends) [mm], None where there is none.

    Only facets on the level z [mm] count.
    """
    corners = np.array([facet.corner, facet.corner + facet.along, facet.corner + facet.across]).T
    positions = cell_points(basis.mesh, corners, facet.elements)  # (3, facets, corners)
    on_level = np.abs(positions[2] - z).max(axis=1) < _NEAR
    corner, along_end, across_end = positions[:2, on_level].transpose(2, 0, 1)
    along_points, length = _gauss_fractions(corner, along_end - corner, window)
    across_points, width = _gauss_fractions(corner, across_end - corner, window)
    inside = length * width > 0.0
    if not inside.any():
        return None

    # All pairs of Gauss points along both edges, as points of the unit cube (3, facets, 9).
    count = len(_GAUSS)
    in_along = np.multiply.outer(facet.along, np.repeat(along_points[inside], count, axis=1))
    in_across = np.multiply.outer(facet.across, np.tile(across_points[inside], count))
    points = facet.corner[:, None, None] + in_along + in_across
    area = (length * width)[inside]
    weights = 0.25 * np.outer(area, np.outer(_WEIGHTS, _WEIGHTS))  # on (-1, 1) weights add up to 2 along each edge
    return patch_inside(basis, facet.elements[on_level][inside], points, weights)


def _gauss_fractions(corner: Floats, edge: Floats, window: Floats) -> tuple[Floats, Floats]:
    """Return the Gauss points of the part of each edge inside a window, and the length of that part [mm].

    Edges run from their corners, both (x and y, facets) [mm]; the window is (x and y, ends) [mm]. The points are
    fractions of the edge, shape (facets, 3). Raises SolveError where an edge runs neither along x nor along y.
    """
    axis = np.argmax(np.abs(edge), axis=0)  # along which each edge runs
    facets = np.arange(len(axis))
    if (np.abs(edge[1 - axis, facets]) > _NEAR).any():
        msg = "bonded foil: a facet below it is no rectangle along x and y; make a fresh mesh"
        raise SolveError(msg)
    start = corner[axis, facets]
    length = edge[axis, facets]
    # Where the window begins and ends, as fractions of each edge.
    ends = np.clip((window[axis] - start[:, None]) / length[:, None], 0.0, 1.0)
    ends = np.sort(ends, axis=1)
    inside = np.diff(ends, axis=1)
    return ends[:, :1] + 0.5 * inside * (1.0 + _GAUSS), inside[:, 0] * np.abs(length)
