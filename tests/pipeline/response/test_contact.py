"""The fruit's compliance: which tips and fruit it is solved for, what it is where they differ, and what is kept."""

import dataclasses
import functools

import numpy as np
import pytest
from refusal import refusal
from stand_ins import CONTACT, K_M_OVER_E

import pipeline.response.contact
from pipeline.options import RunOptions
from pipeline.response.contact import contact_compliance, fruit_compliance
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.tips import PressMotion, Tips
from solve.contact.linear_response import spring_compliance
from solve.contact.pose_forces import Pose, Stand, pose_forces
from solve.contact.scene import Scene

BLOCK = Fruit()
TIPS = Tips()
GENTLE = Tips(layout="square", shape="dome", dome_radius_mm=10.0, side_mm=4.0, spacing_mm=5.0)


solved = functools.cache(contact_compliance)


def test_paper_block_takes_the_split_by_default():
    found = solved(BLOCK, TIPS)
    assert found.info.method == "split"
    assert "block of" not in found.info.status
    assert found.K_m_over_E() == pytest.approx(K_M_OVER_E, rel=1e-4)


@pytest.mark.parametrize(
    ("tips", "flat", "words"),
    [
        (Tips(fillet_mm=0.1), TIPS, "a sharp cube of 1 mm"),
        (Tips(shape="sphere"), Tips(shape="cylinder"), "a sharp cylinder of 1 mm"),
    ],
    ids=["fillet", "sphere"],
)
def test_tips_are_sized_by_their_sharp_flat_reference(tips, flat, words):
    found = contact_compliance(BLOCK, tips)
    np.testing.assert_array_equal(found.S, solved(BLOCK, flat).S)
    assert f"the tips count as {words}" in found.info.status


def test_a_curved_fruit_is_its_block_and_what_its_shape_changes():
    piece = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=20.0, thickness_mm=12.0)
    block, found = solved(BLOCK, TIPS), contact_compliance(piece, TIPS)
    assert pytest.approx(block.S + found.shape_change) == found.S
    assert 1e-3 < 1.0 - found.K_m_over_E() / block.K_m_over_E() < 3e-3
    assert "s11 - s12 changes by +0.16 % in the shape of the sphere" in found.info.status


BALL = Fruit(shape="sphere", radius_mm=35.0, thickness_mm=12.0)
EGG = Fruit(shape="ellipsoid", radius_mm=47.0, radius_across_mm=110.0, length_mm=30.0, width_mm=30.0, thickness_mm=12.0)
SOFT, STIFF = spring_compliance(0.15, 1.4, 0.15, 1.4), spring_compliance(1.2, 20.0, 1.2, 20.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fruit", "C", "travel", "met"),
    [
        (EGG, SOFT, 0.8, {"radii_mm": (42.0, 86.0), "azimuth_deg": 45.0}),
        *(
            pytest.param(*case, marks=pytest.mark.study)
            for case in [
                (BALL, STIFF, 0.4, {"radii_mm": (28.0, 28.0)}),
                (BALL, STIFF, 0.4, {"radii_mm": (42.0, 42.0)}),
                (EGG, SOFT, 0.8, {"radii_mm": (53.0, 144.0), "azimuth_deg": 135.0}),
                (EGG, SOFT, 0.8, {"radii_mm": (47.0, 110.0), "azimuth_deg": 0.0, "thickness_mm": 8.0}),
                (EGG, SOFT, 0.8, {"radii_mm": (47.0, 110.0), "azimuth_deg": 0.0, "thickness_mm": 20.0}),
                (EGG, SOFT, 0.8, {"radii_mm": (42.0, 86.0), "azimuth_deg": 45.0, "thickness_mm": 8.0}),
                (EGG, SOFT, 0.8, {"radii_mm": (42.0, 144.0), "azimuth_deg": 0.0, "thickness_mm": 20.0}),
            ]
        ),
    ],
)
def test_domes_on_a_fruit_of_other_radii_and_thickness(fruit, C, travel, met):
    """The compliance of one fruit serves others within the bar: against the compliance of each, solved anew."""
    tips = dataclasses.replace(GENTLE, side_mm=5.8, spacing_mm=6.0)
    along, across = met["radii_mm"]
    own = {"radius_mm": along, **({"radius_across_mm": across} if fruit is EGG else {})}
    other = dataclasses.replace(
        fruit, **own, **{key: met[key] for key in ("azimuth_deg", "thickness_mm") if key in met}
    )
    stand = Stand(from_touch=fruit is EGG, tilt_deg=(1.0, 0.0), **met)
    poses = [Pose(E=E, travel=travel, stand=stand) for E in (0.5, 3.5)]
    scenes = [Scene(fruit=of, tips=tips, press=PressMotion(travel_mm=travel)) for of in (fruit, other)]
    found, anew = (pose_forces(scene, solved(scene.fruit, tips), C, poses) for scene in scenes)
    assert np.all(np.abs(found.F - anew.F) <= found.F_error)
    assert np.all(found.F_error >= anew.F_error if fruit is EGG else found.F_error > anew.F_error)


