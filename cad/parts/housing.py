"""The dimensions and the profile of the printable housing: a frame, two flexures and two tips in one plate.

In the sensor frame, the x axis runs along the tips, with the low tip at -x. The y axis runs through the depth of the
plate, which lies in |y| <= depth / 2. The z axis is opposite to the direction of the press, with both tip faces at
z = 0. All lengths are in mm.

A sensor with a square of four tips consists of two such plates, mounted back to back.
"""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

from sensor.design.tips import PressMotion
from sensor.quantity import Bounds, InputError, check_fields, quantity, report_field, validation_error
from sensor.theory.leaf_spring import Flexure

Point = tuple[float, float]
HeldBy = Literal["covers", "washers", "holes"]
"""How the frame is held: clamped by covers or washers, or fixed at the walls of its holes, which is for comparisons."""
SETBACK_MM = 1.0  # distance of the rim of a cover, or of a pad, from each edge beside a moving part
TILT_DEG = 3.0  # largest tilt of a sensor that a hand or a gripper holds level
ENGRAVED_MM = 0.3  # depth of the marks on the frame
DOWEL_MM = 3.0  # diameter of the dowels between two plates, ISO 8734
_HINT = "choose another process, other tips or other targets"
_POSITIVE = Bounds(above=0.0)


@dataclass(frozen=True, kw_only=True)
class Arm:
    """One spring of the housing with its shuttle and its wall.

    `sign` is -1 for the left arm and 1 for the right arm. The following fields are x coordinates [mm]. `centre` is the
    position of the tip's axis. `wall` and `shuttle` are the roots of the leaves. The post, which the screws hold,
    extends from `post` to `outer`, the outer side of the wall. The post is the whole wall, except in back-to-back
    plates, where the wall of the shorter arm is wider.

    `levels` are z [mm] of the mid-planes of the lower and the upper leaf, and `top_level` is z of the top of the
    shuttle. `holes` are the centres (x, z) of the lower and the upper screw hole [mm].
    """

    name: str
    flexure: Flexure
    sign: float
    centre: float
    shuttle: float
    wall: float
    post: float
    outer: float
    levels: tuple[float, float]
    top_level: float
    holes: tuple[Point, ...]

    @property
    def roots(self) -> tuple[float, float]:
        """Return the x coordinates of the left and the right end of the leaves [mm]."""
        return min(self.wall, self.shuttle), max(self.wall, self.shuttle)


@dataclass(frozen=True, kw_only=True)
class _HousingFeature:
    """A feature that only some housings have. All its sizes must be greater than 0."""

    HINT: ClassVar[str] = _HINT

    def __post_init__(self) -> None:
        """Raise InputError for a size that is not greater than 0."""
        check_fields(self, "housing")


@dataclass(frozen=True, kw_only=True)
class Pin(_HousingFeature):
    """A ground steel pin that is glued into a pocket in the foot of a shuttle [mm]."""

    side: float = quantity(
        "mm",
        _POSITIVE,
        meaning="side or diameter of a pin; this and the other sizes of pins are 0 if the tips are printed",
        key="pin_side",
    )
    is_round: bool = report_field("", "true for a round pin", key="pin_round")
    protruding_length: float = quantity("mm", _POSITIVE, meaning="length of a pin outside its foot", key="pin_out")
    pocket_side: float = quantity("mm", _POSITIVE, meaning="width of the pocket for a pin")
    pocket_depth: float = quantity("mm", _POSITIVE, meaning="depth of the pocket for a pin")

    def __post_init__(self) -> None:
        """Raise InputError for a size that is not greater than 0, or for a pocket that is not wider than the pin."""
        super().__post_init__()
        if self.pocket_side <= self.side:
            raise _size_error("pocket_side", self.pocket_side, f"greater than {self.side:g} mm")

    @property
    def length(self) -> float:
        """Return the total length of the pin [mm], outside and inside its foot."""
        return self.protruding_length + self.pocket_depth

    @property
    def square_area_ratio(self) -> float:
        """Return the cross-sectional area divided by the area of a square with the same side or diameter [1].

        The perimeters have the same ratio.
        """
        return 0.25 * math.pi if self.is_round else 1.0


