"""Correction of a unit by presses on a reference ball, a rubber ball of known modulus.

The form errors of the domes change all readings of a unit by the same factor. The presses on the ball determine this
factor. The rubber is assumed to be elastic, without relaxation.
"""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from instrument.press.fruit_reading import FruitReading
from instrument.press.half_width import UNKNOWN_CORRELATION
from instrument.press.measuring import MeasuringUnit
from instrument.press.presses import readings_of
from instrument.press.reference_ball import FACTOR, MODULUS, RADIUS, BallCorrection
from instrument.press.signals import Signal
from pipeline.reading.form import form_error_changes
from pipeline.reading.measurement import RiseModel
from pipeline.tables import rows
from pipeline.tables.headers import NO_FLAGS, ColumnFlags
from sensor.arrays import Floats, rows_of
from sensor.design.bench import RUBBER_POISSON
from sensor.design.reading import PRESS_SAMPLES
from sensor.design.tips import REPRESENTED_BY_BALL
from sensor.quantity import COVERAGE, UNIFORM_DEVIATION, Bounds, InputError, validation_error
from sensor.theory.contrast_law import ReadingError
from sensor.theory.contrast_rise import RiseReading, read_rise, select_rise
from sensor.theory.student import student_quantile
from solve.contact.linear_response import travels
from solve.contact.relaxing import elastic_forces
from solve.linear import SolveError

FEWEST_PRESSES = 3
ERROR = Bounds(at_least=0.1, at_most=50.0)
"""Allowed half width at 95 % of the ball's modulus [%]; a smaller number is probably a fraction, not a percentage."""
SCATTER = Bounds(at_most=10.0)
"""Allowed half width at 95 % of the factor [%], due to the scatter of the presses."""
LEAST_RADIUS_RATIO = 3.0
"""Smallest ratio of the ball's radius to the tip spacing, by judgement.

The contact model neglects the finite size of the ball, which affects the forces more the smaller the ball is.
"""
ACCEPTED_FLAGS = {"press_over_bruise_limit", "out_of_range"}
"""Flags that do not exclude a press on a ball: rubber does not bruise, and a form error may shift E out of range."""


@dataclass(frozen=True, kw_only=True)
class ReferenceBall:
    """A reference ball: its modulus [MPa] with the relative standard deviation [%], its radius and Poisson's ratio."""

    E_MPa: float
    radius_mm: float
    percent: float
    poisson: float = RUBBER_POISSON

    @property
    def reduced_MPa(self) -> float:
        """Return E / (1 - nu^2) [MPa], the only modulus that affects a press."""
        return self.E_MPa / (1.0 - self.poisson**2)


def reference_ball(reduced_MPa: float | None, radius_mm: float | None, u_percent: float | None) -> ReferenceBall:
    """Build the reference ball that the flags of a command describe.

    `reduced_MPa` is E / (1 - nu^2) [MPa], so Poisson's ratio is not required. `radius_mm` is the radius [mm], and
    `u_percent` is the half width of the error bar of the modulus at 95 % [%]. A flag that was not given is None. Raises
    InputError for a flag that is missing or out of bounds.
    """
    modulus_hint = "pipeline modulus --json gives E_over_1_minus_nu2_MPa and u_percent"
    radius_hint = "measure the diameter of the ball, and give half of it"
    reduced = _checked_flag("--ball-reduced-modulus", reduced_MPa, "MPa", MODULUS, modulus_hint)
    radius = _checked_flag("--ball-radius", radius_mm, "mm", RADIUS, radius_hint)
    u = _checked_flag("--ball-modulus-error", u_percent, "%", ERROR, modulus_hint)
    # Any Poisson's ratio serves, because only E / (1 - nu^2) affects a press.
    return ReferenceBall(E_MPa=reduced * (1.0 - RUBBER_POISSON**2), radius_mm=radius, percent=u / COVERAGE)


def _checked_flag(flag: str, value: float | None, unit: str, bounds: Bounds, hint: str) -> float:
    """Return the value of a flag, or raise InputError if it is missing (None) or out of `bounds`."""
    if value is None or not bounds.hold(value):
        raise validation_error(flag, value, unit, f"given with --ball, {bounds}", hint)
    return value


