"""Verdicts: the tolerances of the contract, undecided only for a wide error bar, and a wrong design for each kind."""

import dataclasses
import types

import numpy as np
import pytest

from cad.design.parameters import Targets
from cad.theory.two_spring_law import Springs, size_springs
from cad.verdict import Verdict, all_passed
from pipeline.stages.verdict_rules import (
    FITTED_TOLERANCE,
    PAPER,
    PAPER_TARGETS,
    STIFFNESS_TOLERANCE,
    Judged,
    advised,
    decided,
    displacement_verdict,
    monotonic_verdict,
    stiffness_verdict,
    target_verdicts,
)
from solve.contact.linear_response import linear_response, spring_compliance, travels

K_M_OVER_E = 1.32263  # mm, reference of the paper's block
K_M = 3.5 * K_M_OVER_E
S = np.array([[0.766603, 0.010526], [0.010526, 0.766603]])
X = travels(0.6, 12)
MODULI = (0.5, 1.0, 2.0, 3.5)


def verdict(passed):
    return Verdict(name="n", value=1.0, unit="1", limit=1.0, tolerance=0.1, passed=passed, reference="r")


def responses(springs, moduli=MODULI, ahead=(0.0, 0.0)):
    C = spring_compliance(springs.K_l, springs.K_h)
    return [linear_response(S, C, E, X, ahead) for E in moduli]


@pytest.mark.parametrize(
    ("value", "error", "passed"),
    [
        (5.0, 0.0, True),
        (5.0499, 0.0, True),
        (5.0501, 0.0, False),
        (4.9501, 0.05, True),
        (4.94, 0.05, False),
        (5.0, 0.051, None),
        (5.04, 0.2, None),
        (5.3, 0.2, False),
    ],
)
def test_value_is_undecided_only_where_its_error_bar_exceeds_the_tolerance(value, error, passed):
    assert decided(value, 5.0, 0.05, error) is passed


@pytest.mark.parametrize(
    ("error", "asked", "words"),
    [
        (0.1, 0.02, "undecided by its error bar, --tol 0.005 would decide"),
        (0.07, 0.02, "undecided by its error bar, --tol 0.005 would decide"),
        (0.5, 0.02, "undecided by its error bar, no --tol would decide"),
        (1000.0, 0.001, "undecided by its error bar, no --tol would decide"),
    ],
)
def test_an_undecided_verdict_says_which_tolerance_would_decide(error, asked, words):
    P_max = dataclasses.replace(verdict(None), limit=5.0, tolerance=0.01, relative=True, error=error)
    assert advised(P_max, asked).reference == f"r; {words}"


def test_a_decided_verdict_needs_no_advice():
    for passed in (True, False):
        decided_one = dataclasses.replace(verdict(passed), error=1.0)
        assert advised(decided_one, 0.02) == decided_one
    of_springs_not_made = dataclasses.replace(verdict(None), error=1e-4)
    assert advised(of_springs_not_made, 0.02) == of_springs_not_made


@pytest.mark.parametrize(
    ("each", "whole"), [([True, True], True), ([True, None], None), ([None, False], False), ([True, False], False)]
)
def test_one_failed_verdict_fails_the_run(each, whole):
    assert all_passed([verdict(passed) for passed in each]) is whole


@pytest.mark.parametrize("definition", ["mid-range", "largest"])
def test_sized_springs_meet_their_targets(definition):
    targets = Targets(P_max=7.0, NL=0.03, NL_definition=definition)
    judged = Judged(springs=size_springs(7.0, 0.03, K_M, definition), K_m_max=K_M)
    P_max, NL = target_verdicts(judged, targets)
    assert P_max.value == pytest.approx(7.0, rel=1e-12)
    assert NL.value == pytest.approx(0.03, rel=1e-10)
    assert (P_max.passed, NL.passed) == (True, True)