@dataclass(frozen=True, kw_only=True)
class DomeCap(_HousingFeature):
    """The spherical cap of a printed tip, with its apex at z = 0 [mm]."""

    radius: float = quantity(
        "mm", _POSITIVE, meaning="radius of the domes at the tips; 0 for flat tips", key="dome_radius"
    )


@dataclass(frozen=True, kw_only=True)
class BackToBack(_HousingFeature):
    """The features of a plate that is mounted back to back with a second, equal plate [mm].

    The second plate is rotated by 180 degrees about the press axis. The plates touch each other with the pads on their
    back faces, y = depth / 2, and two dowels align them.
    """

    pad_height: float = quantity(
        "mm", _POSITIVE, meaning="height of the pads on the back of the frame; 0 for a plate that stands alone"
    )
    dowel_hole: float = quantity(
        "mm", _POSITIVE, meaning="diameter of the holes for two dowels; 0 for a plate that stands alone"
    )

    @property
    def gap(self) -> float:
        """Return the distance between the back faces of the two plates [mm]."""
        return 2.0 * self.pad_height


@dataclass(frozen=True, kw_only=True)
class Housing:
    """Every dimension of the housing [mm]. Levels are heights z above the printed tip faces.

    With pins, the printed tips are the feet in which the pins are glued, and the pins touch the fruit below z = 0. A
    plate that is mounted back to back with a second one has a symmetric frame.
    """

    low: Flexure = report_field("", "leaves of the low spring")
    high: Flexure = report_field("", "leaves of the high spring")
    tip_side: float = report_field("mm", "side of the printed tip, at least `tips.side_mm`, or of the foot of a pin")
    tip_height: float = report_field("mm", "height of the straight part of the tip or foot")
    spacing: float = report_field("mm", "distance between the centres of the tips")
    shuttle_width: float = report_field("mm", "width of the shuttles, the bars between the leaves")
    neck_level: float = report_field("mm", "level at which a shuttle begins to taper towards its tip")
    lower_leaf_level: float = report_field("mm", "level of the mid-plane of the lower leaves")
    low_top_level: float = report_field("mm", "level of the top of the low shuttle")
    high_top_level: float = report_field("mm", "level of the top of the high shuttle")
    cavity_level: float = report_field("mm", "level of the stop above both shuttles")
    top_level: float = report_field("mm", "level of the top of the frame")
    protrusion: float = report_field("mm", "distance by which the tips protrude below the frame")
    wall_width: float = report_field("mm", "width of the frame's side walls", default=8.0)
    hole_diameter: float = report_field("mm", "diameter of the screw holes", default=3.4)
    hole_inset: float = report_field(
        "mm", "distance of the centres of the screw holes from the nearest horizontal edge of the frame", default=4.5
    )
    mount: HeldBy = report_field("", "parts that clamp the frame, `covers` or `washers`", default="holes")
    cover_level: float = report_field("mm", "level of the lower edge of the covers", default=0.0)
    pin: Pin | None = report_field("", "the pin in each foot", default=None, flat=Pin, has_key=False)
    dome: DomeCap | None = report_field("", "the dome of each printed tip", default=None, flat=DomeCap, has_key=False)
    back_to_back: BackToBack | None = report_field(
        "", "true for one of two plates that are mounted back to back", default=None, flat=BackToBack
    )

    def __post_init__(self) -> None:
        """Raise InputError for a tip, a shuttle or a pocket whose size is not positive or too large for the housing."""
        largest_side = min(self.depth, self.shuttle_width)
        if not 0.0 < self.tip_side <= largest_side:
            raise _size_error("tip_side", self.tip_side, f"greater than 0 mm and at most {largest_side:g} mm")
        if not 0.0 < self.shuttle_width < self.spacing:
            bound = f"greater than 0 mm and less than {self.spacing:g} mm"
            raise _size_error("shuttle_width", self.shuttle_width, bound)
        if self.pin is not None:
            half_foot = 0.5 * self.tip_side
            # The pocket ends in a gable, whose ridge is at the distance `pocket_side` from the axis of the foot.
            if self.pin.pocket_side >= half_foot:
                raise _size_error("pocket_side", self.pin.pocket_side, f"less than {half_foot:g} mm")
            if self.pin.pocket_depth >= self.neck_level:
                raise _size_error("pocket_depth", self.pin.pocket_depth, f"less than {self.neck_level:g} mm")

    @property
    def depth(self) -> float:
        """Return the depth of the plate [mm], which is also the depth of both flexures."""
        return self.low.depth

    @property
    def arms(self) -> tuple[Arm, ...]:
        """Return the arms from left to right, which are the low arm and the high arm."""
        return (
            self._arm("low", -1.0, self.low, self.low_top_level),
            self._arm("high", 1.0, self.high, self.high_top_level),
        )

    def _arm(self, name: str, sign: float, flexure: Flexure, top_level: float) -> Arm:
        """Return the arm on the left (`sign` = -1) or on the right (`sign` = 1), with its positions in x and z [mm].

        `flexure` is its spring, and `top_level` [mm] is the level of the top of its shuttle. In back-to-back plates,
        both posts are placed for the longer leaf. The frame is then symmetric, so that the holes of both plates are
        aligned.
        """
        shuttle_x = sign * 0.5 * (self.spacing + self.shuttle_width)  # outer side of the shuttle, where the leaves end
        longest = max(self.low.length, self.high.length) if self.back_to_back else flexure.length
        post_x = shuttle_x + sign * longest
        hole_x = post_x + sign * 0.5 * self.wall_width
        lower_hole = (hole_x, self.protrusion + self.hole_inset)
        upper_hole = (hole_x, self.top_level - self.hole_inset)
        return Arm(
            name=name,
            flexure=flexure,
            sign=sign,
            centre=sign * 0.5 * self.spacing,
            shuttle=shuttle_x,
            wall=shuttle_x + sign * flexure.length,
            post=post_x,
            outer=post_x + sign * self.wall_width,
            levels=(self.lower_leaf_level, self.lower_leaf_level + flexure.separation),
            top_level=top_level,
            holes=(lower_hole, upper_hole),
        )

    def with_flexures(self, flexures: Mapping[str, Flexure]) -> "Housing":
        """Return a copy of the housing with the given flexures [mm] on the arms that are named `low` or `high`."""
        return replace(self, low=flexures.get("low", self.low), high=flexures.get("high", self.high))

    @property
    def left(self) -> float:
        """Return the x coordinate of the outer left face [mm]."""
        return self.arms[0].outer

    @property
    def right(self) -> float:
        """Return the x coordinate of the outer right face [mm]."""
        return self.arms[-1].outer

    @property
    def holes(self) -> tuple[Point, ...]:
        """Return the centres (x, z) of the screw holes [mm]. Each wall has two."""
        return tuple(hole for arm in self.arms for hole in arm.holes)

    @property
    def corner(self) -> float:
        """Return the radius of all inner corners [mm], including the roots of the leaves."""
        return self.low.fillet

    @property
    def touching_side(self) -> float:
        """Return the side or diameter [mm] of the part that touches the fruit, which is a pin or a printed tip."""
        return self.tip_side if self.pin is None else self.pin.side

    @property
    def beyond_face(self) -> float:
        """Return the distance [mm] by which pins extend below the printed face, or 0 without pins."""
        return 0.0 if self.pin is None else self.pin.protruding_length

    @property
    def plates(self) -> int:
        """Return the number of plates in a sensor: two if they are mounted back to back, and otherwise one."""
        return 2 if self.back_to_back else 1

    @property
    def stack(self) -> float:
        """Return the thickness of the plate [mm], or of both plates including the gap between them."""
        return self.spacing + self.depth if self.back_to_back else self.depth

    @property
    def dowels(self) -> tuple[Point, ...]:
        """Return the centres (x, z) of the dowel holes in the pad on the bar [mm]. A single plate has none."""
        if self.back_to_back is None:
            return ()
        level = 0.5 * (self.cavity_level + SETBACK_MM + self.top_level)
        return tuple((arm.post - arm.sign * self.back_to_back.dowel_hole, level) for arm in self.arms)

    def shuttle_volume(self, arm: Arm) -> float:
        """Return the volume of a shuttle [mm^3], including its tapered neck and its tip."""
        block_area = self.shuttle_width * self.depth
        tip_area = self.tip_side**2
        block_volume = block_area * (arm.top_level - self.neck_level)
        # The neck is approximated by a truncated pyramid between the section of the block and the face of the tip.
        neck_height = self.neck_level - self.tip_height
        neck_volume = neck_height * (block_area + tip_area + math.sqrt(block_area * tip_area)) / 3.0
        return block_volume + neck_volume + tip_area * self.tip_height

    def depth_share(self, z: float) -> float:
        """Return the fraction of the plate's depth that is solid at height z [mm], below 1 in tips and necks."""
        tip_fraction = self.tip_side / self.depth
        neck_position = (z - self.tip_height) / (self.neck_level - self.tip_height)  # from 0 at the tip to 1
        return tip_fraction + (1.0 - tip_fraction) * min(1.0, max(0.0, neck_position))


