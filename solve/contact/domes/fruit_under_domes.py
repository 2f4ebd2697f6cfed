"""The compliance that a fruit adds to a half-space under domes, from its compliance under small flat circles."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sensor.arrays import Floats, Ints
from sensor.design.fruit import Fruit
from solve.contact.scene import Scene
from solve.fruit.compliance import FruitCompliance
from solve.fruit.footprints import half_space_compliance
from solve.fruit.skin import layer_on
from solve.fruit.split import contact_footprints
from solve.halfspace.layered import RoundContact, base_compliance, round_contact

# Error bound for another radius, over the change that is scaled by the curvature. A new solve of a fruit of 28 mm
# instead of 35 mm differs by 1.2 of it, between opposite domes of a square of 6 mm.
OTHER_RADIUS = 1.25
OTHER_THICKNESS = 0.25  # error bound over the change by thickness; the solved piece has sides, the layer has none


@dataclass(frozen=True, eq=False)
class FruitUnderDomes:
    """The fruit under the domes: Poisson's ratio [1], and the compliance that it adds to a half-space.

    `remainder` (poses, tips, tips), times E [1/mm], is this compliance, `bound` the bound of its error in the same
    shape. `size` [mm] is the smallest distance from a contact to the boundary of the fruit. `feet` (tips, 2) [mm] are
    the places of the domes in the solve. `skinned` is the contact of one dome on a half-space of flesh under a skin, or
    None.
    """

    poisson: float
    remainder: Floats
    bound: Floats
    size: float
    feet: Floats
    skinned: RoundContact | None = None

    def select(self, poses: Ints) -> "FruitUnderDomes":
        """Return the body in some of the poses, given by their indices."""
        return replace(self, remainder=self.remainder[poses], bound=self.bound[poses])


def dome_body(scene: Scene, compliance: FruitCompliance, fruits: Sequence[Fruit]) -> FruitUnderDomes:
    """Return the fruit under domes as an addition to a half-space, for one fruit per pose, `fruits` (poses,).

    The fruits may differ from the fruit of the scene in shape or thickness; `compliance` belongs to the latter. The
    change by the shape is proportional to the mean curvature of each fruit. The change by the thickness is taken from a
    layer on a rigid base. The bound contains the errors of both.
    """
    block = scene.fruit.equivalent_block
    footprints = contact_footprints(scene.fruit, scene.tips)
    # The half-space under the flat circles of the solve; the body's compliance is the difference from it.
    half_space = half_space_compliance(footprints, block.poisson)
    skinned = None
    if compliance.flesh_E is not None:
        half_space = half_space.copy()
        skinned = round_contact(layer_on(block, compliance.flesh_E), scene.tips.side_mm)
        for tip, footprint in enumerate(footprints):
            # the bare half-space under a flat circle gives (1 - nu^2) / side
            own = 1.0 / skinned.flat_stiffness(0.5 * footprint.side)
            half_space[tip, tip] += own - (1.0 - block.poisson**2) / footprint.side
    feet = np.array([(footprint.x, footprint.y) for footprint in footprints])
    change, change_bound = _changes(scene, compliance, feet, fruits)
    error = max(compliance.error_pair, compliance.error_own)
    return FruitUnderDomes(
        poisson=block.poisson,
        remainder=compliance.S - half_space + change,
        bound=error * np.abs(compliance.S) + change_bound,
        size=min(block.height_mm, *(footprint.room(block) for footprint in footprints)),
        feet=feet,
        skinned=skinned,
    )


def _changes(scene: Scene, compliance: FruitCompliance, feet: Floats, fruits: Sequence[Fruit]) -> tuple[Floats, Floats]:
    """Return the change of compliance for other fruits (poses,) and its error bound, (poses, tips, tips) [1/mm]."""
    # Many poses share a fruit.
    made: dict[int, tuple[Floats, Floats]] = {}
    changes = []
    for fruit in fruits:
        if id(fruit) not in made:
            made[id(fruit)] = _change(scene, compliance, feet, fruit)
        changes.append(made[id(fruit)])
    change, bound = zip(*changes, strict=True)
    return np.array(change), np.array(bound)


def _change(scene: Scene, compliance: FruitCompliance, feet: Floats, fruit: Fruit) -> tuple[Floats, Floats]:
    """Return the change of compliance from the scene's fruit to another one, and its error bound, (tips, tips) [1/mm].

    `feet` (tips, 2) [mm] are the places where the domes touch. The change by the shape is proportional to the mean
    curvature. It neglects the difference of the principal curvatures, which is part of the bound.
    """
    solved = scene.fruit
    change = np.zeros_like(compliance.S)
    bound = np.zeros_like(compliance.S)
    if scene.curved:
        mean, saddle = _mean_and_saddle(solved)
        mean_met, saddle_met = _mean_and_saddle(fruit)
        change = (mean_met / mean - 1.0) * compliance.shape_change
        bound = OTHER_RADIUS * np.abs(change)
        if fruit.radii_mm != solved.radii_mm or fruit.azimuth_deg != solved.azimuth_deg:
            bound = bound + (saddle + saddle_met) / mean * np.abs(compliance.shape_change)
    if fruit.depth_mm != solved.depth_mm:
        under = tuple(map(tuple, feet.tolist()))
        by_base = _by_base(fruit.depth_mm, solved.poisson, under) - _by_base(solved.depth_mm, solved.poisson, under)
        change = change + by_base
        bound = bound + OTHER_THICKNESS * np.abs(by_base)
    return change, bound


@functools.lru_cache(maxsize=256)
def _by_base(depth: float, poisson: float, feet: tuple[tuple[float, ...], ...]) -> Floats:
    """Return the change of compliance due to a rigid base at a depth [mm], (tips, tips) [1/mm].

    `feet` [mm] are the places where the domes touch. It is cached for the designs of a search.
    """
    between = np.array(feet)
    return base_compliance(depth, poisson, np.linalg.norm(between[:, None] - between, axis=-1))


def _mean_and_saddle(fruit: Fruit) -> tuple[float, float]:
    """Return the mean and half the difference of the principal curvatures [1/mm]."""
    first, second = (1.0 / radius for radius in fruit.radii_mm)
    return 0.5 * (first + second), 0.5 * abs(first - second)
