"""The independent check of a housing's stiffness: quadratic tetrahedra on two meshes, extrapolated."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from skfem import Mesh

from cad.parts.housing import Housing
from reference.element_study import element_stiffness
from sensor.theory.leaf_spring import Flexure

Pair = tuple[float, float]

SMALL_HOUSING = Housing(
    low=Flexure(thickness=0.8, length=9.0, depth=4.0, separation=8.0, fillet=0.5),
    high=Flexure(thickness=1.2, length=7.0, depth=4.0, separation=8.0, fillet=0.5),
    tip_side=1.0, tip_height=1.0, spacing=6.0, shuttle_width=4.0, neck_level=2.5, lower_leaf_level=4.7,
    low_top_level=15.0, high_top_level=15.2, cavity_level=15.5, top_level=20.0, protrusion=1.0, wall_width=6.0,
)  # fmt: skip
"""A housing with short leaves, so that meshes for other programs are small."""
RATE = 2.5  # rate of convergence; on meshes of 100 to 350 thousand dofs 2 to 3 (low tip) and 1 to 2.5 (high tip)


@dataclass(frozen=True, kw_only=True)
class ReferenceStiffness:
    """Extrapolated stiffness of the low and the high tip [N/mm], with the correction by extrapolation [%].

    `K_meshes` [N/mm] and `dofs` are of the single meshes, coarse to fine.
    """

    K: Pair
    spread_percent: Pair
    K_meshes: tuple[tuple[float, ...], ...]
    dofs: tuple[int, ...]
    seconds: float


def reference_stiffness(meshes: Sequence[Mesh], sizes: Sequence[float], E: float, poisson: float) -> ReferenceStiffness:
    """Return the stiffness extrapolated from two meshes with these relative sizes, coarse to fine.

    Raises SolveError if a solve fails.
    """
    start = time.perf_counter()
    found = tuple(element_stiffness(mesh, "tet P2", E, poisson).K for mesh in meshes)
    coarse, fine = np.array(found)
    correction = (fine - coarse) / ((sizes[0] / sizes[1]) ** RATE - 1.0)
    limit = fine + correction
    return ReferenceStiffness(
        K=limit.tolist(),
        spread_percent=(100.0 * np.abs(correction) / limit).tolist(),
        K_meshes=found,
        dofs=tuple(3 * int(mesh.doflocs.shape[1]) for mesh in meshes),
        seconds=time.perf_counter() - start,
    )
