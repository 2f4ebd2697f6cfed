"""The assembly of a sensor over its fruit: one housing or two back-to-back plates, with covers and fasteners.

A sensor with a square of four tips has two equal plates. The first plate is on the side -y, with its back towards the
centre. The second plate is the first one rotated by 180 degrees about the press axis. The low and the high side are
therefore swapped, and the springs on each diagonal of the square are equal. The pads of the two plates meet at y = 0.
All coordinates are in the sensor frame [mm].
"""

from __future__ import annotations

import math

import cadquery as cq

from cad.parts.cover import COVER_MM, WASHER_MM
from cad.parts.cover_solid import cover_part
from cad.parts.fruit import whole_fruit
from cad.parts.hall_seats import HallSeats, required_seats
from cad.parts.housing import DOWEL_MM, SETBACK_MM, BackToBack, Housing, Pin
from cad.parts.housing_solid import cut_domes, cut_magnet_pockets, housing_part, named_housing
from cad.parts.part import Part
from cad.parts.pin_socket import cut_pin_sockets, pin_locations, pin_solid
from cad.parts.sensor import SensorSolids
from sensor.design.parameters import Design

PRINTED_COLOUR = cq.Color(0.22, 0.40, 0.62)
COVER_COLOUR = cq.Color(0.60, 0.60, 0.62)
STEEL_COLOUR = cq.Color(0.75, 0.77, 0.80)
FRUIT_COLOUR = cq.Color(0.95, 0.66, 0.20)
SCREW_MM = 3.0  # nominal diameter of an M3 screw
HEAD_MM = 5.5  # diameter of the head of an M3 screw, ISO 4762
HEAD_HEIGHT_MM = 3.0  # height of the head of an M3 screw, ISO 4762
NUT_ACROSS_FLATS_MM = 5.5  # width across flats of an M3 nut, ISO 4032
NUT_MM = 2.4  # thickness of an M3 nut, ISO 4032
WASHER_THICKNESS_MM = 0.5  # thickness of an M3 washer, ISO 7089
WASHER_HOLE_MM = 3.2  # inner diameter of an M3 washer, ISO 7089
SCREW_LENGTHS_MM = (10, 12, 16, 20, 25, 30, 35, 40, 45, 50)  # standard lengths of M3 screws, ISO 4762
DOWEL_LENGTHS_MM = (4, 5, 6, 8, 10, 12, 14, 16, 18, 20, 24, 28, 30)  # standard lengths of 3 mm dowels, ISO 8734
APART = 2.5  # displacement of a body in exploded views, as a multiple of its distance from the plane y = 0
_MARGIN = 1.0  # extension of a cut beyond the plate [mm]
_HALF_TURN = cq.Location(cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 0.0, 1.0), 180.0)


def finished_part(housing: Housing, seats: HallSeats | None = None) -> Part:
    """Return the housing as manufactured, with its domes, its pockets for pins and magnets, and its pad."""
    part = cut_pin_sockets(cut_domes(housing_part(housing), housing), housing)
    if housing.back_to_back:
        part = named_housing(_add_pad(part.shape, housing, housing.back_to_back), housing)
    return cut_magnet_pockets(part, housing, seats)


def tagged_workplane(part: Part) -> cq.Workplane:
    """Convert a part [mm] to a CadQuery workplane for further editing. The named faces become tags."""
    workplane = cq.Workplane(part.shape)
    faces = part.shape.Faces()
    for name, indices in part.faces.items():
        workplane.newObject([faces[index] for index in indices]).tag(name)
    return workplane


def draw_sensor(design: Design, housing: Housing) -> SensorSolids:
    """Return the solids of a sensor, with the fruit, the tips and the press motion of its design.

    `housing` must be the housing that was sized for the design.
    """
    seats = required_seats(design, housing)  # None without a Hall read-out
    return SensorSolids(
        housing=housing,
        part=finished_part(housing, seats),
        fruit=design.fruit,
        tips=design.tips,
        press=design.press,
        name=design.name,
        seats=seats,
    )


def _add_pad(plate: cq.Shape, housing: Housing, back_to_back: BackToBack) -> cq.Shape:
    """Add a pad to the back of a plate, and cut the holes for screws and dowels through plate and pad [mm].

    Two back-to-back plates touch each other only with their pads. `back_to_back` holds the height of the pad and the
    diameter of the dowel holes.
    """
    back = 0.5 * housing.depth  # y of the back face of the plate
    height = back_to_back.pad_height
    plate = plate.fuse(_draw_pad(housing, height))

    # The normal of the workplane "XZ" is -y, so the holes run from behind the pad to the front of the plate.
    behind_pad = cq.Workplane("XZ", origin=(0.0, back + height + _MARGIN, 0.0))
    hole_length = housing.depth + height + 2.0 * _MARGIN
    screw_holes = behind_pad.pushPoints(list(housing.holes)).circle(0.5 * housing.hole_diameter).extrude(hole_length)
    dowel_holes = behind_pad.pushPoints(list(housing.dowels)).circle(0.5 * back_to_back.dowel_hole).extrude(hole_length)
    plate = plate.cut(screw_holes.findSolid(), dowel_holes.findSolid())
    return plate.clean()  # joins the two faces of a hole through plate and pad


