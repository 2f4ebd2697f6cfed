"""The layered half-space against its limits, and against the integral equation of a flat circle."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j0

from solve.fruit.footprints import Footprint, level_compliance
from solve.fruit.skin import layered_change
from solve.halfspace.layered import Layer, base_compliance, round_contact
from solve.halfspace.punch import circle_punch

SKIN = Layer(thickness=0.3, modulus=10.0, poisson=0.3, poisson_below=0.3)
RADIUS = 0.564


def circle_stiffness(layer, radius):
    """Return the stiffness of a flat circle over that on the half-space below alone [1].

    N. N. Lebedev, Y. S. Ufliand, J. Appl. Math. Mech. 22 (1958) 442: phi + int M phi = 1, Gauss's rule for the
    integrals, M(t, s) = 2 / pi int (T - 1) cos kt cos ks dk, stiffness int phi.
    """
    k = np.linspace(0.0, 25.0 / layer.thickness, 6001)
    of_k = np.full(len(k), k[1] / 3.0)  # Simpson's rule
    of_k[1:-1:2] *= 4.0
    of_k[2:-1:2] *= 2.0
    t, of_t = np.polynomial.legendre.leggauss(40)
    t = 0.5 * radius * (t + 1.0)
    of_t = 0.5 * radius * of_t
    cosines = np.cos(np.outer(k, t))
    kernel = 2.0 / np.pi * (cosines.T * (of_k * layer.softening(k * layer.thickness))) @ cosines
    phi = np.linalg.solve(np.eye(len(t)) + kernel * of_t, np.ones(len(t)))
    bare = (1.0 - layer.poisson_below**2) * radius
    return of_t @ phi / layer.surface * (1.0 - layer.poisson_below**2) ** 2 / bare


def stiffness_ratio(layer, footprint, per_side):
    """Return the stiffness of a footprint under a layer over that without [1]."""
    bare = float(level_compliance([footprint], layer.poisson_below, np.zeros(()), per_side)[0, 0])
    return bare / (bare + float(layered_change([footprint], [layer], per_side)[0, 0, 0]))


def sinusoidal_sinking(layer, kh):
    """Return k (1 - nu) / mu times the surface's displacement per pressure of wave number k [1], by six equations.

    Plane strain, A + B z and C + D z times exp(-+ k z) in the layer and A + B z below; stresses and displacements
    agree at z = h.
    """
    h = kh  # lengths over 1 / k

    def rows(z, poisson, shear, sign):
        """Return w, u, sigma_z, tau of the two functions that go with exp(-sign z)."""
        decay = np.exp(-sign * (z - (0.0 if sign > 0 else h)))
        kappa = 3.0 - 4.0 * poisson
        w = np.array([1.0, z]) * decay
        u = np.array([sign * 1.0, sign * z - kappa]) * decay
        dw = np.array([-sign, 1.0 - sign * z]) * decay
        du = np.array([-1.0, sign * 1.0 - z + sign * kappa]) * decay
        lam = 2.0 * shear * poisson / (1.0 - 2.0 * poisson)
        return w, u, (lam + 2.0 * shear) * dw + lam * u, shear * (du - w)

    mu_s = layer.modulus / (2.0 * (1.0 + layer.poisson))
    mu = 1.0 / (2.0 * (1.0 + layer.poisson_below))
    zero = np.zeros(2)
    system = []
    right = []
    top = [rows(0.0, layer.poisson, mu_s, sign) for sign in (1.0, -1.0)]
    for part, load in ((2, -1.0), (3, 0.0)):
        system.append(np.concatenate([top[0][part], top[1][part], zero]))
        right.append(load)
    joint = [rows(h, layer.poisson, mu_s, sign) for sign in (1.0, -1.0)]
    below = rows(h, layer.poisson_below, mu, 1.0)
    for part in range(4):
        system.append(np.concatenate([joint[0][part], joint[1][part], -below[part]]))
        right.append(0.0)
    found = np.linalg.solve(np.array(system), np.array(right))
    return float(np.concatenate([top[0][0], top[1][0], zero]) @ found) / ((1.0 - layer.poisson) / mu_s)


@pytest.mark.parametrize("poissons", [(0.3, 0.3), (0.45, 0.3), (0.2, 0.49)])
@pytest.mark.parametrize("modulus", [1.0, 10.0, 100.0])
def test_waves_sink_a_layer_as_six_equations_say(modulus, poissons):
    layer = Layer(0.3, modulus, *poissons)
    for kh in (0.05, 0.3, 1.0, 3.0):
        assert 1.0 + layer.softening(np.array(kh)) == pytest.approx(sinusoidal_sinking(layer, kh), rel=1e-9)


@pytest.mark.parametrize(("thickness", "per_side"), [pytest.param(0.1, 17, marks=pytest.mark.slow), (0.3, 9), (0.6, 9)])
@pytest.mark.parametrize("modulus", [20.0, 10.0, 10.0 / 3.5])
def test_a_flat_circle_is_as_stiff_as_the_integral_equation_says(thickness, per_side, modulus):
    layer = dataclasses.replace(SKIN, thickness=thickness, modulus=modulus)
    circle = Footprint(0.0, 0.0, 2.0 * RADIUS, circle_punch)
    assert stiffness_ratio(layer, circle, per_side) == pytest.approx(circle_stiffness(layer, RADIUS), rel=3e-4)


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
        circle_stiffness(SKIN, RADIUS) * 2.0 * RADIUS / (1.0 - 0.3**2), rel=1e-4
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


def bonded(u, poisson):
    """Return L of a layer on a rigid base at u = k h: N. N. Lebedev, Y. S. Ufliand (1958), in test_bonded_layer.py."""
    k = 3.0 - 4.0 * poisson
    top = 2.0 * k * np.sinh(2.0 * u) - 4.0 * u
    return top / (2.0 * k * np.cosh(2.0 * u) + 4.0 * u**2 + 1.0 + k**2)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45, 0.49])
@pytest.mark.parametrize(("h", "apart"), [(8.0, 0.0), (8.0, 3.0), (8.0, 25.0), (2.0, 3.0)])
def test_a_rigid_base_takes_off_what_the_bonded_layer_lacks(poisson, h, apart):
    off = quad(lambda u: (bonded(u, poisson) - 1.0) * j0(u * apart / h), 0.0, 25.0, limit=400, epsabs=1e-11)[0]
    expected = (1.0 - poisson**2) / (np.pi * h) * off
    # A base 1e7 times as hard, and a spline through 160 distances.
    np.testing.assert_allclose(base_compliance(h, poisson, np.array(apart)), expected, atol=1e-6)