@dataclass(frozen=True, kw_only=True)
class PressedBall:
    """A ball and the file of presses on it.

    `counts_as` is the notation of the counts: "unsigned", "offset", or None for signed counts. `columns` specifies
    columns and units that the header lacks. `say` receives each note about the file, by default without effect.
    """

    source: Path
    ball: ReferenceBall
    counts_as: str | None = None
    columns: ColumnFlags = NO_FLAGS
    say: Callable[[str], None] = lambda _: None


@dataclass(frozen=True, kw_only=True)
class BallPresses:
    """The number of accepted presses on a ball (`counted`), and the number of all presses.

    `flags` maps each flag to the number of presses that it excluded.
    """

    counted: int
    presses: int
    flags: dict[str, int]

    @property
    def flags_text(self) -> str:
        """Return the flags of the rejected presses as text, each followed by the number of presses that it excluded."""
        return ", ".join(f"{flag} {count}" for flag, count in self.flags.items())


def measure_ball_correction(pressed: PressedBall, sensor: MeasuringUnit) -> tuple[BallCorrection, BallPresses]:
    """Read the presses on a ball of known modulus, and determine the correction of the unit from them.

    `pressed` holds the ball and the file of presses. `sensor` is the unit without this correction. Returns the
    correction and the numbers of presses, and passes notes on the file to `pressed.say`.

    Raises InputError for a ball or a report that is unsuitable, and if the presses do not determine a factor.
    """
    _check_ball(pressed, sensor)
    source = pressed.source
    ball = pressed.ball

    def say_with_source(note: str) -> None:
        pressed.say(f"{source}: {note}")

    signal = Signal(rows.rows_of(source, "--ball"), len(sensor.report.tips), pressed.columns, say_with_source)
    for note in (signal.summary, *signal.notes):
        pressed.say(note)
    readings = list(readings_of(sensor.for_ball(ball.radius_mm), signal, counts_as=pressed.counts_as))
    return fit_ball_correction(readings, ball, sensor, str(source)), count_presses(readings)


def _check_ball(pressed: PressedBall, sensor: MeasuringUnit) -> None:
    """Raise InputError if the ball or the report does not suit a correction of the domes.

    The design must be one whose fruit and tips a ball can represent, and the report must hold the form errors of the
    domes. The ball must be large enough, and its modulus must lie within the range of the design's fruit.
    """
    source = pressed.source
    ball = pressed.ball
    design = sensor.report.design
    if not design.takes_ball:
        bound = f"left out, because a ball is only for {REPRESENTED_BY_BALL}"
        raise validation_error("--ball", str(source), "", bound, "remove the flag")
    if sensor.lacks_form:
        bound = "in report.json if --ball is given"
        raise validation_error("reading.moduli.form_percent", None, "", bound, "run the design again")
    least_radius = LEAST_RADIUS_RATIO * design.tips.spacing_mm
    if not ball.radius_mm >= least_radius:
        bound = f"at least {least_radius:g} mm, {LEAST_RADIUS_RATIO:g} times tips.spacing_mm"
        raise validation_error("--ball-radius", ball.radius_mm, "mm", bound, "use a larger ball")
    softest, firmest = map(sensor.reduced, sensor.range_MPa)  # E / (1 - nu^2) of the fruit [MPa]
    if not softest <= ball.reduced_MPa <= firmest:
        bound = f"from {softest:.3g} to {firmest:.3g} MPa, as firm as the fruit of the design"
        raise validation_error("--ball-reduced-modulus", ball.reduced_MPa, "MPa", bound, "use a softer or firmer ball")


def _is_accepted(reading: FruitReading) -> bool:
    """Return whether a press on a ball has a modulus and no flag that excludes the press."""
    return reading.E is not None and ACCEPTED_FLAGS.issuperset(reading.flags)


