"""The profile of the housing as four-sided blocks: fans at the leaf roots, rings around the holes, coarse elsewhere.

A fan extends from the end of a straight leaf over its fillets to a box in the solid: four sectors of 45 degrees. Units:
mm; points are (x, z).
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from cad.parts.housing import Arm, Housing

Point = tuple[float, float]
Interval = tuple[float, float]  # from, to [mm]

_FAN = 1.8  # half height of a fan's box over half the thickness of the leaf with its fillets
_ROOM = 0.7  # fraction of the solid beside a fillet that a fan may take
_NECK_GROWTH = 1.5  # size of an element of a neck over the one below


@dataclass(frozen=True, kw_only=True)
class Counts:
    """Numbers of elements along the curves of the profile; `frame_size` is the length of an element in the frame.

    `across_leaf` is the number over the thickness of a leaf.
    """

    sector: int
    across_leaf: int
    along_leaf: int
    along_fillet: int
    beside_fillet: int
    neck: int
    ring: int
    frame_size: float


@dataclass(frozen=True, kw_only=True)
class Segment:
    """A line or, with a centre, an arc, with its number of elements; `surface` is the name of the face it lies on.

    `growth` is the size ratio of successive elements; `bump` below 1 concentrates elements at both ends.
    """

    start: Point
    end: Point
    count: int
    centre: Point | None = None
    growth: float = 1.0
    bump: float = 1.0
    surface: str = ""


@dataclass(frozen=True, kw_only=True)
class Block:
    """A four-sided piece of the profile; opposite sides have the same number of elements."""

    sides: tuple[tuple[Segment, ...], ...]
    smooth: bool = False


@dataclass(frozen=True)
class Fan:
    """The levels z of a fan: the level of its leaf, and its height above and below it [mm]."""

    level: float
    height: float

    @property
    def levels(self) -> tuple[float, float, float]:
        """Return the levels z of its lower edge, its leaf and its upper edge [mm]."""
        return self.level - self.height, self.level, self.level + self.height


def counts(housing: Housing, scale: float) -> Counts:
    """Return the numbers of elements at a relative element size [1].

    Size 1 is for the mesh of the solve, 2 for the mesh that gives its error, 0.5 for a reference. In the frame, which
    hardly deforms, elements grow with the root of it.
    """

    def scaled(number: int) -> int:
        return max(1, round(number / scale))

    sector = scaled(1)
    return Counts(
        sector=sector,
        across_leaf=4 * sector,
        along_leaf=scaled(10),
        along_fillet=scaled(3),
        beside_fillet=scaled(4),
        neck=scaled(6),
        ring=scaled(2),
        frame_size=0.4 * scale**0.5 * housing.wall_width,
    )


def pieces(length: float, count: Counts) -> int:
    """Return the number of elements of the frame's size on a length [mm]."""
    return max(1, math.ceil(length / count.frame_size - 0.01))


def pieces_between(a: float, b: float, fans: Sequence[Fan], count: Counts) -> int:
    """Return the number of elements between two levels of a wall or shuttle [mm]; in a fan it is the fan's number."""
    return count.sector if in_fan(a, b, fans) else pieces(b - a, count)


def in_fan(a: float, b: float, fans: Sequence[Fan]) -> bool:
    """Return whether two levels [mm] lie in the same fan."""
    for fan in fans:
        lower, _, upper = fan.levels
        if lower <= a and b <= upper:
            return True
    return False


def fans_between(arm: Arm, bottom: float, top: float) -> tuple[Fan, ...]:
    """Return the fans of both leaves in a wall or shuttle between a bottom and a top level [mm]."""
    lower, upper = arm.levels
    inside = 0.5 * arm.flexure.separation
    half = 0.5 * arm.flexure.thickness + arm.flexure.fillet
    fans = []
    for level, outside in ((lower, lower - bottom), (upper, top - upper)):
        room = min(outside, inside)
        fans.append(Fan(level, min(_FAN * half, half + _ROOM * (room - half))))
    return tuple(fans)


def fan_block(arm: Arm, x: float, fan: Fan, depth: float, count: Counts) -> Block:
    """Return the fan at the root of a leaf at x [mm]; its box extends `depth` [mm] along x into the solid.

    The depth has the sign of this direction. The fan has four sides: the end of the straight leaf, fillet and face
    above, the box in the solid, and fillet and face below.
    """
    lower, level, upper = fan.levels
    half = 0.5 * arm.flexure.thickness
    start = x - math.copysign(arm.flexure.fillet, depth)  # where the straight leaf ends
    corners = [(x, lower), (x + depth, lower), (x + depth, level), (x + depth, upper), (x, upper)]
    far = tuple(Segment(start=a, end=b, count=count.sector) for a, b in pairwise(corners))
    leaf = Segment(start=(start, level - half), end=(start, level + half), count=count.across_leaf)
    above = _fan_side(arm, (x, upper), start, level, count)
    below = _fan_side(arm, (x, lower), start, level, count)
    return Block(sides=((leaf,), above, far, below), smooth=True)


