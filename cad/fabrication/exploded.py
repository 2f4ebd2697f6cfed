"""The exploded view of a sensor, exploded.svg: its parts along the screws, with their numbers in the bill."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cadquery as cq

from cad.drawing.projection import edge_points, point_in_view, view_of
from cad.fabrication.bill import BillLine
from cad.fabrication.sheet_templates import render_template
from cad.parts.assembly import placed_shape, product_of

# Prefixes of the names of parts in the assembly, from the front to the back, each with the name in the bill.
_STACK = {
    "screw": "screw",
    "front_washer": "washer",
    "front_cover": "cover",
    "housing": "housing",
    "plate_1": "housing",
    "dowel": "dowel",
    "plate_2": "housing",
    "back_cover": "cover",
    "mount": "mount",
    "back_washer": "washer",
    "nut": "nut",
}
_GAP_MM = 9.0  # gap between neighbours in the stack, and between a pin and its foot
_BEHIND_COVER_MM = 30.0  # gap behind a front cover, so that the springs are visible
_HIDDEN = ("back_washer", "nut")  # groups whose parts on the left are hidden by the bracket
_ROOM_MM = 7.0  # space between the picture and its numbers
_APART_MM = 11.0  # smallest distance between the centres of two numbers
_COARSE_MM = 0.5  # chord height of the triangles that are searched for the highest point


@dataclass(frozen=True)
class Balloon:
    """A number of the bill in the view: its position x, and the point `at` of its part to which a line leads [mm]."""

    number: int
    x: float
    at: tuple[float, float]


def write_exploded(assembly: cq.Assembly, bill: Sequence[BillLine], path: Path) -> None:
    """Write the exploded view of a sensor with its bracket as SVG; raises OSError."""
    groups = explode(assembly)
    shapes = [placed_shape(part) for group in groups.values() for part in group]
    edges = view_of(cq.Compound.makeCompound(shapes), "corner")
    lines = sorted([(round(x, 2), round(y, 2)) for x, y in edge_points(edge)] for edge in edges)
    text = render_template("exploded.svg.jinja", lines=lines, balloons=place_balloons(groups, bill), room=_ROOM_MM)
    path.write_text(text, encoding="utf-8")


def explode(assembly: cq.Assembly) -> dict[str, list[cq.Assembly]]:
    """Return the parts of a sensor grouped by their position in the stack, and moved apart along y [mm].

    The fruit is left out. Pins are also moved down, out of the housing or plate that holds them.
    """
    parts = assembly.children
    pins = [part for part in parts if product_of(part) == "pin"]
    groups: dict[str, list[cq.Assembly]] = {}
    front_y = 0.0
    for position in _STACK:
        group = [part for part in parts if part.name == position or part.name.startswith(f"{position}_")]
        if not group:
            continue
        box = cq.Compound.makeCompound([placed_shape(part) for part in group]).BoundingBox()
        groups[position] = _displace(group, front_y - box.ymin)
        # A plate holds the pins whose names end with its number.
        held_pins = [
            pin
            for pin in pins
            if position == "housing" or (position[-1] == pin.name[-1] and position.startswith("plate"))
        ]
        if held_pins:
            groups[f"pin {position}"] = _displace(held_pins, front_y - box.ymin, -_GAP_MM)
        front_y += box.ylen + (_BEHIND_COVER_MM if position == "front_cover" else _GAP_MM)
    return groups


def place_balloons(groups: dict[str, list[cq.Assembly]], bill: Sequence[BillLine]) -> list[Balloon]:
    """Return the numbers of the groups of parts, in one row above the picture [mm].

    Each number is above the highest point of its group, or farther right if the number to its left is too close.
    """
    numbers: dict[str, int] = {}
    for number, row in enumerate(bill, start=1):
        numbers.setdefault(row.part, number)
    # A part with several lines in the bill gets the number of its first line. Pins are in no position of the stack.
    targets = sorted(
        (_highest_point(position, group), numbers[_STACK.get(position, "pin")]) for position, group in groups.items()
    )
    balloons: list[Balloon] = []
    for target, number in targets:
        x = max(target[0], balloons[-1].x + _APART_MM) if balloons else target[0]
        balloons.append(Balloon(number, x, target))
    return balloons


def _displace(parts: Sequence[cq.Assembly], y: float, z: float = 0.0) -> list[cq.Assembly]:
    """Return copies of parts, displaced along y and z [mm]."""
    displacement = cq.Location(cq.Vector(0.0, y, z))
    return [cq.Assembly(part.obj, loc=displacement * part.loc, name=part.name) for part in parts]


def _highest_point(position: str, group: Sequence[cq.Assembly]) -> tuple[float, float]:
    """Return the highest point of a group of parts in the view [mm].

    In groups that are partly hidden by the bracket, only the parts on the right are searched.
    """
    shapes = [placed_shape(part) for part in group]
    rightmost = max(shape.BoundingBox().xmax for shape in shapes)
    visible = [
        shape for shape in shapes if position not in _HIDDEN or shape.BoundingBox().xmax > rightmost - _COARSE_MM
    ]
    corners = [corner for shape in visible for corner in shape.copy().tessellate(_COARSE_MM)[0]]
    return max((point_in_view(corner, "corner") for corner in corners), key=lambda point: point[1])
