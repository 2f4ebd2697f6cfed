"""The two-spring law of the paper, in both directions: from targets to stiffnesses, and from stiffnesses to P.

Equation numbers refer to "Design and Simulation of a Tactile Sensor for Fruit Ripeness Detection", WCECS 2019, ISBN
978-988-14048-7-9. All stiffnesses have the same unit; in this project it is N/mm.

K_m is the stiffness of the fruit under the low tip. Away from the middle of a fruit, the stiffness under the high tip
differs: it is `stiffness_ratio` times K_m. P is then `stiffness_ratio` times the force ratio of springs K_l and
K_h / stiffness_ratio.
"""

import math
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from sensor.float_or_array import FloatOrArray
from sensor.quantity import python_numbers, validation_error

Definition = Literal["mid-range", "largest"]

SOFTEST = 1e-9  # modulus, divided by E_max, of a fruit so soft that both springs are practically rigid
CURVE_STEPS = 24  # number of steps of a curve of P whose moduli are all solved; even, so that E_max / 2 is one of them
_NL_LIMIT = 0.5  # limit of NL as K_h tends to 0
_LEAST_STEPS = 2  # minimum number of steps of a curve, so that it has a middle
_LEAST_LOG_R = -14.0  # ln(K_m,max / K_h) at which the high spring is practically rigid


@dataclass(frozen=True, kw_only=True)
class Springs:
    """The stiffnesses of the low and the high spring.

    Parameters
    ----------
    K_l : float
        Stiffness of the low spring [N/mm].
    K_h : float
        Stiffness of the high spring [N/mm].

    Raises
    ------
    ValueError
        If a stiffness is not greater than 0 and finite.

    Examples
    --------
    >>> twintip.Springs(K_l=0.753, K_h=17.3).stiffnesses
    (0.753, 17.3)
    """

    K_l: float
    K_h: float

    def __post_init__(self) -> None:
        """Raise ValueError unless both stiffnesses are numbers greater than 0 and finite."""
        for name, value in vars(self).items():
            _as_number(name, value)
        if not (0.0 < self.K_l < math.inf and 0.0 < self.K_h < math.inf):
            msg = (
                f"K_l = {self.K_l * 1e3:g} N/m, K_h = {self.K_h * 1e3:g} N/m: must be greater than 0 and finite; "
                "check the stiffnesses"
            )
            raise ValueError(msg)

    @property
    def stiffnesses(self) -> tuple[float, float]:
        """Return both stiffnesses, low then high [N/mm]."""
        return self.K_l, self.K_h

    def scaled(self, factors: Iterable[float]) -> "Springs":
        """Return springs with both stiffnesses multiplied by factors [1], low then high."""
        low, high = factors
        return Springs(K_l=self.K_l * low, K_h=self.K_h * high)


def _as_number(name: str, value: object) -> float:
    """Return an argument as one of Python's numbers; raises InputError, a ValueError, if it is none."""
    number = python_numbers(value)
    if isinstance(number, bool) or not isinstance(number, int | float):
        raise validation_error(name, str(value), "", "a number", "write for instance 5.0")
    return number


def _as_positive(name: str, value: object, unit: str = "") -> float:
    """Return an argument as a number; raises InputError unless it is greater than 0 and finite."""
    number = _as_number(name, value)
    if not 0.0 < number < math.inf:
        raise validation_error(name, number, unit, "greater than 0 and finite", "check its sign and its unit")
    return number


PAPER_SPRINGS = Springs(K_l=0.753, K_h=17.3)  # the springs of the paper, sized by its equations (6), (7) and (10)


def series_stiffness(K: float, K_m: FloatOrArray) -> FloatOrArray:
    """Return the stiffness of a spring in series with the fruit, by equations (1) and (2) [unit of `K` and `K_m`]."""
    return K * K_m / (K + K_m)


def spring_deflection(K: float, K_m: FloatOrArray, travel: FloatOrArray) -> FloatOrArray:
    """Return the deflection of a spring in series with the fruit, at a travel that both share [unit of `travel`]."""
    return travel * series_stiffness(K, K_m) / K


