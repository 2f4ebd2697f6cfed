import dataclasses

import numpy as np
import pytest
from bars import bars, holds

from benchmarks.bars.truths import TRUTHS
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from sensor.quantity import InputError
from solve.fruit.footprints import Footprint, level_compliance
from solve.fruit.split import (
    LEAST_STEP,
    LEVELS,
    NODE_ERROR,
    ROUGH,
    SAFETY,
    check_domain,
    contact_footprints,
    footprint_compliance,
    largest_errors,
    level_errors,
    mesh_dofs,
    relative_changes,
    split_compliance,
)
from solve.halfspace.punch import circle_punch, square_punch
from solve.linear import SolveError

BLOCK = Fruit(length_mm=20.0, width_mm=20.0, height_mm=12.0, poisson=0.3)
TIPS = Tips(side_mm=1.0, spacing_mm=8.0)
PAIR = (Footprint(-4.0, 0.0, 1.0), Footprint(4.0, 0.0, 1.0))


def paired(S):
    """Return the mean of s11 and s22 less s12."""
    return 0.5 * (S[0][0] + S[1][1]) - S[0][1]


@pytest.mark.parametrize("name", bars("paper"))
def test_error_bar_holds(name):
    holds(name)


def test_far_tips_superpose_on_the_half_space():
    feet = (Footprint(-50.0, 0.0, 1.0), Footprint(50.0, 0.0, 2.0), Footprint(500.0, 0.0, 1.0, circle_punch))
    S = level_compliance(feet, 0.3, np.zeros((27, 27)), 3)
    own = [1.0 / 1.152302, 0.5 / 1.152302, 1.0]
    expected = [
        [own[i] if i == j else 1.0 / (np.pi * abs(a.x - b.x)) for j, b in enumerate(feet)] for i, a in enumerate(feet)
    ]
    # punches of finite size a see each other as points but for (a / distance)^2, 4e-4 of the crosstalk
    np.testing.assert_allclose(S, (1.0 - 0.3**2) * np.array(expected), rtol=4e-4)


@pytest.mark.parametrize(
    ("fruit", "tips", "name"),
    [
        ({"length_mm": 10.9}, {}, "gap from tip to side face"),
        ({"width_mm": 2.9}, {}, "gap from tip to side face"),
        ({}, {"offset_mm": 4.6}, "gap from tip to side face"),
        ({"height_mm": 0.9}, {}, "tips.side_mm"),
        ({"poisson": 0.49995}, {}, "fruit.poisson"),
        ({"poisson": -0.51}, {}, "fruit.poisson"),
        ({}, {"spacing_mm": 1.04}, "tips.spacing_mm"),
    ],
)
def test_scenes_outside_the_domain_are_refused(fruit, tips, name):
    with pytest.raises(InputError, match=rf"^{name} "):
        split_compliance(dataclasses.replace(BLOCK, **fruit), dataclasses.replace(TIPS, **tips))


def test_bounds_of_the_domain_belong_to_it():
    check_domain(dataclasses.replace(BLOCK, length_mm=11.0, width_mm=3.0, height_mm=1.0, poisson=0.4999), PAIR)
    check_domain(BLOCK, (Footprint(-0.6, 0.0, 1.0), Footprint(0.6, 0.0, 1.0)))


def test_a_scene_that_does_not_converge_is_refused(monkeypatch):
    monkeypatch.setattr("solve.fruit.split.LEVELS", LEVELS[:1])
    monkeypatch.setattr("solve.fruit.split.LARGEST_ERROR", 1e-6)
    with pytest.raises(InputError):
        split_compliance(BLOCK, TIPS, 1e-6)


@pytest.mark.parametrize(
    ("tolerance", "grading"), [(0.02, ROUGH), (1e-3, LEVELS[0]), pytest.param(5e-5, LEVELS[1], marks=pytest.mark.slow)]
)
def test_the_coarsest_mesh_that_meets_the_tolerance_is_taken(tolerance, grading):
    truth = TRUTHS["paper's block"]
    found = split_compliance(BLOCK, TIPS, tolerance)
    error = abs(paired(found.S) / truth.values[0] - 1.0)
    assert found.info.dofs == mesh_dofs(BLOCK, PAIR, grading) == footprint_compliance(BLOCK, PAIR, grading).dofs
    assert error < found.difference_error + truth.relative_error
    assert found.difference_error <= tolerance


