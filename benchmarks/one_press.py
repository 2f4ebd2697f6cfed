"""Errors that one press cannot detect: presses by independent boundary elements, read by a unit of a design.

`python -m benchmarks.one_press [DESIGN] [--rows NAME ...] [--count N] [--seed 1]` prints rows for causes of error. A
row has the change of E by the cause, the bar of the reading and its flags. A row of many presses has the numbers of
presses inside their bars and of flagged ones, and the largest error in bars. Presses outside their bars without a flag
are printed before it.

Springs are as designed and known to 1 %, forces have no noise, and domes end at their rims. The unit is calibrated on a
ball if the design says so.
"""

import argparse
import math
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from instrument.calibrate.reference_presses import ReferenceBall, correction_of
from instrument.press.contrast_press import press_reading
from instrument.press.fruit_of_presses import fruit_answer
from instrument.press.fruit_reading import FruitReading
from instrument.press.measuring import MeasuringUnit
from instrument.press.touches import PressSamples
from instrument.simulate.unit import domes_of
from sensor.design.bench import RUBBER_POISSON
from sensor.design.fruits import FRUITS
from solve.presses.over_time import press_over_time
from solve.presses.pressed_bodies import EllipsoidFruit as Fruit
from solve.presses.pressed_bodies import FleshOnStone
from solve.presses.pressed_bodies import OuterLayer as Layer
from solve.presses.pressed_bodies import SprungDomes as Sensor
from solve.presses.pressing import Pressing, press
from tests.measured_units import MeasuredDesign

MODULI = (0.7, 2.5)  # MPa, well inside the range of the mango
WAY = np.linspace(0.3, 1.0, 10)  # samples as shares of the travel; with 24 samples E changes by 1 %
CELLS = 20  # cells of a grid in each direction; with 32 cells E changes by 0.1 %
HOLLOW_CELLS = 32  # cells for contacts in hollows, where coarser grids do not converge at the rim of a dome
PRESS_S = 3.0  # duration of a press
FLESH = ((0.25, 5.0), (0.33, 120.0))  # relaxation (share, time [s]) with 42 % left, as for Tarocco oranges
TURNS = (0.0, 90.0, 45.0)  # rotations of the fruit between three presses [deg]
LOW, HIGH = 0, 1  # indices of a low and a high tip
BALL_RADIUS = 40.0  # mm
HANDS = ((0.0, 0.0), (1.0, 40.0), (1.5, 200.0))  # tilts of presses on the ball, and their azimuths [deg]


class Read(NamedTuple):
    """A reading compared with the true modulus: relative error and bar [1], and flags."""

    error: float
    bar: float
    flags: tuple[str, ...]

    @property
    def inside(self) -> bool:
        """Return whether the error is within the bar."""
        return abs(self.error) <= self.bar


