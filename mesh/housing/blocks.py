"""The profile of the housing as four-sided blocks: fans around the leaf roots, rings around the holes, the rest coarse.

A fan runs from the end of a straight leaf over its fillets to a box in the solid: four sectors of 45 degrees. A strip
of sheet runs on in its glue, and three blocks around its slot reach to such a box. Units: mm; points are (x, z).
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from cad.parts.housing import Arm, Housing
from sensor.theory.strip_clamp import StripClamp

Point = tuple[float, float]
Interval = tuple[float, float]  # from, to [mm]

_FAN = 1.8  # half height of a fan's box over half the thickness of the leaf with its fillets
_ROOM = 0.7  # fraction of the solid beside a fillet that a fan may take
_NECK_GROWTH = 1.5  # of one element of a neck over the one below
STRIP = "strips"
GLUE = "glue"
# Of a strip: the first element in its slot at size 1 over its thickness, the number along a slot then, the growth of
# those around the slot, and of the ends outside the shoulders their length over the thickness and their growth.
_FIRST = 0.8
_COARSEST = 10
_SLOT_GROWTH = 1.7
_LEAF_END = 6.0
_END_GROWTH = 2.0
_BISECTIONS = 50


@dataclass(frozen=True, kw_only=True)
class Counts:
    """Numbers of elements along the curves of the profile; `frame_size` is the length of an element in the frame.

    `across_leaf` is that over the thickness of a leaf, `root` that over half the height of a fan. `near` and `far` are
    those along both halves of a shuttle. Those of a slot are used where strips of sheet are glued in.
    """

    sector: int
    across_leaf: int
    root: int
    near: int
    far: int
    beside_slot: int
    glue: int
    leaf_end: int
    along_leaf: int
    along_fillet: int
    beside_fillet: int
    neck: int
    ring: int
    frame_size: float


@dataclass(frozen=True, kw_only=True)
class Segment:
    """A line or, with a centre, an arc, with its number of elements; `surface` names the face it lies on.

    `growth` is the ratio of one element to the next; `bump` below 1 packs elements towards both ends.
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
    """A four-sided piece of the profile; opposite sides have the same number of elements.

    `region` names its material, and is empty for that of the print.
    """

    sides: tuple[tuple[Segment, ...], ...]
    smooth: bool = False
    region: str = ""


@dataclass(frozen=True)
class Fan:
    """The levels z of a fan: that of its leaf, and its height above and below it [mm]."""

    level: float
    height: float

    @property
    def levels(self) -> tuple[float, float, float]:
        """Return the levels z of its lower edge, its leaf and its upper edge [mm]."""
        return self.level - self.height, self.level, self.level + self.height


