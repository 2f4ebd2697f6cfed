"""Readings of presses by the rise of the contrast of the tips.

Samples after the deepest one are not used, because flesh may have yielded by then. Errors that are constant in a press
cancel in the modulus: the saddle of the skin, the heights and places of the tips, and the pose of the sensor.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from instrument.press.fruit_reading import UNCERTAIN, FruitReading, flags_of_modulus
from instrument.press.half_width import Deviations, half_width
from instrument.press.hold import held_moduli
from instrument.press.measuring import MeasuringUnit
from instrument.press.one_time import Timing
from instrument.press.pace import LARGEST_BY_PACE, pace_shift
from instrument.press.pair_press import ratio_modulus_and_noise
from instrument.press.seating import Seated, seated_reading
from instrument.press.touches import PressSamples
from sensor.quantity import COVERAGE
from sensor.theory.contrast_law import ReadingError, lowered_tips, plane_through
from sensor.theory.contrast_rise import LARGEST_BY_TIME, RiseError, RiseLaw, RiseReading, RiseSlopes, moduli_without

AT_ONCE = Timing()


def press_reading(sensor: MeasuringUnit, press: PressSamples, timing: Timing = AT_ONCE) -> FruitReading:
    """Return the reading of a press; without a modulus, its flag states the cause.

    `others` also holds the modulus by the force ratio of a pair, or the apparent modulus in the hold of flesh that
    relaxes.
    """
    relaxes = press.channels.shape[1] > press.tips
    law = sensor.rise_law.over_time if relaxes else sensor.rise_law
    spikes = ["spike"] if press.lines_left_out else []

    def without_modulus(flag: str) -> FruitReading:
        return FruitReading(flags=(flag, *spikes), lines_left_out=press.lines_left_out)

    try:
        seated = seated_reading(sensor, law, press, timing.lag)
    except RiseError as error:
        return without_modulus(error.flag)
    beside = _in_hold(sensor, press, seated.found) if relaxes else _by_force_ratio(sensor, press, seated)
    if beside is None:
        return without_modulus("released_early")
    found = seated.found
    press_s = press.duration_s
    E = sensor.corrected(found.E, press_s)
    by_unit = sensor.channels_in(timing.deviation, press_s).of_press([found.slopes])
    bend = sensor.by_bends(found.slopes.channel_bends, found.slopes.spring_bends)
    deviations = Deviations.with_unit([found.noise], by_unit, _by_shape(sensor, found.slopes))
    parts = half_width(sensor, E, deviations, bend)
    u = parts.of_one_press
    tilt, direction = _pose(sensor, law, seated)
    forces = sensor.press_over_weighed(press_s) * seated.deepest[: press.tips]
    flags = flags_of_modulus(sensor, E, u, forces, tilt)
    # If leaving out one sample changes the reading by more than its half width, that sample may be bad.
    shift = _shift_by_one(sensor, law, seated, timing.lag, press_s)
    wider = u + shift if shift > u else u
    by_pace = pace_shift(sensor, press)
    uneven = by_pace > LARGEST_BY_PACE
    if uneven:
        wider += by_pace
    causes = {
        "uncertain": u <= UNCERTAIN < wider,
        "one_sample": shift > u,
        "uneven_pace": uneven,
        "read_outs_disagree": beside.disagrees,
        "too_fast": by_unit["times"] > LARGEST_BY_TIME,
    }
    noise = COVERAGE * sensor.steepness(E) * found.noise
    # The offset is a gap of the high tips above the low ones, so its sign is reversed for "nearer to the skin". The
    # offset of a pair is a tilt, and is not reported as an offset.
    left = math.sqrt(max(u**2 - noise**2, 0.0))
    offset_u = math.hypot(COVERAGE * found.offset_noise, found.offset_per_log_E * left)
    return FruitReading(
        E=E,
        reduced=sensor.reduced(E),
        u=wider,
        tilt=tilt,
        direction=direction,
        flags=(*flags, *(flag for flag, holds in causes.items() if holds), *spikes),
        ripeness=None if sensor.classes is None else sensor.classes.class_of(E),
        samples=found.samples,
        noise=noise,
        bend=parts.bend,
        offset=None if sensor.report.read_out.is_pair else -found.offset,
        offset_u=None if sensor.report.read_out.is_pair else offset_u,
        lines_left_out=press.lines_left_out,
        others=beside.others,
        relaxation=beside.relaxation,
        firmness=None if sensor.unit.scale is None else sensor.unit.scale.firmness_of(E),
        press_s=press_s,
        time_s=timing.deviation,
        parts=parts,
    )


@dataclass(frozen=True, kw_only=True)
class _Beside:
    """Other results of the same press: moduli by other methods [MPa], and the relaxation [1].

    `disagrees` is True if another modulus contradicts the modulus of the press.
    """

    others: dict[str, float] = field(default_factory=dict)
    relaxation: float | None = None
    disagrees: bool = False


def _by_force_ratio(sensor: MeasuringUnit, press: PressSamples, seated: Seated) -> _Beside:
    """Return the modulus by the force ratio of the deepest sample, for a pair of flat tips.

    The two moduli differ if the sensor is tilted. Noise and the error of the contact model are allowed.
    """
    if not sensor.reads_moments:
        return _Beside()
    found = seated.found
    try:
        by_ratio, noise = ratio_modulus_and_noise(sensor, seated.deepest)
    except ReadingError:
        return _Beside(disagrees=True)
    allowed = COVERAGE * math.hypot(noise, found.noise) + sensor.model_error
    return _Beside(
        others={"force_ratio": sensor.corrected(by_ratio, press.duration_s)},
        disagrees=abs(by_ratio / found.E - 1.0) > allowed,
    )


def _in_hold(sensor: MeasuringUnit, press: PressSamples, found: RiseReading) -> _Beside | None:
    """Return the apparent modulus and the relaxation in the hold; None if it ended before the reading moment."""
    press_s = press.duration_s

    def stiffened(held_s: float) -> float:
        return sensor.press_over_weighed(press_s) * sensor.softening_in_hold(held_s, press_s)

    try:
        held = held_moduli(
            sensor.report.design, press, sensor.rise_law.with_offset(found.offset), found.offset, stiffened
        )
    except ReadingError:
        return _Beside()
    if held is None:
        return None
    return _Beside(others={"apparent": sensor.ball_factor * held.apparent}, relaxation=held.relaxation)


def _shift_by_one(sensor: MeasuringUnit, law: RiseLaw, seated: Seated, lag: int, press_s: float | None) -> float:
    """Return the largest relative change of E [1] if one bad conversion is left out; 1 if no modulus remains.

    `lag` is the number of samples that one bad conversion affects.
    """
    E = sensor.corrected(seated.found.E, press_s)
    moduli = [sensor.corrected(found, press_s) for found in moduli_without(law, seated.rise, lag)]
    return max((1.0 if math.isnan(found) else abs(found / E - 1.0) for found in moduli), default=0.0)


def _pose(sensor: MeasuringUnit, law: RiseLaw, seated: Seated) -> tuple[float, float | None]:
    """Return the tilt of the deepest sample and its direction [deg].

    The direction is None if the layout does not show it.
    """
    tips = sensor.report.design.tips
    found, deepest = seated.found, seated.deepest
    if sensor.report.read_out.is_pair:  # the offset of a pair is the lead of the low tip
        return abs(math.degrees(math.atan(found.offset / tips.spacing_mm))), 0.0 if found.offset <= 0.0 else 180.0
    lowered = lowered_tips(law.with_offset(found.offset), deepest.tolist(), found.E)[-len(tips.places_mm) :]
    _, along, across = plane_through(tips.places_mm, lowered)
    # `across` is None for tips in a line. A dome rolls on a round fruit: the tilt that lowers a point by 1
    # lowers the contact of the dome by R / (r + R).
    rolling = 1.0 if sensor.domes is None else sensor.domes.rolling_factor
    tilt = math.degrees(math.atan(rolling * math.hypot(along, across or 0.0)))
    return tilt, None if across is None else math.degrees(math.atan2(across, along))


def _by_shape(sensor: MeasuringUnit, slopes: RiseSlopes) -> list[float]:
    """Return relative standard deviations of the modulus [1] from the shape of the fruit and from the tip heights.

    Height errors act like a saddle, which moves the points of contact.
    """
    weights = np.array(sensor.rise_law.contrast.weights)
    domes = sensor.domes
    by_curvature = 0.0
    if domes is not None:
        by_curvature = slopes.mean_curvature(domes.relative_radius) * sensor.curvature_deviation
    return [by_curvature, *(slopes.offset * weights * sensor.height_deviation).tolist()]
