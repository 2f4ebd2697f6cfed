"""How a sensor is put together over its fruit: a housing, or the two plates of a square, with all that holds them.

The plates of a square are equal. One stands on the side -y, its back to the middle; the other is that one turned half
round the press axis, so that low and high change sides and springs of one kind stand on each diagonal. Their pads meet
at y = 0. Sensor frame, mm.
"""

from __future__ import annotations

import math
from dataclasses import replace

import cadquery as cq

from cad.design.parameters import Design
from cad.parts.cover import WASHER_MM
from cad.parts.cover_solid import cover_of, cover_part, turned
from cad.parts.housing import DOWEL_MM, SETBACK_MM, Housing
from cad.parts.housing_solid import domed, housing_part, named_housing
from cad.parts.part import Part
from cad.parts.pin_socket import socketed
from cad.parts.pose import in_place
from cad.parts.sensor import STEEL_COLOUR, Body, Colour, Sensor

COVER_COLOUR: Colour = (0.60, 0.60, 0.62)
SCREW_MM, HEAD_MM, HEAD_HEIGHT_MM = 3.0, 5.5, 3.0  # M3, ISO 4762
NUT_ACROSS_FLATS_MM, NUT_MM = 5.5, 2.4  # of M3, ISO 4032
WASHER_THICKNESS_MM, WASHER_HOLE_MM = 0.5, 3.2  # of M3, ISO 7089
SCREW_LENGTHS_MM = (10, 12, 16, 20, 25, 30, 35, 40, 45, 50)  # of M3, ISO 4762
DOWEL_LENGTHS_MM = (4, 5, 6, 8, 10, 12, 14, 16, 18, 20, 24, 28, 30)  # of 3 mm, ISO 8734
_REACH = 1.0  # of a tool beyond what it cuts


def finished_part(housing: Housing) -> Part:
    """Return a housing as it is made: with domes, pockets for pins, and in a plate of a square with pads and holes."""
    part = socketed(domed(housing_part(housing), housing), housing)
    return named_housing(_with_pads(part.shape, housing), housing) if housing.back_to_back else part


def sensor_of(design: Design, housing: Housing) -> Sensor:
    """Return the sensor of a design with this housing."""
    part = finished_part(housing)
    return Sensor(
        housing=housing, part=part, fruit=design.fruit, tips=design.tips, press=design.press, name=design.name
    )


def _with_pads(plate: cq.Shape, housing: Housing) -> cq.Shape:
    """Return a plate with a pad on the posts and the bar of its back, and with holes for screws and dowels in it.

    The pad lies where the rim of a cover lies on the frame, set back from what moves; it is open towards the tips.
    """
    back, height = 0.5 * housing.depth, housing.pad_height
    if height > 0.0:
        foot = max(housing.cover_level, housing.protrusion)
        width = housing.right - housing.left
        post = housing.wall_width - SETBACK_MM
        pad = cq.Solid.makeBox(width, height, housing.top_level - foot, cq.Vector(housing.left, back, foot))
        opening = cq.Solid.makeBox(
            width - 2.0 * post,
            height + 2.0 * _REACH,
            housing.cavity_level + SETBACK_MM - foot + _REACH,
            cq.Vector(housing.left + post, back - _REACH, foot - _REACH),
        )
        plate = plate.fuse(pad.cut(opening))
    drill = cq.Workplane("XZ", origin=(0.0, back + height + _REACH, 0.0))
    through = housing.depth + height + 2.0 * _REACH
    for points, diameter in ((housing.holes, housing.hole_diameter), (housing.dowels, housing.dowel_hole)):
        plate = plate.cut(drill.pushPoints(list(points)).circle(0.5 * diameter).extrude(through).findSolid())
    plate = plate.clean()  # a hole through plate and pad is one face
    return plate.Solids()[0] if len(plate.Solids()) == 1 else plate


def turned_twin(shape: cq.Shape) -> cq.Shape:
    """Return a shape in its place in the sensor [mm] turned half round the press axis: the same of the other plate."""
    return shape.rotate(cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 0.0, 1.0), 180.0)


def assembly_bodies(sensor: Sensor) -> tuple[Body, ...]:
    """Return every body of a sensor before the press: housing or both plates, covers, screws, dowels, pins, fruit."""
    printed = [sensor.housing_body()]
    pins = list(sensor.pin_bodies())
    if sensor.housing.back_to_back:
        printed = _twins(replace(printed[0], name="plate"), sensor.housing)
        pins = [body for pin in pins for body in _twins(pin, sensor.housing)]
    covers = [Body(name=name, shape=shape, colour=COVER_COLOUR) for name, shape in cover_pair(sensor).items()]
    bought = [Body(name=name, shape=shape, colour=STEEL_COLOUR) for name, shape in fasteners(sensor).items()]
    return (*printed, *covers, *pins, *bought, sensor.fruit_body())


