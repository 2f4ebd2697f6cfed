"""The remainder, which a finite block of fruit adds to the half-space: v = u - u_halfspace, smooth, on a coarse mesh.

v is elastic in the block. Its load is minus the half-space tractions on the free sides and nothing on the top. On the
clamped base it is minus the half-space displacements. Its value under a load follows from Betti's theorem,

    v_z^j(x_k) = int_base t^k . u^j - int_sides t^j . u^k - int_sides t^k . v^j + int_base t(v^j) . u^k,

with t and u of the half-space. This form is symmetric, evaluates no field at a point, and its error is a product of two
energy errors. On a half or a quarter of the block, u is the field of a load and its mirror images. The theorem holds
unchanged, because one of these loads lies on the part, and fields of one parity do no work on each other across a
mirror plane. 27-node hexahedra with B-bar dilatation do not lock as nu tends to 0.5. E = 1 throughout.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from skfem import CellBasis, ElementHex2, Mesh
from skfem.quadrature import get_quadrature
from skfem.refdom import RefQuad

from sensor.arrays import Floats, Ints
from solve.elasticity import assemble_elements, stiffness_matrix, vector_basis
from solve.halfspace import potentials as halfspace
from solve.linear import SolveError, factorise
from solve.surface import surface_patches

Parity = tuple[int, int]
HalfSpaceFields = tuple[Floats, Floats]  # displacement and traction, each (loads, 3, facets, q)

VOLUME_ORDER = 4  # polynomial degree of the quadrature in elements
PLANES = ("x_low", "y_low")
SURFACE_ORDER = 9  # polynomial degree of the quadrature on faces
RECIPROCITY_LIMIT = 5e-5  # largest asymmetry of a compliance, relative to its largest entry
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

    It has points [mm] and outward normals (3, facets, q), and weights [mm^2] (facets, q). Values of the scalar shape
    functions are (nodes, facets, q), dofs (nodes, 3, facets).
    """

    points: Floats
    normals: Floats
    weights: Floats
    shapes: Floats
    dofs: Ints


def remainder_compliance(
    mesh: Mesh, poisson: float, loads: Floats, parities: Sequence[Parity]
) -> tuple[list[Floats], int]:
    """Return the compliance of the remainder for each parity, E = 1 [1/mm], (loads, loads) each, and the dofs.

    Entry kj is v_z at load k per unit normal load j. `mesh` is the block, or the half or quarter of it at x >= 0 or y
    >= 0, with faces named as by `box_mesh`. `loads` (n, 2) are points on its top [mm]. A parity has one sign for x and
    one for y, which mirrors every load at the plane x = 0 or y = 0. The sign is +1, -1, or 0 if the mesh contains both
    sides. Raises ValueError if the zeros of the parities differ, because all parities share the mesh and its planes.
    Raises SolveError if a solve does not converge or the compliance is not symmetric.
    """
    mirrored = np.abs(parities[0])
    if (np.abs(parities) != mirrored).any():
        msg = f"remainder: parities {parities} must all be 0 where the mesh has both sides, and only there"
        raise ValueError(msg)
    basis = vector_basis(mesh, ElementHex2(), VOLUME_ORDER)
    stiffness = stiffness_matrix(basis, 1.0, poisson, b_bar=True)
    clamped = basis.get_dofs("base").all()
    mirror_planes = [plane for plane, has_plane in zip(PLANES, mirrored, strict=True) if has_plane]
    side = _quadrature(basis, {name: normal for name, normal in SIDES.items() if name not in mirror_planes})
    base = _quadrature(basis, BASE)

    # The half-space under a load and each of its mirror images, identified by the signs of x and y.
    signs = [(1, -1) if has_plane else (1,) for has_plane in mirrored]
    images = np.array(list(itertools.product(*signs)))
    on_side = [_half_space(loads * image, poisson, side) for image in images]
    on_base = [_half_space(loads * image, poisson, base) for image in images]

    compliances = []
    for parity in parities:
        image_signs = np.where(images < 0, parity, 1).prod(axis=1)
        side_u, side_t = _signed_sum(image_signs, on_side)
        base_u, base_t = _signed_sum(image_signs, on_base)

        # v takes minus the half-space tractions on the sides (load), minus its displacements on the base (lift).
        mirror = mirror_dofs(basis, parity)
        load = -_load_vector(side, side_t, basis.N)
        lift = -_projection(base, base_u, np.setdiff1d(clamped, mirror), basis.N)
        factor = factorise(stiffness, np.union1d(clamped, mirror))
        v = factor.solve(load, lift[factor.fixed])

        # Betti's theorem, with its four terms in the order of the module docstring: first the terms of the half-space,
        # then the terms of v, with the nodal reactions of the base instead of its tractions.
        half_space = _work(base, base_t, base_u) - _work(side, side_t, side_u).T
        reaction = stiffness @ v - load
        compliances.append(half_space + load.T @ v - lift.T @ reaction)
    _check_reciprocity(compliances)
    return [0.5 * (each + each.T) for each in compliances], int(basis.N)


def _signed_sum(signs: Ints, fields: Sequence[HalfSpaceFields]) -> HalfSpaceFields:
    """Return the sums over mirror images, with their signs, of displacements and of tractions."""
    displacement = np.tensordot(signs, [u for u, _ in fields], 1)
    traction = np.tensordot(signs, [t for _, t in fields], 1)
    return displacement, traction