def _draw_pad(housing: Housing, height: float) -> cq.Shape:
    """Return the pad of this height [mm] on the back of a plate, without its holes.

    The pad is a frame that is open towards the tips. Like the rim of a cover, it lies on the posts and on the bar above
    the springs. Its edges beside moving parts are set back by SETBACK_MM.
    """
    back = 0.5 * housing.depth  # y of the back face of the plate
    lower_level = max(housing.cover_level, housing.protrusion)  # never below the lower edge of the frame
    width = housing.right - housing.left
    post_width = housing.wall_width - SETBACK_MM
    bar_level = housing.cavity_level + SETBACK_MM
    block = cq.Solid.makeBox(width, height, housing.top_level - lower_level, cq.Vector(housing.left, back, lower_level))
    # The opening extends beyond the block in front, behind and below, so that no thin layer remains there.
    opening = cq.Solid.makeBox(
        width - 2.0 * post_width,
        height + 2.0 * _MARGIN,
        bar_level - lower_level + _MARGIN,
        cq.Vector(housing.left + post_width, back - _MARGIN, lower_level - _MARGIN),
    )
    return block.cut(opening)


def plate_locations(housing: Housing) -> tuple[cq.Location, ...]:
    """Return the location of the housing in the sensor [mm], or the locations of both back-to-back plates."""
    if not housing.back_to_back:
        return (cq.Location(),)
    front_plate = cq.Location(cq.Vector(0.0, -0.5 * housing.spacing, 0.0))
    return front_plate, _HALF_TURN * front_plate


def cover_locations(housing: Housing) -> tuple[cq.Location, cq.Location]:
    """Return the locations of the front and the back cover in the sensor [mm].

    A cover is drawn behind its plate, so a front cover is rotated by half a turn. Of two plates, each has one cover, on
    the face away from the other plate.
    """
    plates = plate_locations(housing)
    half_turn = cq.Location(cq.Vector(housing.left + housing.right, 0.0, 0.0)) * _HALF_TURN
    front = plates[0] * half_turn
    back = plates[1] * half_turn if housing.back_to_back else cq.Location()
    return front, back


def assemble_sensor(sensor: SensorSolids) -> cq.Assembly:
    """Return the assembly of a sensor over its fruit before the press [mm].

    The parts are the housing or the two plates, covers, pins, screws, nuts, washers, dowels and the fruit. Each part
    has a name and a colour, and its named faces have tags. Equal parts share one shape. Names have no spaces, because
    CadQuery's selectors such as `front_cover?rim` do not allow them.
    """
    housing = sensor.housing
    assembly = cq.Assembly(name="sensor")
    printed_part = tagged_workplane(sensor.part)
    for suffix, plate in _plates_by_suffix(housing).items():
        name = f"plate{suffix}" if housing.back_to_back else "housing"
        assembly.add(printed_part, name=name, loc=plate, color=PRINTED_COLOUR)
    if housing.mount == "covers":
        cover = tagged_workplane(cover_part(housing, sensor.seats))
        for side, location in zip(("front", "back"), cover_locations(housing), strict=True):
            assembly.add(cover, name=f"{side}_cover", loc=location, color=COVER_COLOUR)
    if housing.pin:
        _add_pins(assembly, sensor, housing.pin)
    _add_fasteners(assembly, sensor)
    # The origin of the fruit is its apex. The faces that touch the fruit are above it by the gap before the press, and
    # the sensor is offset from it along x.
    fruit_origin = cq.Vector(-sensor.tips.offset_mm, 0.0, -sensor.tips.gap_mm - housing.beyond_face)
    fruit = whole_fruit(sensor.fruit, sensor.tips)
    return assembly.add(fruit, name="fruit", loc=cq.Location(fruit_origin), color=FRUIT_COLOUR)


def placed_shape(part: cq.Assembly) -> cq.Shape:
    """Return the shape of a part of an assembly at its location in the assembly [mm]."""
    return part.shapes[0].moved(part.loc)


def part_type(part: cq.Assembly) -> str:
    """Return the type of a part from its name in the assembly, for example `washer` for `front_washer_1`."""
    return part.name.rstrip("_0123456789").rpartition("_")[2]


def part_colour(part: cq.Assembly) -> tuple[float, ...]:
    """Return the colour of a part as red, green and blue from 0 to 1. A part without a colour is steel grey."""
    return (part.color or STEEL_COLOUR).toTuple()[:3]


def exploded_shift(part: cq.Assembly) -> float:
    """Return the displacement of a part along y in exploded views [mm]."""
    box = placed_shape(part).BoundingBox()
    # A screw moves out of all clamped parts, in the direction of its head, which is -y.
    if part.name.startswith("screw"):
        return APART * float(box.ymin) - float(box.ylen)
    return APART * float(box.center.y)


