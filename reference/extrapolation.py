"""The limit of a number on meshes without size, estimated from three meshes (Richardson)."""

from collections.abc import Sequence
from dataclasses import dataclass

from scipy.optimize import brentq

RATE_BAND = (0.5, 2.0)  # of the expected rate: outside, the meshes are not yet in the range where the rate holds
_SEARCH = (0.05, 10.0)  # of the expected rate: where an observed rate is looked for
_WIDE = 3.0  # factor where the observed rate is not sane; P. J. Roache, J. Fluids Eng. 116, 1994
_LEAST = 0.15  # of the last correction: twice the scatter of limits over families of unstructured meshes
_SAME = 1e-12  # relative: differences under this are round-off of the solve


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
    """Return the limit of values on three meshes, coarse to fine, at size zero [unit of the values].

    Their error is C h^rate. The value is the limit at the expected rate; the observed rate must be sane, and the bar
    holds its limit too. Without a sane observed rate the error is wide and the status says so.
    L. F. Richardson, Phil. Trans. R. Soc. A 226, 1927; P. J. Roache, J. Fluids Eng. 116, 1994.
    """
    coarse, middle, fine = values
    first_step = middle - coarse
    last_step = fine - middle
    largest_step = max(abs(first_step), abs(last_step))
    if largest_step <= _SAME * max(abs(coarse), abs(middle), abs(fine)):
        return Extrapolated(value=fine, error=_SAME * abs(fine), rate=None, status="the meshes agree to round-off")
    if first_step * last_step <= 0.0:
        status = "not extrapolated: the three values are not monotone; the bar is 3 times their largest difference"
        return Extrapolated(value=fine, error=_WIDE * largest_step, rate=None, status=status)

    last_ratio = sizes[1] / sizes[2]
    correction = last_step / (last_ratio**expected_rate - 1.0)
    limit = fine + correction
    rate = _observed_rate(first_step / last_step, sizes, expected_rate)
    # How far the limits at the observed and at the expected rate lie apart.
    spread = 0.0 if rate is None else abs(last_step / (last_ratio**rate - 1.0) - correction)

    low = RATE_BAND[0] * expected_rate
    high = RATE_BAND[1] * expected_rate
    if rate is not None and low <= rate <= high:
        # The scatter of unstructured meshes moves the limit at the observed rate several times as far as the other one.
        status = f"extrapolated from three meshes at rate {expected_rate:g} (observed {rate:.2f})"
        return Extrapolated(value=limit, error=max(spread, _LEAST * abs(correction)), rate=rate, status=status)
    observed = "no rate was observed" if rate is None else f"the observed rate {rate:.2f} is not {low:g} to {high:g}"
    status = f"extrapolated at rate {expected_rate:g}, but {observed}; the bar is at least 3 times the largest step"
    error = max(spread, _WIDE * abs(correction), _WIDE * largest_step)
    return Extrapolated(value=limit, error=error, rate=rate, status=status)


def _observed_rate(step_quotient: float, sizes: Sequence[float], expected_rate: float) -> float | None:
    """Return the rate [1] that explains the first step between three meshes over the last one.

    `step_quotient` is (middle - coarse) / (fine - middle), `sizes` the three sizes of elements from coarse to fine.
    None where no rate from 0.05 to 10 times the expected one does.
    """
    first_ratio = sizes[0] / sizes[1]
    last_ratio = sizes[1] / sizes[2]

    def excess(rate: float) -> float:
        """Return the quotient of the steps that a rate predicts, less the one that was seen."""
        return float((first_ratio**rate - 1.0) / (1.0 - last_ratio**-rate) - step_quotient)

    slowest = _SEARCH[0] * expected_rate
    fastest = _SEARCH[1] * expected_rate
    if not excess(slowest) * excess(fastest) <= 0.0:
        return None
    return float(brentq(excess, slowest, fastest))
