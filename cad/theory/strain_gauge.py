"""Foil strain gauges as data with sources, where they lie along a leaf, and what they stiffen by the beam law.

Four make a full bridge: one on each face of the upper leaf of a flexure, at its root in the wall and at its root in
the shuttle. The strains at the two roots, and on the two faces, are equal and opposite, so all four arms work.
"""

import itertools
import math
from dataclasses import dataclass

from cad.quantity import Bounds, check_fields, fault, quantity
from cad.theory.flexure import Flexure
from cad.theory.leaf_spring import pair_stiffness

Span = tuple[float, float]
_POSITIVE = Bounds(above=0.0)
_DATA = "correct the entry in cad/gauges.py"
_ROOM = "choose another process or other targets, or print.gauges = 'none'"
_HALVINGS = 60


@dataclass(frozen=True, kw_only=True)
class FoilGauge:
    """A gauge of one grid: sizes [mm], layers and gauge factor; metal ends `margin_mm` inside the backing's edges.

    The metal is the grid, which begins at the edge next to a leaf's root, and its solder tabs behind it; `foil_fill`
    is the share of that rectangle which the foil covers.
    """

    name: str
    grid_length_mm: float = quantity("mm", _POSITIVE, remedy=_DATA)
    grid_width_mm: float = quantity("mm", _POSITIVE, remedy=_DATA)
    backing_length_mm: float = quantity("mm", _POSITIVE, remedy=_DATA)
    backing_width_mm: float = quantity("mm", _POSITIVE, remedy=_DATA)
    margin_mm: float = quantity("mm", _POSITIVE, remedy=_DATA)
    foil_mm: float = quantity("mm", _POSITIVE, remedy=_DATA)
    foil_fill: float = quantity("1", Bounds(above=0.0, at_most=1.0), remedy=_DATA)
    foil_E_MPa: float = quantity("MPa", _POSITIVE, remedy=_DATA)
    foil_poisson: float = quantity("1", Bounds(above=-1.0, below=0.5), remedy=_DATA)
    backing_mm: float = quantity("mm", _POSITIVE, remedy=_DATA)
    backing_E_MPa: float = quantity("MPa", _POSITIVE, remedy=_DATA)
    backing_poisson: float = quantity("1", Bounds(above=-1.0, below=0.5), remedy=_DATA)
    gauge_factor: float = quantity("1", _POSITIVE, remedy=_DATA)
    sources: tuple[tuple[str, str], ...]

    def __post_init__(self) -> None:
        """Check each number, that the backing carries the grid, and that every number has a source."""
        check_fields(self, f"gauge {self.name}")
        for side, value, least in (
            ("length", self.backing_length_mm, self.grid_length_mm + 2.0 * self.margin_mm),
            ("width", self.backing_width_mm, self.grid_width_mm + 2.0 * self.margin_mm),
        ):
            if value < least:
                name, bound = f"gauge {self.name}.backing_{side}_mm", f"at least {least:g} mm, to carry the grid"
                raise fault(name, value, "mm", bound, _DATA)
        told = {field for field, _ in self.sources}
        numbers = {name for name, value in vars(self).items() if isinstance(value, float)}
        for field in sorted(numbers ^ told):
            name = f"gauge {self.name}.{field}"
            raise fault(name, getattr(self, field, None), "", "a number with one source", _DATA)

    @property
    def layers(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return E t [N/mm] and Poisson's ratio of the foil and of the backing."""
        foil = self.foil_E_MPa * self.foil_mm * self.foil_fill
        return (foil, self.foil_poisson), (self.backing_E_MPa * self.backing_mm, self.backing_poisson)

    @property
    def metal_width_mm(self) -> float:
        """Return the width of grid and tabs [mm]."""
        return self.backing_width_mm - 2.0 * self.margin_mm


_OMEGA = "OMEGA strain gages for bending, SG series, manual E-12"
_KAPTON = "DuPont Kapton HN summary of properties, 23 C"
FOIL = FoilGauge(
    name="foil", grid_length_mm=3.0, grid_width_mm=3.0, backing_length_mm=6.0, backing_width_mm=4.0, margin_mm=0.5,
    foil_mm=0.005, foil_fill=0.6, foil_E_MPa=162000.0, foil_poisson=0.33, backing_mm=0.075, backing_E_MPa=2500.0,
    backing_poisson=0.34, gauge_factor=2.1,
    sources=(
        ("grid_length_mm", f"{_OMEGA}: SG-3, 3.0 mm"),
        ("grid_width_mm", f"{_OMEGA}: SG-3, 3.0 mm"),
        ("backing_length_mm", "grid, 0.5 mm before it and 2.5 mm of solder tabs behind it, typical of a 3 mm gauge"),
        ("backing_width_mm", "trimmed to 0.5 mm beside the grid; OMEGA allows 0.25 mm"),
        ("margin_mm", "trimmed to 0.5 mm before the grid; OMEGA allows 0.25 mm"),
        ("foil_mm", f"{_OMEGA}: constantan foil, 5 micrometre"),
        ("foil_fill", "typical: lines somewhat wider than the gaps between them, tabs taken alike"),
        ("foil_E_MPa", "typical of constantan, 162 GPa"),
        ("foil_poisson", "typical of constantan"),
        ("backing_mm", f"{_OMEGA}: polyimide, substrate 50 and cover 25 micrometre"),
        ("backing_E_MPa", _KAPTON),
        ("backing_poisson", _KAPTON),
        ("gauge_factor", "typical of constantan, 2.0 to 2.2 by makers"),
    ),
)  # fmt: skip

GAUGES: dict[str, FoilGauge | None] = {"none": None, "foil": FOIL}


def shortest_gauged(fillet: float, gauge: FoilGauge) -> float:
    """Return the shortest leaf [mm] that has room for a gauge at each root, between the fillets."""
    return 2.0 * (fillet + gauge.backing_length_mm)


def gauge_spans(flexure: Flexure, gauge: FoilGauge) -> tuple[tuple[Span, Span, Span], tuple[Span, Span, Span]]:
    """Return where backing, metal and grid begin and end [mm from the wall], of the gauges at wall and at shuttle.

    Raises InputError for a leaf that is too short or not deep enough.
    """
    for key, value, least in (
        ("flexure.length", flexure.length, shortest_gauged(flexure.fillet, gauge)),
        ("flexure.depth", flexure.depth, gauge.backing_width_mm),
    ):
        if value < least:
            raise fault(key, value, "mm", f"at least {least:g} mm, the room for gauges", _ROOM)
    start, end = flexure.fillet, flexure.fillet + gauge.backing_length_mm
    inside = start + gauge.margin_mm
    at_wall = ((start, end), (inside, end - gauge.margin_mm), (inside, inside + gauge.grid_length_mm))
    far = flexure.length
    backing, metal, grid = ((far - a, far - b) for a, b in at_wall)
    return at_wall, (backing, metal, grid)


def along_leaf(roots: tuple[float, float], span: Span) -> Span:
    """Return x at both ends of a span that counts from the wall of a leaf, its roots in wall and shuttle [mm]."""
    wall, shuttle = roots
    start, end = (wall + (way if shuttle > wall else -way) for way in span)
    return start, end


def sandwich_gain(E: float, section: tuple[float, float], length: float, fillet: float, gauge: FoilGauge) -> float:
    """Return K of a pair with gauges on one leaf over K without [1], for leaves of depth and thickness `section` [mm].

    Beam law of a clamped-guided leaf, K = 1 / (J2 - J1^2 / J0) with Jn the integral of s^n / EI: a skin of stiffness
    E_g t_g, b wide, on both faces adds E_g t_g b t^2 / 2 to EI. S. Timoshenko, Strength of Materials I, 1930, art. 43.
    """
    depth, t = section
    bare = E * depth * t**3 / 12.0
    (foil, _), (backing, _) = gauge.layers
    coated = bare + 0.5 * backing * min(gauge.backing_width_mm, depth) * t**2
    full = coated + 0.5 * foil * min(gauge.metal_width_mm, depth) * t**2
    start, end, m = fillet, min(fillet + gauge.backing_length_mm, 0.5 * length), gauge.margin_mm
    half = ((0.0, bare), (start, coated), (start + m, full), (end - m, coated), (end, bare))
    ends = [*(at for at, _ in half), *(length - at for at, _ in reversed(half))]
    rows = [EI for _, EI in half] + [EI for _, EI in reversed(half[:-1])]
    pieces = list(zip(itertools.pairwise(ends), rows, strict=True))

    def moment(n: int) -> float:
        return math.fsum((b ** (n + 1) - a ** (n + 1)) / ((n + 1) * EI) for (a, b), EI in pieces)

    J0, J1, J2 = (moment(n) for n in (0, 1, 2))
    return 0.5 * (1.0 + length**3 / (12.0 * bare) / (J2 - J1**2 / J0))


def gauged_length(E: float, section: tuple[float, float], fillet: float, stiffness: float, gauge: FoilGauge) -> float:
    """Return the leaf length [mm] at which a pair with gauges on one leaf has a stiffness [N/mm]."""
    depth, t = section

    def too_stiff(length: float) -> bool:
        gain = sandwich_gain(E, section, length, fillet, gauge)
        return pair_stiffness(E, depth, t, length) * gain > stiffness

    low, high = 2.0 * fillet, 2.0 * fillet + t
    while too_stiff(high):
        low, high = high, 2.0 * high
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if too_stiff(middle) else (low, middle)
    return high
