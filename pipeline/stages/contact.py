"""The fruit's answer to both tips by the method that the scene asks for: the split in its domain, else direct FE."""

import dataclasses

from cad.design.parameters import Fruit, Tips
from cad.parts.fruit import fruit_half, fruit_quarter
from cad.quantity import InputError, fault
from mesh.fruit import REFINEMENTS, fruit_meshes, fruit_size
from mesh.volume import volume_mesh
from pipeline.accuracy import CONTACT_SHARE, DEFAULT_TOLERANCE
from pipeline.options import CONTACT_METHODS
from solve.fruit.compliance import Compliance
from solve.fruit.direct import direct_compliance
from solve.fruit.split import SplitDomainError, split_compliance

_FACETED = 0.02  # of an area: the circle of a cylinder's face on the coarsest mesh, 31 edges, misses 0.7 %


def contact_compliance(
    fruit: Fruit, tips: Tips, method: str = "auto", tolerance: float = CONTACT_SHARE * DEFAULT_TOLERANCE
) -> Compliance:
    """Return the compliance that sizes the springs: of a block under two level tips with sharp flat faces.

    A curved fruit stands for the block of its plan and thickness, a filleted tip for the sharp one, a spherical tip
    for the cylinder of its diameter; the status says so. "auto" takes the split in its domain, on the coarsest mesh
    whose error meets the relative tolerance, else direct finite elements. Raises InputError for an unknown method, or
    where "split" is asked for outside its domain.
    """
    if method not in CONTACT_METHODS:
        raise fault("contact method", method, "", f"one of {', '.join(CONTACT_METHODS)}", "auto fits every scene")
    block, flat = fruit.equivalent_block, tips.flat
    found = _flat_compliance(block, flat, method, tolerance)
    stands = []
    if block != fruit:
        size = f"{block.length_mm:g} x {block.width_mm:g} x {block.height_mm:g} mm"
        stands.append(f"the {fruit.shape} counts as a block of {size}")
    if flat != tips:
        stands.append(f"the tips count as a sharp {flat.shape} of {flat.side_mm:g} mm")
    return dataclasses.replace(found, status="; ".join([*stands, found.status])) if stands else found


def _flat_compliance(block: Fruit, tips: Tips, method: str, tolerance: float) -> Compliance:
    if method == "direct":
        return _direct(block, tips)
    try:
        return split_compliance(block, tips, tolerance)
    except SplitDomainError as outside:
        reason = str(outside)
        if method == "split":
            raise InputError(reason) from outside
    found = _direct(block, tips)
    cause = reason.partition(";")[0]
    return dataclasses.replace(found, status=f"{found.status}; {cause}, so solved by direct finite elements")


def _direct(block: Fruit, tips: Tips) -> Compliance:
    if tips.shape == "cube":
        return direct_compliance(fruit_meshes(block, tips), block, tips)
    part = fruit_quarter(block, tips) if tips.offset_mm == 0.0 else fruit_half(block, tips)
    sizes = (fruit_size(part, block, tips, scale) for scale in REFINEMENTS)
    return direct_compliance([volume_mesh(part, size, tolerance=_FACETED) for size in sizes], block, tips)
