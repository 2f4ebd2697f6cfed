"""The stiffness of both flexures of a printed housing in its mount, from the displacement of a tip per force on it.

The mesh is the half y >= 0, but all forces are forces on the whole part. Arrays over tips have the order of `SPRINGS`.
Elements are 20-node hexahedra with 2^3 Gauss points; with full integration, a leaf would need eight times as many.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from skfem import CellBasis, Mesh

from sensor.arrays import Floats
from solve.error_estimate import SolveInfo
from solve.housing.clamped_half import (
    ACROSS,
    LENGTHWISE,
    POINTS,
    PRESS,
    WEIGHTS,
    ClampedHalf,
    check_tips,
    clamped_half,
    face_mean,
    weight_load,
    with_symmetry,
)
from solve.housing.elastic_layer import ElasticLayer
from solve.surface import surface_patches

PerTip = tuple[float, ...]

SPRINGS = ("low", "high")  # names of the springs, in the order of all results

# Error bar over the difference from the coarse mesh. Compared with a mesh of 4.5 times as many dofs, the error is at
# most 0.23 of this difference for designs in all print processes, with a median of 0.07
# (tests/reference/fits/test_housing.py). The fit of the springs adds a floor, and more for leaves of unusual shape.
ERROR_SHARE = 0.2
# Error bar over the increase in strain due to its extrapolation to element edges. The largest ratio found is 1.1,
# and 0.85 in tests/reference/fits/test_housing.py.
STRAIN_ERROR_SHARE = 1.5
# Linear extrapolation from the two Gauss points of an edge to its ends.
_EXTRAPOLATION = 0.5 * np.array([[1.0 + np.sqrt(3.0), 1.0 - np.sqrt(3.0)], [1.0 - np.sqrt(3.0), 1.0 + np.sqrt(3.0)]])


def tip_face(spring: str) -> str:
    """Return the name of the face of a spring's tip in the mesh."""
    return f"{spring}_tip"


def leaf_faces(spring: str) -> str:
    """Return the name of the faces of a spring's leaves in the mesh."""
    return f"{spring}_leaves"


@dataclass(frozen=True, kw_only=True, eq=False)
class TipCompliance:
    """The solution on one mesh: C[i, j] is the displacement of tip i along the press per force on tip j [mm/N].

    All other fields have a value for each tip. `strain_per_N` is the largest principal strain on a flexure's leaves per
    force on its tip [1/N], extrapolated to the edges of elements. `strain_inside_per_N` is the same at the Gauss
    points. `tilt_per_N` is the rotation of a tip's face in the plane of the plate [rad/N]. `weight_sag` [mm^4/N] is the
    displacement of a tip along the press per body force along the press, and `weight_sag_lengthwise` per body force
    along x.
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
        """Return the stiffness of each tip with the other tips unloaded [N/mm]."""
        return tip_stiffnesses(self.C)


@dataclass(frozen=True, kw_only=True, eq=False)
class HousingStiffness:
    """The solution on the fine mesh with relative errors [1]: `error` of the stiffness K, and errors of other fields.

    The other fields are as in `TipCompliance`.
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
        """Return the stiffness of each flexure with the other tips unloaded [N/mm]."""
        return tip_stiffnesses(self.C)


def tip_stiffnesses(C: Floats) -> PerTip:
    """Return the stiffness of each tip with the others unloaded [N/mm], from the compliance (tips, tips) [mm/N]."""
    return tuple(1.0 / float(compliance) for compliance in np.diag(C))


