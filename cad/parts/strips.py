"""Leaves of sheet and the printed bodies that they are glued into: strips, and a frame and two shuttles with slots.

The solid of a housing with strips is what print, glue and strips fill together. Its printed bodies are the pieces that
a cut along the leaves makes of it. The cut is as wide as a slot, and reaches from the end of one slot to that of the
other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cadquery as cq

from cad.parts.housing import Housing, Strip
from cad.parts.part import NEAR_MM, box_through

FRAME = "frame"
PRINTED_AROUND_STRIPS = (FRAME, "low shuttle", "high shuttle")
_CUT_MM = 1.0  # of sheet that a cut takes


@dataclass(frozen=True, kw_only=True)
class CutStrip:
    """Strips of one spring as they are cut from sheet: their count in a sensor, and their size [mm]."""

    spring: str
    count: int
    length: float
    width: float
    thickness: float

    @property
    def length_with_cut(self) -> float:
        """Return the length of sheet that a strip takes with its cut [mm]."""
        return self.length + _CUT_MM

    def across(self, stock_width: float) -> int:
        """Return how many strips lie side by side on a piece of sheet of a width [mm]."""
        return math.floor((stock_width + NEAR_MM) / self.width)

    @property
    def size(self) -> str:
        """Return length, width and thickness as text [mm], the length to 0.1 mm."""
        return f"{self.length:.1f} x {self.width:g} x {self.thickness:g}"


def printed_bodies(shape: cq.Shape, housing: Housing) -> dict[str, cq.Shape]:
    """Return by name the bodies that are printed of the solid of a housing [mm]: itself where its leaves are printed.

    With strips they are the frame and both shuttles. Raises ValueError where the cut leaves other bodies than these.
    """
    if not housing.strips:
        return {"housing": shape}
    pieces = shape.cut(*[_slot_cut(strip, housing) for strip in housing.strips]).Solids()
    if len(pieces) != len(PRINTED_AROUND_STRIPS):
        named = ", ".join(PRINTED_AROUND_STRIPS)
        msg = f"slots leave {len(pieces)} printed bodies, must be {len(PRINTED_AROUND_STRIPS)}: {named}"
        raise ValueError(msg)
    return dict(zip(PRINTED_AROUND_STRIPS, widest_first(pieces), strict=True))


def widest_first(solids: Sequence[cq.Shape]) -> list[cq.Shape]:
    """Return solids with the widest along x first, then the others from left to right."""
    widest, *others = sorted(solids, key=lambda solid: -float(solid.BoundingBox().xlen))
    return [widest, *sorted(others, key=lambda solid: float(solid.Center().x))]


def _slot_cut(strip: Strip, housing: Housing) -> cq.Shape:
    """Return the box from the end of one slot of a strip to that of the other, as wide as they are [mm]."""
    (first, (foot, top)), (last, _) = strip.slots
    return box_through(housing.depth, (first[0], last[1]), (foot, top))


def strip_shapes(housing: Housing) -> dict[str, cq.Shape]:
    """Return by name the strips of a housing in their places [mm]; those of one spring are one shape, placed twice."""
    shapes = {}
    for arm in housing.arms:
        blank: cq.Shape | None = None
        for strip in arm.strips:
            thickness = arm.flexure.thickness
            if blank is None:
                corner = cq.Vector(-0.5 * strip.length, -0.5 * housing.depth, -0.5 * thickness)
                blank = cq.Solid.makeBox(strip.length, housing.depth, thickness, corner)
            middle = cq.Vector(0.5 * sum(strip.x), 0.0, 0.5 * sum(strip.z))
            shapes[strip.name] = blank.moved(cq.Location(middle))
    return shapes


def cut_strips(housing: Housing) -> tuple[CutStrip, ...]:
    """Return the strips of a sensor as they are cut, those of the low spring first; none where leaves are printed."""
    return tuple(
        CutStrip(
            spring=arm.name,
            count=housing.plates * len(arm.strips),
            length=arm.strips[0].length,
            width=housing.depth,
            thickness=arm.flexure.thickness,
        )
        for arm in housing.arms
        if arm.strips
    )


def glue_volume(housing: Housing) -> float:
    """Return the volume of the glue in all slots of a sensor [mm^3]."""
    volume = 0.0
    for strip in housing.strips:
        for (start, end), (foot, top) in strip.slots:
            held = min(end, strip.x[1]) - max(start, strip.x[0])
            volume += housing.depth * ((end - start) * (top - foot) - held * (strip.z[1] - strip.z[0]))
    return housing.plates * volume


def length_of_stock(strips: CutStrip, stock_width: float) -> float:
    """Return the length of a piece of sheet of a width [mm] that yields the strips, with what the cuts take [mm].

    Infinite where the strips are wider.
    """
    across = strips.across(stock_width)
    return math.ceil(strips.count / across) * strips.length_with_cut if across else math.inf


def pieces_of_stock(strips: CutStrip, stock: tuple[float, float]) -> int:
    """Return how many strips a piece of sheet of a width and length [mm] yields, each with its cut along the length."""
    width, length = stock
    return strips.across(width) * math.floor((length + NEAR_MM) / strips.length_with_cut)
