"""Which points lie inside the parts of a sensor: written from the lengths of its design, without the constructor.

Frame of a plate [mm]: x along the tips, y across from the front to the back, z against the press. Leaves are printed.
"""

import math

import numpy as np

from cad.parts.hall_seats import HallSeats
from cad.parts.housing import Housing
from cad.parts.sensor import SensorSolids
from sensor.design.tips import PressMotion

SETBACK = 1.0  # of a rim or a pad from what moves
BALL_SHARE = 0.98  # of the radius of a dome, to which a round cap reaches
CONE_END = 0.25  # radius of the end of a pocket that closes at 45 degrees
COVER, RECESS, LEDGE = 3.0, 1.0, 0.9
BLOCK, PAD, WEIGHT_HOLE, CLAMP_HOLE = (24.0, 12.0), 7.0, 2.5, 3.4  # of a coupon
BRACKET, HEAD_ROOM, WASHER = 5.0, 8.0, 0.5  # thicknesses, and the room for the heads of ISO 9409-1-50-4-M6
FLANGE, CIRCLE, FLANGE_HOLE, FLANGE_HEAD = 63.0, 50.0, 6.6, 10.0


def inside_box(x, z, x_range, z_range):
    return (x >= x_range[0]) & (x <= x_range[1]) & (z >= z_range[0]) & (z <= z_range[1])


def in_hole(x, z, middle, diameter):
    return np.hypot(x - middle[0], z - middle[1]) < 0.5 * diameter


def in_fillet(x, z, corner, away, radius):
    """Say which points a fillet adds at a corner; `away` are the signs of x and z into the open quarter."""
    u, v = away[0] * (x - corner[0]), away[1] * (z - corner[1])
    is_near = (u >= 0.0) & (v >= 0.0) & (u <= radius) & (v <= radius)
    return is_near & (np.hypot(u - radius, v - radius) >= radius)


class ArmSizes:
    """Places of one arm along its own side: x counts from the middle of the sensor towards this arm's wall."""

    def __init__(self, housing: Housing, name: str) -> None:
        self.flexure = getattr(housing, name)
        self.top = getattr(housing, f"{name}_top_level")
        self.centre = 0.5 * housing.spacing
        self.inner = self.centre - 0.5 * housing.shuttle_width
        self.shuttle = self.centre + 0.5 * housing.shuttle_width
        self.wall = self.shuttle + self.flexure.length
        longest = max(housing.low.length, housing.high.length)
        self.post = self.shuttle + longest if housing.back_to_back else self.wall
        self.outer = self.post + housing.wall_width
        self.levels = (housing.lower_leaf_level, housing.lower_leaf_level + self.flexure.separation)
        hole = self.post + 0.5 * housing.wall_width
        self.holes = (
            (hole, housing.protrusion + housing.hole_inset),
            (hole, housing.top_level - housing.hole_inset),
        )


def inside_housing(housing: Housing, seats: HallSeats | None, points: np.ndarray) -> np.ndarray:
    """Say which points (n, 3) lie in a housing without marks, or in a plate of a square with its pads."""
    x, y, z = points.T
    half = 0.5 * housing.depth
    found = np.zeros(len(points), dtype=bool)
    for name, sign in (("low", -1.0), ("high", 1.0)):
        arm = ArmSizes(housing, name)
        found |= (sign * x >= 0.0) & _in_side(housing, arm, seats, np.stack([sign * x, y, z], axis=1))
    found &= np.abs(y) <= half
    if plates := housing.back_to_back:
        found |= (y >= half) & (y <= half + plates.pad_height) & _in_pad(housing, x, z)
    return found & ~_drilled(housing, x, z)


