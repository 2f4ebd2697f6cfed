"""Division of the housing's frame into four-sided blocks: two walls, and the top bar between them.

Each mounting hole in a wall is surrounded by a ring: a group of blocks between the hole and a rectangle around it.
Lengths are in mm, and points are (x, z).
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

from cad.parts.housing import Arm, Housing
from mesh.housing import blocks
from mesh.housing.blocks import Block, ElementCounts, Point, Segment
from mesh.session import MeshError

# Smallest distance from the centre of a hole to the edge of its ring, divided by the radius of the hole.
_MIN_RING_RATIO = 1.3
# The same ratio for a ring whose edge lies at a new level, which divides the wall only for this ring.
_NEW_EDGE_RATIO = 1.7
_MAX_RING_RATIO = 2.0 * _NEW_EDGE_RATIO  # largest such ratio for a ring whose edge lies at an existing level
# Largest extent of a fan in x, as a fraction of the distance from the post to the edge of the hole.
_MAX_FAN_FRACTION = 0.65


def housing_blocks(housing: Housing, counts: ElementCounts) -> list[Block]:
    """Return the blocks of the whole profile. Raises MeshError if there is no wall between the two holes of an arm."""
    profile_blocks = _bar_blocks(housing, counts)
    for arm in housing.arms:
        profile_blocks += _Wall(housing, arm, counts).blocks()
        profile_blocks += blocks.shuttle_blocks(housing, arm, counts)
        profile_blocks += blocks.leaf_blocks(arm, counts)
    return profile_blocks


def post_columns(housing: Housing, arm: Arm, counts: ElementCounts) -> tuple[float, float]:
    """Return x [mm] at both ends of the plain cells of a wall, which lie between its fans and its rings."""
    wall = _Wall(housing, arm, counts)
    return wall.fan_end_x, wall.ring_start_x


class _Wall:
    """One wall of the frame: fans and cells beside the cavity, then plain cells, then the rings of the holes.

    The wall is divided at levels z and into columns in x [mm]:

        cavity | upper fan | plain cells | upper ring  | outside     z up
        cavity | cells     | plain cells | two columns | outside
        cavity | lower fan | plain cells | lower ring  | outside
              wall      fan_end_x   ring_start_x     outer           x, away from the cavity

    There are plain cells only if the wall is wider than its post, which is the part with the holes.
    """

    def __init__(self, housing: Housing, arm: Arm, counts: ElementCounts) -> None:
        """Determine the levels that divide the wall, and the x coordinates at which the fans end and the rings begin.

        The wall is divided at the edges of the fans, at the fillet under the top bar, and at the edges of the rings.
        """
        self.housing = housing
        self.arm = arm
        self.counts = counts
        self.hole_radius = 0.5 * housing.hole_diameter
        fillet_level = housing.cavity_level - housing.corner  # lower end of the fillet under the top bar
        self.fans = blocks.leaf_fans(arm, housing.protrusion, fillet_level)
        lower_fan, upper_fan = self.fans
        levels = [housing.protrusion, *lower_fan.levels, *upper_fan.levels]
        levels += [fillet_level, housing.cavity_level, housing.top_level]
        lower_hole, upper_hole = arm.holes
        self.lower_ring_top = self._ring_end_level(lower_hole, 1.0, levels)
        self.upper_ring_bottom = self._ring_end_level(upper_hole, -1.0, levels)
        self.levels = sorted({*levels, self.lower_ring_top, self.upper_ring_bottom})

        # Both fans have the same extent in x, with the sign of the direction away from the cavity. If the wall is no
        # wider than its post, arm.wall = arm.post, and the rings begin where the fans end.
        largest_extent = _MAX_FAN_FRACTION * (abs(lower_hole[0] - arm.post) - self.hole_radius)
        fan_extent = arm.sign * min(max(lower_fan.height, upper_fan.height), largest_extent)
        self.fan_end_x = arm.wall + fan_extent
        self.ring_start_x = arm.post + fan_extent

    def blocks(self) -> Iterator[Block]:
        """Yield the blocks of the wall. Raises MeshError if there is no wall between its two holes."""
        lower_hole, upper_hole = self.arm.holes
        if not self.lower_ring_top <= self.upper_ring_bottom:
            reason = f"the holes at z = {lower_hole[1]:.4g} and {upper_hole[1]:.4g} mm leave no wall between them"
            raise MeshError("blocks", reason, "use smaller holes or a larger leaf separation")
        yield from self._cavity_blocks()
        yield from self._plain_blocks()
        yield from self._post_blocks()

    def _cavity_blocks(self) -> Iterator[Block]:
        """Yield the blocks next to the cavity: the fans at the leaf roots, and one cell between other levels."""
        for fan in self.fans:
            yield blocks.fan_block(self.arm, self.arm.wall, fan, self.fan_end_x - self.arm.wall, self.counts)
        for lower, upper in pairwise(self.levels):
            if not blocks.is_in_fan(lower, upper, self.fans):
                yield self._cavity_cell(lower, upper)

    def _plain_blocks(self) -> Iterator[Block]:
        """Yield the plain cells between the fans and the post. A wall that is no wider than its post has none."""
        width = abs(self.ring_start_x - self.fan_end_x)
        if width > 0.0:
            columns = blocks.frame_elements(width, self.counts)
            for lower, upper in pairwise(self.levels):
                rows = self._elements(lower, upper)
                yield blocks.rectangle((self.fan_end_x, self.ring_start_x), (lower, upper), columns, rows)

    def _post_blocks(self) -> Iterator[Block]:
        """Yield the rings around both holes, and two columns of cells between the rings."""
        lower_hole, upper_hole = self.arm.holes
        hole_x = lower_hole[0]
        for lower, upper in self._pairs_of_levels(self.lower_ring_top, self.upper_ring_bottom):
            rows = self._elements(lower, upper)
            yield blocks.rectangle((self.ring_start_x, hole_x), (lower, upper), self.counts.sector, rows)
            yield blocks.rectangle((hole_x, self.arm.outer), (lower, upper), self.counts.sector, rows)
        yield from self._ring(lower_hole, self.levels[0], self.lower_ring_top)
        yield from self._ring(upper_hole, self.upper_ring_bottom, self.levels[-1])

    def _pairs_of_levels(self, start: float, end: float) -> Iterator[tuple[float, float]]:
        """Return the pairs of adjacent levels from z = `start` up to z = `end` [mm], which are levels themselves."""
        return pairwise(level for level in self.levels if start <= level <= end)

    def _elements(self, lower: float, upper: float) -> int:
        """Return the number of elements between two adjacent levels [mm]."""
        return blocks.elements_between(lower, upper, self.fans, self.counts)

    def _ring_end_level(self, hole: Point, sign: float, levels: Sequence[float]) -> float:
        """Return the level z [mm] of the edge of a hole's ring, above the hole (sign 1) or below it (sign -1).

        The nearest of the existing `levels` [mm] that makes the ring wide enough is returned. If no such level is near
        the hole, a new level is returned. A new level inside a fan is moved to the edge of the fan, because the sectors
        of a fan must not be divided.
        """
        _, hole_z = hole
        for level in sorted(levels, reverse=sign < 0.0):  # beyond the hole, the nearest level then comes first
            distance_ratio = sign * (level - hole_z) / self.hole_radius  # negative on the other side of the hole
            if _MIN_RING_RATIO <= distance_ratio <= _MAX_RING_RATIO:
                return level
        new_level = hole_z + sign * _NEW_EDGE_RATIO * self.hole_radius
        for fan in self.fans:
            lower, _, upper = fan.levels
            if lower < new_level < upper:
                return upper if sign > 0.0 else lower
        return new_level

    def _cavity_cell(self, lower: float, upper: float) -> Block:
        """Return the block from the cavity to the end of the fans in x, between the levels `lower` and `upper` [mm].

        The fillet between the wall and the top bar is divided at its middle, called the knuckle. The uppermost cell
        beside the cavity ends there, and one of its sides is the lower half of the fillet. The cell above it begins at
        the knuckle.
        """
        ceiling = self.housing.cavity_level  # the underside of the top bar
        wall_x = self.arm.wall
        knuckle = _knuckle(self.housing, self.arm)
        lower_corner = knuckle if lower == ceiling else (wall_x, lower)
        upper_corner = knuckle if upper == ceiling else (wall_x, upper)
        elements = self._elements(lower, upper)
        corners = ((self.fan_end_x, lower), lower_corner, upper_corner, (self.fan_end_x, upper))
        cell = blocks.straight_block(corners, self.counts.sector, elements)
        if upper != ceiling:
            return cell
        # The arc replaces the second side, which runs along the cavity from the lower to the upper corner.
        lower_side, _, upper_side, fan_side = cell.sides
        fillet = _half_fillet(self.housing, self.arm, (wall_x, lower), elements)
        return Block(sides=(lower_side, (fillet,), upper_side, fan_side))

    def _ring(self, hole: Point, start: float, end: float) -> Iterator[Block]:
        """Yield the blocks between a hole and the rectangle around it, which extends from `start` to `end` [mm] in z.

        Each block lies between a piece of the rectangle's edge and the nearest piece of the circle.
        """
        inner_x = self.ring_start_x
        hole_x, hole_z = hole
        outer_x = self.arm.outer
        # The pieces of the rectangle's edge run up the side that faces the fans, along the top, down the outer face,
        # and back along the bottom. Each has a start, an end and a number of elements.
        edges = []
        for lower, upper in self._pairs_of_levels(start, end):
            edges.append(((inner_x, lower), (inner_x, upper), self._elements(lower, upper)))
        corners = [(inner_x, end), (hole_x, end), (outer_x, end), (outer_x, hole_z), (outer_x, start), (hole_x, start)]
        for corner, next_corner in pairwise([*corners, (inner_x, start)]):
            edges.append((corner, next_corner, self.counts.sector))

        for edge_start, edge_end, elements in edges:
            arc_start = _nearest_on_circle(hole, self.hole_radius, edge_start)
            arc_end = _nearest_on_circle(hole, self.hole_radius, edge_end)
            quadrilateral = (edge_start, edge_end, arc_end, arc_start)
            straight_sided = blocks.straight_block(quadrilateral, elements, self.counts.ring)
            edge_side, end_side, _, start_side = straight_sided.sides
            # The arc replaces the third side, which is its chord.
            arc = Segment(start=arc_start, end=arc_end, count=elements, centre=hole, surface="mounting_holes")
            yield Block(sides=(edge_side, end_side, (arc,), start_side))


def _nearest_on_circle(centre: Point, radius: float, point: Point) -> Point:
    """Return the point on a circle that is nearest to the given point [mm]."""
    distance = math.dist(point, centre)
    x = centre[0] + radius * (point[0] - centre[0]) / distance
    z = centre[1] + radius * (point[1] - centre[1]) / distance
    return x, z


def _knuckle(housing: Housing, arm: Arm) -> Point:
    """Return the middle of the fillet between the wall and the top bar [mm], at 45 degrees on its arc."""
    inset = housing.corner * (1.0 - math.sqrt(0.5))
    return arm.wall - arm.sign * inset, housing.cavity_level - inset


def _half_fillet(housing: Housing, arm: Arm, start: Point, elements: int) -> Segment:
    """Return one half of the fillet between the wall and the top bar: the arc from its end `start` to its middle."""
    radius = housing.corner
    centre = (arm.wall - arm.sign * radius, housing.cavity_level - radius)
    return Segment(start=start, end=_knuckle(housing, arm), count=elements, centre=centre)


def _bar_blocks(housing: Housing, counts: ElementCounts) -> list[Block]:
    """Return the three blocks of the top bar: one above the upper half of each wall's fillet, and one between them."""
    elements = blocks.frame_elements(housing.top_level - housing.cavity_level, counts)
    bar = []
    middle_ends = []  # lower and upper corner of the middle block, first at its left end and then at its right end
    for arm in housing.arms:
        fillet_end_x = arm.wall - arm.sign * housing.corner  # where the fillet meets the underside of the bar
        lower_point = (fillet_end_x, housing.cavity_level)
        upper_point = (fillet_end_x, housing.top_level)
        over_wall = (arm.wall, housing.top_level)
        quadrilateral = (_knuckle(housing, arm), lower_point, upper_point, over_wall)
        straight_sided = blocks.straight_block(quadrilateral, counts.sector, elements)
        # The arc of the fillet replaces the first side, from the knuckle to the lower point.
        fillet = _half_fillet(housing, arm, lower_point, counts.sector)
        bar.append(Block(sides=((fillet,), *straight_sided.sides[1:])))
        middle_ends.append((lower_point, upper_point))
    (left_below, left_above), (right_below, right_above) = middle_ends
    corners = (left_below, right_below, right_above, left_above)
    columns = blocks.frame_elements(right_below[0] - left_below[0], counts)
    bar.append(blocks.straight_block(corners, columns, elements))
    return bar
