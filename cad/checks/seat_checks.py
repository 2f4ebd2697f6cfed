"""Verdicts on the seats of a Hall read-out: pockets for magnets in the shuttles, windows for sensors in a cover."""

import itertools
import math
from collections.abc import Iterator

import cadquery as cq

from cad.checks.line_probe import UP, Lines, Vector, open_ahead, solid_lines
from cad.checks.tip_checks import PLACE_TOLERANCE_MM
from cad.parts.cover import RECESS_MM
from cad.parts.hall_seats import LEDGE_MM, HallSeats
from cad.parts.sensor import SensorSolids
from sensor.design.readout import PROBE
from sensor.verdict import Verdict, at_least, failed_verdict

_CROSSWISE: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), UP, (0.0, 0.0, -1.0))
_INWARDS: Vector = (0.0, 1.0, 0.0)
_OUTSIDE = 0.5  # [mm] before a face, where a line that measures a depth starts
_BEFORE_LEDGE = 0.1  # [mm] of lines that measure a window
_ON_DISC = 0.98  # of the radius of a magnet, where the depth of its pocket is measured


class _SeatError(ValueError):
    """A seat that is not there, or has another size; the message says where."""


def pocket_verdicts(sensor: SensorSolids) -> tuple[Verdict, ...]:
    """Return geometry.magnet_pockets [mm]: the thinnest wall around a pocket for a magnet.

    It fails where a pocket is off its place, diameter or depth. None without a Hall read-out.
    """
    if sensor.seats is None:
        return ()
    seats = sensor.seats
    lines = solid_lines(sensor.part.shape)
    size = f"diameter {seats.pocket_diameter:g}, depth {seats.pocket_depth:g} mm"
    return (_verdict("geometry.magnet_pockets", _pocket_walls(lines, sensor, seats), seats, f"pockets of {size}"),)


def window_verdicts(sensor: SensorSolids, front_cover: cq.Shape) -> tuple[Verdict, ...]:
    """Return geometry.sensor_windows [mm]: the thinnest wall under and between the Hall sensors of a front cover.

    It fails where a window is off its place or size. None without a Hall read-out.
    """
    if sensor.seats is None:
        return ()
    seats = sensor.seats
    lines = solid_lines(front_cover)
    size = f"{seats.window_width:g} x {seats.window_height:g} mm"
    return (_verdict("geometry.sensor_windows", _window_walls(lines, sensor, seats), seats, f"windows of {size}"),)


def _verdict(name: str, walls: Iterator[float], seats: HallSeats, what: str) -> Verdict:
    try:
        least = min(walls)
    except _SeatError as error:
        return failed_verdict(name, seats.least_wall, unit="mm", reference=str(error))
    reference = f"lines to the walls around {what}; thinnest wall"
    return at_least(name, least, seats.least_wall, PLACE_TOLERANCE_MM, unit="mm", reference=reference)


def _pocket_walls(lines: Lines, sensor: SensorSolids, seats: HallSeats) -> Iterator[float]:
    """Yield the walls [mm] beside and behind each pocket; raises _SeatError for one that holds no magnet."""
    housing = sensor.housing
    front = -0.5 * housing.depth
    radius = 0.5 * seats.pocket_diameter
    at_edge = 0.5 * _ON_DISC * PROBE.magnet_mm
    for arm, below in itertools.product(housing.arms, seats.discs):
        level = housing.top_level - below
        where = f"the pocket of the {arm.name} shuttle {below:.2f} mm below the upper edge"
        middle = (arm.centre, front + 0.5 * seats.pocket_depth, level)
        for x, _, z in _CROSSWISE:
            yield _wall(lines, middle, (x, 0.0, z), radius, where)
            start = (arm.centre + at_edge * x, front - _OUTSIDE, level + at_edge * z)
            yield _wall(lines, start, _INWARDS, _OUTSIDE + seats.depth_at(at_edge), where)
        yield _wall(lines, (arm.centre, front - _OUTSIDE, level), _INWARDS, _OUTSIDE + seats.depth_at(0.0), where)


def _window_walls(lines: Lines, sensor: SensorSolids, seats: HallSeats) -> Iterator[float]:
    """Yield the thickness of the ledges and the walls beside each window [mm]; raises _SeatError."""
    housing = sensor.housing
    front = -0.5 * housing.depth
    level = housing.top_level - seats.sensor
    if housing.spacing < PROBE.package_width_mm:
        msg = f"sensors {PROBE.package_width_mm:g} mm wide have no room side by side, {housing.spacing:g} mm apart"
        raise _SeatError(msg)
    before_ledge = front - seats.face_out - _BEFORE_LEDGE
    for centre in seats.windows:
        middle = (centre, before_ledge, level)
        where = f"the window at x = {centre:g} mm"
        half_sizes = (0.5 * seats.window_width,) * 2 + (0.5 * seats.window_height,) * 2
        for direction, half in zip(_CROSSWISE, half_sizes, strict=True):
            yield _wall(lines, middle, direction, half, where)
    for arm, side in itertools.product(housing.arms, (-1.0, 1.0)):
        where = f"the window over the {arm.name} shuttle"
        start = (arm.centre, before_ledge, level + side * 0.5 * (seats.window_height - LEDGE_MM))
        thickness = _wall(lines, start, _INWARDS, _BEFORE_LEDGE, where)
        if abs(thickness - (seats.face_out - RECESS_MM)) > PLACE_TOLERANCE_MM:
            msg = f"{where}: a ledge is {thickness:.3f} mm thick, must be {seats.face_out - RECESS_MM:.3f} mm"
            raise _SeatError(msg)
        yield thickness


def _wall(lines: Lines, start: Vector, direction: Vector, expected: float, where: str) -> float:
    """Return the thickness [mm] of the first wall that a line meets, which must begin so far from its start [mm]."""
    begins = open_ahead(lines, start, direction)
    if math.isnan(begins) or abs(begins - expected) > PLACE_TOLERANCE_MM:
        found = "material" if math.isnan(begins) else f"{begins:.3f} mm"
        msg = f"{where}: {found} from its middle to a wall, must be {expected:.3f} mm"
        raise _SeatError(msg)
    return next(span.leave - span.enter for span in lines(start, direction) if span.enter > 0.0)
