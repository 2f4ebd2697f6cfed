"""The bracket that carries a sensor: an angle behind the sensor, with the hole pattern of a robot flange above it.

The flange is ISO 9409-1-50-4-M6: four M6 screws on a 50 mm circle around the axis of the press. All coordinates are
sensor coordinates [mm].
"""

import math

import cadquery as cq

from cad.parts.assembly import WASHER_THICKNESS_MM, grip
from cad.parts.housing import largest_tilt
from cad.parts.part import FaceTest, Part, is_hole, named_part, plane_face_test
from cad.parts.sensor import SensorSolids

FLANGE_CIRCLE_MM = 50.0  # ISO 9409-1-50-4-M6
FLANGE_HOLE_MM = 6.6  # diameter of a clearance hole for M6, ISO 273 medium
FLANGE_MM = 63.0  # outer diameter of the flange, ISO 9409-1
FLANGE_SCREW_MM = 12.0  # length of a flange screw, of which 7 mm are in the flange
PLATE_MM = 5.0  # thickness of the bracket
HEAD_ROOM_MM = 8.0  # height of the space for the heads of the flange screws, which are 6 mm high, ISO 4762
HEAD_MM = 10.0  # diameter of the heads of the flange screws, ISO 4762
_BESIDE_SENSOR_MM = 1.0  # clearance between the Hall sensors and the edges of the window
_FOR_WIRES_MM = 6.0  # height of the window minus the height of its sensors
_BEHIND_HOLE_MM = 6.0  # distance from the centre of the rearmost flange hole to the rear edge of the shelf
_MARGIN_MM = 1.0  # extension of a cut beyond the plate, and clearance of the screw heads


def bracket_seat_y(sensor: SensorSolids) -> float:
    """Return the y coordinate [mm] of the face against which the bracket is screwed, behind covers or washers."""
    return 0.5 * grip(sensor) + _washers_at_bracket(sensor)


def _washers_at_bracket(sensor: SensorSolids) -> float:
    """Return the thickness [mm] of the washers between frame and bracket, which is 0 if there are covers."""
    return 0.0 if sensor.housing.mount == "covers" else WASHER_THICKNESS_MM


def mounted_grip(sensor: SensorSolids) -> float:
    """Return the grip [mm] of the four screws that hold sensor and bracket, without the washers at their ends."""
    return grip(sensor) + _washers_at_bracket(sensor) + PLATE_MM


def flange_holes(sensor: SensorSolids) -> tuple[tuple[float, float], ...]:
    """Return the x and y coordinates of the holes for the flange screws [mm].

    If the sensor is thick, the holes are on the axes. Otherwise they are on the diagonals, so that the screw heads
    clear the upright plate.
    """
    radius = 0.5 * FLANGE_CIRCLE_MM
    if bracket_seat_y(sensor) >= 0.5 * HEAD_MM + _MARGIN_MM:
        return (radius, 0.0), (0.0, radius), (-radius, 0.0), (0.0, -radius)
    offset = math.sqrt(0.5) * radius
    return (offset, offset), (-offset, offset), (-offset, -offset), (offset, -offset)


def bracket_solid(sensor: SensorSolids) -> cq.Solid:
    """Return the bracket in its position behind the sensor [mm], with its holes and its window.

    The bracket consists of an upright plate, against which the sensor is screwed, and a shelf, which is the plate under
    the flange.
    """
    housing = sensor.housing
    back = bracket_seat_y(sensor)  # y of the face of the upright plate that the sensor touches
    hole_length = PLATE_MM + 2.0 * _MARGIN_MM  # a cut extends beyond the plate, so that no thin layer remains
    bracket = cq.Workplane(obj=upright_solid(sensor).fuse(shelf_solid(sensor)).clean())
    # The normal of the workplane "XZ" is -y, so the screw holes are cut from behind.
    rear_plane = cq.Workplane("XZ", origin=(0.0, back + PLATE_MM + _MARGIN_MM, 0.0))
    screw_holes = rear_plane.pushPoints(list(housing.holes)).circle(0.5 * housing.hole_diameter)
    bracket = bracket.cut(screw_holes.extrude(hole_length))
    # The normal of the workplane "XY" is z, so the holes of the flange are cut from below.
    lower_plane = cq.Workplane("XY", origin=(0.0, 0.0, _shelf_level(sensor) - _MARGIN_MM))
    flange_screw_holes = lower_plane.pushPoints(list(flange_holes(sensor))).circle(0.5 * FLANGE_HOLE_MM)
    bracket = bracket.cut(flange_screw_holes.extrude(hole_length))
    opening = window_solid(sensor)
    if opening is not None:
        bracket = bracket.cut(cq.Workplane(obj=opening))
    return bracket.findSolid().Solids()[0]


