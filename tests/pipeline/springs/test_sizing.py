"""Sizing: the paper's springs by Hayes, the right ones by the true contact, given springs unchanged."""

import dataclasses

import numpy as np
import pytest
from refusal import refusal
from stand_ins import CONTACT, K_M_OVER_E, sizing_of

from pipeline.options import RunOptions
from pipeline.springs.sizing import spring_sizing
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design, GivenSprings, Targets
from solve.contact.linear_response import linear_response, spring_compliance


def test_hayes_gives_the_springs_that_the_paper_prints_and_the_true_contact_judges():
    sizing = spring_sizing(Design(), CONTACT, RunOptions(fruit_stiffness="hayes"))
    assert 1e3 * sizing.K_m_max == pytest.approx(3846.15, abs=0.01)
    assert 1e3 * sizing.springs.K_l == pytest.approx(752.5, abs=0.05)
    assert 1e3 * sizing.springs.K_h == pytest.approx(17308.0, abs=0.5)
    assert sizing.K_m_over_E == pytest.approx(1.0 / 0.91, rel=1e-12)
    assert sizing.basis == "hayes"
    assert sizing.K_m_max_contact == pytest.approx(3.5 * K_M_OVER_E, rel=1e-12)


def test_given_springs_are_taken_as_they_are():
    sizing = sizing_of(Design(springs=GivenSprings(K_l_N_per_m=753.0, K_h_N_per_m=17300.0)))
    assert sizing.springs.stiffnesses == pytest.approx((0.753, 17.3), rel=1e-12)


@pytest.mark.parametrize("K_l", [999999999.9999999, 999999000.0])
def test_springs_that_no_fruit_tells_apart_are_refused(K_l):
    """P rises by K_m (1 / K_l - 1 / K_h), 4.6e-12 for springs that differ by 1e-6 of 1e6 N/mm."""
    refused = refusal(sizing_of, Design(springs=GivenSprings(K_l_N_per_m=K_l, K_h_N_per_m=1e9)))
    assert (refused.field, refused.value) == ("springs.K_l_N_per_m", K_l)


@pytest.mark.parametrize("E", [3.5, 10.0])
@pytest.mark.parametrize(("travels", "shares"), [((0.6, 0.6), (0.6, 0.6)), ((0.81, -0.1), (0.81, 0.0))])
def test_deflections_share_the_travel_with_the_firmest_fruit(E, travels, shares):
    """In series a spring takes the share K_m / (K_m + K) of its travel; one that is lifted takes none."""
    sizing = sizing_of(Design(fruit=Fruit(E_MPa=(1.0, E))))
    K_m = E * K_M_OVER_E
    expected = [share * K_m / (K_m + K) for share, K in zip(shares, sizing.springs.stiffnesses, strict=True)]
    assert sizing.deflections(travels) == pytest.approx(expected, rel=1e-12)
    assert sizing.K_m_at_largest_E == pytest.approx(K_m, rel=1e-12)


def test_off_the_middle_each_tip_meets_its_own_fruit():
    contact = dataclasses.replace(CONTACT, S=np.array([[0.76, 0.011], [0.011, 0.79]]))
    sizing = sizing_of(Design(), contact)
    assert sizing.stiffness_ratio == pytest.approx((0.76 - 0.011) / (0.79 - 0.011), rel=1e-12)
    response = linear_response(contact.S, spring_compliance(*sizing.springs.stiffnesses), [3.5], [0.3, 0.6])
    assert pytest.approx([5.0, 5.0], rel=1e-12) == response.P[0]


def test_target_under_the_ratio_of_the_fruit_is_refused():
    """A high tip on a fruit twice as stiff shows P of 2 with rigid springs already."""
    contact = dataclasses.replace(CONTACT, S=np.array([[0.79, 0.01], [0.01, 0.4]]))
    refused = refusal(sizing_of, Design(targets=Targets(P_max=1.5)), contact)
    assert (refused.field, refused.value) == ("targets.P_max", 1.5)
