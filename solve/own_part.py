"""The compliance of a part of any shape, with some faces held and a uniform load on others.

The caller obtains error bars from two or more meshes. A swept mesh may neglect features of the part; their effect is
bounded by the strain energy of the neglected material.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix
from skfem import CellBasis, ElementTetP2, MeshTet2

from mesh.own_part import FILLETS, WALLS, SweptPart
from sensor.arrays import Floats
from solve.displacement_basis import scalar_gradients
from solve.elasticity import stiffness_matrix, stress, vector_basis
from solve.housing.clamped_half import BALANCE_LIMIT, HOLES, ClampedHalf, clamped_half, face_mean
from solve.housing.elastic_layer import ElasticLayer, layer_matrix
from solve.housing.stiffness import largest_strain
from solve.linear import SolveError
from solve.multigrid import two_grid

Direction = tuple[float, float, float]
# Increase in compliance due to removed material, divided by the strain energy that the material would carry. It is 2
# for a round hole under tension, and larger for a slender hole. See J. D. Eshelby, Proc. R. Soc. A 241 (1957) 376,
# doi:10.1098/rspa.1957.0133.
VOID_FACTOR = 4.0
ERROR_SHARE = 1.0  # error bar divided by the difference between two meshes
ERROR_FLOOR = 1e-3  # smallest relative error bar
# Elements at sharp inner corners are refined if they hold more than this fraction of the strain energy. Coarse elements
# miss at most a twelfth of that energy, which is 0.16 % of the total. The error floor covers 0.1 % of this, and the
# difference between the meshes covers the rest.
CORNER_SHARE = 0.02
_TETRAHEDRA_ORDER = 4  # polynomial degree of the quadrature, high enough for cells with curved edges
_SHARP_CORNER_RATIO = 1.2  # a larger ratio of the strain at walls to that at round corners means a sharp corner


@dataclass(frozen=True, kw_only=True, eq=False)
class PartCompliance:
    """The solution on one mesh: C[i, j] is the displacement of face i along its load per force on face j [mm/N].

    The strains, `density` and `at_corners` have one entry per load, for a load of 1 N. `strain_per_N` [1/N] is the
    largest principal strain at round inner corners, extrapolated to element edges. `strain_inside_per_N` [1/N] is the
    largest at points inside elements. The strains are nan if the part has no round inner corner, or if the strain at
    another wall is more than 1.2 times as large. `density` [N/mm^2] is twice the strain energy density in each element.
    `at_corners` (loads, corners) [1] is the fraction of the strain energy in the elements at each sharp inner corner.
    `seconds` is the wall-clock time.
    """

    C: Floats
    strain_per_N: tuple[float, ...]
    strain_inside_per_N: tuple[float, ...]
    density: tuple[Floats, ...]
    at_corners: Floats
    dofs: int
    seconds: float

    @property
    def K(self) -> Floats:
        """Return the stiffness of each face with the other faces unloaded [N/mm]."""
        return np.asarray(1.0 / np.diag(self.C))


def swept_compliance(
    part: SweptPart,
    material: tuple[float, float],
    presses: Mapping[str, Direction],
    layers: Sequence[ElasticLayer] = (),
) -> PartCompliance:
    """Return the compliance, the corner strains and the strain energies of a swept part under a load on each face.

    `material` is Young's modulus [MPa] and Poisson's ratio. `presses` maps the name of each pressed face to the unit
    vector along its load. The part is supported by the elastic `layers`; without layers, its held faces cannot move.
    Raises SolveError if nothing holds the part, or if the solution is inaccurate or violates reciprocity.
    """
    start = time.perf_counter()
    half = clamped_half(part.mesh, *material, layers)
    means = _press_means(half.basis, presses)
    # If only half of the part is meshed, only half of each load acts on the mesh.
    u = half.factor.solve(part.meshed_fraction * means)
    C = means.T @ u
    _check_reciprocal(C)
    # These tuples have one entry per load.
    strains_at_edges, strains_inside = zip(*[_corner_strain(half.basis, column) for column in u.T], strict=True)
    densities, energies = zip(*[_doubled_strain_energies(half, material, column) for column in u.T], strict=True)
    return PartCompliance(
        C=0.5 * (C + C.T),  # removes the asymmetry due to round-off
        strain_per_N=strains_at_edges,
        strain_inside_per_N=strains_inside,
        density=densities,
        at_corners=np.array([_corner_shares(part, energy) for energy in energies]),
        dofs=int(half.basis.N),
        seconds=time.perf_counter() - start,
    )


def strained_corners(solution: PartCompliance) -> tuple[int, ...]:
    """Return the indices of the sharp inner corners that hold enough strain energy to need refinement.

    The other corners together hold at most the fraction `CORNER_SHARE` of the strain energy of each load.
    """
    increasing = np.argsort(solution.at_corners.max(axis=0))  # corners in order of increasing strain energy
    cumulative_share = np.cumsum(solution.at_corners[:, increasing], axis=1).max(axis=0)
    is_negligible = cumulative_share <= CORNER_SHARE
    return tuple(sorted(increasing[~is_negligible].tolist()))


def _check_reciprocal(C: Floats) -> None:
    """Raise SolveError unless C (loads, loads) [mm/N] is symmetric, as Betti's theorem requires."""
    skew = float(np.abs(C - C.T).max())
    if not skew <= BALANCE_LIMIT * float(np.abs(C).max()):
        msg = f"own part: mutual compliances of two loads differ by {skew:.1e} mm/N but must be equal. Check the solid."
        raise SolveError(msg)


