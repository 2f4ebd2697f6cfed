"""MESH_PAIRS, ERROR_SHARE and odd_shape_factor: error over bar of each pair of meshes, against much finer ones.

`python tests/fits mesh_pairs` (8 minutes) solves six processes and four odd shapes to scale 0.5, and one to 0.36.
Without gauges, bar = odd_shape_factor x share x difference + floor; the largest error must fill a third of it at least.
"""

import itertools
from collections.abc import Sequence

import numpy as np
from fits.comparison import Comparison, covering
from fits.springs import EVERY, ODD, PETG, Case, solved, stiffness

from pipeline.springs.leaf_lengths import DEFAULT, MESH_PAIRS, MeshPair
from solve.housing.stiffness import housing_stiffness

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


def compared(
    pairs: Sequence[MeshPair] = (CHEAPEST, DEFAULT),
    groups: Sequence[Sequence[Case]] = (EVERY, ODD),
    reference: float = REFERENCE,
) -> list[Comparison]:
    rows = []
    for pair, cases in itertools.product(pairs, groups):
        seen = np.concatenate([filled(pair, case, reference) for case in cases])
        rows.append(covering(f"bar of scale {pair.fine:g} judged by {pair.coarse:g}, share {pair.share:g}", 1.0, seen))
    return rows


def details() -> list[str]:
    shown = [
        f"{case}: error over difference {raw_shares(pair, case, REFERENCE)} of {pair.share:g}"
        for case, pair in itertools.product((*EVERY, *ODD), (CHEAPEST, DEFAULT))
    ]
    finest = covering("share of the finest pair", FINEST.share, raw_shares(FINEST, PETG, FINEST_REFERENCE))
    return [*shown, str(finest)]
