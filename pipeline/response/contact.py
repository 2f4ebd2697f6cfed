"""The compliance of the fruit under the tips: the compliance of its block, changed by shape and skin."""

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

_BESIDE_CONTACT = (
    *("name", "E_MPa", "E_max_MPa", "poisson_spread", "bruise_limit_MPa", "relaxation"),
    *("roughness_mm", "roughness_wave_mm", "flesh_scatter_percent"),
)
BESIDE_CONTACT: dict[str, dict[str, Any]] = {
    "fruit": {key: getattr(Fruit(), key) for key in _BESIDE_CONTACT},
    "tips": {"gap_mm": 0.0, "socket": "none"},
}
"""Keys that do not affect the compliance of a fruit times its modulus, each with one value for all designs."""


def fruit_compliance(design: Design, options: RunOptions) -> FruitCompliance:
    """Return the compliance of the fruit under all tips [1/mm], cached; raises like `contact_compliance`."""
    solve = partial(contact_compliance, design.fruit, design.tips, options.contact_tolerance)
    fruit, tips = contact_scene(design)
    inputs = {"fruit": fruit, "tips": tips, "tol": options.contact_tolerance}
    return load_or_compute("contact", inputs, solve, FruitCompliance)


def contact_scene(design: Design) -> tuple[Fruit, Tips]:
    """Return fruit and tips with a fixed value in each field that does not affect their contact.

    Designs that differ only in such fields then share one cached solution. Under a skin the moduli affect the contact,
    so they keep their values.
    """
    fruit = design.fruit
    moduli = {} if fruit.skin_mm is None else {"E_MPa": fruit.E_MPa, "E_max_MPa": fruit.E_max_MPa}
    return replace(fruit, **BESIDE_CONTACT["fruit"] | moduli), replace(design.tips, **BESIDE_CONTACT["tips"])


def contact_compliance(
    fruit: Fruit, tips: Tips, tolerance: float = CONTACT_FRACTION * DEFAULT_TOLERANCE
) -> FruitCompliance:
    """Solve the compliance matrix of the fruit under its tips, times E [1/mm], which sizes the springs.

    The tips are level, sharp and flat, and press vertically. Other tips are replaced by such tips. A filleted tip
    becomes a sharp one, a spherical tip the cylinder of its diameter, and a dome a circle of half its width at the
    contact. The status of the result names the replacement. The fruit is solved as a block, on the coarsest mesh whose
    error meets the relative `tolerance`. The effects of its curved shape and of its skin are then added. Raises
    InputError for a scene outside the domain of the block's solver (`solve/fruit/split.py`), or for a curved fruit
    outside its own domain (`solve/fruit/curved_body.py`).
    """
    is_curved = fruit.equivalent_block != fruit
    footprints = contact_footprints(fruit, tips)
    presses_along_normals = tips.tip_shape.obeys_hertz  # a smooth dome presses along the normal of the skin
    if is_curved:
        check_curved(fruit, footprints)  # first, because the block takes long to solve
    compliance = split_compliance(fruit, tips, tolerance)
    compliance = replace(compliance, rough=tolerance >= CONTACT_FRACTION * ROUGH_TOLERANCE)
    if is_curved:
        compliance = curved_compliance(compliance, fruit, footprints, presses_along_normals, tolerance)
    if fruit.skin_mm is not None:
        compliance = skin_compliance(compliance, fruit, footprints, presses_along_normals)
    info = replace(compliance.info, status=f"{_replacement_text(fruit, tips)}{compliance.info.status}")
    return replace(compliance, info=info)


def _replacement_text(fruit: Fruit, tips: Tips) -> str:
    """Return a clause on the sharp flat tips that replace those of the design; empty if these are sharp and flat."""
    flat = tips.flat
    if tips.tip_shape.touches_beside_centre:
        circle = contact_footprints(fruit, tips)[0].side
        return f"the domes count as flat circles of {circle:g} mm where they touch; "
    return f"the tips count as a sharp {flat.shape} of {flat.side_mm:g} mm; " if flat != tips else ""
