"""The layered half-space against its limits, and against the integral equation of a flat circle."""

import dataclasses

import numpy as np
import pytest
from layer_equations import bonded, circle_stiffness
from scipy.integrate import quad
from scipy.linalg import expm, null_space
from scipy.special import j0

from solve.elasticity import lame_parameters
from solve.fruit.footprints import Footprint, level_compliance
from solve.fruit.skin import layered_change
from solve.halfspace.layered import Layer, base_compliance, round_contact
from solve.halfspace.punch import circle_punch


def flat_circle(layer, radius):
    """Return the stiffness of a flat circle over that on the half-space below alone [1]."""
    on_layer_alone = circle_stiffness(layer.softening, radius / layer.thickness)
    return on_layer_alone * (1.0 - layer.poisson_below**2) / layer.surface


SKIN = Layer(thickness=0.3, modulus=10.0, poisson=0.3, poisson_below=0.3)
RADIUS = 0.564


def stiffness_ratio(layer, footprint, per_side):
    """Return the stiffness of a footprint under a layer over that without [1]."""
    bare = float(level_compliance([footprint], layer.poisson_below, np.zeros(()), per_side)[0, 0])
    return bare / (bare + float(layered_change([footprint], [layer], per_side)[0, 0, 0]))


def growth(modulus, poisson):
    """Return the matrix of d(w, u, sigma_z, tau) / dz in plane strain at the wave number 1."""
    lam, mu = lame_parameters(modulus, poisson)
    M = lam + 2.0 * mu
    return np.array([
        [0.0, -lam / M, 1.0 / M, 0.0],
        [1.0, 0.0, 0.0, 1.0 / mu],
        [0.0, 0.0, 0.0, -1.0],
        [0.0, M - lam**2 / M, lam / M, 0.0],
    ])  # fmt: skip


def sinusoidal_sinking(layer, kh):
    """Return k (1 - nu) / mu times the displacement of the surface per pressure of wave number k [1].

    The two states that decay with depth in the flesh, as exp(-z) and z exp(-z), are carried up through the layer.
    """
    flesh = growth(1.0, layer.poisson_below) + np.eye(4)
    top = expm(-kh * growth(layer.modulus, layer.poisson)) @ null_space(flesh @ flesh, rcond=1e-8)
    _, mu = lame_parameters(layer.modulus, layer.poisson)
    return top[0] @ np.linalg.solve(top[2:], [-1.0, 0.0]) * mu / (1.0 - layer.poisson)


@pytest.mark.parametrize("poissons", [(0.3, 0.3), (0.45, 0.3), (0.2, 0.49)])
@pytest.mark.parametrize("modulus", [1.0, 10.0, 100.0])
def test_waves_sink_a_layer_as_its_differential_equations_say(modulus, poissons):
    layer = Layer(0.3, modulus, *poissons)
    for kh in (0.05, 0.3, 1.0, 3.0):
        assert 1.0 + layer.softening(np.array(kh)) == pytest.approx(sinusoidal_sinking(layer, kh), rel=1e-9)


@pytest.mark.parametrize(("thickness", "per_side"), [pytest.param(0.1, 17, marks=pytest.mark.slow), (0.3, 9), (0.6, 9)])
@pytest.mark.parametrize("modulus", [20.0, 10.0, 10.0 / 3.5])
def test_a_flat_circle_is_as_stiff_as_the_integral_equation_says(thickness, per_side, modulus):
    layer = dataclasses.replace(SKIN, thickness=thickness, modulus=modulus)
    circle = Footprint(0.0, 0.0, 2.0 * RADIUS, circle_punch)
    assert stiffness_ratio(layer, circle, per_side) == pytest.approx(flat_circle(layer, RADIUS), rel=3e-4)


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
    assert contact.flat_stiffness(RADIUS) == pytest.approx(
        flat_circle(SKIN, RADIUS) * 2.0 * RADIUS / (1.0 - 0.3**2), rel=1e-4
    )


def test_only_a_curved_layer_that_is_no_flesh_arches():
    """Twice the curvature bears four times as much; one curvature alone 3/8 of both, a saddle of both 1/2."""
    both = SKIN.shell_effect(RADIUS, 1.5, (0.03, 0.03))
    assert both > 0.0
    assert SKIN.shell_effect(RADIUS, 1.5, (0.0, 0.0)) == 0.0
    assert dataclasses.replace(SKIN, modulus=1.0).shell_effect(RADIUS, 1.5, (0.03, 0.03)) == 0.0
    assert SKIN.shell_effect(RADIUS, 1.5, (0.06, 0.06)) == pytest.approx(4.0 * both)
    assert SKIN.shell_effect(RADIUS, 1.5, (0.03, 0.0)) == pytest.approx(0.375 * both)
    assert SKIN.shell_effect(RADIUS, 1.5, (0.03, -0.03)) == pytest.approx(0.5 * both)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45, 0.49])
@pytest.mark.parametrize(("h", "apart"), [(8.0, 0.0), (8.0, 3.0), (8.0, 25.0), (2.0, 3.0)])
def test_a_rigid_base_takes_off_what_the_bonded_layer_lacks(poisson, h, apart):
    off = quad(lambda u: (bonded(u, poisson) - 1.0) * j0(u * apart / h), 0.0, 25.0, limit=400, epsabs=1e-11)[0]
    expected = (1.0 - poisson**2) / (np.pi * h) * off
    # A base 1e7 times as hard, and a spline through 160 distances.
    np.testing.assert_allclose(base_compliance(h, poisson, np.array(apart)), expected, atol=1e-6)
