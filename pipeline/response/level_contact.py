"""The compliance under level tips, by the split; outside its domain by a solve that is handed in.

It imports neither solids nor meshes of solids: a study of contact alone starts at once.
"""

import dataclasses
from collections.abc import Callable

from cad.design.fruit import Fruit
from cad.design.tips import Tips
from cad.quantity import InputError, validation_error
from pipeline.options import CONTACT_METHODS
from solve.fruit.compliance import FruitCompliance
from solve.fruit.curved_body import check_curved, curved_compliance
from solve.fruit.split import SplitDomainError, block_compliance, contact_footprints, split_compliance

DirectSolve = Callable[[Fruit, Tips], FruitCompliance]


def level_compliance(fruit: Fruit, tips: Tips, method: str, tolerance: float, direct: DirectSolve) -> FruitCompliance:
    """Return the compliance [1/mm] that sizes the springs: under level tips with sharp flat faces, pressed vertically.

    A curved fruit is the block of its plan and thickness plus what its shape changes, a filleted tip stands for the
    sharp one, a spherical tip for the cylinder of its diameter, a dome for a circle of half its width where it touches;
    the status says so. "auto" takes the split in its
    domain, on the coarsest mesh whose error meets the relative tolerance, else `direct` finite elements. Raises
    InputError for an unknown method, where "split" is asked for outside its domain, or for a curved fruit outside that
    of its own (`solve/fruit/curved_body.py`).
    """
    if method not in CONTACT_METHODS:
        raise validation_error(
            "contact method", method, "", f"one of {', '.join(CONTACT_METHODS)}", "auto fits every scene"
        )
    block, flat = fruit.equivalent_block, tips.flat
    if block != fruit:
        check_curved(fruit, contact_footprints(fruit, tips))  # before the block is solved
    if tips.layout != "pair" or tips.tip_shape.obeys_hertz:
        compliance = _split(fruit, tips, method, tolerance)
    else:
        compliance = _flat_compliance(block, flat, method, tolerance, direct)
    if block != fruit:
        compliance = curved_compliance(compliance, fruit, contact_footprints(fruit, tips), tips.tip_shape.obeys_hertz)
    if tips.tip_shape.obeys_hertz:
        circle = contact_footprints(fruit, tips)[0].side
        said = f"the domes count as flat circles of {circle:g} mm where they touch; {compliance.info.status}"
        return _with_status(compliance, said)
    if flat != tips:
        said = f"the tips count as a sharp {flat.shape} of {flat.side_mm:g} mm; {compliance.info.status}"
        compliance = _with_status(compliance, said)
    return compliance


def _with_status(compliance: FruitCompliance, status: str) -> FruitCompliance:
    return dataclasses.replace(compliance, info=dataclasses.replace(compliance.info, status=status))


def _split(fruit: Fruit, tips: Tips, method: str, tolerance: float) -> FruitCompliance:
    """Return the compliance of the block under any layout [1/mm]; only the split knows layouts other than a flat pair.

    Raises InputError outside its domain.
    """
    if method == "direct":
        raise validation_error(
            "contact method", method, "", "split or auto for lines, squares and domes", "auto fits every scene"
        )
    try:
        return block_compliance(fruit.equivalent_block, contact_footprints(fruit, tips), tolerance, tips.names)
    except SplitDomainError as outside:
        reason = str(outside).partition(" for the split")[0]
        msg = f"{reason} for lines, squares and domes; move the tips, or take smaller ones"
        raise InputError(msg) from outside


def _flat_compliance(block: Fruit, tips: Tips, method: str, tolerance: float, direct: DirectSolve) -> FruitCompliance:
    if method == "direct":
        return direct(block, tips)
    try:
        return split_compliance(block, tips, tolerance)
    except SplitDomainError as outside:
        reason = str(outside)
        if method == "split":
            raise InputError(reason) from outside
    compliance = direct(block, tips)
    cause = reason.partition(";")[0]
    return _with_status(compliance, f"{compliance.info.status}; {cause}, so solved by direct finite elements")
