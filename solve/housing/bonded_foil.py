"""Thin foils bonded to the leaves: what they add to the stiffness matrix, and the mean strain under their grids.

A foil is a membrane in plane stress on a level face; its own distance from the face is left out. Facets there are
rectangles along x and y, so a foil that ends inside an element is integrated over its exact part of the facet.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from skfem import CellBasis
from skfem.refdom import RefHex

from solve.linear import SolveError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Pair = tuple[float, float]
Rectangle = tuple[Pair, Pair]  # ends in x and in y [mm]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)  # strain is quadratic along a facet at most
_NEAR = 1e-6  # [mm]


@dataclass(frozen=True, kw_only=True)
class BondedFoil:
    """A layer on the level z of the surface `name` [mm]: its rectangle, its E t [N/mm], its Poisson's ratio.

    One with a grid senses the force on a tip (0 low, 1 high); `sign` is that of its arm of the bridge.
    """

    name: str
    z: float
    place: Rectangle
    stiffness: float
    poisson: float
    tip: int
    sign: float
    grid: Rectangle | None = None


@dataclass(frozen=True)
class _Piece:
    """Parts of facets in a rectangle: gradients (nodes, 3, cells, points), dofs, weights with the area [mm^2]."""

    gradients: Floats
    dofs: Ints
    weights: Floats


def facets_by_place(basis: CellBasis, name: str) -> Iterator[tuple[Ints, Floats, Floats, Floats]]:
    """Yield the cells on a named surface with the corner p of their facet and the edges a, b from it, in the cell."""
    mesh = basis.mesh
    facets = mesh.boundaries[name]
    owners = mesh.f2t[0, facets]
    for local, corners in enumerate(RefHex.facets):
        cells = owners[mesh.t2f[local, owners] == facets]
        if len(cells):
            p, q, _, s = RefHex.p[:, corners].T
            yield cells, p, q - p, s - p


def nodal(basis: CellBasis, cells: Ints) -> Ints:
    """Return the dofs of cells, shape (nodes, 3, cells)."""
    dofs = basis.element_dofs[:, cells]
    return np.asarray(dofs.reshape(-1, 3, len(cells)))


def membrane_matrix(basis: CellBasis, foils: Sequence[BondedFoil]) -> csc_matrix:
    """Return what the foils add to the stiffness matrix [N/mm], shape (dofs, dofs); raises SolveError."""
    entries: list[tuple[Floats, Ints, Ints]] = []
    for foil in foils:
        D = _plane_stress(foil.stiffness, foil.poisson)
        for piece in _pieces(basis, foil, foil.place):
            x, y = piece.gradients[:, 0], piece.gradients[:, 1]  # (nodes, cells, points)
            none = np.zeros_like(x)
            B = np.array([[x, none], [none, y], [y, x]])  # (strains, components, nodes, cells, points)
            blocks = np.einsum("sanep,st,tbmep,ep->enamb", B, D, B, piece.weights, optimize=True)
            dofs = piece.dofs[:, :2].transpose(2, 0, 1).reshape(len(blocks), -1)
            size = dofs.shape[1]
            entries.append((blocks.ravel(), np.repeat(dofs, size, axis=1).ravel(), np.tile(dofs, (1, size)).ravel()))
    values, rows, columns = (np.concatenate(parts) for parts in zip(*entries, strict=True))
    return csc_matrix((values, (rows, columns)), shape=(basis.N, basis.N))


def _plane_stress(E_t: float, nu: float) -> Floats:
    return E_t / (1.0 - nu**2) * np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - nu)]])


def bridge_strains(basis: CellBasis, foils: Sequence[BondedFoil], u: Floats) -> Pair:
    """Return the mean strain along x under the grids of each tip's bridge for its own load, in size [1]."""
    arms: tuple[list[float], list[float]] = ([], [])
    for foil in foils:
        if foil.grid is not None:
            arms[foil.tip].append(foil.sign * _mean_strain(basis, foil, foil.grid, u[:, foil.tip]))
    return abs(float(np.mean(arms[0]))), abs(float(np.mean(arms[1])))