def housing_stiffness(fine: TipCompliance, coarse: TipCompliance) -> HousingStiffness:
    """Return the solution on the fine mesh, with errors estimated from the difference between both meshes.

    The error of the strain is estimated from the increase due to its extrapolation to element edges.
    """
    return HousingStiffness(
        C=fine.C,
        error=_relative_errors(fine.K, coarse.K, ERROR_SHARE),
        strain_per_N=fine.strain_per_N,
        strain_error=_relative_errors(fine.strain_per_N, fine.strain_inside_per_N, STRAIN_ERROR_SHARE),
        tilt_per_N=fine.tilt_per_N,
        weight_sag=fine.weight_sag,
        weight_sag_error=_relative_errors(fine.weight_sag, coarse.weight_sag, 1.0),
        weight_sag_lengthwise=fine.weight_sag_lengthwise,
        info=SolveInfo(
            method="20-node hexahedra",
            dofs=fine.dofs,
            seconds=fine.seconds + coarse.seconds,
            status=f"20-node hexahedra; error from meshes of {coarse.dofs} and {fine.dofs} dofs",
        ),
    )


def _relative_errors(fine: PerTip, coarse: PerTip, fraction: float) -> PerTip:
    """Return the relative errors [1] of fine values: `fraction` times their relative difference from coarse ones."""
    return tuple(fraction * abs(b / a - 1.0) for a, b in zip(fine, coarse, strict=True))


def tip_compliance(mesh: Mesh, E: float, poisson: float, layers: Sequence[ElasticLayer] = ()) -> TipCompliance:
    """Return the compliance of all tips along the press, on one mesh [mm] of the half y >= 0.

    E is in MPa. The load is uniform over the face of a tip, and its displacement is the mean over the face. The housing
    rests on the `layers`; without layers, its mounting holes are clamped. Raises SolveError if the linear solve, the
    balance of forces or the reciprocity of the loads fails.
    """
    start = time.perf_counter()
    return compliance_of(clamped_half(mesh, E, poisson, layers), start)


def compliance_of(half: ClampedHalf, start: float | None = None) -> TipCompliance:
    """Return the compliance, strains and sags of all tips of a half housing, whose matrix is already factorised.

    `start` is the time at which the caller began to assemble the half, so that `seconds` includes this; by default it
    is now. Raises the SolveErrors of `tip_compliance`.
    """
    start = time.perf_counter() if start is None else start
    basis = half.basis
    mean = tip_means(basis, PRESS)
    # Loads on the half: 0.5 `mean` is 1 N on a whole tip. The other two are body forces along the press and along x.
    loads = [0.5 * mean, weight_load(half, PRESS), weight_load(half, LENGTHWISE)]
    solution = half.factor.solve(np.column_stack(loads))
    u = solution[:, : len(SPRINGS)]
    sag, lengthwise_sag = solution[:, len(SPRINGS) :].T @ mean
    check_tips(0.5 * mean.T @ u, half.support(u), half.round_off(u))

    tilt = []
    strain = []
    strain_inside = []
    for j, spring in enumerate(SPRINGS):
        tilt.append(float(face_mean(basis, tip_face(spring), PRESS, slope=LENGTHWISE) @ u[:, j]))
        at_corners, inside = largest_strain(basis, leaf_faces(spring), u[:, j])
        strain.append(at_corners)
        strain_inside.append(inside)
    C = mean.T @ u
    return TipCompliance(
        C=0.5 * (C + C.T),
        strain_per_N=tuple(strain),
        strain_inside_per_N=tuple(strain_inside),
        tilt_per_N=tuple(tilt),
        weight_sag=tuple(sag.tolist()),
        weight_sag_lengthwise=tuple(lengthwise_sag.tolist()),
        dofs=int(basis.N),
        seconds=time.perf_counter() - start,
    )


