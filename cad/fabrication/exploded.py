"""The exploded view of a sensor, exploded.svg: its parts moved apart along the screws, numbered as in the bill."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cadquery as cq

from cad.drawing.projection import edge_points, point_in_view, project_visible_edges
from cad.fabrication.bill import BillLine
from cad.fabrication.sheet_templates import render_template
from cad.parts.assembly import part_type, placed_shape

# The prefixes of part names in the assembly, from the front to the back, and the names of these parts in the bill.
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
_GAP_MM = 9.0  # gap between neighbouring parts, and between a pin and its foot
_BEHIND_COVER_MM = 30.0  # gap behind a front cover, wide enough to show the springs
_PARTLY_HIDDEN = ("back_washer", "nut")  # groups whose parts on the left are hidden by the bracket
_ABOVE_PICTURE_MM = 7.0  # space between the picture and the numbers above it
_BALLOON_SPACING_MM = 11.0  # smallest distance between the centres of two numbers
_CHORD_MM = 0.5  # chord height of the triangles that are searched for the highest point


@dataclass(frozen=True)
class Balloon:
    """A number of the bill at the position `x` [mm], with a line to the point `at` [mm] of its part."""

    number: int
    x: float
    at: tuple[float, float]


def write_exploded(assembly: cq.Assembly, bill: Sequence[BillLine], path: Path) -> None:
    """Write the exploded view of a sensor with its bracket to an SVG file, with the numbers of the bill.

    Raises OSError if the file cannot be written.
    """
    groups = explode(assembly)
    shapes = [placed_shape(part) for group in groups.values() for part in group]
    edges = project_visible_edges(cq.Compound.makeCompound(shapes), "corner")
    # The kernel returns edges in any order. Sorted and rounded lines make the files of identical sensors identical.
    lines = sorted([(round(x, 2), round(y, 2)) for x, y in edge_points(edge)] for edge in edges)
    text = render_template(
        "exploded.svg.jinja", lines=lines, balloons=place_balloons(groups, bill), room=_ABOVE_PICTURE_MM
    )
    path.write_text(text, encoding="utf-8")


def explode(assembly: cq.Assembly) -> dict[str, list[cq.Assembly]]:
    """Group the parts of a sensor by their position in the stack, and return the groups moved apart along y [mm].

    The groups are keyed by the names in `_STACK`, which run from the front to the back. The fruit is omitted. Pins form
    groups of their own, such as `pin housing`, and are also moved down, out of the housing or the plate that holds
    them.
    """
    parts = assembly.children
    all_pins = [part for part in parts if part_type(part) == "pin"]
    groups: dict[str, list[cq.Assembly]] = {}
    front_y = 0.0  # y coordinate at which the next group begins
    for position in _STACK:
        group = [part for part in parts if part.name == position or part.name.startswith(f"{position}_")]
        if not group:  # this sensor has no such part
            continue
        box = cq.Compound.makeCompound([placed_shape(part) for part in group]).BoundingBox()
        groups[position] = _displace(group, front_y - box.ymin)
        pins = _pins_held_by(position, all_pins)
        if pins:
            groups[f"pin {position}"] = _displace(pins, front_y - box.ymin, -_GAP_MM)
        front_y += box.ylen + (_BEHIND_COVER_MM if position == "front_cover" else _GAP_MM)
    return groups


def _pins_held_by(position: str, pins: Sequence[cq.Assembly]) -> list[cq.Assembly]:
    """Return the pins that are glued into the part at a position in the stack: the housing or a plate."""
    if position == "housing":
        return list(pins)
    if position.startswith("plate"):
        # Plate 1 holds the pins whose names end with 1, and plate 2 the pins whose names end with 2.
        return [pin for pin in pins if pin.name[-1] == position[-1]]
    return []


def place_balloons(groups: dict[str, list[cq.Assembly]], bill: Sequence[BillLine]) -> list[Balloon]:
    """Return the numbers of the groups of parts, placed in one row above the picture [mm].

    `groups` is the result of `explode`. Each number is above the highest point of its group, or farther to the right
    if the previous number is too close.
    """
    numbers: dict[str, int] = {}
    for number, row in enumerate(bill, start=1):
        numbers.setdefault(row.part, number)  # a part with several lines in the bill gets the number of the first line
    targets = []  # the point (x, y) of each group to which its line leads, and the number of the group
    for position, group in groups.items():
        part_name = _STACK.get(position, "pin")  # the only groups that are not named in `_STACK` are pins
        targets.append((_highest_point(position, group), numbers[part_name]))
    balloons: list[Balloon] = []
    for target, number in sorted(targets):  # from left to right
        x = target[0]
        if balloons:
            x = max(x, balloons[-1].x + _BALLOON_SPACING_MM)
        balloons.append(Balloon(number, x, target))
    return balloons


def _displace(parts: Sequence[cq.Assembly], y: float, z: float = 0.0) -> list[cq.Assembly]:
    """Return copies of parts, displaced by `y` and `z` [mm]."""
    displacement = cq.Location(cq.Vector(0.0, y, z))
    return [cq.Assembly(part.obj, loc=displacement * part.loc, name=part.name) for part in parts]


def _highest_point(position: str, group: Sequence[cq.Assembly]) -> tuple[float, float]:
    """Return the highest point (x, y) of a group of parts in the exploded view [mm].

    `position` is the name of the group. The line of a number must lead to a visible part. If the bracket hides some
    parts of the group, only the parts farthest to the right are therefore searched.
    """
    shapes = [placed_shape(part) for part in group]
    visible = shapes
    if position in _PARTLY_HIDDEN:
        right_edge = max(shape.BoundingBox().xmax for shape in shapes)
        # The chord height also serves as the tolerance of this comparison.
        visible = [shape for shape in shapes if shape.BoundingBox().xmax > right_edge - _CHORD_MM]
    points = []
    for shape in visible:
        # OCCT stores triangles in a shape, and would reuse finer ones of an earlier call. The copy has none.
        corners, _ = shape.copy().tessellate(_CHORD_MM)
        points += [point_in_view(corner, "corner") for corner in corners]
    return max(points, key=lambda point: point[1])
