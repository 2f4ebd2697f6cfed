"""Division of the housing's profile into four-sided blocks, which gmsh then divides into quadrilaterals.

The mesh is fine at the roots of the leaves and around the holes, and coarse elsewhere. The block at a leaf root is
called a fan. It extends from the end of the straight leaf, past its two fillets, to a box in the solid. The elements
spread out in it like a fan, over four sectors of 45 degrees. Lengths are in mm, and points are (x, z).
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from cad.parts.housing import Arm, Housing

Point = tuple[float, float]
Interval = tuple[float, float]  # start and end [mm]

# Half the height of a fan's box, divided by half the leaf thickness plus the fillet radius.
_FAN_HEIGHT_RATIO = 1.8
_MAX_FAN_FRACTION = 0.7  # largest fraction of the solid beside a fillet that a fan may occupy
_NECK_GROWTH = 1.5  # size ratio of successive elements, from the tip upwards
# An excess of up to this fraction of an element, for example from rounding, does not add an element.
_IGNORED_EXCESS = 0.01
_FRAME_SIZE_RATIO = 0.4  # element size in the frame at scale 1, divided by the width of a wall


@dataclass(frozen=True, kw_only=True)
class ElementCounts:
    """The numbers of elements along the curves of the profile, and the element size in the frame, `frame_size` [mm].

    Each field is the number of elements along one kind of curve:

    - `sector`: one sector of a fan
    - `across_leaf`: the thickness of a leaf
    - `along_leaf`: the straight part of a leaf
    - `along_fillet`: a fillet at a leaf root
    - `beside_fillet`: the face between such a fillet and the edge of the fan
    - `neck`: the height of a neck
    - `ring`: the distance from a hole to the edge of the ring of blocks around it
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
    """One curve of the profile: a straight line, or an arc about `centre`, divided into `count` elements.

    `growth` is the size ratio of successive elements. If `bump` is less than 1, the elements are smaller at both ends.
    `surface` is the name of the housing's face on which the curve lies, or an empty string.
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

    Each side consists of one or more segments. If `smooth` is true, gmsh smooths the elements in the block.
    """

    sides: tuple[tuple[Segment, ...], ...]
    smooth: bool = False


@dataclass(frozen=True)
class Fan:
    """The extent of a fan in z: from `level` - `height` to `level` + `height` [mm].

    `level` is the mid-plane of its leaf.
    """

    level: float
    height: float

    @property
    def levels(self) -> tuple[float, float, float]:
        """Return z [mm] at the lower edge of the fan, at the mid-plane of the leaf, and at the upper edge."""
        return self.level - self.height, self.level, self.level + self.height


def element_counts(housing: Housing, scale: float) -> ElementCounts:
    """Return the numbers of elements along the curves of a housing's profile.

    `scale` [1] is the relative element size: 1 for the mesh of the solution, 2 for the coarse mesh of its error
    estimate, and 0.5 for a reference solution. The frame hardly deforms, so its element size is only proportional to
    the square root of `scale`.
    """

    def scaled(number_at_scale_1: int) -> int:
        return max(1, round(number_at_scale_1 / scale))

    sector = scaled(1)
    return ElementCounts(
        sector=sector,
        across_leaf=4 * sector,  # the end of a leaf is the side of a fan opposite its four sectors
        along_leaf=scaled(10),
        along_fillet=scaled(3),
        beside_fillet=scaled(4),
        neck=scaled(6),
        ring=scaled(2),
        frame_size=_FRAME_SIZE_RATIO * scale**0.5 * housing.wall_width,
    )


def frame_elements(length: float, counts: ElementCounts) -> int:
    """Return the number of elements along a length [mm] in the frame."""
    return max(1, math.ceil(length / counts.frame_size - _IGNORED_EXCESS))


def elements_between(lower: float, upper: float, fans: Sequence[Fan], counts: ElementCounts) -> int:
    """Return the number of elements between two adjacent levels `lower` and `upper` [mm] of a wall or shuttle.

    If both levels lie in a fan, they enclose one sector, which has its own number of elements.
    """
    return counts.sector if is_in_fan(lower, upper, fans) else frame_elements(upper - lower, counts)


def is_in_fan(lower: float, upper: float, fans: Sequence[Fan]) -> bool:
    """Return whether the levels `lower` and `upper` [mm] lie in the same fan."""
    for fan in fans:
        fan_bottom, _, fan_top = fan.levels
        if fan_bottom <= lower and upper <= fan_top:
            return True
    return False


