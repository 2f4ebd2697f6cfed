"""Verdicts of a run: the tolerances of the contract, and a wrong design for each kind."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from stand_ins import CONTACT, K_M_OVER_E, LENGTHS, draw_sensor, solved, springs_of

from pipeline.errors.targets import ForceRatioCurve, SceneTargets
from pipeline.springs.spring import MadeSpring
from pipeline.verdicts.rules import (
    NL_verdict,
    P_max_verdict,
    displacement_verdict,
    monotonic_verdict,
    printable_verdict,
    stiffness_verdict,
)
from sensor.design.parameters import PAPER_SPRINGS, PAPER_TARGETS, Design, Targets
from sensor.theory.two_spring_law import Springs, curve_shares, force_ratio, size_springs
from sensor.verdict import row_of
from solve.contact.linear_response import linear_response, spring_compliance, travels

K_M = 3.5 * K_M_OVER_E
X = travels(0.6, 12)
MODULI = (0.5, 1.0, 2.0, 3.5)
MADE = springs_of(Design())
LEAVES = MADE.printable["low"]


def judged(own, targets, *, made=True):
    """Return the verdicts on P_max and NL of a sensor that the two-spring law describes."""
    design = Design(targets=targets)
    springs = springs_of(design, made=made)
    reached = SceneTargets(P_max=own.P_max(), NL=own.NL(targets), level=None)
    sensor = solved(draw_sensor(design, springs), reached=reached)
    return sensor.verdict("P_max"), sensor.verdict("NL")


def responses(springs, moduli=MODULI, ahead=(0.0, 0.0)):
    return linear_response(CONTACT.S, spring_compliance(*springs.stiffnesses), moduli, X, ahead)


def test_targets_of_springs_that_were_not_made_are_undecided():
    own = ForceRatioCurve(springs=size_springs(5.0, 0.05, K_M), K_m_max=K_M)
    P_max, NL = judged(own, Targets(), made=False)
    assert (P_max.passed, NL.passed) == (None, None)
    assert P_max.value == pytest.approx(5.0, rel=1e-12)
    assert "of the target stiffnesses" in NL.reference


@pytest.mark.parametrize("judge_one", [P_max_verdict, NL_verdict])
def test_scene_in_which_a_tip_is_off_has_no_value_and_fails(judge_one):
    found = judge_one(None, Targets(), "")
    assert (found.value, found.error, found.passed) == (None, None, False)
    assert "a tip is off the fruit" in found.reference


@pytest.mark.parametrize(
    ("K_l", "K_h", "failed"), [(0.93, 20.83, "P_max"), (K_M / (5.0 * (1.0 + K_M / 18.5) - 1.0), 18.5, "NL")]
)
def test_spring_off_its_target_fails_the_verdict_that_it_moves(K_l, K_h, failed):
    own = ForceRatioCurve(springs=Springs(K_l=K_l, K_h=K_h), K_m_max=K_M)
    assert [each.name for each in judged(own, PAPER_TARGETS) if not each.passed] == [failed]


def test_largest_nonlinearity_under_a_skin_is_where_the_curve_departs_most():
    """Without a skin it is the closed form's, and where K_m rises as E^0.8 a search finds the same.

    The curve has 200 steps; its parabola misses the top by a share of the square of a step.
    """
    springs = size_springs(5.0, 0.05, K_M)
    shares = np.array(curve_shares(200))
    targets = dataclasses.replace(PAPER_TARGETS, NL_definition="largest")
    bare = ForceRatioCurve(springs=springs, K_m_max=K_M)
    as_flesh = dataclasses.replace(bare, stiffening=tuple(shares.tolist()))
    assert as_flesh.NL(targets).value == pytest.approx(bare.NL(targets).value, abs=1e-6)
    skin = dataclasses.replace(bare, stiffening=tuple((shares**0.8).tolist()))

    def departure(share):
        P = [force_ratio(springs, K_M * each**0.8) for each in (shares[0], share, 1.0)]
        return share - (P[1] - P[0]) / (P[2] - P[0])

    found = minimize_scalar(departure, bounds=(0.01, 0.99), method="bounded")
    assert skin.NL(targets).value == pytest.approx(-found.fun, abs=1e-6)


def test_error_of_P_max_is_what_the_worst_springs_do():
    """K_l 1 % low, K_h 1 % high and K_m 1 % high each raise P."""
    springs = size_springs(5.0, 0.05, K_M)
    own = ForceRatioCurve(springs=springs, K_m_max=K_M, spring_errors=(0.01 * springs.K_l, 0.01 * springs.K_h))
    worst = ForceRatioCurve(springs=Springs(K_l=0.99 * springs.K_l, K_h=1.01 * springs.K_h), K_m_max=K_M)
    assert own.P_max().error == pytest.approx(worst.P_max().value - 5.0, rel=0.03)
    wider = dataclasses.replace(own, K_m_error=0.01 * K_M)
    assert wider.P_max().error > own.P_max().error


def spring(K, error=0.0):
    """Return a spring of a target of 0.906 N/mm that was made to K [N/mm] with a relative error, or not made."""
    return MadeSpring(target=0.906, K=K, K_error=None if K is None else error)


@pytest.mark.parametrize(
    ("K", "error", "passed"),
    [(0.9068, 0.0, True), (0.9071, 0.0, False), (0.9050, 0.0, False), (None, 0.0, None), (0.906, 0.0011, None)],
)
def test_stiffness_is_held_to_a_tenth_of_a_percent(K, error, passed):
    found = stiffness_verdict("K_l", spring(K, error), monolithic=True)
    assert found.passed is passed
    assert found.limit == pytest.approx(906.0, rel=1e-12)
    assert found.value == (None if K is None else pytest.approx(1e3 * K, rel=1e-12))


@pytest.mark.parametrize(("error", "tolerance"), [(0.0011, "tolerance_with_pins"), (0.0005, "tolerance")])
def test_glued_springs_have_the_wide_tolerance_only_where_they_are_not_known_better(error, tolerance):
    found = stiffness_verdict("K_l", spring(0.906, error), monolithic=False)
    assert (found.passed, found.tolerance) == (True, getattr(row_of("K_l"), tolerance))


@pytest.mark.parametrize(
    ("share", "error", "passed"), [(0.5, 0.1, True), (0.95, 0.1, None), (1.05, 0.1, False)], ids=str
)
def test_root_strain_of_the_solve_is_held_to_the_limit_of_the_process(share, error, passed):
    strained = dataclasses.replace(
        MADE.springs["low"], root_strain=share * LEAVES.strain_limit, root_strain_error=error / share
    )
    found = printable_verdict(LEAVES, strained)
    assert found.passed is passed
    assert ("FE root strain" in found.reference) == (passed is not True)


def test_leaves_have_the_length_that_is_made_and_keep_the_reason_why_none_is():
    bare = springs_of(Design(), made=False)
    made, refused = (printable_verdict(of.printable["low"], of.springs["low"]) for of in (MADE, bare))
    assert made.value == LENGTHS[0]
    assert (refused.value, refused.passed, refused.reference) == (None, False, "leaf too long")


@pytest.mark.parametrize(("tilt_deg", "least"), [(0.0, 0.0), (1.0, 0.1), (10.0, None)])
def test_force_ratio_depends_on_travel_where_a_press_is_tilted(tilt_deg, least):
    """At 10 deg a tip is off the fruit at every travel, so that there is no number."""
    step = 4.0 * np.tan(np.radians(tilt_deg))
    found = displacement_verdict(responses(PAPER_SPRINGS, ahead=(-step, step)))
    assert found.passed is (tilt_deg == 0.0)
    if least is None:
        assert found.value is None
    elif least:
        assert found.value > least
    else:
        assert found.value == pytest.approx(0.0, abs=1e-12)


def test_force_ratio_must_rise_with_the_modulus():
    found = monotonic_verdict(responses(PAPER_SPRINGS))
    assert found.passed is True
    assert found.value == pytest.approx(2.5607 / 1.8091 - 1.0, rel=2e-4)
    swapped = monotonic_verdict(responses(Springs(K_l=PAPER_SPRINGS.K_h, K_h=PAPER_SPRINGS.K_l)))
    assert (swapped.passed, swapped.value < 0.0) == (False, True)
    lifted = monotonic_verdict(responses(PAPER_SPRINGS, ahead=(-0.7, 0.7)))
    assert (lifted.passed, lifted.value) == (False, None)
