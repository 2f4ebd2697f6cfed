"""Poses of a sensor on a fruit: all that occur by the design, over which readings are evaluated."""

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
"""Components along and across the tips."""

LEVEL: Vector = (0.0, 0.0)
DIRECTIONS = [(math.cos(angle), math.sin(angle)) for angle in (0.25 * math.pi * k for k in range(8))]
DRAWN = 48
SEED = 21
FEWEST_MODULI = 4
_AXES = {0: "+x", 90: "+y", 180: "-x", -180: "-x", -90: "-y"}  # names of axes by their angle to +x [deg]


@dataclass(frozen=True, kw_only=True)
class Placement(Stand):
    """A stand that occurs, with its text; `is_drawn` marks one that was sampled with its natural frequency.

    `turned_deg` is the change of the tilt during the whole press.
    """

    is_drawn: bool = False

    def __str__(self) -> str:
        """Return the placement as text; a tilt is named by the side whose tips are lower."""
        tilt = math.hypot(*self.tilt_deg)
        off = math.hypot(*self.off_centre_mm)
        parts = [f"tilted {tilt:.2g} deg down towards {_direction(self.tilt_deg)}" if tilt else "level"]
        if off:
            parts.append(f"{off:.2g} mm off the apex towards {_direction(self.off_centre_mm)}")
        if self.radii_mm and self.azimuth_deg is None:
            parts.append(f"on a radius of {self.radii_mm[0]:.3g} mm")
        elif self.radii_mm:
            first, second = self.radii_mm
            parts.append(f"on radii of {first:.3g} and {second:.3g} mm, the first at {self.azimuth_deg:.3g} deg")
        if self.thickness_mm:
            parts.append(f"on flesh of {self.thickness_mm:.3g} mm")
        return ", ".join(parts)


def _direction(vector: Vector) -> str:
    """Return the direction of a vector along and across the tips as text: an axis, or its angle to +x."""
    angle = round(math.degrees(math.atan2(vector[1], vector[0])))
    return _AXES.get(angle, f"{angle} deg from +x")


def read_moduli(fruit: Fruit) -> tuple[float, ...]:
    """Return the moduli at which readings are evaluated [MPa]: the moduli of the fruit, at least four up to E_max."""
    shown = sorted({*fruit.E_MPa, fruit.E_max_MPa})
    if len(shown) >= FEWEST_MODULI or shown[0] == shown[-1]:
        return tuple(shown)
    return tuple(np.geomspace(shown[0], shown[-1], FEWEST_MODULI).tolist())


@dataclass(frozen=True, kw_only=True)
class OccurringFruits:
    """The fruits that occur: ranges of their principal radii and of their flesh [mm]; None is the value of the design.

    Without a range across, the second radius is `aspect` times the first.
    """

    radius: Vector | None = None
    across: Vector | None = None
    thickness: Vector | None = None
    azimuths: tuple[float, ...] = ()
    aspect: float = 1.0

    def extremes(self) -> Iterator[Placement]:
        """Yield level placements on fruits at the ends of all ranges except the flesh."""
        for first in self.radius or ():
            for second in self.across or (self.aspect * first,):
                for azimuth in self.azimuths or (None,):
                    yield Placement(from_touch=True, radii_mm=(first, second), azimuth_deg=azimuth)


def fruits_of(fruit: Fruit, reading: ReadingRequirements) -> OccurringFruits:
    """Return the fruits that occur in a reading; the azimuth of an ellipsoid is arbitrary."""
    if fruit.radius_mm is None:
        return OccurringFruits()
    if reading.radius_mm is not None:
        return OccurringFruits(
            radius=reading.radius_mm,
            across=reading.radius_across_mm,
            thickness=reading.thickness_mm,
            azimuths=(0.0, 45.0, 135.0),  # along a radius, and between both, where the skin twists most under the tips
        )
    radius = None
    if reading.radius_spread:
        radius = (fruit.radius_mm * (1.0 - reading.radius_spread), fruit.radius_mm * (1.0 + reading.radius_spread))
    along, across = fruit.radii_mm
    return OccurringFruits(radius=radius, thickness=reading.thickness_mm, aspect=across / along)