def _size_error(name: str, value: float, bound: str) -> InputError:
    """Return the error for a size [mm] of the housing that is outside its bound."""
    return validation_error(f"housing.{name}", value, "mm", bound, _HINT)


@dataclass(frozen=True, kw_only=True)
class PartSize:
    """The volume [mm^3] and the surface area [mm^2] of a solid, and the area [mm^2] of each named face."""

    volume: float
    surface: float
    areas: Mapping[str, float]


def press_tilt(press: PressMotion) -> float:
    """Return the angle [deg] between the press axis and the normal of the fruit, which results from tilt and roll."""
    cosine = math.cos(math.radians(press.tilt_deg)) * math.cos(math.radians(press.roll_deg))
    return math.degrees(math.acos(cosine))


def largest_tilt(press: PressMotion) -> float:
    """Return the largest tilt [deg] at which the frame must not touch the fruit."""
    return max(TILT_DEG, press_tilt(press))


def profile(housing: Housing) -> list[Point]:
    """Return the corners (x, z) of the outline of the plate [mm], without its windows and holes."""
    left, right = housing.arms
    bottom, top = housing.protrusion, housing.top_level
    outer_corners = [(right.outer, bottom), (right.outer, top), (left.outer, top), (left.outer, bottom)]
    return [*_arm_outline(housing, left), *reversed(_arm_outline(housing, right)), *outer_corners]


