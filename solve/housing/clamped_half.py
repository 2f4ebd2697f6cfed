"""One half of a housing in its mount: its displacement basis, its factorised stiffness matrix and solution checks."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csc_matrix
from skfem import CellBasis, ElementHexS2, Mesh
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet, RefTri

from sensor.arrays import Floats, Ints
from solve.displacement_basis import scalar_shapes
from solve.elasticity import stiffness_matrix, vector_basis
from solve.housing.elastic_layer import ElasticLayer, layer_matrix
from solve.linear import Factor, SolveError, factorise, magnitude
from solve.surface import surface_patches

HOLES = "mounting_holes"
SIDES = "side_faces"
# Largest asymmetry of the mutual work divided by the largest work [1], and largest error of a support force [N].
BALANCE_LIMIT = 1e-5
REDUCED = 3  # polynomial degree of the reduced integration, which has 2^3 Gauss points
_GAUSS = np.array([0.5 - 0.5 / np.sqrt(3.0), 0.5 + 0.5 / np.sqrt(3.0)])
POINTS = np.array([np.repeat(_GAUSS, 2), np.tile(_GAUSS, 2)])  # 2^2 Gauss points of the unit square
WEIGHTS = np.full(4, 0.25)
_TRIANGLE_ORDER = 4  # polynomial degree of the quadrature on triangular facets


# The axes x, y and z.
LENGTH_AXIS = 0
CROSS_AXIS = 1
PRESS_AXIS = 2
# The displacement components that are 0 on the plane of symmetry y = 0, under a load along PRESS_AXIS or CROSS_AXIS.
# In scikit-fem, "u^1", "u^2" and "u^3" are the components along x, y and z.
SYMMETRY = {PRESS_AXIS: ("u^2",), CROSS_AXIS: ("u^1", "u^3")}


@dataclass(frozen=True, eq=False)
class ClampedHalf:
    """The half y >= 0 of a housing, mounted on elastic layers on a rigid ground or by clamped mounting holes.

    `matrix` [N/mm] is the stiffness matrix. `ground` is the contribution of the layers to it, or None without layers.
    `clamped` holds the dofs of the mounting holes; it is empty if there are layers. `factor` is the factorised matrix,
    in which these dofs and the dofs of the plane of symmetry are held at 0.
    """

    basis: CellBasis
    matrix: csc_matrix
    ground: csc_matrix | None
    clamped: Ints
    factor: Factor

    def support(self, u: Floats) -> Floats:
        """Return the force of the mount on the half along the press [N], shape (loads,).

        `u` (dofs, loads) [mm] are the displacements.
        """
        if self.ground is not None:
            return -np.asarray((self.ground @ u)[self._vertical].sum(axis=0))
        held = np.intersect1d(self.clamped, self._vertical)
        return np.asarray((self.matrix @ u)[held].sum(axis=0))

    def round_off(self, u: Floats) -> float:
        """Return the round-off error of `support` [N], for displacements u (dofs, loads) [mm].

        The support force is a small sum of large nodal forces, so its relative error can be large. The result is the
        largest error of all loads.
        """
        magnitudes = (magnitude(self.matrix) @ np.abs(u))[self._vertical].sum(axis=0)
        return float(np.finfo(np.float64).eps * magnitudes.max())

    @property
    def _vertical(self) -> Ints:
        """Return the dofs of the displacement along the press, at corners and at midpoints of edges."""
        return np.concatenate([self.basis.nodal_dofs[PRESS_AXIS], self.basis.edge_dofs[PRESS_AXIS]])


def clamped_half(
    mesh: Mesh, E: float, poisson: float, layers: Sequence[ElasticLayer] = (), axis: int = PRESS_AXIS
) -> ClampedHalf:
    """Assemble and factorise half a housing with modulus E [MPa] and Poisson's ratio, for loads along an axis.

    `mesh` [mm] is the half y >= 0, or a whole part without a boundary named "symmetry". `axis` is PRESS_AXIS or
    CROSS_AXIS. The housing rests on the `layers`; without layers, its mounting holes are clamped. Raises SolveError if
    nothing holds the housing, or if its matrix is too large.
    """
    basis = vector_basis(mesh, ElementHexS2(), order=REDUCED)
    matrix = stiffness_matrix(basis, E, poisson)
    if layers:
        ground = layer_matrix(basis, layers, E, poisson)
        matrix = csc_matrix(matrix + ground)
        clamped = np.zeros(0, dtype=np.int64)  # only the layers hold the housing
    else:
        ground = None
        clamped = basis.get_dofs(HOLES).all()
    factor = factorise(matrix, np.union1d(clamped, _symmetry_dofs(basis, axis)))
    return ClampedHalf(basis=basis, matrix=matrix, ground=ground, clamped=clamped, factor=factor)


def _symmetry_dofs(basis: CellBasis, axis: int) -> Ints:
    """Return the dofs that are 0 on the plane of symmetry, under a load along `axis`, PRESS_AXIS or CROSS_AXIS.

    The result is empty if the whole part is meshed, without a boundary named "symmetry".
    """
    if "symmetry" not in (basis.mesh.boundaries or {}):
        return np.zeros(0, dtype=np.int64)
    plane = basis.get_dofs("symmetry")
    return np.concatenate([plane.all(component) for component in SYMMETRY[axis]])


def with_symmetry(half: ClampedHalf, axis: int) -> ClampedHalf:
    """Return the same half, factorised for loads along another axis.

    The axis of the load determines which displacement components are 0 on the plane of symmetry. The matrix is
    therefore factorised again.
    """
    held = np.union1d(half.clamped, _symmetry_dofs(half.basis, axis))
    return replace(half, factor=factorise(half.matrix, held))


def facet_rule(mesh: Mesh) -> tuple[Floats, Floats]:
    """Return the points (2, q) and weights (q,) [1] of a quadrature rule on the facets of hexahedra or tetrahedra."""
    if mesh.refdom is RefTet:
        points, weights = get_quadrature(RefTri, _TRIANGLE_ORDER)
        return points, weights
    return POINTS, WEIGHTS


def face_mean(basis: CellBasis, name: str, axis: int, *, slope: int | None = None) -> Floats:
    """Return the vector (dofs,) whose product with displacements is the mean over a face of their component `axis`.

    `name` is the boundary of the mesh on the face. With `slope`, LENGTH_AXIS or CROSS_AXIS, the product is instead the
    least-squares slope [rad] of the component along this axis. Half of the vector is also a load on the half mesh: it
    represents 1 N on the whole face or, with `slope`, a moment of 1 N mm.
    """
    patches = list(surface_patches(basis, name, *facet_rule(basis.mesh)))
    # The coordinate of the centre of the whole face along the axis of the slope [mm]. Along y it is 0, because the
    # other half of the face lies beyond the plane of symmetry.
    centre = 0.0
    if slope == LENGTH_AXIS:
        area = sum(float(patch.weights.sum()) for patch in patches)
        centre = sum(float((patch.points[LENGTH_AXIS] * patch.weights).sum()) for patch in patches) / area

    # The mean of u is int u / int 1. The slope of u is int u (x - centre) / int (x - centre)^2. Both quotients have the
    # form int u lever / int lever^2, with a lever of 1 for the mean and of x - centre for the slope.
    integral = np.zeros(basis.N)
    norm = 0.0
    for patch in patches:
        lever = np.ones_like(patch.weights) if slope is None else patch.points[slope] - centre
        np.add.at(integral, patch.dofs[:, axis], (patch.shapes * lever * patch.weights).sum(axis=2))
        norm += float((lever**2 * patch.weights).sum())
    return integral / norm


def weight_load(half: ClampedHalf, axis: int) -> Floats:
    """Return the nodal forces [N] due to a body force of 1 N/mm^3 along an axis, shape (dofs,)."""
    basis = half.basis
    load = np.zeros(basis.N)
    forces = scalar_shapes(basis) @ basis.dx.T
    np.add.at(load, np.asarray(basis.element_dofs)[axis::3], forces)
    return load


def check_tip_loads(work: Floats, support: Floats | None, round_off: float = 0.0) -> None:
    """Raise SolveError unless the loads on tips satisfy Betti's theorem and the mount carries each load completely.

    `work[i, j]` [N mm] is the work of load i on the displacements due to load j. `support` (loads,) [N] is the force of
    the mount. It must balance 0.5 N, the load on the half mesh for 1 N on the whole tip. The tolerance is 1e-5 N or, if
    larger, the numerical error `round_off` [N] of `support`. `support` is None if the plane of symmetry carries a part
    of the load; the balance is then not checked.
    """
    asymmetry = float(np.abs(work - work.T).max())
    # Both comparisons are negated, so that nan is rejected too.
    if not asymmetry <= BALANCE_LIMIT * float(np.abs(work).max()):
        msg = (
            f"flexure: the work of one load on the displacements due to another differs by {asymmetry:.1e} N mm from "
            "the reverse, but both must be equal. Check that the matrix is symmetric."
        )
        raise SolveError(msg)
    imbalance = 0.0 if support is None else float(np.abs(support + 0.5).max())
    tolerance = max(BALANCE_LIMIT, round_off)
    if not imbalance <= tolerance:
        msg = (
            f"flexure: the force of the mount and the load of 0.5 N on half a tip differ by {imbalance:.1e} N. The "
            f"difference must be at most {tolerance:.0e} N. Check what holds the housing."
        )
        raise SolveError(msg)
