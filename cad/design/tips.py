"""The tips and how they are pressed on the fruit: lengths in mm, angles in degrees."""

import dataclasses
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

from cad.design.fruit import Fruit
from cad.quantity import LENGTH, Bounds, check_fields, choice, quantity, validation_error
from cad.tips.shapes import SHAPES, ShapeKeys, tip_shape
from cad.tips.tip_shape import TipShape

_LENGTH_OR_ZERO = Bounds(at_least=0.0, at_most=1000.0)
_SPREAD = Bounds(at_least=0.0, at_most=30.0)
_WIDEST_TILT = Bounds(at_least=-30.0, at_most=30.0)

Layout = Literal["pair", "line", "square"]
Order = Literal["LHL", "HLH"]
Spring = Literal["low", "high"]
Place = tuple[float, float]
Attitude = Literal["down", "side", "up"]
Socket = Literal["none", "pin"]
Strain = Literal["linear", "large"]
# Places of the tips in spacings, in the order of their names.
_PLACES: dict[Layout, tuple[Place, ...]] = {
    "pair": ((-0.5, 0.0), (0.5, 0.0)),
    "line": ((-1.0, 0.0), (0.0, 0.0), (1.0, 0.0)),
    "square": ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)),
}

_ORDERS: dict[Layout, str] = {"pair": "LH", "square": "LHLH"}
_SPRINGS: dict[str, Spring] = {"L": "low", "H": "high"}


