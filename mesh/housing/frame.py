"""The frame of the housing as four-sided blocks: walls with their holes in rings, and the top bar between them.

Units: mm; points are (x, z).
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

from cad.parts.housing import Housing
from mesh.housing.blocks import (
    Arm,
    Block,
    Counts,
    Fan,
    Point,
    Segment,
    arms,
    fan,
    fan_height,
    leaves,
    pieces,
    pieces_between,
    shuttle,
    straight_block,
)
from mesh.session import MeshError

_RING = 1.3  # least distance of a ring's edge from the centre of its hole, over the radius
_WIDE_RING = 1.7  # where a line is made for it
_TO_HOLE = 0.65  # share of the distance between leaf root and hole that a fan may take


def housing_blocks(housing: Housing, count: Counts) -> list[Block]:
    """Return the blocks of the profile; raises MeshError where two holes leave no wall between them."""
    blocks = [*_bar(housing, count)]
    for arm in arms(housing):
        blocks += _wall(housing, arm, count)
        blocks += shuttle(housing, arm, count)
        blocks += leaves(arm, count)
    return blocks


def _wall(housing: Housing, arm: Arm, count: Counts) -> Iterator[Block]:
    """Return the blocks of one wall: beside the cavity fans and cells, behind them the holes in rings."""
    lower, upper = arm.levels
    inside = 0.5 * arm.flexure.separation
    ceiling = housing.cavity_level - arm.flexure.fillet
    rooms = (min(lower - housing.protrusion, inside), min(ceiling - upper, inside))
    heights = [fan_height(arm.flexure, room) for room in rooms]
    fans = [(z - h, z, z + h) for z, h in zip(arm.levels, heights, strict=True)]
    lines = [housing.protrusion, *fans[0], *fans[1], ceiling, housing.cavity_level, housing.top_level]
    radius = 0.5 * housing.hole_diameter
    rings = [_ring_edge(hole, radius, sign, lines, fans) for hole, sign in zip(arm.holes, (1.0, -1.0), strict=True)]
    if not rings[0] <= rings[1]:
        reason = f"the holes at z = {arm.holes[0][1]:.4g} and {arm.holes[1][1]:.4g} mm leave no wall between them"
        raise MeshError("blocks", reason, "take smaller holes or a larger leaf separation")
    lines = sorted({*lines, *rings})
    inner = arm.wall - arm.inward * min(max(heights), _TO_HOLE * (abs(arm.holes[0][0] - arm.wall) - radius))
    for z, h in zip(arm.levels, heights, strict=True):
        yield fan(arm, arm.wall, z, (inner - arm.wall, h), count)
    knuckle = _knuckle(housing, arm)
    for a, b in pairwise(lines):
        number = pieces_between(a, b, fans, count)
        if not any(low <= a and b <= high for low, _, high in fans):
            yield _wall_cell(housing, arm, (inner, a, b), (number, count), knuckle)
    middle, outer = arm.holes[0][0], arm.wall - arm.inward * housing.wall_width
    for a, b in pairwise(line for line in lines if rings[0] <= line <= rings[1]):
        number = pieces_between(a, b, fans, count)
        for x0, x1 in ((inner, middle), (middle, outer)):
            yield straight_block(((x0, a), (x1, a), (x1, b), (x0, b)), (count.sector, number))
    for hole, (start, end) in zip(arm.holes, ((lines[0], rings[0]), (rings[1], lines[-1])), strict=True):
        beside = [line for line in lines if start <= line <= end]
        edges = [((inner, a), (inner, b), pieces_between(a, b, fans, count)) for a, b in pairwise(beside)]
        far = [(outer, end), (outer, hole[1]), (outer, start)]
        around = [(inner, end), (middle, end), *far, (middle, start), (inner, start)]
        edges += [(p, q, count.sector) for p, q in pairwise(around)]
        yield from _ring(hole, radius, edges, count)


def _ring_edge(hole: Point, radius: float, sign: float, lines: Sequence[float], fans: Sequence[Fan]) -> float:
    """Return the line across a wall where the ring of a hole ends, above it or below it (sign -1).

    It is a line at hand, or a new one where none is near; never one across a fan, whose sectors are fixed.
    """
    _, z = hole
    near = [line for line in lines if _RING * radius <= sign * (line - z) <= 2.0 * _WIDE_RING * radius]
    if near:
        return min(near, key=lambda line: sign * (line - z))
    made = z + sign * _WIDE_RING * radius
    return next(((high if sign > 0.0 else low) for low, _, high in fans if low < made < high), made)


def _knuckle(housing: Housing, arm: Arm) -> Point:
    """Return the middle of the fillet between wall and top bar."""
    reach = arm.flexure.fillet * (1.0 - math.sqrt(0.5))
    return arm.wall + arm.inward * reach, housing.cavity_level - reach


def _wall_cell(
    housing: Housing, arm: Arm, place: tuple[float, float, float], number: tuple[int, Counts], knuckle: Point
) -> Block:
    """Return the block between a line behind the fans and the cavity; the fillet in the corner bends its side."""
    inner, a, b = place
    along, count = number
    lower = knuckle if a == housing.cavity_level else (arm.wall, a)
    upper = knuckle if b == housing.cavity_level else (arm.wall, b)
    cell = straight_block(((inner, a), lower, upper, (inner, b)), (count.sector, along))
    if b != housing.cavity_level:
        return cell
    return Block(sides=(cell.sides[0], (_half_fillet(housing, arm, (arm.wall, a), along),), *cell.sides[2:]))


def _half_fillet(housing: Housing, arm: Arm, start: Point, number: int) -> Segment:
    r = arm.flexure.fillet
    centre = (arm.wall + arm.inward * r, housing.cavity_level - r)
    return Segment(start=start, end=_knuckle(housing, arm), count=number, centre=centre)


def _bar(housing: Housing, count: Counts) -> Iterator[Block]:
    """Return the blocks of the top bar between the walls."""
    high = pieces(housing.top_level - housing.cavity_level, count)
    ends = []
    for arm in arms(housing):
        x = arm.wall + arm.inward * arm.flexure.fillet
        ceiling, top = (x, housing.cavity_level), (x, housing.top_level)
        over_wall = (arm.wall, housing.top_level)
        corner = straight_block((_knuckle(housing, arm), ceiling, top, over_wall), (count.sector, high))
        yield Block(sides=((_half_fillet(housing, arm, ceiling, count.sector),), *corner.sides[1:]))
        ends.append((ceiling, top))
    (a, d), (b, c) = ends
    yield straight_block((a, b, c, d), (pieces(b[0] - a[0], count), high))


def _ring(hole: Point, radius: float, edges: Sequence[tuple[Point, Point, int]], count: Counts) -> Iterator[Block]:
    """Return the blocks between a hole and the edges around it."""

    def foot(point: Point) -> Point:
        away = math.dist(point, hole)
        return hole[0] + radius * (point[0] - hole[0]) / away, hole[1] + radius * (point[1] - hole[1]) / away

    for a, b, number in edges:
        sides = straight_block((a, b, foot(b), foot(a)), (number, count.ring)).sides
        arc = Segment(start=foot(a), end=foot(b), count=number, centre=hole, surface="mounting_holes")
        yield Block(sides=(*sides[:2], (arc,), sides[3]))
