"""Stiffness of both flexures as printed: the housing in its mount, a force on a tip, and the tip's displacement.

The mesh is the half y >= 0; forces are on the whole part. Tips are in the order of the names of their springs. Elements
are 20-node hexahedra with 2^3 Gauss points; with full integration a leaf would need eight times as many.
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

SPRINGS = ("low", "high")  # names of the springs, in the order of every result

# Error over the difference to the coarse mesh. With a mesh of 4.5 times the dofs, it is at most 0.23 for designs in all
# processes; the median is 0.07 (tests/reference/fits/test_housing.py). The fit of the springs adds a floor, and more
# for leaves of unusual shape.
ERROR_SHARE = 0.2
# Error over the increase by extrapolating the strain to the edges of the elements. At most 1.1 was found, and 0.85 in
# tests/reference/fits/test_housing.py.
STRAIN_ERROR_SHARE = 1.5
# Linear extrapolation from two Gauss points of an edge to its ends.
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

    C has shape (tips, tips); all other fields have a number per tip. `strain_per_N` is the largest principal strain on
    a flexure's leaves per force on its tip [1/N], extrapolated to the edges of the elements. `strain_inside_per_N` is
    the largest one inside them. `tilt_per_N` is the rotation of a tip's face in the plane of the plate [rad/N].
    `weight_sag` [mm^4/N] is the displacement of a tip along the press per body force along the press.
    `weight_sag_lengthwise` is the same for a body force along x.
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
        """Return the stiffness of each tip with the other tips free [N/mm]."""
        return tip_stiffnesses(self.C)


@dataclass(frozen=True, kw_only=True, eq=False)
class HousingStiffness:
    """The compliance C, the relative error of each stiffness [1], and the other fields as in `TipCompliance`."""

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
        """Return the stiffness of each flexure with the other tips free [N/mm]."""
        return tip_stiffnesses(self.C)


def tip_stiffnesses(C: Floats) -> PerTip:
    """Return the stiffness of each tip with the other tips free [N/mm], from the compliance (tips, tips) [mm/N]."""
    return tuple(1.0 / float(compliance) for compliance in np.diag(C))


def housing_stiffness(fine: TipCompliance, coarse: TipCompliance) -> HousingStiffness:
    """Return the result of the fine mesh, with its error estimated from the difference to the coarse mesh.

    The error of the strain is estimated from its extrapolation to the edges of the elements.
    """
    return HousingStiffness(
        C=fine.C,
        error=_differences(fine.K, coarse.K, ERROR_SHARE),
        strain_per_N=fine.strain_per_N,
        strain_error=_differences(fine.strain_per_N, fine.strain_inside_per_N, STRAIN_ERROR_SHARE),
        tilt_per_N=fine.tilt_per_N,
        weight_sag=fine.weight_sag,
        weight_sag_error=_differences(fine.weight_sag, coarse.weight_sag, 1.0),
        weight_sag_lengthwise=fine.weight_sag_lengthwise,
        info=SolveInfo(
            method="20-node hexahedra",
            dofs=fine.dofs,
            seconds=fine.seconds + coarse.seconds,
            status=f"20-node hexahedra; error from meshes of {coarse.dofs} and {fine.dofs} dofs",
        ),
    )


def _differences(fine: PerTip, coarse: PerTip, fraction: float) -> PerTip:
    """Return a fraction of the relative difference of each value on two meshes [1]."""
    return tuple(fraction * abs(b / a - 1.0) for a, b in zip(fine, coarse, strict=True))


def tip_compliance(mesh: Mesh, E: float, poisson: float, layers: Sequence[ElasticLayer] = ()) -> TipCompliance:
    """Return the compliance of all tips along the press [mm/N from MPa] on one mesh [mm] of the half y >= 0.

    The load is uniform over the face, the displacement is the mean over the face. Without layers of a mount the holes
    are clamped. Raises SolveError if the solve, the balance of forces or the reciprocity of the loads fails.
    """
    start = time.perf_counter()
    return compliance_of(clamped_half(mesh, E, poisson, layers), start)


def compliance_of(half: ClampedHalf, start: float | None = None) -> TipCompliance:
    """Return the compliance, strains and sags of all tips of a clamped half [mm/N].

    `start` is the time at which the caller began, so that `seconds` includes making the half; by default it is now.
    Raises SolveError as `tip_compliance` does.
    """
    start = time.perf_counter() if start is None else start
    basis = half.basis
    mean = tip_means(basis, PRESS)
    # Loads on the half: 0.5 `mean` is 1 N on a whole tip. The others are body forces along the press and along x.
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
    """Return the largest magnitudes of principal strain [1] on a named surface, for displacements u (dofs,) [mm].

    The first is extrapolated to the corners of the facets, the second is at their Gauss points. Strain is most accurate
    at the Gauss points, but its peak lies between them and the edges, so it is extrapolated bilinearly.
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
    """Return the stiffness of each tip across the plate [N/mm], for forces and displacements along y.

    Raises SolveError as `tip_compliance` does.
    """
    half = clamped_half(mesh, E, poisson, layers, ACROSS)
    mean = tip_means(half.basis, ACROSS)
    u = half.factor.solve(0.5 * mean)
    check_tips(0.5 * mean.T @ u, None)
    return tip_stiffnesses(mean.T @ u)


def lever_compliance(half: ClampedHalf, lever: float) -> Floats:
    """Return the compliance [mm/N] of points above the middles of the tips' faces, (tips, tips, 3, 3).

    The points move rigidly with the faces, at a lever [mm] along the press. Entry (i, j, a, b) is the displacement of
    point i along axis a per force along b at point j. Rotation of a face about the press is neglected. `half` is made
    for a load along the press. Raises SolveError as `tip_compliance` does.
    """
    compliance = np.zeros((len(SPRINGS), len(SPRINGS), 3, 3))
    # Loads along x and the press are symmetric about y = 0; loads along y are antisymmetric.
    for part, level in ((half, LENGTHWISE), (with_symmetry(half, ACROSS), ACROSS)):
        slopes = [face_mean(part.basis, tip_face(spring), PRESS, slope=level) for spring in SPRINGS]
        tilts = np.column_stack(slopes)
        # The rotation of a face moves a point by its lever.
        moves = {level: tip_means(part.basis, level) - lever * tilts}
        if level == LENGTHWISE:
            moves[PRESS] = tip_means(part.basis, PRESS)
        axes = tuple(moves)
        point = np.column_stack(list(moves.values()))  # (dofs, axes times tips)
        u = part.factor.solve(0.5 * point)
        check_tips(0.5 * point.T @ u, None)
        # Reorder from (axis, tip, axis, tip) to (tip, tip, axis, axis).
        shape = (len(axes), len(SPRINGS))
        entries = np.ix_(range(len(SPRINGS)), range(len(SPRINGS)), axes, axes)
        compliance[entries] += (point.T @ u).reshape(*shape, *shape).transpose(1, 3, 0, 2)
    return compliance


def displacements(half: ClampedHalf) -> Floats:
    """Return the displacements [mm] for 1 N along the press on each tip, shape (dofs, tips); raises SolveError."""
    mean = tip_means(half.basis, PRESS)
    u = half.factor.solve(0.5 * mean)
    check_tips(0.5 * mean.T @ u, half.support(u), half.round_off(u))
    return u


def tip_means(basis: CellBasis, axis: int) -> Floats:
    """Return the vectors (dofs, tips) whose products with displacements are the means along an axis over the tips."""
    return np.column_stack([face_mean(basis, tip_face(spring), axis) for spring in SPRINGS])