def _corner_strain(basis: CellBasis, u: Floats) -> tuple[float, float]:
    """Return the largest strain at round inner corners [1]: extrapolated to element edges, and inside the elements.

    `u` (dofs,) [mm] are the displacements. Both values are nan if there is no round inner corner, or if the strain at
    another wall is more than 1.2 times as large. In that case, the largest strain is at a sharp corner. It increases
    with every refinement of the mesh, so it has no value that could be reported.
    """
    if FILLETS not in basis.mesh.boundaries:
        return np.nan, np.nan
    at_fillets, inside = largest_strain(basis, FILLETS, u)
    at_walls, _ = largest_strain(basis, WALLS, u)
    if not _SHARP_CORNER_RATIO * at_fillets >= at_walls:  # negated, so that nan is rejected too
        return np.nan, np.nan
    # The strain in the straight wall next to a wide fillet may be slightly larger than the strain in the fillet.
    return max(at_fillets, at_walls), inside


def tetrahedral_compliance(
    mesh: MeshTet2,
    material: tuple[float, float],
    presses: Mapping[str, Direction],
    layers: Sequence[ElasticLayer] = (),
) -> PartCompliance:
    """Return the compliance of the pressed faces of a part, solved on a mesh [mm] of quadratic tetrahedra.

    Only the compliance is computed: the strains are nan, and there are no strain energies. `material` is Young's
    modulus [MPa] and Poisson's ratio. `presses` maps the name of each pressed face to the unit vector along its load.
    The part is supported by the elastic `layers`; without layers, its held faces cannot move. Raises SolveError if
    nothing holds the part, if conjugate gradients do not converge, or if the compliance is not symmetric.
    """
    start = time.perf_counter()
    basis = vector_basis(mesh, ElementTetP2(), _TETRAHEDRA_ORDER)
    matrix = stiffness_matrix(basis, *material)
    if layers:
        matrix = csc_matrix(matrix + layer_matrix(basis, layers, *material))
        held = np.zeros(0, dtype=np.int64)  # only the layers support the part
    else:
        held = basis.get_dofs(HOLES).all()
    means = _press_means(basis, presses)
    C = means.T @ two_grid(basis, matrix, held).solve(means)
    _check_reciprocal(C)
    unknown = (np.nan,) * len(presses)
    return PartCompliance(
        C=0.5 * (C + C.T),  # removes the asymmetry due to round-off
        strain_per_N=unknown,
        strain_inside_per_N=unknown,
        density=(),
        at_corners=np.zeros((len(presses), 0)),
        dofs=int(basis.N),
        seconds=time.perf_counter() - start,
    )


