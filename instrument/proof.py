"""Proof of a design by simulation: drawn units press drawn fruit, and their readings are compared with the truth.

Units and presses share nothing with the law that reads. A unit is calibrated as its design states, and the remaining
error of each quantity is drawn. If a reference ball corrects the unit, it presses that ball too.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import binom

from instrument.calibrate.reference_presses import MAY_STAND, ReferenceBall, correction_of
from instrument.press.fruit_reading import FruitReading
from instrument.press.measuring import MeasuringUnit
from instrument.press.presses import readings_of
from instrument.press.printed_unit import PrintedUnit, unit_of
from instrument.press.signals import Signal
from instrument.simulate.bench_tables import usual_ball
from instrument.simulate.drawn_fruit import PressedFruit, drawn_fruit
from instrument.simulate.log import log_of, usual_rate
from instrument.simulate.simulated_press import press_curve
from instrument.simulate.simulation import hand_of
from instrument.simulate.unit import SimulatedUnit, drawn_unit
from pipeline.report.report import Report
from pipeline.tables.rows import Rows
from sensor.arrays import Floats
from sensor.design.reading import ReadingRequirements
from sensor.quantity import BOUNDED, InputError, report_field

OUTSIDE = 0.05
"""Share of honest readings outside bars that hold 95 %."""
POINT = 0.99  # point of the binomial distribution: an honest design exceeds it once in a hundred times
_LEAST_PERCENT = 1e-6  # least error of a spring [%], because none is known exactly
_BEFORE_BENCHES_PERCENT = 1.0  # error of a spring [%] in reports without errors left by calibration
MOST_DRAWS = 5
"""Most draws for one press, if a unit cannot be calibrated or a press has no solution."""
MOST_BARS = 2.0
MOST_FLAGGED = 0.1


@dataclass(frozen=True, kw_only=True)
class ProvedReading:
    """A simulated press: the truth of its fruit and pose, and the reading."""

    E: float = report_field("MPa", "true modulus of the fruit", key="E_MPa")
    radii: tuple[float, float] = report_field("mm", "principal radii of the fruit", key="radii_mm")
    thickness: float | None = report_field("mm", "flesh over the stone; null without a stone", key="thickness_mm")
    tilt: float = report_field("deg", "tilt at the first touch, against the normal of the skin", key="tilt_deg")
    told: float | None = report_field("MPa", "modulus that was read; null if there is none", key="told_MPa")
    u: float | None = report_field("%", "half width at 95 % of the modulus that was read", key="u_percent", times=100.0)
    error: float | None = report_field(
        "%", "error of the modulus that was read, over the true one", key="error_percent", times=100.0
    )
    flags: tuple[str, ...] = report_field("", "flags of the reading, each a reason to doubt it")

    @property
    def is_flagged(self) -> bool:
        """Return whether a flag questions the modulus; flags on bruises and on the ends of the range do not."""
        return self.told is None or not MAY_STAND.issuperset(self.flags)

    @property
    def bars(self) -> float:
        """Return the error of the reading over its half width [1]."""
        return math.inf if self.told is None or not self.u else abs(self.E / self.told - 1.0) / self.u


@dataclass(frozen=True, kw_only=True)
class ProvedDesign:
    """The result of all simulated presses."""

    design: str = report_field("", "name of the design")
    seed: int = report_field("1", "seed of the draws")
    presses: int = report_field("1", "number of presses")
    outside: int = report_field("1", "readings beyond their 95 % bar without a flag")
    most_outside: int = report_field("1", "most that may be outside: the 99 % point of a binomial distribution of 5 %")
    farthest: float = report_field(
        "1", "largest distance from the truth over the bar, of readings without a flag; at most 2"
    )
    flagged: int = report_field("1", "readings with a flag that speaks against E; at most a tenth")
    drawn_again: int = report_field(
        "1", "presses that were drawn again: their unit could not be calibrated, or they had no solution"
    )
    passed: bool = report_field("", "whether all three hold")
    readings: tuple[ProvedReading, ...] = report_field("", "truth and answer of each press")

    @property
    def failures(self) -> list[str]:
        """Return each condition that fails, as text."""
        found = []
        if self.outside > self.most_outside:
            found.append(f"{self.outside} of {self.presses} are outside their bars, at most {self.most_outside} may be")
        if self.farthest > MOST_BARS:
            found.append(f"one error is {self.farthest:.2g} bars, but at most {MOST_BARS:g} is allowed")
        if self.flagged > MOST_FLAGGED * self.presses:
            found.append(f"{self.flagged} of {self.presses} are flagged, but at most a tenth may be")
        return found


def prove(report: Report, count: int, seed: int, progress: Callable[[int], None] = lambda _: None) -> ProvedDesign:
    """Return the proof of a design by a number of presses, each by another unit on another fruit.

    `progress` is called with the number of finished presses. A press is drawn again if it has no solution or its unit
    cannot be calibrated. Raises InputError if that does not help.
    """
    readings, again = [], 0
    for number in range(count):
        for attempt in range(MOST_DRAWS):
            try:
                # Each draw has its own seed, so that a repeated press does not change the others.
                readings.append(
                    _proved(report, np.random.default_rng([seed, number] if not attempt else [seed, number, attempt]))
                )
                break
            except InputError:
                if attempt + 1 == MOST_DRAWS:
                    raise
                again += 1
        progress(number + 1)
    return judged(report.design.name, seed, readings, again)


def judged(design: str, seed: int, readings: Iterable[ProvedReading], again: int = 0) -> ProvedDesign:
    """Return the proof from its readings; `again` is the number of presses that were drawn again."""
    readings = tuple(readings)
    bars = [each.bars for each in readings if not each.is_flagged]
    proof = ProvedDesign(
        design=design,
        seed=seed,
        presses=len(readings),
        outside=sum(bar > 1.0 for bar in bars),
        most_outside=int(binom.ppf(POINT, len(readings), OUTSIDE)),
        farthest=max(bars, default=0.0),
        flagged=len(readings) - len(bars),
        drawn_again=again,
        passed=False,
        readings=readings,
    )
    return replace(proof, passed=not proof.failures)


def _proved(report: Report, rng: np.random.Generator) -> ProvedReading:
    """Return one simulated press of a drawn unit on a drawn fruit, and its reading."""
    made = drawn_unit(report, rng)
    unit = MeasuringUnit(report=report, unit=_calibrated(report, made, rng))
    fruit = drawn_fruit(report, rng)
    found = read_by(unit, made.in_other_air(report, rng), fruit, rng)
    return ProvedReading(
        E=fruit.E,
        radii=fruit.radii,
        thickness=fruit.thickness,
        tilt=math.hypot(*fruit.tilt),
        told=found.E,
        u=found.u,
        error=None if found.E is None else float(found.E / fruit.E - 1.0),
        flags=found.flags,
    )


def read_by(
    unit: MeasuringUnit, made: SimulatedUnit, fruit: PressedFruit, rng: np.random.Generator | None = None
) -> FruitReading:
    """Return the reading by a calibrated unit of a press with the real unit; with `rng` the log has noise."""
    report = unit.report
    press = press_curve(made, fruit, hand_of(report))
    lines = log_of(report, made, [press], usual_rate(report), rng)
    readings = list(readings_of(unit, Signal(Rows(lines, "the simulated log"), len(report.tips))))
    return max(readings, key=lambda each: each.samples or 0)


def _calibrated(report: Report, made: SimulatedUnit, rng: np.random.Generator) -> PrintedUnit:
    """Return the calibration of a real unit, with drawn errors that the design leaves to calibration.

    With weights, the gains determine the error of the forces. With a plate, they determine the error of the
    deflections, and forces follow from the stiffness.
    """
    reading = report.design.reading or ReadingRequirements()
    springs, gains = _left_percent(report)
    K = made.domes.K
    found = K * (1.0 + 0.01 * springs * rng.normal(size=len(K)))
    newtons_per_mm = (1.0 + 0.01 * gains * rng.normal(size=len(K))) * (found if reading.on_plate else K)
    drifts = BOUNDED * np.array(report.read_out.channels.gain_drift_percent)
    unit = unit_of(report, stiffnesses=found.tolist(), percent=springs.tolist(), method="drawn")
    unit = replace(
        unit,
        gain_percent=tuple(np.hypot(gains, drifts).tolist()),
        newtons_per_count=tuple(map(tuple, np.diag(newtons_per_mm / np.diag(made.per_mm)).tolist())),
        zero_counts=tuple(made.zeros.tolist()),
        saturation_counts=made.saturation or 0,
        calibrated_by="plate" if reading.on_plate else "weights",
        weighed_after_s=made.weighed_s,
    )
    if reading.calibrated_by != "ball":
        return unit
    ball = usual_ball(report)
    sensor = MeasuringUnit(report=report, unit=unit)
    reference = ReferenceBall(E_MPa=ball.E, radius_mm=ball.radius, percent=reading.ball_percent)
    found_on_ball = read_by(sensor.on_ball(ball.radius), made, ball.fruit())
    correction = correction_of(3 * [found_on_ball], reference, sensor, "the ball")
    known = math.exp(0.01 * reading.ball_percent * rng.normal())
    return replace(unit, ball=replace(correction, factor=known * correction.factor))


def _left_percent(report: Report) -> tuple[Floats, Floats]:
    """Return the errors of springs and gains [%], (tips,), after the calibration that the design assumes."""
    reading = report.design.reading or ReadingRequirements()
    left = None if report.reading is None else report.reading.calibration
    if left is not None:
        return np.maximum(left.stiffness_percent, _LEAST_PERCENT), np.array(left.gain_percent)
    tips = np.ones(len(report.tips))
    springs = _BEFORE_BENCHES_PERCENT if reading.stiffness_percent is None else reading.stiffness_percent
    return max(springs, _LEAST_PERCENT) * tips, reading.uncalibrated_gain_percent * tips
