"""Stiffness of both flexures as printed: the housing clamped at its holes, a force on a tip, the tip's displacement.

The mesh is the half y >= 0; forces are on the whole part. Index 0 is the low tip, 1 the high tip.
Elements are 20-node hexahedra with 2^3 Gauss points: in a leaf, full integration needs eight times the elements.
"""

import dataclasses
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from skfem import CellBasis, ElementHexS2, Mesh

from solve.elasticity import stiffness_matrix, vector_basis
from solve.housing.bonded_foil import BondedFoil, Ints, bridge_strains, facets_by_place, membrane_matrix, nodal
from solve.linear import SolveError, factorised

Floats = NDArray[np.float64]
Pair = tuple[float, float]

TIPS = ("low_tip", "high_tip")
LEAVES = ("low_leaves", "high_leaves")
_GAUSS = (0.5 - 0.5 / np.sqrt(3.0), 0.5 + 0.5 / np.sqrt(3.0))
_CONTINUED = 0.5 * np.array([[1.0 + np.sqrt(3.0), 1.0 - np.sqrt(3.0)], [1.0 - np.sqrt(3.0), 1.0 + np.sqrt(3.0)]])
BALANCE_LIMIT = 1e-5  # round-off grows with the slenderness of the leaves: 4e-7 at L/t 150
REDUCED = 3  # polynomial degree: 2^3 Gauss points

# Of the difference to the coarse mesh. A mesh of 4.5 times the dofs has shown at most 0.21 of it, over random designs
# in all processes; the median is 0.07. A floor, and more for leaves of odd shape, are added in `pipeline.flexures`.
ERROR_SHARE = 0.2
# At the edges of a foil on plastic the stress is singular: both meshes are too stiff alike. Of the step from the coarse
# mesh 0.24 (steel) to 1.17 (plastic) is still to come, and 0.3 to 2.1 for the strain under a grid, against meshes of
# eight times the elements along the leaves: (share taken, share left open).
EDGE_STIFFNESS = (0.7, 0.5)
EDGE_STRAIN = (1.1, 1.0)
STRAIN_ERROR_SHARE = 1.5  # of what continuing the strain to the edges of the elements adds; seen at most 1.1


@dataclass(frozen=True, kw_only=True)
class TipCompliance:
    """One mesh: C[i][j] is the displacement of tip i along the press for 1 N on tip j [mm/N].

    `strain_per_N` is the largest principal strain on the leaves of a flexure for 1 N on its tip [1/N], continued to
    the edges of the elements, `strain_inside_per_N` the largest one inside them; `tilt_per_N` the turn of a tip's face
    in the plane of the plate [rad/N]. `gauge_strain_per_N` is the mean strain under the grids of its bridge [1/N].
    """

    C: Floats
    strain_per_N: Pair
    strain_inside_per_N: Pair
    tilt_per_N: Pair
    dofs: int
    seconds: float
    gauge_strain_per_N: Pair | None = None

    @property
    def K(self) -> Pair:
        """Return the stiffness of each tip with the other one free [N/mm]."""
        return 1.0 / float(self.C[0, 0]), 1.0 / float(self.C[1, 1])


@dataclass(frozen=True, kw_only=True)
class HousingStiffness:
    """The stiffness [N/mm] of both flexures with its estimated error [%]; the rest as in `TipCompliance`."""

    C: Floats
    K: Pair
    error_percent: Pair
    strain_per_N: Pair
    strain_error_percent: Pair
    tilt_per_N: Pair
    dofs: int
    seconds: float
    status: str
    gauge_strain_per_N: Pair | None = None
    gauge_error_percent: Pair | None = None


def housing_stiffness(fine: TipCompliance, coarse: TipCompliance) -> HousingStiffness:
    """Return the fine mesh's result, its error estimated from the difference to the coarse mesh's.

    The error of the strain is what continuing it to the edges of the elements has added.

    Raises ValueError when the coarse mesh is not the coarser one.
    """
    if not coarse.dofs < fine.dofs:
        msg = f"coarse.dofs = {coarse.dofs}: must be less than {fine.dofs} of the fine mesh; give fine, then coarse"
        raise ValueError(msg)
    found = HousingStiffness(
        C=fine.C,
        K=fine.K,
        error_percent=_apart(fine.K, coarse.K, ERROR_SHARE),
        strain_per_N=fine.strain_per_N,
        strain_error_percent=_apart(fine.strain_per_N, fine.strain_inside_per_N, STRAIN_ERROR_SHARE),
        tilt_per_N=fine.tilt_per_N,
        dofs=fine.dofs,
        seconds=fine.seconds + coarse.seconds,
        status=f"20-node hexahedra; error from meshes of {coarse.dofs} and {fine.dofs} dofs",
    )
    gauges = (fine.gauge_strain_per_N, coarse.gauge_strain_per_N)
    return found if gauges[0] is None or gauges[1] is None else _extrapolated(found, coarse, gauges[0], gauges[1])