def force_ratio(springs: Springs, K_m: float, stiffness_ratio: float = 1.0) -> float:
    """Return the force ratio P = F_h / F_l of two springs on a fruit, by the paper's equation (3).

    Parameters
    ----------
    springs : Springs
        The two springs [N/mm].
    K_m : float
        Stiffness of the fruit under the low tip [N/mm].
    stiffness_ratio : float, optional
        Fruit stiffness under the high tip, divided by the fruit stiffness under the low tip [1].

    Returns
    -------
    float
        The force ratio [1].

    Raises
    ------
    ValueError
        Unless K_m and stiffness_ratio are greater than 0 and finite.

    Examples
    --------
    >>> springs = twintip.size_springs(P_max=5.0, NL=0.05, K_m_max=4.629)
    >>> round(twintip.force_ratio(springs, K_m=2.0), 3)
    2.927
    """
    for entry in getattr(K_m, "flat", (K_m,)):  # an array gives the ratio of each of its stiffnesses
        _as_positive("K_m", entry, "N/mm")
    _as_positive("stiffness_ratio", stiffness_ratio)
    return _ratio(springs, K_m, stiffness_ratio)


def _ratio(springs: Springs, K_m: float, stiffness_ratio: float) -> float:
    """Return the force ratio [1] as `force_ratio` does, without checks, because a search calls it many times."""
    return series_ratio(springs.K_l, springs.K_h, K_m, stiffness_ratio * K_m)


def series_ratio(K_l: float, K_h: float, K_m_low: float, K_m_high: float) -> float:
    """Return the force ratio [1] of two springs, each in series with the fruit under its tip, by equation (3)."""
    return series_stiffness(K_h, K_m_high) / series_stiffness(K_l, K_m_low)


def fruit_stiffness(springs: Springs, P: float, stiffness_ratio: float = 1.0) -> float:
    """Return the stiffness of the fruit from the force ratio of two springs, by the paper's equation (4).

    With the stiffness ratio r, the result is

        K_m = K_h K_l (r - P) / (r (P K_l - K_h)).

    This equation holds for any NL, because P need not be a linear function of the stiffness.

    Parameters
    ----------
    springs : Springs
        The two springs [N/mm].
    P : float
        Force ratio F_h / F_l [1].
    stiffness_ratio : float, optional
        Fruit stiffness under the high tip, divided by the fruit stiffness under the low tip [1].

    Returns
    -------
    float
        The stiffness of the fruit under the low tip [N/mm].

    Raises
    ------
    ValueError
        Unless 0 < stiffness_ratio < P < K_h / K_l, the range of the springs.

    Examples
    --------
    >>> springs = twintip.size_springs(P_max=5.0, NL=0.05, K_m_max=4.629)
    >>> round(twintip.fruit_stiffness(springs, P=3.0), 3)
    2.083
    """
    P = _as_number("P", P)
    stiffness_ratio = _as_positive("stiffness_ratio", stiffness_ratio)
    K_l = springs.K_l
    K_h = springs.K_h
    if not stiffness_ratio < P < K_h / K_l:
        bound = f"greater than {stiffness_ratio:g} and less than K_h/K_l = {K_h / K_l:g}"
        msg = f"P = {P:g} must be {bound}. Check the two forces."
        raise ValueError(msg)
    return K_h * K_l * (stiffness_ratio - P) / (stiffness_ratio * (P * K_l - K_h))


def hayes_stiffness(E: float, poisson: float, radius: float) -> float:
    """Return K_m = 2 r E / (1 - nu^2) [N/mm] under a flat circular tip of `radius` r [mm]: (6) with C_k = 1."""
    return 2.0 * radius * E / (1.0 - poisson**2)


def stiffness_at_largest_nonlinearity(K_h: float, K_m_max: float) -> float:
    """Return K_m* = sqrt(K_h (K_h + K_m,max)) - K_h, at which P deviates most from a straight line [unit of `K_h`]."""
    return math.sqrt(K_h * (K_h + K_m_max)) - K_h


def nonlinearity(
    springs: Springs,
    K_m_max: float,
    definition: Definition = "mid-range",
    stiffness_ratio: float = 1.0,
    stiffening: Sequence[float] = (),
) -> float:
    """Return NL [1], the deviation of P from a straight line between K_m = 0 and K_m,max, divided by the rise of P.

    `K_m_max` [N/mm] is the stiffness of the firmest fruit. `definition` is where NL is evaluated: at K_m,max / 2
    ("mid-range", the paper's equation (7)), or where it is largest ("largest"). `stiffness_ratio` [1] is the fruit
    stiffness under the high tip, divided by the fruit stiffness under the low tip.

    Under a skin, K_m is not proportional to the modulus E of the flesh. For such a fruit, `stiffening` holds K_m /
    K_m,max [1] at the `curve_shares` of E_max. The straight line is then over E instead of K_m.
    """
    if stiffening:
        P = [_ratio(springs, K_m_max * fraction, stiffness_ratio) for fraction in stiffening]
        return curve_nonlinearity(P, curve_shares(len(P) - 1), definition)
    K_h = springs.K_h / stiffness_ratio  # with this K_h, the equations for equal stiffness under the two tips hold
    K_m = stiffness_at_largest_nonlinearity(K_h, K_m_max) if definition == "largest" else 0.5 * K_m_max
    # P tends to the stiffness ratio as K_m tends to 0.
    rise = _ratio(springs, K_m_max, stiffness_ratio) - stiffness_ratio
    return (_ratio(springs, K_m, stiffness_ratio) - stiffness_ratio) / rise - K_m / K_m_max


