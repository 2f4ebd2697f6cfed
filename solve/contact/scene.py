"""A contact scene: the fruit, the tips, their motion, and the initial gap between tips and fruit.

The travel x is measured at the middle of the tips, from the first touch of a level sensor. Tilt and roll rotate the
sensor about this point. The tilt is the inclination along the tips, and the roll is the inclination across them.
"""

import functools
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sensor.arrays import Floats
from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips
from sensor.quantity import validation_error
from solve.contact.gap import tip_gap
from solve.fruit.curved_shape import fruit_gap, fruit_slope

Point = tuple[float, float]  # along the tips, across

# Largest slope at which the small-slope approximation is used for gaps and forces. 1 / cos(slope) - 1 is then 6 %.
STEEPEST_DEG = 20.0
# Tolerances in the search for the smallest gap under a tip, in units of the tip's side.
POSITION_TOLERANCE = 1e-9
GAP_TOLERANCE = 1e-14


@dataclass(frozen=True, eq=False)
class LateralCompliance:
    """The compliance of tips on their springs under lateral forces, in addition to the compliance along the press.

    The last two axes of `compliance` (tips, tips, 3, 3) [mm/N] are the directions along the tips, across them, and up
    the sensor. It applies at the faces of flat tips, and at the sphere centres of domes. The entries for upward motion
    under upward forces are 0, because the compliance of the springs includes them. `error` [1] is the relative error.
    """

    compliance: Floats
    error: float


@dataclass(frozen=True, kw_only=True)
class Scene:
    """The fruit, the tips, and the motion that presses the tips against the fruit.

    `height_offset_mm` is the offset of each tip from the level plane of the sensor. It is at most 0, and a negative
    offset retracts the tip from the fruit. It is caused by the sag of the springs, and is empty for level tips. The
    designed protrusion of the tips is part of `tips`; travel starts at the first touch with this protrusion.
    `off_centre_mm` is the position error of the sensor on the fruit, along the tips and across. `sideways` is used only
    for domes.

    With `from_touch`, travel is along the axis of the sensor, and starts at the first touch in this pose. Since the
    first touch, the sensor has rotated about the middle of the tips. `tilt_change_deg` is the change in tilt, along the
    tips and across.
    """

    fruit: Fruit
    tips: Tips
    press: PressMotion
    height_offset_mm: tuple[float, ...] = ()
    off_centre_mm: Point = (0.0, 0.0)
    sideways: LateralCompliance | None = None
    from_touch: bool = False
    tilt_change_deg: Point = (0.0, 0.0)

    @property
    def obeys_linear_law(self) -> bool:
        """Return whether the linear law applies, because level flat faces press flat flesh.

        Each face then touches as a whole or not at all.
        """
        is_level = self.press.tilt_deg == 0.0 and self.press.roll_deg == 0.0
        return is_level and self.fruit.shape == "block" and self.tips.tip_shape.is_flat

    @property
    def touches_at_once(self) -> bool:
        """Return whether all tips touch at the same travel, so that the force ratio does not depend on the travel."""
        return self.obeys_linear_law and not any(self.height_offset_mm)

    @property
    def is_symmetric(self) -> bool:
        """Return whether the contact is symmetric about the plane y = 0, in which all tips lie."""
        return self.press.roll_deg == 0.0 and self.fruit.is_symmetric and all(y == 0.0 for _, y in self.centres)

    @cached_property
    def centres(self) -> tuple[Point, ...]:
        """Return the positions x, y of the tip centres relative to the apex [mm]."""
        along, across = self.off_centre_mm
        return tuple((x + along, y + across) for x, y in self.tips.places_mm)

    @cached_property
    def height_offsets_mm(self) -> tuple[float, ...]:
        """Return the offset of each tip from the level plane of the sensor [mm]: its designed offset plus its sag.

        A negative offset retracts the tip from the fruit.
        """
        sags = self.height_offset_mm or (0.0,) * len(self.tips.height_offset_mm)
        return tuple(designed + sag for designed, sag in zip(self.tips.height_offset_mm, sags, strict=True))

    @property
    def slopes_deg(self) -> tuple[float, ...]:
        """Return the downward slope of the fruit along the tips, under the centre of each tip [deg]."""
        return tuple(float(np.degrees(np.arctan(along))) for along, _ in _fruit_slopes(self.fruit, self.centres))

    @property
    def steepest_deg(self) -> float:
        """Return the largest angle between a tip's face and the surface of the fruit under its centre [deg]."""
        along, across = self.tilt_tangents.tolist()
        slopes = [math.hypot(x - along, y - across) for x, y in _fruit_slopes(self.fruit, self.centres)]
        return math.degrees(math.atan(max(slopes)))

    @cached_property
    def tilt_tangents(self) -> Floats:
        """Return the tangents of tilt and roll [1], shape (2,), including the rotation since the first touch."""
        tilt = np.radians([self.press.tilt_deg, self.press.roll_deg])
        return np.asarray(np.tan(tilt + np.radians(self.tilt_change_deg)))

    @cached_property
    def tilt_tangents_at_touch(self) -> Floats:
        """Return the tangents of tilt and roll at the first touch [1], shape (2,)."""
        return np.tan(np.radians([self.press.tilt_deg, self.press.roll_deg]))

    @property
    def obeys_dome_law(self) -> bool:
        """Return whether the dome law applies, because the tips obey Hertz's law."""
        return self.tips.tip_shape.obeys_hertz

    @property
    def is_solved_on_cells(self) -> bool:
        """Return whether contact is solved on cells, because the contact area varies and the tips are not domes."""
        return not self.obeys_linear_law and not self.obeys_dome_law

    @property
    def is_fruit_curved(self) -> bool:
        """Return whether the fruit has a curved skin."""
        return self.fruit.radius_mm is not None

    def fruit_gap(self, x: Floats, y: Floats) -> Floats:
        """Return the gap between the fruit and the plane at its apex [mm]; it is infinite outside the fruit's plan."""
        return _fruit_gap(self.fruit, x, y)

    def gap_under(self, centre: Point, x: Floats, y: Floats) -> Floats:
        """Return the gap [mm] between the fruit and a level tip whose lowest point is on the plane at the apex.

        `centre` is the position of the tip. The points x, y [mm] are relative to it.
        """
        return _gap_under(self.fruit, self.tips, centre, x, y)

    @cached_property
    def first_touch_mm(self) -> float:
        """Return the distance that a level sensor travels from the plane at the apex to its first touch [mm]."""
        gaps = []
        for centre, height_offset in zip(self.centres, self.tips.height_offset_mm, strict=True):
            gaps.append(_smallest_gap(self.fruit, self.tips, centre) - height_offset)
        return min(gaps)