def _mean_strain(basis: CellBasis, foil: BondedFoil, grid: Rectangle, u: Floats) -> float:
    pieces = _pieces(basis, foil, grid)
    total = sum(float(np.einsum("nep,ne,ep->", one.gradients[:, 0], u[one.dofs[:, 0]], one.weights)) for one in pieces)
    return total / sum(float(one.weights.sum()) for one in pieces)


def _pieces(basis: CellBasis, foil: BondedFoil, rectangle: Rectangle) -> list[_Piece]:
    """Return the parts of the half y >= 0 of a rectangle; raises SolveError where the mesh does not carry all of it."""
    (x0, x1), (y0, y1) = (sorted(pair) for pair in rectangle)
    window = np.array([[x0, x1], [max(y0, 0.0), y1]])
    found = [
        piece
        for cells, *facet in facets_by_place(basis, foil.name)
        for piece in _clipped(basis, cells, facet, (foil.z, window))
    ]
    area, wanted = sum(float(piece.weights.sum()) for piece in found), float(np.prod(window[:, 1] - window[:, 0]))
    if not abs(area - wanted) <= 1e-6 * wanted:
        msg = (
            f"bonded foil on {foil.name!r}: the mesh carries {area:.6g} mm^2 of it: must be {wanted:.6g} mm^2; "
            "place it on the straight part of a leaf"
        )
        raise SolveError(msg)
    return found


def _clipped(basis: CellBasis, cells: Ints, facet: Sequence[Floats], where: tuple[float, Floats]) -> Iterator[_Piece]:
    """Yield the parts of some facets (corner p, edges a and b in the cell) inside a window on the level z."""
    (p, a, b), (z, window) = facet, where
    at = np.asarray(basis.mapping.F(np.array([p, p + a, p + b]).T, tind=cells))  # (3, cells, corners)
    level = np.abs(at[2] - z).max(axis=1) < _NEAR
    cells, at = cells[level], at[:2, level]
    shares, area = [], np.ones(len(cells))
    for edge in (at[:, :, 1] - at[:, :, 0], at[:, :, 2] - at[:, :, 0]):
        start, end, long = _share(at[:, :, 0], edge, window)
        shares.append(start[:, None] + 0.5 * (end - start)[:, None] * (1.0 + _NODES))
        area *= np.maximum(end - start, 0.0) * np.abs(long)
    inside = area > 0.0
    if not inside.any():
        return
    cells, (first, second) = cells[inside], (share[inside] for share in shares)
    reach = np.array([p]).T[:, :, None, None] + np.multiply.outer(a, first)[:, :, :, None]
    points = (reach + np.multiply.outer(b, second)[:, :, None, :]).reshape(3, len(cells), -1)
    weights = 0.25 * area[inside, None] * np.outer(_WEIGHTS, _WEIGHTS).ravel()
    nodes = range(basis.element_dofs.shape[0] // 3)
    gradients = [basis.elem.elem.gbasis(basis.mapping, points, i, tind=cells)[0].grad for i in nodes]
    yield _Piece(np.array(gradients), nodal(basis, cells), weights)


def _share(corner: Floats, edge: Floats, window: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the shares of facet edges (x and y, cells) at which a window begins and ends, and their lengths."""
    along = np.argmax(np.abs(edge), axis=0)[None]
    if (np.abs(np.take_along_axis(edge, 1 - along, axis=0)) > _NEAR).any():
        msg = "bonded foil: a facet below it is no rectangle along x and y; make a fresh mesh"
        raise SolveError(msg)
    start, long = (np.take_along_axis(one, along, axis=0)[0] for one in (corner, edge))
    low, high = np.sort(np.clip((window[along[0]] - start[:, None]) / long[:, None], 0.0, 1.0), axis=1).T
    return low, high, long