def curve_shares(steps: int) -> list[float]:
    """Return the fractions of E_max [1] at which P is evaluated: nearly 0, then 1 / steps, 2 / steps, up to 1."""
    return [SOFTEST, *(step / steps for step in range(1, steps + 1))]


def curve_nonlinearity(P: Sequence[float], E: Sequence[float], definition: Definition) -> float:
    """Return NL [1], the deviation of a curve P(E) from a straight line, divided by the rise of P.

    `P` [1] are the force ratios at the increasing moduli `E`, which may have any unit. E[0] must be nearly 0. With the
    `definition` "mid-range", NL is the deviation at the middle modulus. With "largest", it is the vertex of the
    parabola through the largest deviation and its two neighbours, which are treated as equally spaced. The result is
    nan if a required P is not finite, because a tip is out of contact, or if P does not change.
    """
    rise = P[-1] - P[0]
    if rise == 0.0 or not math.isfinite(rise):
        return math.nan
    deviations = [(p - P[0]) / rise - e / E[-1] for p, e in zip(P, E, strict=True)]
    if definition == "mid-range":
        return deviations[len(P) // 2]
    if not all(map(math.isfinite, deviations)):
        return math.nan
    largest = deviations.index(max(deviations))
    middle = min(max(largest, 1), len(P) - 2)  # moved by one from an end, so that both neighbours exist
    before, here, after = deviations[middle - 1 : middle + 2]
    second_difference = before - 2.0 * here + after
    if second_difference >= 0.0:  # the parabola through the three deviations has no maximum
        return here
    return here - (after - before) ** 2 / (8.0 * second_difference)  # height of its vertex


def size_springs(
    P_max: float,
    NL: float,
    K_m_max: float,
    definition: Definition = "mid-range",
    stiffness_ratio: float = 1.0,
    stiffening: Sequence[float] = (),
) -> Springs:
    """Return the springs for a force ratio P_max and a nonlinearity NL on the firmest fruit, in closed form.

    The springs satisfy the paper's equations (7) and (10). With r = K_m,max / K_h, for a stiffness ratio of 1, the
    nonlinearity is

        NL = r / (4 + 2 r) at mid-range,    NL = (s - 1) / (s + 1) with s = sqrt(1 + r) at its maximum.

    Either equation gives r in closed form, and K_l = K_m,max / (P_max (1 + r) - 1). With `stiffening`, r is found
    numerically. NL then increases with r from the value that the skin causes under rigid springs.

    Parameters
    ----------
    P_max : float
        Force ratio on the firmest fruit [1].
    NL : float
        Nonlinearity of P as a function of the fruit stiffness [1].
    K_m_max : float
        Stiffness of the firmest fruit [N/mm].
    definition : "mid-range" or "largest", optional
        Where NL is evaluated: at half of K_m_max, or where it is largest.
    stiffness_ratio : float, optional
        Fruit stiffness under the high tip, divided by the fruit stiffness under the low tip [1].
    stiffening : sequence of float, optional
        Stiffness of a fruit with a skin, divided by K_m_max [1]: at nearly zero modulus, then at an even number of
        equal steps up to the largest modulus, where it is 1.

    Returns
    -------
    Springs
        The low and the high spring.

    Raises
    ------
    ValueError
        Unless P_max > stiffness_ratio > 0, 0 < NL < 0.5 and K_m_max > 0; for an unknown `definition`; or if no springs
        have this NL under the skin, for instance because the skin already causes a larger one.

    Examples
    --------
    >>> springs = twintip.size_springs(P_max=5.0, NL=0.05, K_m_max=4.629)
    >>> round(springs.K_l, 3), round(springs.K_h, 2)
    (0.906, 20.83)
    """
    if definition not in get_args(Definition):
        bound = f"one of {', '.join(get_args(Definition))}"
        raise validation_error("definition", str(definition), "", bound, "choose one of these")
    P_max, NL, K_m_max = _as_number("P_max", P_max), _as_number("NL", NL), _as_number("K_m_max", K_m_max)
    stiffness_ratio = _as_positive("stiffness_ratio", stiffness_ratio)
    stiffening = _checked_stiffening(stiffening)
    ratio = P_max / stiffness_ratio  # force ratio for equal stiffness under the two tips
    if not (ratio > 1.0 and 0.0 < NL < _NL_LIMIT and 0.0 < K_m_max < math.inf):
        bound = f"P_max > {stiffness_ratio:g}, 0 < NL < 0.5, K_m_max > 0"
        msg = f"P_max = {P_max:g}, NL = {NL:g}, K_m_max = {K_m_max:g} N/mm must be {bound}. Check the targets."
        raise ValueError(msg)
    r_mid_range = 4.0 * NL / (1.0 - 2.0 * NL)
    r_largest = ((1.0 + NL) / (1.0 - NL)) ** 2 - 1.0
    r = r_largest if definition == "largest" else r_mid_range

    def springs_for(r: float) -> Springs:
        """Return the springs with the given r and the force ratio P_max."""
        return Springs(K_l=K_m_max / (ratio * (1.0 + r) - 1.0), K_h=stiffness_ratio * K_m_max / r)

    if not stiffening:
        return springs_for(r)

    def nonlinearity_at(log_r: float) -> float:
        """Return the nonlinearity [1] of the springs with the given ln r on a fruit with a skin."""
        return nonlinearity(springs_for(math.exp(log_r)), K_m_max, definition, stiffness_ratio, stiffening)

    return springs_for(math.exp(_log_r_under_skin(nonlinearity_at, NL, r)))


def _checked_stiffening(stiffening: object) -> Sequence[float]:
    """Return the stiffnesses of a fruit with a skin as numbers [1], or none; raises InputError if they cannot be so."""
    stiffnesses = python_numbers(stiffening)
    if not isinstance(stiffnesses, list | tuple):
        hint = "leave it out without a skin"
        raise validation_error("stiffening", str(stiffening), "", "a sequence of numbers", hint)
    for entry in stiffnesses:
        _as_positive("stiffening", entry)
    steps = len(stiffnesses) - 1
    if stiffnesses and (steps < _LEAST_STEPS or steps % 2):
        bound = "an odd number of stiffnesses, at least 3"
        raise validation_error("stiffening", len(stiffnesses), "numbers", bound, "add the middle modulus")
    if stiffnesses and not math.isclose(stiffnesses[-1], 1.0):
        raise validation_error("stiffening", stiffnesses[-1], "", "1 at its end", "divide it by its last number")
    return stiffnesses


def _log_r_under_skin(nonlinearity_at: Callable[[float], float], NL: float, r_without_skin: float) -> float:
    """Return ln r at which the nonlinearity on a fruit with a skin is NL [1], with r = K_m,max / K_h.

    `nonlinearity_at` returns the nonlinearity [1] at ln r, which increases with ln r. `r_without_skin` is the solution
    for a fruit without a skin. Raises ValueError if the skin causes a larger nonlinearity than NL even under rigid
    springs.
    """
    from scipy.optimize import brentq  # rarely needed, and slow to import

    def excess(log_r: float) -> float:
        """Return the nonlinearity at ln r, minus NL [1]."""
        return nonlinearity_at(log_r) - NL

    nonlinearity_of_skin = excess(_LEAST_LOG_R) + NL
    if nonlinearity_of_skin >= NL:
        msg = f"NL = {NL:g} must be above {nonlinearity_of_skin:.4g}, the NL caused by the skin. Choose a larger NL."
        raise ValueError(msg)
    # The skin adds to the nonlinearity, so the root is smaller than r without a skin. Twice this r is a safe upper end
    # of the bracket. The tolerances are round-off.
    upper_end = math.log(2.0 * r_without_skin)
    if not excess(upper_end) > 0.0:
        msg = (
            f"NL = {NL:g} must be reachable, but this stiffening is not above a straight line, as that of a skin is. "
            "Check its numbers."
        )
        raise ValueError(msg)
    return float(brentq(excess, _LEAST_LOG_R, upper_end, xtol=1e-15, rtol=4.0 * sys.float_info.epsilon))
