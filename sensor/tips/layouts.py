"""Layouts: the positions of the tips, their springs and the plates that carry them.

To add a layout, add an entry to LAYOUTS.
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple

Spring = Literal["low", "high"]
SPRINGS: dict[str, Spring] = {"L": "low", "H": "high"}


class Position(NamedTuple):
    """The position of a tip, x along the tips and y across them, in mm or, in a layout, in units of the spacing."""

    x: float
    y: float


class SpringGroups(NamedTuple):
    """The indices of the tips on low springs, and of the tips on high springs."""

    low: tuple[int, ...]
    high: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class Layout:
    """The positions of the tips relative to their centre, in units of the spacing, and the parts that carry them.

    `orders` are the sequences of low (L) and high (H) springs from which a user may choose. `outer` holds the indices
    of the tips that protrude by `tips.outer_mm`. `plates` is the number of equal plates: 2 if they stand back to back,
    0 if there is no housing. `leaf_separation_mm` is the distance between the two leaves of a flexure. A large distance
    keeps the tip from tilting, above all in a thin plate. `turn_deg` is the rotation about the press axis that swaps
    the low and the high tips, or None if there is no such rotation.
    """

    name: str
    positions: tuple[Position, ...]
    orders: tuple[str, ...]
    outer: tuple[int, ...] = ()
    plates: int = 1
    leaf_separation_mm: float = 14.0
    shuttle_width_mm: float = 6.0
    top_bar_mm: float = 6.0
    turn_deg: float | None = None

    @property
    def is_pair(self) -> bool:
        """Return whether the layout is a pair, whose readings use the force ratio and not a contrast of forces."""
        return len(self.positions) == len(SPRINGS)

    @property
    def takes_targets(self) -> bool:
        """Return whether the springs are sized for targets of the force ratio.

        In other layouts, the user must specify the springs.
        """
        return self.is_pair

    @property
    def has_choice_of_order(self) -> bool:
        """Return whether the user chooses the order of the springs and the protrusion of the outer tips."""
        return len(self.orders) > 1

    @property
    def has_housing(self) -> bool:
        """Return whether there is a housing for this layout."""
        return self.plates > 0

    @property
    def is_back_to_back(self) -> bool:
        """Return whether two equal plates carry the tips, each with one low and one high tip."""
        return self.plates > 1

    @property
    def length_in_spacings(self) -> float:
        """Return the distance between the outermost tips along x [spacings]."""
        x = [position.x for position in self.positions]
        return max(x) - min(x)

    @property
    def width_in_spacings(self) -> float:
        """Return the distance between the outermost tips along y [spacings]."""
        y = [position.y for position in self.positions]
        return max(y) - min(y)


PAIR = Layout(name="pair", positions=(Position(-0.5, 0.0), Position(0.5, 0.0)), orders=("LH",), turn_deg=180.0)
LINE = Layout(
    name="line",
    positions=(Position(-1.0, 0.0), Position(0.0, 0.0), Position(1.0, 0.0)),
    orders=("LHL", "HLH"),
    outer=(0, 2),
    plates=0,
)
SQUARE = Layout(
    name="square",
    positions=(Position(-0.5, -0.5), Position(0.5, -0.5), Position(0.5, 0.5), Position(-0.5, 0.5)),
    orders=("LHLH",),
    plates=2,
    leaf_separation_mm=20.0,
    shuttle_width_mm=3.0,
    top_bar_mm=6.5,  # wide enough for marks and dowels on the pad
    turn_deg=90.0,
)
LAYOUTS = {layout.name: layout for layout in (PAIR, LINE, SQUARE)}
ORDERS = tuple(order for layout in LAYOUTS.values() if layout.has_choice_of_order for order in layout.orders)
