"""The frame of the housing as four-sided blocks: walls with rings around their holes, and the top bar between them.

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
_WIDE_RING = 1.7  # this distance if the edge gets a line of its own
_TO_HOLE = 0.65  # largest extent of a fan over the distance between leaf root and hole


def housing_blocks(housing: Housing, count: Counts) -> list[Block]:
    """Return the blocks of the profile; raises MeshError if two holes leave no wall between them."""
    profile = _bar(housing, count)
    for arm in housing.arms:
        profile += _Wall(housing, arm, count).blocks()
        profile += blocks.shuttle(housing, arm, count)
        profile += blocks.leaves(arm, count)
    return profile


def post_columns(housing: Housing, arm: Arm, count: Counts) -> tuple[float, float]:
    """Return x [mm] where the plain cells between a wall's fans and the rings of its post begin and end."""
    wall = _Wall(housing, arm, count)
    return wall.fan_end_x, wall.ring_start_x


class _Wall:
    """One wall: fans and cells beside the cavity, and behind them the holes in rings; levels z and columns x [mm].

        cavity | upper fan | plain cells | upper ring  | outside     z up
        cavity | cells     | plain cells | two columns | outside
        cavity | lower fan | plain cells | lower ring  | outside
              wall      fan_end_x   ring_start_x     outer           x, away from the cavity

    There are plain cells only if the wall is wider than its post.
    """

    def __init__(self, housing: Housing, arm: Arm, count: Counts) -> None:
        """Find the levels that divide the wall, and the columns where fans end and rings begin.

        Levels are needed at the fans, at the fillet under the top bar, and at the edges of the rings.
        """
        self.housing = housing
        self.arm = arm
        self.count = count
        self.radius = 0.5 * housing.hole_diameter
        ceiling = housing.cavity_level - housing.corner
        self.fans = blocks.fans_between(arm, housing.protrusion, ceiling)
        lower_fan, upper_fan = self.fans
        levels = [housing.protrusion, *lower_fan.levels, *upper_fan.levels]
        levels += [ceiling, housing.cavity_level, housing.top_level]
        lower_hole, upper_hole = arm.holes
        self.lower_ring_top = self._ring_end_level(lower_hole, 1.0, levels)
        self.upper_ring_bottom = self._ring_end_level(upper_hole, -1.0, levels)
        self.levels = sorted({*levels, self.lower_ring_top, self.upper_ring_bottom})

        # x where the fans end and where the rings begin, which differ only in a wall wider than its post
        to_hole = _TO_HOLE * (abs(lower_hole[0] - arm.post) - self.radius)
        reach = arm.sign * min(max(lower_fan.height, upper_fan.height), to_hole)
        self.fan_end_x, self.ring_start_x = arm.wall + reach, arm.post + reach

    def blocks(self) -> Iterator[Block]:
        """Yield the blocks; raises MeshError if two holes leave no wall between them."""
        lower_hole, upper_hole = self.arm.holes
        if not self.lower_ring_top <= self.upper_ring_bottom:
            reason = f"the holes at z = {lower_hole[1]:.4g} and {upper_hole[1]:.4g} mm leave no wall between them"
            raise MeshError("blocks", reason, "take smaller holes or a larger leaf separation")
        yield from self._beside_cavity()
        yield from self._before_post()
        yield from self._post()

    def _beside_cavity(self) -> Iterator[Block]:
        """Yield the fans at the roots of the leaves, and the cells between them."""
        for fan in self.fans:
            yield blocks.fan_block(self.arm, self.arm.wall, fan, self.fan_end_x - self.arm.wall, self.count)
        for a, b in pairwise(self.levels):
            if not blocks.in_fan(a, b, self.fans):
                yield self._cell(a, b)

    def _before_post(self) -> Iterator[Block]:
        """Yield the plain cells between the fans and the post; nothing if the wall is no wider than its post."""
        width = abs(self.ring_start_x - self.fan_end_x)
        if width > 0.0:
            columns = blocks.pieces(width, self.count)
            for a, b in pairwise(self.levels):
                yield blocks.rectangle((self.fan_end_x, self.ring_start_x), (a, b), columns, self._pieces(a, b))

    def _post(self) -> Iterator[Block]:
        """Yield the rings around both holes, and two columns of cells between the rings."""
        lower_hole, upper_hole = self.arm.holes
        middle = lower_hole[0]
        for a, b in self._pairs_of_levels(self.lower_ring_top, self.upper_ring_bottom):
            yield blocks.rectangle((self.ring_start_x, middle), (a, b), self.count.sector, self._pieces(a, b))
            yield blocks.rectangle((middle, self.arm.outer), (a, b), self.count.sector, self._pieces(a, b))
        yield from self._ring(lower_hole, self.levels[0], self.lower_ring_top)
        yield from self._ring(upper_hole, self.upper_ring_bottom, self.levels[-1])

    def _pairs_of_levels(self, start: float, end: float) -> Iterator[tuple[float, float]]:
        """Return the levels from start to end [mm], each paired with the next one."""
        return pairwise(level for level in self.levels if start <= level <= end)

    def _pieces(self, a: float, b: float) -> int:
        """Return the number of elements between two levels [mm]."""
        return blocks.pieces_between(a, b, self.fans, self.count)

    def _ring_end_level(self, hole: Point, sign: float, levels: Sequence[float]) -> float:
        """Return the level [mm] at which the ring of a hole ends, above the hole (sign 1) or below it (sign -1).

        It is the nearest level that makes the ring wide enough, or a new one if none is close enough. It never lies
        inside a fan, whose sectors are fixed.
        """
        for level in sorted(levels, reverse=sign < 0.0):  # outwards from the hole
            distance = sign * (level - hole[1]) / self.radius
            if _RING <= distance <= 2.0 * _WIDE_RING:
                return level
        new = hole[1] + sign * _WIDE_RING * self.radius
        for fan in self.fans:
            lower, _, upper = fan.levels
            if lower < new < upper:
                return upper if sign > 0.0 else lower
        return new

    def _cell(self, a: float, b: float) -> Block:
        """Return the block between levels a and b [mm], from the end of the fans to the cavity.

        The fillet under the top bar is divided at its middle, the knuckle. The cell below ends there and has the lower
        half of the fillet as its side; the cell above begins there.
        """
        ceiling = self.housing.cavity_level
        wall = self.arm.wall
        knuckle = _knuckle(self.housing, self.arm)
        start = knuckle if a == ceiling else (wall, a)
        end = knuckle if b == ceiling else (wall, b)
        number = self._pieces(a, b)
        along = self.count.sector
        cell = blocks.straight_block(((self.fan_end_x, a), start, end, (self.fan_end_x, b)), along, number)
        if b != ceiling:
            return cell
        fillet = _half_fillet(self.housing, self.arm, (wall, a), number)
        return Block(sides=(cell.sides[0], (fillet,), *cell.sides[2:]))

    def _ring(self, hole: Point, start: float, end: float) -> Iterator[Block]:
        """Yield the blocks between a hole and the rectangle around it, from one level to another [mm]."""
        inner = self.ring_start_x
        middle, level = hole
        outer = self.arm.outer
        # The edges of the rectangle in order: up the side to the fans, over the top, down the outer face, back below.
        edges = []
        for a, b in self._pairs_of_levels(start, end):
            edges.append(((inner, a), (inner, b), self._pieces(a, b)))
        corners = [(inner, end), (middle, end), (outer, end), (outer, level), (outer, start), (middle, start)]
        for corner, next_corner in pairwise([*corners, (inner, start)]):
            edges.append((corner, next_corner, self.count.sector))

        # Each edge and the piece of the circle nearest to it bound a block.
        for edge_start, edge_end, number in edges:
            arc_start = _on_circle(hole, self.radius, edge_start)
            arc_end = _on_circle(hole, self.radius, edge_end)
            quadrangle = (edge_start, edge_end, arc_end, arc_start)
            sides = blocks.straight_block(quadrangle, number, self.count.ring).sides
            arc = Segment(start=arc_start, end=arc_end, count=number, centre=hole, surface="mounting_holes")
            yield Block(sides=(sides[0], sides[1], (arc,), sides[3]))