@functools.lru_cache(maxsize=256)  # many scenes differ only in the tilt of the press
def _fruit_slopes(fruit: Fruit, centres: tuple[Point, ...]) -> tuple[Point, ...]:
    """Return the slopes of the fruit along the tips and across [1], at each of the given positions [mm]."""
    if fruit.radius_mm is None:  # a flat fruit
        return ((0.0, 0.0),) * len(centres)
    return tuple(fruit_slope(fruit, x, y) for x, y in centres)


@functools.lru_cache(maxsize=256)
def _smallest_gap(fruit: Fruit, tips: Tips, centre: Point) -> float:
    """Return the smallest gap [mm] between a fruit and the face of a level tip, by the Nelder-Mead method.

    The tip is at `centre` [mm] relative to the apex, and its lowest point is on the plane at the apex. The gap is a
    convex function of the position on the face, so it has a single minimum. The result is cached, because many scenes
    have the same tips on the same fruit.
    """
    from scipy.optimize import minimize  # rarely needed, and slow to load

    side = tips.side_mm

    def relative_gap(point: Floats) -> float:
        """Return the gap at a point relative to the centre of the tip, both in units of `side`."""
        x, y = side * _move_to_face(point, tips.tip_shape.is_round)
        return float(_gap_under(fruit, tips, centre, x, y)) / side

    # The first corner of the simplex is moved from the centre towards the apex, because the gap is smallest there. A
    # size of 0.2 sides keeps all three corners on the face.
    towards_apex = -0.1 * np.sign(centre)
    simplex = np.array([towards_apex, *(towards_apex + 0.2 * np.eye(2))])
    minimum = minimize(
        relative_gap,
        towards_apex,
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "xatol": POSITION_TOLERANCE, "fatol": GAP_TOLERANCE},
    )
    return side * float(minimum.fun)


def _move_to_face(point: Floats, is_round: bool) -> Floats:
    """Return a point on the face of a tip: the given point (2,), or a point on the edge if it lies outside the face.

    Points are relative to the centre of the tip, in units of its side or diameter. The face has a radius or a half side
    of 0.5.
    """
    if is_round:
        return point / max(1.0, 2.0 * float(np.hypot(*point)))
    return np.clip(point, -0.5, 0.5)


def _fruit_gap(fruit: Fruit, x: Floats, y: Floats) -> Floats:
    """Return the gap between a fruit and the plane at its apex [mm]; it is 0 for a flat fruit."""
    return np.zeros_like(x) if fruit.radius_mm is None else fruit_gap(fruit, x, y)


def _gap_under(fruit: Fruit, tips: Tips, centre: Point, x: Floats, y: Floats) -> Floats:
    """Return the gap [mm] between a fruit and a level tip whose lowest point is on the plane at the fruit's apex.

    `centre` is the position of the tip. The points x, y [mm] are relative to it.
    """
    return _fruit_gap(fruit, centre[0] + x, centre[1] + y) + tip_gap(tips.tip_shape, x, y)


def check_scene(scene: Scene) -> None:
    """Raise InputError if a tip meets the fruit at more than 20 deg, where the small-slope approximation fails.

    The message also states the slopes of the fruit, because they can cause a large angle even in a level press.
    """
    if scene.steepest_deg > STEEPEST_DEG:
        bound = (
            f"such that no tip meets the fruit at more than {STEEPEST_DEG:g} deg, here {scene.steepest_deg:.3g} deg "
            f"with slopes of the fruit of {slopes_text(scene.slopes_deg)} deg"
        )
        hint = "press more level, or nearer to the apex"
        raise validation_error("press.tilt_deg", scene.press.tilt_deg, "deg", bound, hint)


def slopes_text(slopes: tuple[float, ...]) -> str:
    """Return slopes as text, with three significant digits; equal slopes are stated once, and opposite ones with ±."""
    texts = list(dict.fromkeys(f"{slope + 0.0:.3g}" for slope in slopes))  # the sum turns -0 into 0
    sizes = {text.removeprefix("-") for text in texts}
    if len(sizes) == 1 < len(texts):
        return f"±{sizes.pop()}"
    return " and ".join(texts)
