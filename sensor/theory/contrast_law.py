"""The contrast of the tips: a combination of several forces that depends on the modulus, but not on travel and tilt.

A rigid pose lifts each tip by a plane: travel + tilt . X_i. The weights w have sum w_i = 0 and sum w_i X_i = 0; here
they are the mean of the high tips less the mean of the low ones. They cancel the plane in the travel of the tips,

    pose_i = (C F)_i + h E^(-2/3) F_i^(2/3) + (S F)_i / E + gap_i ,

with C the compliance of the springs, S the compliance of the body, and h the Hertz contact of a dome (0 for flat tips).
The remainder has one unknown, E: a cubic in E^(-1/3), whose largest root in E is the modulus. With g(F, E) the
contrast, the slope of the modulus over a force is -(dg / dF_i) / (dg / dE), and likewise for springs.

The gaps must be known, as they are for a level pair on its block. On a fruit they are unknown, so a whole press is read
(`contrast_rise.py`).
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

_MOST_STEPS = 100  # steps to a root: Newton needs about six; bisection in every step needs one per binary digit
_LEVEL = 1e-9  # largest contrast of a tilt, over the largest coordinate


OF_ANOTHER_SENSOR = (
    "the forces belong to no modulus: must be forces of this sensor, pressed on a fruit; calibrate it again"
)


class ReadingError(ValueError):
    """Forces that give no modulus; the message says why."""


@dataclass(frozen=True, kw_only=True)
class ContrastLaw:
    """The constants of the contrast of a sensor.

    `weights` [1] belong to the tips, and `gaps` [mm] are under them before the press. `C` [mm/N] and `S`, times E
    [1/mm], have a row and a column for each tip. `hertz`, times E^(2/3) [mm (MPa/N)^(2/3)], comes from
    `hertz.hertz_factor`.
    """

    weights: tuple[float, ...]
    gaps: tuple[float, ...]
    C: Matrix
    S: Matrix
    hertz: float = 0.0

    def __post_init__(self) -> None:
        """Refuse arrays whose shapes do not match the number of tips."""
        count = len(self.weights)
        shapes = (np.shape(self.gaps), np.shape(self.C), np.shape(self.S))
        if shapes != ((count,), (count, count), (count, count)):
            msg = f"contrast law of {count} tips: tables of {shapes}; must have a row and a column for each tip"
            raise ValueError(msg)

    @cached_property
    def arrays(self) -> tuple[Floats, Floats, Floats]:
        """Return weights, C and S as arrays, cached for the many readings of one sensor."""
        return np.array(self.weights), np.array(self.C), np.array(self.S)


def contrast_weights(positions: Sequence[Place], springs: Sequence[str]) -> tuple[float, ...]:
    """Return the weight of each tip [1] in the contrast: the mean over the high tips less the mean over the low ones.

    `positions` are x and y [mm], `springs` low or high. Raises InputError if a tilt would change the contrast.
    """
    weights = [1.0 / springs.count("high") if spring == "high" else -1.0 / springs.count("low") for spring in springs]
    let_through = np.abs(np.array(weights) @ np.array(positions))
    if let_through.max() > _LEVEL * np.abs(positions).max():
        bound = "a line or a square: low and high tips about one middle"
        hint = "one reading of a pair cannot separate tilt from stiffness"
        raise validation_error("tips.layout", "pair", "", bound, hint)
    return tuple(weights)


def pair_law(C: Matrix, own_less_other: float) -> ContrastLaw:
    """Return the contrast of a pair, its low tip first, on springs C [mm/N]; unlike other contrasts, a tilt changes it.

    For flat tips it depends on S only by s11 - s12, times E [1/mm], which is `own_less_other`.
    """
    S = ((own_less_other, 0.0), (0.0, own_less_other))
    return ContrastLaw(weights=(-1.0, 1.0), gaps=(0.0, 0.0), C=C, S=S)


def ratio_modulus(C: Matrix, own_less_other: float, forces: Sequence[float]) -> float:
    """Return the modulus [MPa] at which a level pair has these forces [N] on its low and its high tip.

    This is (4) of the paper for coupled springs; C [mm/N] and s11 - s12 [1/mm] are as in `pair_law`. Raises
    ReadingError if no positive modulus has these forces.
    """
    low, high = forces
    difference = (C[0][0] - C[1][0]) * low + (C[0][1] - C[1][1]) * high
    if not (difference > 0.0 and high > low):
        raise ReadingError(OF_ANOTHER_SENSOR)
    return own_less_other * (high - low) / difference


def read_modulus(law: ContrastLaw, forces: Sequence[float], offset: float = 0.0) -> float:
    """Return the modulus of the fruit [MPa] from the forces of all tips [N]; raises ReadingError.

    `offset` [mm] is a contrast of gaps in addition to the gaps of the law.
    """
    rigid, dome, body = contrast_terms(law, forces)
    z = smallest_root(rigid + offset, dome, body)  # E^(-1/3)
    return 1.0 / (z * z * z)


class ContrastTerms(NamedTuple):
    """The coefficients of the contrast rigid + dome E^(-2/3) + body E^(-1), which is zero at the modulus of the fruit.

    `rigid` [mm] comes from the springs and the gaps, `dome` [mm MPa^(2/3)] from Hertz's contact, and `body` [mm MPa]
    from the flesh.
    """

    rigid: float
    dome: float
    body: float


def contrast_terms(law: ContrastLaw, forces: Sequence[float]) -> ContrastTerms:
    """Return the terms of the contrast at the forces of all tips [N]; raises ReadingError unless all are above 0."""
    if len(forces) != len(law.weights):
        msg = f"{len(forces)} forces must be {len(law.weights)}, one for each tip. Check the sensor's channels."
        raise ReadingError(msg)
    for tip, force in enumerate(forces, start=1):
        if not 0.0 < force < math.inf:
            msg = f"force of tip {tip} = {force:g} N must be above 0. The tip does not touch: press more level."
            raise ReadingError(msg)
    weights, C, S = law.arrays
    F = np.array(forces)
    rigid = weights @ (C @ F + law.gaps)
    dome = law.hertz * weights @ (F ** (2.0 / 3.0))
    body = weights @ (S @ F)
    return ContrastTerms(rigid=float(rigid), dome=float(dome), body=float(body))


@dataclass(frozen=True, kw_only=True)
class ReadingSlopes:
    """Relative change of E per unit of each input, for a reading at one moment.

    `forces` [1/N] and `springs` [1], per relative change of stiffness, have an entry per tip. `contrast` [1/mm] is the
    slope over a contrast of gaps that the law does not contain.
    """

    forces: tuple[float, ...]
    springs: tuple[float, ...]
    contrast: float


def stiffened_compliance(C: Matrix, factors: Sequence[float]) -> tuple[tuple[float, ...], ...]:
    """Return the compliance C [mm/N] after each spring was stiffened by its factor [1].

    An entry of C is divided by the root of the factors of its row and its column.
    """
    scales = 1.0 / np.sqrt(factors)
    return rows_of(np.array(C) * np.outer(scales, scales))


def contrast_slopes(law: ContrastLaw, forces: Sequence[float], E: float) -> ReadingSlopes:
    """Return the slopes of the reading E [MPa] over its inputs, at forces [N], each above 0.

    With g(F, E) the contrast [mm], ln E moves by dg / (-E dg/dE), and the part of dg by a force is

        dg/dF_i = (w C)_i + 2/3 h w_i E^(-2/3) F_i^(-1/3) + (w S)_i / E .
    """
    _, dome, body = contrast_terms(law, forces)
    E_power = E ** (-2.0 / 3.0)
    per_log_E = dome * E_power / 1.5 + body / E  # -E dg/dE [mm]
    weights = np.array(law.weights)
    C = np.array(law.C)
    F = np.array(forces)
    of_springs = weights @ C
    of_fruit = weights @ np.array(law.S) / E
    of_domes = law.hertz * E_power / 1.5 * weights * F ** (-1.0 / 3.0)
    by_force = (of_springs + of_fruit + of_domes) / per_log_E
    # A spring that is 1 % stiffer reduces its row and its column of C by 0.5 % each.
    by_spring = -0.5 * (weights * (C @ F) + of_springs * F) / per_log_E
    return ReadingSlopes(
        forces=tuple(by_force.tolist()),
        springs=tuple(by_spring.tolist()),
        contrast=1.0 / per_log_E,
    )


def lowered_tips(law: ContrastLaw, forces: Sequence[float], E: float) -> tuple[float, ...]:
    """Return the travel of each tip [mm] at which a fruit of modulus E [MPa] resists with the forces [N]."""
    F = np.array(forces)
    flattened = law.hertz * (F / E) ** (2.0 / 3.0)
    lowered = (np.array(law.C) + np.array(law.S) / E) @ F + flattened + law.gaps
    return tuple(lowered.tolist())


def plane_through(positions: Sequence[Place], heights: Sequence[float]) -> tuple[float, float, float | None]:
    """Return the travel [mm] and the slopes along and across [1] of the plane that fits the heights [mm] best.

    The positions [mm] must be mirror images about their middle. The slope across is None if all lie in one line.
    """
    arms = np.array(positions) - np.mean(positions, axis=0)
    along, across = (arms**2).sum(axis=0)
    moment_along, moment_across = np.array(heights) @ arms
    slope_along = float(moment_along / along) if along > 0.0 else 0.0
    slope_across = float(moment_across / across) if across > 0.0 else None
    return float(np.mean(heights)), slope_along, slope_across


def smallest_root(rigid: float, dome: float, body: float) -> float:
    """Return the smallest z > 0 of rigid + dome z^2 + body z^3 = 0, which is E^(-1/3) [MPa^(-1/3)].

    The cubic is level at z = 0 and at z = -2 dome / (3 body), and monotonic between them. If the second level point is
    above 0, the root must lie before it; else the cubic is monotonic for all z > 0. Raises ReadingError if the cubic
    does not change its sign there.
    """
    second_level = -2.0 * dome / (3.0 * body) if body != 0.0 else 0.0
    end = second_level if second_level > 0.0 else _beyond_root(rigid, dome, body)
    if not rigid * (rigid + end * end * (dome + body * end)) < 0.0:
        raise ReadingError(OF_ANOTHER_SENSOR)
    # Newton's method; a step that leaves the bracket of the root is replaced by a bisection.
    start = 0.0
    z = 0.5 * end
    for _ in range(_MOST_STEPS):
        contrast = rigid + z * z * (dome + body * z)
        if rigid * contrast > 0.0:
            start = z
        else:
            end = z
        slope = z * (2.0 * dome + 3.0 * body * z)
        following = z - contrast / slope if slope != 0.0 else start
        if following == z:
            break
        if not start < following < end:
            following = 0.5 * (start + end)
            if following in (start, end):
                break
        z = following
    return z


def _beyond_root(rigid: float, dome: float, body: float) -> float:
    """Return a point beyond the root of a cubic that is monotonic for z > 0 [MPa^(-1/3)].

    Both terms have the same sign, so the root lies before the root with either term only.
    """
    by_dome = math.sqrt(abs(rigid / dome)) if dome != 0.0 else math.inf
    by_body = abs(rigid / body) ** (1.0 / 3.0) if body != 0.0 else math.inf
    nearer = min(by_dome, by_body)
    return 2.0 * nearer if math.isfinite(nearer) else 1.0