@dataclass(frozen=True, kw_only=True)
class Tips(ShapeKeys):
    """The rigid tips on their springs; `side_mm` is the side of a square tip, the diameter of a round one.

    A pair stands on the length axis of the fruit, low spring first. A line is three in a row, `spacing_mm` from one to
    the next, in the given order of low and high springs; its outer tips stand out by `outer_mm` more. A square is four
    at (+-spacing / 2, +-spacing / 2), springs of one kind on each diagonal. The keys of each shape are in `cad/tips`.
    Tips are printed with the housing, or with the socket "pin" are ground steel pins glued into it.
    """

    layout: Layout = choice(("pair", "line", "square"), default="pair")
    order: Order | None = choice(("LHL", "HLH"), default=None)
    outer_mm: float | None = quantity("mm", _LENGTH_OR_ZERO, default=None, remedy="spacing^2 / (2 radius) on a sphere")
    shape: str = choice(tuple(SHAPES), default="cube")
    side_mm: float = quantity("mm", LENGTH, default=1.0, remedy="the paper's cube has 1")
    spacing_mm: float = quantity("mm", LENGTH, default=8.0, remedy="centre to centre, the paper has 8")
    offset_mm: float = quantity(
        "mm", Bounds(at_least=-1000.0, at_most=1000.0), default=0.0, remedy="midpoint of the tips from the apex"
    )
    gap_mm: float = quantity("mm", _LENGTH_OR_ZERO, default=0.5, remedy="tip face above the fruit before the press")
    socket: Socket = choice(("none", "pin"), default="none")

    def __post_init__(self) -> None:
        """Check each field, that the tips are apart and that keys belong to the layout and the shape."""
        check_fields(self, "tips")
        if self.spacing_mm <= self.side_mm:
            bound = f"greater than tips.side_mm = {self.side_mm:g} mm"
            raise validation_error("tips.spacing_mm", self.spacing_mm, "mm", bound, "the tips overlap, move them apart")
        self._check_line()
        tip_shape(self.shape, self.side_mm, self)

    def _check_line(self) -> None:
        if self.layout == "line" and self.order is None:
            raise validation_error("tips.order", None, "", "given for tips.layout = 'line'", "choose LHL or HLH")
        for name, value in (("tips.order", self.order), ("tips.outer_mm", self.outer_mm)):
            if value is not None and self.layout != "line":
                bound = f"left out for tips.layout = {self.layout!r}"
                raise validation_error(name, value, "", bound, "drop it, or take the layout it is for")

    @cached_property
    def tip_shape(self) -> TipShape:
        """Return the shape of each tip."""
        return tip_shape(self.shape, self.side_mm, self)

    @property
    def springs(self) -> tuple[Spring, ...]:
        """Return the kind of spring behind each tip, in the order of `places_mm`."""
        letters = self.order or _ORDERS[self.layout]
        return tuple(_SPRINGS[letter] for letter in letters)

    @property
    def kinds(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Return the indices of the tips on low and of those on high springs."""
        low, high = (tuple(i for i, spring in enumerate(self.springs) if spring == kind) for kind in _SPRINGS.values())
        return low, high

    def each(self, of_low: float, of_high: float) -> tuple[float, ...]:
        """Return for each tip the number that its kind of spring has, in that number's unit."""
        return tuple(of_low if i in self.kinds[0] else of_high for i in range(len(self.springs)))

    @property
    def names(self) -> tuple[str, ...]:
        """Return the name of each tip: its spring, with a number where there are two of a kind."""
        counts = [self.springs[: place + 1].count(spring) for place, spring in enumerate(self.springs)]
        alone = [self.springs.count(spring) == 1 for spring in self.springs]
        named = zip(self.springs, counts, alone, strict=True)
        return tuple(spring if single else f"{spring}_{count}" for spring, count, single in named)

    @property
    def places_mm(self) -> tuple[Place, ...]:
        """Return x and y of each tip from the apex of the fruit [mm]; a square is gone round from (-x, -y)."""
        return tuple((self.offset_mm + self.spacing_mm * x, self.spacing_mm * y) for x, y in _PLACES[self.layout])

    @property
    def centres_mm(self) -> tuple[float, ...]:
        """Return x of each tip from the apex of the fruit [mm]."""
        return tuple(x for x, _ in self.places_mm)

    @property
    def height_offset_mm(self) -> tuple[float, ...]:
        """Return how far each tip stands before the foremost ones by design [mm], at most 0."""
        outer = self.outer_mm or 0.0
        return (0.0, -outer, 0.0) if self.layout == "line" else (0.0,) * len(self.springs)

    @property
    def face_mm2(self) -> float:
        """Return the area of a tip's outline [mm^2]."""
        return self.tip_shape.area_mm2

    @property
    def as_pair(self) -> "Tips":
        """Return two of these tips, on a low and a high spring."""
        return dataclasses.replace(self, layout="pair", order=None, outer_mm=None)

    @property
    def flat(self) -> "Tips":
        """Return the tips with sharp flat faces of the same outline: those that size the springs."""
        sharp: dict[str, Any] = {key.name: key.default for key in dataclasses.fields(ShapeKeys)}
        return dataclasses.replace(self, shape=self.tip_shape.sized_as, **sharp)


@dataclass(frozen=True, kw_only=True)
class Press:
    """How the sensor is pressed on: travel from first touch, tilt along the tips, roll across them.

    `tilt_spread_deg` is how far the tilt of a press may be off, two sigma. `attitude` says where the tips point, which
    decides how the weight of the moving parts bends the springs. `strain` says whether the flesh counts as linear, or
    is solved at large strain as far as the tips go in.
    """

    travel_mm: float = quantity("mm", LENGTH, default=0.6, remedy="the paper presses 0.6")
    tilt_deg: float = quantity("deg", _WIDEST_TILT, default=0.0, remedy="positive lowers the high tip")
    tilt_spread_deg: float = quantity("deg", _SPREAD, default=1.0, remedy="a steady hand keeps 1")
    roll_deg: float = quantity("deg", _WIDEST_TILT, default=0.0, remedy="positive lowers the side y > 0 of each tip")
    attitude: Attitude = choice(("down", "side", "up"), default="side")
    strain: Strain = choice(("linear", "large"), default="linear")

    def __post_init__(self) -> None:
        """Check each field."""
        check_fields(self, "press")


def check_tips_on_fruit(fruit: Fruit, tips: Tips) -> None:
    """Raise InputError when a tip stands beyond the fruit."""
    remedy = "the tips stand beyond the fruit"
    free = fruit.length_mm - tips.side_mm - 2.0 * abs(tips.offset_mm)
    along, words = (0.5 * free, "half of fruit.length_mm") if tips.layout == "line" else (free, "fruit.length_mm")
    if tips.spacing_mm > along:
        bound = f"at most {words} - side - 2 |offset| = {along:g} mm"
        raise validation_error("tips.spacing_mm", tips.spacing_mm, "mm", bound, remedy)
    if tips.side_mm > fruit.width_mm:
        raise validation_error(
            "tips.side_mm", tips.side_mm, "mm", f"at most fruit.width_mm = {fruit.width_mm:g} mm", remedy
        )
    if tips.layout == "square" and tips.spacing_mm > fruit.width_mm - tips.side_mm:
        bound = f"at most fruit.width_mm - side = {fruit.width_mm - tips.side_mm:g} mm"
        raise validation_error("tips.spacing_mm", tips.spacing_mm, "mm", bound, remedy)
