"""The frame of the housing as four-sided blocks: two walls, and the top bar between them.

Each mounting hole in a wall lies in a ring, a group of blocks between the hole and a rectangle around it. Lengths are
in mm; points are (x, z).
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

from cad.parts.housing import Arm, Housing
from mesh.housing import blocks
from mesh.housing.blocks import Block, Counts, Point, Segment
from mesh.session import MeshError

_RING = 1.3  # smallest distance of a ring's edge from the centre of its hole, over the radius of the hole
_WIDE_RING = 1.7  # the same distance for an edge at a level that is added only for the ring
_TO_HOLE = 0.65  # largest extent of a fan in x over the distance between leaf root and hole


def housing_blocks(housing: Housing, count: Counts) -> list[Block]:
    """Return the blocks of the whole profile; raises MeshError if there is no wall between the two holes of an arm."""
    profile = _bar_blocks(housing, count)
    for arm in housing.arms:
        profile += _Wall(housing, arm, count).blocks()
        profile += blocks.shuttle_blocks(housing, arm, count)
        profile += blocks.leaf_blocks(arm, count)
    return profile


def post_columns(housing: Housing, arm: Arm, count: Counts) -> tuple[float, float]:
    """Return x [mm] where the plain cells of a wall begin and end: at the end of its fans, and at the rings."""
    wall = _Wall(housing, arm, count)
    return wall.fan_end_x, wall.ring_start_x


class _Wall:
    """One wall of the frame: fans and cells beside the cavity, then plain cells, then the rings of the holes.

    The wall is divided at levels z and into columns in x [mm]:

        cavity | upper fan | plain cells | upper ring  | outside     z up
        cavity | cells     | plain cells | two columns | outside
        cavity | lower fan | plain cells | lower ring  | outside
              wall      fan_end_x   ring_start_x     outer           x, away from the cavity

    There are plain cells only if the wall is wider than its post, the part with the holes.
    """

    def __init__(self, housing: Housing, arm: Arm, count: Counts) -> None:
        """Determine the levels that divide the wall, and x where the fans end and where the rings begin.

        Levels are required at the fans, at the fillet under the top bar, and at the edges of the rings.
        """
        self.housing = housing
        self.arm = arm
        self.count = count
        self.radius = 0.5 * housing.hole_diameter
        ceiling = housing.cavity_level - housing.corner
        self.fans = blocks.leaf_fans(arm, housing.protrusion, ceiling)
        lower_fan, upper_fan = self.fans
        levels = [housing.protrusion, *lower_fan.levels, *upper_fan.levels]
        levels += [ceiling, housing.cavity_level, housing.top_level]
        lower_hole, upper_hole = arm.holes
        self.lower_ring_top = self._ring_end_level(lower_hole, 1.0, levels)
        self.upper_ring_bottom = self._ring_end_level(upper_hole, -1.0, levels)
        self.levels = sorted({*levels, self.lower_ring_top, self.upper_ring_bottom})

        # In a wall no wider than its post, the rings begin where the fans end.
        to_hole = _TO_HOLE * (abs(lower_hole[0] - arm.post) - self.radius)
        reach = arm.sign * min(max(lower_fan.height, upper_fan.height), to_hole)
        self.fan_end_x, self.ring_start_x = arm.wall + reach, arm.post + reach

    def blocks(self) -> Iterator[Block]:
        """Yield the blocks of the wall; raises MeshError if there is no wall between its two holes."""
        lower_hole, upper_hole = self.arm.holes
        if not self.lower_ring_top <= self.upper_ring_bottom:
            reason = f"the holes at z = {lower_hole[1]:.4g} and {upper_hole[1]:.4g} mm leave no wall between them"
            raise MeshError("blocks", reason, "take smaller holes or a larger leaf separation")
        yield from self._beside_cavity()
        yield from self._before_post()
        yield from self._post()

    def _beside_cavity(self) -> Iterator[Block]:
        """Yield the blocks next to the cavity: the fans at the leaf roots, and a cell at each other level."""
        for fan in self.fans:
            yield blocks.fan_block(self.arm, self.arm.wall, fan, self.fan_end_x - self.arm.wall, self.count)
        for a, b in pairwise(self.levels):
            if not blocks.in_fan(a, b, self.fans):
                yield self._cavity_cell(a, b)

    def _before_post(self) -> Iterator[Block]:
        """Yield the plain cells between the fans and the post; nothing if the wall is no wider than its post."""
        width = abs(self.ring_start_x - self.fan_end_x)
        if width > 0.0:
            columns = blocks.frame_elements(width, self.count)
            for a, b in pairwise(self.levels):
                yield blocks.rectangle((self.fan_end_x, self.ring_start_x), (a, b), columns, self._elements(a, b))

    def _post(self) -> Iterator[Block]:
        """Yield the rings around both holes, and two columns of cells between the rings."""
        lower_hole, upper_hole = self.arm.holes
        middle = lower_hole[0]
        for a, b in self._pairs_of_levels(self.lower_ring_top, self.upper_ring_bottom):
            yield blocks.rectangle((self.ring_start_x, middle), (a, b), self.count.sector, self._elements(a, b))
            yield blocks.rectangle((middle, self.arm.outer), (a, b), self.count.sector, self._elements(a, b))
        yield from self._ring(lower_hole, self.levels[0], self.lower_ring_top)
        yield from self._ring(upper_hole, self.upper_ring_bottom, self.levels[-1])

    def _pairs_of_levels(self, start: float, end: float) -> Iterator[tuple[float, float]]:
        """Return the pairs of successive levels between `start` and `end` [mm]."""
        return pairwise(level for level in self.levels if start <= level <= end)

    def _elements(self, a: float, b: float) -> int:
        """Return the number of elements between the levels a and b [mm]."""
        return blocks.elements_between(a, b, self.fans, self.count)

    def _ring_end_level(self, hole: Point, sign: float, levels: Sequence[float]) -> float:
        """Return the level [mm] of the edge of a hole's ring, above the hole (sign 1) or below it (sign -1).

        It is the nearest of the given `levels` that makes the ring wide enough. If none is near enough, it is a new
        level. A new level inside a fan is moved to the end of the fan, whose sectors must not be divided.
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

    def _cavity_cell(self, a: float, b: float) -> Block:
        """Return the block between levels a and b [mm], and between the end of the fans and the cavity.

        The fillet between wall and top bar is divided at its middle, the knuckle. The uppermost cell beside the cavity
        ends there, and one of its sides is the lower half of the fillet. The cell above it begins at the knuckle.
        """
        ceiling = self.housing.cavity_level
        wall = self.arm.wall
        knuckle = _knuckle(self.housing, self.arm)
        start = knuckle if a == ceiling else (wall, a)
        end = knuckle if b == ceiling else (wall, b)
        elements = self._elements(a, b)
        along = self.count.sector
        cell = blocks.straight_block(((self.fan_end_x, a), start, end, (self.fan_end_x, b)), along, elements)
        if b != ceiling:
            return cell
        fillet = _half_fillet(self.housing, self.arm, (wall, a), elements)
        return Block(sides=(cell.sides[0], (fillet,), *cell.sides[2:]))

    def _ring(self, hole: Point, start: float, end: float) -> Iterator[Block]:
        """Yield the blocks between a hole and the rectangle around it, which extends from `start` to `end` [mm] in z.

        Each block lies between a piece of the rectangle's edge and the nearest piece of the circle.
        """
        inner = self.ring_start_x
        middle, level = hole
        outer = self.arm.outer
        # The pieces of the rectangle's edge in order, each with its number of elements. They run up the side that faces
        # the fans, along the top, down the outer face, and back along the bottom.
        edges = []
        for a, b in self._pairs_of_levels(start, end):
            edges.append(((inner, a), (inner, b), self._elements(a, b)))
        corners = [(inner, end), (middle, end), (outer, end), (outer, level), (outer, start), (middle, start)]
        for corner, next_corner in pairwise([*corners, (inner, start)]):
            edges.append((corner, next_corner, self.count.sector))

        for edge_start, edge_end, elements in edges:
            arc_start = _nearest_on_circle(hole, self.radius, edge_start)
            arc_end = _nearest_on_circle(hole, self.radius, edge_end)
            quadrangle = (edge_start, edge_end, arc_end, arc_start)
            sides = blocks.straight_block(quadrangle, elements, self.count.ring).sides
            arc = Segment(start=arc_start, end=arc_end, count=elements, centre=hole, surface="mounting_holes")
            yield Block(sides=(sides[0], sides[1], (arc,), sides[3]))


