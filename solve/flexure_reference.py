"""The independent check of a housing's stiffness: quadratic tetrahedra on two meshes, extrapolated."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from skfem import ElementTetP2, FacetBasis, LinearForm, Mesh

from solve.elasticity import stiffness_matrix, vector_basis
from solve.error import richardson
from solve.linear import factorised

Floats = NDArray[np.float64]
Pair = tuple[float, float]

RATE = 2.5  # seen on meshes of 100 to 350 thousand dofs: 2 to 3 for the low tip, 1 to 2.5 for the high one


@dataclass(frozen=True, kw_only=True)
class ReferenceStiffness:
    """Stiffness of the low and the high tip [N/mm], extrapolated, with the spread [%]; `K_meshes` coarse to fine."""

    K: Pair
    spread_percent: Pair
    K_meshes: tuple[Pair, ...]
    dofs: tuple[int, ...]
    seconds: float


def tetrahedral_stiffness(mesh: Mesh, E: float, poisson: float) -> Pair:
    """Return the stiffness of both tips [N/mm from MPa] on one mesh [mm] of the half y >= 0.

    An even load on the tip's face, its mean displacement along z. Raises SolveError when the solve fails.
    """
    basis = vector_basis(mesh, ElementTetP2(), order=2)
    held = [basis.get_dofs("mounting_holes").all(), basis.get_dofs("symmetry").all("u^2")]
    factor = factorised(stiffness_matrix(basis, E, poisson), np.concatenate(held))
    faces = [FacetBasis(mesh, basis.elem, facets=mesh.boundaries[tip], intorder=3) for tip in ("low_tip", "high_tip")]
    total = LinearForm(lambda v, w: v[2] + 0.0 * w.x[0])
    means = np.column_stack([total.assemble(face) / face.dx.sum() for face in faces])
    compliance = np.sum(means * factor.solve(0.5 * means), axis=0)
    return 1.0 / float(compliance[0]), 1.0 / float(compliance[1])


def reference_stiffness(meshes: Sequence[Mesh], sizes: Sequence[float], E: float, poisson: float) -> ReferenceStiffness:
    """Return the stiffness extrapolated from two or three meshes of these relative sizes, coarse to fine."""
    start = time.perf_counter()
    found = tuple(tetrahedral_stiffness(mesh, E, poisson) for mesh in meshes)
    low, high = (richardson([K[i] for K in found], sizes, RATE) for i in (0, 1))
    return ReferenceStiffness(
        K=(low.value, high.value),
        spread_percent=(100.0 * low.error / low.value, 100.0 * high.error / high.value),
        K_meshes=found,
        dofs=tuple(3 * int(mesh.doflocs.shape[1]) for mesh in meshes),
        seconds=time.perf_counter() - start,
    )
