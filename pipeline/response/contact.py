"""The fruit's compliance under the tips by the method that fits the scene: the split in its domain, else direct FE."""

import dataclasses
from functools import partial

from pipeline.options import (
    CONTACT_FRACTION,
    CONTACT_METHODS,
    DEFAULT_TOLERANCE,
    ROUGH_TOLERANCE,
    RunOptions,
    contact_inputs,
)
from pipeline.storage.cache import cached
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.tips import Tips
from sensor.quantity import InputError, validation_error
from solve.fruit.compliance import FruitCompliance
from solve.fruit.curved_body import check_curved, curved_compliance
from solve.fruit.direct import direct_compliance
from solve.fruit.skin import skin_compliance
from solve.fruit.split import SplitDomainError, contact_footprints, split_compliance

_FACETED = 0.02  # of an area: the circle of a cylinder's face on the coarsest mesh, 31 edges, misses 0.7 %


def fruit_compliance(design: Design, options: RunOptions) -> FruitCompliance:
    """Return the compliance of the fruit under all tips [1/mm], solved and kept; raises as `contact_compliance`."""
    solve = partial(contact_compliance, design.fruit, design.tips, options.contact_method, options.contact_tolerance)
    return cached("contact", contact_inputs(design, options), solve, FruitCompliance)


def contact_compliance(
    fruit: Fruit, tips: Tips, method: str = "auto", tolerance: float = CONTACT_FRACTION * DEFAULT_TOLERANCE
) -> FruitCompliance:
    """Return the compliance [1/mm] that sizes the springs: under level tips with sharp flat faces, pressed vertically.

    A curved fruit is the block of its plan and thickness plus what its shape changes. A filleted tip is taken as the
    sharp one, and a spherical tip as the cylinder of its diameter. A dome is taken as a circle of half its width where
    it touches. The status says so. "auto" takes the split in its domain, on the coarsest mesh whose error meets the
    relative tolerance, else direct finite elements. Raises InputError for an unknown method, where "split" is asked for
    outside its domain, or for a curved fruit outside that of its own (`solve/fruit/curved_body.py`).
    """
    methods = contact_methods(fruit, tips)
    if method not in methods:
        bound = f"one of {', '.join(methods)} for these tips on this fruit"
        raise validation_error("contact method", method, "", bound, "auto fits every scene")
    is_curved = fruit.equivalent_block != fruit
    if is_curved:
        check_curved(fruit, contact_footprints(fruit, tips))  # before the block is solved
    compliance = _block_compliance(fruit, tips, method, tolerance)
    compliance = dataclasses.replace(compliance, rough=tolerance >= CONTACT_FRACTION * ROUGH_TOLERANCE)
    if is_curved or fruit.skin_mm is not None:
        footprints = contact_footprints(fruit, tips)
        along_normals = tips.tip_shape.obeys_hertz
        if is_curved:
            compliance = curved_compliance(compliance, fruit, footprints, along_normals, tolerance)
        if fruit.skin_mm is not None:
            compliance = skin_compliance(compliance, fruit, footprints, along_normals)
    return _with_status(compliance, before=_stand_ins(fruit, tips))


def contact_methods(fruit: Fruit, tips: Tips) -> tuple[str, ...]:
    """Return the methods that can solve tips on a fruit: direct elements only a pair of flat tips without a skin."""
    if tips.tip_layout.is_pair and not tips.tip_shape.obeys_hertz and fruit.skin_mm is None:
        return CONTACT_METHODS
    return tuple(method for method in CONTACT_METHODS if method != "direct")


def _block_compliance(fruit: Fruit, tips: Tips, method: str, tolerance: float) -> FruitCompliance:
    """Return the compliance [1/mm] of the block that stands for a fruit, by the split or by direct finite elements.

    "auto" takes the split in its domain, and direct elements outside it where they know the tips. Raises InputError
    for a scene that neither can solve.
    """
    cause = ""
    if method != "direct":
        try:
            return split_compliance(fruit, tips, tolerance)
        except SplitDomainError as outside:
            if "direct" not in contact_methods(fruit, tips):
                reason = str(outside).partition(" for the split")[0]
                hint = "change it, or take a pair of flat tips without a skin"
                msg = f"{reason} for lines, squares, domes and skins; {hint}"
                raise InputError(msg) from outside
            if method == "split":
                raise InputError(str(outside)) from outside
            cause = f"; {str(outside).partition(';')[0]}, so solved by direct finite elements"
    return _with_status(direct_contact(fruit.equivalent_block, tips.flat), after=cause)


def _stand_ins(fruit: Fruit, tips: Tips) -> str:
    """Return words for the flat sharp tips that stand for those of the design; none where tips are flat and sharp."""
    flat = tips.flat
    if tips.tip_shape.touches_beside_centre:
        circle = contact_footprints(fruit, tips)[0].side
        return f"the domes count as flat circles of {circle:g} mm where they touch; "
    return f"the tips count as a sharp {flat.shape} of {flat.side_mm:g} mm; " if flat != tips else ""


def direct_contact(block: Fruit, tips: Tips) -> FruitCompliance:
    """Return the compliance [1/mm] of a block under a flat pair by direct finite elements."""
    from mesh.fruit import REFINEMENTS, fruit_meshes, fruit_size  # loads the mesher, which few scenes need
    from mesh.volume import volume_mesh

    if not tips.tip_shape.is_round:
        return direct_compliance(fruit_meshes(block, tips), block.poisson)
    from cad.parts.fruit import solved_block  # loads the CAD kernel

    part = solved_block(block, tips)
    sizes = [fruit_size(part, block, tips, scale) for scale in REFINEMENTS]
    return direct_compliance([volume_mesh(part, size, tolerance=_FACETED) for size in sizes], block.poisson)


def _with_status(compliance: FruitCompliance, before: str = "", after: str = "") -> FruitCompliance:
    info = dataclasses.replace(compliance.info, status=f"{before}{compliance.info.status}{after}")
    return dataclasses.replace(compliance, info=info)
