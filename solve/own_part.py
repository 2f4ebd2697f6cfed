"""Stiffness of a part of any shape: faces that are held, faces that are pressed, each by an even load along a line.

A bar comes from two meshes. What a sweep leaves out of the part is bounded by its strain energy.
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
# Gain in compliance by material that is left out, over the strain energy that it would carry. It is 2 for a round hole
# under tension and more for a slender one. J. D. Eshelby, Proc. R. Soc. A 241 (1957) 376, doi:10.1098/rspa.1957.0133.
VOID_FACTOR = 4.0
# The share of the difference between both meshes that is the error bar, and its floor.
ERROR_SHARE = 1.0
ERROR_FLOOR = 1e-3
# Elements at sharp inner corners get finer where they have more than this share of the strain energy. They miss at most
# a twelfth of what they have: 0.16 %. The floor of the bar has 0.1 %, and the difference of the meshes the rest.
CORNER_SHARE = 0.02
_TETRAHEDRA_ORDER = 4  # order of the quadrature, for curved edges
_SHARP = 1.2


@dataclass(frozen=True, kw_only=True, eq=False)
class PartCompliance:
    """One mesh: C[i, j] is the displacement of face i along its press for 1 N on face j [mm/N].

    `strain_per_N` and `strain_inside_per_N` are the largest strain on a round inner corner, continued to the edges of
    elements and inside them [1/N]; empty if there is none. `density` is twice the density of strain energy of each
    element for 1 N [N/mm^2]. `at_corners` (presses, corners) is the share of the strain energy in the elements at each
    sharp inner corner of the section [1].
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
        """Return the stiffness of each face with the others free [N/mm]."""
        return np.asarray(1.0 / np.diag(self.C))


def swept_compliance(
    part: SweptPart,
    material: tuple[float, float],
    presses: Mapping[str, Direction],
    layers: Sequence[ElasticLayer] = (),
) -> PartCompliance:
    """Return the compliance of the pressed faces of a swept part, E [MPa] and Poisson's ratio its material.

    `presses` has the unit direction in which each face is pressed. Without layers the faces that are held do not move.
    Raises SolveError.
    """
    start = time.perf_counter()
    half = clamped_half(part.mesh, *material, layers)
    means = np.column_stack([press_mean(half.basis, name, direction) for name, direction in presses.items()])
    u = half.factor.solve(part.share * means)
    C = means.T @ u
    _check_reciprocal(C)
    corners = [_corner_strain(half.basis, column) for column in u.T]
    energies = [_energy(half, material, column) for column in u.T]
    return PartCompliance(
        C=0.5 * (C + C.T),
        strain_per_N=tuple(corner for corner, _ in corners),
        strain_inside_per_N=tuple(inside for _, inside in corners),
        density=tuple(density for density, _ in energies),
        at_corners=np.array([_at_corners(part, energy) for _, energy in energies]),
        dofs=int(half.basis.N),
        seconds=time.perf_counter() - start,
    )


def strained_corners(found: PartCompliance) -> tuple[int, ...]:
    """Return the numbers of sharp inner corners without which the others have a small share of the strain energy."""
    order = np.argsort(found.at_corners.max(axis=0))
    is_small = np.cumsum(found.at_corners[:, order], axis=1).max(axis=0) <= CORNER_SHARE
    return tuple(sorted(order[~is_small].tolist()))


def _check_reciprocal(C: Floats) -> None:
    """Raise SolveError unless each load moves the other's face as that moves its own (Betti)."""
    skew = float(np.abs(C - C.T).max())
    if not skew <= BALANCE_LIMIT * float(np.abs(C).max()):
        msg = f"own part: compliances of two loads differ by {skew:.1e} mm/N: must be equal; check the solid"
        raise SolveError(msg)


