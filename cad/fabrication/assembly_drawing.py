"""The drawing of the assembly: taken apart along its screws, each part with its number in the list of parts [mm]."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import cadquery as cq

from cad.drawing.canvas import Canvas, Point
from cad.drawing.sheet import Sheet, Title, on_sheet
from cad.drawing.view import View, draw_view, views_of
from cad.fabrication.bill import Row
from cad.fabrication.mount import PLATE_MM, back_of, mounted_grip
from cad.fabrication.templates import EACH
from cad.parts.assembly import APART, assembly_bodies, grip, outwards
from cad.parts.pin import STEEL_G_PER_CM3
from cad.parts.sensor import STEEL_COLOUR, Body, Sensor

_FARTHER = 1.6  # than in the animation of assembly.glb: nothing on paper can be turned
_BALLOON_MM = 4.0  # radius on paper, ISO 6433
_OUT_MM = 9.0  # on paper, from the picture to the balloons
_BOUGHT = {"screw", "nut", "washer", "dowel", "pin"}  # of steel
_NOTES = (
    "Isometric view, taken apart along the screws.",
    "Dowels and pins are pressed or glued in, see fabrication.md.",
    "The screws are those that hold the bracket too.",
)


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
    items: dict[str, list[View]] = {}  # by what they are called in the bill
    parts: list[tuple[str, ...]] = []
    for row in bill:
        own = [view for body, view in zip(bodies, views, strict=True) if row.part in body.name.split()]
        if own and row.part not in items:
            items[row.part] = own
            number = numbers.get(row.part, row.standard)
            parts.append((str(len(items)), str(row.count), row.part, row.size.removesuffix(EACH), number))

    def draw_views(canvas: Canvas) -> None:
        for view in views:
            draw_view(canvas, view)
        _draw_balloons(canvas, tuple(items.values()))

    return on_sheet(draw_views, _NOTES, replace(title, mass_g=mass), parts)


def _taken_apart(sensor: Sensor, mount: cq.Shape) -> list[Body]:
    """Return every solid of the sensor and its bracket, moved along y so that there is room between them."""
    behind_all = _FARTHER * APART * (back_of(sensor) + 0.5 * PLATE_MM)
    places = [(Body(name="mount", shape=mount, colour=STEEL_COLOUR), behind_all)]
    for body in assembly_bodies(sensor, behind=mounted_grip(sensor) - grip(sensor)):
        if body.name != "fruit":
            named = replace(body, name=body.name.replace("plate", "housing"))
            places.append((named, _FARTHER * outwards(body)))
    foremost = min(out for _, out in places)
    moved = []
    for body, out in places:
        # so far down that no part before them hides the pins
        down = foremost - out if "pin" in body.name.split() else 0.0
        moved.append(replace(body, shape=body.shape.translate(cq.Vector(0.0, out, down))))
    return moved


def _draw_balloons(canvas: Canvas, items: Sequence[Sequence[View]]) -> None:
    """Draw the numbers of the items in a row above and a row below, each with a line to the outermost of its edges."""
    picture = canvas.extents()
    middle = 0.5 * (picture.bottom + picture.top)
    radius = _BALLOON_MM / canvas.scale
    out = _OUT_MM / canvas.scale
    rows: dict[float, list[tuple[Point, int]]] = {picture.top + out: [], picture.bottom - out: []}
    upper, lower = rows
    for number, views in enumerate(items, start=1):
        edges = [edge for view in views for edge in view.seen] or [edge for view in views for edge in view.hidden]
        outermost = max((edge.positionAt(0.5) for edge in edges), key=lambda point: abs(point.y - middle))
        row = rows[upper if outermost.y > middle else lower]
        row.append(((outermost.x, outermost.y), number))
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
