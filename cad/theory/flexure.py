"""The dimensions of one flexure: two parallel leaves that guide a platform."""

from dataclasses import dataclass

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
