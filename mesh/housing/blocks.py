"""The profile of the housing as four-sided blocks: fans around the leaf roots, rings around the holes, the rest coarse.

A fan runs from the end of a straight leaf over its fillets to a box in the solid: four sectors of 45 degrees.
Units: mm; points are (x, z).
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from cad.parts.housing import Housing
from cad.theory.flexure import Flexure

Point = tuple[float, float]
Fan = tuple[float, float, float]
"""Levels z of the lower edge, the leaf and the upper edge of a fan."""
Surface = Literal["low_leaves", "high_leaves", "mounting_holes", ""]

_FAN = 1.8  # half height of a fan's box over half the thickness of the leaf with its fillets
_ROOM = 0.7  # share of the solid beside a fillet that a fan may take
_NECK_GROWTH = 1.5


@dataclass(frozen=True, kw_only=True)
class Counts:
    """Numbers of elements along the curves of the profile; `frame_size` is the length of an element in the frame."""

    sector: int
    along_leaf: int
    along_fillet: int
    beside_fillet: int
    neck: int
    ring: int
    frame_size: float


@dataclass(frozen=True, kw_only=True)
class Segment:
    """A line or, with a centre, an arc, with its number of elements.

    `growth` is the ratio of one element to the next; `bump` below 1 packs elements towards both ends.
    """

    start: Point
    end: Point
    count: int
    centre: Point | None = None
    growth: float = 1.0
    bump: float = 1.0
    surface: Surface = ""


@dataclass(frozen=True, kw_only=True)
class Block:
    """A four-sided piece of the profile; opposite sides have the same number of elements."""

    sides: tuple[tuple[Segment, ...], ...]
    smooth: bool = False


@dataclass(frozen=True, kw_only=True)
class Arm:
    """One flexure with what it is fixed to: x of its roots, the way from wall to shuttle, and its levels."""

    flexure: Flexure
    leaves: Surface
    wall: float
    shuttle: float
    top: float
    levels: tuple[float, float]
    holes: tuple[Point, Point]

    @property
    def inward(self) -> float:
        """Return the sign of x from the wall to the shuttle."""
        return math.copysign(1.0, self.shuttle - self.wall)


def counts(housing: Housing, scale: float) -> Counts:
    """Return the numbers of elements; `scale` 1 is the mesh to solve on, 2 the one it is judged by, 0.5 a reference."""

    def scaled(number: int) -> int:
        return max(1, round(number / scale))

    return Counts(
        sector=scaled(1),
        along_leaf=scaled(10),
        along_fillet=scaled(3),
        beside_fillet=scaled(4),
        neck=scaled(6),
        ring=scaled(2),
        frame_size=0.4 * scale**0.5 * housing.wall_width,
    )


def arms(housing: Housing) -> tuple[Arm, Arm]:
    """Return the low and the high arm."""

    def arm(flexure: Flexure, roots: Point, top: float, holes: Sequence[Point]) -> Arm:
        return Arm(
            flexure=flexure,
            leaves="low_leaves" if roots[0] < roots[1] else "high_leaves",
            wall=roots[0],
            shuttle=roots[1],
            top=top,
            levels=(housing.lower_leaf_level, housing.lower_leaf_level + flexure.separation),
            holes=(holes[0], holes[1]),
        )

    low = arm(housing.low, housing.low_root, housing.low_top_level, housing.holes[:2])
    return low, arm(housing.high, housing.high_root, housing.high_top_level, housing.holes[2:])


def pieces(length: float, count: Counts) -> int:
    """Return the number of elements of the frame's size on a length."""
    return max(1, math.ceil(length / count.frame_size - 0.01))


def fan_height(flexure: Flexure, room: float) -> float:
    """Return half the height of a fan's box; `room` is the solid beside the root."""
    half = 0.5 * flexure.thickness + flexure.fillet
    return min(_FAN * half, half + _ROOM * (room - half))


