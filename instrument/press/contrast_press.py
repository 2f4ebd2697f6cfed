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
from sensor.arrays import Floats
from sensor.quantity import COVERAGE
from sensor.theory.contrast_law import ReadingError, fit_plane, tip_travels
from sensor.theory.contrast_rise import LARGEST_BY_TIME, RiseError, RiseLaw, RiseReading, RiseSlopes, moduli_without

SIMULTANEOUS = Timing()


def press_reading(sensor: MeasuringUnit, press: PressSamples, timing: Timing = SIMULTANEOUS) -> FruitReading:
    """Return the reading of a press by the printed unit `sensor`.

    If the modulus cannot be determined, the reading has a flag that states why. `timing` is the accuracy of the
    sampling times. The field `others` of the reading contains a second modulus: the modulus from the force ratio of a
    pair, or the apparent modulus in the hold of flesh that relaxes. The half width of E is increased if a single sample
    changes E by more than this half width, or if the pace of the press was uneven.
    """
    # A press on flesh that relaxes has further channels after the forces of the tips: the forces of elastic flesh.
    flesh_relaxes = press.channels.shape[1] > press.tips
    law = sensor.rise_law.relaxing_law if flesh_relaxes else sensor.rise_law
    spike_flags = ["spike"] if press.lines_left_out else []

    def reading_without_modulus(flag: str) -> FruitReading:
        return FruitReading(flags=(flag, *spike_flags), lines_left_out=press.lines_left_out)

    try:
        seated = seated_reading(sensor, law, press, timing.lag)
    except RiseError as error:
        return reading_without_modulus(error.flag)
    if flesh_relaxes:
        second_reading = _held_reading(sensor, press, seated.reading)
    else:
        second_reading = _ratio_reading(sensor, press, seated)
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
    """Return the reading of a press that determines a modulus: the corrected modulus, its half width and its flags.

    `seated` holds the modulus that `law` reads from the part of the press in which the tips are seated. `timing` is the
    accuracy of the sampling times. `second_reading` is the result of another method for the same press.
    """
    uncorrected = seated.reading
    press_s = press.duration_s
    E = sensor.correct_modulus(uncorrected.E, press_s)
    unit_errors = sensor.channels_in(timing.deviation, press_s).press_uncertainty([uncorrected.slopes])
    parts = _half_width_parts(sensor, E, uncorrected, unit_errors)
    tilt, direction = _tilt_and_direction(sensor, law, seated)
    flags = flags_of_modulus(sensor, E, parts.total, _true_deepest_forces(sensor, press, seated), tilt)
    doubts = _Doubts(
        sample_shift=_largest_sample_shift(sensor, law, seated, timing.lag, press_s),
        shift_by_pace=pace_shift(sensor, press),
    )
    flags += doubts.flags(parts.total)
    if second_reading.disagrees:
        flags.append("read_outs_disagree")
    if unit_errors["times"] > LARGEST_BY_TIME:
        flags.append("too_fast")
    return replace(
        _unflagged_reading(sensor, E, uncorrected, parts),
        u=doubts.widened(parts.total),
        tilt=tilt,
        direction=direction,
        flags=tuple(flags),
        lines_left_out=press.lines_left_out,
        others=second_reading.others,
        relaxation=second_reading.relaxation,
        press_s=press_s,
        time_s=timing.deviation,
    )


def _unflagged_reading(sensor: MeasuringUnit, E: float, uncorrected: RiseReading, parts: HalfWidth) -> FruitReading:
    """Return a reading without flags and half width: the corrected modulus E [MPa], and what follows from it.

    `uncorrected` is the reading before its correction. `parts` are the parts of the half width of E.
    """
    noise = COVERAGE * sensor.steepness(E) * uncorrected.noise  # part of the half width due to noise [1]
    offset, offset_u = _offset_of_high_tips(sensor, uncorrected, parts.total, noise)
    return FruitReading(
        E=E,
        reduced=sensor.reduced(E),
        ripeness=sensor.ripeness_of(E),
        samples=uncorrected.samples,
        noise=noise,
        bend=parts.bend,
        offset=offset,
        offset_u=offset_u,
        firmness=sensor.firmness_of(E),
        parts=parts,
    )


def _true_deepest_forces(sensor: MeasuringUnit, press: PressSamples, seated: Seated) -> Floats:
    """Return the true forces (tips,) [N] in the deepest sample of a press.

    Springs are stiffer in a press than under calibration weights, so the true forces are larger than the measured ones.
    """
    return sensor.press_stiffness_ratio(press.duration_s) * seated.deepest_channels[: press.tips]


