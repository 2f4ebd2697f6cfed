"""The compliance that the fruit adds to a half-space under domes, computed from its compliance under small circles."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sensor.arrays import Floats, Ints
from sensor.design.fruit import Fruit
from solve.contact.scene import Scene
from solve.fruit.compliance import FruitCompliance
from solve.fruit.footprints import Footprint, half_space_compliance
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
    same shape. `boundary_distance` [mm] is the smallest distance from a contact to the boundary of the fruit.
    `contact_points` (tips, 2) [mm] are the points for which the compliance was solved. `skin_contact` describes the
    contact of one dome on a half-space of flesh under a skin; without a skin, it is None.
    """

    poisson: float
    remainder: Floats
    bound: Floats
    boundary_distance: float
    contact_points: Floats
    skin_contact: RoundContact | None = None

    def select(self, poses: Ints) -> "FruitUnderDomes":
        """Return the fruit for a subset of the poses, given by their indices."""
        return replace(self, remainder=self.remainder[poses], bound=self.bound[poses])


def fruit_under_domes(scene: Scene, compliance: FruitCompliance, fruits: Sequence[Fruit]) -> FruitUnderDomes:
    """Return the compliance that fruits add to a half-space under the domes of a scene.

    `compliance` is the compliance of the scene's fruit, solved for a flat circle under each dome. `fruits` holds one
    fruit per pose, which may differ from the scene's fruit in shape or thickness. The compliance is converted to these
    fruits by an approximation (`_change_to_fruit`), which the error bound covers.
    """
    block = scene.fruit.equivalent_block
    footprints = contact_footprints(scene.fruit, scene.tips)
    skin_contact = None
    if compliance.flesh_E is not None:  # the flesh has a skin
        skin_contact = round_contact(layer_on(block, compliance.flesh_E), scene.tips.side_mm)
    half_space = _half_space_part(block.poisson, footprints, skin_contact)
    contact_points = np.array([(footprint.x, footprint.y) for footprint in footprints])
    change_of_poses, change_bound = _changes_of_poses(scene, compliance, contact_points, fruits)
    error = max(compliance.difference_error, compliance.s11_error)
    # The dome law computes the half-space part itself, so it is subtracted from the solved compliance.
    return FruitUnderDomes(
        poisson=block.poisson,
        remainder=compliance.S - half_space + change_of_poses,
        bound=error * np.abs(compliance.S) + change_bound,
        boundary_distance=min(block.height_mm, *(footprint.distance_to_edge(block) for footprint in footprints)),
        contact_points=contact_points,
        skin_contact=skin_contact,
    )


def _half_space_part(poisson: float, footprints: tuple[Footprint, ...], skin_contact: RoundContact | None) -> Floats:
    """Return the compliance of a half-space under flat circles, times E [1/mm], shape (tips, tips).

    The fruit's compliance was solved for the circles `footprints`. `skin_contact` describes the contact of a circle on
    flesh under a skin; without a skin, it is None. The skin changes only the compliance of a circle under its own
    force.
    """
    half_space = half_space_compliance(footprints, poisson)
    if skin_contact is None:
        return half_space
    half_space = half_space.copy()  # the cached array is read-only
    for tip, footprint in enumerate(footprints):
        # Replace the compliance of bare flesh under a circle, (1 - nu^2) / side, by the compliance with the skin.
        with_skin = 1.0 / skin_contact.flat_stiffness(0.5 * footprint.side)
        half_space[tip, tip] += with_skin - (1.0 - poisson**2) / footprint.side
    return half_space


