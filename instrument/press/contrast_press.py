"""Read the modulus from one press by the rise of the contrast, a weighted sum over the tips.

Travel and tilt cancel in this sum. Samples after the deepest one are not used, because the flesh may have yielded.
Errors that are constant during a press cancel too, so that they do not change the modulus. They are due to a
saddle-shaped skin, the heights and positions of the tips, and the pose of the sensor.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from instrument.press.fruit_reading import UNCERTAIN, FruitReading, flags_of_modulus
from instrument.press.half_width import Deviations, HalfWidth, half_width
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

SIMULTANEOUS = Timing()


def press_reading(sensor: MeasuringUnit, press: PressSamples, timing: Timing = SIMULTANEOUS) -> FruitReading:
    """Return the reading of a press by the printed unit `sensor`.

    If the modulus cannot be determined, the reading has a flag that states why. `timing` is the accuracy of the
    sampling times. The field `others` of the reading contains a second modulus: the modulus from the force ratio of a
    pair, or the apparent modulus in the hold of flesh that relaxes. The half width of E is increased if a single sample
    changes E by more than this half width, or if the pace of the press was uneven.
    """
    relaxes = press.channels.shape[1] > press.tips  # then the forces of elastic flesh are further channels
    law = sensor.rise_law.relaxing_law if relaxes else sensor.rise_law
    spike_flags = ["spike"] if press.lines_left_out else []

    def reading_without_modulus(flag: str) -> FruitReading:
        return FruitReading(flags=(flag, *spike_flags), lines_left_out=press.lines_left_out)

    try:
        seated = seated_reading(sensor, law, press, timing.lag)
    except RiseError as error:
        return reading_without_modulus(error.flag)
    second_reading = _held_reading(sensor, press, seated.found) if relaxes else _ratio_reading(sensor, press, seated)
    if second_reading is None:  # the hold ended before the reading time of the design
        return reading_without_modulus("released_early")
    reading = _evaluate_reading(sensor, law, press, timing, seated, second_reading)
    return replace(reading, flags=(*reading.flags, *spike_flags))


def _evaluate_reading(
    sensor: MeasuringUnit,
    law: RiseLaw,
    press: PressSamples,
    timing: Timing,
    seated: Seated,
    second_reading: "_SecondReading",
) -> FruitReading:
    """Return the reading of a press whose modulus was found: correct the modulus, and determine its error and flags.

    `seated` holds the modulus that `law` reads from the part of the press in which the tips are seated. `timing` is the
    accuracy of the sampling times. `second_reading` is the result of another method for the same press.
    """
    found = seated.found
    press_s = press.duration_s
    E = sensor.correct_modulus(found.E, press_s)
    unit_errors = sensor.channels_in(timing.deviation, press_s).press_uncertainty([found.slopes])
    parts = _half_width_parts(sensor, E, found, unit_errors)
    u = parts.total  # half width of E [1]
    tilt, direction = _tilt_and_direction(sensor, law, seated)
    # Springs are stiffer in a press than under calibration weights, so the true forces are larger by this factor.
    deepest_forces = sensor.press_stiffness_ratio(press_s) * seated.deepest[: press.tips]
    flags = flags_of_modulus(sensor, E, u, deepest_forces, tilt)
    sample_shift = _largest_sample_shift(sensor, law, seated, timing.lag, press_s)
    shift_by_pace = pace_shift(sensor, press)
    widened_u = _widened_half_width(u, sample_shift, shift_by_pace)
    causes = {
        "uncertain": u <= UNCERTAIN < widened_u,  # if u is larger, `flags` already contains this flag
        "one_sample": sample_shift > u,
        "uneven_pace": shift_by_pace > LARGEST_BY_PACE,
        "read_outs_disagree": second_reading.disagrees,
        "too_fast": unit_errors["times"] > LARGEST_BY_TIME,
    }
    noise = COVERAGE * sensor.steepness(E) * found.noise  # part of the half width due to noise
    offset, offset_u = (None, None) if sensor.report.read_out.is_pair else _offset_of_high_tips(found, u, noise)
    return FruitReading(
        E=E,
        reduced=sensor.reduced(E),
        u=widened_u,
        tilt=tilt,
        direction=direction,
        flags=(*flags, *(flag for flag, applies in causes.items() if applies)),
        ripeness=None if sensor.classes is None else sensor.classes.class_of(E),
        samples=found.samples,
        noise=noise,
        bend=parts.bend,
        offset=offset,
        offset_u=offset_u,
        lines_left_out=press.lines_left_out,
        others=second_reading.others,
        relaxation=second_reading.relaxation,
        firmness=None if sensor.unit.scale is None else sensor.unit.scale.firmness_of(E),
        press_s=press_s,
        time_s=timing.deviation,
        parts=parts,
    )


def _half_width_parts(
    sensor: MeasuringUnit, E: float, found: RiseReading, unit_errors: Mapping[str, float]
) -> HalfWidth:
    """Return the parts of the half width of the corrected modulus E [MPa].

    `found` is the uncorrected reading with its noise and slopes. `unit_errors` maps each cause of errors in channels
    and springs to a relative standard deviation of the reading [1].
    """
    bend = sensor.bend_error(found.slopes.channel_bends, found.slopes.spring_bends)
    deviations = Deviations.with_unit([found.noise], unit_errors, _shape_deviations(sensor, found.slopes))
    return half_width(sensor, E, deviations, bend)


def _widened_half_width(u: float, sample_shift: float, shift_by_pace: float) -> float:
    """Return the half width `u` of E [1], increased by doubts about a single sample and about the pace of the press.

    `sample_shift` [1] is the change of E without one sample. If it is larger than u, the sample may be bad.
    `shift_by_pace` [1] is the change of E due to an uneven pace. Small changes are ignored.
    """
    widened_u = u + sample_shift if sample_shift > u else u
    return widened_u + shift_by_pace if shift_by_pace > LARGEST_BY_PACE else widened_u


def _offset_of_high_tips(found: RiseReading, u: float, noise: float) -> tuple[float, float]:
    """Return how much nearer to the skin the high tips are than the low tips [mm], and the half width of this offset.

    `u` is the half width of E [1], and `noise` its part due to noise [1]. Noise changes the offset directly. All other
    errors change it through the error of E. This function is not used for a pair, whose offset is reported as a tilt.
    """
    other_errors = math.sqrt(max(u**2 - noise**2, 0.0))
    half_width_mm = math.hypot(COVERAGE * found.offset_noise, found.offset_per_log_E * other_errors)
    # The offset that was found is the gap under the high tips minus the gap under the low tips, so its sign changes.
    return -found.offset, half_width_mm


@dataclass(frozen=True, kw_only=True)
class _SecondReading:
    """Further results of the same press: the moduli from other methods [MPa], and the relaxation ratio [1].

    `others` maps the name of a method to its modulus. `disagrees` is True if another method contradicts the modulus
    that was read from the rise of the contrast.
    """

    others: dict[str, float] = field(default_factory=dict)
    relaxation: float | None = None
    disagrees: bool = False


def _ratio_reading(sensor: MeasuringUnit, press: PressSamples, seated: Seated) -> _SecondReading:
    """Return the modulus from the force ratio in the deepest sample of a pair of flat tips.

    For other tips, the result contains no modulus. This modulus and the modulus from the rise of the contrast differ if
    the sensor is tilted. They disagree if they differ by more than noise and the error of the contact model can
    explain, or if no modulus yields the force ratio.
    """
    if not sensor.reads_moments:
        return _SecondReading()
    found = seated.found
    try:
        modulus, noise = ratio_modulus_and_noise(sensor, seated.deepest)
    except ReadingError:
        return _SecondReading(disagrees=True)
    allowed = COVERAGE * math.hypot(noise, found.noise) + sensor.model_error
    return _SecondReading(
        others={"force_ratio": sensor.correct_modulus(modulus, press.duration_s)},
        disagrees=abs(modulus / found.E - 1.0) > allowed,
    )


def _held_reading(sensor: MeasuringUnit, press: PressSamples, found: RiseReading) -> _SecondReading | None:
    """Return the apparent modulus and the relaxation in the hold of a press on flesh that relaxes.

    The result is None if the hold ended before the reading time of the design. It is empty if the forces in the
    hold do not determine a modulus.
    """
    press_s = press.duration_s

    def stiffening(held_s: float) -> float:  # stiffness after a hold of held_s [s], relative to calibration weights
        return sensor.press_stiffness_ratio(press_s) * sensor.softening_in_hold(held_s, press_s)

    try:
        held = held_moduli(
            sensor.report.design, press, sensor.rise_law.with_offset(found.offset), found.offset, stiffening
        )
    except ReadingError:
        return _SecondReading()
    if held is None:
        return None
    return _SecondReading(others={"apparent": sensor.ball_factor * held.apparent}, relaxation=held.relaxation)


def _largest_sample_shift(
    sensor: MeasuringUnit, law: RiseLaw, seated: Seated, lag: int, press_s: float | None
) -> float:
    """Return the largest relative change of E [1] when one sample is left out; 1 if no modulus remains.

    `lag` consecutive samples are left out together, because one bad conversion affects all of them. `press_s` [s] is
    the duration of the press.
    """
    E = sensor.correct_modulus(seated.found.E, press_s)
    moduli = [sensor.correct_modulus(modulus, press_s) for modulus in moduli_without(law, seated.rise, lag)]
    return max((1.0 if math.isnan(modulus) else abs(modulus / E - 1.0) for modulus in moduli), default=0.0)


def _tilt_and_direction(sensor: MeasuringUnit, law: RiseLaw, seated: Seated) -> tuple[float, float | None]:
    """Return the tilt of the sensor on the skin in the deepest sample, and its direction [deg].

    The tilt is the slope of the plane through the depths of the tips. The direction points to the lower side of the
    sensor, and is measured from +x towards +y. It is None if the layout does not determine it, as for tips in a line.
    """
    tips = sensor.report.design.tips
    found = seated.found
    if sensor.report.read_out.is_pair:  # then the offset is the travel of the low tip minus the travel of the high tip
        pair_tilt = abs(math.degrees(math.atan(found.offset / tips.spacing_mm)))
        pair_direction = 0.0 if found.offset <= 0.0 else 180.0
        return pair_tilt, pair_direction
    # The law of flesh that relaxes has two channels per tip; the depths follow from the second half of the channels.
    depths = lowered_tips(law.with_offset(found.offset), seated.deepest.tolist(), found.E)[-len(tips.places_mm) :]
    _, along, across = plane_through(tips.places_mm, depths)
    # A dome of radius r rolls on a fruit of radius R. A tilt that lowers a fixed point of the sensor by 1 mm therefore
    # lowers the contact of the dome by only R / (r + R) mm.
    rolling = 1.0 if sensor.domes is None else sensor.domes.rolling_factor
    tilt = math.degrees(math.atan(rolling * math.hypot(along, across or 0.0)))
    return tilt, None if across is None else math.degrees(math.atan2(across, along))


def _shape_deviations(sensor: MeasuringUnit, slopes: RiseSlopes) -> list[float]:
    """Return the relative standard deviations of E [1] due to errors of the fruit's mean curvature and of the heights.

    The first deviation is due to the curvature. It is followed by one deviation for each tip, due to the error of the
    tip's height. Height errors act like a saddle-shaped skin, which moves the points of contact.
    """
    weights = np.array(sensor.rise_law.contrast.weights)
    domes = sensor.domes
    curvature_error = 0.0
    if domes is not None:
        curvature_error = slopes.mean_curvature(domes.relative_radius) * sensor.curvature_deviation
    return [curvature_error, *(slopes.offset * weights * sensor.height_deviation).tolist()]
