"""The four-sided blocks into which the profile of the housing is divided for a mesh of quadrilaterals.

The mesh is fine at the roots of the leaves and around the holes, and coarse elsewhere. A fan is the block at a leaf
root. It extends from the end of the straight leaf over its two fillets to a box in the solid. Elements spread in it
like a fan, over four sectors of 45 degrees. Lengths are in mm; points are (x, z).
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from cad.parts.housing import Arm, Housing

Point = tuple[float, float]
Interval = tuple[float, float]  # from, to [mm]

_FAN = 1.8  # half height of a fan's box over its fillet reach, which is half the leaf thickness plus the fillet radius
_ROOM = 0.7  # largest fraction of the solid beside a fillet that a fan may take up
_NECK_GROWTH = 1.5  # size ratio of successive elements up a neck


@dataclass(frozen=True, kw_only=True)
class Counts:
    """Numbers of elements along the curves of the profile, and the length of an element in the frame [mm].

    `sector` is the number for one sector of a fan, `across_leaf` for the thickness of a leaf, `along_leaf` for its
    straight length. `along_fillet` is the number along a fillet, `beside_fillet` on the face from there to the edge of
    the fan. `neck` is the number along the height of a neck, `ring` from a hole to the edge of its ring.
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
    """One curve of the profile with its number of elements: a straight line, or an arc if `centre` is given.

    `growth` is the size ratio of successive elements. `bump` below 1 concentrates elements at both ends. `surface` is
    the name of the housing's face on which the curve lies, or empty.
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
    """A four-sided piece of the profile. Opposite sides have the same number of elements.

    A side consists of one segment or several. With `smooth`, gmsh smooths the elements inside.
    """

    sides: tuple[tuple[Segment, ...], ...]
    smooth: bool = False


@dataclass(frozen=True)
class Fan:
    """The extent of a fan in z [mm]: the level of the middle of its leaf, and its height above and below this level."""

    level: float
    height: float

    @property
    def levels(self) -> tuple[float, float, float]:
        """Return the levels z [mm] of the lower edge, the middle of the leaf, and the upper edge."""
        return self.level - self.height, self.level, self.level + self.height


def counts(housing: Housing, scale: float) -> Counts:
    """Return the numbers of elements for a relative element size `scale` [1].

    `scale` is 1 for the mesh of the solve, 2 for the coarse mesh of its error estimate, and 0.5 for a reference. The
    frame hardly deforms, so the size of its elements is proportional to the square root of `scale`.
    """

    def scaled(number: int) -> int:
        """Return a number of elements at scale 1 converted to `scale`."""
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


def frame_elements(length: float, count: Counts) -> int:
    """Return the number of elements along a length [mm] in the frame."""
    # A hundredth of an element beyond a whole number, for instance from rounding, adds no element.
    return max(1, math.ceil(length / count.frame_size - 0.01))


def elements_between(a: float, b: float, fans: Sequence[Fan], count: Counts) -> int:
    """Return the number of elements between the levels a and b [mm] of a wall or shuttle.

    Inside a fan, it is the number of one of the fan's sectors.
    """
    return count.sector if in_fan(a, b, fans) else frame_elements(b - a, count)


def in_fan(a: float, b: float, fans: Sequence[Fan]) -> bool:
    """Return whether the levels a <= b [mm] lie in the same fan."""
    for fan in fans:
        lower, _, upper = fan.levels
        if lower <= a and b <= upper:
            return True
    return False


def leaf_fans(arm: Arm, bottom: float, top: float) -> tuple[Fan, ...]:
    """Return the fans of both leaves of an arm, in a wall or shuttle that extends from `bottom` to `top` [mm] in z.

    A fan is smaller where the solid beside its fillet is short: up to an end of the wall, or halfway to the other leaf.
    """
    lower_leaf, upper_leaf = arm.levels
    half_separation = 0.5 * arm.flexure.separation
    fillet_reach = 0.5 * arm.flexure.thickness + arm.flexure.fillet
    fans = []
    for level, distance_to_end in ((lower_leaf, lower_leaf - bottom), (upper_leaf, top - upper_leaf)):
        room = min(distance_to_end, half_separation)
        fans.append(Fan(level, min(_FAN * fillet_reach, fillet_reach + _ROOM * (room - fillet_reach))))
    return tuple(fans)


def fan_block(arm: Arm, x: float, fan: Fan, depth: float, count: Counts) -> Block:
    """Return the block of the fan at the root of a leaf.

    The face of the solid is at `x` [mm]. The fan's box extends from there by `depth` [mm] along x into the solid; its
    sign is the direction. The block has four sides. They are the end of the straight leaf, the fillet and face above
    the leaf, the box in the solid, and the fillet and face below the leaf.
    """
    lower, level, upper = fan.levels
    half_thickness = 0.5 * arm.flexure.thickness
    leaf_end = x - math.copysign(arm.flexure.fillet, depth)  # x where the straight leaf ends and the fillets begin
    corners = [(x, lower), (x + depth, lower), (x + depth, level), (x + depth, upper), (x, upper)]
    box_side = tuple(Segment(start=a, end=b, count=count.sector) for a, b in pairwise(corners))
    leaf_side = Segment(
        start=(leaf_end, level - half_thickness), end=(leaf_end, level + half_thickness), count=count.across_leaf
    )
    upper_side = _fan_side(arm, (x, upper), leaf_end, level, count)
    lower_side = _fan_side(arm, (x, lower), leaf_end, level, count)
    return Block(sides=((leaf_side,), upper_side, box_side, lower_side), smooth=True)


def _fan_side(arm: Arm, edge: Point, start: float, level: float, count: Counts) -> tuple[Segment, Segment]:
    """Return one curved side of a fan: the fillet from the leaf to the face of the solid, and the face beyond it.

    The straight leaf at `level` ends at x = `start` [mm]. The face ends at `edge` [mm], a corner of the fan's box. Both
    segments lie on the same side of the leaf as `edge`.
    """
    direction = math.copysign(1.0, edge[1] - level)
    leaf_z = level + direction * 0.5 * arm.flexure.thickness
    root_z = level + direction * (0.5 * arm.flexure.thickness + arm.flexure.fillet)
    tangent_point = (edge[0], root_z)  # where the fillet meets the face
    fillet = Segment(
        start=(start, leaf_z),
        end=tangent_point,
        count=count.along_fillet,
        centre=(start, root_z),
        surface=f"{arm.name}_leaves",
    )
    return fillet, Segment(start=tangent_point, end=edge, count=count.beside_fillet)


def straight_ends(arm: Arm) -> tuple[float, float]:
    """Return x [mm] of both ends of the straight leaves of an arm, which lie between the fillets: wall, then shuttle.

    A mesh may be stretched between them to fit another leaf length.
    """
    fillet = arm.flexure.fillet
    return arm.wall - arm.sign * fillet, arm.shuttle + arm.sign * fillet


def leaf_blocks(arm: Arm, count: Counts) -> Iterator[Block]:
    """Yield the blocks of the straight parts of both leaves of an arm."""
    half_thickness = 0.5 * arm.flexure.thickness
    start, end = straight_ends(arm)
    # Anticlastic bending decays within half the leaf's depth from a root. A long leaf needs its elements there.
    bump = min(1.0, arm.flexure.depth / abs(end - start))
    for level in arm.levels:
        lower_face = Segment(
            start=(start, level - half_thickness),
            end=(end, level - half_thickness),
            count=count.along_leaf,
            bump=bump,
            surface=f"{arm.name}_leaves",
        )
        upper_face = replace(lower_face, start=(start, level + half_thickness), end=(end, level + half_thickness))
        at_start = Segment(
            start=(start, level - half_thickness), end=(start, level + half_thickness), count=count.across_leaf
        )
        at_end = replace(at_start, start=(end, level - half_thickness), end=(end, level + half_thickness))
        yield Block(sides=((lower_face,), (at_end,), (upper_face,), (at_start,)))


def straight_block(corners: Sequence[Point], along: int, across: int) -> Block:
    """Return the block with straight sides between four corners in order.

    The first side starts at the first corner. It and the third side have `along` elements, the other two `across`.
    """
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
    """Return the rectangular block over the intervals `x` and `z` [mm], with `along` elements in x, `across` in z."""
    start, end = x
    lower, upper = z
    return straight_block(((start, lower), (end, lower), (end, upper), (start, upper)), along, across)


def shuttle_blocks(housing: Housing, arm: Arm, count: Counts) -> Iterator[Block]:
    """Yield the blocks of one shuttle with its neck and tip, in two columns side by side in x.

    The near column is on the side of the leaves. At the levels of the leaf roots, the fans take its place.
    """
    fans = leaf_fans(arm, housing.neck_level, arm.top_level)
    width = -arm.sign * housing.shuttle_width
    half_tip = -arm.sign * 0.5 * housing.tip_side
    near = arm.shuttle
    middle = arm.shuttle + 0.5 * width
    far = arm.shuttle + width
    for fan in fans:
        yield fan_block(arm, near, fan, middle - near, count)
    for z0, z1 in pairwise([housing.neck_level, *fans[0].levels, *fans[1].levels, arm.top_level]):
        elements = elements_between(z0, z1, fans, count)
        yield rectangle((middle, far), (z0, z1), count.sector, elements)
        if not in_fan(z0, z1, fans):
            yield rectangle((near, middle), (z0, z1), count.sector, elements)
    yield from _neck(housing, (near, middle), (middle - half_tip, middle), count)
    yield from _neck(housing, (middle, far), (middle, middle + half_tip), count)


def _neck(housing: Housing, x_top: Interval, x_bottom: Interval, count: Counts) -> Iterator[Block]:
    """Yield the two blocks of one column of a neck and of the tip below it.

    The neck tapers from the interval `x_top` [mm] at the shuttle to the interval `x_bottom` [mm] at the tip.
    """
    a = (x_bottom[0], housing.tip_height)
    b = (x_bottom[1], housing.tip_height)
    c = (x_top[1], housing.neck_level)
    d = (x_top[0], housing.neck_level)
    lower = Segment(start=a, end=b, count=count.sector)
    right = Segment(start=b, end=c, count=count.neck, growth=_NECK_GROWTH)
    upper = Segment(start=c, end=d, count=count.sector)
    left = Segment(start=a, end=d, count=count.neck, growth=_NECK_GROWTH)
    yield Block(sides=((lower,), (right,), (upper,), (left,)))
    yield rectangle(x_bottom, (0.0, housing.tip_height), count.sector, count.sector)
