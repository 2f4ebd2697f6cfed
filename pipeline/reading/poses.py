"""The poses of a sensor on a fruit in which readings are evaluated. They cover the ranges that the design allows."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from pipeline.response.scene_press import refuse_unsolvable_scene, scene_of
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.reading import ReadingRequirements
from sensor.quantity import validation_error
from solve.contact.pose_forces import Stand, posed_scene
from solve.contact.scene import STEEPEST_DEG
from solve.contact.scene_cells import scene_footprints

Vector = tuple[float, float]
"""The components of a vector along and across the tips."""

LEVEL: Vector = (0.0, 0.0)
_ANGLES = [0.25 * math.pi * k for k in range(8)]  # [rad]
# unit vectors at 0, 45, ..., 315 deg from the line of the tips
DIRECTIONS = [(math.cos(angle), math.sin(angle)) for angle in _ANGLES]
_DIAGONALS = DIRECTIONS[1::2]  # every second direction, from 45 deg on
RANDOM_PLACEMENTS = 48  # number of random placements
SEED = 21  # fixed, so that every run evaluates the same random placements
FEWEST_MODULI = 4  # minimum number of moduli at which readings are evaluated
_AXES = {0: "+x", 90: "+y", 180: "-x", -180: "-x", -90: "-y"}  # names of the axes by their angle from +x [deg]


@dataclass(frozen=True, kw_only=True)
class Placement(Stand):
    """A position and tilt of the sensor on a fruit of given radii and flesh thickness.

    `is_random` is True for a random placement. Random placements represent how often each pose occurs.
    `tilt_change_deg` is the change in tilt during the whole press.
    """

    is_random: bool = False

    def __str__(self) -> str:
        """Return the placement as text, for example "tilted 2 deg down towards +x, on a radius of 30 mm"."""
        tilt = math.hypot(*self.tilt_deg)
        distance = math.hypot(*self.off_centre_mm)
        parts = [f"tilted {tilt:.2g} deg down towards {_direction(self.tilt_deg)}" if tilt else "level"]
        if distance:
            parts.append(f"{distance:.2g} mm off the apex towards {_direction(self.off_centre_mm)}")
        if self.radii_mm and self.azimuth_deg is None:
            parts.append(f"on a radius of {self.radii_mm[0]:.3g} mm")
        elif self.radii_mm:
            radius, radius_across = self.radii_mm
            azimuth = self.azimuth_deg
            parts.append(f"on radii of {radius:.3g} and {radius_across:.3g} mm, the first at {azimuth:.3g} deg")
        if self.thickness_mm:
            parts.append(f"on flesh of {self.thickness_mm:.3g} mm")
        return ", ".join(parts)


def _direction(vector: Vector) -> str:
    """Return the direction of a vector in the plane of the tips as text: the name of an axis, or the angle from +x."""
    angle = round(math.degrees(math.atan2(vector[1], vector[0])))
    return _AXES.get(angle, f"{angle} deg from +x")


def read_moduli(fruit: Fruit) -> tuple[float, ...]:
    """Return the moduli [MPa] at which readings are evaluated: the fruit's own, or four moduli over the same range.

    Four moduli in geometric progression are used if the fruit has two or three. A fruit with a single modulus keeps it.
    """
    moduli = sorted({*fruit.E_MPa, fruit.E_max_MPa})
    if len(moduli) >= FEWEST_MODULI or moduli[0] == moduli[-1]:
        return tuple(moduli)
    return tuple(np.geomspace(moduli[0], moduli[-1], FEWEST_MODULI).tolist())


@dataclass(frozen=True, kw_only=True)
class OccurringFruits:
    """The ranges in which the dimensions of the fruits vary [mm]; None means the value of the design.

    `radius` and `across` are the ranges of the two principal radii. Without `across`, the second radius is `aspect`
    times the first. `thickness` is the range of the flesh thickness. `azimuths` are the angles [deg] between the first
    principal direction and the line of tips.
    """

    radius: Vector | None = None
    across: Vector | None = None
    thickness: Vector | None = None
    azimuths: tuple[float, ...] = ()
    aspect: float = 1.0

    def extremes(self) -> Iterator[Placement]:
        """Yield level placements on fruits at the ends of all ranges except the flesh thickness."""
        for first in self.radius or ():  # a fruit whose radii do not vary yields nothing
            for second in self.across or (self.aspect * first,):
                for azimuth in self.azimuths or (None,):  # None keeps the azimuth of the design
                    yield Placement(from_touch=True, radii_mm=(first, second), azimuth_deg=azimuth)


def occurring_fruits(fruit: Fruit, reading: ReadingRequirements) -> OccurringFruits:
    """Return the ranges of the fruits to be read, from the design's `[reading]`.

    `[reading]` gives ranges of the two radii, or a relative spread of the design's radius. `[reading]` may also give a
    range of the flesh thickness. If it gives ranges of radii, the azimuth of the fruit is arbitrary. The dimensions of
    a flat fruit do not vary.
    """
    if fruit.radius_mm is None:
        return OccurringFruits()
    if reading.radius_mm is not None:
        return OccurringFruits(
            radius=reading.radius_mm,
            across=reading.radius_across_mm,
            thickness=reading.thickness_mm,
            # The azimuth 0 is along a principal direction. The other two are midway between the principal directions,
            # where the saddle of the skin under the tips is largest.
            azimuths=(0.0, 45.0, 135.0),
        )
    radius = None
    if reading.radius_spread:
        radius = (fruit.radius_mm * (1.0 - reading.radius_spread), fruit.radius_mm * (1.0 + reading.radius_spread))
    along, across = fruit.radii_mm
    return OccurringFruits(radius=radius, thickness=reading.thickness_mm, aspect=across / along)


def occurring_placements(design: Design, reading: ReadingRequirements) -> Iterator[Placement]:
    """Yield the placements at which readings are evaluated: level, at the ends of all ranges, and at random.

    The placements are in this order:

    - The first one is level on the design's fruit. The next ones are tilted in eight directions, if tilts are allowed.
    - A level placement follows at the apex of each fruit at the ends of the ranges of flesh thickness and radii, at
      several azimuths. If the fruit has other radii than the design's fruit, four tilted placements come after it. The
      sensor is then tilted towards a diagonal, as far from the apex as the design allows. The four tilted placements
      are omitted at azimuth 0, where the skin under the tips has a smaller saddle.
    - The random placements come last.
    """
    fruits = occurring_fruits(design.fruit, reading)
    # The level press is placement 0; the error analysis relies on it.
    level = Placement(from_touch=True)
    yield level
    if reading.tilt_deg:
        yield from (replace(level, tilt_deg=_scale(direction, reading.tilt_deg)) for direction in DIRECTIONS)
    for shape in (level, *fruits.extremes()):
        for thickness in (None, *(fruits.thickness or ())):  # None is the thickness of the design
            with_flesh = replace(shape, thickness_mm=thickness)
            if with_flesh != level:
                yield with_flesh
            if shape != level and shape.azimuth_deg != 0.0:
                yield from (_tilt_and_shift(with_flesh, reading, direction) for direction in _DIAGONALS)
    yield from _sample_placements(fruits, reading)


def _tilt_and_shift(shape: Placement, reading: ReadingRequirements, direction: Vector) -> Placement:
    """Return a placement with the largest distance from the apex, and the largest tilt at the end of the press.

    `shape` is a level placement, which gives the fruit. The distance and the tilt are along `direction`, a unit vector.
    The press begins at a smaller tilt. During the press, the tilt increases by the largest change that the design
    allows, as in a press by hand.
    """
    tilt_change = min(reading.tilt_change_deg, reading.tilt_deg)
    return replace(
        shape,
        tilt_deg=_scale(direction, reading.tilt_deg - tilt_change),
        tilt_change_deg=_scale(direction, tilt_change),
        off_centre_mm=_scale(direction, reading.off_centre_mm),
    )


def _sample_placements(fruits: OccurringFruits, reading: ReadingRequirements) -> Iterator[Placement]:
    """Yield `RANDOM_PLACEMENTS` random placements, uniformly distributed over every range except the flesh thickness.

    Tilts, their changes and positions are uniformly distributed over the area of a disc. The thickness is a separate
    source of uncertainty, so it keeps the value of the design.
    """
    rng = np.random.default_rng(SEED)
    for _ in range(RANDOM_PLACEMENTS):
        # All random numbers are drawn even if a range is missing, so that the other numbers remain the same.
        radius_fraction, across_fraction, azimuth_fraction = rng.uniform(size=3).tolist()
        tilt, position, tilt_change = (_sample_disc(rng) for _ in range(3))  # fractions of their largest values
        radii = None
        if fruits.radius is not None:
            radius = _interpolate(fruits.radius, radius_fraction)
            across = fruits.aspect * radius if fruits.across is None else _interpolate(fruits.across, across_fraction)
            radii = (radius, across)
        yield Placement(
            from_touch=True,
            is_random=True,
            radii_mm=radii,
            azimuth_deg=180.0 * azimuth_fraction if fruits.azimuths else None,  # an ellipsoid repeats after 180 deg
            # the tilt and its change together stay within the largest tilt of the design
            tilt_deg=_scale(tilt, max(reading.tilt_deg - reading.tilt_change_deg, 0.0)),
            off_centre_mm=_scale(position, reading.off_centre_mm),
            tilt_change_deg=_scale(tilt_change, reading.tilt_change_deg),
        )


def _sample_disc(rng: np.random.Generator) -> Vector:
    """Return a random point in the unit disc, uniformly distributed over its area.

    The area within a radius grows with its square, so the radius is the square root of a uniform number.
    """
    area, direction = rng.uniform(size=2).tolist()
    angle = 2.0 * math.pi * direction
    return math.sqrt(area) * math.cos(angle), math.sqrt(area) * math.sin(angle)


def _scale(vector: Vector, length: float) -> Vector:
    """Return a vector multiplied by a length."""
    return length * vector[0], length * vector[1]


def _interpolate(ends: Vector, fraction: float) -> float:
    """Return the value at a fraction [1] of a range, linearly between its ends."""
    return ends[0] + fraction * (ends[1] - ends[0])


def refuse_unsolvable_poses(design: Design) -> None:
    """Raise InputError if contact cannot be solved in the scene of a design or in a pose of its `[reading]`.

    The angle between each tip and the skin must not exceed the limit of the contact solver. This check solves nothing.
    """
    refuse_unsolvable_scene(design)
    reading = design.reading
    if reading is None:
        return
    scene = scene_of(design)
    for placement in occurring_placements(design, reading):
        posed = posed_scene(scene, placement)
        if posed.steepest_deg <= STEEPEST_DEG:
            continue
        bound = (
            f"such that no tip meets the fruit at more than {STEEPEST_DEG:g} deg, here {posed.steepest_deg:.3g} "
            f"deg where the sensor is {placement}"
        )
        hint = "use a smaller tilt, or fruits of larger radii"
        raise validation_error("reading.tilt_deg", reading.tilt_deg, "deg", bound, hint)
    if not scene.obeys_dome_law:  # all poses are solved on the cells of the most tilted pose
        tilted = replace(scene.press, tilt_deg=reading.tilt_deg)
        scene_footprints(replace(scene, press=tilted), design.press.travel_mm)  # called only to raise InputError
