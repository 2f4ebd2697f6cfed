"""Sobol indices: the fraction of a number's variance by each varied key, by itself and with other keys.

A. Saltelli et al., Comput. Phys. Commun. 181 (2010) 259, doi 10.1016/j.cpc.2009.09.018, as implemented in SciPy.
"""

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.study.points import point_count, saltelli_indices
from pipeline.study.store import StudyStore
from pipeline.study.study_file import Study
from sensor.arrays import Floats
from sensor.quantity import InputError

RESAMPLES = 200
CONFIDENCE = 0.95


@dataclass(frozen=True, kw_only=True)
class Sensitivity:
    """The fractions of a wanted number's variance by one key [1]: by itself (`first`), and with others (`total`).

    Each has the ends of its 95 % interval by bootstrap.
    """

    wanted: str
    key: str
    first: float
    first_interval: list[float]
    total: float
    total_interval: list[float]


def sensitivities(store: StudyStore, study: Study) -> tuple[Sensitivity, ...]:
    """Return the indices of every wanted number that varies, for each varied key.

    Raises InputError if points are missing, refused or failed, because the indices need all of them.
    """
    lacking = point_count(study) - store.counts()["done"]
    if lacking:
        msg = f"sensitivities: {lacking} points have no results; narrow the spans so that none is refused"
        raise InputError(msg, field="sensitivities", value=lacking)
    indices: list[Sensitivity] = []
    for wanted in filter(store.differs, study.wanted):
        values = store.column(wanted)
        if not np.isnan(values).any():
            indices += _indices(study, wanted, values)
    return tuple(indices)


def _indices(study: Study, wanted: str, values: Floats) -> list[Sensitivity]:
    """Return the indices of one number for each key, from its values at all points in order (points,)."""
    keys = len(study.vary)
    of_samples = iter(np.split(values, [study.samples, 2 * study.samples]))  # in SciPy's order
    result = saltelli_indices(study, lambda _: next(of_samples))
    with np.errstate(divide="ignore", invalid="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a key without influence has no variance to resample
        spread = result.bootstrap(confidence_level=CONFIDENCE, n_resamples=RESAMPLES)
    first = result.first_order.reshape(keys)
    total = result.total_order.reshape(keys)
    first_ends = _ends(first, spread.first_order.confidence_interval)
    total_ends = _ends(total, spread.total_order.confidence_interval)
    return [
        Sensitivity(
            wanted=wanted,
            key=key,
            first=float(first[i]),
            first_interval=first_ends[i],
            total=float(total[i]),
            total_interval=total_ends[i],
        )
        for i, key in enumerate(study.vary)
    ]


def _ends(indices: Floats, interval: Any) -> list[list[float]]:  # noqa: ANN401 - SciPy's own record
    """Return the ends of the interval of each key [1]; for a key without influence both are its index."""
    ends = np.column_stack([np.ravel(interval.low), np.ravel(interval.high)])
    nothing = ~np.isfinite(ends).all(axis=1)
    ends[nothing] = indices[nothing, None]
    return list(map(list, ends.tolist()))