def extrapolate_to_size_zero(sizes: Sequence[float], values: Sequence[float]) -> tuple[float, float]:
    """Extrapolate values on three or more meshes to element size 0, and return the limit and its error.

    `sizes` are the element sizes in decreasing order. The error of a value is assumed to be proportional to the size.
    The error at a sharp corner decreases at least at this rate, and a convergence rate estimated on unstructured meshes
    would mainly reflect scatter. The error of the limit is the larger of the last two extrapolation steps, each scaled
    to the last size. Two steps are used because a single one may be small by chance.
    """
    # Each pair of neighbouring meshes gives one straight line, and one change from the last size to size 0.
    slopes = np.diff(values[-3:]) / np.diff(sizes[-3:])
    steps = slopes * sizes[-1]
    return float(values[-1] - steps[-1]), float(np.abs(steps).max())


def _press_means(basis: CellBasis, presses: Mapping[str, Direction]) -> Floats:
    """Return vectors (dofs, loads) whose products with displacements are the mean displacements of the pressed faces.

    `presses` maps the name of each pressed face to the unit vector along its load. Each vector is also a load of 1 N.
    """
    return np.column_stack([_press_mean(basis, name, direction) for name, direction in presses.items()])


def _press_mean(basis: CellBasis, name: str, direction: Direction) -> Floats:
    """Return the vector (dofs,) whose product with displacements is their mean component along a direction over a face.

    `direction` is a unit vector. The returned vector is also the uniform load of 1 N on the face in this direction.
    """
    return np.asarray(sum(part * face_mean(basis, name, axis) for axis, part in enumerate(direction) if part != 0.0))


def _doubled_strain_energies(half: ClampedHalf, material: tuple[float, float], u: Floats) -> tuple[Floats, Floats]:
    """Return twice the strain energy density and twice the strain energy of each element, both (elements,).

    The first array is the mean density over the quadrature points [N/mm^2], the second is the integral [N mm]. `u`
    (dofs,) [mm] are the displacements, and `material` is Young's modulus [MPa] and Poisson's ratio.
    """
    # The indices in `einsum` are node n, axes i and j, element e and quadrature point q.
    basis = half.basis
    dofs = np.asarray(basis.element_dofs).reshape(-1, 3, basis.element_dofs.shape[1])
    gradient = np.einsum("nie,njeq->ijeq", u[dofs], scalar_gradients(basis))
    # The stress is symmetric, so its product with the gradient is its product with the strain.
    density = np.asarray((stress(gradient, *material) * gradient).sum(axis=(0, 1)))
    return density.mean(axis=1), (density * basis.dx).sum(axis=1)


def neglected_feature_errors(part: SweptPart, solution: PartCompliance) -> tuple[float, ...]:
    """Return an upper bound of the relative error of each C[i, i] [1] due to features that the swept mesh neglects.

    `part` is the swept part, and `solution` its compliance. In each column of cells along the sweep, the mesh has too
    much or too little material. This material is assumed to have the strain energy density of the most strained cell of
    the column. For a load of 1 N, twice the strain energy is a compliance.
    """
    # Volume [mm^3] whose strain energy is the change in compliance; a void adds more compliance than its own energy.
    effective_volume = VOID_FACTOR * part.effective_length_error * part.area
    relative_errors = []
    for load, density in enumerate(solution.density):
        largest_density = density[part.cells].max(axis=0)  # one value per column of cells
        relative_errors.append(float((effective_volume * largest_density).sum()) / solution.C[load, load])
    return tuple(relative_errors)


def _corner_shares(part: SweptPart, energy: Floats) -> Floats:
    """Return the fraction of the strain energy in the elements at each sharp inner corner [1], shape (corners,).

    `energy` (elements,) is the strain energy of each element, in any unit.
    """
    energy_of_columns = energy[part.cells].sum(axis=0)
    is_at_corner = part.corner >= 0  # -1 marks a column of cells that is not at a sharp inner corner
    energy_at_corners = np.bincount(
        part.corner[is_at_corner], energy_of_columns[is_at_corner], minlength=part.corner_count
    )
    return np.asarray(energy_at_corners / energy.sum())
