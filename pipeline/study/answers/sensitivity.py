"""Sobol indices: which share of the scatter of a number each key that varies makes, alone and with the others.

A. Saltelli et al., Comput. Phys. Commun. 181 (2010) 259, doi 10.1016/j.cpc.2009.09.018, as SciPy has it.
"""

import math
import warnings
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.stats import sobol_indices

from cad.quantity import InputError
from pipeline.study.answers.point_columns import Floats, point_columns
from pipeline.study.points import point_count
from pipeline.study.store import StudyStore
from pipeline.study.study_file import Study

RESAMPLES = 200
LEVEL = 0.95


@dataclass(frozen=True, kw_only=True)
class Sensitivity:
    """The shares of the variance of a wanted number that one key makes [1]: alone (`first`), and with others (`total`).

    Each has the ends of its 95 % interval by bootstrap.
    """

    wanted: str
    key: str
    first: float
    first_interval: tuple[float, float]
    total: float
    total_interval: tuple[float, float]


def sensitivities(store: StudyStore, study: Study) -> tuple[Sensitivity, ...]:
    """Return the indices of every wanted number that scatters, for each key that varies.

    Raises InputError where points are missing, refused or failed: the indices need all of them.
    """
    columns = point_columns(store, study.wanted)
    lacking = point_count(study) - len(columns.points)
    if lacking:
        msg = f"sensitivities: {lacking} points have no results; narrow the spans so that none is refused"
        raise InputError(msg)
    found = []
    for wanted in study.wanted:
        if wanted in columns.values and not np.isnan(columns.values[wanted]).any() and columns.differs(wanted):
            found += _indices(study, wanted, columns.values[wanted])
    return tuple(found)


def _indices(study: Study, wanted: str, values: Floats) -> list[Sensitivity]:
    """Return the indices of one number; its values are those of A, of B, and of A with each column from B."""
    count = study.samples
    blocks = values.reshape(len(study.vary) + 2, 1, count)
    outputs: dict[Literal["f_A", "f_B", "f_AB"], Floats] = {"f_A": blocks[0], "f_B": blocks[1], "f_AB": blocks[2:]}
    result = sobol_indices(func=outputs, n=count)
    first, total = _intervals(result)
    shares = np.ravel(result.first_order).tolist(), np.ravel(result.total_order).tolist()
    return [
        Sensitivity(
            wanted=wanted,
            key=key,
            first=shares[0][i],
            first_interval=_ends(shares[0][i], first, i),
            total=shares[1][i],
            total_interval=_ends(shares[1][i], total, i),
        )
        for i, key in enumerate(study.vary)
    ]


def _intervals(result: Any) -> tuple[tuple[object, ...], tuple[object, ...]]:  # noqa: ANN401 - SciPy's own record
    """Return the lower and upper ends of the first and of the total indices [1], each of shape (1, keys)."""
    with np.errstate(divide="ignore", invalid="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a key that moves nothing has no scatter to resample
        spread = result.bootstrap(confidence_level=LEVEL, n_resamples=RESAMPLES)
    first, total = spread.first_order.confidence_interval, spread.total_order.confidence_interval
    return tuple(first), tuple(total)


def _ends(share: float, interval: tuple[object, ...], place: int) -> tuple[float, float]:
    """Return the ends of the interval of one key [1]; of a key that moves nothing both are its share."""
    lowest, largest = (float(np.ravel(np.asarray(end))[place]) for end in interval)
    return (lowest, largest) if math.isfinite(lowest) and math.isfinite(largest) else (share, share)