def count_presses(readings: Sequence[FruitReading]) -> BallPresses:
    """Count the accepted presses on a ball, all presses, and the presses that each flag excluded."""
    rejected = [reading for reading in readings if not _is_accepted(reading)]
    flags = Counter(flag for reading in rejected for flag in reading.flags if flag not in ACCEPTED_FLAGS)
    return BallPresses(counted=len(readings) - len(rejected), presses=len(readings), flags=dict(flags))


def fit_ball_correction(
    readings: Sequence[FruitReading], ball: ReferenceBall, sensor: MeasuringUnit, source: str
) -> BallCorrection:
    """Return the correction of a unit from its readings on a ball.

    The unit reads with the contact law of the design's fruit, which is less deep than a ball. So even with ideal domes,
    the unit would not read the modulus of the ball. The reference is therefore the reading of a simulated press by
    ideal domes:

        factor = E read in the simulated press / median of E read in the real presses.

    The error of the factor combines the error of the ball's modulus, the scatter of the presses, and the errors that
    all presses share.

    `sensor` is the unit without this correction, and `source` is the name of the file in messages. Raises InputError
    for too few accepted presses, for a factor out of bounds, and for presses that scatter too much.
    """
    accepted = _select_accepted(readings, source)
    on_ball = sensor.for_ball(ball.radius_mm)
    E = _equivalent_modulus(ball, sensor)
    forces, simulated = deep_press(on_ball, E)
    moduli = np.array([reading.E for reading in accepted])
    # The simulated reading gets the same corrections as the real readings, for instance for creep.
    factor = on_ball.correct_modulus(simulated.E) / float(np.median(moduli))
    _check_factor(factor, source)
    scatter = _median_error(moduli)
    _check_scatter(scatter, len(moduli), source)
    press_s = _typical_duration(accepted, on_ball)
    common_error = _common_error(on_ball, simulated, accepted, press_s)
    return BallCorrection(
        factor=factor,
        percent=math.hypot(ball.percent, 100.0 * scatter, 100.0 * common_error),
        E_MPa=E,
        radius_mm=ball.radius_mm,
        press_s=press_s,
        spring_slopes=simulated.slopes.springs,
        gain_slopes=simulated.slopes.gains,
        form_percent=_form_percent(on_ball, forces),
    )


def _typical_duration(accepted: Sequence[FruitReading], on_ball: MeasuringUnit) -> float:
    """Return the median duration of the accepted presses [s], or the duration in the design if no press has times."""
    durations = [reading.press_s for reading in accepted if reading.press_s is not None]
    return float(np.median(durations)) if durations else on_ball.report.design.press_s


def _check_factor(factor: float, source: str) -> None:
    """Raise InputError if the factor [1] of the presses in the file `source` is implausible."""
    if not FACTOR.hold(factor):
        hint = "check the unit of the modulus, and the springs"
        name = f"{source}: E of the ball divided by E read"
        raise validation_error(name, float(f"{factor:.3g}"), "", str(FACTOR), hint)


def _check_scatter(scatter: float, press_count: int, source: str) -> None:
    """Raise InputError if the presses in the file `source` scatter so much that the factor is too uncertain.

    `scatter` [1] is the relative standard error of the factor due to the scatter of `press_count` presses.
    """
    half_width = 100.0 * COVERAGE * scatter  # at 95 % [%]
    if not SCATTER.hold(half_width):
        name = f"{source}: error of the factor (95 %) due to the scatter of {press_count} presses"
        hint = "press more often, level and at an even pace, with the ball on a hard base"
        raise validation_error(name, float(f"{half_width:.3g}"), "%", str(SCATTER), hint)


def _select_accepted(readings: Sequence[FruitReading], source: str) -> list[FruitReading]:
    """Return the readings of accepted presses, or raise InputError if there are too few of them.

    `source` is the name of the file in the message.
    """
    accepted = list(filter(_is_accepted, readings))
    if len(accepted) < FEWEST_PRESSES:
        numbers = count_presses(readings)
        flags = f" ({numbers.flags_text})" if numbers.flags else ""
        bound = f"at least {FEWEST_PRESSES} of {numbers.presses} presses with a modulus and without flags{flags}"
        hint = "press the ball again; pipeline read shows the flags of each press"
        raise validation_error(source, len(accepted), "presses", bound, hint)
    return accepted


