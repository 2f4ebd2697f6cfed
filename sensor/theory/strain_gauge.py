"""Foil strain gauges, read from gauges.toml, where they lie along a leaf, and what they stiffen by the beam law.

Four make a full bridge. They lie on both faces of the upper leaf of a flexure, at its root in the wall and at its root
in the shuttle. The strains at the two roots, and on the two faces, are equal and opposite, so all four arms work.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, NamedTuple

from sensor.input_file import read_toml
from sensor.quantity import Bounds, Sourced, quantity, validation_error
from sensor.theory.bisection import last_holding
from sensor.theory.leaf_spring import Flexure, LeafProfile, pair_stiffness

_POSITIVE = Bounds(above=0.0)
_ROOM = "choose another process or other targets, or print.gauges = 'none'"


@dataclass(frozen=True, kw_only=True)
class FoilGauge(Sourced):
    """A gauge of one grid: sizes [mm], layers and gauge factor; metal ends `margin_mm` inside the backing's edges.

    The metal is the grid, which begins at the edge next to a leaf's root, and its solder tabs behind it. `foil_fill` is
    the fraction of that rectangle which the foil covers.
    """

    LABEL: ClassVar[str] = "gauge"

    grid_length_mm: float = quantity("mm", _POSITIVE)
    grid_width_mm: float = quantity("mm", _POSITIVE)
    backing_length_mm: float = quantity("mm", _POSITIVE)
    backing_width_mm: float = quantity("mm", _POSITIVE)
    margin_mm: float = quantity("mm", _POSITIVE)
    foil_mm: float = quantity("mm", _POSITIVE)
    foil_fill: float = quantity("1", Bounds(above=0.0, at_most=1.0))
    foil_E_MPa: float = quantity("MPa", _POSITIVE)
    foil_poisson: float = quantity("1", Bounds(above=-1.0, below=0.5))
    backing_mm: float = quantity("mm", _POSITIVE)
    backing_E_MPa: float = quantity("MPa", _POSITIVE)
    backing_poisson: float = quantity("1", Bounds(above=-1.0, below=0.5))
    gauge_factor: float = quantity("1", _POSITIVE)

    def __post_init__(self) -> None:
        """Check each number, that the backing carries the grid, and that every number has a source."""
        super().__post_init__()
        for side in ("length", "width"):
            name = f"backing_{side}_mm"
            backing = getattr(self, name)
            least = getattr(self, f"grid_{side}_mm") + 2.0 * self.margin_mm
            if backing < least:
                bound = f"at least {least:g} mm, to carry the grid"
                key = f"gauge {self.name}.{name}"
                raise validation_error(key, backing, "mm", bound, self.HINT)

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


_DECLARED = FoilGauge.from_tables(read_toml(Path(__file__).with_name("gauges.toml"), "gauges"))
FOIL = _DECLARED["foil"]
GAUGES: dict[str, FoilGauge | None] = {"none": None, **_DECLARED}


class LeafInterval(NamedTuple):
    """Where a layer starts, nearest to the root of the leaf, and where it ends [mm from the wall]."""

    start: float
    end: float

    def mirrored(self, length: float) -> "LeafInterval":
        """Return the span at the other end of a leaf of a length [mm]."""
        return LeafInterval(length - self.start, length - self.end)


@dataclass(frozen=True, kw_only=True)
class GaugeSpans:
    """Where backing, metal and grid of a gauge begin and end along a leaf [mm from the wall]."""

    backing: LeafInterval
    metal: LeafInterval
    grid: LeafInterval


def shortest_gauged(fillet: float, gauge: FoilGauge) -> float:
    """Return the shortest leaf [mm] that has room for a gauge at each root, between the fillets."""
    return 2.0 * (fillet + gauge.backing_length_mm)


def gauge_spans(flexure: Flexure, gauge: FoilGauge) -> tuple[GaugeSpans, GaugeSpans]:
    """Return the gauges at the wall and at the shuttle [mm]; every span starts nearest to its own root.

    Raises InputError for a leaf that is too short or not deep enough.
    """
    shortest = shortest_gauged(flexure.fillet, gauge)
    if flexure.length < shortest:
        bound = f"at least {shortest:g} mm, the room for gauges"
        raise validation_error("flexure.length", flexure.length, "mm", bound, _ROOM)
    if flexure.depth < gauge.backing_width_mm:
        bound = f"at least {gauge.backing_width_mm:g} mm, the room for gauges"
        raise validation_error("flexure.depth", flexure.depth, "mm", bound, _ROOM)
    start = flexure.fillet
    end = start + gauge.backing_length_mm
    inside = start + gauge.margin_mm
    at_wall = GaugeSpans(
        backing=LeafInterval(start, end),
        metal=LeafInterval(inside, end - gauge.margin_mm),
        grid=LeafInterval(inside, inside + gauge.grid_length_mm),
    )
    at_shuttle = GaugeSpans(
        backing=at_wall.backing.mirrored(flexure.length),
        metal=at_wall.metal.mirrored(flexure.length),
        grid=at_wall.grid.mirrored(flexure.length),
    )
    return at_wall, at_shuttle


def sandwich_gain(E: float, leaf: LeafProfile, length: float, gauge: FoilGauge) -> float:
    """Return K of a pair of leaves with gauges on one of them over K without [1 from MPa, mm].

    Beam law of a clamped-guided leaf, K = 1 / (J2 - J1^2 / J0) with Jn the integral of s^n / EI. A skin of stiffness
    E_g t_g, b wide, on both faces adds E_g t_g b t^2 / 2 to EI. S. Timoshenko, Strength of Materials I, 1930, art. 43.
    """
    depth, thickness, fillet = leaf
    bare = E * depth * thickness**3 / 12.0
    coated = bare + 0.5 * gauge.backing_stiffness * min(gauge.backing_width_mm, depth) * thickness**2
    full = coated + 0.5 * gauge.foil_stiffness * min(gauge.metal_width_mm, depth) * thickness**2
    start = fillet
    end = min(fillet + gauge.backing_length_mm, 0.5 * length)
    # Where EI changes: backing, then metal on it, then backing alone; the gauge at the other root is a mirror image.
    half = (0.0, start, start + gauge.margin_mm, end - gauge.margin_mm, end)
    ends = [*half, *(length - position for position in reversed(half))]
    bending = (bare, coated, full, coated, bare, coated, full, coated, bare)
    # One leaf of the pair has gauges, the other is as stiff as 12 bare / length^3.
    return 0.5 * (1.0 + _guided_stiffness(ends, bending) * length**3 / (12.0 * bare))


def _guided_stiffness(ends: Sequence[float], bending: Sequence[float]) -> float:
    """Return K of a clamped-guided leaf [N/mm] in pieces between ends [mm], each with its EI [N mm^2]."""
    J = []
    for n in (0, 1, 2):
        pieces = zip(itertools.pairwise(ends), bending, strict=True)
        J.append(math.fsum((end ** (n + 1) - start ** (n + 1)) / ((n + 1) * EI) for (start, end), EI in pieces))
    return 1.0 / (J[2] - J[1] ** 2 / J[0])


def gauged_length(E: float, leaf: LeafProfile, stiffness: float, gauge: FoilGauge) -> float:
    """Return the leaf length [mm] at which a pair with gauges on one leaf has a stiffness [N/mm], by bisection."""

    def too_stiff(length: float) -> bool:
        gain = sandwich_gain(E, leaf, length, gauge)
        return pair_stiffness(E, leaf.depth, leaf.thickness, length) * gain > stiffness

    # From the shortest leaf that its fillets leave on, lengths are doubled until one is not too stiff.
    shorter = 2.0 * leaf.fillet
    longer = shorter + leaf.thickness
    while too_stiff(longer):
        shorter = longer
        longer = 2.0 * longer
    return last_holding(too_stiff, shorter, longer)
