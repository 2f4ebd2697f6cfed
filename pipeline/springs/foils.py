"""The gauges of a housing as the solver takes them: foils at their places on the upper leaf of each spring."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from cad.parts.housing import Housing
from cad.theory.strain_gauge import GAUGES, FoilGauge, gauge_spans
from solve.housing.bonded_foil import BondedFoil
from solve.housing.stiffness import leaf_faces


def bonded_foils(housing: Housing) -> tuple[BondedFoil, ...]:
    """Return the gauges [mm, N/mm] glued on the leaves, none where it is made without.

    Raises InputError where a leaf has no room for them.
    """
    gauge = GAUGES[housing.gauges]
    if gauge is None:
        return ()
    foils: list[BondedFoil] = []
    for tip, arm in enumerate(housing.arms):
        level = arm.levels[1]
        for root, spans in zip((1.0, -1.0), gauge_spans(arm.flexure, gauge), strict=True):
            for face in (1.0, -1.0):
                place = _Place(
                    leaves=leaf_faces(arm.name),
                    tip=tip,
                    z=level + 0.5 * face * arm.flexure.thickness,
                    sign=root * face,
                    backing=arm.along(spans.backing),
                    metal=arm.along(spans.metal),
                    grid=arm.along(spans.grid),
                )
                foils += _layers(place, gauge)
    return tuple(foils)


@dataclass(frozen=True, kw_only=True)
class _Place:
    """Where one gauge lies: its leaf and face, the sign of its strain, and x at both ends of its parts [mm]."""

    leaves: str
    tip: int
    z: float
    sign: float
    backing: tuple[float, float]
    metal: tuple[float, float]
    grid: tuple[float, float]


def _layers(place: _Place, gauge: FoilGauge) -> Iterator[BondedFoil]:
    """Yield the backing and, inside it, the metal with the grid that senses."""
    bare = BondedFoil(
        name=place.leaves,
        z=place.z,
        outline=(place.backing, _across(gauge.backing_width_mm)),
        stiffness=gauge.backing_stiffness,
        poisson=gauge.backing_poisson,
        tip=place.tip,
        sign=place.sign,
    )
    yield bare
    yield replace(
        bare,
        outline=(place.metal, _across(gauge.metal_width_mm)),
        stiffness=gauge.foil_stiffness,
        poisson=gauge.foil_poisson,
        grid=(place.grid, _across(gauge.grid_width_mm)),
    )


def _across(width: float) -> tuple[float, float]:
    return -0.5 * width, 0.5 * width