def _in_side(housing: Housing, arm: ArmSizes, seats: HallSeats | None, points: np.ndarray) -> np.ndarray:
    x, y, z = points.T
    flexure, radius = arm.flexure, arm.flexure.fillet
    across = (0.0, arm.outer)
    found = inside_box(x, z, (arm.wall, arm.outer), (housing.protrusion, housing.top_level))
    found |= inside_box(x, z, across, (housing.cavity_level, housing.top_level))
    found |= in_fillet(x, z, (arm.wall, housing.cavity_level), (-1, -1), radius)
    for level in arm.levels:
        for side in (-1, 1):
            face = level + 0.5 * side * flexure.thickness
            found |= in_fillet(x, z, (arm.wall, face), (-1, side), radius)
            found |= in_fillet(x, z, (arm.shuttle, face), (1, side), radius)
        faces = (level - 0.5 * flexure.thickness, level + 0.5 * flexure.thickness)
        found |= inside_box(x, z, (arm.shuttle, arm.wall), faces)
    found |= inside_box(x, z, (arm.inner, arm.shuttle), (housing.neck_level, arm.top))
    rise = np.clip((z - housing.tip_height) / (housing.neck_level - housing.tip_height), 0.0, 1.0)
    half_width = 0.5 * (housing.tip_side + rise * (housing.shuttle_width - housing.tip_side))
    half_depth = 0.5 * (housing.tip_side + rise * (housing.depth - housing.tip_side))
    end = (z >= 0.0) & (z <= housing.neck_level)
    end &= (np.abs(x - arm.centre) <= half_width) & (np.abs(y) <= half_depth)
    if housing.dome:
        radius = housing.dome.radius
        cap = min(BALL_SHARE * radius, housing.tip_height)
        from_centre = np.linalg.norm(points - (arm.centre, 0.0, radius), axis=1)
        end &= (z > cap) | (from_centre <= radius)
    found |= end
    if pin := housing.pin:
        gable = y if housing.back_to_back else -y  # the ridge lies up in print
        half = 0.5 * pin.pocket_side
        u = np.abs(x - arm.centre)
        section = (u <= half) & (gable >= -half) & ((gable <= half) | (u <= 2.0 * half - gable))
        found &= ~(section & (z <= pin.pocket_depth))
    if seats is not None:
        into = y + 0.5 * housing.depth
        for below in (seats.upper_disc, seats.lower_disc):
            from_axis = np.hypot(x - arm.centre, z - (housing.top_level - below))
            radius = 0.5 * seats.pocket_diameter
            found &= ~((from_axis < radius) & (into < seats.pocket_depth))
            if seats.is_pointed:
                beyond = into - seats.pocket_depth
                cone = (beyond >= 0.0) & (beyond <= radius - CONE_END) & (from_axis < radius - beyond)
                found &= ~cone
    return found


def _holes(housing: Housing) -> list[tuple[float, float]]:
    sides = (("low", -1.0), ("high", 1.0))
    return [(sign * x, z) for name, sign in sides for x, z in ArmSizes(housing, name).holes]


def _ends(housing: Housing) -> tuple[float, float]:
    return -ArmSizes(housing, "low").outer, ArmSizes(housing, "high").outer


def _drilled(housing: Housing, x: np.ndarray, z: np.ndarray) -> np.ndarray:
    found = np.zeros(len(x), dtype=bool)
    for hole in _holes(housing):
        found |= in_hole(x, z, hole, housing.hole_diameter)
    if plates := housing.back_to_back:
        level = 0.5 * (housing.cavity_level + SETBACK + housing.top_level)
        for name, sign in (("low", -1.0), ("high", 1.0)):
            dowel = (sign * (ArmSizes(housing, name).post - plates.dowel_hole), level)
            found |= in_hole(x, z, dowel, plates.dowel_hole)
    return found


def _in_pad(housing: Housing, x: np.ndarray, z: np.ndarray) -> np.ndarray:
    left, right = _ends(housing)
    post = housing.wall_width - SETBACK
    foot = max(housing.cover_level, housing.protrusion)
    outline = inside_box(x, z, (left, right), (foot, housing.top_level))
    return outline & ~((x > left + post) & (x < right - post) & (z < housing.cavity_level + SETBACK))


def inside_cover(housing: Housing, seats: HallSeats | None, points: np.ndarray) -> np.ndarray:
    """Say which points (n, 3) lie in a back cover, whose windows are mirrored: it is turned to the front."""
    x, y, z = points.T
    out = y - 0.5 * housing.depth
    left, right = _ends(housing)
    post = housing.wall_width - SETBACK
    found = (out >= 0.0) & (out <= COVER) & inside_box(x, z, (left, right), (housing.cover_level, housing.top_level))
    found &= ~((out < RECESS) & (x > left + post) & (x < right - post) & (z < housing.cavity_level + SETBACK))
    for hole in _holes(housing):
        found &= ~in_hole(x, z, hole, housing.hole_diameter)
    for window in () if seats is None else seats.windows:
        mirrored = left + right - window
        from_level = np.abs(z - (housing.top_level - seats.sensor_level))
        half = 0.5 * seats.window_height
        open_half = np.where(out >= seats.face_distance, half, half - LEDGE)
        found &= ~((np.abs(x - mirrored) < 0.5 * seats.window_width) & (from_level < open_half))
    return found


