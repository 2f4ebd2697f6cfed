"""Generate the files of a simulation as lines of text: logs of presses on a fruit or a ball, and calibration tables."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from instrument.simulate.bench_tables import ball_presses, plate_table, usual_ball, weights_table
from instrument.simulate.drawn_fruit import PressedFruit, add_bruise, make_uneven
from instrument.simulate.log import log_lines
from instrument.simulate.simulated_press import HandPress, press_curve
from instrument.simulate.unit import SimulatedUnit, draw_unit
from pipeline.report.report import Report
from pipeline.storage.stopwatch import Count, ignore_progress
from sensor.design.bench import Bench
from sensor.design.reading import ReadingRequirements

# Each file has random numbers of its own, which follow from the seed and one of these numbers.
_UNIT, _FRUIT_LOG, _BALL_LOG, _WEIGHTS, _PLATE = range(5)


@dataclass(frozen=True, kw_only=True)
class SimulationSettings:
    """The settings of a simulation of a number of `presses` on a fruit, logged at a sampling `rate` [Hz].

    The sensor is turned between presses. With `noise`, the channels have noise and drift. With `uneven`, skin and flesh
    vary with the position. `bruise_mm` [mm] is the radius of a bruise under the first tip in the first press.
    `relaxation` is the Prony series of the flesh: the fraction [1] and the time constant [s] of each Maxwell arm.
    `seed` determines all random numbers.
    """

    fruit: PressedFruit
    presses: int
    rate: float
    noise: bool
    uneven: bool
    bruise_mm: float | None
    relaxation: Sequence[tuple[float, float]]
    seed: int

    def random_generator(self, file_number: int) -> np.random.Generator:
        """Return the random generator of one file; its numbers do not depend on which other files are made."""
        return np.random.default_rng([self.seed, file_number])


def unit_of_seed(report: Report, seed: int) -> SimulatedUnit:
    """Return the random unit of a design that `seed` determines."""
    return draw_unit(report, np.random.default_rng([seed, _UNIT]))


def designed_press(report: Report, relaxation: Sequence[tuple[float, float]] | None = None) -> HandPress:
    """Return a press by hand with the travel, duration and hold of a design.

    `relaxation` is the Prony series of the flesh. If it is None, the relaxation of the design is used.
    """
    design = report.design
    return HandPress(
        travel=design.press.travel_mm,
        press_s=design.press_s,
        hold_s=design.press.hold_s or 0.0,
        relaxation=(design.fruit.relaxation or ()) if relaxation is None else relaxation,
    )


def bench_of(report: Report) -> Bench:
    """Return the bench of a design, or the default bench."""
    return report.design.bench or Bench()


def log_of_fruit(
    report: Report, unit: SimulatedUnit, settings: SimulationSettings, count: Count = ignore_progress
) -> list[str]:
    """Simulate all presses on the fruit and return the lines of their log.

    Between the presses, the sensor is turned by the angle of its layout. `count` is called before each press with the
    number of solved presses and the total number of presses. Raises InputError if a press has no solution.
    """
    rng = settings.random_generator(_FRUIT_LOG)
    # The temperature during the presses differs from the temperature during the calibration.
    pressing_unit = unit.at_other_temperature(report, rng) if settings.noise else unit
    turn = report.design.tips.tip_layout.turn_deg or 0.0  # the sensor is not turned if its layout has no such angle
    hand_press = designed_press(report, settings.relaxation)
    presses = []
    for number in range(settings.presses):
        count(number, settings.presses)
        fruit = settings.fruit.in_turned_frame(number * turn)
        if settings.bruise_mm is not None:
            fruit = add_bruise(fruit, report, settings.bruise_mm, number * turn)
        if settings.uneven:
            fruit = make_uneven(fruit, report, rng)
        presses.append(press_curve(pressing_unit, fruit, hand_press))
    return log_lines(report, pressing_unit, presses, settings.rate, rng if settings.noise else None)


def log_of_ball(report: Report, unit: SimulatedUnit, settings: SimulationSettings, _count: Count) -> list[str]:
    """Simulate presses by hand on a rubber ball, at the calibration temperature, and return the lines of their log.

    On a ball, the sensor is tilted by at most half of the largest tilt of the design. Rubber does not relax. Raises
    InputError if a press has no solution.
    """
    rng = settings.random_generator(_BALL_LOG)
    steepest = (report.design.reading or ReadingRequirements()).tilt_deg
    hand_press = designed_press(report, ())  # no relaxation
    presses = [press_curve(unit, fruit, hand_press) for fruit in ball_presses(usual_ball(report), 0.5 * steepest, rng)]
    return log_lines(report, unit, presses, settings.rate, rng if settings.noise else None)


def _weights_lines(report: Report, unit: SimulatedUnit, settings: SimulationSettings, _count: Count) -> list[str]:
    return weights_table(report, unit, bench_of(report), settings.random_generator(_WEIGHTS))


def _plate_lines(report: Report, unit: SimulatedUnit, settings: SimulationSettings, _count: Count) -> list[str]:
    return plate_table(report, unit, bench_of(report), settings.random_generator(_PLATE))


FILES: dict[str, Callable[[Report, SimulatedUnit, SimulationSettings, Count], list[str]]] = {
    "weights": _weights_lines,
    "plate": _plate_lines,
    "ball": log_of_ball,
    "out": log_of_fruit,
}
"""For each file, by the name of its flag, the function that returns its lines."""
