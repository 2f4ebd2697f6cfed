"""What a block of fruit adds to the half-space: v = u - u_halfspace, smooth, found on a coarse mesh.

v is elastic in the block, carries minus the half-space tractions on the free sides, takes minus the half-space
displacements on the clamped base and nothing on the top. Its value under a load follows from Betti's theorem,

    v_z^j(x_k) = int_base t^k . u^j - int_sides t^j . u^k - int_sides t^k . v^j + int_base t(v^j) . u^k,

t, u of the half-space: symmetric, no value is read off at a point, and the error is a product of two energy errors.
27-node hexahedra with projected dilatation do not lock as nu tends to 0.5 (`solve/dilatation.py`). E = 1 throughout.
"""

import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from skfem import CellBasis, ElementHex2, Mesh
from skfem.quadrature import get_quadrature
from skfem.refdom import RefQuad

from solve.dilatation import projected_stiffness
from solve.elasticity import vector_basis
from solve.halfspace import potentials as halfspace
from solve.linear import SolveError, factorised

Floats = NDArray[np.float64]
Ints = NDArray[np.integer[Any]]
Parity = tuple[int, int]

VOLUME_ORDER = 4
PLANES = ("x_low", "y_low")
SIDES = ("x_low", "x_high", "y_low", "y_high")
SURFACE_ORDER = 9
RECIPROCITY_LIMIT = 5e-5
FACES = {
    "x_low": (-1.0, 0.0, 0.0),
    "x_high": (1.0, 0.0, 0.0),
    "y_low": (0.0, -1.0, 0.0),
    "y_high": (0.0, 1.0, 0.0),
    "base": (0.0, 0.0, 1.0),
}


@dataclass(frozen=True)
class Boundary:
    """Quadrature on some faces: points and normals (3, facets, q), weights (facets, q), scalar shape functions."""

    points: Floats
    normals: Floats
    weights: Floats
    shapes: Floats
    dofs: Ints


@dataclass(frozen=True)
class Answer:
    """Displacement and traction of the half-space under each load on some faces, both (loads, 3, facets, q)."""

    u: Floats
    t: Floats


@dataclass(frozen=True)
class Remainder:
    """v_z at load k per load j, times E [1/mm], symmetric, shape (loads, loads), one per parity; and the dofs."""

    compliances: tuple[Floats, ...]
    dofs: int


def remainder_compliance(mesh: Mesh, poisson: float, loads: Floats, parities: tuple[Parity, ...]) -> Remainder:
    """Return the remainder's answer to unit normal loads at places on the top of a block, at these places.

    `mesh` is the block, or the half or quarter of it that lies at x >= 0 or y >= 0, with faces named as `box_mesh`
    does; `loads` (n, 2) are places on its top [mm]. A parity (+1 | -1 | 0 for x, same for y) mirrors every load with
    that sign at the plane x = 0 or y = 0; 0 where the mesh holds both sides. Raises SolveError when a solve is not
    exact or the answers are not reciprocal.
    """
    basis = vector_basis(mesh, ElementHex2(), VOLUME_ORDER)
    stiffness = projected_stiffness(basis, 1.0, poisson)
    mirrored = [name for name, sign in zip(PLANES, parities[0], strict=True) if sign]
    side = _boundary(mesh, basis, [name for name in SIDES if name not in mirrored])
    base = _boundary(mesh, basis, ["base"])
    images = _images(parities[0])
    on_side = {image: _half_space(loads * image, poisson, side) for image in images}
    on_base = {image: _half_space(loads * image, poisson, base) for image in images}
    clamped = basis.get_dofs("base").all()
    found = []
    for parity in parities:
        mirror = _mirror_dofs(basis, parity)
        factor = factorised(stiffness, np.union1d(clamped, mirror))
        sides, bases = _sum_of_images(on_side, parity), _sum_of_images(on_base, parity)
        right = -_load_vector(side, sides.t, basis.N)
        lift = -_projection(base, bases.u, np.setdiff1d(clamped, mirror), basis.N)
        v = factor.solve(right, lift[factor.fixed])
        reaction = stiffness @ v - right
        known = _work(base, bases.t, bases.u) - _work(side, sides.t, sides.u).T
        found.append(known + right.T @ v - lift.T @ reaction)
    _check_reciprocity(found)
    return Remainder(tuple(0.5 * (one + one.T) for one in found), int(basis.N))


