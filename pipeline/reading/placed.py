"""How a sensor stands on a fruit, and all the ways that a design says occur, over which its reading is judged."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cad.design.fruit import Fruit
from cad.design.parameters import Design
from cad.design.reading import Reading
from cad.quantity import validation_error
from pipeline.response.scene_press import refuse_unsolvable, scene_of
from solve.contact.linear_response import travels
from solve.contact.poses import Pose, posed_scene
from solve.contact.scene import STEEPEST_DEG

Vector = tuple[float, float]

DIRECTIONS = 8
FEWEST_MODULI = 4
_AXES = {0: "+x", 90: "+y", 180: "-x", -180: "-x", -90: "-y"}  # by their angle to +x [deg]


@dataclass(frozen=True, kw_only=True)
class Placed:
    """How a sensor stands on a fruit: tilt [deg] and place from the apex [mm] along and across, radius [mm]."""

    tilt_deg: Vector = (0.0, 0.0)
    off_centre_mm: Vector = (0.0, 0.0)
    radius_mm: float | None = None

    @property
    def tilted(self) -> bool:
        """Say whether it is tilted and nothing else."""
        return any(self.tilt_deg) and not any(self.off_centre_mm) and self.radius_mm is None

    @property
    def off_centre(self) -> bool:
        """Say whether it stands off the apex and nothing else."""
        return any(self.off_centre_mm) and not any(self.tilt_deg) and self.radius_mm is None

    @property
    def other_fruit(self) -> bool:
        """Say whether the fruit has another radius and nothing else is off."""
        return self.radius_mm is not None and not any(self.tilt_deg) and not any(self.off_centre_mm)

    @classmethod
    def of(cls, pose: Pose) -> "Placed":
        """Return how the sensor of a pose stands."""
        return cls(tilt_deg=pose.tilt_deg, off_centre_mm=pose.off_centre_mm, radius_mm=pose.radius_mm)

    def pressed(self, E: float, travel: float) -> Pose:
        """Return the pose on a fruit of a modulus [MPa] at a travel [mm]."""
        return Pose(
            E=E,
            travel=travel,
            tilt_deg=self.tilt_deg,
            off_centre_mm=self.off_centre_mm,
            radius_mm=self.radius_mm,
        )

    def __str__(self) -> str:
        """Return the place in words; it is the tips on the side named that are lower."""
        tilt, off = math.hypot(*self.tilt_deg), math.hypot(*self.off_centre_mm)
        parts = [
            f"tilted {tilt:.2g} deg down towards {_direction(self.tilt_deg)}" if tilt else "level",
            f"{off:.2g} mm off the apex towards {_direction(self.off_centre_mm)}" if off else "",
            f"on a radius of {self.radius_mm:.3g} mm" if self.radius_mm else "",
        ]
        return ", ".join(part for part in parts if part)


def _direction(vector: Vector) -> str:
    """Return in words where a vector along and across the tips points: along an axis, or by its angle to +x."""
    angle = round(math.degrees(math.atan2(vector[1], vector[0])))
    return _AXES.get(angle, f"{angle} deg from +x")


def press_of(placed: Placed, E: float, design: Design, samples: int) -> list[Pose]:
    """Return the poses of a press at a modulus [MPa], one for each sample, the last at full travel."""
    return [placed.pressed(E, travel) for travel in travels(design.press.travel_mm, samples).tolist()]


def directed(length: float, count: int = DIRECTIONS) -> list[Vector]:
    """Return vectors of a length [its unit] in equally spaced directions; a single one of length 0."""
    if length == 0.0:
        return [(0.0, 0.0)]
    angles = [2.0 * math.pi * k / count for k in range(count)]
    return [(length * math.cos(angle), length * math.sin(angle)) for angle in angles]


def read_moduli(fruit: Fruit) -> tuple[float, ...]:
    """Return the moduli at which a reading is judged [MPa]: those shown, or at least four from the least to E_max."""
    shown = sorted({*fruit.E_MPa, fruit.E_max_MPa})
    if len(shown) >= FEWEST_MODULI or shown[0] == shown[-1]:
        return tuple(shown)
    return tuple(np.geomspace(shown[0], shown[-1], FEWEST_MODULI).tolist())


def radii(fruit: Fruit, reading: Reading) -> tuple[float | None, ...]:
    """Return the radii of the fruits that occur [mm], the design's first; None stands for the design's own shape."""
    if fruit.radius_mm is None or reading.radius_spread == 0.0:
        return (None,)
    return (None, *(fruit.radius_mm * (1.0 + sign * reading.radius_spread) for sign in (-1.0, 1.0)))


def occurring(design: Design, reading: Reading) -> Iterator[Placed]:
    """Yield how the sensor may stand, level in the middle first: each radius with tilts and places in all directions.

    A sensor off the centre of a sphere stands as one that is tilted: with the tilt and against it are the extremes.
    """
    for radius, share in itertools.product(radii(design.fruit, reading), (0.0, 0.5, 1.0)):
        for tilt in directed(share * reading.tilt_deg) if share else [(0.0, 0.0)]:
            yield Placed(tilt_deg=tilt, radius_mm=radius)
            for place in _off_centre(tilt, reading.off_centre_mm):
                yield Placed(tilt_deg=tilt, off_centre_mm=place, radius_mm=radius)


def _off_centre(tilt: Vector, distance: float) -> list[Vector]:
    """Return the places at a distance [mm] from the apex: along a tilt both ways, all directions for a level press."""
    if distance == 0.0:
        return []
    length = math.hypot(*tilt)
    if length == 0.0:
        return directed(distance)
    return [(sign * distance * tilt[0] / length, sign * distance * tilt[1] / length) for sign in (-1.0, 1.0)]


def refuse_unsolvable_presses(design: Design) -> None:
    """Raise InputError where contact cannot be solved in the scene of a design, or in a pose of its reading.

    Solves nothing.
    """
    refuse_unsolvable(design)
    refuse_steep_poses(design)


def refuse_steep_poses(design: Design) -> None:
    """Raise InputError where a pose that the reading shall stand is too steep to be solved; solves nothing."""
    reading, scene = design.reading, scene_of(design)
    if reading is None:
        return
    for placed in occurring(design, reading):
        posed = posed_scene(scene, placed.pressed(design.fruit.E_max_MPa, design.press.travel_mm))
        if posed.steepest_deg > STEEPEST_DEG:
            key, value, unit = "reading.tilt_deg", reading.tilt_deg, "deg"
            if reading.off_centre_mm and not any(placed.tilt_deg):
                key, value, unit = "reading.off_centre_mm", reading.off_centre_mm, "mm"
            bound = (
                f"such that no tip meets the fruit at more than {STEEPEST_DEG:g} deg, here {posed.steepest_deg:.3g} "
                f"deg where the sensor is {placed}"
            )
            raise validation_error(
                key, value, unit, bound, "take less tilt, a place nearer to the apex, or a smaller spread of radius"
            )
