"""The compliance of the fruit under the tips: the compliance of a block, corrected for curved shape and skin."""

from dataclasses import replace
from functools import partial
from typing import Any

from pipeline.options import CONTACT_FRACTION, DEFAULT_TOLERANCE, ROUGH_TOLERANCE, RunOptions
from pipeline.storage.cache import load_or_compute
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.tips import Tips
from solve.fruit.compliance import FruitCompliance
from solve.fruit.curved_body import check_curved, curved_compliance
from solve.fruit.skin import skin_compliance
from solve.fruit.split import contact_footprints, split_compliance

_IRRELEVANT_FRUIT_KEYS = (
    *("name", "E_MPa", "E_max_MPa", "poisson_spread", "bruise_limit_MPa", "relaxation"),
    *("roughness_mm", "roughness_wave_mm", "flesh_scatter_percent"),
)
IRRELEVANT_VALUES: dict[str, dict[str, Any]] = {
    "fruit": {key: getattr(Fruit(), key) for key in _IRRELEVANT_FRUIT_KEYS},
    "tips": {"gap_mm": 0.0, "socket": "none"},
}
"""Replacement values of the keys that do not affect the compliance of a fruit times its modulus.

With these values, designs that differ only in such keys share one cached solution.
"""


def fruit_compliance(design: Design, options: RunOptions) -> FruitCompliance:
    """Return the compliance of the fruit under all tips times E [1/mm], from the cache on disk if possible.

    Raises the same errors as `contact_compliance`.
    """
    solve = partial(contact_compliance, design.fruit, design.tips, options.contact_tolerance)
    fruit, tips = contact_scene(design)
    inputs = {"fruit": fruit, "tips": tips, "tol": options.contact_tolerance}
    return load_or_compute("contact", inputs, solve, FruitCompliance)


def contact_scene(design: Design) -> tuple[Fruit, Tips]:
    """Return the fruit and the tips of a design, with a fixed value in each field that does not affect their contact.

    Designs that differ only in such fields then share one cached solution. If the fruit has a skin, its moduli do
    affect the contact, so they keep their values.
    """
    fruit = design.fruit
    fruit_values = dict(IRRELEVANT_VALUES["fruit"])
    if fruit.skin_mm is not None:
        fruit_values |= {"E_MPa": fruit.E_MPa, "E_max_MPa": fruit.E_max_MPa}
    return replace(fruit, **fruit_values), replace(design.tips, **IRRELEVANT_VALUES["tips"])


def contact_compliance(
    fruit: Fruit, tips: Tips, tolerance: float = CONTACT_FRACTION * DEFAULT_TOLERANCE
) -> FruitCompliance:
    """Return E times the compliance matrix of the fruit under its tips [1/mm], from which the springs are sized.

    The tips are assumed to be level, sharp and flat, and to press vertically. Other tips are replaced by such tips. A
    filleted tip is replaced by a sharp tip, and a spherical tip by the cylinder of its diameter. A dome is replaced by
    a flat circle of half its width, placed where the dome touches. The status of the result names the replacement.

    The fruit is solved as a block, on the coarsest mesh whose relative error is within `tolerance` [1]. If no mesh is
    so accurate, the best mesh is used. The effects of the curved shape and of the skin are then added.

    Raises InputError if the scene is outside the domain of the solver for blocks (`solve/fruit/split.py`) or, for a
    curved fruit, of the solver for curved bodies (`solve/fruit/curved_body.py`). Raises SolveError if a solve does not
    converge.
    """
    is_curved = fruit.equivalent_block != fruit
    footprints = contact_footprints(fruit, tips)
    presses_along_normals = tips.tip_shape.obeys_hertz  # a smooth dome presses along the normal of the skin
    if is_curved:
        check_curved(fruit, footprints)  # checked before the block is solved, which is slow
    compliance = split_compliance(fruit, tips, tolerance)
    # Mark the result as rough if its tolerance is as wide as in a rough run.
    compliance = replace(compliance, rough=tolerance >= CONTACT_FRACTION * ROUGH_TOLERANCE)
    if is_curved:
        compliance = curved_compliance(compliance, fruit, footprints, presses_along_normals, tolerance)
    if fruit.skin_mm is not None:
        compliance = skin_compliance(compliance, fruit, footprints, presses_along_normals)
    status = _replacement_text(fruit, tips) + compliance.info.status
    return replace(compliance, info=replace(compliance.info, status=status))


def _replacement_text(fruit: Fruit, tips: Tips) -> str:
    """Return a clause that names the sharp flat tips which replace the tips of the design.

    The clause is empty if the tips of the design are sharp and flat themselves.
    """
    flat = tips.flat
    if tips.tip_shape.touches_beside_centre:
        circle = contact_footprints(fruit, tips)[0].side
        return f"the domes count as flat circles of {circle:g} mm where they touch; "
    return f"the tips count as a sharp {flat.shape} of {flat.side_mm:g} mm; " if flat != tips else ""
