"""Foil strain gauges, read from gauges.toml, where they lie along a leaf, and what they stiffen by the beam law.

Four make a full bridge: one on each face of the upper leaf of a flexure, at its root in the wall and at its root in
the shuttle. The strains at the two roots, and on the two faces, are equal and opposite, so all four arms work.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cad.quantity import Bounds, check_fields, check_sources, quantity, sourced_records, validation_error
from cad.theory.leaf_spring import Flexure, pair_stiffness

Span = tuple[float, float]
_POSITIVE = Bounds(above=0.0)
_DATA = "correct the entry in cad/theory/gauges.toml"
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
        table = f"gauge {self.name}"
        check_fields(self, table)
        for side, value, grid in (
            ("length", self.backing_length_mm, self.grid_length_mm),
            ("width", self.backing_width_mm, self.grid_width_mm),
        ):
            least = grid + 2.0 * self.margin_mm
            if value < least:
                name, bound = f"{table}.backing_{side}_mm", f"at least {least:g} mm, to carry the grid"
                raise validation_error(name, value, "mm", bound, _DATA)
        check_sources(self, table, _DATA)

    @property
    def foil_stiffness(self) -> float:
        """Return E t of the foil [N/mm], its gaps counted."""
        return self.foil_E_MPa * self.foil_mm * self.foil_fill

    @property
    def backing_stiffness(self) -> float:
        """Return E t of the backing [N/mm]."""
        return self.backing_E_MPa * self.backing_mm

    @property
    def metal_width_mm(self) -> float:
        """Return the width of grid and tabs [mm]."""
        return self.backing_width_mm - 2.0 * self.margin_mm


_DECLARED = sourced_records(Path(__file__).with_name("gauges.toml"), FoilGauge, "gauge", _DATA)
FOIL = _DECLARED["foil"]
GAUGES: dict[str, FoilGauge | None] = {"none": None, **_DECLARED}


@dataclass(frozen=True, kw_only=True)
class GaugeSpans:
    """Where backing, metal and grid of a gauge begin and end along a leaf [mm from the wall]."""

    backing: Span
    metal: Span
    grid: Span


def shortest_gauged(fillet: float, gauge: FoilGauge) -> float:
    """Return the shortest leaf [mm] that has room for a gauge at each root, between the fillets."""
    return 2.0 * (fillet + gauge.backing_length_mm)


def gauge_spans(flexure: Flexure, gauge: FoilGauge) -> tuple[GaugeSpans, GaugeSpans]:
    """Return the places of the gauges at the wall and at the shuttle [mm]; every span starts nearest to its own root.

    Raises InputError for a leaf that is too short or not deep enough.
    """
    for key, value, least in (
        ("flexure.length", flexure.length, shortest_gauged(flexure.fillet, gauge)),
        ("flexure.depth", flexure.depth, gauge.backing_width_mm),
    ):
        if value < least:
            raise validation_error(key, value, "mm", f"at least {least:g} mm, the room for gauges", _ROOM)
    start, end = flexure.fillet, flexure.fillet + gauge.backing_length_mm
    inside = start + gauge.margin_mm
    spans = {
        "backing": (start, end),
        "metal": (inside, end - gauge.margin_mm),
        "grid": (inside, inside + gauge.grid_length_mm),
    }
    mirrored = {name: (flexure.length - a, flexure.length - b) for name, (a, b) in spans.items()}
    return GaugeSpans(**spans), GaugeSpans(**mirrored)


def sandwich_gain(E: float, depth: float, thickness: float, length: float, fillet: float, gauge: FoilGauge) -> float:
    """Return K of a pair of leaves with gauges on one of them over K without [1 from MPa, mm].

    Beam law of a clamped-guided leaf, K = 1 / (J2 - J1^2 / J0) with Jn the integral of s^n / EI: a skin of stiffness
    E_g t_g, b wide, on both faces adds E_g t_g b t^2 / 2 to EI. S. Timoshenko, Strength of Materials I, 1930, art. 43.
    """
    bare = E * depth * thickness**3 / 12.0
    coated = bare + 0.5 * gauge.backing_stiffness * min(gauge.backing_width_mm, depth) * thickness**2
    full = coated + 0.5 * gauge.foil_stiffness * min(gauge.metal_width_mm, depth) * thickness**2
    start, end = fillet, min(fillet + gauge.backing_length_mm, 0.5 * length)
    half = (0.0, start, start + gauge.margin_mm, end - gauge.margin_mm, end)
    ends = [*half, *(length - place for place in reversed(half))]
    bending = (bare, coated, full, coated, bare, coated, full, coated, bare)
    return 0.5 * (1.0 + _guided_stiffness(ends, bending) * length**3 / (12.0 * bare))


def _guided_stiffness(ends: Sequence[float], bending: Sequence[float]) -> float:
    """Return K of a clamped-guided leaf [N/mm] in pieces between ends [mm], each with its EI [N mm^2]."""
    pieces = list(zip(itertools.pairwise(ends), bending, strict=True))
    J0, J1, J2 = (math.fsum((b ** (n + 1) - a ** (n + 1)) / ((n + 1) * EI) for (a, b), EI in pieces) for n in (0, 1, 2))
    return 1.0 / (J2 - J1**2 / J0)


def gauged_length(E: float, depth: float, thickness: float, fillet: float, stiffness: float, gauge: FoilGauge) -> float:
    """Return the leaf length [mm] at which a pair with gauges on one leaf has a stiffness [N/mm], by bisection."""

    def too_stiff(length: float) -> bool:
        gain = sandwich_gain(E, depth, thickness, length, fillet, gauge)
        return pair_stiffness(E, depth, thickness, length) * gain > stiffness

    shorter, longer = 2.0 * fillet, 2.0 * fillet + thickness
    while too_stiff(longer):
        shorter, longer = longer, 2.0 * longer
    for _ in range(_HALVINGS):
        middle = 0.5 * (shorter + longer)
        if too_stiff(middle):
            shorter = middle
        else:
            longer = middle
    return longer
