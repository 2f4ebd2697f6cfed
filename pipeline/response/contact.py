"""The compliance of the fruit under the tips: the compliance of its block, changed by shape and skin."""

import dataclasses
from functools import partial

from pipeline.options import CONTACT_FRACTION, DEFAULT_TOLERANCE, ROUGH_TOLERANCE, RunOptions, contact_inputs
from pipeline.storage.cache import cached
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.tips import Tips
from solve.fruit.compliance import FruitCompliance
from solve.fruit.curved_body import check_curved, curved_compliance
from solve.fruit.skin import skin_compliance
from solve.fruit.split import contact_footprints, split_compliance


def fruit_compliance(design: Design, options: RunOptions) -> FruitCompliance:
    """Return the compliance of the fruit under all tips [1/mm], cached; raises like `contact_compliance`."""
    solve = partial(contact_compliance, design.fruit, design.tips, options.contact_tolerance)
    return cached("contact", contact_inputs(design, options), solve, FruitCompliance)


def contact_compliance(
    fruit: Fruit, tips: Tips, tolerance: float = CONTACT_FRACTION * DEFAULT_TOLERANCE
) -> FruitCompliance:
    """Return the compliance [1/mm] that sizes the springs: level tips with sharp flat faces, pressed vertically.

    A curved fruit is the block of its plan and thickness, plus the change by its shape. A filleted tip is replaced by
    the sharp one, and a spherical tip by the cylinder of its diameter. A dome is replaced by a circle of half its width
    at the contact. The status names these replacements. The block is solved on the coarsest mesh whose error meets the
    relative tolerance. Raises InputError for a scene outside the domain of the split (`solve/fruit/split.py`), or for a
    curved fruit outside its own domain (`solve/fruit/curved_body.py`).
    """
    is_curved = fruit.equivalent_block != fruit
    footprints = contact_footprints(fruit, tips)
    along_normals = tips.tip_shape.obeys_hertz
    if is_curved:
        check_curved(fruit, footprints)  # before the block is solved
    compliance = split_compliance(fruit, tips, tolerance)
    compliance = dataclasses.replace(compliance, rough=tolerance >= CONTACT_FRACTION * ROUGH_TOLERANCE)
    if is_curved:
        compliance = curved_compliance(compliance, fruit, footprints, along_normals, tolerance)
    if fruit.skin_mm is not None:
        compliance = skin_compliance(compliance, fruit, footprints, along_normals)
    info = dataclasses.replace(compliance.info, status=f"{_stand_ins(fruit, tips)}{compliance.info.status}")
    return dataclasses.replace(compliance, info=info)


def _stand_ins(fruit: Fruit, tips: Tips) -> str:
    """Return text that names the flat sharp tips in place of the design's; empty if these are flat and sharp."""
    flat = tips.flat
    if tips.tip_shape.touches_beside_centre:
        circle = contact_footprints(fruit, tips)[0].side
        return f"the domes count as flat circles of {circle:g} mm where they touch; "
    return f"the tips count as a sharp {flat.shape} of {flat.side_mm:g} mm; " if flat != tips else ""
