"""Richardson extrapolation: the limit of a number at zero mesh size, estimated from three meshes."""

from collections.abc import Sequence
from dataclasses import dataclass

from scipy.optimize import brentq

RATE_BAND = (0.5, 2.0)  # observed over expected rate; outside, the meshes are not in the asymptotic range
_SEARCH = (0.05, 10.0)  # range of the search for the observed rate, over the expected rate
_WIDE = 3.0  # safety factor if the observed rate is outside the band; P. J. Roache, J. Fluids Eng. 116, 1994
_SMALLEST = 0.15  # smallest error over the correction: twice the scatter of the limits of several mesh families
_SAME = 1e-12  # relative difference below which values differ only by round-off


@dataclass(frozen=True, kw_only=True)
class Extrapolated:
    """A limit with its error [unit of the value], the observed rate of convergence [1], and a sentence on the method.

    `rate` is None if no rate fits the values.
    """

    value: float
    error: float
    rate: float | None
    status: str


def richardson(values: Sequence[float], sizes: Sequence[float], expected_rate: float) -> Extrapolated:
    """Return the limit of the values on three meshes, coarse to fine, at element size zero [unit of the values].

    The error of a value is assumed to be C h^rate, with the element sizes h. The limit is that of the expected rate.
    Its error bar includes the limit at the observed rate. If the observed rate is outside `RATE_BAND` times the
    expected one, the error bar is wide, and the status says so.
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
    # The difference between the limits at the observed and at the expected rate.
    spread = 0.0 if rate is None else abs(last_step / (last_ratio**rate - 1.0) - correction)

    low = RATE_BAND[0] * expected_rate
    high = RATE_BAND[1] * expected_rate
    if rate is not None and low <= rate <= high:
        # The limit at the expected rate is used, because the scatter of unstructured meshes changes the limit at the
        # observed rate several times as much.
        status = f"extrapolated from three meshes at rate {expected_rate:g} (observed {rate:.2f})"
        return Extrapolated(value=limit, error=max(spread, _SMALLEST * abs(correction)), rate=rate, status=status)
    observed = "no rate was observed" if rate is None else f"the observed rate {rate:.2f} is not {low:g} to {high:g}"
    status = f"extrapolated at rate {expected_rate:g}, but {observed}; the bar is at least 3 times the largest step"
    error = max(spread, _WIDE * abs(correction), _WIDE * largest_step)
    return Extrapolated(value=limit, error=error, rate=rate, status=status)


def _observed_rate(step_quotient: float, sizes: Sequence[float], expected_rate: float) -> float | None:
    """Return the rate of convergence [1] that explains the values on three meshes, or None if none fits.

    `step_quotient` is (middle - coarse) / (fine - middle), and `sizes` are the element sizes from coarse to fine. Rates
    from 0.05 to 10 times the expected one are tried.
    """
    first_ratio = sizes[0] / sizes[1]
    last_ratio = sizes[1] / sizes[2]

    def excess(rate: float) -> float:
        """Return the step quotient that a rate predicts minus the observed one."""
        return float((first_ratio**rate - 1.0) / (1.0 - last_ratio**-rate) - step_quotient)

    slowest = _SEARCH[0] * expected_rate
    fastest = _SEARCH[1] * expected_rate
    if not excess(slowest) * excess(fastest) <= 0.0:
        return None
    return float(brentq(excess, slowest, fastest))
