"""Every number a person may choose, frozen and checked at construction: targets, fruit, tips, press, print.

Units: mm, N, MPa, degrees; a field whose name ends in N_per_m is in N/m. Defaults are the paper's sensor, as is
designs/paper.toml.
"""

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Literal

from cad.design.processes import PROCESSES
from cad.quantity import LENGTH, MODULUS, Bounds, check_fields, choice, fault, quantity
from cad.theory.strain_gauge import GAUGES
from cad.theory.two_spring_law import PAPER_SPRINGS, Definition

_STIFFNESS = Bounds(above=0.0, at_most=1e9)
_LENGTH_OR_ZERO = Bounds(at_least=0.0, at_most=1000.0)
_LONGEST_NAME = 64
_WIDEST_TILT = Bounds(at_least=-30.0, at_most=30.0)

FruitShape = Literal["block", "sphere", "ellipsoid"]
TipShape = Literal["cube", "cylinder", "sphere"]
Socket = Literal["none", "pin"]


@dataclass(frozen=True, kw_only=True)
class Targets:
    """What the sensor shall do: largest force ratio and nonlinearity."""

    P_max: float = quantity("1", Bounds(above=1.0, at_most=100.0), default=5.0, remedy="the paper uses 5")
    NL: float = quantity("1", Bounds(above=0.0, below=0.5), default=0.05, remedy="give a fraction, for 5 % write 0.05")
    NL_definition: Definition = choice(("mid-range", "largest"), default="mid-range")

    def __post_init__(self) -> None:
        """Check each field."""
        check_fields(self, "targets")


PAPER_TARGETS = Targets(P_max=5.0, NL=0.05)  # the paper's choice before (10), and its 5 % under (12)


@dataclass(frozen=True, kw_only=True)
class GivenSprings:
    """Springs to be judged instead of sized; both or neither."""

    K_l_N_per_m: float | None = quantity(
        "N/m", _STIFFNESS, default=None, remedy=f"the paper has {1e3 * PAPER_SPRINGS.K_l:g}"
    )
    K_h_N_per_m: float | None = quantity(
        "N/m", _STIFFNESS, default=None, remedy=f"the paper has {1e3 * PAPER_SPRINGS.K_h:g}"
    )

    def __post_init__(self) -> None:
        """Check each field, that both are given and that the low spring is the softer one."""
        check_fields(self, "springs")
        K_l, K_h = self.K_l_N_per_m, self.K_h_N_per_m
        if (K_l is None) != (K_h is None):
            names = ("springs.K_l_N_per_m", "springs.K_h_N_per_m")
            missing, partner = names if K_l is None else names[::-1]
            raise fault(missing, None, "", f"given together with {partner}", "give both or neither")
        if K_l is not None and K_h is not None and K_l >= K_h:
            bound = f"less than springs.K_h_N_per_m = {K_h:g} N/m"
            raise fault("springs.K_l_N_per_m", K_l, "N/m", bound, "the low spring is the softer one")

    @property
    def given(self) -> bool:
        """Say whether the design names its own springs."""
        return self.K_l_N_per_m is not None