def _half_width_parts(
    sensor: MeasuringUnit, E: float, uncorrected: RiseReading, unit_errors: Mapping[str, float]
) -> HalfWidth:
    """Return the parts of the half width of the corrected modulus E [MPa].

    `uncorrected` is the reading before its correction, with its noise and slopes. `unit_errors` maps each cause of
    errors in channels and springs to a relative standard deviation of the reading [1].
    """
    slopes = uncorrected.slopes
    bend = sensor.bend_error(slopes.channel_bends, slopes.spring_bends)
    deviations = Deviations.with_unit([uncorrected.noise], unit_errors, _shape_deviations(sensor, slopes))
    return half_width(sensor, E, deviations, bend)


@dataclass(frozen=True, kw_only=True)
class _Doubts:
    """Relative changes of E [1] that cast doubt on a press, if they are large.

    `sample_shift` is the largest change when one sample is left out. If it exceeds the half width of E, that sample may
    be bad. `shift_by_pace` is the change due to an uneven pace of the press, and is ignored up to `LARGEST_BY_PACE`.
    """

    sample_shift: float
    shift_by_pace: float

    def widened(self, u: float) -> float:
        """Return the half width `u` of E [1], increased by the changes that are not ignored."""
        widened_u = u + self.sample_shift if self.sample_shift > u else u
        return widened_u + self.shift_by_pace if self.shift_by_pace > LARGEST_BY_PACE else widened_u

    def flags(self, u: float) -> list[str]:
        """Return the flags of the changes that are not ignored, for the half width `u` of E [1].

        The flag `uncertain` is included only if these changes increase `u` beyond `UNCERTAIN`. If `u` itself exceeds
        this limit, the reading has the flag already.
        """
        causes = {
            "uncertain": u <= UNCERTAIN < self.widened(u),
            "one_sample": self.sample_shift > u,
            "uneven_pace": self.shift_by_pace > LARGEST_BY_PACE,
        }
        return [flag for flag, applies in causes.items() if applies]