def fan(arm: Arm, x: float, level: float, box: Point, count: Counts) -> Block:
    """Return the fan at a root; its box reaches `box` = (depth along x, signed; half height)."""
    depth, height = box
    r, half, out = arm.flexure.fillet, 0.5 * arm.flexure.thickness, -math.copysign(arm.flexure.fillet, depth)
    n = count.sector

    def side(sign: float) -> tuple[Segment, Segment]:
        start, touch = (x + out, level + sign * half), (x, level + sign * (half + r))
        centre = (x + out, level + sign * (half + r))
        return (
            Segment(start=start, end=touch, count=count.along_fillet, centre=centre, surface=arm.leaves),
            Segment(start=touch, end=(x, level + sign * height), count=count.beside_fillet),
        )

    corners = [(x, level - height), (x + depth, level - height), (x + depth, level), (x + depth, level + height),
               (x, level + height)]  # fmt: skip
    far = tuple(Segment(start=a, end=b, count=n) for a, b in pairwise(corners))
    leaf_end = Segment(start=(x + out, level - half), end=(x + out, level + half), count=4 * n)
    return Block(sides=((leaf_end,), side(1.0), far, side(-1.0)), smooth=True)


def leaves(arm: Arm, count: Counts) -> Iterator[Block]:
    """Return the straight parts of the two leaves of an arm."""
    r, half, n = arm.flexure.fillet * arm.inward, 0.5 * arm.flexure.thickness, count.along_leaf
    start, end = arm.wall + r, arm.shuttle - r
    # Bending across the leaf fades within half its depth from a root: long leaves need their elements there.
    bump = min(1.0, arm.flexure.depth / abs(end - start))
    for level in arm.levels:
        rows = [
            Segment(start=(start, z), end=(end, z), count=n, bump=bump, surface=arm.leaves)
            for z in (level - half, level + half)
        ]
        ends = [Segment(start=(x, level - half), end=(x, level + half), count=4 * count.sector) for x in (end, start)]
        yield Block(sides=((rows[0],), (ends[0],), (rows[1],), (ends[1],)))


def straight_block(corners: Sequence[Point], number: tuple[int, int]) -> Block:
    """Return a straight-sided block; sides 0 and 2 have number[0] elements, sides 1 and 3 number[1]."""
    pairs = pairwise([*corners, corners[0]])
    return Block(sides=tuple((Segment(start=a, end=b, count=number[i % 2]),) for i, (a, b) in enumerate(pairs)))


def pieces_between(a: float, b: float, fans: Sequence[Fan], count: Counts) -> int:
    """Return the number of elements between two lines of a wall or shuttle; a fan sets it where there is one."""
    in_fan = any(low <= a and b <= high for low, _, high in fans)
    return count.sector if in_fan else pieces(b - a, count)


def shuttle(housing: Housing, arm: Arm, count: Counts) -> Iterator[Block]:
    """Return the blocks of one shuttle with its neck and tip, two columns wide."""
    lower, upper = arm.levels
    inside = 0.5 * arm.flexure.separation
    rooms = (min(lower - housing.neck_level, inside), min(arm.top - upper, inside))
    heights = [fan_height(arm.flexure, room) for room in rooms]
    fans = [(z - h, z, z + h) for z, h in zip(arm.levels, heights, strict=True)]
    middle = arm.shuttle + arm.inward * 0.5 * housing.shuttle_width
    far = arm.shuttle + arm.inward * housing.shuttle_width
    for z, h in zip(arm.levels, heights, strict=True):
        yield fan(arm, arm.shuttle, z, (middle - arm.shuttle, h), count)
    for a, b in pairwise([housing.neck_level, *fans[0], *fans[1], arm.top]):
        number = pieces_between(a, b, fans, count)
        yield straight_block(((middle, a), (far, a), (far, b), (middle, b)), (count.sector, number))
        if not any(low <= a and b <= high for low, _, high in fans):
            yield straight_block(((arm.shuttle, a), (middle, a), (middle, b), (arm.shuttle, b)), (count.sector, number))
    tip = arm.inward * 0.5 * housing.tip_side
    for top, bottom in (((arm.shuttle, middle), (middle - tip, middle)), ((middle, far), (middle, middle + tip))):
        yield _neck(housing, top, bottom, count)
        (a, b), z = bottom, housing.tip_height
        yield straight_block(((a, 0.0), (b, 0.0), (b, z), (a, z)), (count.sector, count.sector))


def _neck(housing: Housing, top: tuple[float, float], bottom: tuple[float, float], count: Counts) -> Block:
    corners = [(x, housing.tip_height) for x in bottom] + [(x, housing.neck_level) for x in reversed(top)]
    (a, b, c, d) = corners
    cell = straight_block(corners, (count.sector, count.neck))
    rise = tuple(
        (Segment(start=low, end=high, count=count.neck, growth=_NECK_GROWTH),) for low, high in ((b, c), (a, d))
    )
    return Block(sides=(cell.sides[0], rise[0], cell.sides[2], rise[1]))
