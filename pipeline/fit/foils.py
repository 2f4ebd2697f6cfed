"""The gauges of a housing as the solver takes them: foils at their places on the upper leaf of each flexure."""

from dataclasses import replace

from cad.parts.housing import Housing
from cad.theory.strain_gauge import GAUGES, along_leaf, gauge_spans
from solve.housing.bonded_foil import BondedFoil
from solve.housing.stiffness import LEAVES


def bonded_foils(housing: Housing) -> tuple[BondedFoil, ...]:
    """Return the gauges that the housing has room for, none where it is made without; raises InputError."""
    gauge = GAUGES[housing.gauges]
    if gauge is None:
        return ()
    wide, metal_wide = 0.5 * gauge.backing_width_mm, 0.5 * gauge.metal_width_mm
    grid_wide = 0.5 * gauge.grid_width_mm
    (foil, foil_poisson), (backing, backing_poisson) = gauge.layers
    found = []
    for tip, (_, flexure, roots) in enumerate(housing.arms):
        level = housing.lower_leaf_level + flexure.separation
        for root, spans in zip((1.0, -1.0), gauge_spans(flexure, gauge), strict=True):
            whole, metal, grid = (along_leaf(roots, span) for span in spans)
            for face in (1.0, -1.0):
                bare = BondedFoil(
                    name=LEAVES[tip],
                    z=level + 0.5 * face * flexure.thickness,
                    place=(whole, (-wide, wide)),
                    stiffness=backing,
                    poisson=backing_poisson,
                    tip=tip,
                    sign=root * face,
                )
                found += [
                    bare,
                    replace(
                        bare,
                        place=(metal, (-metal_wide, metal_wide)),
                        stiffness=foil,
                        poisson=foil_poisson,
                        grid=(grid, (-grid_wide, grid_wide)),
                    ),
                ]
    return tuple(found)
