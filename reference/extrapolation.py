"""Richardson extrapolation: the limit of a quantity at zero element size, estimated from three meshes."""

from collections.abc import Sequence
from dataclasses import dataclass

from scipy.optimize import brentq

# Ratio of the observed to the expected rate of convergence. Outside this range, the meshes are not fine enough for the
# asymptotic error.
RATE_BAND = (0.5, 2.0)
_SEARCH_RANGE = (0.05, 10.0)  # range in which the observed rate is searched, as multiples of the expected rate
_SAFETY_FACTOR = 3.0  # for an observed rate outside the band; P. J. Roache, J. Fluids Eng. 116, 1994
# Smallest ratio of the error to the correction: twice the scatter of the limits of several mesh families.
_MIN_ERROR_RATIO = 0.15
_ROUND_OFF = 1e-12  # relative difference below which values differ only by round-off


@dataclass(frozen=True, kw_only=True)
class Extrapolated:
    """A limit and its error [unit of the value], the observed rate of convergence [1], and a sentence on the method.

    `rate` is None if no rate explains the values.
    """

    value: float
    error: float
    rate: float | None
    status: str


def richardson(values: Sequence[float], sizes: Sequence[float], expected_rate: float) -> Extrapolated:
    """Extrapolate the values on three meshes, coarse to fine, to element size zero [unit of the values].

    A value v at the element size h is assumed to be v_0 + C h^p. With the expected rate p, the limit v_0 follows from
    the two finest meshes: v_0 = v_3 + (v_3 - v_2) / ((h_2 / h_3)^p - 1). The error bar includes the limit at the
    observed rate, which follows from all three meshes. If the observed rate is outside `RATE_BAND` times the expected
    rate, the error bar is wide, and the status states the reason. Values that are not monotone are not extrapolated.

    See L. F. Richardson, Phil. Trans. R. Soc. A 226 (1927), and P. J. Roache, J. Fluids Eng. 116 (1994).
    """
    coarse, middle, fine = values
    first_step = middle - coarse
    last_step = fine - middle
    largest_step = max(abs(first_step), abs(last_step))
    # Nothing is extrapolated if the values agree to round-off, or do not change in one direction.
    if largest_step <= _ROUND_OFF * max(abs(coarse), abs(middle), abs(fine)):
        return Extrapolated(value=fine, error=_ROUND_OFF * abs(fine), rate=None, status="the meshes agree to round-off")
    if first_step * last_step <= 0.0:
        status = "not extrapolated: the three values are not monotone; the bar is 3 times their largest difference"
        return Extrapolated(value=fine, error=_SAFETY_FACTOR * largest_step, rate=None, status=status)
    return _extrapolate_monotone(fine, first_step, last_step, sizes, expected_rate)


def _extrapolate_monotone(
    fine: float, first_step: float, last_step: float, sizes: Sequence[float], expected_rate: float
) -> Extrapolated:
    """Extrapolate three monotone values to element size zero, as `richardson` describes.

    `fine` is the value on the finest mesh. The steps are the changes from the coarse to the middle mesh, and from the
    middle to the fine mesh.
    """
    last_ratio = sizes[1] / sizes[2]
    correction = last_step / (last_ratio**expected_rate - 1.0)
    limit = fine + correction
    rate = _observed_rate(first_step / last_step, sizes, expected_rate)
    # Difference between the limits at the observed rate and at the expected rate.
    spread = 0.0 if rate is None else abs(last_step / (last_ratio**rate - 1.0) - correction)

    low = RATE_BAND[0] * expected_rate
    high = RATE_BAND[1] * expected_rate
    if rate is not None and low <= rate <= high:
        # The limit at the expected rate is reported. The limit at the observed rate only widens the error bar, because
        # the scatter of unstructured meshes affects it several times as much.
        status = f"extrapolated from three meshes at rate {expected_rate:g} (observed {rate:.2f})"
        error = max(spread, _MIN_ERROR_RATIO * abs(correction))
        return Extrapolated(value=limit, error=error, rate=rate, status=status)
    observed = "no rate was observed" if rate is None else f"the observed rate {rate:.2f} is not {low:g} to {high:g}"
    status = f"extrapolated at rate {expected_rate:g}, but {observed}; the bar is at least 3 times the largest step"
    largest_step = max(abs(first_step), abs(last_step))
    error = max(spread, _SAFETY_FACTOR * abs(correction), _SAFETY_FACTOR * largest_step)
    return Extrapolated(value=limit, error=error, rate=rate, status=status)


def _observed_rate(step_quotient: float, sizes: Sequence[float], expected_rate: float) -> float | None:
    """Return the rate of convergence [1] that explains the values on three meshes, or None if no rate does.

    `step_quotient` is (v_2 - v_1) / (v_3 - v_2), and `sizes` are the element sizes h_1, h_2 and h_3 from coarse to
    fine. Errors C h^p have the quotient ((h_1 / h_2)^p - 1) / (1 - (h_2 / h_3)^-p), which is solved for p. Rates from
    0.05 to 10 times the expected rate are searched.
    """
    first_ratio = sizes[0] / sizes[1]
    last_ratio = sizes[1] / sizes[2]

    def excess(rate: float) -> float:
        """Return the step quotient for a rate, minus the observed quotient."""
        return float((first_ratio**rate - 1.0) / (1.0 - last_ratio**-rate) - step_quotient)

    slowest = _SEARCH_RANGE[0] * expected_rate
    fastest = _SEARCH_RANGE[1] * expected_rate
    if not excess(slowest) * excess(fastest) <= 0.0:
        return None
    return float(brentq(excess, slowest, fastest))
