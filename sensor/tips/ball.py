"""Tips that end in a spherical surface: a hemisphere, and a dome, which is a shallow spherical cap."""

import math
from dataclasses import dataclass
from typing import ClassVar

from sensor.quantity import LENGTH, quantity, validation_error
from sensor.theory.hertz import contact_radius, relative_radius
from sensor.tips.tip_shape import Meridian, TipShape, arc


@dataclass(frozen=True, kw_only=True)
class DomeKeys:
    """The keys in [tips] that only domes have."""

    dome_radius_mm: float | None = quantity(
        "mm", LENGTH, default=None, hint="a gentle dome has 10", meaning="radius of the cap of a dome"
    )


@dataclass(frozen=True, kw_only=True)
class Sphere(TipShape):
    """A hemisphere of diameter `side_mm`. Its contact is solved on cells, because it indents deeply for its size."""

    name: ClassVar[str] = "sphere"

    @property
    def radius_mm(self) -> float:
        """Return the radius of the sphere [mm]."""
        return 0.5 * self.side_mm

    @property
    def meridian(self) -> Meridian:
        """Return the arc of the hemisphere, from the axis to the rim."""
        return (arc(0.0, 0.5 * self.side_mm, 0.0, self.radius_mm),)

    @property
    def sized_as(self) -> str:
        """Return the name of the cylinder, which has the same outline."""
        return "cylinder"

    def contact_area_mm2(self, force: float, reduced_modulus: float, fruit_radius: float) -> float:
        """Return the area of the Hertzian contact circle [mm^2] under a force [N].

        `reduced_modulus` is E / (1 - nu^2) of the fruit [MPa], and `fruit_radius` is its radius [mm].
        """
        radius = relative_radius(self.radius_mm, fruit_radius)
        # A Poisson's ratio of 0 is passed, because the reduced modulus includes the effect of Poisson's ratio.
        return math.pi * contact_radius(force, reduced_modulus, 0.0, radius) ** 2


@dataclass(frozen=True, kw_only=True)
class Dome(Sphere):
    """A cap with a base of diameter `side_mm`, cut from a sphere of radius `dome_radius_mm`."""

    name: ClassVar[str] = "dome"
    obeys_hertz: ClassVar[bool] = True
    touches_beside_centre: ClassVar[bool] = True
    pressure_exponent: ClassVar[float] = 0.5  # by Hertz, force ~ travel^1.5 and contact area ~ travel

    dome_radius_mm: float

    def __post_init__(self) -> None:
        """Raise InputError if the face is wider than the sphere."""
        if self.side_mm > 2.0 * self.dome_radius_mm:
            bound = f"at most 2 tips.dome_radius_mm = {2.0 * self.dome_radius_mm:g} mm"
            raise validation_error(
                "tips.side_mm", self.side_mm, "mm", bound, "use a larger dome radius, or a narrower face"
            )

    @property
    def radius_mm(self) -> float:
        """Return the radius of the sphere [mm]."""
        return self.dome_radius_mm

    @property
    def is_printed(self) -> bool:
        """Return whether the tip is printed with the housing, which is true for every dome."""
        return True
