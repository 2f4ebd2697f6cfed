"""A small beam with the housing's leaves, clamped in the middle and loaded at its ends: it tells E as printed.

Coupon frame: that of the housing, with the middle of the clamped block at x = 0, z = 0.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import cadquery as cq
import numpy as np

from cad.parts.housing import Housing, is_upright_at
from cad.parts.part import Part, named_part
from cad.theory.flexure import Flexure

_NEAR = 1e-6
_POINTS = 24  # of Gauss, in each fillet and in the straight part


@dataclass(frozen=True, kw_only=True)
class Coupon:
    """Two leaves out of one block [mm], low to -x and high to +x, each with a pad and a hole for a weight."""

    low: Flexure
    high: Flexure
    block_width: float = 24.0
    block_height: float = 12.0
    pad_side: float = 7.0
    weight_hole: float = 2.5
    clamp_hole: float = 3.4

    @property
    def arm_beyond_leaf(self) -> float:
        """Return the distance from the end of a leaf to the middle of the weight's hole [mm]."""
        return 0.5 * self.pad_side


def coupon_of(housing: Housing) -> Coupon:
    """Return the coupon whose leaves have the thickness, length, depth and fillets of the housing's."""
    return Coupon(low=housing.low, high=housing.high)


def modulus_factor(flexure: Flexure, beyond: float) -> float:
    """Return C [1/mm] in E = C F / d: a weight F [N] at the hole moves it by d [mm] when the block is clamped.

    Euler-Bernoulli cantilever, C = integral of 12 (a - s)^2 / (w t(s)^3) ds over the leaf with its fillets,
    a = length + beyond; S. Timoshenko, Strength of Materials I, 1930, art. 34. The pad is taken rigid.
    """
    r, length = flexure.fillet, flexure.length
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    total = 0.0
    for start, end in ((0.0, r), (r, length - r), (length - r, length)):
        s = 0.5 * (end - start) * nodes + 0.5 * (end + start)
        from_root = np.minimum(s, length - s)
        rise = r - np.sqrt(np.maximum(r**2 - np.maximum(r - from_root, 0.0) ** 2, 0.0))
        thickness = flexure.thickness + 2.0 * rise
        share = 12.0 * (length + beyond - s) ** 2 / (flexure.depth * thickness**3)
        total += 0.5 * (end - start) * float(weights @ share)
    return total


def largest_weight(flexure: Flexure, beyond: float, E: float, strain: float) -> float:
    """Return the force [N] that strains the root of a leaf of modulus E [MPa] to the given strain [1]."""
    return strain * E * flexure.depth * flexure.thickness**2 / (6.0 * (flexure.length + beyond))


def coupon_part(coupon: Coupon) -> Part:
    """Return the coupon as one solid with the faces clamp_holes, low_weight and high_weight."""
    depth, half = coupon.low.depth, 0.5 * coupon.block_width
    back = cq.Workplane("XZ", origin=(0.0, 0.5 * depth, 0.0))
    body = back.rect(coupon.block_width, coupon.block_height).extrude(depth)
    corners, centres = [], {}
    for name, sign, flexure in (("low_weight", -1.0, coupon.low), ("high_weight", 1.0, coupon.high)):
        root, end = sign * half, sign * (half + flexure.length)
        centre = end + sign * coupon.arm_beyond_leaf
        leaf = back.center(0.5 * (root + end), 0.0).rect(flexure.length, flexure.thickness).extrude(depth)
        body = body.union(leaf).union(back.center(centre, 0.0).rect(coupon.pad_side, coupon.pad_side).extrude(depth))
        corners += [(x, side * 0.5 * flexure.thickness) for x in (root, end) for side in (-1.0, 1.0)]
        centres[name] = centre
    clamps = [(side * (half - 6.0), 0.0) for side in (-1.0, 1.0)]
    body = body.cut(back.pushPoints(clamps).circle(0.5 * coupon.clamp_hole).extrude(depth))
    holes = back.pushPoints([(x, 0.0) for x in centres.values()]).circle(0.5 * coupon.weight_hole)
    solid = body.cut(holes.extrude(depth)).findSolid()
    roots = [edge for edge in solid.Edges() if is_upright_at(edge, corners)]
    return named_part(
        "coupon",
        solid.fillet(coupon.low.fillet, roots).Solids()[0],
        {
            "clamp_holes": lambda face: _is_hole(face, clamps),
            **{name: _hole_at(x) for name, x in centres.items()},
        },
    )


def _hole_at(x: float) -> Callable[[cq.Face], bool]:
    return lambda face: _is_hole(face, [(x, 0.0)])


def _is_hole(face: cq.Face, centres: list[tuple[float, float]]) -> bool:
    """Say whether a face is a round hole about one of the centres (x, z): a cylinder that closes, no fillet."""
    if face.geomType() != "CYLINDER":
        return False
    box = face.BoundingBox()
    middle, whole = box.center, abs(box.xlen - box.zlen) < _NEAR and len(face.Wires()) >= 1
    return whole and any(math.hypot(middle.x - x, middle.z - z) < _NEAR for x, z in centres)
