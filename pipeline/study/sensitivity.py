"""Sobol indices: the fraction of an output's variance that each varied key causes, alone and with other keys.

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

RESAMPLES = 200  # number of bootstrap samples for the confidence intervals
CONFIDENCE = 0.95  # coverage of the confidence intervals


@dataclass(frozen=True, kw_only=True)
class Sensitivity:
    """The Sobol indices [1] of the output `wanted` with respect to the varied key `key`.

    The indices are fractions of the output's variance. `first` is the fraction due to the key alone; `total` also
    includes interactions with other keys. Each interval is a 95 % confidence interval from a bootstrap, given by its
    two ends.
    """

    wanted: str
    key: str
    first: float
    first_interval: list[float]
    total: float
    total_interval: list[float]


def sensitivities(store: StudyStore, study: Study) -> tuple[Sensitivity, ...]:
    """Return the Sobol indices of each output of a study with respect to each varied key.

    `store` holds the results of the points. Outputs that are constant, or that have no number at some point, are left
    out, because they have no indices. Raises InputError if any point is missing, refused or failed, because the indices
    need the values at all points.
    """
    missing = point_count(study) - store.counts()["done"]
    if missing:
        msg = f"sensitivities: {missing} points have no results; narrow the ranges so that no point is refused"
        raise InputError(msg, field="sensitivities", value=missing)
    indices: list[Sensitivity] = []
    for wanted in filter(store.differs, study.wanted):
        values = store.column(wanted)
        if not np.isnan(values).any():
            indices += _sobol_indices(study, wanted, values)
    return tuple(indices)


def _sobol_indices(study: Study, wanted: str, values: Floats) -> list[Sensitivity]:
    """Return the Sobol indices of the output `wanted` with respect to each varied key.

    `values` (points,) holds the output at all points of the study, in the order of the points.
    """
    key_count = len(study.vary)
    # SciPy calls its function three times: for the sample matrices A and B, with `samples` points each, and for the
    # matrices AB that mix both. In each call, the lambda ignores the points and returns their stored values.
    values_by_call = iter(np.split(values, [study.samples, 2 * study.samples]))
    result = saltelli_indices(study, lambda _: next(values_by_call))
    with np.errstate(divide="ignore", invalid="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # SciPy warns about a key without influence, which has no variance to resample
        bootstrap = result.bootstrap(confidence_level=CONFIDENCE, n_resamples=RESAMPLES)
    first = result.first_order.reshape(key_count)
    total = result.total_order.reshape(key_count)
    first_ends = _interval_ends(first, bootstrap.first_order.confidence_interval)
    total_ends = _interval_ends(total, bootstrap.total_order.confidence_interval)
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


def _interval_ends(indices: Floats, interval: Any) -> list[list[float]]:  # noqa: ANN401 - SciPy's own record
    """Return the two ends [1] of each key's confidence interval.

    For a key without influence, the bootstrap yields NaN. Both ends of its interval are then set to the index of the
    key, which is an element of `indices` (keys,).
    """
    ends = np.column_stack([np.ravel(interval.low), np.ravel(interval.high)])
    is_undefined = ~np.isfinite(ends).all(axis=1)
    ends[is_undefined] = indices[is_undefined, None]
    return list(map(list, ends.tolist()))
