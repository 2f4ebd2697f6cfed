"""The independent check of a housing's stiffness: quadratic tetrahedra on two meshes, extrapolated."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

from skfem import Mesh

from benchmarks.element_study import element_stiffness
from solve.error_estimate import richardson

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


def reference_stiffness(meshes: Sequence[Mesh], sizes: Sequence[float], E: float, poisson: float) -> ReferenceStiffness:
    """Return the stiffness extrapolated from two or three meshes of these relative sizes, coarse to fine.

    Raises SolveError when a solve fails.
    """
    start = time.perf_counter()
    found = tuple(element_stiffness(mesh, "tet P2", E, poisson).K for mesh in meshes)
    low, high = (richardson([K[i] for K in found], sizes, RATE) for i in (0, 1))
    return ReferenceStiffness(
        K=(low.value, high.value),
        spread_percent=(100.0 * low.error / low.value, 100.0 * high.error / high.value),
        K_meshes=found,
        dofs=tuple(3 * int(mesh.doflocs.shape[1]) for mesh in meshes),
        seconds=time.perf_counter() - start,
    )