def _extrapolated(found: HousingStiffness, coarse: TipCompliance, strain: Pair, before: Pair) -> HousingStiffness:
    """Return the fine mesh's result carried on by a share of the step from the coarse mesh, as gauges need it."""
    C = found.C + EDGE_STIFFNESS[0] * (found.C - coarse.C)
    low, high = (a + EDGE_STRAIN[0] * (a - b) for a, b in zip(strain, before, strict=True))
    return dataclasses.replace(
        found,
        C=C,
        K=(1.0 / float(C[0, 0]), 1.0 / float(C[1, 1])),
        error_percent=_apart(found.K, coarse.K, EDGE_STIFFNESS[1]),
        status=f"{found.status}; carried on to the edges of the gauges",
        gauge_strain_per_N=(low, high),
        gauge_error_percent=_apart(strain, before, EDGE_STRAIN[1]),
    )


def _apart(fine: Pair, coarse: Pair, share: float) -> Pair:
    low, high = (100.0 * share * abs(b / a - 1.0) for a, b in zip(fine, coarse, strict=True))
    return low, high


def tip_compliance(mesh: Mesh, E: float, poisson: float, foils: Sequence[BondedFoil] = ()) -> TipCompliance:
    """Return the compliance of both tips along the press [mm/N from MPa] on one mesh [mm] of the half y >= 0.

    The load is spread evenly over the face, the displacement is the face's mean. Foils are gauges on the leaves.
    Raises SolveError when the solve, the balance of forces or the reciprocity of the two loads fails.
    """
    start = time.perf_counter()
    basis, mean, u = _moved(mesh, (E, poisson), (2, ("u^2",)), foils)
    C = mean.T @ u
    tilts = [float(_face_sum(basis, tip, 2, turn=True) @ u[:, j]) for j, tip in enumerate(TIPS)]
    strains = [_largest_strain(basis, leaves, u[:, j]) for j, leaves in enumerate(LEAVES)]
    return TipCompliance(
        C=0.5 * (C + C.T),
        strain_per_N=(strains[0][0], strains[1][0]),
        strain_inside_per_N=(strains[0][1], strains[1][1]),
        tilt_per_N=(tilts[0], tilts[1]),
        dofs=int(basis.N),
        seconds=time.perf_counter() - start,
        gauge_strain_per_N=bridge_strains(basis, foils, u) if foils else None,
    )


def sideways_stiffness(mesh: Mesh, E: float, poisson: float, foils: Sequence[BondedFoil] = ()) -> Pair:
    """Return the stiffness of each tip across the plate [N/mm]: the force along y that moves its face by 1 mm.

    Raises SolveError as `tip_compliance` does.
    """
    _, mean, u = _moved(mesh, (E, poisson), (1, ("u^1", "u^3")), foils)
    C = mean.T @ u
    return 1.0 / float(C[0, 0]), 1.0 / float(C[1, 1])


def displacements(mesh: Mesh, E: float, poisson: float, foils: Sequence[BondedFoil] = ()) -> Floats:
    """Return the displacements [mm] for 1 N along the press on each tip, shape (dofs, 2); raises SolveError."""
    return _moved(mesh, (E, poisson), (2, ("u^2",)), foils)[2]


def _moved(
    mesh: Mesh, material: Pair, load: tuple[int, tuple[str, ...]], foils: Sequence[BondedFoil]
) -> tuple[CellBasis, Floats, Floats]:
    """Return the basis, the means of the tips' faces along an axis, and the displacements for 1 N along it on each.

    The load is the axis, with what the plane of symmetry holds then.
    """
    _check_names(mesh)
    axis, held = load
    basis = vector_basis(mesh, ElementHexS2(), order=REDUCED)
    mean = np.column_stack([_face_sum(basis, tip, axis) for tip in TIPS])
    K = stiffness_matrix(basis, *material)
    return basis, mean, _solved(basis, K + membrane_matrix(basis, foils) if foils else K, mean, held)


def _solved(basis: CellBasis, K: csc_matrix, mean: Floats, held: tuple[str, ...]) -> Floats:
    """Return the displacements for 1 N on each tip of the whole part, of which the half carries half."""
    plane = basis.get_dofs("symmetry")
    clamp = basis.get_dofs("mounting_holes")
    factor = factorised(K, np.concatenate([clamp.all(), *(plane.all(component) for component in held)]))
    load = 0.5 * mean
    u = factor.solve(load)
    check_tips(load.T @ u, (K @ u)[clamp.all("u^3")].sum(axis=0) if "u^2" in held else None)
    return u