def _on_circle(centre: Point, radius: float, point: Point) -> Point:
    """Return the point of a circle nearest to a point."""
    distance = math.dist(point, centre)
    x = centre[0] + radius * (point[0] - centre[0]) / distance
    z = centre[1] + radius * (point[1] - centre[1]) / distance
    return x, z


def _knuckle(housing: Housing, arm: Arm) -> Point:
    """Return the middle of the fillet between wall and top bar, at 45 degrees."""
    reach = housing.corner * (1.0 - math.sqrt(0.5))
    return arm.wall - arm.sign * reach, housing.cavity_level - reach


def _half_fillet(housing: Housing, arm: Arm, start: Point, number: int) -> Segment:
    """Return the fillet between wall and top bar from one of its ends to its middle, with a number of elements."""
    r = housing.corner
    centre = (arm.wall - arm.sign * r, housing.cavity_level - r)
    return Segment(start=start, end=_knuckle(housing, arm), count=number, centre=centre)


def _bar(housing: Housing, count: Counts) -> list[Block]:
    """Return the blocks of the top bar: one over half of the fillet at each wall, and one between them."""
    high = blocks.pieces(housing.top_level - housing.cavity_level, count)
    bar = []
    ends = []  # ends of the block between, each with its lower and upper point
    for arm in housing.arms:
        x = arm.wall - arm.sign * housing.corner
        below = (x, housing.cavity_level)
        above = (x, housing.top_level)
        over_wall = (arm.wall, housing.top_level)
        corner = blocks.straight_block((_knuckle(housing, arm), below, above, over_wall), count.sector, high)
        fillet = _half_fillet(housing, arm, below, count.sector)
        bar.append(Block(sides=((fillet,), *corner.sides[1:])))
        ends.append((below, above))
    (left_below, left_above), (right_below, right_above) = ends
    corners = (left_below, right_below, right_above, left_above)
    bar.append(blocks.straight_block(corners, blocks.pieces(right_below[0] - left_below[0], count), high))
    return bar
