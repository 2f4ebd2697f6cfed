"""Readings of units with form errors of their domes, before and after calibration on a reference ball.

`python -m benchmarks.dome_form [DESIGN] [--count 60] [--seed 1]` prints the number of readings inside their bars. Each
unit has another radius of its domes and another cap, equal on all tips, with the errors of its process. Forces come
from boundary elements, which share nothing with the law. Springs are known, and forces have no noise.
"""

import argparse
import math
import sys
from dataclasses import replace

import numpy as np

from benchmarks.harness import table
from benchmarks.one_press import BALL_RADIUS, Bench
from instrument.press.measuring import MeasuringUnit
from instrument.simulate.unit import drawn_form
from solve.presses.pressed_bodies import EllipsoidFruit

NEAR = 0.02  # relative error of E that is also counted on a fruit with the radius of the ball
HEADS = ["presses", "inside the bar", "rms error %", "farthest, in bars"]


class Unit:
    """A bench with form errors of its domes: of their radius and of their caps."""

    def __init__(self, bench: Bench) -> None:
        """Draw the form errors; half the accuracy of the process is one standard deviation of outlines."""
        self.bench = bench
        self.sensor = drawn_form(bench.design, bench.sensor, bench.rng)

    def error(self, fruit: EllipsoidFruit, by: MeasuringUnit) -> tuple[float, float]:
        """Return the relative error and the bar of a reading of a fruit by a unit [1]; infinite without a reading."""
        self.bench.unit = by
        found = self.bench.read(fruit, self.sensor)
        return (math.inf, 0.0) if found.E is None or found.u is None else (found.E / fruit.E - 1.0, found.u)


def row_of(name: str, found: list[tuple[float, float]], limit: float | None = None) -> list[str]:
    """Return a row of the table from errors and bars [1]; a limit replaces the bars."""
    errors = np.abs([error for error, _ in found])
    bars = np.array([bar if limit is None else limit for _, bar in found])
    inside = f"{int((errors <= bars).sum())} of {len(found)}"
    return [name, inside, f"{100.0 * math.sqrt(np.square(errors).mean()):.2g}", f"{(errors / bars).max():.2g}"]


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("design", nargs="?", default="mango")
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    bench = Bench(arguments.design, arguments.seed)
    # The fruits are even, because bars for uneven ones would hide the effect of the domes.
    rows_of_report = tuple(replace(row, fruit=None) for row in bench.unit.report.moduli)
    known = replace(bench.before_ball, report=replace(bench.unit.report, moduli=rows_of_report))
    bench.before_ball = known
    least, largest = known.range_MPa
    middle = math.sqrt(least * largest)
    rows: dict[str, list[tuple[float, float]]] = {}
    for _ in range(arguments.count):
        unit = Unit(bench)
        drawn = bench.drawn()
        after = bench.after_ball(unit.sensor, percent=0.0)
        of_ball = EllipsoidFruit(E=middle, R1=BALL_RADIUS, R2=BALL_RADIUS, poisson=bench.design.fruit.poisson)
        told = replace(after, radii_mm=(BALL_RADIUS, BALL_RADIUS))
        rows.setdefault("before a ball", []).append(unit.error(drawn, known))
        rows.setdefault("after a ball, fruits of the design", []).append(unit.error(drawn, after))
        rows.setdefault("after a ball, fruit as round, as firm", []).append(unit.error(of_ball, told))
        for E in (least, largest):
            name = f"after a ball, fruit as round, {E:g} MPa"
            rows.setdefault(name, []).append(unit.error(replace(of_ball, E=E), told))
    cells = []
    for name, found in rows.items():
        cells.append(row_of(name, found))
        if "as round" in name:
            cells.append(row_of(f"{name}, within {100.0 * NEAR:g} %", found, NEAR))
    print(table(HEADS, cells))
    return 0


if __name__ == "__main__":
    sys.exit(main())
