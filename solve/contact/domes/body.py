"""The fruit under domes: what it adds to the half-space, from its compliance under small flat circles."""

from dataclasses import dataclass, replace

import numpy as np

from cad.arrays import Floats, Ints
from solve.contact.scene import Scene
from solve.fruit.compliance import FruitCompliance
from solve.fruit.footprints import half_space_compliance
from solve.fruit.skin import layer_on
from solve.fruit.split import contact_footprints
from solve.halfspace.layered import RoundContact, round_contact

# Of what the shape of a fruit changes, by how much less or more it may be for another radius than by its curvature: by
# 1.2 less between opposite domes of a square of 6 mm where a fruit of 28 mm instead of 35 is solved anew.
OTHER_RADIUS = 1.25


@dataclass(frozen=True, eq=False)
class Body:
    """The fruit under the domes: Poisson's ratio [1], and what it adds to a half-space.

    `remainder` (poses, tips, tips), times E [1/mm], is that of the compliance; `bound`, as the remainder, how far that
    may be off; `size` [mm] the nearest distance from a contact to what bounds the fruit; `feet` (tips, 2) [mm] where
    the domes touch as it was solved; `skinned` the contact of one dome on a half-space of the flesh under its skin,
    None without one.
    """

    poisson: float
    remainder: Floats
    bound: Floats
    size: float
    feet: Floats
    skinned: RoundContact | None = None

    def some(self, poses: Ints) -> "Body":
        """Return the body in some of the poses, by their indices."""
        return replace(self, remainder=self.remainder[poses], bound=self.bound[poses])


def dome_body(scene: Scene, compliance: FruitCompliance, radii: Floats) -> Body:
    """Return the body of the scene's fruit in poses on fruits of `radii` (poses,) [mm] along the tips.

    `compliance` is that of the scene's own fruit. What its shape changes goes with the curvature of each fruit; how far
    that may be off is in the bound.
    """
    block = scene.fruit.equivalent_block
    footprints = contact_footprints(scene.fruit, scene.tips)
    half_space = half_space_compliance(footprints, block.poisson)
    curvature_ratio = scene.fruit.radii_mm[0] / radii if scene.curved else np.ones(len(radii))
    change = np.multiply.outer(curvature_ratio - 1.0, compliance.shape_change)
    skinned = None
    if compliance.flesh_E is not None:
        half_space = half_space.copy()
        skinned = round_contact(layer_on(block, compliance.flesh_E), scene.tips.side_mm)
        for tip, footprint in enumerate(footprints):
            # the bare half-space under a flat circle gives (1 - nu^2) / side
            own = 1.0 / skinned.flat_stiffness(0.5 * footprint.side)
            half_space[tip, tip] += own - (1.0 - block.poisson**2) / footprint.side
    error = max(compliance.error_pair, compliance.error_own)
    return Body(
        poisson=block.poisson,
        remainder=compliance.S - half_space + change,
        bound=error * np.abs(compliance.S) + OTHER_RADIUS * np.abs(change),
        size=min(block.height_mm, *(footprint.room(block) for footprint in footprints)),
        feet=np.array([(footprint.x, footprint.y) for footprint in footprints]),
        skinned=skinned,
    )
