"""The files of a simulation: logs of presses on a fruit and on a ball, and the tables of a bench, as lines."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from instrument.simulate.bench_tables import ball_presses, plate_table, usual_ball, weights_table
from instrument.simulate.drawn_fruit import PressedFruit, bruised, uneven
from instrument.simulate.log import log_of
from instrument.simulate.simulated_press import Hand, press_curve
from instrument.simulate.unit import SimulatedUnit, drawn_unit
from pipeline.report.report import Report
from pipeline.storage.stopwatch import Count, silent
from sensor.design.bench import Bench
from sensor.design.reading import ReadingRequirements


@dataclass(frozen=True, kw_only=True)
class Asked:
    """The settings of a simulation: presses on a fruit, each turned against the one before, logged at a rate [Hz].

    With `noise`, channels have noise and drift. With `uneven`, skin and flesh vary from place to place. `bruise_mm` is
    the radius of a bruise under the first tip of the first press. `relaxation` are shares and times [s] of the flesh.
    The seed determines all random numbers.
    """

    fruit: PressedFruit
    presses: int
    rate: float
    noise: bool
    uneven: bool
    bruise_mm: float | None
    relaxation: Sequence[tuple[float, float]]
    seed: int

    def numbers(self, place: int) -> np.random.Generator:
        """Return the random numbers of one file, which do not depend on the other files."""
        return np.random.default_rng([self.seed, place])


def unit_of_seed(report: Report, seed: int) -> SimulatedUnit:
    """Return the unit of a design that a seed determines."""
    return drawn_unit(report, np.random.default_rng([seed, 0]))


def hand_of(report: Report, relaxation: Sequence[tuple[float, float]] | None = None) -> Hand:
    """Return the press of a design by hand, on relaxing flesh with the hold of the design.

    None is the design's flesh.
    """
    design = report.design
    return Hand(
        travel=design.press.travel_mm,
        press_s=design.press_s,
        hold_s=design.press.hold_s or 0.0,
        relaxation=(design.fruit.relaxation or ()) if relaxation is None else relaxation,
    )


def bench_of(report: Report) -> Bench:
    """Return the bench of a design, or the usual one."""
    return report.design.bench or Bench()


def log_of_fruit(report: Report, unit: SimulatedUnit, asked: Asked, count: Count = silent) -> list[str]:
    """Return the log of the presses on the fruit; `count` is called with the number of solved presses."""
    rng = asked.numbers(1)
    now = unit.in_other_air(report, rng) if asked.noise else unit
    turn = report.design.tips.tip_layout.turn_deg or 0.0  # without a turn, all presses stand in the same way
    hand = hand_of(report, asked.relaxation)
    presses = []
    for number in range(asked.presses):
        count(number, asked.presses)
        fruit = asked.fruit.pressed_again(number * turn)
        if asked.bruise_mm is not None:
            fruit = bruised(fruit, report, asked.bruise_mm, number * turn)
        if asked.uneven:
            fruit = uneven(fruit, report, rng)
        # An identical press is solved again; it differs after a turn only if the fruit is no ball.
        presses.append(press_curve(now, fruit, hand))
    return log_of(report, now, presses, asked.rate, rng if asked.noise else None)


def log_of_ball(report: Report, unit: SimulatedUnit, asked: Asked, _count: Count) -> list[str]:
    """Return the log of presses by hand on a rubber ball, at the temperature of the bench."""
    rng = asked.numbers(2)
    steepest = (report.design.reading or ReadingRequirements()).tilt_deg
    hand = hand_of(report, ())
    presses = [press_curve(unit, fruit, hand) for fruit in ball_presses(usual_ball(report), 0.5 * steepest, rng)]
    return log_of(report, unit, presses, asked.rate, rng if asked.noise else None)


FILES: dict[str, Callable[[Report, SimulatedUnit, Asked, Count], list[str]]] = {
    "weights": lambda report, unit, asked, _: weights_table(report, unit, bench_of(report), asked.numbers(3)),
    "plate": lambda report, unit, asked, _: plate_table(report, unit, bench_of(report), asked.numbers(4)),
    "ball": log_of_ball,
    "out": log_of_fruit,
}
"""The function that makes the lines of each file, by its flag."""