def leaf_fans(arm: Arm, bottom: float, top: float) -> tuple[Fan, ...]:
    """Return the fans of both leaves of an arm, in a wall or shuttle that extends from `bottom` to `top` [mm] in z.

    A fan is smaller if there is little solid beside its fillet. This solid extends to the end of the wall or shuttle,
    or halfway to the other leaf, whichever is nearer.
    """
    lower_leaf, upper_leaf = arm.levels
    half_separation = 0.5 * arm.flexure.separation
    fillet_reach = 0.5 * arm.flexure.thickness + arm.flexure.fillet
    fans = []
    for level, distance_to_end in ((lower_leaf, lower_leaf - bottom), (upper_leaf, top - upper_leaf)):
        # The fan must not reach the end of the solid, or the fan of the other leaf.
        solid_height = min(distance_to_end, half_separation)
        largest_height = fillet_reach + _MAX_FAN_FRACTION * (solid_height - fillet_reach)
        fans.append(Fan(level, min(_FAN_HEIGHT_RATIO * fillet_reach, largest_height)))
    return tuple(fans)


def fan_block(arm: Arm, face_x: float, fan: Fan, width: float, counts: ElementCounts) -> Block:
    """Return the block of the fan at the root of a leaf.

    The leaf is attached to the face of the solid at x = `face_x` [mm]. The fan's box extends from this face into the
    solid by `width` [mm], which is negative if the solid lies in the direction of -x. `fan` is the extent of the box in
    z. The block has four sides: the end of the straight leaf, a fillet and face above it, the edges of the box, and a
    fillet and face below it.
    """
    lower, level, upper = fan.levels
    half_thickness = 0.5 * arm.flexure.thickness
    box_x = face_x + width  # the far edge of the box
    leaf_end = face_x - math.copysign(arm.flexure.fillet, width)  # x where the straight leaf ends and the fillets begin
    # The edges of the box are the outer ends of the four sectors.
    corners = [(face_x, lower), (box_x, lower), (box_x, level), (box_x, upper), (face_x, upper)]
    box_side = tuple(Segment(start=start, end=end, count=counts.sector) for start, end in pairwise(corners))
    leaf_side = Segment(
        start=(leaf_end, level - half_thickness), end=(leaf_end, level + half_thickness), count=counts.across_leaf
    )
    upper_side = _fan_side(arm, (face_x, upper), leaf_end, level, counts)
    lower_side = _fan_side(arm, (face_x, lower), leaf_end, level, counts)
    return Block(sides=((leaf_side,), upper_side, box_side, lower_side), smooth=True)


def _fan_side(arm: Arm, edge: Point, leaf_end: float, level: float, counts: ElementCounts) -> tuple[Segment, Segment]:
    """Return one curved side of a fan: the fillet from the leaf to the face of the solid, and the face beyond it.

    The straight part of the leaf with its mid-plane at z = `level` [mm] ends at x = `leaf_end` [mm]. The face ends at
    `edge` [mm], a corner of the fan's box. Both segments lie on the same side of the leaf as `edge`, above it or below.
    """
    face_x, edge_z = edge
    direction = math.copysign(1.0, edge_z - level)  # 1 above the leaf, -1 below it
    leaf_z = level + direction * 0.5 * arm.flexure.thickness  # the surface of the leaf
    root_z = level + direction * (0.5 * arm.flexure.thickness + arm.flexure.fillet)
    tangent_point = (face_x, root_z)  # where the fillet meets the face
    fillet = Segment(
        start=(leaf_end, leaf_z),
        end=tangent_point,
        count=counts.along_fillet,
        centre=(leaf_end, root_z),
        surface=f"{arm.name}_leaves",
    )
    face = Segment(start=tangent_point, end=edge, count=counts.beside_fillet)
    return fillet, face


def straight_ends(arm: Arm) -> tuple[float, float]:
    """Return x [mm] at the ends of the straight part of an arm's leaves, first at the wall, then at the shuttle.

    The straight part lies between the fillets. A mesh may be stretched there to fit a different leaf length.
    """
    fillet = arm.flexure.fillet
    return arm.wall - arm.sign * fillet, arm.shuttle + arm.sign * fillet


