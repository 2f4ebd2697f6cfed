from dataclasses import replace

import numpy as np
import pytest

import solve.contact.response
import solve.contact.scene_cells
from cad.design.fruit import Fruit
from cad.design.tips import Press, Tips
from cad.quantity import InputError
from solve.contact.linear_response import linear_response
from solve.contact.response import scene_response
from solve.contact.scene import Scene
from solve.contact.scene_cells import scene_cells
from solve.fruit.split import split_compliance

BLOCK = Fruit()
SPHERE = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=20.0)
C = np.diag([1.0 / 0.9057, 1.0 / 20.831])  # mm/N, springs of the paper's targets
E = (0.5, 3.5)
X = 0.1 * np.arange(1, 7)


@pytest.fixture(scope="module")
def compliance():
    return split_compliance(BLOCK, Tips())


def scene(fruit=BLOCK, tilt=0.0, roll=0.0, **tips):
    return Scene(fruit=fruit, tips=Tips(**tips), press=Press(tilt_deg=tilt, roll_deg=roll))


def ahead(tilt):
    step = 4.0 * np.tan(np.radians(tilt))
    return -step, step


@pytest.mark.parametrize("shape", ["cube", "cylinder"])
def test_flat_level_faces_follow_the_linear_law(compliance, shape):
    found = scene_response(scene(shape=shape), compliance, C, E, X)
    assert found.info.method == "linear"
    assert found.cells == 0
    expected = linear_response(compliance.S, C, E, X)
    np.testing.assert_array_equal(found.P, expected.P)
    np.testing.assert_array_equal(found.F, expected.F)
    np.testing.assert_array_equal(found.P_error, compliance.error_pair)


@pytest.mark.parametrize(("tilt", "roll", "x"), [(0.5, 0.0, 0.4), (-1.0, 0.0, 0.6), (1.0, 0.5, 0.6), (0.0, 2.0, 0.6)])
def test_tilted_faces_in_full_contact_follow_the_linear_law(compliance, tilt, roll, x):
    """The bound of the product is 1 % of P; what is left is the moment of one tip on the slope of the other's field.

    That is (side / spacing)^2 of the crosstalk: 2e-4 of s11.
    """
    found = scene_response(scene(tilt=tilt, roll=roll), compliance, C, (0.5,), [x])
    expected = linear_response(compliance.S, C, (0.5,), [x], ahead(tilt))
    assert found.info.method == "unilateral"
    np.testing.assert_allclose(found.P, expected.P, rtol=2e-4)
    np.testing.assert_allclose(found.F[..., 0], expected.F[..., 0], rtol=2e-4)
    # the mark of full contact: with fewer cells the slopes would differ
    np.testing.assert_allclose(found.slope_ratio, expected.slope_ratio, rtol=1e-6)


@pytest.mark.parametrize("tilt", [5.0, 10.0])
def test_tilt_lifts_the_low_tip(compliance, tilt):
    found = scene_response(scene(tilt=tilt), compliance, C, E, [0.2, 0.3])
    np.testing.assert_array_equal(found.F[..., 0], 0.0)
    assert np.all(np.isnan(found.P))
    assert np.all(np.isnan(found.slope_ratio))
    assert np.all(found.F[..., 1] > 0.0)
    # with its full face down the high tip alone follows its own compliance
    own = 0.3 + 4.0 * np.tan(np.radians(tilt))
    alone = own / (C[1, 1] + compliance.S[1, 1] / 0.5)
    assert found.F[0, 1, 1] == pytest.approx(alone, rel=1e-4 if tilt == 5.0 else 2e-2)


def test_a_scene_too_steep_is_refused(compliance):
    for steep in (scene(tilt=21.0), scene(SPHERE, tilt=17.0)):
        with pytest.raises(InputError) as refused:
            scene_response(steep, compliance, C, E, X)
        assert refused.value.field == "press.tilt_deg"


def test_a_scene_outside_the_domain_is_refused(compliance):
    with pytest.raises(InputError):
        scene_response(scene(tilt=1.0, offset_mm=5.0), compliance, C, E, X)


@pytest.mark.parametrize(
    "where",
    [
        {"tilt": 5.0},
        {"shape": "sphere"},
        pytest.param({"fillet_mm": 0.2}, marks=pytest.mark.slow),
        pytest.param({"fruit": SPHERE}, marks=pytest.mark.slow),
    ],
)
def test_error_bars_cover_a_finer_grid(compliance, where, monkeypatch):
    found = scene_response(scene(**where), compliance, C, E, X)
    monkeypatch.setattr(solve.contact.scene_cells, "HALF_CELLS", (18, 36))
    finer = scene_response(scene(**where), compliance, C, E, X)
    touching = found.F > 0.0
    change = np.abs(np.divide(finer.F, found.F, out=np.ones_like(found.F), where=touching) - 1.0)
    known = np.nan_to_num(found.F_error, nan=0.0)[..., None]
    assert np.all(change <= known)
    assert known.max() < 0.06


@pytest.mark.parametrize("shape", ["cube", pytest.param("sphere", marks=pytest.mark.slow)])
def test_cells_of_a_curved_fruit_carry_what_its_body_changes(shape):
    """A whole ball gives 2 % more than its bounding box; the cells of the box answer a level press 0.05 % off."""
    ball = Fruit(shape="sphere", radius_mm=35.0, thickness_mm=65.0)
    tips = Tips(shape=shape)
    block = split_compliance(ball.equivalent_block, tips.flat)
    body = 0.02 * block.S
    compliance = replace(block, S=block.S + body, shape_change=body)
    _, grid = scene_cells(Scene(fruit=ball, tips=tips, press=Press()), compliance, 0.6)
    np.testing.assert_allclose(grid.compliance_correction, body, atol=5e-4 * block.S[0, 0], rtol=0.0)
