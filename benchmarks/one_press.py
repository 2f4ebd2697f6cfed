"""Errors that one press cannot detect: presses by independent boundary elements, read by a unit of a design.

`python -m benchmarks.one_press [DESIGN] [--rows NAME ...] [--count N] [--seed 1]` prints one row for each cause of
error. A row shows the relative change in E due to the cause, the error bar of the reading, and its flags. A row of many
presses shows how many errors are within their error bars, how many readings have a flag, and the largest ratio of an
error to its bar. Presses outside their bars without a flag are printed before that row.

The springs are as designed and known to 1 %, the forces have no noise, and the domes end at their rims. The unit is
calibrated on a ball if the design requires it.
"""

import argparse
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from instrument.calibrate.reference_presses import ReferenceBall, fit_ball_correction
from instrument.press.contrast_press import press_reading
from instrument.press.fruit_of_presses import fruit_answer
from instrument.press.fruit_reading import FruitReading
from instrument.press.measuring import MeasuringUnit
from instrument.press.touches import PressSamples
from instrument.simulate.unit import domes_of
from sensor.design.bench import RUBBER_POISSON
from sensor.design.fruits import FRUITS
from solve.presses.press_over_time import press_over_time
from solve.presses.pressed_bodies import EllipsoidFruit as Fruit
from solve.presses.pressed_bodies import FleshOnStone
from solve.presses.pressed_bodies import OuterLayer as Layer
from solve.presses.pressed_bodies import SprungDomes as Sensor
from solve.presses.pressing import Pressing, press
from tests.measured_units import MeasuredDesign

HeightMap = Callable[[np.ndarray, np.ndarray], np.ndarray]  # heights [mm] at x and y [mm]

MODULI = (0.7, 2.5)  # modulus of the fruit [MPa], well inside the range of the mango
SAMPLES = np.linspace(0.3, 1.0, 10)  # samples as fractions of the travel; with 24 of them E changes by 1 %
CELLS = 20  # cells per side of a grid; with 32 cells E changes by 0.1 %
HOLLOW_CELLS = 32  # cells per side on concave skin, where coarser grids do not converge at the rim of a dome
PRESS_S = 3.0  # duration of a press
# Fractions of the force that relax, and their time constants [s]; 42 % of the force remains, as in Tarocco oranges.
FLESH = ((0.25, 5.0), (0.33, 120.0))
TURNS = (0.0, 90.0, 45.0)  # rotations of the fruit between three presses [deg]
LOW, HIGH = 0, 1  # indices of a low and a high tip
TIPS = 4  # the designs have four tips in a square
WAVE_COUNT = 12  # number of plane waves in an uneven skin
UNEVEN_RMS = 0.016  # root mean square of the heights of an uneven skin [mm]
BALL_RADIUS = 40.0  # mm
BALL_TILTS = ((0.0, 0.0), (1.0, 40.0), (1.5, 200.0))  # tilts of the presses on the ball, and their azimuths [deg]


class Comparison(NamedTuple):
    """A reading compared with the true modulus: its signed relative error and its error bar [1], and its flags."""

    error: float
    bar: float
    flags: tuple[str, ...]

    @property
    def is_inside(self) -> bool:
        """Return whether the error is within the error bar."""
        return abs(self.error) <= self.bar


