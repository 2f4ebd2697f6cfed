"""What is pressed in a compression test: each body says how a tool presses it on one side, and on which sides."""

import math
from dataclasses import dataclass, replace
from typing import ClassVar, Protocol

from cad.quantity import LENGTH, InputError, check_fields, quantity, validation_error
from cad.theory.hertz import equivalent_radius, relative_radius
from solve.compression.body import RoundSection, StraightSection
from solve.compression.force_curve import Press
from solve.compression.tool import Tool

POINT_CONTACT = 1.5  # exponent of Hertz's law, with which every convex body begins
_DEEPEST = 0.15  # of half the height, or of the radius: most fruit have failed before
_DEEPEST_BALL = 0.1  # of the radius of a ball plunger: beyond, not every law of flesh has an equilibrium
_DEEPEST_FLAT = 0.3  # of the radius of a flat plunger
_LINE_CONTACT = 1.0  # and a logarithm, which the terms of the curve follow
_FLAT_CONTACT = 1.0
_WIDEST = 0.8  # plunger over body: nearer its edge the flesh would be shorn off
_MEASURE = "measure it on the fruit"


@dataclass(frozen=True, kw_only=True)
class Plunger:
    """A plunger that presses from above: a rod of a radius [mm] whose end is flat, or a ball of that radius."""

    radius_mm: float = quantity("mm", LENGTH, hint="measure the plunger")
    ball: bool = False

    def __post_init__(self) -> None:
        """Refuse a size that no plunger has."""
        check_fields(self, "plunger")

    @property
    def tool(self) -> Tool:
        """Return its rigid face."""
        return Tool(curvature=1.0 / self.radius_mm if self.ball else 0.0, edge=self.radius_mm)

    @property
    def deepest(self) -> float:
        """Return down to which depth it is solved [mm]."""
        return self.radius_mm * (_DEEPEST_BALL if self.ball else _DEEPEST_FLAT)


class Body(Protocol):
    """A body that a plate or a plunger presses, on a plate or in a seat that gives nothing."""

    kind: ClassVar[str]

    @property
    def height_mm(self) -> float:
        """Return its height along the press [mm]."""

    @property
    def end_area_mm2(self) -> float | None:
        """Return the area of its flat end [mm^2]; None where it is round."""

    @property
    def per_mm(self) -> float:
        """Return by how much the modulus is lower where every radius or width is 1 mm larger [1]."""

    def sides(self, plunger: Plunger | None, plates: int) -> tuple[Press, ...]:
        """Return how each side that gives way is pressed; raises InputError for what is not solved."""

    def hertz_radii(self, plunger: Plunger | None, plates: int) -> tuple[float, ...]:
        """Return the relative radii of the point contacts [mm]; none where Hertz has no law."""

    def bounds(self, press: Press) -> dict[str, tuple[tuple[Press, float], ...]]:
        """Return, by its name, what the body is simplified by: presses and factors of their force that bound it."""


class _CheckedBody:
    """A body whose fields are checked, with what holds for most: no flat end, nothing that it is simplified by."""

    def __post_init__(self) -> None:
        """Refuse sizes that no fruit has."""
        check_fields(self, "modulus")

    @property
    def end_area_mm2(self) -> float | None:
        """Return none."""
        return None

    def hertz_radii(self, plunger: Plunger | None, plates: int) -> tuple[float, ...]:
        """Return the radius of a ball plunger on a flat end [mm]: neither plates nor a line have a law of Hertz."""
        return (plunger.radius_mm,)[:plates] if plunger is not None and plunger.ball else ()

    def bounds(self, press: Press) -> dict[str, tuple[tuple[Press, float], ...]]:  # noqa: ARG002 - others need it
        """Return nothing: it is solved as it is."""
        return {}


@dataclass(frozen=True, kw_only=True)
class Ellipsoid(_CheckedBody):
    """A ball, an ellipsoid, any convex fruit: two radii of curvature where a tool touches it, alike above and below."""

    kind: ClassVar[str] = "ellipsoid"
    height_mm: float = quantity("mm", LENGTH, hint=_MEASURE)
    radius_mm: float = quantity("mm", LENGTH, hint=_MEASURE)
    radius_across_mm: float = quantity("mm", LENGTH, hint=_MEASURE)

    @property
    def per_mm(self) -> float:
        """Return it of Hertz's law, in which E goes with 1 / sqrt(R) [1]."""
        return 0.5 / self.radius_mm

    @property
    def _radius(self) -> float:
        """Return the radius of the ball that a plate presses in alike [mm]."""
        return equivalent_radius(self.radius_mm, self.radius_across_mm)

    def sides(self, plunger: Plunger | None, plates: int) -> tuple[Press, ...]:
        """Return the upper side, and the lower one on a plate; two unlike radii are taken as their equivalent one."""
        section = RoundSection(half_height=0.5 * self.height_mm, radius=self._radius)
        above = _round_press(section, POINT_CONTACT, plunger)
        return (above, _round_press(section, POINT_CONTACT, None))[:plates]

    def hertz_radii(self, plunger: Plunger | None, plates: int) -> tuple[float, ...]:
        """Return the relative radii above and below [mm]."""
        if plunger is None:
            return (self._radius,) * plates
        if not plunger.ball:
            return ()
        return (relative_radius(plunger.radius_mm, self._radius), self._radius)[:plates]

    def bounds(self, press: Press) -> dict[str, tuple[tuple[Press, float], ...]]:
        """Return the balls of either radius, with the force at which each begins as the ellipsoid does."""
        if self.radius_mm == self.radius_across_mm or press.tool != Tool():
            return {}
        presses = []
        for radius in (self.radius_mm, self.radius_across_mm):
            section = RoundSection(half_height=0.5 * self.height_mm, radius=radius)
            presses.append((replace(press, section=section), math.sqrt(self._radius / radius)))
        return {"two radii": tuple(presses)}