def _check_reciprocity(compliances: Sequence[Floats]) -> None:
    """Raise SolveError unless all compliances are symmetric, which wrong half-space fields would violate."""
    scale = max(float(np.abs(each).max()) for each in compliances)
    skew = max(float(np.abs(each - each.T).max()) for each in compliances)
    if not skew <= RECIPROCITY_LIMIT * scale:
        msg = (
            f"remainder: loads differ from their reciprocals by {skew / scale:.1e} of the largest: must be at most "
            f"{RECIPROCITY_LIMIT:.0e}; take a finer mesh"
        )
        raise SolveError(msg)


def remainder_field(mesh: Mesh, poisson: float, loads: Floats, forces: Floats) -> tuple[CellBasis, Floats]:
    """Return the remainder of a whole block under forces: its basis, and v times E at its dofs [N/mm], shape (dofs,).

    The forces (n,) [N] act at points (n, 2) [mm] on the top. `mesh` is made by `box_mesh`. Raises SolveError if the
    solve does not converge.
    """
    basis = vector_basis(mesh, ElementHex2(), VOLUME_ORDER)
    side = _quadrature(basis, SIDES)
    base = _quadrature(basis, BASE)
    _, traction = _half_space(loads, poisson, side)
    u, _ = _half_space(loads, poisson, base)
    clamped = basis.get_dofs("base").all()
    load = -_load_vector(side, np.tensordot(forces, traction, 1)[None], basis.N)
    lift = -_projection(base, np.tensordot(forces, u, 1)[None], clamped, basis.N)
    factor = factorise(stiffness_matrix(basis, 1.0, poisson, b_bar=True), clamped)
    return basis, factor.solve(load, lift[factor.fixed])[:, 0]


def mirror_dofs(basis: CellBasis, parity: Parity) -> Ints:
    """Return the dofs that are zero on the mirror planes, (n,): normal to the plane if even, in the plane if odd."""
    across = (["u^1"], ["u^2"])
    along = (["u^2", "u^3"], ["u^1", "u^3"])
    dofs = np.zeros(0, dtype=np.int64)
    for axis, sign in enumerate(parity):
        if sign:
            held = across[axis] if sign > 0 else along[axis]
            dofs = np.union1d(dofs, basis.get_dofs(PLANES[axis]).all(held))
    return dofs


def _quadrature(basis: CellBasis, faces: Mapping[str, Sequence[float]]) -> FaceQuadrature:
    """Return one quadrature over all named faces of the box, with the given outward normal (3,) of each."""
    points, weights = get_quadrature(RefQuad, SURFACE_ORDER)
    patches = []
    normals = []
    for name, normal in faces.items():
        for patch in surface_patches(basis, name, points, weights):
            patches.append(patch)
            normals.append(np.broadcast_to(np.array(normal)[:, None, None], patch.points.shape))
    return FaceQuadrature(
        points=np.concatenate([patch.points for patch in patches], axis=1),
        normals=np.concatenate(normals, axis=1),
        weights=np.concatenate([patch.weights for patch in patches]),
        shapes=np.concatenate([patch.shapes for patch in patches], axis=1),
        dofs=np.concatenate([patch.dofs for patch in patches], axis=2),
    )


def _half_space(loads: Floats, poisson: float, faces: FaceQuadrature) -> HalfSpaceFields:
    """Return displacement u and traction t of the half-space on some faces, under a unit force at each load (n, 2)."""
    x = faces.points[0] - loads[:, 0, None, None]
    y = faces.points[1] - loads[:, 1, None, None]
    potentials = halfspace.point_load(x, y, np.broadcast_to(faces.points[2], x.shape))
    traction = np.einsum("abp...,b...->pa...", halfspace.stress(potentials, poisson), faces.normals)
    return halfspace.displacement(potentials, 1.0, poisson).swapaxes(0, 1), traction


def _load_vector(faces: FaceQuadrature, traction: Floats, size: int) -> Floats:
    """Return int traction . N for tractions (loads, 3, facets, q), shape (dofs, loads)."""
    # indices: load p, component c, facet f, point of quadrature q, node b
    local = np.einsum("pcfq,bfq,fq->bcfp", traction, faces.shapes, faces.weights, optimize=True)
    total = np.zeros((size, len(traction)))
    np.add.at(total, faces.dofs, local)
    return total


def _projection(faces: FaceQuadrature, field: Floats, kept: Ints, size: int) -> Floats:
    """Return the least-squares fit of a field on faces by the displacement of the kept dofs, shape (dofs, loads).

    The field is (loads, 3, facets, q), `size` the number of all dofs. Unlike interpolation, a fit leaves a difference
    that does no work with tractions of the same smoothness.
    """
    mass = np.einsum("bfq,dfq,fq->fbd", faces.shapes, faces.shapes, faces.weights, optimize=True)
    right = _load_vector(faces, field, size)
    fitted = np.zeros_like(right)
    for component in range(3):
        dofs = faces.dofs[:, component].T
        chosen = np.intersect1d(dofs, kept)
        matrix = assemble_elements(mass, dofs, size)[chosen][:, chosen].toarray()
        fitted[chosen] = np.linalg.solve(matrix, right[chosen])
    return fitted


def _work(faces: FaceQuadrature, traction: Floats, displacement: Floats) -> Floats:
    """Return int traction_k . displacement_j, shape (loads, loads)."""
    weighted = (traction * faces.weights).reshape(len(traction), -1)
    return weighted @ displacement.reshape(len(displacement), -1).T
