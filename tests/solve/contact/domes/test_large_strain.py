"""Balls at finite strain over Hertz's force: limits, and finite elements that share nothing with the fit."""

import numpy as np
import pytest

from reference.stored import stored
from solve.contact.domes.large_strain import (
    EDGE,
    EDGE_FIT_ERROR,
    FIT_ERROR,
    LARGEST_S,
    POISSONS,
    coefficients,
    large_strain,
)

FLAT = np.array(0.0)
# Of the independent elements: the step of a force from 14 to 20 cells is 1e-4, and at small strain they place the edge
# of Hertz's contact to 1.7e-3 of its radius.
OWN = 2.5e-4
OWN_OF_EDGE = 2e-3
# A ball of nu 0.3 between plates pressed in by 1 % of its height, neo-Hooke over small strain: contact at finite strain
# in another code, each number to 0.3 %. The contact radius is a tenth of the ball's.
BETWEEN_PLATES = 1.046 / 1.057
BETWEEN_PLATES_ERROR = 0.003


BY_OTHER_ELEMENTS = [contact for contact in stored("ball_contact") if contact["cells"] == 14]
# By the elements to which the product was fitted, on a half-space and on a ball of 20 contact radii
FITTED = [(contact, 0.0, 0.0) for contact in stored("dome_strain")]


def test_small_contacts_are_hertz():
    found = large_strain(np.array(1e-6), 10.0, FLAT, 0.3)
    assert found.factor == pytest.approx(1.0, abs=1e-6)
    assert found.error < 1e-6
    assert found.edge == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(("dome", "fruit", "part"), [(0.02, 0.03, 0.5), (0.03, 0.02, 0.5), (0.2, 0.1, 1.0)])
def test_error_of_the_fit(dome, fruit, part):
    """It grows with both curvatures, up to a sum of 0.1 over the contact radius; from there on all of it is open."""
    found = large_strain(np.array(1.0), 1.0 / dome, np.array(fruit), 0.3)
    assert (found.error, found.edge_error) == pytest.approx((part * FIT_ERROR, part * EDGE_FIT_ERROR))


@pytest.mark.parametrize("poisson", POISSONS)
def test_contact_with_a_flat_plate_is_narrower_by_what_the_skin_moves_inward(poisson):
    """Johnson (1985), equation (3.42): the skin moves under Hertz's pressure, and the edge of the contact with it."""
    inward = -2.0 * (1.0 - 2.0 * poisson) / (3.0 * np.pi * (1.0 - poisson))
    assert coefficients(EDGE, poisson)[1] == pytest.approx(inward, abs=0.5e-4)  # four decimals


def test_ball_between_plates_is_that_of_another_code():
    found = large_strain(np.array(1.0), 1e9, np.array(0.1), 0.3)
    assert found.factor == pytest.approx(BETWEEN_PLATES, abs=BETWEEN_PLATES_ERROR)


@pytest.mark.parametrize("poisson", [0.0, 0.2, 0.49])
def test_slope_is_that_of_the_factor(poisson):
    contact = np.array([0.2, 2.0, 6.0])
    curvature = np.full(3, 0.03)
    step = 1e-6
    ahead = large_strain(contact * (1.0 + step), 10.0, curvature, poisson).factor
    behind = large_strain(contact * (1.0 - step), 10.0, curvature, poisson).factor
    found = large_strain(contact, 10.0, curvature, poisson)
    assert found.slope == pytest.approx((ahead - behind) / (2.0 * step), rel=1e-6)


def test_beyond_what_was_solved_all_of_it_is_open():
    end = large_strain(np.array(LARGEST_S), 1.0, FLAT, 0.3)
    deeper = large_strain(np.array(1.1), 1.0, FLAT, 0.3)
    assert deeper.factor == pytest.approx(float(end.factor))
    assert deeper.error >= abs(deeper.factor - 1.0)
    softer = large_strain(np.array(0.2), 1.0, FLAT, -0.2)
    assert softer.error >= abs(softer.factor - 1.0)


@pytest.mark.parametrize(
    ("one", "own", "own_of_edge"), [*FITTED, *((one, OWN, OWN_OF_EDGE) for one in BY_OTHER_ELEMENTS)]
)
def test_the_fit_covers_what_its_elements_and_others_find(one, own, own_of_edge):
    """Curvatures are times the contact radius."""
    found = large_strain(np.array(one["contact"]), 1.0 / one["dome"], np.array(one["fruit"]), one["poisson"])
    assert found.factor == pytest.approx(one["force"], abs=float(found.error) + own)
    assert found.edge == pytest.approx(one["edge"], abs=float(found.edge_error) + own_of_edge)