def largest_strain(basis: CellBasis, name: str, u: Floats) -> tuple[float, float]:
    """Return two values of the largest principal strain magnitude [1] on a named surface, for displacements u (dofs,).

    The first is extrapolated bilinearly to the corners of the facets, the second is at their Gauss points. Strain is
    most accurate at the Gauss points, but its peak may lie between them and the edges of a facet.
    """
    at_corners = 0.0
    at_points = 0.0
    for patch in surface_patches(basis, name, POINTS, WEIGHTS):
        # indices: node n, axes i and j, facet e, Gauss point p, corner q
        gradient = np.einsum("nie,njep->epij", u[patch.dofs], patch.gradients)
        strain = 0.5 * (gradient + gradient.swapaxes(2, 3))
        corners = np.einsum("qp,epij->eqij", np.kron(_EXTRAPOLATION, _EXTRAPOLATION), strain)
        at_corners = max(at_corners, float(np.abs(np.linalg.eigvalsh(corners)).max()))
        at_points = max(at_points, float(np.abs(np.linalg.eigvalsh(strain)).max()))
    return at_corners, at_points


def sideways_stiffness(mesh: Mesh, E: float, poisson: float, layers: Sequence[ElasticLayer] = ()) -> PerTip:
    """Return the lateral stiffness of each tip [N/mm]: force over displacement along y, normal to the plate.

    The arguments and errors are those of `tip_compliance`, but the balance of forces is not checked.
    """
    half = clamped_half(mesh, E, poisson, layers, ACROSS)
    mean = tip_means(half.basis, ACROSS)
    u = half.factor.solve(0.5 * mean)
    check_tips(0.5 * mean.T @ u, None)
    return tip_stiffnesses(mean.T @ u)


def lever_compliance(half: ClampedHalf, lever: float) -> Floats:
    """Return the compliance [mm/N] of points at a distance from the tips, shape (tips, tips, 3, 3).

    Each point moves rigidly with the face of its tip, at a distance `lever` [mm] along the press from the middle of the
    face. Entry (i, j, a, b) is the displacement of point i along axis a per force along axis b at point j. Rotation of
    a face about the press is neglected. `half` is factorised for loads along the press. Raises SolveError if the linear
    solve or the reciprocity of the loads fails.
    """
    compliance = np.zeros((len(SPRINGS), len(SPRINGS), 3, 3))
    # Loads along x and along the press are symmetric about y = 0; loads along y are antisymmetric. So they are solved
    # separately, with what the plane of symmetry holds in each case. `level` is the lateral axis, x or y.
    for part, level in ((half, LENGTHWISE), (with_symmetry(half, ACROSS), ACROSS)):
        slopes = [face_mean(part.basis, tip_face(spring), PRESS, slope=level) for spring in SPRINGS]
        tilts = np.column_stack(slopes)
        # The displacement of a point is that of its face, minus the rotation of the face times the lever.
        displacement = {level: tip_means(part.basis, level) - lever * tilts}
        if level == LENGTHWISE:
            displacement[PRESS] = tip_means(part.basis, PRESS)
        axes = tuple(displacement)
        vectors = np.column_stack(list(displacement.values()))  # (dofs, axes times tips)
        u = part.factor.solve(0.5 * vectors)
        check_tips(0.5 * vectors.T @ u, None)
        # Reorder from (axis, tip, axis, tip) to (tip, tip, axis, axis).
        shape = (len(axes), len(SPRINGS))
        entries = np.ix_(range(len(SPRINGS)), range(len(SPRINGS)), axes, axes)
        compliance[entries] += (vectors.T @ u).reshape(*shape, *shape).transpose(1, 3, 0, 2)
    return compliance


def displacements(half: ClampedHalf) -> Floats:
    """Return the displacements [mm] due to 1 N along the press on each tip, shape (dofs, tips).

    Raises SolveError if the linear solve, the balance of forces or the reciprocity of the loads fails.
    """
    mean = tip_means(half.basis, PRESS)
    u = half.factor.solve(0.5 * mean)
    check_tips(0.5 * mean.T @ u, half.support(u), half.round_off(u))
    return u


def tip_means(basis: CellBasis, axis: int) -> Floats:
    """Return the vectors (dofs, tips) whose products with displacements are the means over tips of a component."""
    return np.column_stack([face_mean(basis, tip_face(spring), axis) for spring in SPRINGS])
