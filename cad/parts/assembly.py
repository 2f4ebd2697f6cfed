"""How a sensor is put together over its fruit: a housing, or the two plates of a square, with all that holds them.

The plates of a square are equal. One stands on the side -y, its back to the middle. The other is that one turned half
round the press axis. So low and high change sides, and springs of one kind stand on each diagonal. Their pads meet at y
= 0. Sensor frame, mm.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import cadquery as cq

from cad.parts.cover import COVER_MM, WASHER_MM
from cad.parts.cover_solid import cover_part, turn_cover
from cad.parts.hall_seats import HallSeats, seats_of
from cad.parts.housing import DOWEL_MM, SETBACK_MM, Housing
from cad.parts.housing_solid import cut_domes, cut_magnet_pockets, housing_part, named_housing
from cad.parts.part import Part
from cad.parts.pin_socket import cut_pin_sockets
from cad.parts.pose import in_place
from cad.parts.sensor import STEEL_COLOUR, Colour, NamedSolid, SensorSolids
from sensor.design.parameters import Design

COVER_COLOUR: Colour = (0.60, 0.60, 0.62)
SCREW_MM = 3.0  # diameter of M3
HEAD_MM = 5.5  # diameter of the head of M3, ISO 4762
HEAD_HEIGHT_MM = 3.0  # of M3, ISO 4762
NUT_ACROSS_FLATS_MM = 5.5  # of M3, ISO 4032
NUT_MM = 2.4  # thickness of M3, ISO 4032
WASHER_THICKNESS_MM = 0.5  # of M3, ISO 7089
WASHER_HOLE_MM = 3.2  # of M3, ISO 7089
SCREW_LENGTHS_MM = (10, 12, 16, 20, 25, 30, 35, 40, 45, 50)  # of M3, ISO 4762
DOWEL_LENGTHS_MM = (4, 5, 6, 8, 10, 12, 14, 16, 18, 20, 24, 28, 30)  # of 3 mm, ISO 8734
APART = 2.5  # how many times its distance across the sensor a body moves outwards
_REACH = 1.0  # of a tool beyond what it cuts
_HALF_TURN = cq.Location(cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 0.0, 1.0), 180.0)  # keeps one shape for both


def finished_part(housing: Housing, seats: HallSeats | None = None) -> Part:
    """Return a housing as it is made: with domes, pockets for pins and magnets, and on a plate pads and holes."""
    part = cut_pin_sockets(cut_domes(housing_part(housing), housing), housing)
    if housing.back_to_back:
        part = named_housing(_with_pads(part.shape, housing), housing)
    return cut_magnet_pockets(part, housing, seats)


def on_workplane(shape: cq.Shape, faces: Mapping[str, tuple[int, ...]]) -> cq.Workplane:
    """Return a shape [mm] on a workplane of CadQuery, to be cut and joined further, its named faces as tags."""
    plane = cq.Workplane(shape)
    every = shape.Faces()
    for name, places in faces.items():
        plane.newObject([every[place] for place in places]).tag(name)
    return plane


def assembly_of(sensor: SensorSolids) -> cq.Assembly:
    """Return the bodies of assembly.step as an assembly of CadQuery, each with its colour and its named faces as tags.

    A name has underscores for spaces: CadQuery finds no other in `front_cover?rim`.
    """
    faces = dict.fromkeys(("housing", "plate"), sensor.part.faces)
    if sensor.housing.mount == "covers":
        faces["cover"] = cover_part(sensor.housing, sensor.seats).faces
    assembly = cq.Assembly(name="sensor")
    for body in assembly_bodies(sensor):
        named = next((faces[word] for word in body.name.split() if word in faces), {})
        name = body.name.replace(" ", "_")
        assembly.add(on_workplane(body.shape, named), name=name, color=cq.Color(*body.colour))
    return assembly


def sensor_of(design: Design, housing: Housing) -> SensorSolids:
    """Return the sensor of a design with this housing."""
    seats = seats_of(design, housing)
    return SensorSolids(
        housing=housing,
        part=finished_part(housing, seats),
        fruit=design.fruit,
        tips=design.tips,
        press=design.press,
        name=design.name,
        seats=seats,
    )


def _with_pads(plate: cq.Shape, housing: Housing) -> cq.Shape:
    """Return a plate with a pad on its back, and with holes for screws and dowels through both.

    The pad is a frame that is open towards the tips. It lies on the posts and the bar, where the rim of a cover lies,
    set back from what moves.
    """
    back = 0.5 * housing.depth
    height = housing.pad_height
    if height > 0.0:
        foot = max(housing.cover_level, housing.protrusion)
        width = housing.right - housing.left
        post_width = housing.wall_width - SETBACK_MM
        bar_foot = housing.cavity_level + SETBACK_MM
        pad = cq.Solid.makeBox(width, height, housing.top_level - foot, cq.Vector(housing.left, back, foot))
        opening = cq.Solid.makeBox(
            width - 2.0 * post_width,
            height + 2.0 * _REACH,
            bar_foot - foot + _REACH,
            cq.Vector(housing.left + post_width, back - _REACH, foot - _REACH),
        )
        plate = plate.fuse(pad.cut(opening))

    outside = cq.Workplane("XZ", origin=(0.0, back + height + _REACH, 0.0))
    through = housing.depth + height + 2.0 * _REACH
    screw_holes = outside.pushPoints(list(housing.holes)).circle(0.5 * housing.hole_diameter).extrude(through)
    dowel_holes = outside.pushPoints(list(housing.dowels)).circle(0.5 * housing.dowel_hole).extrude(through)
    plate = plate.cut(screw_holes.findSolid(), dowel_holes.findSolid())
    return plate.clean()  # a hole through plate and pad is one face


def turned_twin(shape: cq.Shape) -> cq.Shape:
    """Return a shape in its place in the sensor [mm] turned half round the press axis: the same of the other plate."""
    return shape.moved(_HALF_TURN)


def assembly_bodies(sensor: SensorSolids) -> tuple[NamedSolid, ...]:
    """Return every body of a sensor before the press: housing or both plates, covers, screws, dowels, pins, fruit."""
    housing = sensor.housing
    printed = [sensor.printed_body()]
    pins = list(sensor.pin_bodies())
    if housing.back_to_back:
        printed = _in_both_plates([replace(printed[0], name="plate")], housing)
        pins = _in_both_plates(pins, housing)
    covers = [NamedSolid(name=name, shape=shape, colour=COVER_COLOUR) for name, shape in cover_pair(sensor).items()]
    bought = [NamedSolid(name=name, shape=shape, colour=STEEL_COLOUR) for name, shape in fasteners(sensor).items()]
    return (*printed, *covers, *pins, *bought, sensor.fruit_body())


def outwards(body: NamedSolid) -> float:
    """Return how far a body moves across the sensor [mm], along y, in a picture that shows each apart."""
    box = body.shape.BoundingBox()
    if body.name.startswith("screw"):  # out of all that it holds, head first
        return APART * float(box.ymin) - float(box.ylen)
    return APART * float(box.center.y)


def _in_both_plates(bodies: list[NamedSolid], housing: Housing) -> list[NamedSolid]:
    """Return bodies of a plate of a square, numbered, in their places in both plates."""
    twins = []
    for body in bodies:
        shape = in_place(body.shape, housing)
        twins.append(replace(body, name=f"{body.name} 1", shape=shape))
        twins.append(replace(body, name=f"{body.name} 2", shape=turned_twin(shape)))
    return twins


def cover_pair(sensor: SensorSolids) -> dict[str, cq.Shape]:
    """Return by name the covers in front of and behind the housing or its plates [mm]; none where washers hold it."""
    housing = sensor.housing
    if housing.mount != "covers":
        return {}
    cover = cover_part(housing, sensor.seats).shape
    if housing.back_to_back:
        front = in_place(turn_cover(cover, housing), housing)
        return {"front cover": front, "back cover": turned_twin(front)}
    about_middle = cq.Location(cq.Vector(housing.left + housing.right, 0.0, 0.0))
    return {"front cover": cover.moved(about_middle * _HALF_TURN), "back cover": cover}


def grip(sensor: SensorSolids) -> float:
    """Return the grip of the screws [mm]: the plate or both plates, and the covers."""
    housing = sensor.housing
    return housing.stack + (2.0 * COVER_MM if housing.mount == "covers" else 0.0)


def screw_length(grip_mm: float) -> int | None:
    """Return the shortest M3 screw [mm] that holds a grip [mm], a nut and two washers; None where none is so long."""
    least = grip_mm + NUT_MM + 2.0 * WASHER_THICKNESS_MM
    return next((length for length in SCREW_LENGTHS_MM if length >= least), None)


def dowel_length(housing: Housing) -> int | None:
    """Return the longest dowel [mm] that does not stand out of both plates; None where they are thinner."""
    return max((length for length in DOWEL_LENGTHS_MM if length <= housing.stack), default=None)


def fasteners(sensor: SensorSolids) -> dict[str, cq.Shape]:
    """Return by name screws, nuts, washers and dowels [mm], the heads of the screws on the side -y."""
    housing = sensor.housing
    shapes: dict[str, cq.Shape] = {}
    screw_set = _screw_set(grip(sensor))
    for number, (x, z) in enumerate(housing.holes, start=1):
        for name, shape in screw_set.items():
            shapes[f"{name} {number}"] = shape.moved(cq.Location(cq.Vector(x, 0.0, z)))
    length = float(dowel_length(housing) or housing.stack)
    dowel = _along_y(DOWEL_MM, -0.5 * length, length)
    for number, (x, z) in enumerate(housing.dowels, start=1):
        shapes[f"dowel {number}"] = dowel.moved(cq.Location(cq.Vector(x, 0.0, z)))
    return shapes


def _screw_set(grip_mm: float) -> dict[str, cq.Shape]:
    """Return screw, nut and washers about the axis y, y = 0 in the middle of what they hold [mm].

    The head lies on the front, -y. For a grip that no screw is long enough for, the screw is a cut rod.
    """
    front = -0.5 * grip_mm
    back = 0.5 * grip_mm
    length = screw_length(back - front) or math.ceil(back - front + NUT_MM + 2.0 * WASHER_THICKNESS_MM)
    under_head = front - WASHER_THICKNESS_MM
    shank = _along_y(SCREW_MM, under_head, float(length))
    head = _along_y(HEAD_MM, under_head - HEAD_HEIGHT_MM, HEAD_HEIGHT_MM)
    washer = _along_y(WASHER_MM, 0.0, WASHER_THICKNESS_MM).cut(_along_y(WASHER_HOLE_MM, 0.0, WASHER_THICKNESS_MM))

    # A workplane XZ looks along -y: what it extrudes grows that way.
    nut_back = cq.Workplane("XZ", origin=(0.0, back + WASHER_THICKNESS_MM + NUT_MM, 0.0))
    across_corners = NUT_ACROSS_FLATS_MM / math.cos(math.pi / 6.0)
    nut = nut_back.polygon(6, across_corners).circle(0.5 * SCREW_MM).extrude(NUT_MM)
    return {
        "screw": shank.fuse(head).Solids()[0],
        "nut": nut.findSolid(),
        "front washer": washer.moved(cq.Location(cq.Vector(0.0, under_head, 0.0))),
        "back washer": washer.moved(cq.Location(cq.Vector(0.0, back, 0.0))),
    }


def _along_y(diameter: float, start: float, length: float) -> cq.Solid:
    """Return a cylinder about the axis y from `start` on [mm]."""
    return cq.Solid.makeCylinder(0.5 * diameter, length, cq.Vector(0.0, start, 0.0), cq.Vector(0.0, 1.0, 0.0))
