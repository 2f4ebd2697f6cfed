"""A tip that ends in a cone, whose apex is sharp or rounded."""

import math
from dataclasses import dataclass
from typing import ClassVar

from sensor.quantity import Bounds, quantity, validation_error
from sensor.theory.hertz import contact_radius, relative_radius
from sensor.theory.sneddon_cone import cone_mean_pressure
from sensor.tips.tip_shape import LEAST_PIECE_MM, Meridian, MeridianPoint, Straight, TipShape, arc

# Contact is solved for small slopes, so the flank must not be steeper than 45 deg. A cone flatter than 89 deg would be
# practically a flat face.
_HALF_ANGLE = Bounds(at_least=45.0, at_most=89.0)


@dataclass(frozen=True, kw_only=True)
class ConeKeys:
    """The keys in [tips] that only cones have."""

    half_angle_deg: float | None = quantity(
        "deg",
        _HALF_ANGLE,
        default=None,
        hint="an indenter often has 70.3",
        meaning="angle between axis and flank of a cone",
    )
    blunt_mm: float | None = quantity(
        "mm",
        Bounds(at_least=0.0, at_most=1000.0),
        default=None,
        hint="give the radius of the point, 0 for a sharp one",
        meaning="radius of the spherical end of a blunt cone; left out for a sharp one",
    )


@dataclass(frozen=True, kw_only=True)
class Cone(TipShape):
    """A cone of diameter `side_mm`, with the angle `half_angle_deg` between its axis and its flank.

    The apex is rounded to a sphere of radius `blunt_mm` that is tangent to the flank.
    """

    name: ClassVar[str] = "cone"

    half_angle_deg: float
    blunt_mm: float = 0.0

    def __post_init__(self) -> None:
        """Raise InputError if the spherical point is so large that no flank remains."""
        if self._ball_edge_mm > 0.5 * self.side_mm - LEAST_PIECE_MM:
            largest = 0.5 * self.side_mm / math.cos(math.radians(self.half_angle_deg))
            bound = f"less than tips.side_mm / (2 cos(tips.half_angle_deg)) = {largest:g} mm"
            raise validation_error("tips.blunt_mm", self.blunt_mm, "mm", bound, "make it sharper, or use a dome")

    @property
    def _ball_edge_mm(self) -> float:
        """Return the distance from the axis at which the sphere meets the flank [mm]."""
        return self.blunt_mm * math.cos(math.radians(self.half_angle_deg))

    @property
    def meridian(self) -> Meridian:
        """Return the arc of the spherical point, unless the cone is sharp, and the flank."""
        half = 0.5 * self.side_mm
        ball = (arc(0.0, self._ball_edge_mm, 0.0, self.blunt_mm),) if self.blunt_mm > 0.0 else ()
        start = ball[-1].end if ball else MeridianPoint(0.0, 0.0)
        rim = MeridianPoint(half, start.z + (half - start.r) / math.tan(math.radians(self.half_angle_deg)))
        return (*ball, Straight(start, rim))

    @property
    def sized_as(self) -> str:
        """Return the name of the cylinder, which has the same outline."""
        return "cylinder"

    def contact_area_mm2(self, force: float, reduced_modulus: float, fruit_radius: float) -> float:
        """Return the contact area [mm^2] under a force [N].

        If only the spherical point touches, the area of the contact circle according to Hertz is returned. Otherwise,
        the contact area of a sharp cone according to Sneddon is returned. `reduced_modulus` is E / (1 - nu^2) of the
        fruit [MPa], and `fruit_radius` is its radius [mm].
        """
        if self.blunt_mm > 0.0:
            # A Poisson's ratio of 0 is passed, because the reduced modulus includes the effect of Poisson's ratio.
            radius = contact_radius(force, reduced_modulus, 0.0, relative_radius(self.blunt_mm, fruit_radius))
            if radius <= self._ball_edge_mm:  # the contact does not reach the flank
                return math.pi * radius**2
        return force / cone_mean_pressure(self.half_angle_deg, reduced_modulus)
