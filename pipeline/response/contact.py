"""The fruit's compliance under the tips by the method that fits the scene: the split in its domain, else direct FE."""

import dataclasses
from functools import partial

from cad.design.fruit import Fruit
from cad.design.parameters import Design
from cad.design.tips import Tips
from cad.quantity import InputError, validation_error
from pipeline.options import CONTACT_METHODS, CONTACT_SHARE, DEFAULT_TOLERANCE, RunOptions, contact_inputs
from pipeline.storage.cache import cached
from solve.fruit.compliance import FruitCompliance
from solve.fruit.curved_body import check_curved, curved_compliance
from solve.fruit.direct import direct_compliance
from solve.fruit.split import SplitDomainError, contact_footprints, split_compliance

_FACETED = 0.02  # of an area: the circle of a cylinder's face on the coarsest mesh, 31 edges, misses 0.7 %


def fruit_compliance(design: Design, options: RunOptions) -> FruitCompliance:
    """Return the compliance of the fruit under all tips [1/mm], kept by what it depends on; raises as below."""
    solve = partial(contact_compliance, design.fruit, design.tips, options.contact_method, options.contact_tolerance)
    return cached("contact", contact_inputs(design, options), solve, FruitCompliance)


def contact_compliance(
    fruit: Fruit, tips: Tips, method: str = "auto", tolerance: float = CONTACT_SHARE * DEFAULT_TOLERANCE
) -> FruitCompliance:
    """Return the compliance [1/mm] that sizes the springs: under level tips with sharp flat faces, pressed vertically.

    A curved fruit is the block of its plan and thickness plus what its shape changes, a filleted tip stands for the
    sharp one, a spherical tip for the cylinder of its diameter, a dome for a circle of half its width where it touches;
    the status says so. "auto" takes the split in its domain, on the coarsest mesh whose error meets the relative
    tolerance, else direct finite elements. Raises InputError for an unknown method, where "split" is asked for outside
    its domain, or for a curved fruit outside that of its own (`solve/fruit/curved_body.py`).
    """
    if method not in CONTACT_METHODS:
        known = ", ".join(CONTACT_METHODS)
        raise validation_error("contact method", method, "", f"one of {known}", "auto fits every scene")
    block = fruit.equivalent_block
    is_dome = tips.tip_shape.obeys_hertz
    if block != fruit:
        check_curved(fruit, contact_footprints(fruit, tips))  # before the block is solved
    if not tips.tip_layout.is_pair or is_dome:
        compliance = _compliance_of_any_layout(fruit, tips, method, tolerance)
    else:
        compliance = _compliance_of_pair(block, tips.flat, method, tolerance)
    if block != fruit:
        compliance = curved_compliance(compliance, fruit, contact_footprints(fruit, tips), is_dome)
    status = compliance.info.status
    if is_dome:
        circle = contact_footprints(fruit, tips)[0].side
        return _with_status(compliance, f"the domes count as flat circles of {circle:g} mm where they touch; {status}")
    if tips.flat != tips:
        flat = tips.flat
        return _with_status(compliance, f"the tips count as a sharp {flat.shape} of {flat.side_mm:g} mm; {status}")
    return compliance


def _compliance_of_any_layout(fruit: Fruit, tips: Tips, method: str, tolerance: float) -> FruitCompliance:
    """Return the compliance of the block under any layout [1/mm]; only the split knows layouts other than a flat pair.

    Raises InputError outside its domain.
    """
    if method == "direct":
        bound = "split or auto for lines, squares and domes"
        raise validation_error("contact method", method, "", bound, "auto fits every scene")
    try:
        return split_compliance(fruit, tips, tolerance)
    except SplitDomainError as outside:
        reason = str(outside).partition(" for the split")[0]
        msg = f"{reason} for lines, squares and domes; move the tips, or take smaller ones"
        raise InputError(msg) from outside


def _compliance_of_pair(block: Fruit, tips: Tips, method: str, tolerance: float) -> FruitCompliance:
    """Return the compliance of a block under a flat pair [1/mm]; "auto" solves it directly where the split is not for.

    Raises InputError outside the domain of the split.
    """
    if method == "direct":
        return direct_contact(block, tips)
    try:
        return split_compliance(block, tips, tolerance)
    except SplitDomainError as outside:
        reason = str(outside)
        if method == "split":
            raise InputError(reason) from outside
    compliance = direct_contact(block, tips)
    cause = reason.partition(";")[0]
    return _with_status(compliance, f"{compliance.info.status}; {cause}, so solved by direct finite elements")


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


def _with_status(compliance: FruitCompliance, status: str) -> FruitCompliance:
    return dataclasses.replace(compliance, info=dataclasses.replace(compliance.info, status=status))
