"""A skin along the chain: springs, verdicts, readings, firmware; what is not solved is refused by name."""

import dataclasses

import numpy as np
import pytest
from refusal import refusal
from squares import BALL
from stand_ins import with_compliance

from pipeline.options import RunOptions, load_design
from pipeline.reading.measurement import RiseModel, seated_level_readings
from pipeline.reading.reading_over_time import refuse_unsolvable_time
from pipeline.response.contact import contact_scene
from pipeline.response.scene_press import scene_of
from pipeline.sensor import refuse_unsolvable
from pipeline.springs.sizing import fruit_stiffening, spring_sizing
from sensor.theory.two_spring_law import (
    curve_nonlinearity,
    curve_shares,
    size_springs,
)
from solve.contact.linear_response import spring_compliance
from solve.contact.pose_forces import Pose, Stand, pose_forces
from solve.contact.response import scene_response
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance, SkinTable
from solve.fruit.footprints import level_compliance
from solve.fruit.split import contact_footprints

SKIN = {"fruit.skin_mm": 0.3, "fruit.skin_E_MPa": 10.0, "targets.NL": 0.1}
FLESH = np.array([[0.7666, 0.0105], [0.0105, 0.7666]])


def skinned(E):
    """Return a compliance under a skin as it might be: softer flesh has the stiffer surface over its own modulus."""
    own = 0.7666 / (1.0 + 0.6 * E**-0.4)
    return np.array([[own, 0.011], [0.011, own]])


@pytest.fixture
def contact():
    E = np.geomspace(0.1, 5.0, 13)
    info = SolveInfo(method="", dofs=0, seconds=0.0, status="")
    table = SkinTable(E=E, S=np.array([skinned(each) for each in E]))
    return FruitCompliance(S=FLESH, difference_error=1e-4, s11_error=1e-4, info=info, skin=table)


def test_springs_under_a_skin_meet_both_targets_over_the_modulus(contact):
    design = load_design("paper", SKIN)
    sizing = spring_sizing(design, contact, RunOptions())
    C = spring_compliance(*sizing.springs.stiffnesses)
    moduli = 3.5 * np.array(curve_shares(24))
    P = scene_response(scene_of(design), contact, C, moduli, [0.6]).P[:, -1]
    assert P[-1] == pytest.approx(design.targets.P_max, rel=1e-9)
    assert curve_nonlinearity(P.tolist(), moduli.tolist(), "mid-range") == pytest.approx(0.1, abs=1e-5)


@pytest.mark.parametrize("definition", ["mid-range", "largest"])
def test_without_a_skin_the_curve_gives_the_springs_of_the_closed_form(definition):
    closed = size_springs(5.0, 0.05, 4.6, definition)
    by_curve = size_springs(5.0, 0.05, 4.6, definition, stiffening=curve_shares(24))
    # P has risen by (5 - 0.2) 1e-9 where the curve begins: by 6e-10 of its rise at mid-range, 1.2e-8 of NL.
    assert by_curve.stiffnesses == pytest.approx(
        closed.stiffnesses, rel={"mid-range": 1.5e-8, "largest": 2e-3}[definition]
    )


def test_an_nl_that_the_skin_alone_exceeds_is_refused(contact):
    design = load_design("paper", {**SKIN, "targets.NL": 0.01})
    assert refusal(spring_sizing, design, contact, RunOptions()).field == "targets.NL"


def test_stiffening_is_the_fruit_stiffness_over_the_modulus(contact):
    stiffening = fruit_stiffening(3.5, contact)
    middle = 1.75 / (skinned(1.75)[0, 0] - 0.011) / (3.5 / (skinned(3.5)[0, 0] - 0.011))
    assert (stiffening[12], stiffening[-1]) == pytest.approx((middle, 1.0), rel=1e-5)


def test_a_press_under_a_skin_reads_the_modulus_of_the_flesh(contact):
    """More level readings correct it than without a skin; flesh alone would have to be stiffer."""
    design = load_design("paper", SKIN)
    C = spring_compliance(1.3, 49.0)
    sensor = with_compliance(design, contact, C)
    model = RiseModel(law=sensor.law, level=seated_level_readings(sensor))
    assert len(model.level) == 25
    for E in (0.5, 1.2, 3.5):
        press = scene_response(scene_of(design), contact, C, [E], np.linspace(0.1, 0.6, 12)).F[0]
        assert model.read_modulus(press) == pytest.approx(E, rel=5e-4)
        assert dataclasses.replace(model, level=()).read_modulus(press) > 1.2 * E


def test_moduli_count_for_the_contact_of_a_fruit_with_a_skin_alone():
    bare = [load_design("paper", {"fruit.E_max_MPa": E}) for E in (3.0, 3.5)]
    skins = [load_design("paper", {**SKIN, "fruit.E_max_MPa": E}) for E in (3.0, 3.5)]
    assert contact_scene(bare[0]) == contact_scene(bare[1])
    assert contact_scene(skins[0]) != contact_scene(skins[1])


@pytest.mark.parametrize(
    ("refuse", "design", "settings", "field"),
    [
        (refuse_unsolvable, "paper", {"tips.shape": "sphere", "tips.socket": "pin"}, "fruit.skin_mm"),
        (refuse_unsolvable, BALL, {"fruit.length_mm": None, "fruit.width_mm": None}, "fruit.skin_mm"),
        (
            refuse_unsolvable_time,
            "paper",
            {"fruit.relaxation": "[[0.3, 10.0]]", "press.speed_mm_per_s": 1.0, "press.hold_s": 5.0},
            "fruit.relaxation",
        ),
    ],
)
def test_scene_under_a_skin_that_is_not_solved_is_refused(refuse, design, settings, field):
    skin = {"fruit.skin_mm": 0.3, "fruit.skin_E_MPa": 10.0}
    assert refusal(refuse, load_design(design, {**skin, **settings})).field == field


def test_domes_on_a_skin_as_the_flesh_have_the_forces_of_flesh_alone(contact):
    """Of the mango's sensor, level and tilted; its skin changes nothing, and 10 MPa is the modulus of the skin.

    Under a skin the strain is small: what large strain does to flesh is in the bar, and nothing else is.
    """
    design = load_design("mango", {"fruit.skin_mm": 0.3, "fruit.skin_E_MPa": 10.0, "reading.calibrated_by": "plate"})
    flesh = level_compliance(contact_footprints(design.fruit, design.tips), design.fruit.poisson, np.zeros(()), 5)
    E = np.geomspace(0.1, 12.0, 13)
    bare = dataclasses.replace(contact, tips=design.tips.names, S=flesh, shape_change=np.zeros(()), skin=None)
    skinned = dataclasses.replace(bare, skin=SkinTable(E=E, S=np.array([flesh for _ in E])))
    C = spring_compliance(*design.tips.each(0.15, 1.6))
    poses = [Pose(E=10.0, travel=0.5, stand=Stand(tilt_deg=tilt)) for tilt in ((0.0, 0.0), (2.0, 1.0))]
    found, of_flesh = (pose_forces(scene_of(design), of, C, poses) for of in (skinned, bare))
    assert (np.abs(found.F - of_flesh.F) <= found.F_error).all()
    np.testing.assert_allclose(found.F, of_flesh.F, rtol=1e-3)
