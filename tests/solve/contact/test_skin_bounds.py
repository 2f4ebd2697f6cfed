"""A skin beyond what a half-space under each tip can carry is refused with the bound of its modulus, which holds."""

import re
from dataclasses import replace

import numpy as np
import pytest

from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips
from sensor.quantity import InputError
from solve.contact.pose_forces import Pose, pose_forces
from solve.contact.response import scene_response
from solve.contact.scene import Scene
from solve.fruit.skin import skin_compliance
from solve.fruit.split import contact_footprints, split_compliance

SPRINGS = np.diag([1.0 / 0.753, 1.0 / 17.3])  # mm/N, of the paper
BLOCK = Fruit(length_mm=20.0, width_mm=14.0, height_mm=6.0, poisson=0.3, E_MPa=(0.25,), E_max_MPa=0.25)
TIPS = Tips(side_mm=3.0, spacing_mm=6.0)
STIFF = replace(BLOCK, skin_mm=0.5, skin_E_MPa=2e4)
SOFT_IN_SHEAR = replace(BLOCK, poisson=-0.499, skin_mm=0.02, skin_E_MPa=0.26, skin_poisson=0.49)


def scene_of(fruit):
    scene = Scene(fruit=fruit, tips=TIPS, press=PressMotion(tilt_deg=1.0))
    bare = split_compliance(fruit, TIPS, tolerance=0.02)
    return scene, replace(skin_compliance(bare, fruit, contact_footprints(fruit, TIPS)), rough=True)


def pressed_over_travel(scene, compliance):
    return scene_response(scene, compliance, SPRINGS, [0.25], [0.1])


def pressed_in_a_pose(scene, compliance):
    return pose_forces(scene, compliance, SPRINGS, [Pose(E=0.25, travel=0.1)])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fruit", "word", "press"),
    [
        (STIFF, "at most", pressed_in_a_pose),
        pytest.param(SOFT_IN_SHEAR, "at least", pressed_over_travel, marks=pytest.mark.study),
    ],
)
def test_skin_out_of_bounds_is_refused_with_a_bound_that_holds(fruit, word, press):
    """Both presses take the bound from one function; it is sought where one of them cannot be solved."""
    scene, compliance = scene_of(fruit)
    with pytest.raises(InputError) as refused:
        press(scene, compliance)
    assert refused.value.field == "fruit.skin_E_MPa"
    assert word in refused.value.bound
    bound = float(re.search(rf"{word} ([0-9.e+-]+) MPa", refused.value.bound)[1])
    assert press(*scene_of(replace(fruit, skin_E_MPa=bound))).F.min() > 0.0