def _twins(body: Body, housing: Housing) -> list[Body]:
    """Return a body of a plate of a square, numbered, in its place in both plates."""
    shape = in_place(body.shape, housing)
    return [
        replace(body, name=f"{body.name} 1", shape=shape),
        replace(body, name=f"{body.name} 2", shape=turned_twin(shape)),
    ]


def cover_pair(sensor: Sensor) -> dict[str, cq.Shape]:
    """Return by name the covers in front of and behind the housing or its plates [mm]; none where washers hold it."""
    housing = sensor.housing
    if housing.mount != "covers":
        return {}
    cover = cover_part(cover_of(sensor)).shape
    front = in_place(turned(cover, housing), housing)
    return {"front cover": front, "back cover": turned_twin(front) if housing.back_to_back else cover}


def grip(sensor: Sensor) -> float:
    """Return what the screws must span [mm]: the plate or both plates, and the covers."""
    cover = cover_of(sensor)
    return cover.grip if sensor.housing.mount == "covers" else sensor.housing.stack


def screw_length(grip_mm: float) -> int | None:
    """Return the shortest M3 screw [mm] that holds a grip [mm], a nut and two washers; None where none is so long."""
    least = grip_mm + NUT_MM + 2.0 * WASHER_THICKNESS_MM
    return next((length for length in SCREW_LENGTHS_MM if length >= least), None)


def dowel_length(housing: Housing) -> int | None:
    """Return the longest dowel [mm] that does not stand out of both plates; None where they are thinner."""
    return max((length for length in DOWEL_LENGTHS_MM if length <= housing.stack), default=None)


def fasteners(sensor: Sensor) -> dict[str, cq.Shape]:
    """Return by name screws, nuts, washers and dowels [mm], the heads of the screws on the side -y."""
    housing = sensor.housing
    half_grip = 0.5 * grip(sensor)
    length = screw_length(2.0 * half_grip) or math.ceil(2.0 * half_grip + NUT_MM + 2.0 * WASHER_THICKNESS_MM)
    dowel = float(dowel_length(housing) or housing.stack)
    back = cq.Vector(0.0, 1.0, 0.0)
    shapes: dict[str, cq.Shape] = {}
    for number, (x, z) in enumerate(housing.holes, start=1):
        for name, shape in _screw_set(x, z, half_grip, float(length)).items():
            shapes[f"{name} {number}"] = shape
    for number, (x, z) in enumerate(housing.dowels, start=1):
        start = cq.Vector(x, -0.5 * dowel, z)
        shapes[f"dowel {number}"] = cq.Solid.makeCylinder(0.5 * DOWEL_MM, dowel, start, back)
    return shapes


def _screw_set(x: float, z: float, half_grip: float, length: float) -> dict[str, cq.Shape]:
    """Return screw, nut and washers in one hole."""
    back = cq.Vector(0.0, 1.0, 0.0)
    under_head = -half_grip - WASHER_THICKNESS_MM
    shank = cq.Solid.makeCylinder(0.5 * SCREW_MM, length, cq.Vector(x, under_head, z), back)
    head_start = cq.Vector(x, under_head - HEAD_HEIGHT_MM, z)
    head = cq.Solid.makeCylinder(0.5 * HEAD_MM, HEAD_HEIGHT_MM, head_start, back)

    # A workplane XZ looks along -y: what it extrudes grows that way.
    nut_plane = cq.Workplane("XZ", origin=(x, half_grip + WASHER_THICKNESS_MM + NUT_MM, z))
    nut = nut_plane.polygon(6, NUT_ACROSS_FLATS_MM / math.cos(math.pi / 6.0)).circle(0.5 * SCREW_MM).extrude(NUT_MM)
    shapes: dict[str, cq.Shape] = {"screw": shank.fuse(head).Solids()[0], "nut": nut.findSolid()}
    for name, end in (("front washer", -half_grip), ("back washer", half_grip + WASHER_THICKNESS_MM)):
        ring = cq.Workplane("XZ", origin=(x, end, z)).circle(0.5 * WASHER_MM).circle(0.5 * WASHER_HOLE_MM)
        shapes[name] = ring.extrude(WASHER_THICKNESS_MM).findSolid()
    return shapes
