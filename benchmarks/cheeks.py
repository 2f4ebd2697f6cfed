"""Random presses of a square, with forces from independent models, read by a calibrated unit.

`python -m benchmarks.cheeks DESIGN [--by solids|elements] [--count 27] [--seed 1] [--skip 0]` prints a table row by
row. It exits with 1 if the error of a reading exceeds 6 % or twice its bar. Forces have no noise, and springs are as
designed. Forces are from solids at finite strain over a stone (`reference/pressed_solids.py`, about 75 CPU seconds
each), or from boundary elements on a half-space (`solve/presses`, a second each).
"""

import argparse
import math
import sys
import time
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from instrument.press.contrast_press import press_reading
from instrument.press.touches import PressSamples
from instrument.simulate.unit import domes_of
from reference import pressed_solids
from solve.presses import pressing
from solve.presses.pressed_bodies import EllipsoidFruit
from tests.measured_units import MeasuredDesign

SOLVED = 10  # solved samples of a press
READ = 40  # samples for the reading, interpolated between solved ones
LARGEST = 0.06  # largest relative error of a reading
HEADS = "  E MPa    R1    R2 azimuth  tilt flesh   read  error %  bar %  gamma mm      s"


@dataclass(frozen=True)
class DrawnPress:
    """A fruit under a sensor, the thickness of its flesh [mm], and the change of the slope in the press, (2,) [rad]."""

    fruit: EllipsoidFruit
    thickness: float
    drift: np.ndarray


def in_disc(rng, radius):
    """Return a random point of a disc about the origin, uniform in area."""
    angle = rng.uniform(0.0, 2.0 * math.pi)
    return radius * math.sqrt(rng.uniform()) * np.array([math.cos(angle), math.sin(angle)])


def drawn_press(design, rng):
    """Return a press on a random fruit within the ranges of a design; moduli are uniform in their logarithm."""
    asked = design.reading
    tilt = in_disc(rng, asked.tilt_deg)
    fruit = EllipsoidFruit(
        E=math.exp(rng.uniform(*np.log([min(design.fruit.E_MPa), design.fruit.E_max_MPa]))),
        R1=rng.uniform(*asked.radius_mm),
        R2=rng.uniform(*asked.radius_across_mm),
        azimuth=rng.uniform(-90.0, 90.0),
        tilt=float(np.hypot(*tilt)),
        tilt_azimuth=math.degrees(math.atan2(tilt[1], tilt[0])),
        apex=tuple(in_disc(rng, asked.off_centre_mm)),
        poisson=design.fruit.poisson,
    )
    return DrawnPress(fruit, rng.uniform(*asked.thickness_mm), np.radians(in_disc(rng, asked.tilt_change_deg)))


def press_forces(by, design, sensor, drawn):
    """Return the forces of a press from the touch of all tips to the full travel, (READ, tips) [N]."""
    travels = pressed_solids.rising_travels(sensor, drawn.fruit, design.press.travel_mm, SOLVED)
    if by == "solids":
        piece = pressed_solids.Piece(plan=design.fruit.length_mm, thickness=drawn.thickness)
        forces = pressed_solids.press(sensor, drawn.fruit, travels, piece, drift=drawn.drift)
    else:
        forces = pressing.press(sensor, drawn.fruit, travels, drift=drawn.drift)
    touching = (forces > 0.0).all(axis=1)
    # F^(2/3) is nearly linear in the travel, so it is interpolated instead of F.
    between = CubicSpline(travels[touching], forces[touching] ** (2.0 / 3.0))
    return np.maximum(between(np.linspace(travels[touching][0], travels[-1], READ)), 0.0) ** 1.5


def reading_of(unit, forces):
    """Return the reading of a unit from the forces of a press, (samples, tips) [N]."""
    return press_reading(unit, PressSamples.of_forces(forces))


def main() -> int:
    """Press, read, and print the table; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("design")
    parser.add_argument("--by", choices=("solids", "elements"), default="solids")
    parser.add_argument("--count", type=int, default=27)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--skip", type=int, default=0, help="of the count, presses that another run has read")
    asked = parser.parse_args()
    measured = MeasuredDesign(asked.design)
    unit = measured.measuring()
    sensor = domes_of(measured.design, measured.K)
    rng = np.random.default_rng(asked.seed)
    presses = [drawn_press(measured.design, rng) for _ in range(asked.count)]
    print(HEADS, flush=True)
    errors, bars = [], []
    for drawn in presses[asked.skip :]:
        start = time.process_time()
        found = reading_of(unit, press_forces(asked.by, measured.design, sensor, drawn))
        seconds = time.process_time() - start
        fruit = drawn.fruit
        shape = (
            f"{fruit.E:7.3f} {fruit.R1:5.1f} {fruit.R2:5.1f} {fruit.azimuth:7.1f} {fruit.tilt:5.2f} "
            f"{drawn.thickness:5.1f}"
        )
        if found.E is None:
            errors.append(math.inf)
            bars.append(0.0)
            print(shape, *found.flags, f"{seconds:.0f} s", flush=True)
            continue
        errors.append(found.E / fruit.E - 1.0)
        bars.append(found.u)
        row = f"{found.E:6.3f} {100.0 * errors[-1]:8.2f} {100.0 * found.u:6.1f} {found.offset:9.4f} {seconds:6.0f}"
        print(shape, row, *found.flags, flush=True)
    off = np.abs(errors)
    largest, inside, beyond = off.max(), np.sum(off <= bars), np.sum(off > 2.0 * np.array(bars))
    print(
        f"{len(off)} presses: largest error {100.0 * largest:.2f} %, {inside} inside their bar, {beyond} beyond twice"
    )
    return 0 if largest <= LARGEST and not beyond else 1


if __name__ == "__main__":
    sys.exit(main())
