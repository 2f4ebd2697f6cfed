"""How far a computed number is from its limit, estimated from the same number on coarser meshes."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from scipy.optimize import brentq

RATE_BAND = (0.5, 2.0)  # of the expected rate: outside, the meshes are not yet in the range where the rate holds
_SEARCH = (0.05, 10.0)  # of the expected rate
_WIDE = 3.0  # factor where the observed rate is not sane; P. J. Roache, J. Fluids Eng. 116, 1994
_LEAST = 0.15  # of the last correction: twice the scatter of limits over families of unstructured meshes
_SAME = 1e-12  # relative: differences under this are round-off of the solve


@dataclass(frozen=True, kw_only=True)
class SolveInfo:
    """How a result was computed: the method, its unknowns [1], its wall time [s], and a sentence on its quality."""

    method: str
    dofs: int
    seconds: float
    status: str


@dataclass(frozen=True, kw_only=True)
class Extrapolated:
    """A limit value, the half width of its error bar [unit of the value], the observed rate and how it was found.

    `rate` is None where none was observed.
    """

    value: float
    error: float
    rate: float | None
    status: str


def richardson(values: Sequence[float], sizes: Sequence[float], expected_rate: float) -> Extrapolated:
    """Return the limit of values on two or three meshes, coarse to fine, at size zero [unit of the values].

    Their error is C h^rate. The value is the limit at the expected rate; the observed rate must be sane, and the bar
    holds its limit too. With two meshes, or no sane observed rate, the error is wide and the status says so. Raises
    ValueError on bad sizes.
    L. F. Richardson, Phil. Trans. R. Soc. A 226, 1927; P. J. Roache, J. Fluids Eng. 116, 1994.
    """
    _check(values, sizes, expected_rate)
    steps = [fine - coarse for coarse, fine in pairwise(values)]
    largest_step = max(abs(step) for step in steps)
    fine = values[-1]
    correction = steps[-1] / (_ratio(sizes[-2:], expected_rate) - 1.0)
    limit = fine + correction
    if largest_step <= _SAME * max(abs(value) for value in values):
        return Extrapolated(value=fine, error=_SAME * abs(fine), rate=None, status="the meshes agree to round-off")
    if len(steps) == 1:
        status = f"extrapolated from two meshes at the assumed rate {expected_rate:g}; the rate was not observed"
        return Extrapolated(value=limit, error=abs(correction), rate=None, status=status)
    if steps[0] * steps[1] <= 0.0:
        status = "not extrapolated: the three values are not monotone; the bar is 3 times their largest difference"
        return Extrapolated(value=fine, error=_WIDE * largest_step, rate=None, status=status)

    rate = _observed_rate(steps[0] / steps[1], sizes, expected_rate)
    # how far the limit at the observed rate lies from that at the expected one
    spread = 0.0 if rate is None else abs(steps[1] / (_ratio(sizes[1:], rate) - 1.0) - correction)
    low = RATE_BAND[0] * expected_rate
    high = RATE_BAND[1] * expected_rate
    if rate is not None and low <= rate <= high:
        # The scatter of unstructured meshes moves the limit at the observed rate several times as far as the other one.
        status = f"extrapolated from three meshes at rate {expected_rate:g} (observed {rate:.2f})"
        return Extrapolated(value=limit, error=max(spread, _LEAST * abs(correction)), rate=rate, status=status)
    observed = "no rate was observed" if rate is None else f"the observed rate {rate:.2f} is not {low:g} to {high:g}"
    status = f"extrapolated at rate {expected_rate:g}, but {observed}; the bar is at least 3 times the largest step"
    error = max(spread, _WIDE * max(abs(correction), largest_step))
    return Extrapolated(value=limit, error=error, rate=rate, status=status)


def _observed_rate(quotient: float, sizes: Sequence[float], expected_rate: float) -> float | None:
    """Return the rate at which the quotient of the two steps belongs to these sizes; None when it is not positive."""

    def excess(rate: float) -> float:
        return (_ratio(sizes[:2], rate) - 1.0) / (1.0 - 1.0 / _ratio(sizes[1:], rate)) - quotient

    low = expected_rate * _SEARCH[0]
    high = expected_rate * _SEARCH[1]
    return None if excess(low) * excess(high) > 0.0 else float(brentq(excess, low, high))


def _ratio(sizes: Sequence[float], rate: float) -> float:
    return float((sizes[0] / sizes[1]) ** rate)


def _check(values: Sequence[float], sizes: Sequence[float], expected_rate: float) -> None:
    if len(values) != len(sizes) or len(values) not in (2, 3):
        msg = f"{len(values)} values at {len(sizes)} sizes: must be 2 or 3 of each; give one size for each value"
        raise ValueError(msg)
    if not all(coarse > fine > 0.0 for coarse, fine in pairwise(sizes)):
        msg = f"sizes = {tuple(sizes)}: must be positive and fall; give the meshes coarse to fine"
        raise ValueError(msg)
    if not all(math.isfinite(value) for value in values):
        msg = f"values = {tuple(values)}: must be finite; check the solves"
        raise ValueError(msg)
    if not expected_rate > 0.0:
        msg = f"expected_rate = {expected_rate:g}: must be greater than 0; take the order of the discretisation"
        raise ValueError(msg)


def propagated(function: Callable[..., float], values: Sequence[float], errors: Sequence[float]) -> float:
    """Return the half width of a function's value [its unit] when all arguments are off by their errors at their worst.

    Linear in the errors: the sum over the arguments of half the change from value - error to value + error.
    """
    total = 0.0
    for i, error in enumerate(errors):
        high = list(values)
        low = list(values)
        high[i] += error
        low[i] -= error
        total += 0.5 * abs(function(*high) - function(*low))
    return total
