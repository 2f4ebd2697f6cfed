"""The remainder of a block of fruit: the field that its finite size adds to the field of a half-space.

Both bodies carry the same point loads. If the half-space has the displacement u, the block has the displacement u + v.
The remainder v is smooth, so a coarse mesh is sufficient. The remainder solves an elastic problem on the block with
these boundary conditions. On the free sides, its tractions are minus the half-space tractions. On the top, it has no
traction. On the clamped base, it is minus the half-space displacement. The value of v under a load follows from Betti's
theorem,

    v_z^j(x_k) = int_base t^k . u^j - int_sides t^j . u^k - int_sides t^k . v^j + int_base t(v^j) . u^k,

where u^j and t^j are the displacement and the traction of the half-space under load j. This form is symmetric,
evaluates no field at a point, and has an error that is a product of two energy errors.

On a half or a quarter of the block, u is the field of a load and its mirror images. The theorem still holds, because
one of these loads lies on the meshed part. Fields of the same parity do no work on each other across a mirror plane.
Hexahedra with 27 nodes and B-bar dilatation do not lock as nu approaches 0.5. E = 1 throughout.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix
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

VOLUME_ORDER = 4  # polynomial degree of the quadrature over elements
PLANES = ("x_low", "y_low")  # faces that become mirror planes if only half or a quarter of the block is meshed
SURFACE_ORDER = 9  # polynomial degree of the quadrature over faces
RECIPROCITY_LIMIT = 5e-5  # largest allowed asymmetry of a compliance, relative to its largest entry
# Faces of the box and their outward normals.
SIDES = {
    "x_low": (-1.0, 0.0, 0.0),
    "x_high": (1.0, 0.0, 0.0),
    "y_low": (0.0, -1.0, 0.0),
    "y_high": (0.0, 1.0, 0.0),
}
BASE = {"base": (0.0, 0.0, 1.0)}


@dataclass(frozen=True, eq=False)
class FaceQuadrature:
    """A quadrature rule on some faces of the box, with q points on each facet.

    `points` [mm] and outward `normals` have shape (3, facets, q), and `weights` [mm^2] has shape (facets, q). `shapes`
    (nodes, facets, q) holds the values of the scalar shape functions. `dofs` (nodes, 3, facets) holds the dofs of their
    nodes.
    """

    points: Floats
    normals: Floats
    weights: Floats
    shapes: Floats
    dofs: Ints


@dataclass(frozen=True, eq=False)
class _BoundaryProblem:
    """The elastic problem of the remainder on one mesh, for E = 1.

    `stiffness` is the stiffness matrix of the displacement basis. `side` and `base` are quadrature rules on the free
    side faces and on the clamped base.
    """

    basis: CellBasis
    stiffness: csc_matrix
    side: FaceQuadrature
    base: FaceQuadrature

    def solve(self, side_traction: Floats, base_displacement: Floats, mirror: Ints) -> tuple[Floats, Floats, Floats]:
        """Return the remainder v, its nodal forces on the sides, and its displacement on the base, (dofs, loads).

        The remainder cancels the half-space tractions on the sides and the half-space displacements on the base, both
        (loads, 3, facets, q). `mirror` holds the dofs that are zero on the mirror planes. Raises SolveError if the
        solve does not converge.
        """
        clamped = self.basis.get_dofs("base").all()
        side_forces = -_load_vector(self.side, side_traction, self.basis.N)
        # The prescribed displacement is 0 at all dofs except at the base, away from the mirror planes.
        prescribed = -_projection(self.base, base_displacement, np.setdiff1d(clamped, mirror), self.basis.N)
        factor = factorise(self.stiffness, np.union1d(clamped, mirror))
        v = factor.solve(side_forces, prescribed[factor.fixed])
        return v, side_forces, prescribed


def _boundary_problem(mesh: Mesh, poisson: float, mirror_planes: Sequence[str]) -> _BoundaryProblem:
    """Return the elastic problem of the remainder on a mesh. The faces in `mirror_planes` are not free sides."""
    basis = vector_basis(mesh, ElementHex2(), VOLUME_ORDER)
    free_sides = {name: normal for name, normal in SIDES.items() if name not in mirror_planes}
    return _BoundaryProblem(
        basis=basis,
        stiffness=stiffness_matrix(basis, 1.0, poisson, b_bar=True),
        side=_quadrature(basis, free_sides),
        base=_quadrature(basis, BASE),
    )


def remainder_compliance(
    mesh: Mesh, poisson: float, load_points: Floats, parities: Sequence[Parity]
) -> tuple[list[Floats], int]:
    """Return the compliance of the remainder between points on the top of a block for each parity, and the dof count.

    A compliance (points, points) [1/mm] is for E = 1. Entry kj is the remainder v_z at point k per unit normal force at
    point j. `load_points` (points, 2) [mm] are the positions of the points. `mesh` is the block, or the half or quarter
    of it at x >= 0 or y >= 0, with the face names of `box_mesh`.

    A parity has one sign for x and one for y, which refer to the planes x = 0 and y = 0. The sign is 1 if each force
    acts together with its even mirror image, and -1 with its odd mirror image. A sign is 0 if both sides of the plane
    are meshed. All parities share the mesh, so ValueError is raised unless their zeros agree. Raises SolveError if a
    solve does not converge, or if a compliance is not symmetric.
    """
    mirrored = np.abs(parities[0])  # for x and y: 1 if the mesh ends at the mirror plane, otherwise 0
    if (np.abs(parities) != mirrored).any():
        msg = f"remainder: parities {parities} must have zeros for the same planes. Group them by their mirror planes."
        raise ValueError(msg)
    mirror_planes = [plane for plane, has_plane in zip(PLANES, mirrored, strict=True) if has_plane]
    problem = _boundary_problem(mesh, poisson, mirror_planes)
    images = _image_signs(mirrored)
    side_fields = [_half_space(load_points * image, poisson, problem.side) for image in images]
    base_fields = [_half_space(load_points * image, poisson, problem.base) for image in images]

    compliances = []
    for parity in parities:
        # The force of an image that is reflected in a plane has the sign of the parity for this plane.
        force_signs = np.where(images < 0, parity, 1).prod(axis=1)
        side_sum = _signed_sum(force_signs, side_fields)
        base_sum = _signed_sum(force_signs, base_fields)
        compliances.append(_solve_compliance(problem, side_sum, base_sum, mirror_dofs(problem.basis, parity)))
    _check_reciprocity(compliances)
    # The mean of a compliance and its transpose removes the small asymmetry that the check has accepted.
    return [0.5 * (compliance + compliance.T) for compliance in compliances], int(problem.basis.N)


def _image_signs(mirrored: Ints) -> Ints:
    """Return the signs of x and y for a load and each of its mirror images, shape (images, 2).

    The signs (1, 1) are the load itself, and (1, -1) is its reflection in the plane y = 0. `mirrored` holds 1 for x and
    for y if the mesh ends at the mirror plane, and otherwise 0.
    """
    signs = [(1, -1) if has_plane else (1,) for has_plane in mirrored]
    return np.array(list(itertools.product(*signs)))


def _solve_compliance(
    problem: _BoundaryProblem, side_fields: HalfSpaceFields, base_fields: HalfSpaceFields, mirror: Ints
) -> Floats:
    """Return the compliance of the remainder (loads, loads) [1/mm] for one parity, from Betti's theorem, for E = 1.

    Let u, t and v be the half-space displacement, the half-space traction and the remainder. Entry kj is

        int_base t^k . u^j - int_sides t^j . u^k - int_sides t^k . v^j + int_base t(v^j) . u^k.

    `side_fields` and `base_fields` hold u and t on the sides and on the base. `mirror` holds the dofs that are zero on
    the mirror planes. Raises SolveError if the solve for v does not converge.
    """
    side_u, side_t = side_fields
    base_u, base_t = base_fields
    v, side_forces, base_v = problem.solve(side_t, base_u, mirror)
    half_space_terms = _work(problem.base, base_t, base_u) - _work(problem.side, side_t, side_u).T
    # `side_forces` and `base_v` are minus the half-space tractions and displacements. In the last term, the nodal
    # reactions of the base replace its tractions.
    reactions = problem.stiffness @ v - side_forces
    return np.asarray(half_space_terms + side_forces.T @ v - base_v.T @ reactions)


def _signed_sum(signs: Ints, fields: Sequence[HalfSpaceFields]) -> HalfSpaceFields:
    """Return the sums of displacements and of tractions over all mirror images, each multiplied by its sign."""
    displacement = np.tensordot(signs, [u for u, _ in fields], 1)
    traction = np.tensordot(signs, [t for _, t in fields], 1)
    return displacement, traction


def _check_reciprocity(compliances: Sequence[Floats]) -> None:
    """Raise SolveError unless all compliances are symmetric. An asymmetry reveals incorrect half-space fields."""
    scale = max(float(np.abs(each).max()) for each in compliances)
    skew = max(float(np.abs(each - each.T).max()) for each in compliances)
    if not skew <= RECIPROCITY_LIMIT * scale:
        msg = (
            f"remainder: relative asymmetry of the compliance = {skew / scale:.1e} must be at most "
            f"{RECIPROCITY_LIMIT:.0e}. Use a finer mesh."
        )
        raise SolveError(msg)


def remainder_field(mesh: Mesh, poisson: float, points: Floats, forces: Floats) -> tuple[CellBasis, Floats]:
    """Solve for the remainder of a whole block: the field that corrects the half-space solution for the finite size.

    The forces (n,) [N] act at `points` (n, 2) [mm] on the top. `mesh` is the whole block from `box_mesh`. Returns the
    displacement basis, and the remainder v times E at its dofs (dofs,) [N/mm]. Raises SolveError if the solve does not
    converge.
    """
    problem = _boundary_problem(mesh, poisson, mirror_planes=())
    _, traction = _half_space(points, poisson, problem.side)
    u, _ = _half_space(points, poisson, problem.base)
    # One load case: the sum of the half-space fields of all forces.
    side_traction = np.tensordot(forces, traction, 1)[None]
    base_displacement = np.tensordot(forces, u, 1)[None]
    v, _, _ = problem.solve(side_traction, base_displacement, mirror=np.zeros(0, dtype=np.int64))
    return problem.basis, v[:, 0]


def mirror_dofs(basis: CellBasis, parity: Parity) -> Ints:
    """Return the dofs (n,) of the box that are zero on the mirror planes.

    The mirror planes are the faces x_low and y_low, and `parity` has one sign for each of them. If the sign is 1, the
    displacements normal to the plane are zero. If it is -1, the displacements in the plane are zero. If it is 0, the
    face is not a mirror plane.
    """
    # Displacements along x, y and z are called u^1, u^2 and u^3. The first entry is for x_low, the second for y_low.
    normal_components = (["u^1"], ["u^2"])
    tangential_components = (["u^2", "u^3"], ["u^1", "u^3"])
    dofs = np.zeros(0, dtype=np.int64)
    for axis, sign in enumerate(parity):
        if sign:
            components = normal_components[axis] if sign > 0 else tangential_components[axis]
            dofs = np.union1d(dofs, basis.get_dofs(PLANES[axis]).all(components))
    return dofs


def _quadrature(basis: CellBasis, faces: Mapping[str, Sequence[float]]) -> FaceQuadrature:
    """Return one quadrature rule over several faces of the box, for integrals over all of them at once.

    `faces` maps the name of each face to its outward normal (3,). The facets of the faces are concatenated.
    """
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


def _half_space(points: Floats, poisson: float, faces: FaceQuadrature) -> HalfSpaceFields:
    """Return displacement u and traction t of the half-space on some faces, for a unit force at each point (n, 2)."""
    x = faces.points[0] - points[:, 0, None, None]
    y = faces.points[1] - points[:, 1, None, None]
    potentials = halfspace.point_load(x, y, np.broadcast_to(faces.points[2], x.shape))
    traction = np.einsum("abp...,b...->pa...", halfspace.stress(potentials, poisson), faces.normals)
    return halfspace.displacement(potentials, 1.0, poisson).swapaxes(0, 1), traction


def _load_vector(faces: FaceQuadrature, traction: Floats, size: int) -> Floats:
    """Return the nodal forces int traction . N (dofs, loads) for tractions (loads, 3, facets, q) on some faces.

    `size` is the total number of dofs.
    """
    # Indices: load p, component c, facet f, quadrature point q, node b.
    facet_forces = np.einsum("pcfq,bfq,fq->bcfp", traction, faces.shapes, faces.weights, optimize=True)
    forces = np.zeros((size, len(traction)))
    np.add.at(forces, faces.dofs, facet_forces)
    return forces


def _projection(faces: FaceQuadrature, field: Floats, used_dofs: Ints, size: int) -> Floats:
    """Return the least-squares approximation (dofs, loads) of a field on some faces.

    The field has shape (loads, 3, facets, q), and the approximation has its values at the nodes. Only the dofs
    `used_dofs` are used, and all others are 0. `size` is the total number of dofs. Unlike interpolation, this
    projection leaves an error that does no work on tractions of the same smoothness.
    """
    # Indices: nodes b and d, facet f, quadrature point q.
    mass = np.einsum("bfq,dfq,fq->fbd", faces.shapes, faces.shapes, faces.weights, optimize=True)
    right_side = _load_vector(faces, field, size)
    displacements = np.zeros_like(right_side)
    for component in range(3):  # the mass matrix is the same for x, y and z, so the components are solved separately
        component_dofs = faces.dofs[:, component].T
        used = np.intersect1d(component_dofs, used_dofs)
        matrix = assemble_elements(mass, component_dofs, size)[used][:, used].toarray()
        displacements[used] = np.linalg.solve(matrix, right_side[used])
    return displacements


def _work(faces: FaceQuadrature, traction: Floats, displacement: Floats) -> Floats:
    """Return the work int traction_k . displacement_j over some faces, shape (loads, loads)."""
    weighted = (traction * faces.weights).reshape(len(traction), -1)
    return weighted @ displacement.reshape(len(displacement), -1).T