def leaf_blocks(arm: Arm, counts: ElementCounts) -> Iterator[Block]:
    """Yield two blocks: the straight parts of the lower and the upper leaf of an arm."""
    half_thickness = 0.5 * arm.flexure.thickness
    start, end = straight_ends(arm)
    # Anticlastic bending decays within half the leaf's depth from each root. If a leaf is longer than its depth, a bump
    # below 1 concentrates the elements there.
    bump = min(1.0, arm.flexure.depth / abs(end - start))
    for level in arm.levels:
        lower_face = Segment(
            start=(start, level - half_thickness),
            end=(end, level - half_thickness),
            count=counts.along_leaf,
            bump=bump,
            surface=f"{arm.name}_leaves",
        )
        upper_face = replace(lower_face, start=(start, level + half_thickness), end=(end, level + half_thickness))
        at_start = Segment(
            start=(start, level - half_thickness), end=(start, level + half_thickness), count=counts.across_leaf
        )
        at_end = replace(at_start, start=(end, level - half_thickness), end=(end, level + half_thickness))
        yield Block(sides=((lower_face,), (at_end,), (upper_face,), (at_start,)))


def straight_block(corners: Sequence[Point], along: int, across: int) -> Block:
    """Return the block with straight sides between four corners, which are given in order around the block.

    The side from the first to the second corner and the side opposite have `along` elements. The other two sides have
    `across` elements.
    """
    first, second, third, fourth = corners
    return Block(
        sides=(
            (Segment(start=first, end=second, count=along),),
            (Segment(start=second, end=third, count=across),),
            (Segment(start=third, end=fourth, count=along),),
            (Segment(start=fourth, end=first, count=across),),
        )
    )


def rectangle(x: Interval, z: Interval, along: int, across: int) -> Block:
    """Return the rectangular block over the intervals `x` and `z` [mm].

    The block has `along` elements in x and `across` elements in z.
    """
    start, end = x
    lower, upper = z
    return straight_block(((start, lower), (end, lower), (end, upper), (start, upper)), along, across)


def shuttle_blocks(housing: Housing, arm: Arm, counts: ElementCounts) -> Iterator[Block]:
    """Yield the blocks of one shuttle with its neck and tip, in two columns side by side in x.

    Between the levels of a fan, the fan replaces the column on the side of the leaves.
    """
    fans = leaf_fans(arm, housing.neck_level, arm.top_level)
    # Both widths have the sign of the direction away from the leaves.
    width = -arm.sign * housing.shuttle_width
    half_tip = -arm.sign * 0.5 * housing.tip_side
    near_x = arm.shuttle  # the face to which the leaves are attached
    middle_x = arm.shuttle + 0.5 * width
    far_x = arm.shuttle + width
    for fan in fans:
        yield fan_block(arm, near_x, fan, middle_x - near_x, counts)
    lower_fan, upper_fan = fans
    levels = [housing.neck_level, *lower_fan.levels, *upper_fan.levels, arm.top_level]
    for lower, upper in pairwise(levels):
        elements = elements_between(lower, upper, fans, counts)
        yield rectangle((middle_x, far_x), (lower, upper), counts.sector, elements)
        if not is_in_fan(lower, upper, fans):
            yield rectangle((near_x, middle_x), (lower, upper), counts.sector, elements)
    yield from _neck_blocks(housing, (near_x, middle_x), (middle_x - half_tip, middle_x), counts)
    yield from _neck_blocks(housing, (middle_x, far_x), (middle_x, middle_x + half_tip), counts)


def _neck_blocks(housing: Housing, x_top: Interval, x_bottom: Interval, counts: ElementCounts) -> Iterator[Block]:
    """Yield the block of the neck and the block of the tip in one of the two columns of a shuttle.

    The neck tapers from the interval `x_top` [mm] at the shuttle to the interval `x_bottom` [mm] at the tip. The
    intervals `x_top` and `x_bottom` run in the same direction along x.
    """
    bottom_start = (x_bottom[0], housing.tip_height)
    bottom_end = (x_bottom[1], housing.tip_height)
    top_start = (x_top[0], housing.neck_level)
    top_end = (x_top[1], housing.neck_level)
    bottom = Segment(start=bottom_start, end=bottom_end, count=counts.sector)
    top = Segment(start=top_end, end=top_start, count=counts.sector)
    # Both flanks run upwards, because their elements grow from the tip to the shuttle.
    end_flank = Segment(start=bottom_end, end=top_end, count=counts.neck, growth=_NECK_GROWTH)
    start_flank = Segment(start=bottom_start, end=top_start, count=counts.neck, growth=_NECK_GROWTH)
    yield Block(sides=((bottom,), (end_flank,), (top,), (start_flank,)))
    yield rectangle(x_bottom, (0.0, housing.tip_height), counts.sector, counts.sector)
