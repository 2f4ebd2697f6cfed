"""Random presses of a square of domes: boundary elements compute the forces, and a calibrated unit reads them.

`python -m benchmarks.cheeks DESIGN [--count 27] [--seed 1]` prints a table row by row. It exits with 1 if the error of
a reading exceeds 6 % or twice its error bar. The boundary elements (`solve/presses`) share no code with the law that
reads. The flesh is a half-space, the springs are as designed, and the forces have no noise.
"""

import argparse
import math
import sys

import numpy as np
from scipy.interpolate import CubicSpline

from instrument.press.contrast_press import press_reading
from instrument.press.touches import PressSamples
from instrument.simulate.unit import domes_of
from solve.presses.pressed_bodies import EllipsoidFruit
from solve.presses.pressing import Pressing, press
from tests.measured_units import MeasuredDesign

SOLVED = 10  # number of samples of a press that are computed
READ = 40  # number of samples that are read; they are interpolated between the computed samples
LARGEST_ERROR = 0.06  # largest allowed relative error of a reading
HEADS = "  E MPa    R1    R2 azimuth  tilt   read  error %  bar %  gamma mm"


def random_point_in_disc(rng, radius):
    """Return a random point (2,) of a disc about the origin, uniform in area."""
    angle = rng.uniform(0.0, 2.0 * math.pi)
    return radius * math.sqrt(rng.uniform()) * np.array([math.cos(angle), math.sin(angle)])


def random_press(design, rng):
    """Return a random fruit within the ranges of a design, and the change of the sensor's slope in the press (2,).

    Moduli are uniform in their logarithm. The slope changes by the returned value [rad] along x and y.
    """
    ranges = design.reading
    tilt = random_point_in_disc(rng, ranges.tilt_deg)
    fruit = EllipsoidFruit(
        E=math.exp(rng.uniform(*np.log([min(design.fruit.E_MPa), design.fruit.E_max_MPa]))),
        R1=rng.uniform(*ranges.radius_mm),
        R2=rng.uniform(*ranges.radius_across_mm),
        azimuth=rng.uniform(-90.0, 90.0),
        tilt=float(np.hypot(*tilt)),
        tilt_azimuth=math.degrees(math.atan2(tilt[1], tilt[0])),
        apex=tuple(random_point_in_disc(rng, ranges.off_centre_mm)),
        poisson=design.fruit.poisson,
    )
    # The flesh thickness is not used. It is drawn so that a seed still gives the fruits in docs/measurements.md.
    rng.uniform()
    return fruit, np.radians(random_point_in_disc(rng, ranges.tilt_change_deg))


def press_forces(design, sensor, fruit, drift):
    """Return the forces [N] of a press, from first contact of the last tip to full travel, shape (READ, tips)."""
    gaps = Pressing(sensor, fruit).nearest
    last_touch = gaps.max() - gaps.min()
    full = design.press.travel_mm
    travels = np.linspace(last_touch + 0.05 * (full - last_touch), full, SOLVED)
    forces = press(sensor, fruit, travels, drift=drift)
    touching = (forces > 0.0).all(axis=1)
    # By Hertz's law F^(2/3) is nearly linear in the travel, so F^(2/3) is interpolated instead of F.
    spline = CubicSpline(travels[touching], forces[touching] ** (2.0 / 3.0))
    return np.maximum(spline(np.linspace(travels[touching][0], travels[-1], READ)), 0.0) ** 1.5


def main() -> int:
    """Simulate and read the presses, and print the table. Return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("design")
    parser.add_argument("--count", type=int, default=27)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    measured = MeasuredDesign(options.design)
    unit = measured.measuring()
    sensor = domes_of(measured.design, measured.K)
    rng = np.random.default_rng(options.seed)
    print(HEADS, flush=True)
    errors, bars = [], []
    for fruit, drift in [random_press(measured.design, rng) for _ in range(options.count)]:
        forces = press_forces(measured.design, sensor, fruit, drift)
        reading = press_reading(unit, PressSamples.of_forces(forces))
        cells = f"{fruit.E:7.3f} {fruit.R1:5.1f} {fruit.R2:5.1f} {fruit.azimuth:7.1f} {fruit.tilt:5.2f}"
        if reading.E is None:
            errors.append(math.inf)
            bars.append(0.0)
        else:
            errors.append(reading.E / fruit.E - 1.0)
            bars.append(reading.u)
            cells += f" {reading.E:6.3f} {100.0 * errors[-1]:8.2f} {100.0 * reading.u:6.1f} {reading.offset:9.4f}"
        print(cells, *reading.flags, flush=True)
    sizes = np.abs(errors)
    inside, outside_twice = np.sum(sizes <= bars), np.sum(sizes > 2.0 * np.array(bars))
    print(
        f"{len(sizes)} presses: largest error {100.0 * sizes.max():.2f} %, {inside} within their error bar, "
        f"{outside_twice} beyond twice their bar"
    )
    return 0 if sizes.max() <= LARGEST_ERROR and not outside_twice else 1


if __name__ == "__main__":
    sys.exit(main())
