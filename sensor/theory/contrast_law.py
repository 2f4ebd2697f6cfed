"""The contrast of the tips: a combination of several forces that depends on the modulus, but not on travel and tilt.

If the sensor moves as a rigid body, the travel of its tips is a plane: travel + tilt . X_i. The weights w form the mean
over the high tips minus the mean over the low tips. They satisfy sum w_i = 0 and sum w_i X_i = 0, so they
cancel this plane in the travel of the tips,

    travel + tilt . X_i = (C F)_i + h E^(-2/3) F_i^(2/3) + (S F)_i / E + gap_i .

C is the compliance of the springs, S the compliance of the fruit, and h the Hertzian contact of a dome (0 for flat
tips). The contrast has one unknown, E, and is a cubic in E^(-1/3). The modulus is the largest E at which the contrast
is zero. Let g(F, E) be the contrast. The derivative of the modulus with respect to a force is -(dg / dF_i) / (dg / dE).

The gaps must be known, as they are for a level pair on its calibration block. On a fruit they are unknown, so a whole
press is read (`contrast_rise.py`).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from sensor.arrays import Floats, rows_of
from sensor.quantity import validation_error

Matrix = Sequence[Sequence[float]]
Place = tuple[float, float]

_MAX_STEPS = 100  # iterations for a root: Newton needs about six; pure bisection needs one per binary digit
_ROUND_OFF = 1e-9  # tolerance for the contrast of a tilt, relative to the largest coordinate of a tip


OF_ANOTHER_SENSOR = (
    "No modulus fits the forces. They must be the forces of this sensor, pressed on a fruit; calibrate it again."
)


class ReadingError(ValueError):
    """Forces that do not determine a modulus. The message gives the reason."""


@dataclass(frozen=True, kw_only=True)
class ContrastLaw:
    """The constants of the contrast of a sensor.

    `weights` [1] and `gaps` [mm] have one entry per tip. The gaps are the gaps under the tips before the press. `C`
    [mm/N] is the compliance of the springs. `S` [1/mm] is the compliance of the fruit, times E. The matrices C and S
    have a row and a column per tip. `hertz` [mm (MPa/N)^(2/3)] is the Hertzian constant of `hertz.hertz_factor`.
    """

    weights: tuple[float, ...]
    gaps: tuple[float, ...]
    C: Matrix
    S: Matrix
    hertz: float = 0.0

    def __post_init__(self) -> None:
        """Raise ValueError unless all arrays match the number of tips."""
        count = len(self.weights)
        shapes = (np.shape(self.gaps), np.shape(self.C), np.shape(self.S))
        if shapes != ((count,), (count, count), (count, count)):
            msg = f"The tables of {count} tips have the shapes {shapes}; each needs one row and one column per tip."
            raise ValueError(msg)

    @cached_property
    def arrays(self) -> tuple[Floats, Floats, Floats]:
        """Return weights, C and S as arrays. The arrays are cached, because a sensor is read many times."""
        return np.array(self.weights), np.array(self.C), np.array(self.S)


def contrast_weights(positions: Sequence[Place], springs: Sequence[str]) -> tuple[float, ...]:
    """Return the weight of each tip [1] in the contrast: the mean over the high tips minus the mean over the low tips.

    For each tip, `positions` has x and y [mm], and `springs` has the name of its spring, "low" or "high". Raises
    InputError if the contrast depends on the tilt of the sensor.
    """
    weights = []
    for spring in springs:
        if spring == "high":
            weights.append(1.0 / springs.count("high"))
        else:
            weights.append(-1.0 / springs.count("low"))
    tilt_contrast = np.abs(np.array(weights) @ np.array(positions))  # contrasts of a unit tilt along x and along y
    if tilt_contrast.max() > _ROUND_OFF * np.abs(positions).max():
        bound = "a line or a square, whose low and high tips have the same centre"
        hint = "one reading of a pair cannot separate tilt from stiffness"
        # The message names the pair, because no other layout has weights that do not cancel the tilt.
        raise validation_error("tips.layout", "pair", "", bound, hint)
    return tuple(weights)


def pair_law(C: Matrix, self_minus_cross: float) -> ContrastLaw:
    """Return the contrast law of a pair of tips, the low tip first, on springs of compliance C [mm/N].

    The contrast of a pair depends on its tilt, unlike the contrast of the other layouts. Flat tips have the compliance
    matrix [[s11, s12], [s12, s11]] / E of the fruit. Only `self_minus_cross` = s11 - s12 [1/mm] affects the contrast.
    """
    # This diagonal matrix gives the same contrast as the full matrix, because the weights add up to 0.
    S = ((self_minus_cross, 0.0), (0.0, self_minus_cross))
    return ContrastLaw(weights=(-1.0, 1.0), gaps=(0.0, 0.0), C=C, S=S)


def ratio_modulus(C: Matrix, self_minus_cross: float, forces: Sequence[float]) -> float:
    """Return the modulus [MPa] of a fruit from the `forces` [N] on the low and the high tip of a level pair.

    This is equation (4) of the paper that `two_spring_law.py` cites, extended to springs that act on each other. C
    [mm/N] is the compliance of the springs, the low tip first. `self_minus_cross` [1/mm] is s11 - s12 of the fruit,
    times E, as in `pair_law`. Raises ReadingError if no positive modulus is consistent with these forces.
    """
    low, high = forces
    # Both tips of a level pair travel equally. So the low spring bends farther than the high spring by the distance
    # [mm] by which the high tip indents the fruit deeper than the low tip.
    deflection_difference = (C[0][0] - C[1][0]) * low + (C[0][1] - C[1][1]) * high
    if not (deflection_difference > 0.0 and high > low):
        raise ReadingError(OF_ANOTHER_SENSOR)
    return self_minus_cross * (high - low) / deflection_difference


def read_modulus(law: ContrastLaw, forces: Sequence[float], offset: float = 0.0) -> float:
    """Return the modulus of the fruit [MPa] from the forces [N] of all tips at one moment.

    `offset` [mm] is added to the contrast of the gaps of the law. Raises ReadingError if a tip is out of contact, or if
    no modulus fits the forces.
    """
    spring_term, hertz_term, flesh_term = contrast_terms(law, forces)
    z = smallest_root(spring_term + offset, hertz_term, flesh_term)  # E^(-1/3)
    return 1.0 / (z * z * z)


class ContrastTerms(NamedTuple):
    """The coefficients of the contrast as a function of the modulus.

    The contrast `spring_term` + `hertz_term` E^(-2/3) + `flesh_term` / E is zero at the modulus of the fruit.
    `spring_term` [mm] contains the springs and the gaps, `hertz_term` [mm MPa^(2/3)] the Hertzian contact, and
    `flesh_term` [mm MPa] the flesh.
    """

    spring_term: float
    hertz_term: float
    flesh_term: float


def contrast_terms(law: ContrastLaw, forces: Sequence[float]) -> ContrastTerms:
    """Return the coefficients of the contrast for the tip forces F [N].

    The spring term is w.(C F + gaps), the Hertz term h w.F^(2/3) and the flesh term w.(S F). The law has the weights w,
    the compliances C and S, and the Hertzian constant h. Raises ReadingError unless there is one force per tip, and all
    forces are above 0 and finite.
    """
    if len(forces) != len(law.weights):
        msg = f"Got {len(forces)} forces for {len(law.weights)} tips. Check the channels of the sensor."
        raise ReadingError(msg)
    for tip, force in enumerate(forces, start=1):
        if not 0.0 < force < math.inf:
            msg = f"The force of tip {tip}, {force:g} N, must be finite and above 0. Press more level."
            raise ReadingError(msg)
    weights, C, S = law.arrays
    F = np.array(forces)
    spring_term = weights @ (C @ F + law.gaps)
    hertz_term = law.hertz * weights @ (F ** (2.0 / 3.0))
    flesh_term = weights @ (S @ F)
    return ContrastTerms(spring_term=float(spring_term), hertz_term=float(hertz_term), flesh_term=float(flesh_term))


@dataclass(frozen=True, kw_only=True)
class ReadingSlopes:
    """Sensitivity of a reading at one moment: the relative change of E per unit of each input.

    `forces` [1/N] and `springs` [1] have one entry per tip; `springs` are the changes per relative change of the
    stiffness. `contrast` [1/mm] is the change per contrast of additional gaps.
    """

    forces: tuple[float, ...]
    springs: tuple[float, ...]
    contrast: float


def stiffened_compliance(C: Matrix, factors: Sequence[float]) -> tuple[tuple[float, ...], ...]:
    """Return the compliance matrix C [mm/N] after the stiffness of each spring is multiplied by its factor [1].

    Each entry of C is divided by the square roots of the factors of its row and of its column.
    """
    scales = 1.0 / np.sqrt(factors)
    return rows_of(np.array(C) * np.outer(scales, scales))


def contrast_slopes(law: ContrastLaw, forces: Sequence[float], E: float) -> ReadingSlopes:
    """Return the sensitivity of a reading to its inputs, at the modulus E [MPa] and the forces [N], which are above 0.

    Let g(F, E) be the contrast [mm]. A change dg at constant E changes ln E by dg / (-E dg/dE). For a force, dg follows
    from

        dg/dF_i = (w C)_i + 2/3 h w_i E^(-2/3) F_i^(-1/3) + (w S)_i / E .

    The law has the weights w, the compliances C and S, and the Hertzian constant h.
    """
    _, hertz_term, flesh_term = contrast_terms(law, forces)
    E_power = E ** (-2.0 / 3.0)
    # -E dg/dE [mm]; the divisor 1.5 here and below comes from the exponents 2/3 of E and F
    per_log_E = hertz_term * E_power / 1.5 + flesh_term / E
    weights = np.array(law.weights)
    C = np.array(law.C)
    F = np.array(forces)
    # The terms of dg/dF_i [mm/N] due to the springs, the flesh and the Hertzian contact.
    spring_slopes = weights @ C
    flesh_slopes = weights @ np.array(law.S) / E
    dome_slopes = law.hertz * E_power / 1.5 * weights * F ** (-1.0 / 3.0)
    per_force = (spring_slopes + flesh_slopes + dome_slopes) / per_log_E
    # A spring that is 1 % stiffer reduces its row and its column of C by 0.5 % each.
    per_spring = -0.5 * (weights * (C @ F) + spring_slopes * F) / per_log_E
    return ReadingSlopes(
        forces=tuple(per_force.tolist()),
        springs=tuple(per_spring.tolist()),
        contrast=1.0 / per_log_E,
    )


def tip_travels(law: ContrastLaw, forces: Sequence[float], E: float) -> tuple[float, ...]:
    """Return the travel of each tip [mm] at which a fruit of modulus E [MPa] resists with `forces` [N].

    The travel is the sum of the spring deflection, the indentation of the fruit, and the gap under the tip.
    """
    F = np.array(forces)
    hertz_indentation = law.hertz * (F / E) ** (2.0 / 3.0)
    travels = (np.array(law.C) + np.array(law.S) / E) @ F + hertz_indentation + law.gaps
    return tuple(travels.tolist())


def fit_plane(positions: Sequence[Place], heights: Sequence[float]) -> tuple[float, float, float | None]:
    """Fit a plane to the `heights` [mm] of points by least squares.

    Return the mean height [mm], the slope along x [1] and the slope along y [1]. The slope along y is None if all
    points have the same y, as tips in a row do, because they do not determine it. The slope along x is 0 if all points
    have the same x. The `positions` (x, y) [mm] must be symmetric about their centre, so that the two slopes are
    independent.
    """
    # The heights need not be centred, because each column of `arms` adds up to 0.
    arms = np.array(positions) - np.mean(positions, axis=0)
    x_squares, y_squares = (arms**2).sum(axis=0)
    x_moment, y_moment = np.array(heights) @ arms
    slope_x = float(x_moment / x_squares) if x_squares > 0.0 else 0.0
    slope_y = float(y_moment / y_squares) if y_squares > 0.0 else None
    return float(np.mean(heights)), slope_x, slope_y


def smallest_root(a: float, b: float, d: float) -> float:
    """Return the root z = E^(-1/3) [MPa^(-1/3)] of the contrast a + b z^2 + d z^3 between 0 and its next extremum.

    `a` [mm], `b` [mm MPa^(2/3)] and `d` [mm MPa] are the spring term, the Hertz term and the flesh term of
    `ContrastTerms`. The cubic has extrema at z = 0 and at z = -2 b / (3 d). If the second extremum is above 0, a root
    beyond it is not accepted, because the contrast changes with E in the opposite direction there. Otherwise, the cubic
    is monotonic for all z > 0. Raises ReadingError if the cubic does not change its sign in this range.
    """
    second_extremum = -2.0 * b / (3.0 * d) if d != 0.0 else 0.0
    end = second_extremum if second_extremum > 0.0 else _beyond_root(a, b, d)
    # The value of the cubic at z = 0 is a, so it must have the opposite sign at the end of the range.
    end_value = a + end * end * (b + d * end)
    if not a * end_value < 0.0:  # also refuses nan
        raise ReadingError(OF_ANOTHER_SENSOR)
    return _root_between(a, b, d, end)


def _root_between(a: float, b: float, d: float, end: float) -> float:
    """Return the root of the cubic a + b z^2 + d z^3 between 0 and `end`, where it changes its sign once.

    Newton's method is used in a bracket that shrinks in each step. A step that leaves the bracket is replaced by a
    bisection.
    """
    start = 0.0
    z = 0.5 * end
    for _ in range(_MAX_STEPS):
        contrast = a + z * z * (b + d * z)
        if a * contrast > 0.0:  # the sign has not changed yet, so the root is larger
            start = z
        else:
            end = z
        slope = z * (2.0 * b + 3.0 * d * z)
        next_z = z - contrast / slope if slope != 0.0 else start  # `start` leads to a bisection
        if next_z == z:  # converged
            break
        if not start < next_z < end:
            next_z = 0.5 * (start + end)
            if next_z in (start, end):  # no number lies between the two ends
                break
        z = next_z
    return z


def _beyond_root(a: float, b: float, d: float) -> float:
    """Return a point z beyond the root, if any, of a cubic a + b z^2 + d z^3 that is monotonic for z > 0.

    `b` and `d` have the same sign, so the root is smaller than the root of the cubic without one of these terms. The
    point is 1 if both are 0.
    """
    square_root = math.sqrt(abs(a / b)) if b != 0.0 else math.inf
    cube_root = abs(a / d) ** (1.0 / 3.0) if d != 0.0 else math.inf
    upper_bound = min(square_root, cube_root)
    return 2.0 * upper_bound if math.isfinite(upper_bound) else 1.0
