"""The remainder, what a finite block of fruit adds to the half-space: v = u - u_halfspace, smooth, on a coarse mesh.

v is elastic in the block, carries minus the half-space tractions on the free sides, takes minus the half-space
displacements on the clamped base and nothing on the top. Its value under a load follows from Betti's theorem,

    v_z^j(x_k) = int_base t^k . u^j - int_sides t^j . u^k - int_sides t^k . v^j + int_base t(v^j) . u^k,

t, u of the half-space: symmetric, no value is read off at a point, and the error is a product of two energy errors.
27-node hexahedra with B-bar dilatation do not lock as nu tends to 0.5. E = 1 throughout.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix
from skfem import CellBasis, ElementHex2, Mesh
from skfem.quadrature import get_quadrature
from skfem.refdom import RefQuad

from solve.arrays import Floats, Ints
from solve.elasticity import scattered, stiffness_matrix, vector_basis
from solve.halfspace import potentials as halfspace
from solve.linear import SolveError, factorised
from solve.surface import surface_patches

Parity = tuple[int, int]

VOLUME_ORDER = 4
PLANES = ("x_low", "y_low")
SURFACE_ORDER = 9
RECIPROCITY_LIMIT = 5e-5
SIDES = {
    "x_low": (-1.0, 0.0, 0.0),
    "x_high": (1.0, 0.0, 0.0),
    "y_low": (0.0, -1.0, 0.0),
    "y_high": (0.0, 1.0, 0.0),
}
BASE = {"base": (0.0, 0.0, 1.0)}


@dataclass(frozen=True, eq=False)
class FaceQuadrature:
    """Quadrature on some faces of the box.

    Points [mm] and outward normals (3, facets, q), weights [mm^2] (facets, q), values of the scalar shape functions
    (nodes, facets, q) and dofs (nodes, 3, facets).
    """

    points: Floats
    normals: Floats
    weights: Floats
    shapes: Floats
    dofs: Ints


@dataclass(frozen=True, eq=False)
class HalfSpaceField:
    """Displacement u and traction t of the half-space under each load on some faces, (loads, 3, facets, q)."""

    u: Floats
    t: Floats


@dataclass(frozen=True, eq=False)
class Remainder:
    """v_z at load k per load j, times E [1/mm], symmetric, shape (loads, loads), one per parity; and the dofs."""

    compliances: tuple[Floats, ...]
    dofs: int


@dataclass(frozen=True, eq=False)
class _Block:
    """The elastic block: its stiffness, its loaded sides, its clamped base."""

    basis: CellBasis
    stiffness: csc_matrix
    side: FaceQuadrature
    base: FaceQuadrature

    def solved(self, traction: Floats, shift: Floats, mirror: Ints) -> tuple[Floats, Floats, Floats]:
        """Return v, the load and the prescribed base (dofs, loads) for minus a traction on the sides and a base shift.

        `mirror` are the dofs that vanish on the mirror planes.
        """
        clamped = self.basis.get_dofs("base").all()
        factor = factorised(self.stiffness, np.union1d(clamped, mirror))
        load = -_load_vector(self.side, traction, self.basis.N)
        lift = -_projection(self.base, shift, np.setdiff1d(clamped, mirror), self.basis.N)
        return factor.solve(load, lift[factor.fixed]), load, lift

    def compliance(self, side: HalfSpaceField, base: HalfSpaceField, mirror: Ints) -> Floats:
        """Return the remainder at the loads whose half-space fields these are, by Betti's theorem, (loads, loads)."""
        v, load, lift = self.solved(side.t, base.u, mirror)
        reaction = self.stiffness @ v - load
        half_space = _work(self.base, base.t, base.u) - _work(self.side, side.t, side.u).T
        return half_space + load.T @ v - lift.T @ reaction


def remainder_compliance(mesh: Mesh, poisson: float, loads: Floats, parities: Sequence[Parity]) -> Remainder:
    """Return the remainder at places on the top of a block per unit normal load at these places, E = 1 [1/mm].

    `mesh` is the block, or the half or quarter of it that lies at x >= 0 or y >= 0, with faces named as `box_mesh`
    does; `loads` (n, 2) are places on its top [mm]. A parity (+1 | -1 | 0 for x, same for y) mirrors every load with
    that sign at the plane x = 0 or y = 0; 0 where the mesh holds both sides. Raises SolveError when a solve is not
    exact or the compliance is not symmetric.
    """
    mirrored = [name for name, sign in zip(PLANES, parities[0], strict=True) if sign]
    block = _block(mesh, poisson, mirrored)
    images = _images(parities[0])
    on_side = {image: _half_space(loads * image, poisson, block.side) for image in images}
    on_base = {image: _half_space(loads * image, poisson, block.base) for image in images}
    compliances = []
    for parity in parities:
        side, base = _sum_of_images(on_side, parity), _sum_of_images(on_base, parity)
        compliances.append(block.compliance(side, base, mirror_dofs(block.basis, parity)))
    _check_reciprocity(compliances)
    return Remainder(tuple(0.5 * (one + one.T) for one in compliances), int(block.basis.N))


def remainder_field(mesh: Mesh, poisson: float, loads: Floats, forces: Floats) -> tuple[CellBasis, Floats]:
    """Return the remainder under forces (n,) at places (n, 2) on top of a whole block: basis and dofs of v E [1/mm].

    `mesh` as `box_mesh` makes it. Raises SolveError when the solve is not exact.
    """
    block = _block(mesh, poisson, [])
    traction = np.tensordot(forces, _half_space(loads, poisson, block.side).t, 1)[None]
    shift = np.tensordot(forces, _half_space(loads, poisson, block.base).u, 1)[None]
    v, _, _ = block.solved(traction, shift, np.zeros(0, dtype=np.int64))
    return block.basis, v[:, 0]


