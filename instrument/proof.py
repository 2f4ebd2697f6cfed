"""Test a design by simulation: random units press random fruit, and the readings are compared with the true moduli.

The simulation shares no code with the law by which presses are read. Each unit is calibrated as its design states, with
random errors as large as the calibration leaves them. If the design requires a reference ball, the unit also presses
that ball.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import binom

from instrument.calibrate.reference_presses import ACCEPTED_FLAGS, ReferenceBall, fit_ball_correction
from instrument.press.fruit_reading import FruitReading
from instrument.press.measuring import MeasuringUnit
from instrument.press.presses import readings_of
from instrument.press.printed_unit import PrintedUnit, unit_of
from instrument.press.signals import Signal
from instrument.simulate.bench_tables import BALL_PRESSES, usual_ball
from instrument.simulate.drawn_fruit import PressedFruit, draw_fruit
from instrument.simulate.log import log_lines, usual_rate
from instrument.simulate.simulated_press import press_curve
from instrument.simulate.simulation import designed_press
from instrument.simulate.unit import SimulatedUnit, draw_unit
from pipeline.report.report import Report
from pipeline.tables.rows import Rows
from sensor.arrays import Floats
from sensor.design.reading import ReadingRequirements
from sensor.quantity import UNIFORM_DEVIATION, InputError, report_field

EXPECTED_OUTSIDE = 0.05
"""Expected fraction of readings outside their error bars, which contain the true value in 95 % of cases."""
BINOMIAL_QUANTILE = 0.99  # quantile of the binomial distribution; a correct design exceeds it in one of a hundred tests
_MIN_PERCENT = 1e-6  # lower bound on the error of a spring stiffness [%], because no stiffness is known exactly
_UNSTATED_PERCENT = 1.0  # error of a spring stiffness [%], for reports that do not state calibration errors
MAX_DRAWS = 5
"""Maximum number of draws for one press; a draw fails if its unit cannot be calibrated or its press has no solution."""
MAX_ERROR_IN_BARS = 2.0
"""Largest allowed error of a reading without a flag, divided by its half width."""
MAX_FLAGGED = 0.1
"""Largest allowed fraction of readings with a flag."""


@dataclass(frozen=True, kw_only=True)
class ProvedReading:
    """A simulated press: the true properties of its fruit and pose, and the reading."""

    E: float = report_field("MPa", "true modulus of the fruit", key="E_MPa")
    radii: tuple[float, float] = report_field("mm", "principal radii of the fruit", key="radii_mm")
    thickness: float | None = report_field("mm", "flesh over the stone; null without a stone", key="thickness_mm")
    tilt: float = report_field("deg", "tilt at the first touch, against the normal of the skin", key="tilt_deg")
    E_read: float | None = report_field("MPa", "modulus that was read; null if there is none", key="told_MPa")
    u: float | None = report_field("%", "half width at 95 % of the modulus that was read", key="u_percent", times=100.0)
    error: float | None = report_field(
        "%", "error of the modulus that was read, divided by the true modulus", key="error_percent", times=100.0
    )
    flags: tuple[str, ...] = report_field("", "flags of the reading, each a reason to doubt it")

    @property
    def is_flagged(self) -> bool:
        """Return whether there is no modulus, or a flag that casts doubt on it.

        Flags for a bruise or for a modulus out of range cast no doubt on the modulus.
        """
        return self.E_read is None or not ACCEPTED_FLAGS.issuperset(self.flags)

    @property
    def error_in_bars(self) -> float:
        """Return the absolute error of the reading divided by its half width [1]; infinite without a modulus."""
        if self.E_read is None or not self.u:
            return math.inf
        return abs(self.E / self.E_read - 1.0) / self.u


@dataclass(frozen=True, kw_only=True)
class ProvedDesign:
    """The results of all simulated presses of a design, and whether it passes."""

    design: str = report_field("", "name of the design")
    seed: int = report_field("1", "seed of the draws")
    presses: int = report_field("1", "number of presses")
    outside: int = report_field("1", "readings without a flag whose error exceeds the 95 % error bar")
    most_outside: int = report_field(
        "1", "largest allowed number of readings outside: the 99 % quantile of a binomial distribution with 5 %"
    )
    farthest: float = report_field("1", "largest error divided by the error bar, of readings without a flag; at most 2")
    flagged: int = report_field("1", "readings with a flag that casts doubt on E; at most a tenth")
    drawn_again: int = report_field(
        "1", "presses that were drawn again: their unit could not be calibrated, or they had no solution"
    )
    passed: bool = report_field("", "whether all three conditions are met")
    readings: tuple[ProvedReading, ...] = report_field("", "true values and reading of each press")

    @property
    def failures(self) -> list[str]:
        """Return a clause for each condition that is not met; the list is empty if the design passes."""
        return _failures(
            presses=self.presses,
            outside=self.outside,
            most_outside=self.most_outside,
            farthest=self.farthest,
            flagged=self.flagged,
        )


def _failures(*, presses: int, outside: int, most_outside: int, farthest: float, flagged: int) -> list[str]:
    """Return a clause for each condition of a proof that is not met; the arguments are fields of `ProvedDesign`."""
    texts = []
    if outside > most_outside:
        bound = f"at most {most_outside} may be"
        texts.append(f"{outside} of {presses} readings are outside their error bars, but {bound}")
    if farthest > MAX_ERROR_IN_BARS:
        texts.append(f"one error is {farthest:.2g} times its half width, but at most {MAX_ERROR_IN_BARS:g} is allowed")
    if flagged > MAX_FLAGGED * presses:
        texts.append(f"{flagged} of {presses} readings are flagged, but at most a tenth may be")
    return texts


def prove(report: Report, count: int, seed: int, progress: Callable[[int], None] = lambda _: None) -> ProvedDesign:
    """Test a design with `count` simulated presses, each of a new random unit on a new random fruit.

    `seed` determines all random numbers. `progress` is called with the number of finished presses. A press is drawn
    again if it has no solution or its unit cannot be calibrated. Raises InputError if `MAX_DRAWS` draws of one press
    fail.
    """
    readings = []
    redraws = 0  # number of failed draws that were replaced
    for number in range(count):
        for attempt in range(MAX_DRAWS):
            # Each draw has its own seed, so that a repeated draw does not change the other presses. The seed of a
            # repeated draw includes the number of the attempt.
            draw_seed = [seed, number, attempt] if attempt else [seed, number]
            try:
                readings.append(_simulate_reading(report, np.random.default_rng(draw_seed)))
                break
            except InputError:
                if attempt + 1 == MAX_DRAWS:
                    raise
                redraws += 1
        progress(number + 1)
    return evaluate_proof(report.design.name, seed, readings, redraws)


def evaluate_proof(design: str, seed: int, readings: Iterable[ProvedReading], redraws: int = 0) -> ProvedDesign:
    """Evaluate the readings of simulated presses, and decide whether the design passes.

    `design` is the name of the design, and `seed` is the seed of the draws. `redraws` is the number of draws that were
    replaced by another random press, because they failed.
    """
    readings = tuple(readings)
    presses = len(readings)
    # The error of each reading without a flag, divided by its half width; above 1, it is outside its error bar.
    errors_in_bars = [reading.error_in_bars for reading in readings if not reading.is_flagged]
    outside = sum(error > 1.0 for error in errors_in_bars)
    most_outside = int(binom.ppf(BINOMIAL_QUANTILE, presses, EXPECTED_OUTSIDE))
    farthest = max(errors_in_bars, default=0.0)
    flagged = presses - len(errors_in_bars)
    failures = _failures(
        presses=presses, outside=outside, most_outside=most_outside, farthest=farthest, flagged=flagged
    )
    return ProvedDesign(
        design=design,
        seed=seed,
        presses=presses,
        outside=outside,
        most_outside=most_outside,
        farthest=farthest,
        flagged=flagged,
        drawn_again=redraws,
        passed=not failures,
        readings=readings,
    )


def _simulate_reading(report: Report, rng: np.random.Generator) -> ProvedReading:
    """Simulate a press of a random unit on a random fruit; return its reading with the true properties of the fruit.

    Raises InputError if the press has no solution or the unit cannot be calibrated.
    """
    real_unit = draw_unit(report, rng)
    calibrated_unit = MeasuringUnit(report=report, unit=_calibrate_unit(report, real_unit, rng))
    fruit = draw_fruit(report, rng)
    # The temperature during the press differs from the temperature during the calibration.
    reading = read_by(calibrated_unit, real_unit.at_other_temperature(report, rng), fruit, rng)
    return ProvedReading(
        E=fruit.E,
        radii=fruit.radii,
        thickness=fruit.thickness,
        tilt=math.hypot(*fruit.tilt),
        E_read=reading.E,
        u=reading.u,
        error=None if reading.E is None else float(reading.E / fruit.E - 1.0),
        flags=reading.flags,
    )


def read_by(
    unit: MeasuringUnit, real_unit: SimulatedUnit, fruit: PressedFruit, rng: np.random.Generator | None = None
) -> FruitReading:
    """Simulate a press of `real_unit` on a fruit, and return the reading of its log.

    The log is read with `unit`, the sensor as it was calibrated. If `rng` is given, the log has noise. Noise may look
    like additional short presses, so the reading with the most samples is returned. Raises InputError if the press has
    no solution.
    """
    report = unit.report
    press = press_curve(real_unit, fruit, designed_press(report))
    lines = log_lines(report, real_unit, [press], usual_rate(report), rng)
    readings = list(readings_of(unit, Signal(Rows(lines, "the simulated log"), len(report.tips))))
    return max(readings, key=lambda reading: reading.samples or 0)


def _calibrate_unit(report: Report, real_unit: SimulatedUnit, rng: np.random.Generator) -> PrintedUnit:
    """Return `real_unit` as its calibration describes it, with random errors as large as the design expects.

    With weights, the gain errors are errors of the forces. On a hard plate, they are errors of the deflections, and the
    forces follow from the stiffnesses. If the design requires a reference ball, the correction comes from a press on
    it. Raises InputError if that press does not determine a correction.
    """
    requirements = report.design.reading or ReadingRequirements()
    spring_percent, gain_percent = _calibration_percent(report)
    true_K = real_unit.domes.K  # [N/mm]
    K = true_K * (1.0 + 0.01 * spring_percent * rng.normal(size=len(true_K)))
    # On a plate, forces follow from deflections by the calibrated stiffness, which has an error itself.
    base_K = K if requirements.on_plate else true_K
    newtons_per_mm = (1.0 + 0.01 * gain_percent * rng.normal(size=len(true_K))) * base_K
    drift_percent = UNIFORM_DEVIATION * np.array(report.read_out.channels.gain_drift_percent)
    unit = replace(
        unit_of(report, stiffnesses=K.tolist(), percent=spring_percent.tolist(), method="drawn"),
        gain_percent=tuple(np.hypot(gain_percent, drift_percent).tolist()),
        calibrated_by="plate" if requirements.on_plate else "weights",
        weighed_after_s=real_unit.weighed_s,
    )
    unit = _with_counts_of(real_unit, unit, newtons_per_mm)
    return _correct_by_ball(report, unit, real_unit, rng) if requirements.calibrated_by == "ball" else unit


def _with_counts_of(real_unit: SimulatedUnit, unit: PrintedUnit, newtons_per_mm: Floats) -> PrintedUnit:
    """Return a copy of the calibrated `unit` with the zeros and the range of the counts of `real_unit`.

    The force per count follows from `newtons_per_mm` (tips,) [N/mm], the calibrated force on each tip per deflection.
    """
    # In a random unit, the counts of a channel depend only on the deflection of its own tip.
    newtons_per_count = np.diag(newtons_per_mm / np.diag(real_unit.per_mm))
    return replace(
        unit,
        newtons_per_count=tuple(map(tuple, newtons_per_count.tolist())),
        zero_counts=tuple(real_unit.zeros.tolist()),
        saturation_counts=real_unit.saturation or 0,
    )


def _correct_by_ball(
    report: Report, unit: PrintedUnit, real_unit: SimulatedUnit, rng: np.random.Generator
) -> PrintedUnit:
    """Return a copy of the calibrated `unit` with a correction from a simulated press on a reference ball.

    `real_unit` is the simulated sensor that presses the ball. `rng` draws the error of the ball's stated modulus, which
    multiplies the correction. Raises InputError if the press does not determine a correction.
    """
    requirements = report.design.reading or ReadingRequirements()
    ball = usual_ball(report)
    sensor = MeasuringUnit(report=report, unit=unit)
    reference = ReferenceBall(E_MPa=ball.E, radius_mm=ball.radius, percent=requirements.ball_percent)
    # Presses without noise are identical, so one press represents all of them.
    reading = read_by(sensor.for_ball(ball.radius), real_unit, ball.fruit())
    correction = fit_ball_correction(BALL_PRESSES * [reading], reference, sensor, "the ball")  # its name in messages
    # stated modulus of the ball divided by its true modulus
    modulus_factor = math.exp(0.01 * requirements.ball_percent * rng.normal())
    return replace(unit, ball=replace(correction, factor=modulus_factor * correction.factor))


def _calibration_percent(report: Report) -> tuple[Floats, Floats]:
    """Return the standard deviations [%] of the stiffnesses (tips,) and gains (tips,) after the calibration.

    The deviations come from the error analysis of the report. A report without one uses the deviations that the design
    states, or `_UNSTATED_PERCENT` if the design states none for the stiffnesses.
    """
    requirements = report.design.reading or ReadingRequirements()
    calibration = None if report.reading is None else report.reading.calibration
    if calibration is not None:
        return np.maximum(calibration.stiffness_percent, _MIN_PERCENT), np.array(calibration.gain_percent)
    ones = np.ones(len(report.tips))
    stated = requirements.stiffness_percent
    stiffness_percent = _UNSTATED_PERCENT if stated is None else stated
    return max(stiffness_percent, _MIN_PERCENT) * ones, requirements.uncalibrated_gain_percent * ones
