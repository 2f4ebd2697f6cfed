"""Layouts: where the tips stand, on which springs, and what plates carry them. A new layout is an entry in LAYOUTS."""

from dataclasses import dataclass
from typing import Literal, NamedTuple

Spring = Literal["low", "high"]
SPRINGS: dict[str, Spring] = {"L": "low", "H": "high"}


class Position(NamedTuple):
    """Where a tip stands, x along the tips and y across [mm, or spacings where a layout says so]."""

    x: float
    y: float


class SpringGroups(NamedTuple):
    """The indices of the tips on low springs and of those on high springs."""

    low: tuple[int, ...]
    high: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class Layout:
    """The positions of the tips [spacings] about their middle, and what is made for them.

    `orders` are the orders of low and high springs that a user may choose from, in letters; a single one needs no
    choice. `outer` are the indices of the tips that `tips.outer_mm` lets stand out. `plates` is the number of equal
    plates, 2 back to back, 0 where no housing is drawn. A wide stance of the two leaves of a flexure,
    `leaf_separation_mm`, keeps the tip from tilting; a thin plate's more than another's. `turn_deg` is the turn about
    the press that puts low tips where high ones stood, 0 where none does.
    """

    name: str
    positions: tuple[Position, ...]
    orders: tuple[str, ...]
    outer: tuple[int, ...] = ()
    plates: int = 1
    leaf_separation_mm: float = 14.0
    shuttle_width_mm: float = 6.0
    top_bar_mm: float = 6.0
    turn_deg: float = 0.0

    @property
    def is_pair(self) -> bool:
        """Say whether each spring carries one tip, so that a force ratio reads it and no weights of a contrast."""
        return len(self.positions) == len(SPRINGS)

    @property
    def takes_targets(self) -> bool:
        """Say whether targets of the force ratio size its springs; the springs of other layouts must be given."""
        return self.is_pair

    @property
    def has_choice_of_order(self) -> bool:
        """Say whether the user chooses the order of the springs, and how far the outer tips stand out."""
        return len(self.orders) > 1

    @property
    def has_housing(self) -> bool:
        """Say whether a housing is drawn for it."""
        return self.plates > 0

    @property
    def is_back_to_back(self) -> bool:
        """Say whether two equal plates carry it, each with one tip of each kind of spring."""
        return self.plates > 1

    @property
    def length(self) -> float:
        """Return the distance of the outermost tips along x [spacings]."""
        along = [position.x for position in self.positions]
        return max(along) - min(along)

    @property
    def width(self) -> float:
        """Return the distance of the outermost tips along y [spacings]."""
        across = [position.y for position in self.positions]
        return max(across) - min(across)


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
    top_bar_mm=6.5,  # a pad on it has room for marks and dowels
    turn_deg=90.0,
)
LAYOUTS = {layout.name: layout for layout in (PAIR, LINE, SQUARE)}
ORDERS = tuple(order for layout in LAYOUTS.values() if layout.has_choice_of_order for order in layout.orders)
