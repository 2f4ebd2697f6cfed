"""Tips with a square or a round flat face, whose edge may be rounded."""

from dataclasses import dataclass
from typing import ClassVar

from sensor.quantity import Bounds, quantity, validation_error
from sensor.tips.tip_shape import LEAST_PIECE_MM, Meridian, MeridianPoint, Straight, TipShape, arc


@dataclass(frozen=True, kw_only=True)
class FlatKeys:
    """The keys in [tips] that only flat tips have."""

    fillet_mm: float = quantity(
        "mm",
        Bounds(at_least=0.0, at_most=1000.0),
        default=0.0,
        hint="give the radius of the edge of the face",
        meaning="radius of the rounded edge of the face",
    )


@dataclass(frozen=True, kw_only=True)
class FlatTip(TipShape):
    """A tip with a flat face, whose edge has a fillet of radius `fillet_mm`."""

    has_flat_face: ClassVar[bool] = True

    fillet_mm: float = 0.0

    def __post_init__(self) -> None:
        """Raise InputError if the fillet, or the flat face inside it, is too small to be modelled."""
        largest = 0.5 * self.side_mm - LEAST_PIECE_MM
        if self.fillet_mm and not LEAST_PIECE_MM <= self.fillet_mm <= largest:
            half = f"tips.side_mm / 2 = {0.5 * self.side_mm:g} mm"
            bound = f"0, or at least {LEAST_PIECE_MM:g} mm and as much less than {half}"
            raise validation_error("tips.fillet_mm", self.fillet_mm, "mm", bound, "leave a flat face, or use a sphere")

    @property
    def meridian(self) -> Meridian:
        """Return the flat face and, if the edge is rounded, its quarter circle."""
        half = 0.5 * self.side_mm
        fillet = self.fillet_mm
        face = Straight(MeridianPoint(0.0, 0.0), MeridianPoint(half - fillet, 0.0))
        return (face, arc(half - fillet, half, half - fillet, fillet)) if fillet > 0.0 else (face,)

    @property
    def sized_as(self) -> str:
        """Return the name of this shape, because it is sharp and flat without its fillet."""
        return self.name

    def contact_area_mm2(self, force: float, reduced_modulus: float, fruit_radius: float) -> float:  # noqa: ARG002
        """Return the area of the whole face [mm^2]; a flat face touches completely under any force."""
        return self.area_mm2


@dataclass(frozen=True, kw_only=True)
class Cube(FlatTip):
    """A flat tip with a square face."""

    name: ClassVar[str] = "cube"
    is_round: ClassVar[bool] = False

    @property
    def is_printed(self) -> bool:
        """Return whether the tip is printed with the housing, which requires sharp edges."""
        return self.is_flat


@dataclass(frozen=True, kw_only=True)
class Cylinder(FlatTip):
    """A flat tip with a round face."""

    name: ClassVar[str] = "cylinder"
