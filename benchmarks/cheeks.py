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
    """Return a random fruit within the ranges of a design, and the change of the sensor's slope during the press.

    The modulus is uniform in its logarithm. The fruit is tilted by up to the largest tilt of a reading, in any
    direction. The slope changes by the returned values (2,) [rad] along x and y.
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
    """Return the forces [N] of a press, from first contact of the last tip to full travel, shape (READ, tips).

    Only SOLVED samples are computed, because each is a separate solution by boundary elements. The READ samples are
    interpolated between them. `drift` (2,) [rad] is the change of the sensor's slope during the press.
    """
    gaps = Pressing(sensor, fruit).nearest
    # The travel starts at the contact of the first tip, so the last tip touches at the difference of the gaps.
    last_touch = gaps.max() - gaps.min()
    full = design.press.travel_mm
    # The first sample lies 5 % of the remaining travel after the last touch, so that all forces are positive there.
    travels = np.linspace(last_touch + 0.05 * (full - last_touch), full, SOLVED)
    forces = press(sensor, fruit, travels, drift=drift)
    is_touching = (forces > 0.0).all(axis=1)
    # By Hertz's law F^(2/3) is nearly linear in the travel, so F^(2/3) is interpolated instead of F.
    spline = CubicSpline(travels[is_touching], forces[is_touching] ** (2.0 / 3.0))
    read_travels = np.linspace(travels[is_touching][0], travels[-1], READ)
    return np.maximum(spline(read_travels), 0.0) ** 1.5


def main() -> int:
    """Simulate and read the presses, and print the table row by row. Return the exit code.

    The exit code is 1 if an error exceeds `LARGEST_ERROR` or twice its error bar, else 0.
    """
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
        # A press that cannot be read has an infinite error, so that it fails the test.
        errors.append(math.inf if reading.E is None else reading.E / fruit.E - 1.0)
        bars.append(0.0 if reading.E is None else reading.u)
        print(row_text(fruit, reading, errors[-1]), *reading.flags, flush=True)
    return print_summary(np.abs(errors), np.array(bars))


def print_summary(sizes, bars):
    """Print how many errors lie within their error bars, and return the exit code, as `main` does.

    `sizes` (presses,) [1] are the absolute relative errors, and `bars` (presses,) [1] are the error bars.
    """
    inside_count, far_outside_count = np.sum(sizes <= bars), np.sum(sizes > 2.0 * bars)
    print(
        f"{len(sizes)} presses: largest error {100.0 * sizes.max():.2f} %, {inside_count} within their error bar, "
        f"{far_outside_count} beyond twice their bar"
    )
    return 0 if sizes.max() <= LARGEST_ERROR and not far_outside_count else 1


def row_text(fruit, reading, error):
    """Return the row of a press, with its columns under `HEADS`; a press that cannot be read has only the fruit.

    `error` is the relative error of the reading [1].
    """
    cells = f"{fruit.E:7.3f} {fruit.R1:5.1f} {fruit.R2:5.1f} {fruit.azimuth:7.1f} {fruit.tilt:5.2f}"
    if reading.E is None:
        return cells
    return f"{cells} {reading.E:6.3f} {100.0 * error:8.2f} {100.0 * reading.u:6.1f} {reading.offset:9.4f}"


if __name__ == "__main__":
    sys.exit(main())