def remainder_field(mesh: Mesh, poisson: float, loads: Floats, forces: Floats) -> tuple[CellBasis, Floats]:
    """Return the remainder under forces (n,) at places (n, 2) on top of a whole block: basis and dofs of v E [1/mm].

    `mesh` as `box_mesh` makes it. Raises SolveError when the solve is not exact.
    """
    basis = vector_basis(mesh, ElementHex2(), VOLUME_ORDER)
    stiffness = projected_stiffness(basis, 1.0, poisson)
    factor = factorised(stiffness, basis.get_dofs("base").all())
    side, base = _boundary(mesh, basis, list(SIDES)), _boundary(mesh, basis, ["base"])
    traction = np.tensordot(forces, _half_space(loads, poisson, side).t, 1)[None]
    shift = np.tensordot(forces, _half_space(loads, poisson, base).u, 1)[None]
    lift = -_projection(base, shift, factor.fixed, basis.N)
    v: Floats = factor.solve(-_load_vector(side, traction, basis.N), lift[factor.fixed])[:, 0]
    return basis, v


def _check_reciprocity(found: list[Floats]) -> None:
    """Raise SolveError unless loads answer each other alike, which only true half-space fields do."""
    scale = max(float(np.abs(one).max()) for one in found)
    skew = max(float(np.abs(one - one.T).max()) for one in found)
    if not skew <= RECIPROCITY_LIMIT * scale:
        msg = (
            f"remainder: loads differ from their reciprocals by {skew / scale:.1e} of the largest answer: must be at "
            f"most {RECIPROCITY_LIMIT:.0e}; take a finer mesh"
        )
        raise SolveError(msg)


def _boundary(mesh: Mesh, basis: CellBasis, names: list[str]) -> Boundary:
    """Return the quadrature of some faces of a box, from the cells' own shape functions on a face of the cell.

    FacetBasis finds the place in the cell by Newton steps with an absolute tolerance, which fails in thin layers.
    """
    parts = [_face(mesh, basis, name) for name in names]
    return Boundary(
        points=np.concatenate([part.points for part in parts], axis=1),
        normals=np.concatenate([part.normals for part in parts], axis=1),
        weights=np.concatenate([part.weights for part in parts]),
        shapes=np.concatenate([part.shapes for part in parts], axis=1),
        dofs=np.concatenate([part.dofs for part in parts], axis=2),
    )


def _face(mesh: Mesh, basis: CellBasis, name: str) -> Boundary:
    cells = mesh.f2t[0, mesh.boundaries[name]]
    normal = FACES[name]
    axis = int(np.argmax(np.abs(normal)))
    plane, weight = get_quadrature(RefQuad, SURFACE_ORDER)
    place = mesh.p[axis, mesh.facets[0, mesh.boundaries[name][0]]]
    for along, end in itertools.product(range(3), (0.0, 1.0)):
        inside = np.insert(plane, along, end, axis=0)
        points = mesh.mapping().F(inside, cells)
        if np.abs(points[axis] - place).max() <= 1e-9 * np.ptp(mesh.p[axis]):
            break
    scalar = CellBasis(mesh, basis.elem.elem, elements=cells, quadrature=(inside, weight), disable_doflocs=True)
    depth = np.ptp(mesh.p[axis][mesh.t[:, cells]], axis=0)
    shapes = np.stack([np.broadcast_to(np.asarray(field[0]), scalar.dx.shape) for field in scalar.basis])
    normals = np.broadcast_to(np.array(normal)[:, None, None], (3, *scalar.dx.shape))
    dofs = basis.element_dofs[:, cells].reshape(len(shapes), 3, -1)
    return Boundary(points, normals, scalar.dx / depth[:, None], shapes, dofs)


