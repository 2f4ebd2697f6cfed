"""The frame of the housing as four-sided blocks: walls with their holes in rings, and the top bar between them.

Units: mm; points are (x, z).
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

from cad.parts.housing import Arm, Housing
from mesh.housing import blocks
from mesh.housing.blocks import Block, Counts, Point, Segment
from mesh.session import MeshError

_RING = 1.3  # least distance of a ring's edge from the centre of its hole, over the radius
_WIDE_RING = 1.7  # where a line is made for it
_TO_HOLE = 0.65  # fraction of the distance between leaf root and hole that a fan may take


def housing_blocks(housing: Housing, count: Counts) -> list[Block]:
    """Return the blocks of the profile; raises MeshError where two holes leave no wall between them."""
    profile = _bar(housing, count)
    for arm in housing.arms:
        profile += _Wall(housing, arm, count).blocks()
        profile += blocks.shuttle(housing, arm, count)
        profile += blocks.leaves(arm, count)
    return profile


def post_columns(housing: Housing, arm: Arm, count: Counts) -> tuple[float, float]:
    """Return x [mm] at which the plain cells between a wall's fans and the rings of its post begin and end."""
    wall = _Wall(housing, arm, count)
    return wall.inner, wall.ring_edge


class _Wall:
    """One wall: beside the cavity fans and cells, behind them the holes in rings; levels z and columns x [mm].

    A wall that is wider than its post has plain cells in between.
    """

    def __init__(self, housing: Housing, arm: Arm, count: Counts) -> None:
        """Find the levels across the wall, those of the rings' edges among them."""
        self.housing = housing
        self.arm = arm
        self.count = count
        self.radius = 0.5 * housing.hole_diameter
        ceiling = housing.cavity_level - arm.flexure.fillet
        self.fans = blocks.fans_between(arm, housing.protrusion, ceiling)
        levels = [housing.protrusion, *self.fans[0].levels, *self.fans[1].levels]
        levels += [ceiling, housing.cavity_level, housing.top_level]
        lower, upper = arm.holes
        self.rings = self._ring_edge(lower, 1.0, levels), self._ring_edge(upper, -1.0, levels)
        self.levels = sorted({*levels, *self.rings})

        # x where the fans end, and where the rings begin: the same, but in a wall wider than its post
        to_hole = _TO_HOLE * (abs(arm.holes[0][0] - arm.post) - self.radius)
        reach = arm.sign * min(max(fan.height for fan in self.fans), to_hole)
        self.inner = arm.wall + reach
        self.ring_edge = arm.post + reach

    def blocks(self) -> Iterator[Block]:
        """Yield the blocks; raises MeshError where two holes leave no wall between them."""
        (_, lower), (_, upper) = self.arm.holes
        if not self.rings[0] <= self.rings[1]:
            reason = f"the holes at z = {lower:.4g} and {upper:.4g} mm leave no wall between them"
            raise MeshError("blocks", reason, "take smaller holes or a larger leaf separation")
        for fan in self.fans:
            yield blocks.fan_block(self.arm, self.arm.wall, fan, self.inner - self.arm.wall, self.count)
        for a, b in pairwise(self.levels):
            if not blocks.in_fan(a, b, self.fans):
                yield self._cell(a, b)
        before_post = abs(self.ring_edge - self.inner)
        if before_post > 0.0:
            columns = blocks.pieces(before_post, self.count)
            for a, b in pairwise(self.levels):
                yield blocks.rectangle((self.inner, self.ring_edge), (a, b), columns, self._pieces(a, b))
        middle = self.arm.holes[0][0]
        for a, b in pairwise(self._levels_within(*self.rings)):
            for x in ((self.ring_edge, middle), (middle, self.arm.outer)):
                yield blocks.rectangle(x, (a, b), self.count.sector, self._pieces(a, b))
        yield from self._ring(self.arm.holes[0], self.levels[0], self.rings[0])
        yield from self._ring(self.arm.holes[1], self.rings[1], self.levels[-1])

    def _levels_within(self, start: float, end: float) -> list[float]:
        return [level for level in self.levels if start <= level <= end]

    def _pieces(self, a: float, b: float) -> int:
        return blocks.pieces_between(a, b, self.fans, self.count)

    def _ring_edge(self, hole: Point, sign: float, levels: Sequence[float]) -> float:
        """Return the level at which the ring of a hole ends, above the hole or below it (sign -1).

        It is one of the levels, or a new one where none is near; never one in a fan, whose sectors are fixed.
        """
        _, z = hole
        near = [level for level in levels if _RING <= sign * (level - z) / self.radius <= 2.0 * _WIDE_RING]
        if near:
            return min(near, key=lambda level: sign * (level - z))
        level = z + sign * _WIDE_RING * self.radius
        edges = [fan.levels for fan in self.fans if fan.levels[0] < level < fan.levels[2]]
        return edges[0][2 if sign > 0.0 else 0] if edges else level

    def _cell(self, a: float, b: float) -> Block:
        """Return the block between two levels, the fans' inner edge and the cavity; a fillet bends the corner's."""
        ceiling = self.housing.cavity_level
        wall = self.arm.wall
        knuckle = _knuckle(self.housing, self.arm)
        start = knuckle if a == ceiling else (wall, a)
        end = knuckle if b == ceiling else (wall, b)
        number = self._pieces(a, b)
        cell = blocks.straight_block(((self.inner, a), start, end, (self.inner, b)), self.count.sector, number)
        if b != ceiling:
            return cell
        fillet = _half_fillet(self.housing, self.arm, (wall, a), number)
        return Block(sides=(cell.sides[0], (fillet,), *cell.sides[2:]))

    def _ring(self, hole: Point, start: float, end: float) -> Iterator[Block]:
        """Yield the blocks between a hole and a frame around it that reaches from one level to another."""
        for a, b, number in self._frame(hole, start, end):
            on_a = _on_circle(hole, self.radius, a)
            on_b = _on_circle(hole, self.radius, b)
            sides = blocks.straight_block((a, b, on_b, on_a), number, self.count.ring).sides
            arc = Segment(start=on_a, end=on_b, count=number, centre=hole, surface="mounting_holes")
            yield Block(sides=(*sides[:2], (arc,), sides[3]))

    def _frame(self, hole: Point, start: float, end: float) -> Iterator[tuple[Point, Point, int]]:
        """Yield the edges of the frame around a hole with their numbers of elements."""
        inner = self.ring_edge
        middle = hole[0]
        outer = self.arm.outer
        for a, b in pairwise(self._levels_within(start, end)):
            yield (inner, a), (inner, b), self._pieces(a, b)
        far = [(outer, end), (outer, hole[1]), (outer, start)]
        corners = [(inner, end), (middle, end), *far, (middle, start), (inner, start)]
        for start_point, end_point in pairwise(corners):
            yield start_point, end_point, self.count.sector