def _fan_side(arm: Arm, edge: Point, start: float, level: float, count: Counts) -> tuple[Segment, Segment]:
    """Return the fillet from the end of a leaf to the face of the solid, and the face on to the edge of the box.

    The straight leaf at `level` ends at x = `start` [mm]. The segments lie on the side of the leaf where `edge` [mm]
    lies.
    """
    sign = math.copysign(1.0, edge[1] - level)
    leaf = level + sign * 0.5 * arm.flexure.thickness
    root = level + sign * (0.5 * arm.flexure.thickness + arm.flexure.fillet)
    touch = (edge[0], root)  # where the fillet meets the face
    fillet = Segment(
        start=(start, leaf),
        end=touch,
        count=count.along_fillet,
        centre=(start, root),
        surface=f"{arm.name}_leaves",
    )
    return fillet, Segment(start=touch, end=edge, count=count.beside_fillet)


def straight_ends(arm: Arm) -> tuple[float, float]:
    """Return x [mm] of the ends of the part of a leaf that may be stretched, from the wall to the shuttle.

    It lies between the fillets.
    """
    fillet = arm.flexure.fillet
    return arm.wall - arm.sign * fillet, arm.shuttle + arm.sign * fillet


def leaves(arm: Arm, count: Counts) -> Iterator[Block]:
    """Yield the straight parts of the two leaves of an arm."""
    half = 0.5 * arm.flexure.thickness
    start, end = straight_ends(arm)
    # Bending across the leaf decays within half its depth from a root, where long leaves need their elements.
    bump = min(1.0, arm.flexure.depth / abs(end - start))
    for level in arm.levels:
        low = Segment(
            start=(start, level - half),
            end=(end, level - half),
            count=count.along_leaf,
            bump=bump,
            surface=f"{arm.name}_leaves",
        )
        high = replace(low, start=(start, level + half), end=(end, level + half))
        at_start = Segment(start=(start, level - half), end=(start, level + half), count=count.across_leaf)
        at_end = replace(at_start, start=(end, level - half), end=(end, level + half))
        yield Block(sides=((low,), (at_end,), (high,), (at_start,)))


def straight_block(corners: Sequence[Point], along: int, across: int) -> Block:
    """Return a straight-sided block with `along` elements on sides 0 and 2 and `across` on sides 1 and 3."""
    a, b, c, d = corners
    return Block(
        sides=(
            (Segment(start=a, end=b, count=along),),
            (Segment(start=b, end=c, count=across),),
            (Segment(start=c, end=d, count=along),),
            (Segment(start=d, end=a, count=across),),
        )
    )


def rectangle(x: Interval, z: Interval, along: int, across: int) -> Block:
    """Return the block between two x and two levels z [mm]."""
    start, end = x
    lower, upper = z
    return straight_block(((start, lower), (end, lower), (end, upper), (start, upper)), along, across)


def shuttle(housing: Housing, arm: Arm, count: Counts) -> Iterator[Block]:
    """Yield the blocks of one shuttle with its neck and tip, in two columns along x.

    At the levels of the leaf roots, the near column consists of the fans.
    """
    fans = fans_between(arm, housing.neck_level, arm.top_level)
    width = -arm.sign * housing.shuttle_width
    half_tip = -arm.sign * 0.5 * housing.tip_side
    near = arm.shuttle
    middle = arm.shuttle + 0.5 * width
    far = arm.shuttle + width
    for fan in fans:
        yield fan_block(arm, near, fan, middle - near, count)
    for a, b in pairwise([housing.neck_level, *fans[0].levels, *fans[1].levels, arm.top_level]):
        number = pieces_between(a, b, fans, count)
        yield rectangle((middle, far), (a, b), count.sector, number)
        if not in_fan(a, b, fans):
            yield rectangle((near, middle), (a, b), count.sector, number)
    yield from _neck(housing, (near, middle), (middle - half_tip, middle), count)
    yield from _neck(housing, (middle, far), (middle, middle + half_tip), count)


def _neck(housing: Housing, top: Interval, bottom: Interval, count: Counts) -> Iterator[Block]:
    """Yield the blocks of one column of a neck and of the tip below it.

    The neck tapers from the interval `top` of x at the shuttle to the interval `bottom` at the tip.
    """
    a = (bottom[0], housing.tip_height)
    b = (bottom[1], housing.tip_height)
    c = (top[1], housing.neck_level)
    d = (top[0], housing.neck_level)
    lower = Segment(start=a, end=b, count=count.sector)
    right = Segment(start=b, end=c, count=count.neck, growth=_NECK_GROWTH)
    upper = Segment(start=c, end=d, count=count.sector)
    left = Segment(start=a, end=d, count=count.neck, growth=_NECK_GROWTH)
    yield Block(sides=((lower,), (right,), (upper,), (left,)))
    yield rectangle(bottom, (0.0, housing.tip_height), count.sector, count.sector)