def _offset_of_high_tips(
    sensor: MeasuringUnit, uncorrected: RiseReading, u: float, noise: float
) -> tuple[float, float] | tuple[None, None]:
    """Return the distance by which the high tips are nearer to the skin than the low tips [mm], and its half width.

    `u` [1] is the half width of E, and `noise` [1] is the part of it that is due to noise. Noise changes the offset
    directly. All other errors change it through the error of E. Both results are None for a pair, whose offset is
    reported as a tilt.
    """
    if sensor.report.read_out.is_pair:
        return None, None
    # Round-off may make the noise of E slightly larger than its half width, hence the lower bound of 0.
    other_errors = math.sqrt(max(u**2 - noise**2, 0.0))
    half_width_mm = math.hypot(COVERAGE * uncorrected.offset_noise, uncorrected.offset_per_log_E * other_errors)
    # The offset in the law is the gap under the high tips minus the gap under the low tips. A tip nearer to the skin
    # has a smaller gap, so the sign changes.
    return -uncorrected.offset, half_width_mm


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

    For other tips, the result contains no modulus. A tilt of the sensor changes this modulus, but not the modulus from
    the rise of the contrast. The two moduli disagree if they differ by more than noise and the error of the contact
    model can explain. They also disagree if no modulus yields the force ratio.
    """
    if not sensor.reads_moments:
        return _SecondReading()
    uncorrected = seated.reading
    try:
        ratio_modulus, ratio_noise = ratio_modulus_and_noise(sensor, seated.deepest_channels)
    except ReadingError:
        return _SecondReading(disagrees=True)
    allowed_difference = COVERAGE * math.hypot(ratio_noise, uncorrected.noise) + sensor.model_error
    return _SecondReading(
        others={"force_ratio": sensor.correct_modulus(ratio_modulus, press.duration_s)},
        disagrees=abs(ratio_modulus / uncorrected.E - 1.0) > allowed_difference,
    )


def _held_reading(sensor: MeasuringUnit, press: PressSamples, uncorrected: RiseReading) -> _SecondReading | None:
    """Return the apparent modulus and the relaxation in the hold of a press on flesh that relaxes.

    The offset of the press is taken from its `uncorrected` reading, because it does not change in the hold. The result
    is None if the hold ended before the reading time of the design. The result has no modulus if the forces in the hold
    do not determine one.
    """
    press_s = press.duration_s
    law_at_offset = sensor.rise_law.with_offset(uncorrected.offset)

    def stiffness_ratio(held_s: float) -> float:
        """Return the stiffness of the springs after a hold of `held_s` [s], relative to calibration weights [1]."""
        return sensor.press_stiffness_ratio(press_s) * sensor.softening_in_hold(held_s, press_s)

    try:
        held = held_moduli(sensor.report.design, press, law_at_offset, uncorrected.offset, stiffness_ratio)
    except ReadingError:
        return _SecondReading()
    if held is None:
        return None
    return _SecondReading(others={"apparent": sensor.ball_factor * held.apparent}, relaxation=held.relaxation)


def _largest_sample_shift(
    sensor: MeasuringUnit, law: RiseLaw, seated: Seated, lag: int, press_s: float | None
) -> float:
    """Return the largest relative change of E [1] if a single bad conversion is left out of a press.

    A bad conversion affects `lag` consecutive samples, so each such run of samples is left out in turn. `press_s` [s]
    is the duration of the press. A change is counted as 1 if the other samples do not determine a modulus. The result
    is 0 for a long press, in which one sample hardly changes E.
    """
    E = sensor.correct_modulus(seated.reading.E, press_s)
    shifts = [0.0]
    for uncorrected_modulus in moduli_without(law, seated.rise, lag):  # yields nothing for a long press
        modulus = sensor.correct_modulus(uncorrected_modulus, press_s)
        shifts.append(1.0 if math.isnan(modulus) else abs(modulus / E - 1.0))
    return max(shifts)


def _tilt_and_direction(sensor: MeasuringUnit, law: RiseLaw, seated: Seated) -> tuple[float, float | None]:
    """Return the tilt of the sensor on the skin in the deepest sample, and its direction [deg].

    The tilt is the slope of the plane through the depths of the tips. The direction points to the lower side of the
    sensor, and is measured from +x towards +y. A layout such as tips in a line determines no direction, which is then
    None.
    """
    tips = sensor.report.design.tips
    uncorrected = seated.reading
    if sensor.report.read_out.is_pair:
        return _tilt_of_pair(uncorrected.offset, tips.spacing_mm)
    law_at_offset = law.with_offset(uncorrected.offset)
    channel_depths = tip_travels(law_at_offset, seated.deepest_channels.tolist(), uncorrected.E)
    # The law of flesh that relaxes has two channels per tip, and its second half holds the depths of the tips.
    depths = channel_depths[-len(tips.places_mm) :]
    _, slope_x, slope_y = fit_plane(tips.places_mm, depths)
    # A dome of radius r rolls on a fruit of radius R. A tilt that lowers a fixed point of the sensor by 1 mm therefore
    # lowers the contact of the dome by only R / (r + R) mm.
    rolling = 1.0 if sensor.domes is None else sensor.domes.rolling_factor
    tilt = math.degrees(math.atan(rolling * math.hypot(slope_x, slope_y or 0.0)))
    return tilt, None if slope_y is None else math.degrees(math.atan2(slope_y, slope_x))


def _tilt_of_pair(offset: float, spacing: float) -> tuple[float, float]:
    """Return the tilt of a pair of tips along its line, and the direction of its lower side from +x [deg].

    `offset` [mm] is the travel of the low tip minus the travel of the high tip, and `spacing` [mm] is their distance.
    The high tip lies at +x, so it is on the lower side if it travels further.
    """
    return abs(math.degrees(math.atan(offset / spacing))), 0.0 if offset <= 0.0 else 180.0


def _shape_deviations(sensor: MeasuringUnit, slopes: RiseSlopes) -> list[float]:
    """Return the relative standard deviations of E [1] due to errors of the fruit's curvature and of the tips' heights.

    The first deviation is due to the mean curvature of the fruit. It is followed by one deviation for each tip, due to
    the error of the tip's height. The reading takes a height error for a saddle of the skin. Each deviation has the
    sign of the change that a positive error causes. `slopes` are the slopes of ln E against each cause of error.
    """
    weights = np.array(sensor.rise_law.contrast.weights)  # change of the offset per change of each gap [1]
    domes = sensor.domes
    curvature_error = 0.0
    if domes is not None:
        curvature_error = slopes.mean_curvature(domes.relative_radius) * sensor.curvature_deviation
    return [curvature_error, *(slopes.offset * weights * sensor.height_deviation).tolist()]
