"""The stiffness of the two flexures of a printed housing in its mount, from the displacements of the tips per force.

The mesh is the half y >= 0, but all forces are forces on the whole part. Arrays over tips are in the order of
`SPRINGS`. The elements are 20-node hexahedra with 2^3 Gauss points; with full integration, a leaf would need eight
times as many elements.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from skfem import CellBasis, Mesh

from sensor.arrays import Floats
from solve.error_estimate import SolveInfo
from solve.housing.clamped_half import (
    CROSS_AXIS,
    LENGTH_AXIS,
    POINTS,
    PRESS_AXIS,
    WEIGHTS,
    ClampedHalf,
    check_tip_loads,
    clamped_half,
    face_mean,
    weight_load,
    with_symmetry,
)
from solve.housing.elastic_layer import ElasticLayer
from solve.surface import surface_patches

PerTip = tuple[float, ...]

SPRINGS = ("low", "high")  # names of the springs; all results are in this order

# Error bar of the stiffness divided by the difference between the meshes. For designs in all print processes, the
# error was determined with a mesh of 4.5 times as many dofs. It is at most 0.23 times this difference, with a median of
# 0.07 (tests/reference/fits/test_housing.py). The fit of the springs widens the error bar for leaves of unusual shape,
# and adds a floor.
ERROR_SHARE = 0.2
# Error bar of the strain divided by the increase in strain that results from extrapolation to element edges. The
# largest ratio found is 1.1, and 0.85 in tests/reference/fits/test_housing.py.
STRAIN_ERROR_SHARE = 1.5
WEIGHT_SAG_ERROR_SHARE = 1.0  # error bar of the sag divided by the difference between the meshes
# Matrix that linearly extrapolates values at the two Gauss points of an edge to the ends of the edge.
_EXTRAPOLATION = 0.5 * np.array([[1.0 + np.sqrt(3.0), 1.0 - np.sqrt(3.0)], [1.0 - np.sqrt(3.0), 1.0 + np.sqrt(3.0)]])


def tip_face(spring: str) -> str:
    """Return the name of the mesh boundary on the face of a spring's tip."""
    return f"{spring}_tip"


def leaf_faces(spring: str) -> str:
    """Return the name of the mesh boundary on the faces of a spring's leaves."""
    return f"{spring}_leaves"


@dataclass(frozen=True, kw_only=True, eq=False)
class TipCompliance:
    """The solution on one mesh: C[i, j] is the displacement of tip i along the press per force on tip j [mm/N].

    The fields of type `PerTip` have one value per tip. `strain_per_N` [1/N] is the largest principal strain on the
    leaves of a flexure per force on its tip, extrapolated to element edges. `strain_inside_per_N` [1/N] is the largest
    value at the Gauss points. `tilt_per_N` [rad/N] is the rotation of a tip's face in the plane of the plate.
    `weight_sag` [mm^4/N] is the displacement of a tip along the press per body force along the press.
    `weight_sag_lengthwise` [mm^4/N] is the same displacement per body force along x.
    """

    C: Floats
    strain_per_N: PerTip
    strain_inside_per_N: PerTip
    tilt_per_N: PerTip
    weight_sag: PerTip
    weight_sag_lengthwise: PerTip
    dofs: int
    seconds: float

    @property
    def K(self) -> PerTip:
        """Return the stiffness of each flexure [N/mm], with the other tips unloaded."""
        return tip_stiffnesses(self.C)


@dataclass(frozen=True, kw_only=True, eq=False)
class HousingStiffness:
    """The solution on the fine mesh, with the relative errors of its values [1].

    `error` is the relative error of the stiffness K. `strain_error` and `weight_sag_error` are the relative errors of
    `strain_per_N` and `weight_sag`. The other fields are described in `TipCompliance`.
    """

    C: Floats
    error: PerTip
    strain_per_N: PerTip
    strain_error: PerTip
    tilt_per_N: PerTip
    weight_sag: PerTip
    weight_sag_error: PerTip
    weight_sag_lengthwise: PerTip
    info: SolveInfo

    @property
    def K(self) -> PerTip:
        """Return the stiffness of each flexure on the fine mesh [N/mm], with the other tips unloaded."""
        return tip_stiffnesses(self.C)


def tip_stiffnesses(C: Floats) -> PerTip:
    """Return the stiffness of each flexure [N/mm], with the other tips unloaded, from C (tips, tips) [mm/N]."""
    return tuple(1.0 / float(compliance) for compliance in np.diag(C))