def _half_space(loads: Floats, poisson: float, boundary: Boundary) -> Answer:
    fields = _point_loads(loads, boundary.points)
    traction = np.einsum("abp...,b...->pa...", halfspace.stress(fields, poisson), boundary.normals)
    return Answer(halfspace.displacement(fields, 1.0, poisson).swapaxes(0, 1), traction)


def _point_loads(loads: Floats, points: Floats) -> halfspace.Potentials:
    x, y = (points[axis] - loads[:, axis].reshape(-1, *[1] * (points.ndim - 1)) for axis in (0, 1))
    return halfspace.point_load(x, y, np.broadcast_to(points[2], x.shape))


def _images(parity: Parity) -> list[tuple[int, int]]:
    """Return the signs of x and y of a load and of its mirror images."""
    along_x, along_y = ((1, -1) if sign else (1,) for sign in parity)
    return list(itertools.product(along_x, along_y))


def _sum_of_images(answers: dict[tuple[int, int], Answer], parity: Parity) -> Answer:
    signs = [math.prod(p for p, side in zip(parity, image, strict=True) if side < 0) for image in answers]
    return Answer(
        u=np.tensordot(signs, [one.u for one in answers.values()], 1),
        t=np.tensordot(signs, [one.t for one in answers.values()], 1),
    )


def _mirror_dofs(basis: CellBasis, parity: Parity) -> Ints:
    """Return the dofs that vanish on the mirror planes: across the plane when even, along it when odd."""
    found = [np.zeros(0, dtype=np.int64)]
    for axis, (name, sign) in enumerate(zip(PLANES, parity, strict=True)):
        if sign:
            held = [f"u^{k + 1}" for k in range(3) if (k == axis) == (sign > 0)]
            found.append(basis.get_dofs(name).all(held))
    return np.concatenate(found)


def _load_vector(boundary: Boundary, traction: Floats, size: int) -> Floats:
    """Return int traction . N for every load, shape (dofs, loads)."""
    local = np.einsum("pcfq,bfq,fq->bcfp", traction, boundary.shapes, boundary.weights, optimize=True)
    total = np.zeros((size, len(traction)))
    np.add.at(total, boundary.dofs, local)
    return total


def _projection(boundary: Boundary, field: Floats, kept: Ints, size: int) -> Floats:
    """Return the least-squares fit of a field on a boundary by the displacement of the kept dofs, shape (dofs, loads).

    A fit, unlike interpolation, leaves a remainder that does no work with tractions of the same smoothness.
    """
    nodes = len(boundary.shapes)
    mass = np.einsum("bfq,dfq,fq->fbd", boundary.shapes, boundary.shapes, boundary.weights, optimize=True)
    right = _load_vector(boundary, field, size)
    fitted = np.zeros_like(right)
    for component in range(3):
        dofs = boundary.dofs[:, component].T
        rows, columns = np.repeat(dofs, nodes, axis=1).ravel(), np.tile(dofs, (1, nodes)).ravel()
        chosen = np.intersect1d(dofs, kept)
        matrix = csr_matrix((mass.ravel(), (rows, columns)), shape=(size, size))[chosen][:, chosen].toarray()
        fitted[chosen] = np.linalg.solve(matrix, right[chosen])
    return fitted


def _work(boundary: Boundary, traction: Floats, displacement: Floats) -> Floats:
    """Return int traction_k . displacement_j, shape (loads, loads)."""
    weighted = (traction * boundary.weights).reshape(len(traction), -1)
    return weighted @ displacement.reshape(len(displacement), -1).T
