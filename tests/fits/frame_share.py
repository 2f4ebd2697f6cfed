"""FRAME_FRACTIONS: what the frame adds to 1/K, times E w / K, from a housing whose frame is rigid against the real one.

`python tests/fits frame_share` (2 minutes). Rigid is what may carry marks: the bar above the cavity, and the walls
from 2.5 mm behind the leaf roots on, where the letters L and H begin.
"""

from collections.abc import Sequence

import numpy as np
from fits.comparison import Comparison, covering
from fits.springs import Case, mesh, stiffness

from pipeline.verdicts.errors.effects import FRAME_FRACTIONS
from solve.housing.stiffness import tip_compliance

BEHIND = 2.5  # [mm]
SCALE = 0.66  # the coarsest mesh with a line of nodes between leaf root and holes
PAPER = Case("fdm-petg", (25.9, 12.95), depth=6.0)  # 0.74 and 17.7 N/mm, near the paper's 0.753 and 17.3


def shares(case: Case) -> np.ndarray:
    """Return the share of the frame in 1/K of both springs [1], shape (2,)."""
    housing, real = case.housing, mesh(case, SCALE)
    x, _, z = real.p[:, real.t].mean(axis=1)
    left, right = (arm.wall for arm in housing.arms)
    frame = np.flatnonzero((x < left - BEHIND) | (x > right + BEHIND) | (z > housing.cavity_level))
    held = np.union1d(real.boundaries["mounting_holes"], real.t2f[:, frame])
    rigid = real.with_boundaries({**real.boundaries, "mounting_holes": held})
    K = np.array(tip_compliance(rigid, case.process.E_MPa, case.process.poisson).K)
    return 1.0 - stiffness(case, SCALE) / K


def compared(cases: Sequence[Case] = (PAPER,)) -> list[Comparison]:
    scaled = [shares(case) * case.process.E_MPa * case.housing.depth / stiffness(case, SCALE) for case in cases]
    return [
        covering(f"FRAME_FRACTIONS of the {name} spring, {', '.join(map(str, cases))}", constant, seen)
        for name, constant, seen in zip(("low", "high"), FRAME_FRACTIONS, np.transpose(scaled), strict=True)
    ]