def housing_stiffness(fine: TipCompliance, coarse: TipCompliance) -> HousingStiffness:
    """Return the solution on the fine mesh, with errors estimated from the difference between the two meshes.

    The arguments are the solutions on a fine and a coarse mesh of the same housing. The strain error is instead
    estimated from the increase in strain that results from extrapolation to element edges on the fine mesh.
    """
    return HousingStiffness(
        C=fine.C,
        error=_relative_errors(fine.K, coarse.K, ERROR_SHARE),
        strain_per_N=fine.strain_per_N,
        strain_error=_relative_errors(fine.strain_per_N, fine.strain_inside_per_N, STRAIN_ERROR_SHARE),
        tilt_per_N=fine.tilt_per_N,
        weight_sag=fine.weight_sag,
        weight_sag_error=_relative_errors(fine.weight_sag, coarse.weight_sag, WEIGHT_SAG_ERROR_SHARE),
        weight_sag_lengthwise=fine.weight_sag_lengthwise,
        info=SolveInfo(
            method="20-node hexahedra",
            dofs=fine.dofs,
            seconds=fine.seconds + coarse.seconds,
            status=f"20-node hexahedra; error from meshes of {coarse.dofs} and {fine.dofs} dofs",
        ),
    )


def _relative_errors(fine: PerTip, coarse: PerTip, fraction: float) -> PerTip:
    """Return `fraction` times the relative difference [1] between the values on the fine and the coarse mesh."""
    return tuple(fraction * abs(b / a - 1.0) for a, b in zip(fine, coarse, strict=True))


def tip_compliance(mesh: Mesh, E: float, poisson: float, layers: Sequence[ElasticLayer] = ()) -> TipCompliance:
    """Return the compliance of all tips along the press, solved on one mesh [mm] of the half y >= 0.

    `E` [MPa] and `poisson` are the elastic constants of the housing. The load is uniform over the face of a tip, and
    the displacement is the mean over the face. The housing rests on the `layers`; without layers, its mounting holes
    are clamped. Raises SolveError if the linear solve fails, or if the balance of forces or the reciprocity of the
    loads is violated.
    """
    start = time.perf_counter()
    compliance = compliance_of(clamped_half(mesh, E, poisson, layers))
    return replace(compliance, seconds=time.perf_counter() - start)  # includes the assembly and the factorisation


def compliance_of(half: ClampedHalf) -> TipCompliance:
    """Return the compliance, strains and sags of a half housing whose matrix is already factorised.

    `half` is factorised for loads along the press. The reported `seconds` do not include its assembly and
    factorisation. Raises SolveError if the linear solve fails, or if the balance of forces or the reciprocity of the
    loads is violated.
    """
    start = time.perf_counter()
    basis = half.basis
    # The product of a column of `means` with displacements is the mean displacement of a tip. The column is also a
    # uniform load of 1 N on the tip.
    means = tip_means(basis, PRESS_AXIS)
    # The loads act on half the housing, so 1 N on a whole tip is 0.5 `means`. The other two loads are body forces along
    # the press and along x.
    loads = [0.5 * means, weight_load(half, PRESS_AXIS), weight_load(half, LENGTH_AXIS)]
    solution = half.factor.solve(np.column_stack(loads))
    u = solution[:, : len(SPRINGS)]  # displacements due to 1 N on each tip
    sag, lengthwise_sag = solution[:, len(SPRINGS) :].T @ means  # one value per tip for each body force
    check_tip_loads(0.5 * means.T @ u, half.support(u), half.round_off(u))

    own_loads = list(zip(SPRINGS, u.T, strict=True))  # each flexure under the force on its own tip
    tilts = [face_mean(basis, tip_face(spring), PRESS_AXIS, slope=LENGTH_AXIS) @ own_u for spring, own_u in own_loads]
    strains = [largest_strain(basis, leaf_faces(spring), own_u) for spring, own_u in own_loads]
    C = means.T @ u
    return TipCompliance(
        C=0.5 * (C + C.T),  # removes the asymmetry due to round-off
        strain_per_N=tuple(at_corners for at_corners, _ in strains),
        strain_inside_per_N=tuple(inside for _, inside in strains),
        tilt_per_N=tuple(float(tilt) for tilt in tilts),
        weight_sag=tuple(sag.tolist()),
        weight_sag_lengthwise=tuple(lengthwise_sag.tolist()),
        dofs=int(basis.N),
        seconds=time.perf_counter() - start,
    )


def largest_strain(basis: CellBasis, name: str, u: Floats) -> tuple[float, float]:
    """Return the largest absolute principal strain on a named surface [1], at facet corners and at Gauss points.

    `u` (dofs,) [mm] are the displacements. The value at the corners is extrapolated bilinearly from the Gauss points.
    Strain is most accurate at the Gauss points, but its peak may lie between them and the edges of a facet. The
    difference between the two values therefore indicates the error.
    """
    to_corners = np.kron(_EXTRAPOLATION, _EXTRAPOLATION)  # from the 2^2 Gauss points of a facet to its 4 corners
    at_corners = 0.0
    at_points = 0.0
    for patch in surface_patches(basis, name, POINTS, WEIGHTS):
        # The indices in `einsum` are node n, axes i and j, facet e, Gauss point p and corner q.
        gradient = np.einsum("nie,njep->epij", u[patch.dofs], patch.gradients)
        strain = 0.5 * (gradient + gradient.swapaxes(2, 3))
        corners = np.einsum("qp,epij->eqij", to_corners, strain)
        principal_at_corners = np.linalg.eigvalsh(corners)
        principal_at_points = np.linalg.eigvalsh(strain)
        at_corners = max(at_corners, float(np.abs(principal_at_corners).max()))
        at_points = max(at_points, float(np.abs(principal_at_points).max()))
    return at_corners, at_points


