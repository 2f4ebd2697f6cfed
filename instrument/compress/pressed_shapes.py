"""Shapes of bodies in a compression test; each body defines how the tools press its sides."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple

from sensor.quantity import LENGTH, check_fields, quantity, validation_error
from sensor.theory.hertz import equivalent_radius, relative_radius
from solve.compression.force_curve import CompressionPress
from solve.compression.half_body import Section
from solve.compression.tool import Tool

# Exponents n of the force law F ~ D^n at small depths D.
POINT_CONTACT = 1.5  # Hertz's law, valid for every convex body
_LINE_CONTACT = 1.0  # apart from a logarithm, which the fitted force curve represents
_FLAT_CONTACT = 1.0
# Largest depths that are solved.
_DEEPEST = 0.15  # relative to the half height or the radius, whichever is smaller; most fruit fails at smaller depths
_DEEPEST_BALL = 0.1  # relative to the radius of a ball plunger; at larger depths some flesh laws have no equilibrium
_DEEPEST_FLAT = 0.3  # relative to the radius of a flat plunger
_WIDEST = 0.8  # largest ratio of plunger radius to body radius; with a wider plunger the flesh shears off at the edge
_MEASURE = "measure it on the fruit"


@dataclass(frozen=True, kw_only=True)
class Plunger:
    """A plunger that presses from above: a rod with a flat end or with a ball.

    Parameters
    ----------
    radius_mm : float
        Radius of the rod, or of the ball [mm].
    ball : bool, optional
        Whether the end is a ball.

    Raises
    ------
    InputError
        If the radius is outside its bounds.

    Examples
    --------
    >>> twintip.Plunger(radius_mm=4.0).ball
    False
    """

    radius_mm: float = quantity("mm", LENGTH, hint="measure the plunger")
    ball: bool = False

    def __post_init__(self) -> None:
        """Check the size; raises InputError."""
        check_fields(self, "plunger")

    @property
    def tool(self) -> Tool:
        """Return the rigid face of the plunger."""
        return Tool(curvature=1.0 / self.radius_mm if self.ball else 0.0, edge=self.radius_mm)

    @property
    def deepest(self) -> float:
        """Return the largest depth [mm] that is solved."""
        return self.radius_mm * (_DEEPEST_BALL if self.ball else _DEEPEST_FLAT)


class BoundingPress(NamedTuple):
    """A press whose force, multiplied by `factor` [1], bounds the force on one side of the real body."""

    press: CompressionPress
    factor: float


@dataclass(frozen=True, kw_only=True)
class CompressedBody:
    """A body pressed by a plate or a plunger, on a plate or in a rigid seat."""

    kind: ClassVar[str]
    takes_plunger: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Check the sizes; raises InputError."""
        check_fields(self, "modulus")

    @property
    def section(self) -> Section:
        """Return the cross-section on which a compression between plates is solved."""
        raise NotImplementedError

    @property
    def per_mm(self) -> float:
        """Return the relative decrease of the modulus per mm of increase in every radius or width [1/mm]."""
        raise NotImplementedError

    @property
    def end_area_mm2(self) -> float | None:
        """Return the area of the flat end [mm^2]; None if the body is round."""
        section = self.section
        return None if section.is_round else math.pi * section.radius**2

    def sides(self, plunger: Plunger | None, plates: int) -> tuple[CompressionPress, ...]:
        """Return one press for each side of the body that deforms, the upper side first.

        If `plunger` is None, a plate presses from above. `plates` is 1 for a body in a rigid seat, whose lower side
        does not deform, and 2 otherwise. Raises InputError for an unsupported combination of body and tools.
        """
        section = self.section
        has_unsuitable_plunger = plunger is not None and not self.takes_plunger
        has_unsuitable_seat = plates == 1 and not section.is_round
        if has_unsuitable_plunger or has_unsuitable_seat:
            bound = "between plates, or with a plunger or seat that docs/modulus.md lists for it"
            raise validation_error("body", self.kind, "", bound, "choose other tools, because these are not supported")
        presses = _round_presses(section, plunger) if section.is_round else _presses_on_end(section, plunger)
        return presses[:plates]  # in a seat, only the upper side

    def hertz_radii(self, plunger: Plunger | None, plates: int) -> tuple[float, ...]:  # noqa: ARG002 - used by a subclass
        """Return the relative radius of each point contact [mm]; empty if Hertz's law does not apply."""
        return (plunger.radius_mm,) if plunger is not None and plunger.ball else ()

    def bounds(self, sides: Sequence[CompressionPress]) -> Mapping[str, Sequence[Sequence[BoundingPress]]]:  # noqa: ARG002 - used by subclasses
        """Return bounds for each simplification of the body, keyed by its name; this class makes none.

        `sides` are the presses on the body. Each bound consists of one press for each side.
        """
        return {}