def test_a_finer_level_beyond_the_memory_is_left_out(monkeypatch):
    monkeypatch.setattr("solve.fruit.split.MOST_DOFS", 1000)
    assert split_compliance(BLOCK, TIPS, 1e-9).info.dofs == mesh_dofs(BLOCK, PAIR, LEVELS[0])


def test_a_mesh_too_coarse_for_reciprocal_answers_is_passed_over(monkeypatch):
    monkeypatch.setattr("solve.fruit.split.ROUGH", ROUGH.coarser())
    with pytest.raises(SolveError):
        footprint_compliance(BLOCK, PAIR, ROUGH.coarser())
    assert split_compliance(BLOCK, TIPS, 0.02).info.dofs == mesh_dofs(BLOCK, PAIR, LEVELS[0])


@pytest.mark.parametrize("tolerance", [0.0, -1e-3, float("nan")])
def test_a_tolerance_that_is_none_is_refused(tolerance):
    with pytest.raises(InputError) as refused:
        split_compliance(BLOCK, TIPS, tolerance)
    assert refused.value.field == "tolerance"


def test_a_step_that_vanishes_leaves_a_share_of_the_remainder(monkeypatch):
    """The coarser mesh agrees by accident: a bar of the node error alone would claim what nobody knows."""
    fine = footprint_compliance(BLOCK, PAIR, LEVELS[0])
    errors = level_errors(BLOCK, PAIR, LEVELS[0], fine.S)
    monkeypatch.setattr("solve.fruit.split.footprint_compliance", lambda *_: fine)
    vanished = level_errors(BLOCK, PAIR, LEVELS[0], fine.S)
    own = square_punch(3).error + NODE_ERROR
    half_space = (1.0 - 0.3**2) / square_punch(3).flat_stiffness
    share = half_space / fine.S[0, 0] - 1.0
    assert max(vanished) < min(errors)
    # to 5 %: a part of the share comes from the other tip
    assert vanished[1] - own == pytest.approx(SAFETY * LEAST_STEP * share, rel=0.05)


def test_tip_forces_with_a_large_residual_are_refused(monkeypatch):
    monkeypatch.setattr("solve.fruit.footprints.RESIDUAL_LIMIT", 0.0)
    with pytest.raises(SolveError):
        level_compliance(PAIR, 0.3, np.full((18, 18), 0.1), 3)


def test_circles_of_domes():
    """A level dome touches where 1 + r / R is over each principal direction: here turned by 90 degrees, or not."""
    tips = Tips(layout="square", shape="dome", dome_radius_mm=10.0, side_mm=5.0, spacing_mm=6.0)
    egg = Fruit(
        shape="ellipsoid", radius_mm=40.0, radius_across_mm=20.0, thickness_mm=10.0, length_mm=20.0, width_mm=20.0
    )
    for azimuth, x, y in ((0.0, 3.0 / 1.25, 3.0 / 1.5), (90.0, 3.0 / 1.5, 3.0 / 1.25)):
        found = contact_footprints(dataclasses.replace(egg, azimuth_deg=azimuth), tips)
        assert [(abs(one.x), abs(one.y)) for one in found] == [pytest.approx((x, y))] * 4
        assert [(np.sign(one.x), np.sign(one.y)) for one in found] == [
            tuple(np.sign(place)) for place in tips.places_mm
        ]
        assert {one.side for one in found} == {2.5}


def test_relative_changes():
    """Of each pair the change of s_ii + s_jj - 2 s_ij over that, then of each s_ii; one tip has no pair."""
    S = np.array([[2.0, 0.5], [0.5, 3.0]])
    change = np.array([[0.1, -0.02], [-0.02, -0.2]])
    assert relative_changes(change, S) == pytest.approx([0.06 / 4.0, 0.05, 0.2 / 3.0])
    assert largest_errors(np.array([0.015, 0.05, 0.07]), 2) == (0.015, 0.07)
    assert largest_errors(relative_changes(change[:1, :1], S[:1, :1]), 1) == (pytest.approx(0.05), pytest.approx(0.05))