def _on_circle(centre: Point, radius: float, point: Point) -> Point:
    """Return the point of a circle that is nearest to a point."""
    distance = math.dist(point, centre)
    x = centre[0] + radius * (point[0] - centre[0]) / distance
    z = centre[1] + radius * (point[1] - centre[1]) / distance
    return x, z


def _knuckle(housing: Housing, arm: Arm) -> Point:
    """Return the middle of the fillet between wall and top bar."""
    reach = arm.flexure.fillet * (1.0 - math.sqrt(0.5))
    return arm.wall - arm.sign * reach, housing.cavity_level - reach


def _half_fillet(housing: Housing, arm: Arm, start: Point, number: int) -> Segment:
    r = arm.flexure.fillet
    centre = (arm.wall - arm.sign * r, housing.cavity_level - r)
    return Segment(start=start, end=_knuckle(housing, arm), count=number, centre=centre)


def _bar(housing: Housing, count: Counts) -> list[Block]:
    """Return the blocks of the top bar between the walls."""
    high = blocks.pieces(housing.top_level - housing.cavity_level, count)
    bar = []
    ends = []
    for arm in housing.arms:
        x = arm.wall - arm.sign * arm.flexure.fillet
        ceiling = (x, housing.cavity_level)
        top = (x, housing.top_level)
        over_wall = (arm.wall, housing.top_level)
        corner = blocks.straight_block((_knuckle(housing, arm), ceiling, top, over_wall), count.sector, high)
        bar.append(Block(sides=((_half_fillet(housing, arm, ceiling, count.sector),), *corner.sides[1:])))
        ends.append((ceiling, top))
    (a, d), (b, c) = ends
    bar.append(blocks.straight_block((a, b, c, d), blocks.pieces(b[0] - a[0], count), high))
    return bar