def grip(sensor: SensorSolids) -> float:
    """Return the grip of the screws [mm], which is the thickness of the plates and covers that they clamp."""
    housing = sensor.housing
    covers = 2.0 * COVER_MM if housing.mount == "covers" else 0.0
    return housing.stack + covers


def screw_length(grip_mm: float) -> int | None:
    """Return the length [mm] of the shortest standard M3 screw that is long enough for a grip, a nut and two washers.

    The result is None if all standard screws are too short.
    """
    required_length = grip_mm + NUT_MM + 2.0 * WASHER_THICKNESS_MM
    return next((length for length in SCREW_LENGTHS_MM if length >= required_length), None)


def dowel_length(housing: Housing) -> int | None:
    """Return the length of the longest standard dowel that fits into both plates [mm], or None if all are too long."""
    return max((length for length in DOWEL_LENGTHS_MM if length <= housing.stack), default=None)


def _plates_by_suffix(housing: Housing) -> dict[str, cq.Location]:
    """Return the location of each plate [mm], keyed by the suffix that the names of its parts have in the assembly.

    The suffix of a single plate is empty.
    """
    suffixes = ("_1", "_2") if housing.back_to_back else ("",)
    return dict(zip(suffixes, plate_locations(housing), strict=True))


def _add_pins(assembly: cq.Assembly, sensor: SensorSolids, pin: Pin) -> None:
    """Add the glued pins of all plates to an assembly."""
    solid = pin_solid(pin, sensor.tips)
    for name, location_in_plate in pin_locations(sensor.housing).items():
        for suffix, plate in _plates_by_suffix(sensor.housing).items():
            assembly.add(solid, name=f"{name}{suffix}", loc=plate * location_in_plate, color=STEEL_COLOUR)


def _add_fasteners(assembly: cq.Assembly, sensor: SensorSolids) -> None:
    """Add screws, nuts, washers and dowels to an assembly. The heads of the screws are on the front, at -y.

    The name of each part ends in the number of its hole, counted from 1.
    """
    housing = sensor.housing
    screw_set = _screw_set(grip(sensor))
    for number, (x, z) in enumerate(housing.holes, start=1):
        for name, (shape, y) in screw_set.items():
            location = cq.Location(cq.Vector(x, y, z))
            assembly.add(shape, name=f"{name}_{number}", loc=location, color=STEEL_COLOUR)
    # If all standard dowels are too long, a dowel is drawn that is as long as both plates are thick.
    length = float(dowel_length(housing) or housing.stack)
    dowel = _cylinder(DOWEL_MM, -0.5 * length, length)
    for number, (x, z) in enumerate(housing.dowels, start=1):
        location = cq.Location(cq.Vector(x, 0.0, z))
        assembly.add(dowel, name=f"dowel_{number}", loc=location, color=STEEL_COLOUR)


def _screw_set(grip_mm: float) -> dict[str, tuple[cq.Shape, float]]:
    """Return the screw, its nut and its washers on the y axis, each with the y [mm] at which its shape is placed.

    `grip_mm` [mm] is the thickness of the parts between the washers. These parts are centred on y = 0, and the head is
    on the front, at -y. If all standard screws are too short, a threaded rod is drawn as a screw that is just long
    enough, rounded up to 1 mm.
    """
    front = -0.5 * grip_mm
    back = 0.5 * grip_mm
    length = screw_length(grip_mm) or math.ceil(grip_mm + NUT_MM + 2.0 * WASHER_THICKNESS_MM)
    head_y = front - WASHER_THICKNESS_MM  # y of the lower face of the head, which is also the front of its washer
    shank = _cylinder(SCREW_MM, head_y, float(length))
    head = _cylinder(HEAD_MM, head_y - HEAD_HEIGHT_MM, HEAD_HEIGHT_MM)
    washer = _cylinder(WASHER_MM, 0.0, WASHER_THICKNESS_MM).cut(_cylinder(WASHER_HOLE_MM, 0.0, WASHER_THICKNESS_MM))

    # The normal of the workplane "XZ" is -y, so the nut is extruded from its back towards -y.
    nut_back = cq.Workplane("XZ", origin=(0.0, back + WASHER_THICKNESS_MM + NUT_MM, 0.0))
    across_corners = NUT_ACROSS_FLATS_MM / math.cos(math.pi / 6.0)  # CadQuery draws a polygon by this diameter
    nut = nut_back.polygon(6, across_corners).circle(0.5 * SCREW_MM).extrude(NUT_MM)
    # Screw and nut are drawn in place. The washers share one shape, drawn at y = 0, so each has its own y.
    return {
        "screw": (shank.fuse(head).Solids()[0], 0.0),
        "nut": (nut.findSolid(), 0.0),
        "front_washer": (washer, head_y),
        "back_washer": (washer, back),
    }


def _cylinder(diameter: float, start: float, length: float) -> cq.Solid:
    """Return a cylinder on the y axis that extends from y = `start` towards +y. All arguments are in mm."""
    return cq.Solid.makeCylinder(0.5 * diameter, length, cq.Vector(0.0, start, 0.0), cq.Vector(0.0, 1.0, 0.0))