@dataclass(frozen=True, kw_only=True)
class CylinderOnSide(_CheckedBody):
    """A cylinder between plates along it: plane strain, but for its ends, which are free."""

    kind: ClassVar[str] = "cylinder-side"
    radius_mm: float = quantity("mm", LENGTH, hint=_MEASURE)
    length_mm: float = quantity("mm", LENGTH, hint=_MEASURE)

    @property
    def height_mm(self) -> float:
        """Return the diameter [mm]."""
        return 2.0 * self.radius_mm

    @property
    def per_mm(self) -> float:
        """Return it of a line contact: E goes with 1 / length [1]."""
        return 1.0 / self.length_mm

    def sides(self, plunger: Plunger | None, plates: int) -> tuple[Press, ...]:
        """Return both sides, or the upper one alone in a seat."""
        if plunger is not None:
            raise _not_solved(self.kind, "between plates or on a seat")
        section = RoundSection(half_height=self.radius_mm, radius=self.radius_mm, length=self.length_mm)
        return (_round_press(section, _LINE_CONTACT, None),) * plates

    def bounds(self, press: Press) -> dict[str, tuple[tuple[Press, float], ...]]:
        """Return the force where a radius at each end is in plane stress: 1 - nu^2 times that of plane strain."""
        free = min(1.0, 2.0 * self.radius_mm / self.length_mm)
        return {"free ends": ((press, 1.0 - free * press.law.poisson**2),)}


@dataclass(frozen=True, kw_only=True)
class CylinderOnEnd(_CheckedBody):
    """A cylinder pressed along its axis, as a plug from a cork borer."""

    kind: ClassVar[str] = "cylinder-end"
    height_mm: float = quantity("mm", LENGTH, hint=_MEASURE)
    radius_mm: float = quantity("mm", LENGTH, hint=_MEASURE)

    @property
    def end_area_mm2(self) -> float:
        """Return the area of an end [mm^2]."""
        return math.pi * self.radius_mm**2

    @property
    def per_mm(self) -> float:
        """Return it of a bar: E goes with 1 / area [1]."""
        return 2.0 / self.radius_mm

    def sides(self, plunger: Plunger | None, plates: int) -> tuple[Press, ...]:
        """Return both sides, or under a plunger the body on its table."""
        return _straight_sides(self.kind, self.height_mm, self.radius_mm, plunger, plates)


@dataclass(frozen=True, kw_only=True)
class Block(_CheckedBody):
    """A rectangular block, solved as a cylinder of the area of its end.

    That is exact between slippery plates; of all ends of an area the round one is held most by plates that grip, which
    the share of friction holds.
    """

    kind: ClassVar[str] = "block"
    height_mm: float = quantity("mm", LENGTH, hint=_MEASURE)
    width_mm: float = quantity("mm", LENGTH, hint=_MEASURE)
    length_mm: float = quantity("mm", LENGTH, hint=_MEASURE)

    @property
    def end_area_mm2(self) -> float:
        """Return the area of an end [mm^2]."""
        return self.width_mm * self.length_mm

    @property
    def per_mm(self) -> float:
        """Return it of a bar: E goes with 1 / area [1]."""
        return 1.0 / self.width_mm + 1.0 / self.length_mm

    def sides(self, plunger: Plunger | None, plates: int) -> tuple[Press, ...]:
        """Return both sides; raises InputError under a plunger."""
        if plunger is not None:
            raise _not_solved(self.kind, "between plates")
        return _straight_sides(self.kind, self.height_mm, math.sqrt(self.end_area_mm2 / math.pi), plunger, plates)


def _round_press(section: RoundSection, exponent: float, plunger: Plunger | None) -> Press:
    """Return how a plate or a plunger presses a round body."""
    deepest = _DEEPEST * min(section.half_height, section.radius)
    if plunger is None:
        contact = math.sqrt(section.radius * deepest)
        return Press(section=section, deepest=deepest, contact=contact, exponent=exponent)
    deepest = min(deepest, plunger.deepest)
    relative = relative_radius(plunger.radius_mm, section.radius)
    contact = math.sqrt(relative * deepest)
    return Press(section=section, tool=plunger.tool, deepest=deepest, contact=contact, exponent=exponent)


def _straight_sides(kind: str, height: float, radius: float, plunger: Plunger | None, plates: int) -> tuple[Press, ...]:
    """Return how a cylinder on its end is pressed [mm]: by plates on both sides, or by a plunger on a table."""
    if plates == 1:
        raise _not_solved(kind, "on a plate: a flat end needs no seat")
    if plunger is None:
        section = StraightSection(half_height=0.5 * height, radius=radius)
        return (Press(section=section, deepest=_DEEPEST * 0.5 * height, contact=radius, exponent=_FLAT_CONTACT),) * 2
    if plunger.radius_mm > _WIDEST * radius:
        bound = f"at most {_WIDEST:g} of the radius of the body, {radius:g} mm"
        raise validation_error("plunger.radius_mm", plunger.radius_mm, "mm", bound, "say a plate where it is wider")
    section = StraightSection(half_height=height, radius=radius, on_table=True)
    deepest = min(_DEEPEST * height, plunger.deepest)
    contact = math.sqrt(plunger.radius_mm * deepest) if plunger.ball else plunger.radius_mm
    exponent = POINT_CONTACT if plunger.ball else _FLAT_CONTACT
    return (Press(section=section, tool=plunger.tool, deepest=deepest, contact=contact, exponent=exponent),)


def _not_solved(kind: str, bound: str) -> InputError:
    return validation_error("body", kind, "", bound, "this combination is not solved: take other tools")