@dataclass(frozen=True, kw_only=True)
class Fruit:
    """The fruit fixed at its base, tips on its top; length along the tips, width across, height along the press.

    A sphere or an ellipsoid is a piece of fruit of this length and width in plan, its apex in the middle of the top;
    `thickness_mm` is what lies under the apex, down to the stone or the table, and stands for the height, which
    serves where no thickness is given. `radius_mm` is the radius of curvature along the tips and half the
    height of the whole fruit, `radius_across_mm` the radius of curvature across (an ellipsoid's only).
    """

    shape: FruitShape = choice(("block", "sphere", "ellipsoid"), default="block")
    length_mm: float = quantity("mm", LENGTH, default=20.0, remedy="the paper's block has 20")
    width_mm: float = quantity("mm", LENGTH, default=20.0, remedy="the paper's block has 20")
    height_mm: float = quantity("mm", LENGTH, default=12.0, remedy="the paper's block has 12")
    radius_mm: float | None = quantity("mm", LENGTH, default=None, remedy="a mango has about 35")
    radius_across_mm: float | None = quantity("mm", LENGTH, default=None, remedy="a mango has about 35")
    thickness_mm: float | None = quantity("mm", LENGTH, default=None, remedy="flesh over a mango's stone has about 12")
    poisson: float = quantity("1", Bounds(above=-1.0, below=0.5), default=0.3, remedy="fruit flesh has 0.3 to 0.49")
    E_max_MPa: float = quantity("MPa", MODULUS, default=3.5, remedy="give the top of the range, 3.5 for mango")
    E_MPa: tuple[float, ...] = quantity(
        "MPa", MODULUS, default=(0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5), remedy="list the moduli to be shown"
    )
    bruise_limit_MPa: float | None = quantity("MPa", MODULUS, default=None, remedy="apple flesh fails at 0.29")

    def __post_init__(self) -> None:
        """Check each field, that the radii belong to the shape, and that the piece lies on the curved fruit."""
        check_fields(self, "fruit")
        wanted = {"block": (), "sphere": ("radius_mm",), "ellipsoid": ("radius_mm", "radius_across_mm")}[self.shape]
        for key in ("radius_mm", "radius_across_mm", "thickness_mm"):
            name, value = f"fruit.{key}", getattr(self, key)
            if value is None and key in wanted:
                raise fault(name, None, "", f"given for fruit.shape = {self.shape!r}", "give it in mm")
            if value is not None and key not in wanted and (key != "thickness_mm" or self.shape == "block"):
                bound = f"left out for fruit.shape = {self.shape!r}"
                raise fault(name, value, "mm", bound, "drop it, or choose the shape it is for")
        if self.radius_mm is not None:
            self._check_piece(self.radius_mm)

    def _check_piece(self, radius: float) -> None:
        if self.depth_mm > 2.0 * radius:
            bound = f"at most 2 fruit.radius_mm = {2.0 * radius:g} mm"
            raise fault(self.depth_key, self.depth_mm, "mm", bound, "the piece is thicker than the fruit")
        half_length, half_width = 0.5 * self.length_mm, 0.5 * self.width_mm
        if self.fall_mm(half_length, half_width) >= self.depth_mm:
            bound = "so small that the corners of the piece lie on the fruit, above its base"
            raise fault("fruit.length_mm", self.length_mm, "mm", bound, "take a smaller length and width")

    @property
    def depth_key(self) -> str:
        """Return the name of the key that `depth_mm` comes from."""
        return "fruit.height_mm" if self.thickness_mm is None else "fruit.thickness_mm"

    @property
    def depth_mm(self) -> float:
        """Return what lies under the apex: the height of a block, the thickness of a curved fruit [mm]."""
        return self.height_mm if self.thickness_mm is None else self.thickness_mm

    @property
    def equivalent_block(self) -> "Fruit":
        """Return the block of the same plan and thickness: the flat fruit that sizes the springs."""
        return dataclasses.replace(
            self, shape="block", height_mm=self.depth_mm, radius_mm=None, radius_across_mm=None, thickness_mm=None
        )

    def fall_mm(self, x: float, y: float) -> float:
        """Return how far the top of an ellipsoid lies below its apex at a place [mm]; infinity beyond the fruit."""
        if self.radius_mm is None:
            return 0.0
        across = self.radius_mm if self.radius_across_mm is None else self.radius_across_mm
        level = 1.0 - (x / self.radius_mm) ** 2 - y * y / (self.radius_mm * across)
        return self.radius_mm * (1.0 - math.sqrt(level)) if level >= 0.0 else math.inf


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
    """How the sensor is pressed on: travel from first touch, tilt along the tips, roll across them."""

    travel_mm: float = quantity("mm", LENGTH, default=0.6, remedy="the paper presses 0.6")
    tilt_deg: float = quantity("deg", _WIDEST_TILT, default=0.0, remedy="positive lowers the high tip")
    roll_deg: float = quantity("deg", _WIDEST_TILT, default=0.0, remedy="positive lowers the side y > 0 of each tip")

    def __post_init__(self) -> None:
        """Check each field."""
        check_fields(self, "press")