class Bench:
    """A unit of a design, and its sensor for the independent presses."""

    def __init__(self, name: str, seed: int) -> None:
        """Solve the contact and the errors of the named design; `seed` is for random fruits."""
        measured = MeasuredDesign(name)
        self.design = measured.design
        unit = measured.measuring(percent=1.0, gain_percent=0.1)
        by = "plate" if self.design.reading.on_plate else "weights"
        self.unit = self.before_ball = replace(unit, unit=replace(unit.unit, calibrated_by=by))
        self.sensor = domes_of(measured.design, measured.K)
        self.rng = np.random.default_rng(seed)
        self.cells = CELLS
        if self.design.reading.calibrated_by == "ball":
            self.unit = self.after_ball(self.sensor, self.design.reading.ball_percent)

    def after_ball(self, sensor: Sensor, percent: float) -> MeasuringUnit:
        """Return the unit with the domes of a sensor, calibrated on a ball in the middle of the range of E.

        The modulus of the ball is known to `percent`.
        """
        known = self.before_ball
        rubber = (
            math.sqrt(math.prod(known.range_MPa)) * (1.0 - RUBBER_POISSON**2) / (1.0 - self.design.fruit.poisson**2)
        )
        ball = ReferenceBall(E_MPa=rubber, radius_mm=BALL_RADIUS, percent=percent)
        self.unit = known.on_ball(BALL_RADIUS)
        of_ball = Fruit(E=rubber, R1=BALL_RADIUS, R2=BALL_RADIUS, poisson=RUBBER_POISSON)
        found = [self.read(replace(of_ball, tilt=tilt, tilt_azimuth=azimuth), sensor) for tilt, azimuth in HANDS]
        self.unit = known
        return replace(known, unit=replace(known.unit, ball=correction_of(found, ball, known, "the ball")))

    def fruit(self, E: float, **others: object) -> Fruit:
        """Return the mean fruit of the design, level under the sensor and smooth, with changes of some fields."""
        asked = self.design.reading
        middle = [float(np.mean(both)) for both in (asked.radius_mm, asked.radius_across_mm)]
        return replace(Fruit(E=E, R1=middle[0], R2=middle[1], poisson=self.design.fruit.poisson), **others)

    def drawn(self, **others: object) -> Fruit:
        """Return a random fruit in a random pose within the ranges of the design, with changes of some fields."""
        asked, rng = self.design.reading, self.rng
        low, high = min(self.design.fruit.E_MPa), self.design.fruit.largest_E_MPa
        fruit = Fruit(
            E=math.exp(rng.uniform(math.log(low), math.log(high))),
            R1=rng.uniform(*asked.radius_mm),
            R2=rng.uniform(*asked.radius_across_mm),
            azimuth=rng.uniform(-90.0, 90.0),
            tilt=asked.tilt_deg * math.sqrt(rng.uniform()),
            tilt_azimuth=rng.uniform(0.0, 360.0),
            poisson=self.design.fruit.poisson,
        )
        return replace(fruit, **others)

    def read(
        self, fruit: Fruit, sensor: Sensor | None = None, way: np.ndarray | None = None, t: np.ndarray | None = None
    ) -> FruitReading:
        """Return the reading of a press; `way` are its samples as shares of the travel [1].

        With times `t` [s] the flesh relaxes; else it is elastic.
        """
        sensor = sensor or self.sensor
        part = WAY if way is None else way
        travels = self.design.press.travel_mm * part
        if t is None:
            forces = press(sensor, fruit, travels, self.cells)
        else:
            forces = press_over_time(sensor, fruit, travels, t, FLESH, self.cells)
        touching = (forces > self.unit.least_forces).all(axis=1)
        times = PRESS_S * part if t is None else t
        forces, times = forces[touching], times[touching]
        return press_reading(self.unit, PressSamples(channels=forces, tips=len(sensor.K), t=times, touched_s=0.0))

    def against(self, E: float, found: FruitReading) -> Read:
        """Return a reading compared with the true modulus E [MPa]; the error is infinite without a modulus."""
        if found.E is None:
            return Read(math.inf, 0.0, found.flags)
        return Read(found.E / E - 1.0, found.u, found.flags)


def of_tip(tip: int, value: float, otherwise: float) -> tuple[float, ...]:
    """Return a tuple over the four tips with `value` for one tip and `otherwise` for the others."""
    return tuple(value if each == tip else otherwise for each in range(4))