def _arm_outline(housing: Housing, arm: Arm) -> list[Point]:
    """Return the outline (x, z) of an arm [mm], from the lower edge of its wall to the corner of the cavity.

    The outline runs along the underside of the lower leaf, around the neck and the tip, and up the inner side of the
    shuttle. It then returns along the top of the upper leaf. The window between the leaves is cut later.
    """
    lower_leaf, upper_leaf = arm.levels
    half_leaf = 0.5 * arm.flexure.thickness
    underside = lower_leaf - half_leaf
    topside = upper_leaf + half_leaf
    # These half widths have the sign of the arm: positive steps lead towards the wall, and negative steps inwards.
    half_shuttle = arm.sign * 0.5 * housing.shuttle_width
    half_tip = arm.sign * 0.5 * housing.tip_side
    inner_side = arm.centre - half_shuttle
    return [
        (arm.wall, housing.protrusion),
        (arm.wall, underside),
        (arm.shuttle, underside),
        (arm.centre + half_shuttle, housing.neck_level),
        (arm.centre + half_tip, housing.tip_height),
        (arm.centre + half_tip, 0.0),
        (arm.centre - half_tip, 0.0),
        (arm.centre - half_tip, housing.tip_height),
        (inner_side, housing.neck_level),
        (inner_side, arm.top_level),
        (arm.shuttle, arm.top_level),
        (arm.shuttle, topside),
        (arm.wall, topside),
        (arm.wall, housing.cavity_level),
    ]


def fillet_corners(housing: Housing) -> list[Point]:
    """Return the position (x, z) of every rounded corner [mm]. Each flexure has eight, and the cavity has two."""
    corners = [(arm.wall, housing.cavity_level) for arm in housing.arms]
    for arm in housing.arms:
        half_leaf = 0.5 * arm.flexure.thickness
        for level, x in itertools.product(arm.levels, (arm.wall, arm.shuttle)):
            corners.append((x, level - half_leaf))
            corners.append((x, level + half_leaf))
    return corners