def test_paper_springs_fail_their_own_targets_under_the_true_contact():
    P_max, NL = target_verdicts(Judged(springs=PAPER, K_m_max=K_M), PAPER_TARGETS)
    assert P_max.value == pytest.approx(5.6388, abs=5e-5)
    assert NL.value == pytest.approx(0.059, abs=5e-4)
    assert (P_max.passed, NL.passed) == (False, False)


@pytest.mark.parametrize(
    ("K_l", "K_h", "failed"), [(0.93, 20.83, "P_max"), (K_M / (5.0 * (1.0 + K_M / 18.5) - 1.0), 18.5, "NL")]
)
def test_spring_off_its_target_fails_the_verdict_that_it_moves(K_l, K_h, failed):
    judged = Judged(springs=Springs(K_l=K_l, K_h=K_h), K_m_max=K_M)
    assert [v.name for v in target_verdicts(judged, PAPER_TARGETS) if not v.passed] == [failed]


def test_error_of_P_max_is_what_the_worst_springs_do():
    """K_l 1 % low, K_h 1 % high and K_m 1 % high each raise P."""
    springs = size_springs(5.0, 0.05, K_M)
    judged = Judged(springs=springs, K_m_max=K_M, spring_errors=(0.01 * springs.K_l, 0.01 * springs.K_h))
    worst = Judged(springs=Springs(K_l=0.99 * springs.K_l, K_h=1.01 * springs.K_h), K_m_max=K_M)
    assert judged.P_max()[1] == pytest.approx(worst.P_max()[0] - 5.0, rel=0.03)
    wider = dataclasses.replace(judged, K_m_error=0.01 * K_M)
    assert wider.P_max()[1] > judged.P_max()[1]


@pytest.mark.parametrize(
    ("found", "passed"), [(0.906, True), (0.9068, True), (0.9071, False), (0.9050, False), (None, None)]
)
def test_stiffness_is_held_to_a_tenth_of_a_percent(found, passed):
    spring = types.SimpleNamespace(target=0.906, stiffness=found)
    assert stiffness_verdict("K_l", spring, 0.0).passed is passed


def test_wide_error_of_a_stiffness_leaves_it_undecided():
    spring = types.SimpleNamespace(target=0.906, stiffness=0.906)
    assert stiffness_verdict("K_l", spring, 0.001).passed is None


def test_glued_springs_have_the_wide_tolerance_only_where_they_are_not_known_better():
    spring = types.SimpleNamespace(target=0.906, stiffness=0.906)
    unknown, known = (stiffness_verdict("K_l", spring, error, plain=False) for error in (0.001, 0.0005))
    assert (unknown.passed, unknown.tolerance) == (True, FITTED_TOLERANCE)
    assert (known.passed, known.tolerance) == (True, STIFFNESS_TOLERANCE)


def test_force_ratio_of_a_level_sensor_does_not_depend_on_travel():
    found = displacement_verdict(responses(PAPER))
    assert found.value == pytest.approx(0.0, abs=1e-12)
    assert found.passed is True


def test_planted_tilt_of_one_degree_fails_displacement_independence():
    step = 4.0 * np.tan(np.radians(1.0))
    found = displacement_verdict(responses(PAPER, ahead=(-step, step)))
    assert found.passed is False
    assert found.value > 0.1


def test_tip_off_the_fruit_fails_displacement_independence_without_a_number():
    found = displacement_verdict(responses(PAPER, ahead=(-0.7, 0.7)))
    assert (found.value, found.passed) == (None, False)


def test_force_ratio_rises_with_the_modulus():
    found = monotonic_verdict(responses(PAPER))
    assert found.passed is True
    assert found.value == pytest.approx(2.5607 / 1.8091 - 1.0, rel=2e-4)


def test_springs_in_the_wrong_order_fall_with_the_modulus():
    swapped = [linear_response(S, spring_compliance(17.3, 0.753), E, X) for E in MODULI]
    assert monotonic_verdict(swapped).passed is False


def test_tip_off_at_full_travel_fails_monotonic_without_a_number():
    found = monotonic_verdict(responses(PAPER, ahead=(-0.7, 0.7)))
    assert (found.value, found.passed) == (None, False)
