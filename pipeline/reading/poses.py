"""How a sensor stands on a fruit, and all the ways that a design says occur, over which its reading is evaluated."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from cad.design.fruit import Fruit
from cad.design.parameters import Design
from cad.design.reading import Reading
from cad.quantity import validation_error
from pipeline.response.scene_press import refuse_unsolvable, scene_of
from solve.contact.poses import Pose, posed_scene
from solve.contact.scene import STEEPEST_DEG
from solve.contact.scene_cells import scene_footprints

Vector = tuple[float, float]
"""Components along and across the tips."""

LEVEL: Vector = (0.0, 0.0)
DIRECTIONS = 8
FEWEST_MODULI = 4
_AXES = {0: "+x", 90: "+y", 180: "-x", -180: "-x", -90: "-y"}  # by their angle to +x [deg]


@dataclass(frozen=True, kw_only=True)
class Placement:
    """How a sensor stands on a fruit: tilt [deg] and distance from the apex [mm] along and across, radius [mm]."""

    tilt_deg: Vector = LEVEL
    off_centre_mm: Vector = LEVEL
    radius_mm: float | None = None

    @property
    def off_by(self) -> tuple[str, ...]:
        """Return what is not as it should be: tilt, off_centre, radius."""
        off = {"tilt": any(self.tilt_deg), "off_centre": any(self.off_centre_mm), "radius": self.radius_mm is not None}
        return tuple(name for name, is_off in off.items() if is_off)

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
        """Return the placement in words; it is the tips on the side named that are lower."""
        tilt = math.hypot(*self.tilt_deg)
        off = math.hypot(*self.off_centre_mm)
        parts = [f"tilted {tilt:.2g} deg down towards {_direction(self.tilt_deg)}" if tilt else "level"]
        if off:
            parts.append(f"{off:.2g} mm off the apex towards {_direction(self.off_centre_mm)}")
        if self.radius_mm:
            parts.append(f"on a radius of {self.radius_mm:.3g} mm")
        return ", ".join(parts)


def _direction(vector: Vector) -> str:
    """Return in words where a vector along and across the tips points: along an axis, or by its angle to +x."""
    angle = round(math.degrees(math.atan2(vector[1], vector[0])))
    return _AXES.get(angle, f"{angle} deg from +x")


def directed(length: float) -> list[Vector]:
    """Return vectors of a length [its unit] in equally spaced directions; a single one of length 0."""
    if length == 0.0:
        return [LEVEL]
    angles = [2.0 * math.pi * k / DIRECTIONS for k in range(DIRECTIONS)]
    return [(length * math.cos(angle), length * math.sin(angle)) for angle in angles]


def read_moduli(fruit: Fruit) -> tuple[float, ...]:
    """Return the moduli at which readings are evaluated [MPa]: those shown, at least four up to E_max."""
    shown = sorted({*fruit.E_MPa, fruit.E_max_MPa})
    if len(shown) >= FEWEST_MODULI or shown[0] == shown[-1]:
        return tuple(shown)
    return tuple(np.geomspace(shown[0], shown[-1], FEWEST_MODULI).tolist())


def radii(fruit: Fruit, reading: Reading) -> tuple[float | None, ...]:
    """Return the radii of the fruits that occur [mm], the design's first; None stands for the design's own shape."""
    spread = reading.radius_spread
    if fruit.radius_mm is None or spread == 0.0:
        return (None,)
    return (None, fruit.radius_mm * (1.0 - spread), fruit.radius_mm * (1.0 + spread))


def occurring(design: Design, reading: Reading) -> Iterator[Placement]:
    """Yield how the sensor may stand, level in the middle first: each radius with tilts and offsets in all directions.

    A sensor off the centre of a sphere stands as one that is tilted: with the tilt and against it are the extremes.
    """
    for radius, fraction in itertools.product(radii(design.fruit, reading), (0.0, 0.5, 1.0)):
        for tilt in directed(fraction * reading.tilt_deg) if fraction else [LEVEL]:
            yield Placement(tilt_deg=tilt, radius_mm=radius)
            for position in _off_centre(tilt, reading.off_centre_mm):
                yield Placement(tilt_deg=tilt, off_centre_mm=position, radius_mm=radius)


def _off_centre(tilt: Vector, distance: float) -> list[Vector]:
    """Return positions at a distance [mm] from the apex: along a tilt both ways, all directions for a level press."""
    if distance == 0.0:
        return []
    length = math.hypot(*tilt)
    if length == 0.0:
        return directed(distance)
    return [(sign * distance * tilt[0] / length, sign * distance * tilt[1] / length) for sign in (-1.0, 1.0)]


def refuse_unsolvable_poses(design: Design) -> None:
    """Raise InputError where contact cannot be solved in the scene of a design, or in a pose of its reading.

    Solves nothing.
    """
    refuse_unsolvable(design)
    reading = design.reading
    if reading is None:
        return
    scene = scene_of(design)
    for placement in occurring(design, reading):
        posed = posed_scene(scene, placement.pressed(design.fruit.E_max_MPa, design.press.travel_mm))
        if posed.steepest_deg <= STEEPEST_DEG:
            continue
        bound = (
            f"such that no tip meets the fruit at more than {STEEPEST_DEG:g} deg, here {posed.steepest_deg:.3g} "
            f"deg where the sensor is {placement}"
        )
        remedy = "take less tilt, a place nearer to the apex, or a smaller spread of radius"
        if reading.off_centre_mm and not any(placement.tilt_deg):
            raise validation_error("reading.off_centre_mm", reading.off_centre_mm, "mm", bound, remedy)
        raise validation_error("reading.tilt_deg", reading.tilt_deg, "deg", bound, remedy)
    if not scene.tips.tip_shape.obeys_hertz:  # all poses are solved on the cells of the most tilted one
        tilted = replace(scene.press, tilt_deg=reading.tilt_deg)
        scene_footprints(replace(scene, press=tilted), design.press.travel_mm)
