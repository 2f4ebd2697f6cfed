"""The sizes of the cover and the bracket for the fabrication sheet."""

from collections.abc import Sequence
from dataclasses import dataclass

import cadquery as cq

from cad.fabrication.mount import (
    FLANGE_CIRCLE_MM,
    FLANGE_HOLE_MM,
    bracket_seat_y,
    flange_holes,
    shelf_solid,
    upright_solid,
    window_solid,
)
from cad.parts.cover import COVER_MM, RECESS_MM
from cad.parts.hall_seats import LEDGE_MM
from cad.parts.housing import SETBACK_MM, Housing
from cad.parts.sensor import SensorSolids

_DECIMALS = 2  # decimals of a size [mm]


@dataclass(frozen=True)
class SizeLine:
    """A line of a table: the name of a size, and its value [mm] as text."""

    what: str
    size: str


def cover_sizes(sensor: SensorSolids) -> tuple[SizeLine, ...]:
    """Return the sizes of the cover in the pose of cover.stl, with its rim up and the side of the tips in front.

    With a Hall read-out, the sizes of the windows for the sensors are included.
    """
    housing, seats = sensor.housing, sensor.seats
    width = housing.right - housing.left
    height = housing.top_level - housing.cover_level
    sizes = [
        SizeLine("width x height x thickness with rim", _join_sizes(width, height, COVER_MM)),
        SizeLine("height of the rim", _size_text(RECESS_MM)),
        SizeLine("width of the rim on the posts", _size_text(housing.wall_width - SETBACK_MM)),
        SizeLine("width of the rim on the bar", _size_text(housing.top_level - housing.cavity_level - SETBACK_MM)),
        *_screw_hole_lines(housing, housing.top_level),
    ]
    if seats is not None:
        # The windows have the coordinates of a cover on the front, whose rim is seen from behind. The x axis then
        # points to the left, so the left edge of the cover is at x = housing.right.
        centres = [(housing.right - centre, seats.sensor_level) for centre in seats.windows]
        sizes += [
            SizeLine("windows, width x height", _join_sizes(seats.window_width, seats.window_height)),
            SizeLine("slot between their ledges, height", _size_text(seats.window_height - 2.0 * LEDGE_MM)),
            SizeLine("depth of a window to its ledges", _size_text(COVER_MM - seats.face_distance)),
            SizeLine("centres of windows, from the left and the upper edge", _points_text(centres)),
        ]
    return tuple(sizes)


def bracket_sizes(sensor: SensorSolids) -> tuple[SizeLine, ...]:
    """Return the sizes of the bracket, as seen from the front of the sensor with the flange at the top.

    The upright plate carries the sensor, and the plate under the flange is the shelf of the bracket.
    """
    plate = upright_solid(sensor).BoundingBox()
    flange = shelf_solid(sensor).BoundingBox()
    left_text = _size_text(flange.xmin - plate.xmin)
    front_text = _size_text(bracket_seat_y(sensor) - flange.ymin)
    sizes = [
        SizeLine(
            "upright plate, width x height with the flange x thickness", _join_sizes(plate.xlen, plate.zlen, plate.ylen)
        ),
        SizeLine(
            "plate under the flange, width x depth x thickness", _join_sizes(flange.xlen, flange.ylen, flange.zlen)
        ),
        SizeLine("left edge of the plate under the flange, from the left edge of the upright", left_text),
        SizeLine("front edge of the plate under the flange, in front of the seat of the sensor", front_text),
        *_screw_hole_lines(sensor.housing, plate.zmax),
        *_flange_hole_lines(flange_holes(sensor), flange),
    ]
    opening = window_solid(sensor)  # None if no Hall sensor faces the bracket
    if opening is not None:
        box = opening.BoundingBox()
        sizes.append(SizeLine("window, width x height", _join_sizes(box.xlen, box.zlen)))
        centre_text = _points_text([_centre_from_corner(box, plate)])
        sizes.append(SizeLine("centre of the window, from the left and the upper edge", centre_text))
    return tuple(sizes)


def _flange_hole_lines(holes: Sequence[tuple[float, float]], flange: cq.BoundBox) -> tuple[SizeLine, ...]:
    """Return the table lines for the flange holes, with their positions from the left and the front edge of a plate.

    `holes` are their centres (x, y) [mm], and `flange` is the bounding box of the plate under the flange.
    """
    centres = [(x - flange.xmin, y - flange.ymin) for x, y in holes]
    return (
        SizeLine("holes of the flange, diameter", f"{len(holes)} x {_size_text(FLANGE_HOLE_MM)}"),
        SizeLine("bolt circle of the flange, diameter", _size_text(FLANGE_CIRCLE_MM)),
        SizeLine(
            "centres of the holes of the flange, from the left and the front edge of their plate", _points_text(centres)
        ),
    )


def _screw_hole_lines(housing: Housing, top: float) -> tuple[SizeLine, ...]:
    """Return the table lines for the screw holes, with their positions from the left edge and from z = `top` [mm]."""
    centres = [(x - housing.left, top - z) for x, z in housing.holes]
    return (
        SizeLine("holes for screws, diameter", f"{len(centres)} x {_size_text(housing.hole_diameter)}"),
        SizeLine("centres of the screw holes, from the left and the upper edge", _points_text(centres)),
    )


def _centre_from_corner(box: cq.BoundBox, plate: cq.BoundBox) -> tuple[float, float]:
    """Return the distances [mm] from the left and top edges of a plate to the centre of a box."""
    return box.center.x - plate.xmin, plate.zmax - box.center.z


def _size_text(size: float) -> str:
    """Return a size [mm] as text with at most two decimals."""
    return f"{round(size, _DECIMALS):g}"


def _join_sizes(*sizes: float) -> str:
    """Return sizes [mm] as text, such as `20 x 5 x 2`."""
    return " x ".join(map(_size_text, sizes))


def _points_text(points: list[tuple[float, float]]) -> str:
    """Return points [mm] as text, such as `4.5, 4; 40, 4`."""
    return "; ".join(f"{_size_text(x)}, {_size_text(y)}" for x, y in points)
