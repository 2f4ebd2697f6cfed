"""How a sensor is put together over its fruit: a housing, or the two plates of a square, with all that holds them.

The plates of a square are equal. One stands on the side -y, its back to the middle; the other is that one turned half
round the press axis, so that low and high change sides and springs of one kind stand on each diagonal. Their pads meet
at y = 0. Sensor frame, mm.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import cadquery as cq

from cad.design.parameters import Design
from cad.parts.cover import WASHER_MM
from cad.parts.cover_solid import cover_of, cover_part, turned
from cad.parts.housing import DOWEL_MM, SETBACK_MM, Housing
from cad.parts.housing_solid import domed, housing_part, named_housing
from cad.parts.part import Part
from cad.parts.pin_socket import socketed
from cad.parts.pose import in_place
from cad.parts.sensor import HOUSING_COLOUR, STEEL_COLOUR, Body, Colour, Sensor

COVER_COLOUR: Colour = (0.60, 0.60, 0.62)
SCREW_MM, HEAD_MM, HEAD_HEIGHT_MM = 3.0, 5.5, 3.0  # M3, ISO 4762
NUT_ACROSS_FLATS_MM, NUT_MM = 5.5, 2.4  # of M3, ISO 4032
WASHER_THICKNESS_MM, WASHER_HOLE_MM = 0.5, 3.2  # of M3, ISO 7089
SCREW_LENGTHS_MM = (10, 12, 16, 20, 25, 30, 35, 40, 45, 50)  # of M3, ISO 4762
DOWEL_LENGTHS_MM = (4, 5, 6, 8, 10, 12, 14, 16, 18, 20, 24, 28, 30)  # of 3 mm, ISO 8734
_REACH = 1.0  # of a tool beyond what it cuts
_BACK = (0.0, 1.0, 0.0)


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
    """Return a plate with a pad on the posts and the bar of its back, and with holes for screws and dowels in it."""
    back, height = 0.5 * housing.depth, housing.pad_height
    if height > 0.0:
        plate = plate.fuse(_pad(housing))
    drill = cq.Workplane("XZ", origin=(0.0, back + height + _REACH, 0.0))
    through = housing.depth + height + 2.0 * _REACH
    for places, diameter in ((housing.holes, housing.hole_diameter), (housing.dowels, housing.dowel_hole)):
        plate = plate.cut(drill.pushPoints(list(places)).circle(0.5 * diameter).extrude(through).findSolid())
    plate = plate.clean()  # a hole through plate and pad is one face
    return plate.Solids()[0] if len(plate.Solids()) == 1 else plate


def _pad(housing: Housing) -> cq.Shape:
    """Return the pad: where the rim of a cover lies on the frame, set back from what moves; open towards the tips."""
    back, foot, bar = 0.5 * housing.depth, max(housing.cover_level, housing.protrusion), housing.cavity_level
    wall, height = housing.wall_width - SETBACK_MM, housing.pad_height
    width, size = housing.right - housing.left, (housing.top_level - foot)
    plate = cq.Solid.makeBox(width, height, size, cq.Vector(housing.left, back, foot))
    inside = cq.Vector(housing.left + wall, back - _REACH, foot - _REACH)
    opening = (width - 2.0 * wall, height + 2.0 * _REACH, bar + SETBACK_MM - foot + _REACH)
    return plate.cut(cq.Solid.makeBox(*opening, inside))


def turned_twin(shape: cq.Shape) -> cq.Shape:
    """Return a shape in its place in the sensor [mm] turned half round the press axis: the same of the other plate."""
    return shape.rotate(cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 0.0, 1.0), 180.0)


def assembly_bodies(sensor: Sensor) -> tuple[Body, ...]:
    """Return every body of a sensor before the press: housing or both plates, covers, screws, dowels, pins, fruit."""
    steel = {**_pins(sensor), **fasteners(sensor)}
    return (
        *_printed(sensor),
        *(Body(name=name, shape=shape, colour=COVER_COLOUR) for name, shape in cover_pair(sensor).items()),
        *(Body(name=name, shape=shape, colour=STEEL_COLOUR) for name, shape in steel.items()),
        sensor.fruit_body(),
    )


def _printed(sensor: Sensor) -> tuple[Body, ...]:
    """Return the housing, or the two plates of a square in their places."""
    if not sensor.housing.back_to_back:
        return (sensor.housing_body(),)
    plate = in_place(sensor.part.shape, sensor.housing)
    plates = {"plate 1": plate, "plate 2": turned_twin(plate)}
    return tuple(Body(name=name, shape=shape, colour=HOUSING_COLOUR) for name, shape in plates.items())


def _pins(sensor: Sensor) -> dict[str, cq.Shape]:
    """Return by name the pins of the housing, or of both plates [mm]; none where the tips are printed."""
    if not sensor.housing.back_to_back:
        return {body.name: body.shape for body in sensor.pin_bodies()}
    found: dict[str, cq.Shape] = {}
    for body in sensor.pin_bodies():
        pin = in_place(body.shape, sensor.housing)
        found |= {f"{body.name} 1": pin, f"{body.name} 2": turned_twin(pin)}
    return found


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
    housing, half = sensor.housing, 0.5 * grip(sensor)
    length = screw_length(2.0 * half) or math.ceil(2.0 * half + NUT_MM + 2.0 * WASHER_THICKNESS_MM)
    dowel = dowel_length(housing) or housing.stack
    found: dict[str, cq.Shape] = {}
    for number, (x, z) in enumerate(housing.holes, start=1):
        found |= {f"{name} {number}": shape for name, shape in _screw_set(x, z, half, float(length))}
    for number, (x, z) in enumerate(housing.dowels, start=1):
        start = cq.Vector(x, -0.5 * dowel, z)
        found[f"dowel {number}"] = cq.Solid.makeCylinder(0.5 * DOWEL_MM, float(dowel), start, cq.Vector(*_BACK))
    return found


def _screw_set(x: float, z: float, half: float, length: float) -> Iterator[tuple[str, cq.Shape]]:
    """Yield screw, nut and washers in one hole; `half` is that of the grip."""
    head = half + WASHER_THICKNESS_MM
    shank = cq.Solid.makeCylinder(0.5 * SCREW_MM, length, cq.Vector(x, -head, z), cq.Vector(*_BACK))
    top = cq.Solid.makeCylinder(
        0.5 * HEAD_MM, HEAD_HEIGHT_MM, cq.Vector(x, -head - HEAD_HEIGHT_MM, z), cq.Vector(*_BACK)
    )
    yield "screw", shank.fuse(top).Solids()[0]
    # A workplane XZ looks along -y: what it extrudes grows that way.
    behind = cq.Workplane("XZ", origin=(x, head + NUT_MM, z))
    corners = NUT_ACROSS_FLATS_MM / math.cos(math.pi / 6.0)
    yield "nut", behind.polygon(6, corners).circle(0.5 * SCREW_MM).extrude(NUT_MM).findSolid()
    for name, end in (("front washer", -half), ("back washer", head)):
        ring = cq.Workplane("XZ", origin=(x, end, z)).circle(0.5 * WASHER_MM).circle(0.5 * WASHER_HOLE_MM)
        yield name, ring.extrude(WASHER_THICKNESS_MM).findSolid()