def _corner_strain(basis: CellBasis, u: Floats) -> tuple[float, float]:
    """Return the largest strain at round inner corners [1], as `largest_strain` does; nan where another wall has more.

    There it is at a sharp corner, and grows with every finer mesh.
    """
    if FILLETS not in basis.mesh.boundaries:
        return np.nan, np.nan
    corner, inside = largest_strain(basis, FILLETS, u)
    elsewhere, _ = largest_strain(basis, WALLS, u)
    # Beside a wide corner the straight wall may have a little more; a sharp one has far more.
    return (max(corner, elsewhere), inside) if _SHARP * corner >= elsewhere else (np.nan, np.nan)


def tetrahedral_compliance(
    mesh: MeshTet2,
    material: tuple[float, float],
    presses: Mapping[str, Direction],
    layers: Sequence[ElasticLayer] = (),
) -> PartCompliance:
    """Return the compliance of the pressed faces of a whole part in quadratic tetrahedra, without strains.

    Raises SolveError as `swept_compliance` does.
    """
    start = time.perf_counter()
    basis = vector_basis(mesh, ElementTetP2(), _TETRAHEDRA_ORDER)
    matrix = stiffness_matrix(basis, *material)
    held = basis.get_dofs(HOLES).all()
    if layers:
        matrix = csc_matrix(matrix + layer_matrix(basis, layers, *material))
        held = held[:0]
    means = np.column_stack([press_mean(basis, name, direction) for name, direction in presses.items()])
    C = means.T @ two_grid(basis, matrix, held).solve(means)
    _check_reciprocal(C)
    unknown = (np.nan,) * len(presses)
    return PartCompliance(
        C=0.5 * (C + C.T),
        strain_per_N=unknown,
        strain_inside_per_N=unknown,
        density=(),
        at_corners=np.zeros((len(presses), 0)),
        dofs=int(basis.N),
        seconds=time.perf_counter() - start,
    )


def at_size_zero(sizes: Sequence[float], values: Sequence[float]) -> tuple[float, float]:
    """Return a value at size 0 from three or more meshes, and its error: the larger of the last two steps to it.

    The error is taken to fall like the size, because strain energy at a sharp corner falls no slower. A rate that is
    observed on unstructured meshes is scatter. One step can be small by accident, so the step before it counts too.
    """
    slopes = np.diff(values[-3:]) / np.diff(sizes[-3:])
    steps = slopes * sizes[-1]
    return float(values[-1] - steps[-1]), float(np.abs(steps).max())


def press_mean(basis: CellBasis, name: str, direction: Direction) -> Floats:
    """Return the vector (dofs,) whose product with displacements is the mean along a direction over a face."""
    return np.asarray(sum(share * face_mean(basis, name, axis) for axis, share in enumerate(direction) if share != 0.0))


def _energy(half: ClampedHalf, material: tuple[float, float], u: Floats) -> tuple[Floats, Floats]:
    """Return twice the strain energy of each element for 1 N: its mean density [N/mm^2] and its integral [N mm]."""
    basis = half.basis
    dofs = np.asarray(basis.element_dofs).reshape(-1, 3, basis.element_dofs.shape[1])
    gradient = np.einsum("nie,njeq->ijeq", u[dofs], scalar_gradients(basis))
    at_points = np.asarray((stress(gradient, *material) * gradient).sum(axis=(0, 1)))
    return at_points.mean(axis=1), (at_points * basis.dx).sum(axis=1)


def left_out(part: SweptPart, found: PartCompliance) -> tuple[float, ...]:
    """Return the largest change of each C[i, i] by what the sweep has too much or too little, as a fraction of it [1].

    Each column of the mesh has its density of strain energy at its most strained cell, and is too long or too short.
    """
    missed = VOID_FACTOR * part.effect * part.area
    worst = (density[part.cells].max(axis=0) for density in found.density)
    return tuple(float((missed * each).sum()) / found.C[i, i] for i, each in enumerate(worst))


def _at_corners(part: SweptPart, energy: Floats) -> Floats:
    """Return the share of the strain energy in the elements at each sharp inner corner (corners,) [1]."""
    columns = energy[part.cells].sum(axis=0)
    sharp = part.corner >= 0
    at_each = np.bincount(part.corner[sharp], columns[sharp], minlength=part.corner_count)
    return np.asarray(at_each / energy.sum())