def test_line_has_a_row_for_each_tip():
    found = contact_compliance(BLOCK, Tips(layout="line", order="LHL", spacing_mm=2.5))
    assert found.tips == ("low_1", "high", "low_2")
    assert found.S[0, 1] == pytest.approx(found.S[2, 1], rel=1e-12)
    assert found.S[0, 0] > found.S[0, 1] > found.S[0, 2] > 0.0


SPHERE = {"shape": "sphere", "thickness_mm": 4.0}


@pytest.mark.parametrize(
    ("fruit", "tips", "field", "value"),
    [
        (Fruit(radius_mm=3.0, **SPHERE), Tips(spacing_mm=2.0), "fruit.radius_mm", 3.0),
        # the plan that is given may be larger than the fruit: tips then stand beside it
        (
            Fruit(radius_mm=5.0, length_mm=30.0, width_mm=30.0, **SPHERE), Tips(spacing_mm=12.0),
            "centre of a tip, x", -6.0,
        ),
    ],
)  # fmt: skip
def test_fruit_out_of_bounds_is_refused_before_a_block_is_solved(fruit, tips, field, value, monkeypatch):
    monkeypatch.setattr(pipeline.response.contact, "split_compliance", lambda *_: pytest.fail("the block was solved"))
    refused = refusal(contact_compliance, fruit, tips)
    assert (refused.field, refused.value) == (field, value)


@pytest.mark.parametrize("tips", [Tips(layout="square", spacing_mm=17.1), Tips(offset_mm=4.6)], ids=["square", "pair"])
def test_tips_nearer_than_a_side_to_a_side_face_are_refused(tips):
    refused = refusal(contact_compliance, BLOCK, tips)
    assert refused.field == "gap from tip to side face"
    assert refused.value == pytest.approx(0.5 * BLOCK.length_mm - max(map(max, tips.places_mm)) - 0.5)


def test_compliance_is_kept_whatever_the_modulus_and_solved_again_for_another_fruit(tmp_path, monkeypatch):
    """It is that of the fruit times E, so no modulus enters it; the height and the tolerance do."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    solved = []
    stand_in = dataclasses.replace(CONTACT)
    monkeypatch.setattr(pipeline.response.contact, "contact_compliance", lambda *each: solved.append(each) or stand_in)
    stiffer = Fruit(E_max_MPa=5.0, E_MPa=(1.0, 5.0), bruise_limit_MPa=1.0)
    for fruit in (BLOCK, stiffer):
        assert np.array_equal(fruit_compliance(Design(fruit=fruit), RunOptions()).S, CONTACT.S)
    assert len(solved) == 1
    fruit_compliance(Design(fruit=Fruit(height_mm=11.0)), RunOptions())
    fruit_compliance(Design(), RunOptions(tolerance=0.01))
    assert len(solved) == 3
