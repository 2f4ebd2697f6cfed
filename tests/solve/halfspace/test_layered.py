"""The layered half-space against its limits, and against the integral equation of a flat circle."""

import dataclasses

import numpy as np
import pytest

from solve.fruit.footprints import Footprint, level_compliance
from solve.fruit.skin import layered_change
from solve.halfspace.layered import Layer, added_compliances, round_contact
from solve.halfspace.punch import circle_punch

SKIN = Layer(thickness=0.3, modulus=10.0, poisson=0.3, poisson_below=0.3)
RADIUS = 0.564
KH = np.geomspace(1e-3, 20.0, 40)


# Stiffness of a flat circle of this radius over that on the half-space below alone, by thickness and modulus. N. N.
# Lebedev, Y. S. Ufliand, J. Appl. Math. Mech. 22 (1958) 442: Gauss's rule for phi + int M phi = 1, Simpson's for M.
CIRCLE = {
    (0.1, 20.0): 1.318046108,
    (0.1, 10.0): 1.241473939,
    (0.3, 20.0): 1.813003511,
    (0.3, 10.0): 1.600655876,
    (0.3, 10.0 / 3.5): 1.279159112,
    (0.6, 10.0): 2.156647524,
    (0.6, 10.0 / 3.5): 1.501602396,
}
# k (1 - nu) / mu times the surface's displacement per pressure of wave number k at k h of 0.05, 0.3, 1 and 3, in plane
# strain: A + B z and C + D z times exp(-+ k z) in the layer and A + B z below, six equations at surface and joint.
WAVES = {
    (1.5, 0.3, 0.3): (1.4848545326030438, 1.4240140133149168, 1.2497806759359558, 1.019284951554189),
    (10.0, 0.45, 0.3): (10.709838190650208, 9.195311990588017, 3.8748696142559695, 1.1051052094031084),
    (100.0, 0.2, 0.49): (78.90182735353558, 57.56325400327624, 6.686393511000349, 1.1329990025599277),
}


def stiffness_ratio(layer, footprint, per_side):
    """Return the stiffness of a footprint under a layer over that without [1]."""
    bare = float(level_compliance([footprint], layer.poisson_below, np.zeros(()), per_side)[0, 0])
    return bare / (bare + float(layered_change([footprint], [layer], per_side)[0, 0, 0]))


@pytest.mark.parametrize(("modulus", "poisson", "below"), WAVES)
def test_waves_sink_a_layer_as_six_equations_say(modulus, poisson, below):
    softening = Layer(0.3, modulus, poisson, below).softening(np.array([0.05, 0.3, 1.0, 3.0]))
    assert 1.0 + softening == pytest.approx(WAVES[modulus, poisson, below], rel=1e-9)


def test_a_layer_as_what_lies_below_changes_nothing():
    layer = dataclasses.replace(SKIN, modulus=1.0)
    assert np.abs(layer.softening(KH)).max() < 1e-12
    assert added_compliances([layer], np.linspace(0.0, 5.0, 9)) == pytest.approx(np.zeros((1, 9)), abs=1e-12)


@pytest.mark.parametrize(("thickness", "modulus"), [key for key in CIRCLE if key[0] > 0.1])
def test_a_flat_circle_is_as_stiff_as_the_integral_equation_says(thickness, modulus):
    layer = dataclasses.replace(SKIN, thickness=thickness, modulus=modulus)
    circle = Footprint(0.0, 0.0, 2.0 * RADIUS, circle_punch)
    assert stiffness_ratio(layer, circle, 9) == pytest.approx(CIRCLE[thickness, modulus], rel=3e-4)


def test_smooth_loads_meet_a_half_space_of_one_modulus_as_the_closed_form_says():
    """Two normal distributions in one place: (1 - nu^2) / (2 sqrt(pi) sigma)."""
    bare = Layer(0.3, 1.0, 0.3, 0.3)
    assert bare.smooth_compliance((1.5, 1.5), 0.0) == pytest.approx(0.91 / (2.0 * np.sqrt(np.pi) * 1.5), rel=1e-9)
    assert bare.smooth_compliance((0.5, 0.5), 30.0) == pytest.approx(0.91 / (np.pi * 30.0), rel=1e-3)


def test_round_bodies_on_a_layer_as_what_lies_below_follow_hertz():
    """Depth a^2 / R, force 4/3 E* a^3 / R, d force / d depth 2 a E*: Johnson (1985), 4.22 to 4.24."""
    contact = round_contact(dataclasses.replace(SKIN, modulus=1.0), 3.0)
    E_star = 1.0 / (1.0 - 0.3**2)
    radius, force, stiffness = contact.press(np.array([0.0, 1e-6, 0.04, 1.44, 4.0]))
    expected = np.sqrt([0.0, 1e-6, 0.04, 1.44, 4.0])
    assert radius == pytest.approx(expected, rel=1e-6)
    assert force == pytest.approx(4.0 / 3.0 * E_star * expected**3, rel=1e-5)
    assert stiffness == pytest.approx(2.0 * E_star * expected, rel=1e-6)


def test_a_round_contact_grows_by_steps_of_the_flat_circle():
    contact = round_contact(SKIN, 3.0)
    depth = np.linspace(0.05, 6.0, 4001)
    _, force, stiffness = contact.press(depth)
    assert np.gradient(force, depth)[1:-1] == pytest.approx(stiffness[1:-1], rel=1e-3)
    for (thickness, modulus), ratio in CIRCLE.items():
        flat = round_contact(dataclasses.replace(SKIN, thickness=thickness, modulus=modulus), 3.0).flat_stiffness(
            RADIUS
        )
        assert flat == pytest.approx(ratio * 2.0 * RADIUS / (1.0 - 0.3**2), rel=1e-4)


def test_only_a_curved_layer_that_is_no_flesh_arches():
    """Twice the curvature bears four times as much; one curvature alone 3/8 of both, a saddle of both 1/2."""
    both = SKIN.arching(RADIUS, 1.5, (0.03, 0.03))
    assert both > 0.0
    assert SKIN.arching(RADIUS, 1.5, (0.0, 0.0)) == 0.0
    assert dataclasses.replace(SKIN, modulus=1.0).arching(RADIUS, 1.5, (0.03, 0.03)) == 0.0
    assert SKIN.arching(RADIUS, 1.5, (0.06, 0.06)) == pytest.approx(4.0 * both)
    assert SKIN.arching(RADIUS, 1.5, (0.03, 0.0)) == pytest.approx(0.375 * both)
    assert SKIN.arching(RADIUS, 1.5, (0.03, -0.03)) == pytest.approx(0.5 * both)