@dataclass(frozen=True, kw_only=True)
class Ellipsoid(CompressedBody):
    """A ball, an ellipsoid or another convex fruit, with two radii of curvature at each contact.

    The radii at the upper and the lower contact are equal.

    Parameters
    ----------
    height_mm : float
        Height between the plates [mm].
    radius_mm : float
        Radius of curvature at the contact in one vertical plane [mm].
    radius_across_mm : float
        Radius of curvature at the contact in the perpendicular vertical plane [mm].

    Raises
    ------
    InputError
        If a length is outside its bounds.

    Examples
    --------
    >>> fruit = twintip.Ellipsoid(height_mm=70.0, radius_mm=35.0, radius_across_mm=35.0)
    >>> fruit.height_mm
    70.0
    """

    kind: ClassVar[str] = "ellipsoid"
    height_mm: float = quantity("mm", LENGTH, hint=_MEASURE)
    radius_mm: float = quantity("mm", LENGTH, hint=_MEASURE)
    radius_across_mm: float = quantity("mm", LENGTH, hint=_MEASURE)

    @property
    def section(self) -> Section:
        """Return the cross-section of a body of revolution, whose radius is the equivalent radius of the two radii."""
        radius = equivalent_radius(self.radius_mm, self.radius_across_mm)
        return Section(half_height=0.5 * self.height_mm, radius=radius)

    @property
    def per_mm(self) -> float:
        """Return the relative decrease of the modulus per mm of radius R [1/mm], where E ~ 1 / sqrt(R) (Hertz)."""
        return 0.5 / self.radius_mm

    def hertz_radii(self, plunger: Plunger | None, plates: int) -> tuple[float, ...]:
        """Return the relative radii of the upper and the lower point contact [mm]; empty with a flat plunger."""
        radius = self.section.radius
        if plunger is None:
            return (radius,) * plates
        if not plunger.ball:
            return ()
        return (relative_radius(plunger.radius_mm, radius), radius)[:plates]

    def bounds(self, sides: Sequence[CompressionPress]) -> Mapping[str, Sequence[Sequence[BoundingPress]]]:
        """Return bounds for two different radii: bodies of revolution with one or the other radius, between plates.

        `sides` are the presses on the body, the lower side last. The factors make the bounds agree with the ellipsoid
        at small depths, where the force is proportional to the square root of the radius (Hertz). A side under a
        plunger is unchanged. There are no bounds if the radii are equal, or if only a plunger presses the body.
        """
        plate = Tool()  # the default tool is a plate
        if self.radius_mm == self.radius_across_mm or sides[-1].tool != plate:
            return {}
        bounds = []
        for radius in (self.radius_mm, self.radius_across_mm):
            section = replace(self.section, radius=radius)
            factor = math.sqrt(self.section.radius / radius)
            plate_bound = BoundingPress(replace(sides[-1], section=section), factor)
            bounds.append([plate_bound if side.tool == plate else BoundingPress(side, 1.0) for side in sides])
        return {"two radii": bounds}


@dataclass(frozen=True, kw_only=True)
class CylinderOnSide(CompressedBody):
    """A cylinder that lies on its side between plates, in plane strain except at its free ends.

    Parameters
    ----------
    radius_mm : float
        Radius [mm].
    length_mm : float
        Length along the plates [mm].

    Raises
    ------
    InputError
        If a length is outside its bounds.

    Examples
    --------
    >>> twintip.CylinderOnSide(radius_mm=7.5, length_mm=30.0).length_mm
    30.0
    """

    kind: ClassVar[str] = "cylinder-side"
    takes_plunger: ClassVar[bool] = False
    radius_mm: float = quantity("mm", LENGTH, hint=_MEASURE)
    length_mm: float = quantity("mm", LENGTH, hint=_MEASURE)

    @property
    def section(self) -> Section:
        """Return the circular cross-section, which is solved in plane strain."""
        return Section(half_height=self.radius_mm, radius=self.radius_mm, length=self.length_mm)

    @property
    def per_mm(self) -> float:
        """Return the relative decrease of the modulus per mm of contact length [1/mm], where E ~ 1 / length."""
        return 1.0 / self.length_mm

    def bounds(self, sides: Sequence[CompressionPress]) -> Mapping[str, Sequence[Sequence[BoundingPress]]]:
        """Return the only bound, which accounts for the free ends.

        The bound assumes plane stress over a length of one radius at each end. In plane stress, the force is 1 - nu^2
        times the force in plane strain.
        """
        end_fraction = min(1.0, 2.0 * self.radius_mm / self.length_mm)  # both ends, as a fraction of the length
        return {"free ends": [[BoundingPress(side, 1.0 - end_fraction * side.law.poisson**2) for side in sides]]}


@dataclass(frozen=True, kw_only=True)
class CylinderOnEnd(CompressedBody):
    """A cylinder compressed along its axis, such as a plug from a cork borer.

    Parameters
    ----------
    height_mm : float
        Height between the plates [mm].
    radius_mm : float
        Radius [mm].

    Raises
    ------
    InputError
        If a length is outside its bounds.

    Examples
    --------
    >>> twintip.CylinderOnEnd(height_mm=10.0, radius_mm=7.5).radius_mm
    7.5
    """

    kind: ClassVar[str] = "cylinder-end"
    height_mm: float = quantity("mm", LENGTH, hint=_MEASURE)
    radius_mm: float = quantity("mm", LENGTH, hint=_MEASURE)

    @property
    def section(self) -> Section:
        """Return the rectangular section through the axis of the cylinder."""
        return Section(half_height=0.5 * self.height_mm, radius=self.radius_mm, is_round=False)

    @property
    def per_mm(self) -> float:
        """Return the relative decrease of the modulus per mm of radius [1/mm], where E ~ 1 / area."""
        return 2.0 / self.radius_mm