class Bench:
    """A unit of a design, and its sensor for the independent presses."""

    def __init__(self, name: str, seed: int) -> None:
        """Build the unit of the design called `name`, and calibrate it on a ball if the design requires it.

        `seed` is the seed of the random fruit.
        """
        measured = MeasuredDesign(name)
        self.design = measured.design
        unit = measured.measuring(percent=1.0, gain_percent=0.1)  # uncertainty of the springs and of the channels
        calibrated_by = "plate" if self.design.reading.on_plate else "weights"
        self.sensor = domes_of(measured.design, measured.K)  # presses the fruit
        self.rng = np.random.default_rng(seed)
        self.unit = replace(unit, unit=replace(unit.unit, calibrated_by=calibrated_by))  # reads the presses
        if self.design.reading.calibrated_by == "ball":
            self.unit = self.calibrate_on_ball(self.unit, self.design.reading.ball_percent)

    def calibrate_on_ball(self, before: MeasuringUnit, percent: float) -> MeasuringUnit:
        """Return a copy of the unit `before`, calibrated on a rubber ball.

        The modulus of the ball is known to `percent` [%]. The ball is pressed once at each of `BALL_TILTS`. The force
        depends on E / (1 - nu^2). Therefore the ball has the same E / (1 - nu^2) as a fruit whose E is the geometric
        mean of the unit's range.
        """
        middle_E = math.sqrt(math.prod(before.range_MPa))
        rubber_E = middle_E * (1.0 - RUBBER_POISSON**2) / (1.0 - self.design.fruit.poisson**2)
        ball = ReferenceBall(E_MPa=rubber_E, radius_mm=BALL_RADIUS, percent=percent)
        unit = before.for_ball(BALL_RADIUS)
        level = Fruit(E=rubber_E, R1=BALL_RADIUS, R2=BALL_RADIUS, poisson=RUBBER_POISSON)
        readings = []
        for tilt, azimuth in BALL_TILTS:
            readings.append(self.read(replace(level, tilt=tilt, tilt_azimuth=azimuth), unit=unit))
        correction = fit_ball_correction(readings, ball, before, "the ball")  # its name in messages
        return replace(before, unit=replace(before.unit, ball=correction))

    def mean_fruit(self, E: float, **changes: object) -> Fruit:
        """Return the mean fruit of the design with modulus E [MPa], smooth and level; `changes` set other fields."""
        ranges = self.design.reading
        R1, R2 = float(np.mean(ranges.radius_mm)), float(np.mean(ranges.radius_across_mm))
        return replace(Fruit(E=E, R1=R1, R2=R2, poisson=self.design.fruit.poisson), **changes)

    def random_fruit(self, **changes: object) -> Fruit:
        """Return a random fruit in a random pose within the ranges of the design; `changes` set other fields.

        The modulus is log-uniform, and the tilt is uniform in the plane of its two components.
        """
        ranges = self.design.reading
        rng = self.rng
        smallest_E = min(self.design.fruit.E_MPa)
        largest_E = self.design.fruit.largest_E_MPa
        fruit = Fruit(
            E=math.exp(rng.uniform(math.log(smallest_E), math.log(largest_E))),
            R1=rng.uniform(*ranges.radius_mm),
            R2=rng.uniform(*ranges.radius_across_mm),
            azimuth=rng.uniform(-90.0, 90.0),
            tilt=ranges.tilt_deg * math.sqrt(rng.uniform()),  # the root makes the density in the plane uniform
            tilt_azimuth=rng.uniform(0.0, 360.0),
            poisson=self.design.fruit.poisson,
        )
        return replace(fruit, **changes)

    def read(
        self,
        fruit: Fruit,
        sensor: Sensor | None = None,
        fractions: np.ndarray = SAMPLES,
        t: np.ndarray | None = None,
        *,
        unit: MeasuringUnit | None = None,
        cells: int = CELLS,
    ) -> FruitReading:
        """Return the reading of a press on a fruit, solved by independent boundary elements.

        The samples are at `fractions` (samples,) of the full travel [1]. If their times `t` (samples,) [s] are given,
        the flesh relaxes as in `FLESH`. Otherwise the flesh is elastic, and the speed is constant. `sensor` presses the
        fruit, and `unit` reads the press; both are by default those of the bench. The grids have `cells` per side.
        """
        sensor = sensor or self.sensor
        unit = unit or self.unit
        travels = self.design.press.travel_mm * fractions
        if t is None:
            times = PRESS_S * fractions
            forces = press(sensor, fruit, travels, cells)
        else:
            times = t
            forces = press_over_time(sensor, fruit, travels, t, FLESH, cells)
        # The unit reads only samples at which all tips touch.
        touching = (forces > unit.least_forces).all(axis=1)
        samples = PressSamples(channels=forces[touching], tips=len(sensor.K), t=times[touching], touched_s=0.0)
        return press_reading(unit, samples)

    def compare(self, E: float, reading: FruitReading) -> Comparison:
        """Return a reading compared with the true modulus E [MPa]; the error is infinite if no modulus was read."""
        if reading.E is None:
            return Comparison(math.inf, 0.0, reading.flags)
        return Comparison(reading.E / E - 1.0, reading.u, reading.flags)