def inside_bracket(sensor: SensorSolids, points: np.ndarray) -> np.ndarray:
    """Say which points (n, 3) of the sensor frame lie in the bracket for a flange ISO 9409-1-50-4-M6."""
    housing, seats = sensor.housing, sensor.seats
    x, y, z = points.T
    left, right = _ends(housing)
    has_covers = housing.mount == "covers"
    stack = housing.spacing + housing.depth if housing.back_to_back else housing.depth
    back = 0.5 * stack + (COVER if has_covers else WASHER)
    shelf = housing.top_level + HEAD_ROOM
    foot = housing.cover_level + math.ceil(10.0 * BRACKET * math.tan(math.radians(worst_tilt(sensor.press)))) / 10.0
    upright = (y >= back) & (y <= back + BRACKET) & inside_box(x, z, (left, right), (foot, shelf + BRACKET))
    behind = max(back + BRACKET, 0.5 * CIRCLE + 6.0)
    level = inside_box(x, y, (-0.5 * FLANGE, 0.5 * FLANGE), (-0.5 * FLANGE, behind))
    found = upright | (level & (z >= shelf) & (z <= shelf + BRACKET))
    for hole in _holes(housing):
        found &= ~in_hole(x, z, hole, housing.hole_diameter)
    turn = 0.0 if back >= 0.5 * FLANGE_HEAD + 1.0 else 45.0
    for quarter in range(4):
        angle = math.radians(turn + 90.0 * quarter)
        screw = (0.5 * CIRCLE * math.cos(angle), 0.5 * CIRCLE * math.sin(angle))
        found &= ~(in_hole(x, y, screw, FLANGE_HOLE) & (z >= shelf - 1.0) & (z <= shelf + BRACKET + 1.0))
    if seats is not None and has_covers and housing.back_to_back:
        half = max(seats.windows) + 0.5 * seats.window_width + 1.0
        start = housing.top_level - seats.sensor_level - 0.5 * seats.window_height - 1.0
        window = inside_box(x, z, (-half, half), (start, start + seats.window_height + 6.0))
        found &= ~(window & (y >= back - 1.0) & (y <= back + BRACKET + 1.0))
    return found


def worst_tilt(press: PressMotion) -> float:
    """Return the larger of 3 degrees and the angle of press and normal [deg]."""
    cosine = math.cos(math.radians(press.tilt_deg)) * math.cos(math.radians(press.roll_deg))
    return max(3.0, math.degrees(math.acos(cosine)))


def inside_coupon(housing: Housing, points: np.ndarray) -> np.ndarray:
    """Say which points (n, 3) lie in the coupon: a clamped block with a leaf of each spring and a pad at its end."""
    x, y, z = points.T
    width, height = BLOCK
    found = inside_box(x, z, (-0.5 * width, 0.5 * width), (-0.5 * height, 0.5 * height))
    holes = np.zeros(len(points), dtype=bool)
    for sign, flexure in ((-1.0, housing.low), (1.0, housing.high)):
        u = sign * x
        root, end = 0.5 * width, 0.5 * width + flexure.length
        half = 0.5 * flexure.thickness
        found |= inside_box(u, z, (root, end), (-half, half)) | inside_box(
            u, z, (end, end + PAD), (-0.5 * PAD, 0.5 * PAD)
        )
        for side in (-1, 1):
            found |= in_fillet(u, z, (root, side * half), (1, side), housing.low.fillet)
            found |= in_fillet(u, z, (end, side * half), (-1, side), housing.low.fillet)
        holes |= in_hole(u, z, (end + 0.5 * PAD, 0.0), WEIGHT_HOLE)
        holes |= in_hole(u, z, (root - 6.0, 0.0), CLAMP_HOLE)
    return found & ~holes & (np.abs(y) <= 0.5 * housing.depth)
