"""The tips, and the motion of the sensor that presses them against the fruit. Lengths are in mm, angles in degrees."""

import dataclasses
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

from sensor.design.fruit import Fruit
from sensor.quantity import DURATION, LENGTH, Bounds, check_fields, choice, quantity, validation_error
from sensor.tips.layouts import LAYOUTS, ORDERS, PAIR, SPRINGS, Layout, Position, Spring, SpringGroups
from sensor.tips.shapes import SHAPES, ShapeKeys, tip_shape
from sensor.tips.tip_shape import TipShape

_LENGTH_OR_ZERO = Bounds(at_least=0.0, at_most=1000.0)
_SPREAD = Bounds(at_least=0.0, at_most=30.0)
_SPEED = Bounds(at_least=1e-4, at_most=1000.0)
_WIDEST_TILT = Bounds(at_least=-30.0, at_most=30.0)

Attitude = Literal["down", "side", "up"]
Socket = Literal["none", "pin"]


@dataclass(frozen=True, kw_only=True)
class Tips(ShapeKeys):
    """The rigid tips on their springs. `side_mm` is the side of a square tip, or the diameter of a round tip.

    A pair lies on the length axis of the fruit, with the low spring first. A line has three tips in a row, `spacing_mm`
    apart, with low and high springs in the order of `order`. Its outer tips protrude by `outer_mm`. A square has four
    tips at (+-spacing / 2, +-spacing / 2), with springs of one kind on each diagonal. The keys of each shape are
    declared in `sensor/tips`. Tips are printed with the housing. With the socket "pin", they are ground steel pins that
    are glued into it.
    """

    layout: str = choice(
        tuple(LAYOUTS),
        default="pair",
        meaning=(
            "a pair of two tips, a line of three tips, or a square of four with springs of one kind on each diagonal"
        ),
    )
    order: str | None = choice(ORDERS, default=None, meaning="order of the low (L) and high (H) springs along a line")
    outer_mm: float | None = quantity(
        "mm",
        _LENGTH_OR_ZERO,
        default=None,
        hint="on a sphere it is spacing^2 / (2 radius)",
        meaning=(
            "extra length of the outer tips of a line; on a sphere, spacing^2 / (2 radius) lets all tips touch at once"
        ),
    )
    shape: str = choice(
        tuple(SHAPES),
        default="cube",
        meaning=(
            "a cube (square with a flat face), a cylinder (round with a flat face), a sphere, a dome (a shallow "
            "spherical cap on a round face) or a cone"
        ),
    )
    side_mm: float = quantity(
        "mm",
        LENGTH,
        default=1.0,
        hint="the paper's cube has 1",
        meaning="side of a cube, or diameter of any other shape",
    )
    spacing_mm: float = quantity(
        "mm",
        LENGTH,
        default=8.0,
        hint="measure from centre to centre; the paper has 8",
        meaning="centre distance of neighbouring tips; for a square, the length of its side",
    )
    offset_mm: float = quantity(
        "mm",
        Bounds(at_least=-1000.0, at_most=1000.0),
        default=0.0,
        hint="measure from the apex to the midpoint of the tips",
        meaning="distance from the apex of the fruit to the midpoint of the tips, along the line of the tips",
    )
    gap_mm: float = quantity(
        "mm",
        _LENGTH_OR_ZERO,
        default=0.5,
        hint="measure from the tip face to the fruit before the press",
        meaning="distance between the tips and the fruit before the press",
    )
    socket: Socket = choice(
        ("none", "pin"),
        default="none",
        meaning="none: sharp cubes or domes, printed with the housing; pin: ground steel pins of any shape",
    )

    def __post_init__(self) -> None:
        """Raise InputError for an invalid field, for overlapping tips, or for a key of another layout or shape."""
        check_fields(self, "tips")
        if self.spacing_mm <= self.side_mm:
            bound = f"greater than tips.side_mm = {self.side_mm:g} mm"
            hint = "move the tips farther apart, because they overlap"
            raise validation_error("tips.spacing_mm", self.spacing_mm, "mm", bound, hint)
        self._check_order()
        tip_shape(self.shape, self.side_mm, self)

    def _check_order(self) -> None:
        """Raise InputError if a line has no valid order of springs, or if another layout has a key of a line."""
        if self.tip_layout.has_choice_of_order:
            orders = self.tip_layout.orders
            if self.order is None:
                bound = f"given for tips.layout = {self.layout!r}"
                raise validation_error("tips.order", None, "", bound, f"choose {' or '.join(orders)}")
            if self.order not in orders:
                raise validation_error(
                    "tips.order", self.order, "", f"one of {', '.join(orders)}", "choose another order"
                )
            return
        for name, value in (("tips.order", self.order), ("tips.outer_mm", self.outer_mm)):
            if value is not None:
                bound = f"left out for tips.layout = {self.layout!r}"
                raise validation_error(name, value, "", bound, "drop it, or choose tips.layout = 'line'")

    @property
    def tip_layout(self) -> Layout:
        """Return the layout, with the positions of the tips and the plates that carry them."""
        return LAYOUTS[self.layout]

    @cached_property
    def tip_shape(self) -> TipShape:
        """Return the shape that all tips have."""
        return tip_shape(self.shape, self.side_mm, self)

    @cached_property
    def springs(self) -> tuple[Spring, ...]:
        """Return the kind of spring of each tip, in the order of `places_mm`."""
        return tuple(SPRINGS[letter] for letter in self.order or self.tip_layout.orders[0])

    @property
    def spring_groups(self) -> SpringGroups:
        """Return the indices of the tips on low springs and of the tips on high springs."""
        low = tuple(i for i, spring in enumerate(self.springs) if spring == "low")
        high = tuple(i for i, spring in enumerate(self.springs) if spring == "high")
        return SpringGroups(low=low, high=high)

    def each(self, low: float, high: float) -> tuple[float, ...]:
        """Return one number per tip: `low` for tips on low springs, and `high` for tips on high springs."""
        return tuple(low if spring == "low" else high for spring in self.springs)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the name of each tip: the kind of its spring, and a number if several springs are of this kind."""
        springs = self.springs
        names = []
        for i, spring in enumerate(springs):
            number = springs[: i + 1].count(spring)  # 1 for the first spring of this kind
            names.append(spring if springs.count(spring) == 1 else f"{spring}_{number}")
        return tuple(names)

    @cached_property
    def places_mm(self) -> tuple[Position, ...]:
        """Return the position of each tip relative to the apex of the fruit [mm].

        The tips of a square are in anticlockwise order, starting at (-x, -y).
        """
        return tuple(
            Position(self.offset_mm + self.spacing_mm * x, self.spacing_mm * y) for x, y in self.tip_layout.positions
        )

    @property
    def centres_mm(self) -> tuple[float, ...]:
        """Return the x coordinate of each tip relative to the apex of the fruit [mm]."""
        return tuple(position.x for position in self.places_mm)

    @cached_property
    def height_offset_mm(self) -> tuple[float, ...]:
        """Return the design height of each tip relative to the tips that protrude most [mm]. No height is above 0.

        Only the outer tips of a line protrude; without `outer_mm`, all tips have the same height.
        """
        outer = self.outer_mm or 0.0
        inner = -outer if self.tip_layout.outer else 0.0
        return tuple(0.0 if index in self.tip_layout.outer else inner for index in range(len(self.springs)))

    @property
    def own_columns(self) -> tuple[int, ...]:
        """Return the indices of the tips that have separate columns in tables of forces.

        A pair has none, because its two forces are also the mean forces of the low and the high tips.
        """
        return () if self.tip_layout.is_pair else tuple(range(len(self.springs)))

    @property
    def face_mm2(self) -> float:
        """Return the area inside the outline of a tip [mm^2]."""
        return self.tip_shape.area_mm2

    @property
    def as_pair(self) -> "Tips":
        """Return a pair of tips of the same shape: one on a low spring, and one on a high spring."""
        return dataclasses.replace(self, layout=PAIR.name, order=None, outer_mm=None)

    @property
    def flat(self) -> "Tips":
        """Return tips with the same outline and with sharp flat faces, for which the springs are sized."""
        defaults: dict[str, Any] = {key.name: key.default for key in dataclasses.fields(ShapeKeys)}
        return dataclasses.replace(self, shape=self.tip_shape.sized_as, **defaults)


@dataclass(frozen=True, kw_only=True)
class PressMotion:
    """The motion of the sensor in a press: its travel, its tilt along the tips, and its roll across them.

    The travel is measured at the centre of the tips, from the first touch of a level sensor. A tilt or a roll rotates
    the sensor about this centre. At a travel x, a tip of a pair moves by x +- spacing / 2 tan(tilt), so it may touch
    earlier or later.

    `tilt_spread_deg` is the uncertainty of the tilt of a press, two standard deviations. `attitude` is the direction in
    which the tips point. It determines how the weight of the moving parts bends the springs.
    """

    travel_mm: float = quantity(
        "mm",
        LENGTH,
        default=0.6,
        hint="the paper presses 0.6",
        meaning="distance by which the centre of the tips moves down after the first touch of a level sensor; the "
        "presses of [reading] measure it from the first touch in their own pose",
    )
    tilt_deg: float = quantity(
        "deg",
        _WIDEST_TILT,
        default=0.0,
        hint="a positive tilt lowers the high tip",
        meaning="tilt of the sensor along the tips; a positive tilt lowers the high tip",
    )
    tilt_spread_deg: float = quantity(
        "deg",
        _SPREAD,
        default=1.0,
        hint="a steady hand keeps the tilt within 1",
        meaning="uncertainty of the tilt of one press, two standard deviations; the P of a level sensor depends on it; "
        "with `[reading]`, `reading.tilt_deg` replaces it",
    )
    roll_deg: float = quantity(
        "deg",
        _WIDEST_TILT,
        default=0.0,
        hint="a positive roll lowers the side y > 0 of each tip",
        meaning="roll of the sensor across the tips; a positive roll lowers the side y > 0 of each tip",
    )
    attitude: Attitude = choice(
        ("down", "side", "up"),
        default="side",
        meaning=(
            "direction in which the tips point; the weight of the moving parts deflects the springs before the press"
        ),
    )
    speed_mm_per_s: float | None = quantity(
        "mm/s",
        _SPEED,
        default=None,
        hint="a hand presses at about 1",
        meaning="speed of the housing from the first touch to full travel, on flesh that relaxes",
    )
    hold_s: float | None = quantity(
        "s",
        DURATION,
        default=None,
        hint="a hand holds for about 2",
        meaning="time for which full travel is held; a reading may be taken during this time",
    )

    def __post_init__(self) -> None:
        """Raise InputError for an invalid field."""
        check_fields(self, "press")

    @property
    def small_step_mm(self) -> float:
        """Return the largest height difference of the tips [mm] with which all of them touch early in a press.

        It is a tenth of the travel, which is a judgement.
        """
        return 0.1 * self.travel_mm


REPRESENTED_BY_BALL = "domes in a line or a square, on flesh without a skin"
"""Designs for which `represented_by_ball` is true, written as text."""


def represented_by_ball(fruit: Fruit, tips: Tips) -> bool:
    """Return whether presses on a reference ball, which has no skin, represent presses on the fruit."""
    return tips.dome_radius_mm is not None and not tips.tip_layout.takes_targets and fruit.skin_mm is None


def check_tips_on_fruit(fruit: Fruit, tips: Tips) -> None:
    """Raise InputError if a tip extends beyond the length or the width of the fruit.

    The length and the width of a layout are the distances of its outermost tips, as multiples of the tip spacing.
    """
    hint = "move the tips closer together, or choose a larger fruit"
    layout = tips.tip_layout
    # The fruit is centred on the apex, so an offset of the tips takes up length on both sides.
    available_length = fruit.length_mm - tips.side_mm - 2.0 * abs(tips.offset_mm)
    max_spacing = available_length / layout.length_in_spacings
    if tips.spacing_mm > max_spacing:
        divisor = "" if layout.length_in_spacings == 1.0 else f" divided by {layout.length_in_spacings:g} spacings"
        bound = f"at most fruit.length_mm - side - 2 |offset|{divisor} = {max_spacing:g} mm"
        raise validation_error("tips.spacing_mm", tips.spacing_mm, "mm", bound, hint)
    if tips.side_mm > fruit.width_mm:
        bound = f"at most fruit.width_mm = {fruit.width_mm:g} mm"
        raise validation_error("tips.side_mm", tips.side_mm, "mm", bound, hint)
    if layout.width_in_spacings * tips.spacing_mm > fruit.width_mm - tips.side_mm:
        bound = f"at most fruit.width_mm - side = {fruit.width_mm - tips.side_mm:g} mm"
        raise validation_error("tips.spacing_mm", tips.spacing_mm, "mm", bound, hint)