def waves(rng: np.random.Generator, rms: float, length: float) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Return a height map with an rms [mm] of random waves with this length [mm] in all directions."""
    angle, phase = rng.uniform(0.0, 2.0 * math.pi, (2, 12))
    kx, ky = 2.0 * math.pi / length * np.array([np.cos(angle), np.sin(angle)])

    def heights(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        total = np.zeros(np.broadcast(x, y).shape)
        for a, b, c in zip(kx, ky, phase, strict=True):
            total += np.cos(a * x + b * y + c)
        return rms * math.sqrt(2.0 / len(phase)) * total

    return heights


def odd_shape(rng: np.random.Generator, most: float = 0.3) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Return a height map with random terms of third and fourth order, each at most `most` [mm] at 6 mm."""
    third, fourth = rng.uniform(-most, most, 2)
    turned = rng.uniform(0.0, 2.0 * math.pi, 2)
    orders = rng.choice([1, 3]), rng.choice([0, 2, 4])

    def heights(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        r, angle = np.hypot(x, y) / 6.0, np.arctan2(y, x)
        of_third = third * r**3 * np.cos(orders[0] * (angle - turned[0]))
        return of_third + fourth * r**4 * np.cos(orders[1] * (angle - turned[1]))

    return heights


def turned(heights: Callable[[np.ndarray, np.ndarray], np.ndarray], degrees: float) -> Callable:
    """Return a height map, rotated about the axis of the sensor."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return lambda x, y: heights(c * x + s * y, c * y - s * x)


def bruise(bench: Bench) -> Iterator[tuple[str, dict, Sensor]]:
    """Yield bruises with half the modulus and a radius of 6 or 3 mm."""
    for radius in (6.0, 3.0):
        for name, tip in (("low", LOW), ("high", HIGH)):
            soft = {"softness": of_tip(tip, 2.0, 1.0), "soft_radius": of_tip(tip, radius, math.inf)}
            yield f"radius {radius:g} mm, under a {name} tip", soft, bench.sensor


def soft_tip(bench: Bench) -> Iterator[tuple[str, dict, Sensor]]:
    """Yield flesh that is 20 % softer under one tip."""
    for name, tip in (("low", LOW), ("high", HIGH)):
        yield f"under a {name} tip", {"softness": of_tip(tip, 1.25, 1.0)}, bench.sensor


def one_bump(bench: Bench) -> Iterator[tuple[str, dict, Sensor]]:
    """Yield single bumps under a high tip."""
    x0, y0 = bench.sensor.positions[HIGH]
    for height, sigma in ((0.05, 0.8), (0.05, 1.5), (0.05, 3.0), (0.02, 0.8)):

        def bump(x, y, height=height, sigma=sigma):
            return height * np.exp(-0.5 * ((x - x0) ** 2 + (y - y0) ** 2) / sigma**2)

        yield f"{height:g} mm, sigma {sigma:g} mm", {"bumps": bump}, bench.sensor


def uneven(bench: Bench) -> Iterator[tuple[str, dict, Sensor]]:
    """Yield skins with waves of 0.016 mm rms, three draws for each length."""
    for length in (2.0, 4.0, 8.0):
        for draw in range(3):
            yield f"waves of {length:g} mm, {draw + 1}", {"bumps": waves(bench.rng, 0.016, length)}, bench.sensor


def dome(bench: Bench) -> Iterator[tuple[str, dict, Sensor]]:
    """Yield form errors of all domes: caps of 1 mm that are 0.02 mm flat or pointed, and radii changed by 10 %."""
    sensor = bench.sensor
    for name, height in (("cap flat by 0.02 mm", -0.02), ("cap pointed by 0.02 mm", 0.02)):

        def form(s, height=height):
            return height * np.exp(-0.5 * s**2)

        yield name, {}, replace(sensor, form=form)
    for factor in (0.9, 1.1):
        yield f"radius times {factor:g}", {}, replace(sensor, dome_radius=factor * sensor.dome_radius)


def layers(bench: Bench) -> Iterator[tuple[str, dict, Sensor]]:
    """Yield outer layers of 2 mm, twice or half as stiff as the core, whose modulus is to be read."""
    for stiffness in (2.0, 0.5):
        layer = Layer(2.0, stiffness, bench.design.fruit.poisson)
        yield f"{stiffness:g} times as stiff", {"layer": layer}, bench.sensor


def cheeks(bench: Bench) -> Iterator[tuple[str, dict, Sensor]]:
    """Yield cheeks with radii beyond the range of the design."""
    for radii in ((34.0, 80.0), (34.0, 180.0), (63.0, 80.0), (63.0, 180.0)):
        yield f"{radii[0]:g} by {radii[1]:g} mm", {"R1": radii[0], "R2": radii[1]}, bench.sensor


SINGLE = {"bruise": bruise, "soft_tip": soft_tip, "uneven": uneven, "bump": one_bump, "dome": dome, "layers": layers}
SINGLE["cheeks"] = cheeks


def yields(bench: Bench) -> Iterator[tuple[str, Read]]:
    """Yield presses of flesh that yields at 0.8 or 1.1 of the largest mean pressure under a tip.

    They are compared with presses of elastic flesh.
    """
    for E in MODULI:
        fruit = bench.fruit(E)
        elastic = Pressing(bench.sensor, fruit)
        mean = (elastic.forces(bench.design.press.travel_mm) / elastic.area).max()
        even = bench.read(fruit).E
        for part in (0.8, 1.1):
            yield (
                f"at {part:g} of the mean, {E:g} MPa",
                bench.against(even, bench.read(replace(fruit, yields=part * mean))),
            )


def paused(at: float, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Return shares of the travel and times [s] of a press that pauses at the share `at` for `seconds`."""
    way = np.linspace(0.1, 1.0, 19)
    t = PRESS_S * way
    stop = int(np.searchsorted(way, at))
    rests = np.full(4, way[stop])
    at_rest = t[stop] + seconds * np.arange(1, 5) / 4.0
    return np.insert(way, stop + 1, rests), np.concatenate([t[: stop + 1], at_rest, t[stop + 1 :] + seconds])


def changed(at: float, factor: float) -> tuple[np.ndarray, np.ndarray]:
    """Return shares of the travel and times [s] of a press that is slower by a factor from the share `at` on."""
    way = np.linspace(0.1, 1.0, 19)
    return way, PRESS_S * (np.minimum(way, at) + factor * np.maximum(way - at, 0.0))


def pace(bench: Bench) -> Iterator[tuple[str, Read]]:
    """Yield uneven paces on flesh that relaxes, compared with a steady press of the same flesh."""
    for E in MODULI:
        fruit = bench.fruit(E)
        even = bench.read(fruit, None, *changed(1.0, 1.0)).E
        for name, each in (
            ("pause of 2 s at 0.8", paused(0.8, 2.0)),
            ("a third as fast from 0.6", changed(0.6, 3.0)),
            ("twice the time", changed(0.0, 2.0)),
        ):
            yield f"{name}, {E:g} MPa", bench.against(even, bench.read(fruit, None, *each))


def paces(bench: Bench, count: int) -> Iterator[Read]:
    """Yield presses with pauses and changes of pace on random fruit."""
    for number in range(count):
        fruit = bench.drawn()
        even = bench.read(fruit, None, *changed(1.0, 1.0)).E
        at = bench.rng.uniform(0.4, 0.9)
        each = (
            paused(at, bench.rng.uniform(0.3, 3.0)) if number % 2 else changed(at, 3.0 ** bench.rng.uniform(-1.0, 1.0))
        )
        yield bench.against(even, bench.read(fruit, None, *each))


def is_hollow(bench: Bench, fruit: Fruit) -> bool:
    """Return whether a dome touches hollow skin, with a mean curvature below 0, or touches with its rim."""
    x, y = Pressing(bench.sensor, fruit).touch.T
    step = 0.05  # mm
    bumps = fruit.bumps(x, y)
    around = sum(fruit.bumps(x + dx, y + dy) for dx, dy in ((step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)))
    curvature = 0.5 * np.trace(fruit.curvature) - 0.5 * (around - 4.0 * bumps) / step**2
    away = np.hypot(*(np.stack([x, y], axis=1) - bench.sensor.positions).T)
    return bool((curvature < 0.0).any() or (away > bench.sensor.rim - step).any())


def shapes(bench: Bench, count: int) -> Iterator[Read]:
    """Yield presses on skins with terms of third and fourth order; skins hollow under a tip get a separate row."""
    hollow: list[Read] = []
    pressed = 0
    bench.cells = HOLLOW_CELLS
    while pressed < count:
        fruit = bench.drawn(bumps=odd_shape(bench.rng))
        found = bench.against(fruit.E, bench.read(fruit))
        if is_hollow(bench, fruit):
            hollow.append(found)
        else:
            pressed += 1
            yield found
    bench.cells = CELLS
    if hollow:
        print_many("shapes, hollow under a tip", hollow)


def by_three(bench: Bench, fruit: Fruit, each: list[dict]) -> Read:
    """Return the answer from three presses of a fruit, each rotated and with its own changes."""
    found = []
    for turn, changes in zip(TURNS, each, strict=True):
        found.append(bench.read(replace(fruit, azimuth=fruit.azimuth + turn, **changes)))
    answer = fruit_answer(bench.unit, found, "1")
    return Read(math.inf if answer.E is None else answer.E / fruit.E - 1.0, answer.u or 0.0, answer.flags)


def three_uneven(bench: Bench, count: int) -> Iterator[Read]:
    """Yield answers from three rotated presses on uneven skins with waves of 0.016 mm rms and 2 to 8 mm."""
    for _ in range(count):
        heights = waves(bench.rng, 0.016, bench.rng.uniform(2.0, 8.0))
        yield by_three(bench, bench.drawn(), [{"bumps": turned(heights, turn)} for turn in TURNS])


def bruised(bench: Bench, count: int, turned_tips: tuple[int | None, ...]) -> Iterator[Read]:
    """Yield answers from three presses on fruit with a bruise of half the modulus and 6 mm.

    In each press the bruise is under a random first tip plus an entry of `turned_tips`, or under no tip for None.
    """
    for _ in range(count):
        tip = int(bench.rng.integers(4))
        each = []
        for on in turned_tips:
            soft = {} if on is None else {"softness": of_tip((tip + on) % 4, 2.0, 1.0), "soft_radius": (6.0,) * 4}
            each.append(soft)
        yield by_three(bench, bench.drawn(), each)


def three_bruised(bench: Bench, count: int) -> Iterator[Read]:
    """Yield a bruise that is under another tip after a quarter turn, and under none after 45 degrees."""
    yield from bruised(bench, count, (0, 1, None))


def once_bruised(bench: Bench, count: int) -> Iterator[Read]:
    """Yield a bruise that is under a tip in one of three presses."""
    yield from bruised(bench, count, (0, None, None))


def real_cheeks(bench: Bench, count: int) -> Iterator[Read]:
    """Yield presses on real fruit with radii beyond the cheeks of the design; radii within get a separate row.

    A further row repeats the presses with the mean radius known to the unit.
    """
    design, unit = bench.design, bench.unit
    real = FRUITS[design.name]
    stone = FleshOnStone(design.fruit.thickness_mm, design.fruit.poisson)
    within: list[Read] = []
    told: list[Read] = []
    for _ in range(count):
        radii = bench.rng.uniform(*real.radius_mm), bench.rng.uniform(*real.radius_across_mm)
        fruit = bench.drawn(R1=radii[0], R2=radii[1], layer=stone)
        read = bench.against(fruit.E, bench.read(fruit))
        both = zip(radii, (design.reading.radius_mm, design.reading.radius_across_mm), strict=True)
        if all(ends[0] <= radius <= ends[1] for radius, ends in both):
            within.append(read)
            continue
        yield read
        mean = 2.0 / (1.0 / radii[0] + 1.0 / radii[1])
        bench.unit = replace(unit, radii_mm=(mean, mean))
        told.append(bench.against(fruit.E, bench.read(fruit)))
        bench.unit = unit
    if within:
        print_many("real cheeks within those of the design", within)
    print_many("real cheeks beyond, with their mean radius told", told)


MANY = {"paces": (paces, 60), "shapes": (shapes, 300), "three_uneven": (three_uneven, 100)}
MANY["three_bruised"] = (three_bruised, 100)
MANY["real_cheeks"] = (real_cheeks, 60)
MANY["once_bruised"] = (once_bruised, 100)
LISTS = {"yields": yields, "pace": pace}


def print_single(bench: Bench, name: str) -> None:
    """Print the change of E by each kind of a cause, for each modulus."""
    for E in MODULI:
        even = bench.read(bench.fruit(E))
        for kind, changes, sensor in SINGLE[name](bench):
            show(f"{name}: {kind}, {E:g} MPa", bench.against(even.E, bench.read(bench.fruit(E, **changes), sensor)))


def show(name: str, read: Read) -> None:
    """Print the row of one reading."""
    told = "inside" if read.inside else "flagged" if read.flags else "OUTSIDE"
    print(
        f"| {name} | {100.0 * read.error:+.1f} % | {100.0 * read.bar:.1f} % | {told} | {', '.join(read.flags)} |",
        flush=True,
    )


def print_many(name: str, reads: Iterable[Read]) -> None:
    """Print the row of many presses: the numbers inside their bars and flagged, and the largest error in bars."""
    found = []
    for number, read in enumerate(reads):
        found.append(read)
        if not read.inside and not read.flags:
            show(f"{name}: press {number + 1}", read)
    if not found:
        print(f"| {name} | none |", flush=True)
        return
    inside = sum(read.inside for read in found)
    flagged = sum(bool(read.flags) and not read.inside for read in found)
    silent = [abs(read.error) / read.bar for read in found if not read.flags]
    every = sum(bool(read.flags) for read in found)
    farthest = max(silent, default=0.0)
    errors = 100.0 * np.array([read.error for read in found if math.isfinite(read.error)])
    sizes, bar = np.abs(errors), 100.0 * np.median([read.bar for read in found])
    print(
        f"| {name} | {len(found)} | {inside} inside, {flagged} flagged outside, {every} flagged in all, "
        f"{len(found) - len(errors)} without a modulus | farthest without a flag {farthest:.2f} bars | "
        f"error {errors.mean():+.1f} % in the mean, {np.median(sizes):.1f} and {sizes.max():.1f} % in size, "
        f"its bar {bar:.1f} % |",
        flush=True,
    )


def main() -> int:
    """Print the rows."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("design", nargs="?", default="mango")
    names = [*SINGLE, *LISTS, *MANY]
    parser.add_argument("--rows", nargs="+", choices=names, default=names)
    parser.add_argument("--count", type=int, help="presses of each row of many")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    bench = Bench(asked.design, asked.seed)
    for name in asked.rows:
        if name in SINGLE:
            print_single(bench, name)
        elif name in LISTS:
            for kind, read in LISTS[name](bench):
                show(f"{name}: {kind}", read)
        else:
            each, count = MANY[name]
            bench.rng = np.random.default_rng([asked.seed, list(MANY).index(name)])  # independent of earlier rows
            print_many(name, each(bench, asked.count or count))
    return 0


if __name__ == "__main__":
    sys.exit(main())
