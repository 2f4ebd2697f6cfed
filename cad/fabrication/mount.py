"""The bracket that carries a sensor: an angle behind the sensor with the holes of a robot flange above it.

The flange is ISO 9409-1-50-4-M6: four M6 screws on a circle of 50 mm about the axis of the press. All coordinates are
in the sensor frame [mm].
"""

import math

import cadquery as cq

from cad.parts.assembly import WASHER_THICKNESS_MM, grip
from cad.parts.housing import largest_tilt
from cad.parts.part import FaceTest, Part, is_hole, named_part, on_plane
from cad.parts.sensor import SensorSolids

FLANGE_CIRCLE_MM = 50.0  # ISO 9409-1-50-4-M6
FLANGE_HOLE_MM = 6.6  # for M6, ISO 273 medium
FLANGE_MM = 63.0  # outer diameter of the flange, ISO 9409-1
FLANGE_SCREW_MM = 12.0  # length of a flange screw, of which 7 mm are in the flange
PLATE_MM = 5.0  # thickness of the bracket
HEAD_ROOM_MM = 8.0  # height of the room for the heads of the flange screws, which are 6 mm high, ISO 4762
HEAD_MM = 10.0  # diameter of the heads of the flange screws, ISO 4762
_BESIDE_SENSOR = 1.0  # clearance between Hall sensors and the edges of a window
_ROOM_FOR_WIRES = 6.0  # height of a window beyond the height of its sensors
_BEHIND = 6.0  # material behind the rearmost hole of the flange
_REACH = 1.0  # extension of a cut beyond the plate, and clearance of the screw heads


def back_of(sensor: SensorSolids) -> float:
    """Return the coordinate y of the face behind cover or washers, against which the bracket is screwed [mm]."""
    return 0.5 * grip(sensor) + _washer_before_bracket(sensor)


def _washer_before_bracket(sensor: SensorSolids) -> float:
    """Return the thickness of the washers between frame and bracket [mm]; 0 with covers, which need none."""
    return 0.0 if sensor.housing.mount == "covers" else WASHER_THICKNESS_MM


def mounted_grip(sensor: SensorSolids) -> float:
    """Return the thickness that the four screws of the sensor clamp with the bracket, end washers excluded [mm]."""
    return grip(sensor) + _washer_before_bracket(sensor) + PLATE_MM


def flange_holes(sensor: SensorSolids) -> tuple[tuple[float, float], ...]:
    """Return x and y of the holes for the flange screws [mm].

    The holes are on the axes if the sensor is thick, and else on the diagonals. So the heads clear the upright plate.
    """
    half = 0.5 * FLANGE_CIRCLE_MM
    if back_of(sensor) >= 0.5 * HEAD_MM + _REACH:
        return (half, 0.0), (0.0, half), (-half, 0.0), (0.0, -half)
    side = math.sqrt(0.5) * half
    return (side, side), (-side, side), (-side, -side), (side, -side)


def mount_solid(sensor: SensorSolids) -> cq.Solid:
    """Return the bracket in its place behind the sensor [mm]: an upright plate and a shelf, with their holes."""
    housing = sensor.housing
    back = back_of(sensor)
    through = PLATE_MM + 2.0 * _REACH
    body = cq.Workplane(obj=upright(sensor).fuse(shelf(sensor)).clean())
    behind_plate = cq.Workplane("XZ", origin=(0.0, back + PLATE_MM + _REACH, 0.0))  # extrudes along -y
    screw_holes = behind_plate.pushPoints(list(housing.holes)).circle(0.5 * housing.hole_diameter)
    body = body.cut(screw_holes.extrude(through))
    under_shelf = cq.Workplane("XY", origin=(0.0, 0.0, _shelf_level(sensor) - _REACH))
    flange_screws = under_shelf.pushPoints(list(flange_holes(sensor))).circle(0.5 * FLANGE_HOLE_MM)
    body = body.cut(flange_screws.extrude(through))
    if (opening := window(sensor)) is not None:
        body = body.cut(cq.Workplane(obj=opening))
    return body.findSolid().Solids()[0]


def mount_part(sensor: SensorSolids) -> Part:
    """Return the bracket in its place, with the named faces `seat`, `flange`, `mounting_holes` and `flange_holes`.

    The seat lies against the sensor, which is held by screws through the mounting holes.
    """
    faces: dict[str, FaceTest] = {
        "seat": on_plane(1, back_of(sensor)),
        "flange": on_plane(2, _shelf_level(sensor) + PLATE_MM),
        "mounting_holes": lambda face: is_hole(face, sensor.housing.hole_diameter),
        "flange_holes": lambda face: is_hole(face, FLANGE_HOLE_MM),
    }
    return named_part("mount", mount_solid(sensor), faces)


def window(sensor: SensorSolids) -> cq.Solid | None:
    """Return the window of the upright plate for Hall sensors and their wires [mm].

    Return None if no Hall sensor stands in front of the bracket. Only the back cover of a square has sensors there.
    """
    housing, seats = sensor.housing, sensor.seats
    if seats is None or housing.mount != "covers" or not housing.back_to_back:
        return None
    half = max(seats.windows) + 0.5 * seats.window_width + _BESIDE_SENSOR
    foot = housing.top_level - seats.sensor - 0.5 * seats.window_height - _BESIDE_SENSOR
    corner = cq.Vector(-half, back_of(sensor) - _REACH, foot)
    return cq.Solid.makeBox(2.0 * half, PLATE_MM + 2.0 * _REACH, seats.window_height + _ROOM_FOR_WIRES, corner)


def _shelf_level(sensor: SensorSolids) -> float:
    """Return the level of the lower face of the plate under the flange [mm]."""
    return sensor.housing.top_level + HEAD_ROOM_MM


def upright(sensor: SensorSolids) -> cq.Solid:
    """Return the plate behind the sensor without its holes [mm].

    Its foot is so high that it stays above the foot of the cover in every tilt of the press.
    """
    housing = sensor.housing
    back = back_of(sensor)
    rise = math.tan(math.radians(largest_tilt(sensor.press))) * PLATE_MM
    foot = housing.cover_level + math.ceil(10.0 * rise) / 10.0
    height = _shelf_level(sensor) + PLATE_MM - foot
    return cq.Solid.makeBox(housing.right - housing.left, PLATE_MM, height, cq.Vector(housing.left, back, foot))


def shelf(sensor: SensorSolids) -> cq.Solid:
    """Return the plate under the flange [mm] without its holes."""
    half = 0.5 * FLANGE_MM
    behind = max(back_of(sensor) + PLATE_MM, 0.5 * FLANGE_CIRCLE_MM + _BEHIND)
    return cq.Solid.makeBox(FLANGE_MM, behind + half, PLATE_MM, cq.Vector(-half, -half, _shelf_level(sensor)))


def flange_heads(sensor: SensorSolids) -> cq.Shape:
    """Return cylinders for the heads of the flange screws under the shelf [mm], as high as the room for them."""
    level = sensor.housing.top_level
    up = cq.Vector(0.0, 0.0, 1.0)
    heads = [
        cq.Solid.makeCylinder(0.5 * HEAD_MM, HEAD_ROOM_MM - _REACH, cq.Vector(x, y, level + _REACH), up)
        for x, y in flange_holes(sensor)
    ]
    return cq.Compound.makeCompound(heads)