def _median_error(moduli: Floats) -> float:
    """Return the relative standard error [1] of the median of moduli (presses,) [MPa], due to their scatter.

    A few presses determine their own scatter poorly. So the error is widened by Student's t divided by the coverage
    factor of a normal distribution.
    """
    # For normally distributed readings, the variance of the median is pi / 2 times the variance of the mean.
    deviation = float(np.log(moduli).std(ddof=1)) * math.sqrt(0.5 * math.pi / len(moduli))
    return deviation * student_quantile(len(moduli) - 1) / COVERAGE


def deep_press(on_ball: MeasuringUnit, E: float) -> tuple[Floats, RiseReading]:
    """Simulate a level press of a unit on a ball, without noise.

    `on_ball` is the unit for this ball, and `E` [MPa] is the modulus that it should read. Returns the forces (samples,
    tips) [N] of the press and its uncorrected reading. The ball is modelled as an elastic half-space, with the
    curvature of the ball only in the gaps between tips and surface.

    Raises InputError if the press has no solution or no reading, because the springs differ too much from the design.
    """
    domes = on_ball.domes
    reading_law = on_ball.rise_law
    assert domes is not None  # noqa: S101 - only a design with domes takes a ball
    # The press uses the compliance S of a half-space under the tips, but is read like a press on the design's fruit.
    half_space_law = replace(reading_law.contrast, S=rows_of(domes.S()))
    # The travel [mm] begins where the tip with the smallest gap touches the ball.
    travel = min(half_space_law.gaps) + travels(on_ball.report.design.press.travel_mm, PRESS_SAMPLES)
    try:
        forces = elastic_forces(half_space_law, np.full(len(travel), on_ball.uncorrected_modulus(E)), travel)
        tips = forces.shape[1]
        no_noise = np.zeros(tips)
        return forces, read_rise(reading_law, select_rise(forces, tips, on_ball.least_forces), no_noise)
    except (SolveError, ReadingError) as error:
        msg = (
            f"--ball: a level press at {E:.3g} MPa must determine a modulus. "
            "The springs differ too much from the design."
        )
        raise InputError(msg) from error


def _common_error(
    on_ball: MeasuringUnit, simulated: RiseReading, accepted: Sequence[FruitReading], press_s: float
) -> float:
    """Return the relative standard deviation [1] of the error that all presses on the ball share.

    Presses on fruit do not share this error. The causes of this error are the zeros and sampling times of the channels,
    and the contact model. Gain drift is not a cause, because the ball is pressed at the temperature of the weighing.

    `on_ball` is the unit for this ball, and `simulated` is its reading of a simulated press. `accepted` are the
    readings of the real presses, and `press_s` [s] is their duration.
    """
    # The presses may be sampled with different accuracy. The least accurate sampling times are assumed for all.
    time_s = max(reading.time_s for reading in accepted)  # standard deviation of each channel's sampling time
    unit_errors = on_ball.channels_in(time_s, press_s).press_uncertainty([simulated.slopes])  # keyed by cause
    channel_errors = [unit_errors[cause] for cause in UNKNOWN_CORRELATION]
    return math.hypot(*channel_errors, UNIFORM_DEVIATION * on_ball.model_error)


def _form_percent(on_ball: MeasuringUnit, forces: Floats) -> tuple[float, ...]:
    """Return the change of E [%] in a press on the ball, due to one standard deviation of each form error of the domes.

    `on_ball` is the unit for this ball, and `forces` (samples, tips) [N] are the forces of the press.
    """
    model = RiseModel(law=on_ball.rise_law)
    curvature = 1.0 / on_ball.radii_mm[0] if on_ball.radii_mm else 0.0  # 0 for a flat surface
    changes = form_error_changes(on_ball.report.design, model, forces, (curvature, curvature))
    return tuple((100.0 * changes).tolist())


def _equivalent_modulus(ball: ReferenceBall, sensor: MeasuringUnit) -> float:
    """Return the modulus [MPa] of a fruit of the design with the same E / (1 - nu^2) as the ball."""
    return ball.reduced_MPa / sensor.reduced(1.0)