def counts(housing: Housing, scale: float) -> Counts:
    """Return the numbers of elements at a relative element size [1].

    Size 1 is that of the mesh to solve on, 2 that of the one that gives its error, 0.5 that of a reference. In the
    frame, which hardly deforms, elements grow with the root of it.
    """

    def scaled(number: int) -> int:
        return max(1, round(number / scale))

    sector = scaled(1)
    is_printed = housing.clamp is None
    across = 4 * sector if is_printed else 2 * sector
    glue = scaled(2)
    return Counts(
        sector=sector,
        across_leaf=across,
        root=sector if is_printed else glue + across // 2,
        near=sector if is_printed else scaled(6),
        far=sector if is_printed else scaled(4),
        beside_slot=scaled(4),
        glue=glue,
        leaf_end=scaled(3),
        along_leaf=scaled(10 if is_printed else 12),
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
    """Return the number of elements between two levels of a wall or shuttle [mm]; a fan sets it where there is one."""
    return count.root if in_fan(a, b, fans) else pieces(b - a, count)


def in_fan(a: float, b: float, fans: Sequence[Fan]) -> bool:
    """Say whether two levels [mm] lie in the same fan."""
    for fan in fans:
        lower, _, upper = fan.levels
        if lower <= a and b <= upper:
            return True
    return False


def fans_between(arm: Arm, bottom: float, top: float) -> tuple[Fan, ...]:
    """Return the fans of both leaves in a wall or shuttle that reaches from one level to another [mm]."""
    lower, upper = arm.levels
    inside = 0.5 * arm.flexure.separation
    clamp = arm.clamp
    half = 0.5 * arm.flexure.thickness  # of a leaf with its fillets, or of its slot
    half += arm.flexure.fillet if clamp is None else clamp.gap
    most = _FAN * half if clamp is None else half + clamp.wall
    fans = []
    for level, outside in ((lower, lower - bottom), (upper, top - upper)):
        room = min(outside, inside)
        fans.append(Fan(level, min(most, half + _ROOM * (room - half))))
    return tuple(fans)


def _fan_block(arm: Arm, x: float, fan: Fan, depth: float, count: Counts) -> Block:
    """Return the fan at the root of a leaf at x [mm]; its box reaches `depth` [mm] along x into the solid.

    The depth has the sign of that direction. The fan has four sides: the end of the straight leaf, fillet and face
    above, the box in the solid, fillet and face below.
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
    """Return the fillet from the end of a leaf to the face of the solid, and that face on to the edge of the box.

    The straight leaf at `level` ends at x = `start` [mm]. `edge` [mm] lies above or below it, and so do the segments.
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


def root_blocks(arm: Arm, x: float, fan: Fan, ends: Sequence[tuple[float, int]], count: Counts) -> Iterator[Block]:
    """Yield the fan at the root of a printed leaf at x [mm], or the slot of a strip with what is around it.

    `ends` are x [mm] at which the columns in the solid end, with their numbers of elements. A fan ends at the first,
    the box around a slot at the last.
    """
    if arm.clamp is None:
        yield _fan_block(arm, x, fan, ends[0][0] - x, count)
    else:
        yield from _slot_blocks(arm, arm.clamp, x, fan, ends, count)


def _slot_blocks(
    arm: Arm, clamp: StripClamp, x: float, fan: Fan, ends: Sequence[tuple[float, int]], count: Counts
) -> Iterator[Block]:
    """Yield a strip in its glue from the shoulder at x [mm] on, and the blocks around its slot; as `root_blocks`."""
    half = 0.5 * arm.flexure.thickness
    half_slot = half + clamp.gap
    far_x = ends[-1][0]
    tip = x + math.copysign(clamp.length, far_x - x)
    along = sum(number for _, number in ends)
    grown = growth(clamp.length, _FIRST * arm.flexure.thickness * _COARSEST / along, along)

    def line(level: float) -> Segment:
        """Return the line along the slot at a level [mm], its elements growing from the shoulder."""
        return Segment(start=(x, level), end=(tip, level), count=along, growth=grown)

    def rise(place: float, a: float, b: float, number: int) -> Segment:
        return Segment(start=(place, a), end=(place, b), count=number)

    lower, level, upper = fan.levels
    levels = (level - half_slot, level - half, level + half, level + half_slot)
    numbers = (count.glue, count.across_leaf, count.glue)
    for (a, b), number, region in zip(pairwise(levels), numbers, (GLUE, STRIP, GLUE), strict=True):
        sides = ((line(a),), (rise(tip, a, b, number),), (line(b),), (rise(x, a, b, number),))
        yield Block(sides=sides, region=region)

    for inner, outer in ((levels[0], lower), (levels[-1], upper)):
        edges = []
        start = x
        for end, number in ends:
            edges.append(Segment(start=(start, outer), end=(end, outer), count=number))
            start = end
        yield Block(
            sides=(
                (line(inner),),
                (_ray(tip, far_x, inner, outer, count),),
                tuple(edges),
                (_ray(x, x, inner, outer, count),),
            )
        )
    tip_side = tuple(rise(tip, a, b, number) for (a, b), number in zip(pairwise(levels), numbers, strict=True))
    far_side = (rise(far_x, lower, level, count.root), rise(far_x, level, upper, count.root))
    below = _ray(tip, far_x, levels[0], lower, count)
    above = _ray(tip, far_x, levels[-1], upper, count)
    yield Block(sides=(tip_side, (above,), far_side, (below,)))


def _ray(x: float, far_x: float, inner: float, outer: float, count: Counts) -> Segment:
    """Return the line from a corner of a slot to the box around it [mm], its elements growing outwards."""
    return Segment(start=(x, inner), end=(far_x, outer), count=count.beside_slot, growth=_SLOT_GROWTH)


def growth(length: float, first: float, number: int) -> float:
    """Return the ratio of each of a number of elements on a length [mm] to the one before, the first [mm] being given.

    It is 1 where equal elements are no longer than that.
    """

    def too_long(ratio: float) -> bool:
        return first * sum(ratio**i for i in range(number)) > length

    if too_long(1.0) or number == 1:
        return 1.0
    low, high = 1.0, 2.0
    while not too_long(high):
        high *= 2.0
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if too_long(middle) else (middle, high)
    return low


def straight_ends(arm: Arm) -> tuple[float, float]:
    """Return x [mm] where the part of a leaf begins and ends that may be stretched, from the wall to the shuttle.

    It lies between the fillets of a printed leaf, and between the short ends of a strip outside its shoulders.
    """
    inset = arm.flexure.fillet if arm.clamp is None else _LEAF_END * arm.flexure.thickness
    return arm.wall - arm.sign * inset, arm.shuttle + arm.sign * inset


def leaves(arm: Arm, count: Counts) -> Iterator[Block]:
    """Yield the straight parts of the two leaves of an arm, in three pieces where it is a strip."""
    half = 0.5 * arm.flexure.thickness
    start, end = straight_ends(arm)
    # Bending across the leaf fades within half its depth from a root: long leaves need their elements there.
    bump = min(1.0, arm.flexure.depth / abs(end - start))
    pieces_of_leaf = [(start, end, count.along_leaf, 1.0, bump)]
    if arm.clamp is not None:
        for shoulder, inner in ((arm.wall, start), (arm.shuttle, end)):
            pieces_of_leaf.append((shoulder, inner, count.leaf_end, _END_GROWTH, 1.0))
    for level, (a, b, number, grown, packed) in itertools.product(arm.levels, pieces_of_leaf):
        low = Segment(
            start=(a, level - half),
            end=(b, level - half),
            count=number,
            growth=grown,
            bump=packed,
            surface=f"{arm.name}_leaves",
        )
        high = replace(low, start=(a, level + half), end=(b, level + half))
        at_start = Segment(start=(a, level - half), end=(a, level + half), count=count.across_leaf)
        at_end = replace(at_start, start=(b, level - half), end=(b, level + half))
        yield Block(sides=((low,), (at_end,), (high,), (at_start,)), region="" if arm.clamp is None else STRIP)


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

    The fans at the roots of the leaves fill their levels of the near column, slots those of both.
    """
    fans = fans_between(arm, housing.neck_level, arm.top_level)
    width = -arm.sign * housing.shuttle_width
    half_tip = -arm.sign * 0.5 * housing.tip_side
    near = arm.shuttle
    middle = arm.shuttle + 0.5 * width
    far = arm.shuttle + width
    for fan in fans:
        yield from root_blocks(arm, near, fan, ((middle, count.near), (far, count.far)), count)
    for a, b in pairwise([housing.neck_level, *fans[0].levels, *fans[1].levels, arm.top_level]):
        number = pieces_between(a, b, fans, count)
        beside_fan = not in_fan(a, b, fans)
        if beside_fan or arm.clamp is None:
            yield rectangle((middle, far), (a, b), count.far, number)
        if beside_fan:
            yield rectangle((near, middle), (a, b), count.near, number)
    yield from _neck(housing, (near, middle), (middle - half_tip, middle), count.near, count)
    yield from _neck(housing, (middle, far), (middle, middle + half_tip), count.far, count)


def _neck(housing: Housing, top: Interval, bottom: Interval, across: int, count: Counts) -> Iterator[Block]:
    """Yield the blocks of one column of a neck and of the tip below it, in a number of elements across.

    The neck tapers from the interval `top` of x at the shuttle to `bottom` at the tip.
    """
    a = (bottom[0], housing.tip_height)
    b = (bottom[1], housing.tip_height)
    c = (top[1], housing.neck_level)
    d = (top[0], housing.neck_level)
    lower = Segment(start=a, end=b, count=across)
    right = Segment(start=b, end=c, count=count.neck, growth=_NECK_GROWTH)
    upper = Segment(start=c, end=d, count=across)
    left = Segment(start=a, end=d, count=count.neck, growth=_NECK_GROWTH)
    yield Block(sides=((lower,), (right,), (upper,), (left,)))
    yield rectangle(bottom, (0.0, housing.tip_height), across, count.sector)
