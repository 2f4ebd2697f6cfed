"""The fruit's compliance under the tips by the method that fits the scene: the split in its domain, else direct FE."""

from cad.design.fruit import Fruit
from cad.design.parameters import Design
from cad.design.tips import Tips
from mesh.fruit import REFINEMENTS, fruit_meshes, fruit_size
from mesh.volume import volume_mesh
from pipeline.options import CONTACT_SHARE, DEFAULT_TOLERANCE, RunOptions, contact_inputs
from pipeline.response.level_contact import level_compliance
from pipeline.storage.cache import cached
from solve.fruit.compliance import FruitCompliance
from solve.fruit.direct import direct_compliance

_FACETED = 0.02  # of an area: the circle of a cylinder's face on the coarsest mesh, 31 edges, misses 0.7 %


def fruit_compliance(design: Design, options: RunOptions) -> FruitCompliance:
    """Return the compliance of the fruit under all tips [1/mm], kept by what it depends on; raises as below."""
    method, tolerance = options.contact_method, options.contact_tolerance
    return cached(
        "contact",
        contact_inputs(design, options),
        lambda: contact_compliance(design.fruit, design.tips, method, tolerance),
        FruitCompliance,
    )


def contact_compliance(
    fruit: Fruit, tips: Tips, method: str = "auto", tolerance: float = CONTACT_SHARE * DEFAULT_TOLERANCE
) -> FruitCompliance:
    """Return the compliance [1/mm] that sizes the springs, as `level_compliance`, direct solves on meshes of solids."""
    return level_compliance(fruit, tips, method, tolerance, direct_contact)


def direct_contact(block: Fruit, tips: Tips) -> FruitCompliance:
    """Return the compliance [1/mm] of a block under a flat pair by direct finite elements."""
    if not tips.tip_shape.is_round:
        return direct_compliance(fruit_meshes(block, tips), block.poisson)
    from cad.parts.fruit import solved_block  # loads the CAD kernel

    part = solved_block(block, tips)
    sizes = (fruit_size(part, block, tips, scale) for scale in REFINEMENTS)
    return direct_compliance([volume_mesh(part, size, tolerance=_FACETED) for size in sizes], block.poisson)