def bracket_part(sensor: SensorSolids) -> Part:
    """Return the bracket in its position, with the named faces `seat`, `flange`, `mounting_holes` and `flange_holes`.

    The sensor is held against the seat by screws through the mounting holes.
    """
    faces: dict[str, FaceTest] = {
        "seat": plane_face_test(1, bracket_seat_y(sensor)),
        "flange": plane_face_test(2, _shelf_level(sensor) + PLATE_MM),
        "mounting_holes": lambda face: is_hole(face, sensor.housing.hole_diameter),
        "flange_holes": lambda face: is_hole(face, FLANGE_HOLE_MM),
    }
    return named_part("mount", bracket_solid(sensor), faces)


def window_solid(sensor: SensorSolids) -> cq.Solid | None:
    """Return the box that cuts a window into the upright plate for Hall sensors and their wires [mm].

    The result is None if no window is needed. Hall sensors face the bracket only if they are in the back cover of two
    back-to-back plates.
    """
    housing, seats = sensor.housing, sensor.seats
    if seats is None or housing.mount != "covers" or not housing.back_to_back:
        return None
    # The centres of the windows of the cover are symmetric about x = 0, so the largest one determines the width.
    half_width = max(seats.windows) + 0.5 * seats.window_width + _BESIDE_SENSOR_MM
    # `seats.sensor_level` is measured downwards from the top of the frame.
    lower_level = housing.top_level - seats.sensor_level - 0.5 * seats.window_height - _BESIDE_SENSOR_MM
    corner = cq.Vector(-half_width, bracket_seat_y(sensor) - _MARGIN_MM, lower_level)
    return cq.Solid.makeBox(2.0 * half_width, PLATE_MM + 2.0 * _MARGIN_MM, seats.window_height + _FOR_WIRES_MM, corner)


def _shelf_level(sensor: SensorSolids) -> float:
    """Return the height z [mm] of the lower face of the shelf, which is the plate under the flange."""
    return sensor.housing.top_level + HEAD_ROOM_MM


def upright_solid(sensor: SensorSolids) -> cq.Solid:
    """Return the upright plate behind the sensor without its holes [mm].

    Its lower edge stays above the lower edge of the cover at every tilt of the press. The bracket therefore does not
    reduce the clearance from the fruit.
    """
    housing = sensor.housing
    back = bracket_seat_y(sensor)
    # A tilt lowers the rear edge of the plate by this distance [mm], relative to its front edge at the cover.
    edge_drop = math.tan(math.radians(largest_tilt(sensor.press))) * PLATE_MM
    lower_level = housing.cover_level + math.ceil(10.0 * edge_drop) / 10.0  # the distance is rounded up to 0.1 mm
    height = _shelf_level(sensor) + PLATE_MM - lower_level
    return cq.Solid.makeBox(housing.right - housing.left, PLATE_MM, height, cq.Vector(housing.left, back, lower_level))


def shelf_solid(sensor: SensorSolids) -> cq.Solid:
    """Return the shelf [mm], which is the plate under the flange, without its holes."""
    half_width = 0.5 * FLANGE_MM
    rear_edge = max(bracket_seat_y(sensor) + PLATE_MM, 0.5 * FLANGE_CIRCLE_MM + _BEHIND_HOLE_MM)
    return cq.Solid.makeBox(
        FLANGE_MM, rear_edge + half_width, PLATE_MM, cq.Vector(-half_width, -half_width, _shelf_level(sensor))
    )


def flange_heads(sensor: SensorSolids) -> cq.Shape:
    """Return cylinders for the heads of the flange screws under the shelf [mm], for checks of clearances.

    The cylinders extend from the shelf down to 1 mm above the frame. At 7 mm, they are higher than the heads, so the
    checks are on the safe side.
    """
    top_level = sensor.housing.top_level
    height = HEAD_ROOM_MM - _MARGIN_MM
    up = cq.Vector(0.0, 0.0, 1.0)
    heads = []
    for x, y in flange_holes(sensor):
        lowest_point = cq.Vector(x, y, top_level + _MARGIN_MM)
        heads.append(cq.Solid.makeCylinder(0.5 * HEAD_MM, height, lowest_point, up))
    return cq.Compound.makeCompound(heads)
