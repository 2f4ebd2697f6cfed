"""The drawing of the assembly: taken apart along its screws, each part with its number in the list of parts [mm]."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import cadquery as cq

from cad.drawing.canvas import Canvas, Point
from cad.drawing.sheet import Sheet, Title, on_sheet
from cad.drawing.view import View, draw_view, views_of
from cad.fabrication.bill import EACH, Row
from cad.fabrication.mount import PLATE_MM, back_of, mounted_grip
from cad.parts.assembly import assembly_bodies, grip
from cad.parts.pin import STEEL_G_PER_CM3
from cad.parts.sensor import STEEL_COLOUR, Body, Sensor

_APART_MM = 22.0  # between one part and the next
_BALLOON_MM = 4.0  # radius on paper, ISO 6433
_OUT_MM = 9.0  # on paper, from the picture to the balloons
_BOUGHT = {"screw", "nut", "washer", "dowel", "pin"}  # of steel
_NOTES = (
    "Isometric view, taken apart along the screws.",
    "Dowels and pins are pressed or glued in, see fabrication.md.",
    "The screws are those that hold the bracket too.",
)


class _Item(NamedTuple):
    """An item of the list: its number and what is seen of its parts."""

    number: int
    views: Sequence[View]


def assembly_drawing(
    sensor: Sensor, mount: cq.Shape, bill: Sequence[Row], numbers: Mapping[str, str], title: Title
) -> Sheet:
    """Return the sheet of a sensor with its bracket: rows of the bill that are solids, and the numbers of drawings."""
    bodies = _taken_apart(sensor, mount)
    mass = 0.0
    for body in bodies:
        is_bought = not _BOUGHT.isdisjoint(body.name.split())
        density = STEEL_G_PER_CM3 if is_bought else title.process.density_g_per_cm3
        mass += 1e-3 * density * body.shape.Volume()
    views = views_of([body.shape for body in bodies], "corner")
    items: list[_Item] = []
    parts: list[tuple[str, ...]] = []
    named: set[str] = set()
    for row in bill:
        own = [view for body, view in zip(bodies, views, strict=True) if row.part in body.name.split()]
        if not own or row.part in named:
            continue
        named.add(row.part)
        number = len(items) + 1
        items.append(_Item(number, own))
        size = row.size.removesuffix(EACH)
        parts.append((str(number), str(row.count), row.part, size, numbers.get(row.part, row.standard)))

    def draw_views(canvas: Canvas) -> None:
        for view in views:
            draw_view(canvas, view)
        _draw_balloons(canvas, items)

    return on_sheet(draw_views, _NOTES, replace(title, mass_g=mass), parts)


def _taken_apart(sensor: Sensor, mount: cq.Shape) -> list[Body]:
    """Return every solid of the sensor and its bracket, moved along y so that there is room between them."""
    bodies = [Body(name="mount", shape=mount, colour=STEEL_COLOUR)]
    for body in assembly_bodies(sensor, behind=mounted_grip(sensor) - grip(sensor)):
        if body.name != "fruit":
            name = body.name.replace("plate", "housing")
            bodies.append(Body(name=name, shape=body.shape, colour=body.colour))

    places = []
    longest_screw = 0.0
    for body in bodies:
        box = body.shape.BoundingBox()
        place = box.center.y
        if body.name == "mount":  # the middle of its upright plate: its flange reaches over all
            place = back_of(sensor) + 0.5 * PLATE_MM
        elif body.name.startswith("screw"):
            place = box.ymin
            longest_screw = max(longest_screw, box.ylen)
        places.append(round(place, 3))
    layers = sorted(set(places))
    moved = []
    for body, place in zip(bodies, places, strict=True):
        layer = layers.index(place)
        out = _APART_MM * (layer - 0.5 * len(layers))
        if body.name.startswith("screw"):
            out -= longest_screw
        # so far down that no part before them hides the pins
        down = -_APART_MM * layer if "pin" in body.name.split() else 0.0
        moved.append(Body(name=body.name, shape=body.shape.translate(cq.Vector(0.0, out, down)), colour=body.colour))
    return moved


def _draw_balloons(canvas: Canvas, items: Sequence[_Item]) -> None:
    """Draw the numbers of the items in a row above and a row below, each with a line to the outermost of its edges."""
    picture = canvas.extents()
    middle = 0.5 * (picture.bottom + picture.top)
    radius = _BALLOON_MM / canvas.scale
    out = _OUT_MM / canvas.scale
    rows: dict[float, list[tuple[Point, int]]] = {picture.top + out: [], picture.bottom - out: []}
    upper, lower = rows
    for item in items:
        seen = [edge for view in item.views for edge in view.seen]
        edges = seen or [edge for view in item.views for edge in view.hidden]
        outermost = max((edge.positionAt(0.5) for edge in edges), key=lambda point: abs(point.y - middle))
        row = rows[upper if outermost.y > middle else lower]
        row.append(((outermost.x, outermost.y), item.number))
    for level, row in rows.items():
        free_from = picture.left + radius
        for target, number in sorted(row):
            x = max(target[0], free_from)
            free_from = x + 3.0 * radius
            canvas.circle((x, level), radius, "DIMENSIONS")
            canvas.words(str(number), (x, level), 1.2 * canvas.text_height)
            edge = level - radius if level > middle else level + radius
            canvas.line((x, edge), target, "DIMENSIONS")
            canvas.circle(target, 0.1 * radius, "DIMENSIONS")
