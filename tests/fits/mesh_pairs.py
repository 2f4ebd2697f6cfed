"""MESH_PAIRS, ERROR_SHARE and odd_shape_factor: error over bar of each pair of meshes, against much finer ones.

`python tests/fits/mesh_pairs.py` (8 minutes) solves six processes and four odd shapes to scale 0.5, and one to 0.36.
Without gauges, bar = odd_shape_factor x share x difference + floor; the largest error must fill a third of it at least.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from fits.comparison import Comparison, covering  # noqa: E402
from fits.springs import EVERY, ODD, PETG, Case, solved, stiffness  # noqa: E402

from pipeline.springs.leaf_lengths import DEFAULT, MESH_PAIRS, MeshPair  # noqa: E402
from solve.housing.stiffness import housing_stiffness  # noqa: E402

CHEAPEST, _, FINEST = MESH_PAIRS
REFERENCE, FINEST_REFERENCE = 0.5, 0.36  # scales: 4.5 times the dofs of scale 1, 2.5 times those of scale 0.5


def raw_shares(pair: MeshPair, case: Case, reference: float) -> np.ndarray:
    """Return the error over the difference of both meshes [1], shape (2,)."""
    fine, coarse, truth = (stiffness(case, scale) for scale in (pair.fine, pair.coarse, reference))
    return np.abs(fine / truth - 1.0) / np.abs(coarse / fine - 1.0)


def filled(pair: MeshPair, case: Case, reference: float) -> np.ndarray:
    """Return the error over the bar that the product gives [1], shape (2,)."""
    found = housing_stiffness(solved(case, pair.fine), solved(case, pair.coarse))
    bars = np.array(pair.errors(case.housing, found.error))
    return np.abs(np.array(found.K) / stiffness(case, reference) - 1.0) / bars


def compared(pair: MeshPair, cases: Sequence[Case], reference: float = REFERENCE) -> list[Comparison]:
    seen = np.concatenate([filled(pair, case, reference) for case in cases])
    return [covering(f"bar of scale {pair.fine:g} judged by {pair.coarse:g}, share {pair.share:g}", 1.0, seen)]


if __name__ == "__main__":
    for case in (*EVERY, *ODD):
        shown = [f"{raw_shares(pair, case, REFERENCE)} of {pair.share:g}" for pair in (CHEAPEST, DEFAULT)]
        print(f"{case}: error over difference {', '.join(shown)}", flush=True)
    for cases in (EVERY, ODD):
        print(*compared(CHEAPEST, cases), *compared(DEFAULT, cases), sep="\n", flush=True)
    print(covering("share of the finest pair", FINEST.share, raw_shares(FINEST, PETG, FINEST_REFERENCE)))
