"""The compliance that the fruit adds to a half-space under domes, computed from its compliance under small circles."""

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

# Error bound for a fruit with a different radius, as a multiple of the change in compliance that is scaled with the
# curvature. A separate solve for a radius of 28 mm instead of 35 mm differed by 1.2 times this change, between opposite
# domes of a square of 6 mm.
RADIUS_SCALING_ERROR = 1.25
# Error bound for a different thickness, as a fraction of the change in compliance. The change is computed for an
# infinite layer, whereas the solved block has side faces.
THICKNESS_SCALING_ERROR = 0.25


@dataclass(frozen=True, eq=False)
class FruitUnderDomes:
    """The fruit under the domes: its Poisson's ratio, and the compliance that it adds to a half-space.

    `remainder` (poses, tips, tips) [1/mm] is the added compliance times E, and `bound` is its error bound, with the
    same shape. `size` [mm] is the smallest distance from a contact to the boundary of the fruit. `feet` (tips, 2) [mm]
    are the contact points for which the compliance was solved. `skinned` describes the contact of one dome on a
    half-space of flesh under a skin; without a skin, it is None.
    """

    poisson: float
    remainder: Floats
    bound: Floats
    size: float
    feet: Floats
    skinned: RoundContact | None = None

    def select(self, poses: Ints) -> "FruitUnderDomes":
        """Return the fruit for a subset of the poses, given by their indices."""
        return replace(self, remainder=self.remainder[poses], bound=self.bound[poses])


def fruit_under_domes(scene: Scene, compliance: FruitCompliance, fruits: Sequence[Fruit]) -> FruitUnderDomes:
    """Return the compliance that fruits add to a half-space under the domes of a scene.

    `compliance` is the compliance of the scene's fruit. `fruits` holds one fruit per pose, which may differ from the
    scene's fruit in shape or thickness. The part of the compliance that the shape causes is scaled with the mean
    curvature. The change in thickness is modelled by a layer on a rigid base. The error bound covers both
    approximations.
    """
    block = scene.fruit.equivalent_block
    footprints = contact_footprints(scene.fruit, scene.tips)
    # Compliance of a half-space under the same flat circles, which is subtracted from the solved compliance.
    half_space = half_space_compliance(footprints, block.poisson)
    skinned = None
    if compliance.flesh_E is not None:
        half_space = half_space.copy()
        skinned = round_contact(layer_on(block, compliance.flesh_E), scene.tips.side_mm)
        for tip, footprint in enumerate(footprints):
            # Without the skin, the compliance of a half-space under a circle is (1 - nu^2) / side.
            with_skin = 1.0 / skinned.flat_stiffness(0.5 * footprint.side)
            half_space[tip, tip] += with_skin - (1.0 - block.poisson**2) / footprint.side
    feet = np.array([(footprint.x, footprint.y) for footprint in footprints])
    change, change_bound = _compliance_changes(scene, compliance, feet, fruits)
    error = max(compliance.error_pair, compliance.error_own)
    return FruitUnderDomes(
        poisson=block.poisson,
        remainder=compliance.S - half_space + change,
        bound=error * np.abs(compliance.S) + change_bound,
        size=min(block.height_mm, *(footprint.distance_to_edge(block) for footprint in footprints)),
        feet=feet,
        skinned=skinned,
    )


def _compliance_changes(
    scene: Scene, compliance: FruitCompliance, feet: Floats, fruits: Sequence[Fruit]
) -> tuple[Floats, Floats]:
    """Return the change in compliance to each fruit (poses,), and its error bound, both (poses, tips, tips) [1/mm]."""
    # Many poses share a fruit, so the change is computed only once per fruit.
    by_fruit: dict[int, tuple[Floats, Floats]] = {}
    changes = []
    for fruit in fruits:
        if id(fruit) not in by_fruit:
            by_fruit[id(fruit)] = _compliance_change(scene, compliance, feet, fruit)
        changes.append(by_fruit[id(fruit)])
    change, bound = zip(*changes, strict=True)
    return np.array(change), np.array(bound)


def _compliance_change(scene: Scene, compliance: FruitCompliance, feet: Floats, fruit: Fruit) -> tuple[Floats, Floats]:
    """Return the change in compliance from the scene's fruit to another fruit, times E, and its error bound.

    Both have shape (tips, tips) [1/mm]. `feet` (tips, 2) [mm] are the contact points of the domes. The change has two
    parts. The effect of the shape is assumed proportional to the mean curvature. The difference between the principal
    curvatures is neglected, and increases the bound. The effect of the thickness is computed for an infinite layer on a
    rigid base.
    """
    solved_fruit = scene.fruit
    change = np.zeros_like(compliance.S)
    bound = np.zeros_like(compliance.S)
    if scene.curved:
        solved_mean, solved_half_difference = _curvature_mean_and_half_difference(solved_fruit)
        mean, half_difference = _curvature_mean_and_half_difference(fruit)
        change = (mean / solved_mean - 1.0) * compliance.shape_change
        bound = RADIUS_SCALING_ERROR * np.abs(change)
        if fruit.radii_mm != solved_fruit.radii_mm or fruit.azimuth_deg != solved_fruit.azimuth_deg:
            half_differences = solved_half_difference + half_difference
            bound = bound + half_differences / solved_mean * np.abs(compliance.shape_change)
    if fruit.depth_mm != solved_fruit.depth_mm:
        points = tuple(map(tuple, feet.tolist()))
        base_effect = _base_effect(fruit.depth_mm, solved_fruit.poisson, points)
        thickness_change = base_effect - _base_effect(solved_fruit.depth_mm, solved_fruit.poisson, points)
        change = change + thickness_change
        bound = bound + THICKNESS_SCALING_ERROR * np.abs(thickness_change)
    return change, bound


@functools.lru_cache(maxsize=256)
def _base_effect(depth: float, poisson: float, feet: tuple[tuple[float, ...], ...]) -> Floats:
    """Return the change in a half-space's compliance due to a rigid base at a depth [mm], times E, (tips, tips) [1/mm].

    `feet` [mm] are the contact points of the domes. The result is cached because the designs of a search share it.
    """
    points = np.array(feet)
    return base_compliance(depth, poisson, np.linalg.norm(points[:, None] - points, axis=-1))


def _curvature_mean_and_half_difference(fruit: Fruit) -> tuple[float, float]:
    """Return the mean of the principal curvatures at the apex of a fruit, and half their difference, both [1/mm]."""
    first, second = (1.0 / radius for radius in fruit.radii_mm)
    return 0.5 * (first + second), 0.5 * abs(first - second)