def _nearest_on_circle(centre: Point, radius: float, point: Point) -> Point:
    """Return the point of a circle that is nearest to a given point [mm]."""
    distance = math.dist(point, centre)
    x = centre[0] + radius * (point[0] - centre[0]) / distance
    z = centre[1] + radius * (point[1] - centre[1]) / distance
    return x, z


def _knuckle(housing: Housing, arm: Arm) -> Point:
    """Return the middle of the fillet between wall and top bar, at 45 degrees on its arc [mm]."""
    reach = housing.corner * (1.0 - math.sqrt(0.5))
    return arm.wall - arm.sign * reach, housing.cavity_level - reach


def _half_fillet(housing: Housing, arm: Arm, start: Point, elements: int) -> Segment:
    """Return the half of the fillet between wall and top bar from one end, `start`, to its middle."""
    radius = housing.corner
    centre = (arm.wall - arm.sign * radius, housing.cavity_level - radius)
    return Segment(start=start, end=_knuckle(housing, arm), count=elements, centre=centre)


def _bar_blocks(housing: Housing, count: Counts) -> list[Block]:
    """Return the three blocks of the top bar: one above the upper half of each wall's fillet, and one between them."""
    elements = blocks.frame_elements(housing.top_level - housing.cavity_level, count)
    bar = []
    ends = []  # the left and the right end of the block in the middle, each as its lower and upper point
    for arm in housing.arms:
        x = arm.wall - arm.sign * housing.corner
        lower_point = (x, housing.cavity_level)
        upper_point = (x, housing.top_level)
        over_wall = (arm.wall, housing.top_level)
        quadrangle = (_knuckle(housing, arm), lower_point, upper_point, over_wall)
        corner = blocks.straight_block(quadrangle, count.sector, elements)
        fillet = _half_fillet(housing, arm, lower_point, count.sector)
        bar.append(Block(sides=((fillet,), *corner.sides[1:])))
        ends.append((lower_point, upper_point))
    (left_below, left_above), (right_below, right_above) = ends
    corners = (left_below, right_below, right_above, left_above)
    columns = blocks.frame_elements(right_below[0] - left_below[0], count)
    bar.append(blocks.straight_block(corners, columns, elements))
    return bar