@dataclass(frozen=True, kw_only=True)
class Print:
    """How the housing is made, and which strain gauges are glued on its leaves."""

    process: str = choice(tuple(PROCESSES), default="fdm-petg")
    max_length_mm: float = quantity("mm", LENGTH, default=120.0, remedy="longest leaf that fits the machine")
    gauges: str = choice(tuple(GAUGES), default="none")

    def __post_init__(self) -> None:
        """Check each field."""
        check_fields(self, "print")


def check_tips_on_fruit(fruit: Fruit, tips: Tips) -> None:
    """Raise InputError when a tip stands beyond the fruit."""
    reach = tips.spacing_mm + tips.side_mm + 2.0 * abs(tips.offset_mm)
    remedy = "the tips stand beyond the fruit"
    if reach > fruit.length_mm:
        bound = f"at most fruit.length_mm - side - 2 |offset| = {fruit.length_mm - reach + tips.spacing_mm:g} mm"
        raise fault("tips.spacing_mm", tips.spacing_mm, "mm", bound, remedy)
    if tips.side_mm > fruit.width_mm:
        raise fault("tips.side_mm", tips.side_mm, "mm", f"at most fruit.width_mm = {fruit.width_mm:g} mm", remedy)


@dataclass(frozen=True, kw_only=True)
class Design:
    """A whole design: what `designs/*.toml` and `report.json` hold."""

    name: str = "paper"
    targets: Targets = field(default_factory=Targets)
    springs: GivenSprings = field(default_factory=GivenSprings)
    fruit: Fruit = field(default_factory=Fruit)
    tips: Tips = field(default_factory=Tips)
    press: Press = field(default_factory=Press)
    print: Print = field(default_factory=Print)

    def __post_init__(self) -> None:
        """Check what several tables decide together: the tips stand on the fruit, and press less than it is high."""
        allowed = self.name.replace("-", "").replace("_", "").isalnum() and self.name.isascii()
        if not allowed or len(self.name) > _LONGEST_NAME:
            bound = f"1 to {_LONGEST_NAME} letters, digits, - or _"
            raise fault("name", self.name, "", bound, "it names files and folders")
        check_tips_on_fruit(self.fruit, self.tips)
        depth = self.fruit.depth_mm
        if self.press.travel_mm >= depth:
            bound = f"less than {self.fruit.depth_key} = {depth:g} mm"
            raise fault("press.travel_mm", self.press.travel_mm, "mm", bound, "press less deep")

    @property
    def largest_E_MPa(self) -> float:
        """Return the largest modulus that is shown, which may lie beyond E_max [MPa]."""
        return max(self.fruit.E_max_MPa, *self.fruit.E_MPa)

    @property
    def has_paper_scene(self) -> bool:
        """Say whether fruit and tips are the paper's, whatever moduli are shown and however it is pressed."""
        fruit = dataclasses.replace(self.fruit, E_MPa=Fruit().E_MPa, bruise_limit_MPa=None)
        tips = dataclasses.replace(self.tips, gap_mm=Tips().gap_mm, socket="none")
        return (fruit, tips) == (Fruit(), Tips())

    @property
    def full_travels_mm(self) -> tuple[float, float]:
        """Return how far the low and the high tip travel at full press [mm]; negative for one that stays off."""
        step = 0.5 * self.tips.spacing_mm * math.tan(math.radians(self.press.tilt_deg))
        return self.press.travel_mm - step, self.press.travel_mm + step


TABLES = tuple(item.name for item in dataclasses.fields(Design) if item.name != "name")
