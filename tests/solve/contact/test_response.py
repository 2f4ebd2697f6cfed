from dataclasses import replace

import numpy as np
import pytest
from scenes import SPHERE, SPRINGS, scene_of

import solve.contact.response
import solve.contact.scene_cells
from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips
from sensor.quantity import InputError
from solve.contact.linear_response import linear_response
from solve.contact.response import scene_response
from solve.contact.scene import Scene
from solve.contact.scene_cells import scene_cells
from solve.fruit.split import split_compliance

E = (0.5, 3.5)
X = 0.1 * np.arange(1, 7)


def ahead(tilt):
    step = 4.0 * np.tan(np.radians(tilt))
    return -step, step


@pytest.mark.parametrize("shape", ["cube", "cylinder"])
def test_flat_level_faces_follow_the_linear_law(block_compliance, shape):
    found = scene_response(scene_of(shape=shape), block_compliance, SPRINGS, E, X)
    assert found.info.method == "linear"
    assert found.cells == 0
    expected = linear_response(block_compliance.S, SPRINGS, E, X)
    np.testing.assert_array_equal(found.P, expected.P)
    np.testing.assert_array_equal(found.F, expected.F)
    np.testing.assert_array_equal(found.P_error, block_compliance.difference_error)


@pytest.mark.parametrize(("tilt", "roll", "x"), [(0.5, 0.0, 0.4), (-1.0, 0.0, 0.6), (1.0, 0.5, 0.6), (0.0, 2.0, 0.6)])
def test_tilted_faces_in_full_contact_follow_the_linear_law(block_compliance, tilt, roll, x):
    """The bound of the product is 1 % of P; what is left is the moment of one tip on the slope of the other's field.

    That is (side / spacing)^2 of the crosstalk: 2e-4 of s11.
    """
    found = scene_response(scene_of(tilt=tilt, roll=roll), block_compliance, SPRINGS, (0.5,), [x])
    expected = linear_response(block_compliance.S, SPRINGS, (0.5,), [x], ahead(tilt))
    assert found.info.method == "unilateral"
    np.testing.assert_allclose(found.P, expected.P, rtol=2e-4)
    np.testing.assert_allclose(found.F[..., 0], expected.F[..., 0], rtol=2e-4)
    # the mark of full contact: with fewer cells the slopes would differ
    np.testing.assert_allclose(found.slope_ratio, expected.slope_ratio, rtol=1e-6)


@pytest.mark.parametrize("tilt", [5.0, 10.0])
def test_tilt_lifts_the_low_tip(block_compliance, tilt):
    found = scene_response(scene_of(tilt=tilt), block_compliance, SPRINGS, E, [0.2, 0.3])
    np.testing.assert_array_equal(found.F[..., 0], 0.0)
    assert np.all(np.isnan(found.P))
    assert np.all(np.isnan(found.slope_ratio))
    assert np.all(found.F[..., 1] > 0.0)
    # with its full face down the high tip alone follows its own compliance
    own = 0.3 + 4.0 * np.tan(np.radians(tilt))
    alone = own / (SPRINGS[1, 1] + block_compliance.S[1, 1] / 0.5)
    assert found.F[0, 1, 1] == pytest.approx(alone, rel=1e-4 if tilt == 5.0 else 2e-2)


def test_a_scene_too_steep_is_refused(block_compliance):
    for steep in (scene_of(tilt=21.0), scene_of(SPHERE, tilt=17.0)):
        with pytest.raises(InputError) as refused:
            scene_response(steep, block_compliance, SPRINGS, E, X)
        assert refused.value.field == "press.tilt_deg"


def test_a_scene_outside_the_domain_is_refused(block_compliance):
    with pytest.raises(InputError):
        scene_response(scene_of(tilt=1.0, offset_mm=5.0), block_compliance, SPRINGS, E, X)