@dataclass(frozen=True, kw_only=True)
class RectangularBlock(CompressedBody):
    """A rectangular block, which is solved as a cylinder with the same end area.

    The equivalent cylinder is exact between frictionless plates. Plates without slip restrain a round end more than any
    other end of the same area. The error share of friction covers this difference.

    Parameters
    ----------
    height_mm : float
        Height between the plates [mm].
    width_mm : float
        Width of the end face [mm].
    length_mm : float
        Length of the end face [mm].

    Raises
    ------
    InputError
        If a length is outside its bounds.

    Examples
    --------
    >>> twintip.RectangularBlock(height_mm=10.0, width_mm=15.0, length_mm=20.0).width_mm
    15.0
    """

    kind: ClassVar[str] = "block"
    takes_plunger: ClassVar[bool] = False
    height_mm: float = quantity("mm", LENGTH, hint=_MEASURE)
    width_mm: float = quantity("mm", LENGTH, hint=_MEASURE)
    length_mm: float = quantity("mm", LENGTH, hint=_MEASURE)

    @property
    def end_area_mm2(self) -> float:
        """Return the area of an end [mm^2]."""
        return self.width_mm * self.length_mm

    @property
    def section(self) -> Section:
        """Return the rectangular section through the axis of the equivalent cylinder."""
        radius = math.sqrt(self.end_area_mm2 / math.pi)
        return Section(half_height=0.5 * self.height_mm, radius=radius, is_round=False)

    @property
    def per_mm(self) -> float:
        """Return the relative decrease of the modulus per mm of width and length [1/mm], where E ~ 1 / area."""
        return 1.0 / self.width_mm + 1.0 / self.length_mm


KINDS: Mapping[str, type[CompressedBody]] = {
    "ball": Ellipsoid,
    "ellipsoid": Ellipsoid,
    "cylinder-end": CylinderOnEnd,
    "cylinder-side": CylinderOnSide,
    "block": RectangularBlock,
}
"""The class of each body, keyed by its name in `--body`. Each field of a class is a size that a flag sets."""


def _round_presses(section: Section, plunger: Plunger | None) -> tuple[CompressionPress, ...]:
    """Return the presses on a round body: by a plate or a plunger from above, and by a plate from below.

    `section` is the cross-section of the body; `plunger` is None between two plates.
    """
    deepest = _DEEPEST * min(section.half_height, section.radius)
    contact = math.sqrt(section.radius * deepest)  # contact radius [mm] by Hertz's law
    exponent = POINT_CONTACT if section.length is None else _LINE_CONTACT  # only a lying cylinder has a length
    by_plate = CompressionPress(section=section, deepest=deepest, contact=contact, exponent=exponent)
    if plunger is None:
        return by_plate, by_plate
    plunger_depth = min(deepest, plunger.deepest)
    plunger_contact = math.sqrt(relative_radius(plunger.radius_mm, section.radius) * plunger_depth)
    by_plunger = replace(by_plate, tool=plunger.tool, deepest=plunger_depth, contact=plunger_contact)
    return by_plunger, by_plate


def _presses_on_end(section: Section, plunger: Plunger | None) -> tuple[CompressionPress, ...]:
    """Return the presses on a cylinder that stands on its end, by two plates or by a plunger from above.

    `section` is the section through the axis of the cylinder. Each plate presses one half of the height. A plunger
    presses the whole height in a single press, because the cylinder then stands on a table. Raises InputError for a
    plunger that is too wide.
    """
    radius = section.radius
    if plunger is None:
        deepest = _DEEPEST * section.half_height
        by_plate = CompressionPress(section=section, deepest=deepest, contact=radius, exponent=_FLAT_CONTACT)
        return by_plate, by_plate
    if plunger.radius_mm > _WIDEST * radius:
        bound = f"at most {_WIDEST:g} of the radius of the body, {radius:g} mm"
        hint = "leave out a wider plunger, because it acts as a plate"
        raise validation_error("plunger.radius_mm", plunger.radius_mm, "mm", bound, hint)
    height = 2.0 * section.half_height
    deepest = min(_DEEPEST * height, plunger.deepest)
    if plunger.ball:
        contact = math.sqrt(plunger.radius_mm * deepest)  # contact radius [mm] by Hertz's law
        exponent = POINT_CONTACT
    else:
        contact = plunger.radius_mm
        exponent = _FLAT_CONTACT
    by_plunger = CompressionPress(
        section=replace(section, half_height=height, on_table=True),
        tool=plunger.tool,
        deepest=deepest,
        contact=contact,
        exponent=exponent,
    )
    return (by_plunger,)
