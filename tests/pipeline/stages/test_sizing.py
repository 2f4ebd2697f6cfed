"""Sizing: the paper's springs by Hayes, the right ones by the true contact, given springs unchanged."""

import dataclasses

import numpy as np
import pytest

from cad.design.design_file import design_from_mapping
from cad.design.parameters import Design
from cad.theory.two_spring_law import size_springs
from pipeline.stages.sizing import size
from solve.contact.linear_response import linear_response
from solve.fruit.compliance import Compliance

# The paper's block, reference solution by two independent methods to 2e-5.
CONTACT = Compliance(
    S=((0.766603, 0.010526), (0.010526, 0.766603)),
    error_percent=0.01,
    s11_error_percent=0.01,
    method="reference",
    dofs=0,
    seconds=0.0,
    status="given",
)


def test_hayes_gives_the_springs_that_the_paper_prints():
    found = size(Design(), CONTACT, "hayes")
    assert 1e3 * found.K_m_max == pytest.approx(3846.15, abs=0.01)
    assert 1e3 * found.springs.K_l == pytest.approx(752.5, abs=0.05)
    assert 1e3 * found.springs.K_h == pytest.approx(17308.0, abs=0.5)
    assert found.K_m_over_E == pytest.approx(1.0 / 0.91, rel=1e-12)


def test_paper_rounds_the_fruit_stiffness_to_3850():
    rounded = size_springs(5.0, 0.05, 3850.0)
    assert (round(rounded.K_l, 2), round(rounded.K_h)) == (753.26, 17325)


def test_true_contact_gives_stiffer_springs():
    found = size(Design(), CONTACT, "contact")
    assert found.K_m_over_E == pytest.approx(1.0 / (0.766603 - 0.010526), rel=1e-12)
    assert 1e3 * found.springs.K_l == pytest.approx(905.7, rel=5e-4)
    assert 1e3 * found.springs.K_h == pytest.approx(20831.0, rel=5e-4)


def test_whatever_sized_the_true_contact_judges():
    assert size(Design(), CONTACT, "hayes").K_m_max_contact == pytest.approx(3.5 / (0.766603 - 0.010526), rel=1e-12)


def test_given_springs_are_taken_as_they_are():
    design = design_from_mapping({"springs": {"K_l_N_per_m": 753.0, "K_h_N_per_m": 17300.0}})
    found = size(design, CONTACT, "contact")
    assert (found.springs.K_l, found.springs.K_h) == pytest.approx((0.753, 17.3), rel=1e-12)


def test_deflections_share_the_travel_with_the_fruit():
    """In series a spring takes the share K_m / (K_m + K) of the travel."""
    found = size(Design(), CONTACT, "contact")
    low, high = found.deflections((0.6, 0.6))
    K_m = found.K_m_max_contact
    assert low == pytest.approx(0.6 * K_m / (K_m + found.springs.K_l), rel=1e-12)
    assert high == pytest.approx(0.6 * K_m / (K_m + found.springs.K_h), rel=1e-12)


def test_tilt_gives_each_spring_its_own_travel():
    found = size(Design(), CONTACT, "contact")
    level, tilted = found.deflections((0.6, 0.6)), found.deflections((0.81, -0.1))
    assert tilted == pytest.approx((level[0] * 0.81 / 0.6, 0.0), rel=1e-12)


def test_moduli_beyond_the_range_bend_the_springs_further():
    fruit = {"E_MPa": [1.0, 10.0]}
    found = size(design_from_mapping({"fruit": fruit}), CONTACT, "contact")
    assert found.K_m_top == pytest.approx(10.0 / 3.5 * found.K_m_max_contact, rel=1e-12)
    assert found.deflections((0.6, 0.6))[1] > size(Design(), CONTACT, "contact").deflections((0.6, 0.6))[1]


def test_off_the_middle_each_tip_meets_its_own_fruit():
    contact = dataclasses.replace(CONTACT, S=((0.76, 0.011), (0.011, 0.79)))
    found = size(Design(), contact, "contact")
    assert found.asymmetry == pytest.approx((0.76 - 0.011) / (0.79 - 0.011), rel=1e-12)
    C = np.diag([1.0 / found.springs.K_l, 1.0 / found.springs.K_h])
    response = linear_response(np.array(contact.S), C, 3.5, np.array([0.3, 0.6]))
    assert pytest.approx([5.0, 5.0], rel=1e-12) == response.P