def _block(mesh: Mesh, poisson: float, mirrored: Sequence[str]) -> _Block:
    basis = vector_basis(mesh, ElementHex2(), VOLUME_ORDER)
    side = {name: normal for name, normal in SIDES.items() if name not in mirrored}
    stiffness = stiffness_matrix(basis, 1.0, poisson, b_bar=True)
    return _Block(basis, stiffness, _quadrature(basis, side), _quadrature(basis, BASE))


def _check_reciprocity(compliances: Sequence[Floats]) -> None:
    """Raise SolveError unless each compliance is symmetric (Betti); only true half-space fields make it so."""
    scale = max(float(np.abs(one).max()) for one in compliances)
    skew = max(float(np.abs(one - one.T).max()) for one in compliances)
    if not skew <= RECIPROCITY_LIMIT * scale:
        msg = (
            f"remainder: loads differ from their reciprocals by {skew / scale:.1e} of the largest answer: must be at "
            f"most {RECIPROCITY_LIMIT:.0e}; take a finer mesh"
        )
        raise SolveError(msg)


def _quadrature(basis: CellBasis, faces: dict[str, tuple[float, float, float]]) -> FaceQuadrature:
    points, weights = get_quadrature(RefQuad, SURFACE_ORDER)
    pairs = [(patch, faces[name]) for name in faces for patch in surface_patches(basis, name, points, weights)]
    patches = [patch for patch, _ in pairs]
    normals = [np.broadcast_to(np.array(normal)[:, None, None], patch.places.shape) for patch, normal in pairs]
    return FaceQuadrature(
        points=np.concatenate([patch.places for patch in patches], axis=1),
        normals=np.concatenate(normals, axis=1),
        weights=np.concatenate([patch.weights for patch in patches]),
        shapes=np.concatenate([patch.shapes for patch in patches], axis=1),
        dofs=np.concatenate([patch.dofs for patch in patches], axis=2),
    )


def _half_space(loads: Floats, poisson: float, faces: FaceQuadrature) -> HalfSpaceField:
    x, y = (faces.points[axis] - loads[:, axis, None, None] for axis in (0, 1))
    potentials = halfspace.point_load(x, y, np.broadcast_to(faces.points[2], x.shape))
    traction = np.einsum("abp...,b...->pa...", halfspace.stress(potentials, poisson), faces.normals)
    return HalfSpaceField(halfspace.displacement(potentials, 1.0, poisson).swapaxes(0, 1), traction)


def _images(parity: Parity) -> list[tuple[int, int]]:
    """Return the signs of x and y of a load and of its mirror images."""
    along_x, along_y = ((1, -1) if sign else (1,) for sign in parity)
    return list(itertools.product(along_x, along_y))


def _sum_of_images(fields: dict[tuple[int, int], HalfSpaceField], parity: Parity) -> HalfSpaceField:
    signs = [math.prod(p for p, side in zip(parity, image, strict=True) if side < 0) for image in fields]
    return HalfSpaceField(
        u=np.tensordot(signs, [one.u for one in fields.values()], 1),
        t=np.tensordot(signs, [one.t for one in fields.values()], 1),
    )


def mirror_dofs(basis: CellBasis, parity: Parity) -> Ints:
    """Return the dofs that vanish on the mirror planes, shape (n,): across the plane when even, along it when odd."""
    dofs = [np.zeros(0, dtype=np.int64)]
    for axis, (name, sign) in enumerate(zip(PLANES, parity, strict=True)):
        if sign:
            held = [f"u^{k + 1}" for k in range(3) if (k == axis) == (sign > 0)]
            dofs.append(basis.get_dofs(name).all(held))
    return np.concatenate(dofs)


def _load_vector(faces: FaceQuadrature, traction: Floats, size: int) -> Floats:
    """Return int traction . N for every load, shape (dofs, loads)."""
    local = np.einsum("pcfq,bfq,fq->bcfp", traction, faces.shapes, faces.weights, optimize=True)
    total = np.zeros((size, len(traction)))
    np.add.at(total, faces.dofs, local)
    return total


def _projection(faces: FaceQuadrature, field: Floats, kept: Ints, size: int) -> Floats:
    """Return the least-squares fit of a field on faces by the displacement of the kept dofs, shape (dofs, loads).

    A fit, unlike interpolation, leaves a remainder that does no work with tractions of the same smoothness.
    """
    mass = np.einsum("bfq,dfq,fq->fbd", faces.shapes, faces.shapes, faces.weights, optimize=True)
    right = _load_vector(faces, field, size)
    fitted = np.zeros_like(right)
    for component in range(3):
        dofs = faces.dofs[:, component].T
        chosen = np.intersect1d(dofs, kept)
        matrix = scattered(mass, dofs, size)[chosen][:, chosen].toarray()
        fitted[chosen] = np.linalg.solve(matrix, right[chosen])
    return fitted


def _work(faces: FaceQuadrature, traction: Floats, displacement: Floats) -> Floats:
    """Return int traction_k . displacement_j, shape (loads, loads)."""
    weighted = (traction * faces.weights).reshape(len(traction), -1)
    return weighted @ displacement.reshape(len(displacement), -1).T