def value_at_tip(tip: int, value: float, otherwise: float) -> tuple[float, ...]:
    """Return a tuple with an entry for each of the four tips: `value` at the index `tip`, and `otherwise` elsewhere."""
    return tuple(value if index == tip else otherwise for index in range(TIPS))


def random_waves(rng: np.random.Generator, rms: float, length: float) -> HeightMap:
    """Return a height map [mm]: the sum of `WAVE_COUNT` plane waves with random directions and phases.

    `length` [mm] is the length of all waves, and `rms` [mm] is the root mean square of the sum.
    """
    angles, phases = rng.uniform(0.0, 2.0 * math.pi, (2, WAVE_COUNT))  # [rad]
    k_x, k_y = 2.0 * math.pi / length * np.array([np.cos(angles), np.sin(angles)])  # wave vectors [1/mm]

    def heights(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        total = np.zeros(np.broadcast(x, y).shape)
        for wave_x, wave_y, phase in zip(k_x, k_y, phases, strict=True):
            total += np.cos(wave_x * x + wave_y * y + phase)
        # The mean square of a cosine is 1/2, so the root mean square of the sum of n waves is sqrt(n / 2).
        return rms * math.sqrt(2.0 / len(phases)) * total

    return heights


def random_asymmetry(rng: np.random.Generator, largest: float = 0.3) -> HeightMap:
    """Return a height map [mm] with one random term r^3 cos(m a) and one r^4 cos(n a) in polar coordinates r, a.

    Such terms make a fruit asymmetric, because an ellipsoid has only terms of second order. m is 1 or 3, and n is 0, 2
    or 4. The direction a = 0 of each term is random. Each term is at most `largest` [mm] at a radius of 6 mm.
    """
    cubic_height, quartic_height = rng.uniform(-largest, largest, 2)
    directions = rng.uniform(0.0, 2.0 * math.pi, 2)  # direction a = 0 of each term [rad]
    m = rng.choice([1, 3])
    n = rng.choice([0, 2, 4])

    def heights(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        r = np.hypot(x, y) / 6.0  # 1 at a radius of 6 mm
        angle = np.arctan2(y, x)
        cubic = cubic_height * r**3 * np.cos(m * (angle - directions[0]))
        return cubic + quartic_height * r**4 * np.cos(n * (angle - directions[1]))

    return heights


def rotate_heights(heights: HeightMap, degrees: float) -> HeightMap:
    """Return a height map that is rotated anticlockwise about the axis of the sensor by an angle in `degrees`."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return lambda x, y: heights(c * x + s * y, c * y - s * x)


Case = tuple[str, dict, Sensor]
"""The name of a fault, the changes of the mean fruit that cause it, and the sensor that presses this fruit."""


def bruises(bench: Bench) -> Iterator[Case]:
    """Yield bruises under one tip: hemispheres of half the modulus, with a radius of 6 or 3 mm."""
    for radius in (6.0, 3.0):
        for name, tip in (("low", LOW), ("high", HIGH)):
            bruise = {"softness": value_at_tip(tip, 2.0, 1.0), "soft_radius": value_at_tip(tip, radius, math.inf)}
            yield f"radius {radius:g} mm, under a {name} tip", bruise, bench.sensor


def soft_flesh(bench: Bench) -> Iterator[Case]:
    """Yield flesh with 0.8 of the modulus under one tip."""
    for name, tip in (("low", LOW), ("high", HIGH)):
        yield f"under a {name} tip", {"softness": value_at_tip(tip, 1.25, 1.0)}, bench.sensor


def single_bumps(bench: Bench) -> Iterator[Case]:
    """Yield Gaussian bumps of the skin, each under a high tip."""
    x0, y0 = bench.sensor.positions[HIGH]
    for height, sigma in ((0.05, 0.8), (0.05, 1.5), (0.05, 3.0), (0.02, 0.8)):

        def bump(x, y, height=height, sigma=sigma):
            return height * np.exp(-0.5 * ((x - x0) ** 2 + (y - y0) ** 2) / sigma**2)

        yield f"{height:g} mm, sigma {sigma:g} mm", {"bumps": bump}, bench.sensor


def uneven_skins(bench: Bench) -> Iterator[Case]:
    """Yield skins with random waves of the height `UNEVEN_RMS`, three skins for each wavelength."""
    for length in (2.0, 4.0, 8.0):
        for number in (1, 2, 3):
            waves = random_waves(bench.rng, UNEVEN_RMS, length)
            yield f"waves of {length:g} mm, {number}", {"bumps": waves}, bench.sensor


def dome_forms(bench: Bench) -> Iterator[Case]:
    """Yield form errors of all domes: Gaussian caps of 0.02 mm, flat or pointed, and radii changed by 10 %."""
    sensor = bench.sensor
    for name, height in (("cap flat by 0.02 mm", -0.02), ("cap pointed by 0.02 mm", 0.02)):

        def form(s, height=height):
            return height * np.exp(-0.5 * s**2)

        yield name, {}, replace(sensor, form=form)
    for factor in (0.9, 1.1):
        yield f"radius times {factor:g}", {}, replace(sensor, dome_radius=factor * sensor.dome_radius)


def outer_layers(bench: Bench) -> Iterator[Case]:
    """Yield outer layers of 2 mm, twice or half as stiff as the flesh below them."""
    for stiffness in (2.0, 0.5):
        layer = Layer(2.0, stiffness, bench.design.fruit.poisson)
        yield f"{stiffness:g} times as stiff", {"layer": layer}, bench.sensor


def extreme_cheeks(bench: Bench) -> Iterator[Case]:
    """Yield fruit with principal radii outside the range of the design."""
    for radii in ((34.0, 80.0), (34.0, 180.0), (63.0, 80.0), (63.0, 180.0)):
        yield f"{radii[0]:g} by {radii[1]:g} mm", {"R1": radii[0], "R2": radii[1]}, bench.sensor


# The function that yields the cases of each cause of error.
SINGLE = {
    "bruise": bruises,
    "soft_tip": soft_flesh,
    "uneven": uneven_skins,
    "bump": single_bumps,
    "dome": dome_forms,
    "layers": outer_layers,
    "cheeks": extreme_cheeks,
}


def yielding_flesh(bench: Bench) -> Iterator[tuple[str, Comparison]]:
    """Yield the name of each case of flesh that yields at a pressure, and its reading compared with elastic flesh.

    The yield pressure is 0.8 or 1.1 times the largest mean pressure under a tip, on elastic flesh at full travel.
    """
    for E in MODULI:
        fruit = bench.mean_fruit(E)
        elastic = Pressing(bench.sensor, fruit)
        mean_pressure = (elastic.forces(bench.design.press.travel_mm) / elastic.area).max()  # the largest of all tips
        elastic_E = bench.read(fruit).E
        for fraction in (0.8, 1.1):
            reading = bench.read(replace(fruit, yields=fraction * mean_pressure))
            yield f"at {fraction:g} of the mean, {E:g} MPa", bench.compare(elastic_E, reading)


Pace = tuple[np.ndarray, np.ndarray]
"""The samples of a press: fractions of the travel [1], and times [s]."""
PACE_FRACTIONS = np.linspace(0.1, 1.0, 19)  # fractions of the travel at which a press without a pause is sampled [1]


def pace_with_pause(stop: float, seconds: float) -> Pace:
    """Return the samples of a press that pauses for `seconds` at the fraction `stop` of its travel."""
    fractions = PACE_FRACTIONS
    t = PRESS_S * fractions  # times without the pause
    last = int(np.searchsorted(fractions, stop))  # index of the last sample before the pause
    pause_t = t[last] + seconds * np.arange(1, 5) / 4.0  # four samples in the pause
    pause_fractions = np.full(4, fractions[last])
    all_fractions = np.insert(fractions, last + 1, pause_fractions)
    all_t = np.concatenate([t[: last + 1], pause_t, t[last + 1 :] + seconds])
    return all_fractions, all_t


def pace_with_change(start: float, factor: float) -> Pace:
    """Return the samples of a press that takes `factor` times as long per travel beyond the fraction `start`."""
    fractions = PACE_FRACTIONS
    return fractions, PRESS_S * (np.minimum(fractions, start) + factor * np.maximum(fractions - start, 0.0))


STEADY_PACE = pace_with_change(1.0, 1.0)  # the pace does not change before the end of the travel


def uneven_paces(bench: Bench) -> Iterator[tuple[str, Comparison]]:
    """Yield the name of each press at an uneven pace, and its reading compared with a press at a steady pace.

    In all these presses, the flesh relaxes as in `FLESH`.
    """
    paces = (
        ("pause of 2 s at 0.8", pace_with_pause(0.8, 2.0)),
        ("a third as fast from 0.6", pace_with_change(0.6, 3.0)),
        ("twice the time", pace_with_change(0.0, 2.0)),
    )
    for E in MODULI:
        fruit = bench.mean_fruit(E)
        steady_E = bench.read(fruit, None, *STEADY_PACE).E
        for name, pace in paces:
            yield f"{name}, {E:g} MPa", bench.compare(steady_E, bench.read(fruit, None, *pace))


def random_paces(bench: Bench, count: int) -> Iterator[Comparison]:
    """Yield `count` readings of random fruit, alternately with a change of pace and with a pause.

    The flesh relaxes as in `FLESH`. Each reading is compared with a press of the same fruit at a steady pace. The pace
    changes or pauses at a random fraction of the travel, from 0.4 to 0.9. A changed pace is a third to three times the
    steady one, and a pause lasts 0.3 to 3 s.
    """
    for number in range(count):
        fruit = bench.random_fruit()
        steady_E = bench.read(fruit, None, *STEADY_PACE).E
        fraction = bench.rng.uniform(0.4, 0.9)
        if number % 2:
            pace = pace_with_pause(fraction, bench.rng.uniform(0.3, 3.0))
        else:
            pace = pace_with_change(fraction, 3.0 ** bench.rng.uniform(-1.0, 1.0))
        yield bench.compare(steady_E, bench.read(fruit, None, *pace))


def is_hollow(bench: Bench, fruit: Fruit) -> bool:
    """Return whether a dome touches skin with a mean curvature below 0 (concave), or touches with its rim."""
    x, y = Pressing(bench.sensor, fruit).touch.T  # points of first touch, one per tip [mm]
    step = 0.05  # step of the difference quotients, and margin at the rim [mm]
    bumps = fruit.bumps(x, y)
    neighbours = sum(fruit.bumps(x + dx, y + dy) for dx, dy in ((step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)))
    # The mean curvature of a height map is half its Laplacian, here by the five-point formula. Heights are measured
    # outwards, so a negative Laplacian makes the skin more convex.
    curvature = 0.5 * np.trace(fruit.curvature) - 0.5 * (neighbours - 4.0 * bumps) / step**2
    off_axis = np.hypot(*(np.stack([x, y], axis=1) - bench.sensor.positions).T)
    return bool((curvature < 0.0).any() or (off_axis > bench.sensor.rim - step).any())


def asymmetric_fruit(bench: Bench, count: int) -> Iterator[Comparison]:
    """Yield `count` readings of fruit with terms of third and fourth order in its shape.

    Fruit that is concave under a tip, or that touches the rim of a dome, is not counted. After the last reading, the
    readings of such fruit are printed in a row of their own.
    """
    hollow: list[Comparison] = []
    yielded_count = 0
    while yielded_count < count:
        fruit = bench.random_fruit(bumps=random_asymmetry(bench.rng))
        comparison = bench.compare(fruit.E, bench.read(fruit, cells=HOLLOW_CELLS))
        if is_hollow(bench, fruit):
            hollow.append(comparison)
        else:
            yielded_count += 1
            yield comparison
    if hollow:
        print_many("shapes, hollow under a tip", hollow)


def read_three_presses(bench: Bench, fruit: Fruit, changes: list[dict]) -> Comparison:
    """Return the modulus from three presses on a fruit, compared with the true modulus.

    Between the presses the fruit is rotated as in `TURNS`. `changes` holds the changed fields of the fruit in each
    press. The error is infinite if no modulus was read.
    """
    readings = []
    for turn, changed_fields in zip(TURNS, changes, strict=True):
        turned_fruit = replace(fruit, azimuth=fruit.azimuth + turn, **changed_fields)
        readings.append(bench.read(turned_fruit))
    answer = fruit_answer(bench.unit, readings, "1")
    error = math.inf if answer.E is None else answer.E / fruit.E - 1.0
    return Comparison(error, answer.u or 0.0, answer.flags)


def three_uneven(bench: Bench, count: int) -> Iterator[Comparison]:
    """Yield `count` answers from three presses each, on skins with random waves of the height `UNEVEN_RMS`.

    The wavelength of a skin is random, from 2 to 8 mm. The skin turns with the fruit.
    """
    for _ in range(count):
        heights = random_waves(bench.rng, UNEVEN_RMS, bench.rng.uniform(2.0, 8.0))
        changes = [{"bumps": rotate_heights(heights, turn)} for turn in TURNS]
        yield read_three_presses(bench, bench.random_fruit(), changes)


def bruised_fruit(bench: Bench, count: int, tip_steps: tuple[int | None, ...]) -> Iterator[Comparison]:
    """Yield `count` answers from three presses each, on random fruit with a bruise.

    The bruise is a hemisphere of radius 6 mm with half the modulus. `tip_steps` states for each press which tip is over
    the bruise, counted from a random tip. None means that no tip is over it.
    """
    for _ in range(count):
        first_tip = int(bench.rng.integers(TIPS))
        changes = []
        for step in tip_steps:
            if step is None:
                changes.append({})
            else:
                tip = (first_tip + step) % TIPS  # the tips are numbered around the square
                changes.append({"softness": value_at_tip(tip, 2.0, 1.0), "soft_radius": (6.0,) * TIPS})
        yield read_three_presses(bench, bench.random_fruit(), changes)


def real_cheeks(bench: Bench, count: int) -> Iterator[Comparison]:
    """Yield readings of real fruit whose principal radii are outside the ranges of the design.

    `count` fruits with a stone are drawn. Fruits with radii within the ranges are not yielded. After the last reading,
    they are printed in a row of their own. A further row repeats the other presses with the mean radius known to the
    unit.
    """
    design = bench.design
    real = FRUITS[design.name]
    stone = FleshOnStone(design.fruit.thickness_mm, design.fruit.poisson)
    ranges = (design.reading.radius_mm, design.reading.radius_across_mm)
    within_ranges: list[Comparison] = []
    known_radius: list[Comparison] = []
    for _ in range(count):
        radii = bench.rng.uniform(*real.radius_mm), bench.rng.uniform(*real.radius_across_mm)
        fruit = bench.random_fruit(R1=radii[0], R2=radii[1], layer=stone)
        comparison = bench.compare(fruit.E, bench.read(fruit))
        if all(low <= radius <= high for radius, (low, high) in zip(radii, ranges, strict=True)):
            within_ranges.append(comparison)
            continue
        yield comparison
        mean_radius = 2.0 / (1.0 / radii[0] + 1.0 / radii[1])  # the radius of the mean curvature
        informed_unit = replace(bench.unit, radii_mm=(mean_radius, mean_radius))
        known_radius.append(bench.compare(fruit.E, bench.read(fruit, unit=informed_unit)))
    if within_ranges:
        print_many("real cheeks within the ranges of the design", within_ranges)
    print_many("real cheeks outside these ranges, with the mean radius known", known_radius)


# The position of a row in this dict seeds its random numbers, so the order must not change.
MANY: dict[str, tuple[Callable[[Bench, int], Iterator[Comparison]], int]] = {
    "paces": (random_paces, 60),
    "shapes": (asymmetric_fruit, 300),
    "three_uneven": (three_uneven, 100),
    # After a quarter turn the next tip is over the bruise; after a rotation of 45 degrees, no tip is.
    "three_bruised": (partial(bruised_fruit, tip_steps=(0, 1, None)), 100),
    "real_cheeks": (real_cheeks, 60),
    "once_bruised": (partial(bruised_fruit, tip_steps=(0, None, None)), 100),
}
"""The function that yields the readings of each row, and the usual number of readings."""
LISTS = {"yields": yielding_flesh, "pace": uneven_paces}
"""The function that yields the name and the comparison of each case of a row."""


def print_single(bench: Bench, name: str) -> None:
    """Print the change in E due to each case of the cause called `name`, for each modulus.

    The change is relative to the reading of the mean fruit without this cause.
    """
    for E in MODULI:
        smooth_E = bench.read(bench.mean_fruit(E)).E
        for case, changes, sensor in SINGLE[name](bench):
            reading = bench.read(bench.mean_fruit(E, **changes), sensor)
            print_row(f"{name}: {case}, {E:g} MPa", bench.compare(smooth_E, reading))


def print_row(name: str, comparison: Comparison) -> None:
    """Print the row of one reading: its error, its error bar, whether the error is within the bar, and its flags.

    An error outside its bar without a flag is a failure of the reading, so it stands out in capitals.
    """
    error, bar, flags = comparison
    outcome = "flagged" if flags else "OUTSIDE"
    if comparison.is_inside:
        outcome = "inside"
    print(f"| {name} | {100.0 * error:+.1f} % | {100.0 * bar:.1f} % | {outcome} | {', '.join(flags)} |", flush=True)


def print_many(name: str, comparisons: Iterable[Comparison]) -> None:
    """Print the row of many presses, after a row for each press that is outside its error bar without a flag."""
    presses = []
    for number, comparison in enumerate(comparisons, start=1):
        presses.append(comparison)
        if not comparison.is_inside and not comparison.flags:
            print_row(f"{name}: press {number}", comparison)
    print(summary_row(name, presses) if presses else f"| {name} | none |", flush=True)


def summary_row(name: str, presses: Sequence[Comparison]) -> str:
    """Return the row of many presses, with at least one.

    The row shows how many errors are within their error bars, how many readings have a flag and how many have no
    modulus. The mean, the median and the largest error follow, and the median of the error bars.
    """
    inside = sum(press.is_inside for press in presses)
    flagged_outside = sum(bool(press.flags) and not press.is_inside for press in presses)
    flagged = sum(bool(press.flags) for press in presses)
    largest_ratio = max((abs(press.error) / press.bar for press in presses if not press.flags), default=0.0)
    # The error is infinite if no modulus was read.
    errors = 100.0 * np.array([press.error for press in presses if math.isfinite(press.error)])
    absolute_errors = np.abs(errors)
    median_bar = 100.0 * np.median([press.bar for press in presses])
    return (
        f"| {name} | {len(presses)} | {inside} inside, {flagged_outside} flagged outside, {flagged} flagged in all, "
        f"{len(presses) - len(errors)} without a modulus | "
        f"largest error without a flag {largest_ratio:.2f} times its bar | "
        f"mean error {errors.mean():+.1f} %, median {np.median(absolute_errors):.1f} % and largest "
        f"{absolute_errors.max():.1f} % in magnitude, median bar {median_bar:.1f} % |"
    )


def main() -> int:
    """Print the rows that the command line requests, by default all rows, and return the exit code 0."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("design", nargs="?", default="mango")
    names = [*SINGLE, *LISTS, *MANY]
    parser.add_argument("--rows", nargs="+", choices=names, default=names)
    parser.add_argument("--count", type=int, help="number of presses in each row of many")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    bench = Bench(options.design, options.seed)
    for name in options.rows:
        if name in SINGLE:
            print_single(bench, name)
        elif name in LISTS:
            for case, comparison in LISTS[name](bench):
                print_row(f"{name}: {case}", comparison)
        else:
            comparisons, usual_count = MANY[name]
            bench.rng = np.random.default_rng([options.seed, list(MANY).index(name)])  # independent of earlier rows
            print_many(name, comparisons(bench, options.count or usual_count))
    return 0


if __name__ == "__main__":
    sys.exit(main())
