"""The dimensions of one flexure: two parallel leaves that guide a platform."""

from dataclasses import dataclass

from cad.blade import pair_length, pair_stiffness
from cad.quantity import Bounds, check_fields, fault, quantity

_POSITIVE = Bounds(above=0.0)
_REMEDY = "choose another process or other targets"


@dataclass(frozen=True, kw_only=True)
class Flexure:
    """Two leaves of length L between fillets' outer ends, thickness t, depth w, one separation apart [mm]."""

    thickness: float = quantity("mm", _POSITIVE, remedy=_REMEDY)
    length: float = quantity("mm", _POSITIVE, remedy=_REMEDY)
    depth: float = quantity("mm", _POSITIVE, remedy=_REMEDY)
    separation: float = quantity("mm", _POSITIVE, remedy=_REMEDY)
    fillet: float = quantity("mm", _POSITIVE, remedy=_REMEDY)

    def __post_init__(self) -> None:
        """Check each field, and that the fillets leave a straight leaf and a window between the leaves."""
        check_fields(self, "flexure")
        if self.length <= 2.0 * self.fillet:
            bound = f"greater than 2 fillets = {2.0 * self.fillet:g} mm"
            raise fault("flexure.length", self.length, "mm", bound, _REMEDY)
        if self.separation <= self.thickness + 2.0 * self.fillet:
            bound = f"greater than thickness + 2 fillets = {self.thickness + 2.0 * self.fillet:g} mm"
            raise fault("flexure.separation", self.separation, "mm", bound, _REMEDY)

    def beam_stiffness(self, E: float) -> float:
        """Return the guided-beam stiffness [N/mm from MPa]; the printed flexure differs by 5 to 15 %."""
        return pair_stiffness(E, self.depth, self.thickness, self.length)


def beam_length(E: float, depth: float, thickness: float, stiffness: float) -> float:
    """Return the guided-beam leaf length rounded to what is drawn, 0.001 mm."""
    return round(pair_length(E, depth, thickness, stiffness), 3)