def check_tips(work: Floats, support: Floats | None) -> None:
    """Raise SolveError unless the loads are reciprocal (Betti) and the holes carry them, half a newton each.

    `support` is None where the plane of symmetry carries a part.
    """
    skew = float(abs(work[0, 1] - work[1, 0]))
    if not skew <= BALANCE_LIMIT * float(np.abs(work).max()):
        msg = (
            f"flexure: work of one load on the other's displacement differs by {skew:.1e} mm N when they change "
            "places: must be equal; check that the matrix is symmetric"
        )
        raise SolveError(msg)
    rest = 0.0 if support is None else float(np.abs(support + 0.5).max())
    if not rest <= BALANCE_LIMIT:
        msg = (
            f"flexure: the mounting holes miss {rest:.1e} N of the half newton on a tip: must be at most "
            f"{BALANCE_LIMIT:.0e} N; check the clamp"
        )
        raise SolveError(msg)


@dataclass(frozen=True)
class _Patch:
    """Cells with a facet on a surface, seen at 2^2 Gauss points of it: weights (cells, 4) with the area in them."""

    cells: Ints
    scalar: CellBasis
    weights: Floats


def _patches(basis: CellBasis, name: str) -> Iterator[_Patch]:
    """Yield a surface by the place of its facets in their cells.

    Points are the cell's own: scikit-fem's facet basis looks for them by Newton steps, which fail on long cells.
    """
    for cells, p, along, across in facets_by_place(basis, name):
        points = np.array([p + a * along + b * across for a in _GAUSS for b in _GAUSS]).T
        scalar = CellBasis(basis.mesh, basis.elem.elem, quadrature=(points, np.full(4, 0.25)), elements=cells)
        slopes = np.asarray(basis.mapping.DF(points, tind=cells))
        normal = np.cross(np.einsum("ijkl,j->ikl", slopes, along), np.einsum("ijkl,j->ikl", slopes, across), axis=0)
        yield _Patch(cells, scalar, 0.25 * np.linalg.norm(normal, axis=0))


def _face_sum(basis: CellBasis, name: str, axis: int, *, turn: bool = False) -> Floats:
    """Return the vector whose product with the dofs is the mean of a displacement component over a face.

    With `turn` it is the slope of the component along x, by least squares.
    """
    patches = list(_patches(basis, name))
    places = [np.asarray(patch.scalar.global_coordinates())[0] for patch in patches]
    area = sum(float(patch.weights.sum()) for patch in patches)
    centre = sum(float((x * patch.weights).sum()) for x, patch in zip(places, patches, strict=True)) / area
    vector, total = np.zeros(basis.N), 0.0
    for x, patch in zip(places, patches, strict=True):
        arm = x - centre if turn else np.ones_like(x)
        shapes = np.array([np.broadcast_to(np.asarray(field[0]), x.shape) for field in patch.scalar.basis])
        np.add.at(vector, nodal(basis, patch.cells)[:, axis], (shapes * arm * patch.weights).sum(axis=2))
        total += float((arm**2 * patch.weights).sum())
    return vector / total


def _largest_strain(basis: CellBasis, name: str, u: Floats) -> Pair:
    """Return the largest principal strain in size on a surface: carried on to the corners of its facets, and inside.

    Strain is best at the Gauss points; its peak lies between them, so it is continued bilinearly.
    """
    largest = np.zeros(2)
    for patch in _patches(basis, name):
        slopes = np.stack([np.asarray(field[0].grad) for field in patch.scalar.basis])  # (nodes, 3, cells, points)
        gradient = np.einsum("nie,njep->epij", u[nodal(basis, patch.cells)], slopes)
        inside = 0.5 * (gradient + gradient.swapaxes(2, 3))
        corners = np.einsum("qp,epij->eqij", np.kron(_CONTINUED, _CONTINUED), inside)
        sizes = [np.abs(np.linalg.eigvalsh(strain)).max() for strain in (corners, inside)]
        largest = np.maximum(largest, sizes)
    return float(largest[0]), float(largest[1])


def _check_names(mesh: Mesh) -> None:
    known = mesh.boundaries or {}
    for name in (*TIPS, *LEAVES, "mounting_holes", "symmetry"):
        if name not in known:
            msg = f"flexure: boundary {name!r} is unknown on the mesh; known boundaries: {', '.join(known) or 'none'}"
            raise SolveError(msg)
