"""The tips and how they are pressed on the fruit: lengths in mm, angles in degrees."""

import dataclasses
import math
from dataclasses import dataclass
from typing import Literal

from cad.design.fruit import Fruit
from cad.quantity import LENGTH, Bounds, check_fields, choice, fault, quantity

_LENGTH_OR_ZERO = Bounds(at_least=0.0, at_most=1000.0)
_SPREAD = Bounds(at_least=0.0, at_most=30.0)
_WIDEST_TILT = Bounds(at_least=-30.0, at_most=30.0)

TipShape = Literal["cube", "cylinder", "sphere"]
Attitude = Literal["down", "side", "up"]
Socket = Literal["none", "pin"]


@dataclass(frozen=True, kw_only=True)
class Tips:
    """The two rigid tips, on the length axis of the fruit; `side_mm` is the diameter of a cylinder or a sphere.

    They are printed with the housing, or with the socket "pin" are ground steel pins glued into it.
    """

    shape: TipShape = choice(("cube", "cylinder", "sphere"), default="cube")
    side_mm: float = quantity("mm", LENGTH, default=1.0, remedy="the paper's cube has 1")
    fillet_mm: float = quantity("mm", _LENGTH_OR_ZERO, default=0.0, remedy="rounding of the edge of the face")
    spacing_mm: float = quantity("mm", LENGTH, default=8.0, remedy="centre to centre, the paper has 8")
    offset_mm: float = quantity(
        "mm", Bounds(at_least=-1000.0, at_most=1000.0), default=0.0, remedy="midpoint of the tips from the apex"
    )
    gap_mm: float = quantity("mm", _LENGTH_OR_ZERO, default=0.5, remedy="tip face above the fruit before the press")
    socket: Socket = choice(("none", "pin"), default="none")

    def __post_init__(self) -> None:
        """Check each field, that the tips are apart and that a fillet leaves a face."""
        check_fields(self, "tips")
        if self.spacing_mm <= self.side_mm:
            bound = f"greater than tips.side_mm = {self.side_mm:g} mm"
            raise fault("tips.spacing_mm", self.spacing_mm, "mm", bound, "the tips overlap, move them apart")
        if self.shape == "sphere" and self.fillet_mm != 0.0:
            raise fault("tips.fillet_mm", self.fillet_mm, "mm", "0 for tips.shape = 'sphere'", "a sphere has no edge")
        if self.fillet_mm >= 0.5 * self.side_mm:
            bound = f"less than tips.side_mm / 2 = {0.5 * self.side_mm:g} mm"
            raise fault("tips.fillet_mm", self.fillet_mm, "mm", bound, "leave a flat face, or take a sphere")

    @property
    def centres_mm(self) -> tuple[float, float]:
        """Return x of the low and of the high tip from the apex of the fruit [mm]."""
        return self.offset_mm - 0.5 * self.spacing_mm, self.offset_mm + 0.5 * self.spacing_mm

    @property
    def face_mm2(self) -> float:
        """Return the area of a tip's outline [mm^2]."""
        return self.side_mm**2 * (1.0 if self.shape == "cube" else math.pi / 4.0)

    @property
    def flat(self) -> "Tips":
        """Return the tips with sharp flat faces of the same outline: those that size the springs."""
        shape: TipShape = "cylinder" if self.shape == "sphere" else self.shape
        return dataclasses.replace(self, shape=shape, fillet_mm=0.0)


@dataclass(frozen=True, kw_only=True)
class Press:
    """How the sensor is pressed on: travel from first touch, tilt along the tips, roll across them.

    `tilt_spread_deg` is how far the tilt of a press may be off, two sigma. `attitude` says where the tips point, which
    decides how the weight of the moving parts bends the springs.
    """

    travel_mm: float = quantity("mm", LENGTH, default=0.6, remedy="the paper presses 0.6")
    tilt_deg: float = quantity("deg", _WIDEST_TILT, default=0.0, remedy="positive lowers the high tip")
    tilt_spread_deg: float = quantity("deg", _SPREAD, default=1.0, remedy="a steady hand keeps 1")
    roll_deg: float = quantity("deg", _WIDEST_TILT, default=0.0, remedy="positive lowers the side y > 0 of each tip")
    attitude: Attitude = choice(("down", "side", "up"), default="side")

    def __post_init__(self) -> None:
        """Check each field."""
        check_fields(self, "press")


def check_tips_on_fruit(fruit: Fruit, tips: Tips) -> None:
    """Raise InputError when a tip stands beyond the fruit."""
    reach = tips.spacing_mm + tips.side_mm + 2.0 * abs(tips.offset_mm)
    remedy = "the tips stand beyond the fruit"
    if reach > fruit.length_mm:
        bound = f"at most fruit.length_mm - side - 2 |offset| = {fruit.length_mm - reach + tips.spacing_mm:g} mm"
        raise fault("tips.spacing_mm", tips.spacing_mm, "mm", bound, remedy)
    if tips.side_mm > fruit.width_mm:
        raise fault("tips.side_mm", tips.side_mm, "mm", f"at most fruit.width_mm = {fruit.width_mm:g} mm", remedy)