@pytest.mark.parametrize(
    "where",
    [
        pytest.param({"tilt": 5.0}, marks=pytest.mark.slow),
        {"shape": "sphere"},
        pytest.param({"fillet_mm": 0.2}, marks=pytest.mark.slow),
        pytest.param({"fruit": SPHERE}, marks=pytest.mark.slow),
    ],
)
def test_error_bars_cover_a_finer_grid(block_compliance, where, monkeypatch):
    found = scene_response(scene_of(**where), block_compliance, SPRINGS, E, X)
    monkeypatch.setattr(solve.contact.scene_cells, "HALF_CELLS", (18, 36))
    finer = scene_response(scene_of(**where), block_compliance, SPRINGS, E, X)
    touching = found.F > 0.0
    change = np.abs(np.divide(finer.F, found.F, out=np.ones_like(found.F), where=touching) - 1.0)
    known = np.nan_to_num(found.F_error, nan=0.0)[..., None]
    assert np.all(change <= known)
    assert known.max() < 0.06


@pytest.mark.parametrize(
    "tilt_deg",
    [0.0, 1.0],
)
def test_error_of_the_compliance_adds(block_compliance, tilt_deg):
    """Whatever the grid: an error of the compliance that is larger by 0.02 is in both errors as it is."""
    scene = scene_of(tilt=tilt_deg)
    known, rough = (
        scene_response(scene, replace(block_compliance, difference_error=error), SPRINGS, (2.0,), [0.5, 0.6])
        for error in (0.01, 0.03)
    )
    np.testing.assert_allclose(rough.F_error - known.F_error, 0.02, rtol=1e-9)
    np.testing.assert_allclose(rough.P_error - known.P_error, 0.02, rtol=1e-9)
    assert known.F_error.min() >= 0.01
    assert known.P_error.min() >= 0.01


def test_error_of_the_rim(block_compliance, monkeypatch):
    """The rim of a contact that covers part of a face runs through cells: its share is in both errors, added."""
    ball = scene_of(shape="sphere")
    before = scene_response(ball, block_compliance, SPRINGS, (2.0,), [0.3])
    monkeypatch.setattr(solve.contact.response, "RIM", 2.0 * solve.contact.response.RIM)
    after = scene_response(ball, block_compliance, SPRINGS, (2.0,), [0.3])
    rim = after.F_error - before.F_error
    assert rim > 1e-4
    np.testing.assert_allclose(after.P_error - before.P_error, rim, rtol=1e-9)
    assert before.F_error > rim


def test_error_of_domes():
    """That of the force ratio is twice the largest of the forces, which may be off against each other."""
    dome = Scene(fruit=Fruit(), tips=Tips(shape="dome", dome_radius_mm=2.0), press=PressMotion(travel_mm=0.1))
    found = scene_response(dome, split_compliance(dome.fruit, dome.tips, 1e-3), SPRINGS, (2.0,), [0.05, 0.1])
    np.testing.assert_allclose(found.P_error, 2.0 * found.F_error, rtol=1e-12)
    assert found.F_error.min() > 0.0
    assert found.mean_pressure.shape == found.F.shape


@pytest.mark.parametrize("shape", ["cube", pytest.param("sphere", marks=pytest.mark.slow)])
def test_cells_of_a_curved_fruit_carry_what_its_body_changes(shape):
    """A whole ball gives 2 % more than its bounding box; the cells of the box answer a level press 0.05 % off."""
    ball = Fruit(shape="sphere", radius_mm=35.0, thickness_mm=65.0)
    tips = Tips(shape=shape)
    block = split_compliance(ball.equivalent_block, tips.flat)
    body = 0.02 * block.S
    compliance = replace(block, S=block.S + body, shape_change=body)
    _, grid = scene_cells(Scene(fruit=ball, tips=tips, press=PressMotion()), compliance, 0.6)
    np.testing.assert_allclose(grid.compliance_correction, body, atol=5e-4 * block.S[0, 0], rtol=0.0)