def sideways_stiffness(mesh: Mesh, E: float, poisson: float, layers: Sequence[ElasticLayer] = ()) -> PerTip:
    """Return the lateral stiffness of each tip [N/mm]: force divided by displacement along y, normal to the plate.

    `mesh` [mm] is the half y >= 0 of a housing with modulus E [MPa] and Poisson's ratio. The housing rests on the
    `layers`; without layers, its mounting holes are clamped. Raises SolveError if the linear solve fails or the
    reciprocity of the loads is violated. The balance of forces is not checked, because the plane of symmetry carries a
    part of the load.
    """
    half = clamped_half(mesh, E, poisson, layers, CROSS_AXIS)
    means = tip_means(half.basis, CROSS_AXIS)
    u = half.factor.solve(0.5 * means)  # half of 1 N acts on the half mesh
    check_tip_loads(0.5 * means.T @ u, None)
    return tip_stiffnesses(means.T @ u)


def lever_compliance(half: ClampedHalf, lever: float) -> Floats:
    """Return the compliance of points at a distance from the tips [mm/N], shape (tips, tips, 3, 3).

    Each point moves rigidly with the face of its tip, at a distance `lever` [mm] along the press from the middle of the
    face. Entry (i, j, a, b) is the displacement of point i along axis a per force along axis b at point j. Rotation of
    a face about the press axis is neglected. `half` is factorised for loads along the press. Raises SolveError if the
    linear solve fails or the reciprocity of the loads is violated.
    """
    # Loads along x and along the press are symmetric about y = 0, and loads along y are antisymmetric. The two kinds of
    # load need different boundary conditions on the plane of symmetry, so they are solved separately.
    antisymmetric_half = with_symmetry(half, CROSS_AXIS)
    symmetric_means = {
        LENGTH_AXIS: _lateral_point_means(half.basis, LENGTH_AXIS, lever),
        PRESS_AXIS: tip_means(half.basis, PRESS_AXIS),  # along the press, a point moves with the middle of its face
    }
    antisymmetric_means = {CROSS_AXIS: _lateral_point_means(antisymmetric_half.basis, CROSS_AXIS, lever)}

    compliance = np.zeros((len(SPRINGS), len(SPRINGS), 3, 3))  # entries that couple the two kinds of load remain 0
    tips = range(len(SPRINGS))
    for held_half, point_means in ((half, symmetric_means), (antisymmetric_half, antisymmetric_means)):
        axes = tuple(point_means)
        compliance[np.ix_(tips, tips, axes, axes)] += _point_compliance(held_half, list(point_means.values()))
    return compliance


def _point_compliance(half: ClampedHalf, point_means: Sequence[Floats]) -> Floats:
    """Return the compliance between points on the tips along several axes [mm/N], shape (tips, tips, axes, axes).

    For each axis, `point_means` holds the vectors (dofs, tips) whose products with displacements are the displacements
    of the points along this axis. Raises SolveError if the linear solve fails or the reciprocity of the loads is
    violated.
    """
    vectors = np.column_stack(point_means)  # (dofs, axes times tips)
    # Each vector is also a load of 1 N at a point, of which half acts on the half mesh.
    u = half.factor.solve(0.5 * vectors)
    check_tip_loads(0.5 * vectors.T @ u, None)
    # Reorder the array axes from (axis, tip, axis, tip) to (tip, tip, axis, axis).
    shape = (len(point_means), len(SPRINGS))
    return np.asarray((vectors.T @ u).reshape(*shape, *shape).transpose(1, 3, 0, 2))


def _lateral_point_means(basis: CellBasis, axis: int, lever: float) -> Floats:
    """Return vectors (dofs, tips) whose products with displacements are the displacements of points along `axis`.

    `axis` is LENGTH_AXIS or CROSS_AXIS. Each point lies at a distance `lever` [mm] along the press from the middle of a
    tip's face. It moves by the displacement of the face, minus the rotation of the face times the lever.
    """
    tilts = np.column_stack([face_mean(basis, tip_face(spring), PRESS_AXIS, slope=axis) for spring in SPRINGS])
    return tip_means(basis, axis) - lever * tilts


def displacements(half: ClampedHalf) -> Floats:
    """Return the displacements due to 1 N along the press on each tip [mm], shape (dofs, tips).

    Raises SolveError if the linear solve fails, or if the balance of forces or the reciprocity of the loads is
    violated.
    """
    means = tip_means(half.basis, PRESS_AXIS)
    u = half.factor.solve(0.5 * means)  # half of 1 N acts on the half mesh
    check_tip_loads(0.5 * means.T @ u, half.support(u), half.round_off(u))
    return u


def tip_means(basis: CellBasis, axis: int) -> Floats:
    """Return vectors (dofs, tips) whose products with displacements are the mean displacement of each tip along `axis`.

    The mean is taken over the face of the tip.
    """
    return np.column_stack([face_mean(basis, tip_face(spring), axis) for spring in SPRINGS])