def _changes_of_poses(
    scene: Scene, compliance: FruitCompliance, contact_points: Floats, fruits: Sequence[Fruit]
) -> tuple[Floats, Floats]:
    """Return the change in compliance from the scene's fruit to the fruit of each pose, times E, and its error bound.

    Both have shape (poses, tips, tips) [1/mm]. `compliance` is the compliance of the scene's fruit, and `fruits` holds
    one fruit per pose. `contact_points` (tips, 2) [mm] are the points at which the domes touch.
    """
    # Many poses share one fruit object, so the change is computed only once per object.
    fruits_by_id = {id(fruit): fruit for fruit in fruits}
    changes_by_id = {
        key: _change_to_fruit(scene, compliance, contact_points, fruit) for key, fruit in fruits_by_id.items()
    }
    change, bound = zip(*[changes_by_id[id(fruit)] for fruit in fruits], strict=True)
    return np.array(change), np.array(bound)


def _change_to_fruit(
    scene: Scene, compliance: FruitCompliance, contact_points: Floats, fruit: Fruit
) -> tuple[Floats, Floats]:
    """Return the change in compliance from the scene's fruit to another fruit, times E, and its error bound.

    Both have shape (tips, tips) [1/mm]. `compliance` is the compliance of the scene's fruit, and `contact_points`
    (tips, 2) [mm] are the points at which the domes touch. The change is the sum of a change due to the shape and a
    change due to the thickness. The effect of the thickness is computed for an infinite layer on a rigid base.
    """
    solved_fruit = scene.fruit
    change = np.zeros_like(compliance.S)
    bound = np.zeros_like(compliance.S)
    if scene.is_fruit_curved:
        change, bound = _change_by_shape(solved_fruit, fruit, compliance.shape_change)
    if fruit.depth_mm != solved_fruit.depth_mm:
        points = tuple(map(tuple, contact_points.tolist()))  # tuples can be keys of the cache
        base_effect = _base_effect(fruit.depth_mm, solved_fruit.poisson, points)
        thickness_change = base_effect - _base_effect(solved_fruit.depth_mm, solved_fruit.poisson, points)
        change = change + thickness_change
        bound = bound + THICKNESS_SCALING_ERROR * np.abs(thickness_change)
    return change, bound


def _change_by_shape(solved_fruit: Fruit, fruit: Fruit, solved_effect: Floats) -> tuple[Floats, Floats]:
    """Return the change in compliance from one curved fruit to another due to their shapes, times E, and its bound.

    `solved_effect` is the effect of the curvature of `solved_fruit`, compared with a block. It is assumed proportional
    to the mean curvature. The difference between the principal curvatures is neglected, and increases the error bound.
    All arrays are (tips, tips) [1/mm].
    """
    solved_mean_curvature, solved_half_difference = _curvature_mean_and_half_difference(solved_fruit)
    mean_curvature, half_difference = _curvature_mean_and_half_difference(fruit)
    change = (mean_curvature / solved_mean_curvature - 1.0) * solved_effect
    bound = RADIUS_SCALING_ERROR * np.abs(change)
    if fruit.radii_mm != solved_fruit.radii_mm or fruit.azimuth_deg != solved_fruit.azimuth_deg:
        sum_of_half_differences = solved_half_difference + half_difference
        bound = bound + sum_of_half_differences / solved_mean_curvature * np.abs(solved_effect)
    return change, bound


@functools.lru_cache(maxsize=256)
def _base_effect(depth: float, poisson: float, contact_points: tuple[tuple[float, ...], ...]) -> Floats:
    """Return the change in a half-space's compliance due to a rigid base at a depth [mm], times E, (tips, tips) [1/mm].

    `contact_points` [mm] are the contact points of the domes. The result is cached, because all designs of a search
    share it.
    """
    points = np.array(contact_points)
    return base_compliance(depth, poisson, np.linalg.norm(points[:, None] - points, axis=-1))


def _curvature_mean_and_half_difference(fruit: Fruit) -> tuple[float, float]:
    """Return the mean of the principal curvatures at the apex of a fruit, and half their difference, both [1/mm]."""
    first, second = (1.0 / radius for radius in fruit.radii_mm)
    return 0.5 * (first + second), 0.5 * abs(first - second)
