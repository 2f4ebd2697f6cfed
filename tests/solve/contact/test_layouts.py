"""Contact of tips anywhere: a layout turned with its press reads the same, and tilt turns about the mean centre."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scenes import BLOCK, SPHERE

import solve.contact.scene_cells
from sensor.design.tips import PressMotion, Tips
from solve.contact.linear_response import spring_compliance
from solve.contact.response import scene_response
from solve.contact.scene import Scene
from solve.contact.scene_cells import scene_footprints
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance
from solve.fruit.footprints import Footprint
from solve.fruit.split import LEVELS, footprint_compliance

TIPS = Tips(layout="square", spacing_mm=4.0)
SQUARE = TIPS.places_mm
C = spring_compliance(0.9, 20.0, 0.9, 20.0)
SYMMETRY = 1e-7  # of forces: the meshes are turned with the layout, the active set is the same


@cache
def square_S():
    return footprint_compliance(BLOCK, [Footprint(x, y, 1.0) for x, y in SQUARE], LEVELS[0]).S


def pressed(fruit=BLOCK, tilt=0.0, roll=0.0, springs=C):
    info = SolveInfo(method="", dofs=0, seconds=0.0, status="")
    compliance = FruitCompliance(tips=tuple("abcd"), S=square_S(), difference_error=1e-4, s11_error=1e-4, info=info)
    scene = Scene(fruit=fruit, tips=TIPS, press=PressMotion(tilt_deg=tilt, roll_deg=roll))
    return scene_response(scene, compliance, springs, (1.0,), (0.2, 0.6))


def test_tilt_and_roll_of_a_square_are_the_same_seen_from_its_sides(monkeypatch):
    """Mirrored at x = y, tips 0 and 2 stay, 1 and 3 change places, and tilt becomes roll."""
    monkeypatch.setattr(solve.contact.scene_cells, "WHOLE_CELLS", (4, 6))
    tilted, rolled = pressed(SPHERE, tilt=2.0), pressed(SPHERE, roll=2.0)
    np.testing.assert_allclose(rolled.F[..., [0, 3, 2, 1]], tilted.F, rtol=SYMMETRY)
    assert tilted.info.method == "unilateral"


def test_first_touch_off_the_axis_is_under_the_inner_corner():
    inner = 1.5**2 + 1.5**2
    scene = Scene(fruit=SPHERE, tips=TIPS, press=PressMotion())
    assert scene.first_touch_mm == pytest.approx(35.0 - np.sqrt(35.0**2 - inner), rel=1e-9)
    # a sphere of radius 0.5 touches where the tangents agree: (R + r) less the rest, from the centres' distance
    round_tips = Scene(fruit=SPHERE, tips=replace(TIPS, shape="sphere"), press=PressMotion())
    assert round_tips.first_touch_mm == pytest.approx(35.5 - np.sqrt(35.5**2 - 8.0), rel=1e-9)


@pytest.mark.parametrize("tips", [replace(TIPS, shape="sphere"), replace(TIPS, shape="dome", dome_radius_mm=3.0)])
def test_squares_of_cells_under_curved_tips_move_with_the_sensor(tips):
    scene = Scene(fruit=replace(BLOCK, length_mm=40.0), tips=tips, press=PressMotion(tilt_deg=1.0, roll_deg=2.0))
    here = scene_footprints(scene, 0.3)
    there = scene_footprints(replace(scene, off_centre_mm=(1.0, -1.5)), 0.3)
    for before, after in zip(here, there, strict=True):
        assert (after.x - before.x, after.y - before.y) == pytest.approx((1.0, -1.5))
        assert after.side == pytest.approx(before.side)