def occurring(design: Design, reading: ReadingRequirements) -> Iterator[Placement]:
    """Yield the placements of the sensor that occur: level, at the ends of all ranges, and random ones.

    The first is level on the design's fruit. Ends are taken of the flesh, and of radii at azimuths along the tips and
    along the diagonals between them. On the diagonals the sensor is tilted towards each of four tips, up to the largest
    tilt at the end of the press. It stands as far beside the apex as the design allows.
    """
    fruits = fruits_of(design.fruit, reading)
    # The level press is place 0; the error analysis relies on it.
    level = Placement(from_touch=True)
    yield level
    if reading.tilt_deg:
        yield from (replace(level, tilt_deg=_times(each, reading.tilt_deg)) for each in DIRECTIONS)
    for shape in (level, *fruits.extremes()):
        for thickness in (None, *(fruits.thickness or ())):
            with_flesh = replace(shape, thickness_mm=thickness)
            if with_flesh != level:
                yield with_flesh
            if shape != level and shape.azimuth_deg != 0.0:
                yield from (_by_hand(with_flesh, reading, direction) for direction in DIRECTIONS[1::2])
    yield from _drawn(fruits, reading)


def _by_hand(shape: Placement, reading: ReadingRequirements, direction: Vector) -> Placement:
    """Return a placement that reaches the largest tilt in a direction [1] at the end, and lies beside the apex."""
    turned = min(reading.tilt_change_deg, reading.tilt_deg)
    return replace(
        shape,
        tilt_deg=_times(direction, reading.tilt_deg - turned),
        turned_deg=_times(direction, turned),
        off_centre_mm=_times(direction, reading.off_centre_mm),
    )


def _drawn(fruits: OccurringFruits, reading: ReadingRequirements) -> Iterator[Placement]:
    """Yield placements sampled uniformly from every range except the flesh; tilts and positions are uniform in area."""
    rng = np.random.default_rng(SEED)
    for _ in range(DRAWN):
        radius, across, azimuth = rng.uniform(size=3).tolist()
        tilt, place, turned = (_in_disc(rng) for _ in range(3))
        radii = None
        if fruits.radius is not None:
            first = _between(fruits.radius, radius)
            radii = (first, fruits.aspect * first if fruits.across is None else _between(fruits.across, across))
        yield Placement(
            from_touch=True,
            is_drawn=True,
            radii_mm=radii,
            azimuth_deg=180.0 * azimuth if fruits.azimuths else None,
            tilt_deg=_times(tilt, max(reading.tilt_deg - reading.tilt_change_deg, 0.0)),
            off_centre_mm=_times(place, reading.off_centre_mm),
            turned_deg=_times(turned, reading.tilt_change_deg),
        )


def _in_disc(rng: np.random.Generator) -> Vector:
    """Return a random point of the unit disc, uniform in area."""
    area, direction = rng.uniform(size=2).tolist()
    angle = 2.0 * math.pi * direction
    return math.sqrt(area) * math.cos(angle), math.sqrt(area) * math.sin(angle)


def _times(vector: Vector, length: float) -> Vector:
    return length * vector[0], length * vector[1]


def _between(ends: Vector, fraction: float) -> float:
    return ends[0] + fraction * (ends[1] - ends[0])


def refuse_unsolvable_poses(design: Design) -> None:
    """Raise InputError if contact cannot be solved in the scene of a design or in a pose of its reading.

    Nothing is solved.
    """
    refuse_unsolvable_scene(design)
    reading = design.reading
    if reading is None:
        return
    scene = scene_of(design)
    for placement in occurring(design, reading):
        posed = posed_scene(scene, placement)
        if posed.steepest_deg <= STEEPEST_DEG:
            continue
        bound = (
            f"such that no tip meets the fruit at more than {STEEPEST_DEG:g} deg, here {posed.steepest_deg:.3g} "
            f"deg where the sensor is {placement}"
        )
        hint = "take less tilt, or fruits of larger radii"
        raise validation_error("reading.tilt_deg", reading.tilt_deg, "deg", bound, hint)
    if not scene.on_domes:  # all poses are solved on the cells of the most tilted one
        tilted = replace(scene.press, tilt_deg=reading.tilt_deg)
        scene_footprints(replace(scene, press=tilted), design.press.travel_mm)
