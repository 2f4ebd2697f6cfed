"""Curves against numbers of an independent program, closed forms and finer meshes.

That program has other elements (quadratic, integrated in full), another mesh and its own contact; it states 0.2 to
0.4 %. Its forces are over the linear ones of a sharp tip that slides; its tips grip.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from reference.flat_punch import force_curve as module
from reference.flat_punch import newton, press
from reference.flat_punch.curve_error import fillet_covered, fillet_loss
from reference.flat_punch.force_curve import force_curve
from reference.flat_punch.press import TipPress, pressed
from reference.flat_punch.table import RADIUS
from reference.flat_punch.tip_profile import RoundTip
from sensor.quantity import InputError
from sensor.theory.soft_tissue import no_slip
from solve.compression.flesh_law import FleshLaw

DEPTHS = np.array([0.002, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
STATED = 0.004  # error of the independent program
INDEPENDENT = {
    0.30: [1.0297, 1.0277, 1.0238, 1.0214, 1.0223, 1.0247, 1.0277, 1.0316],
    0.40: [1.0096, 1.0045, 0.9982, 0.9910, 0.9867, 0.9832, 0.9811, 0.9799],
    0.45: [1.0027, 0.9964, 0.9894, 0.9798, 0.9723, 0.9659, 0.9609, 0.9547],
    0.49: [1.0001, 0.9938, 0.9872, 0.975, 0.964, 0.956, 0.947, 0.939],  # by mixed elements from 0.2 on
}
ROUNDED = {  # (nu, edge of the round tip): at depths of 0.1, 0.3 and 0.6
    (0.30, 0.05): [0.9722, 1.0043, 1.0296],
    (0.30, 0.10): [0.9047, 0.9645, 1.0091],
    (0.45, 0.05): [0.9385, 0.9498, 0.9482],
    (0.45, 0.10): [0.8735, 0.9106, 0.9248],
}
FIRST_TOUCH = {(0.30, 0.05): 0.9087, (0.30, 0.10): 0.8178, (0.45, 0.05): 0.9090, (0.45, 0.10): 0.8178}
OTHER_LAWS = {  # over the force at first touch, at depths of 0.1, 0.3 and 0.6
    ("hencky", 0.30): [1.024, 1.072, 1.128],
    ("foam", 0.30): [0.977, 0.953, 0.953],
    ("hencky", 0.49): [1.001, 1.002, 0.991],
    ("foam", 0.49): [0.981, 0.954, 0.950],
}


def often(case, cases):
    """Return the cases, of which all but one are studies."""
    return [pytest.param(*each, marks=() if each == case else pytest.mark.study) for each in cases]


def sharp_curve(poisson, deepest=0.6):
    return force_curve(RoundTip(radius=RADIUS), FleshLaw(poisson=poisson), deepest)


@pytest.fixture(scope="module")
def soft():
    """Return the curve of a sharp tip at nu = 0.3."""
    return sharp_curve(0.3)


def assert_agree(curve, depths, expected):
    """Assert that forces over the sliding linear ones agree within both errors."""
    found, allowed = curve.factor(depths) * curve.grip, curve.error(depths) * curve.grip + STATED
    np.testing.assert_array_less(np.abs(found - expected), allowed)


def test_sharp_tip_is_that_of_the_independent_program(soft):
    assert_agree(soft, DEPTHS, INDEPENDENT[0.30])
    assert soft.errors[-1] < 0.004
    assert (soft.reached, soft.asked) == (0.6, 0.6)


@pytest.mark.slow
@pytest.mark.parametrize(
    "poisson", [pytest.param(0.40, marks=pytest.mark.study), pytest.param(0.45, marks=pytest.mark.study), 0.49]
)
def test_tips_on_less_compressible_flesh_are_too(poisson):
    curve = sharp_curve(poisson)
    assert_agree(curve, DEPTHS, INDEPENDENT[poisson])


@pytest.mark.slow
@pytest.mark.parametrize(("poisson", "edge"), often((0.30, 0.10), ROUNDED))
def test_rounded_edges_are_too(poisson, edge):
    curve = force_curve(RoundTip(radius=RADIUS, edge=edge), FleshLaw(poisson=poisson), 0.6)
    assert_agree(curve, np.array([0.1, 0.3, 0.6]), ROUNDED[poisson, edge])
    # In the first step of that program nothing grips yet; here the sharp tip beside it grips too.
    first = float(curve.factor(0.002))
    assert abs(first - FIRST_TOUCH[poisson, edge]) < curve.errors[0] + STATED


@pytest.mark.slow
@pytest.mark.parametrize(("name", "poisson"), often(("foam", 0.30), OTHER_LAWS))
def test_other_laws_are_too(name, poisson):
    curve = force_curve(RoundTip(radius=RADIUS), FleshLaw(name=name, poisson=poisson), 0.6)
    depths = np.array([0.1, 0.3, 0.6])
    expected = OTHER_LAWS[name, poisson]
    np.testing.assert_array_less(np.abs(curve.factor(depths) - expected), curve.error(depths) + STATED)


@pytest.mark.parametrize(("ratio", "published"), [(0.2, 1.207), (0.4, 1.473), (1.0, 2.484)])
def test_small_strain_is_that_of_a_punch_on_a_bonded_layer(ratio, published, monkeypatch):
    """F = kappa 2 r E d / (1 - nu^2) with kappa of W. C. Hayes et al., 1972, at nu = 0.3; known to 0.002."""
    monkeypatch.setattr("reference.flat_punch.grid.BODY_HEIGHT", RADIUS / ratio)
    depth = 1e-4
    coarse, fine = (
        pressed(TipPress(tip=RoundTip(radius=RADIUS), law=FleshLaw(), refinement=each), (depth,)) for each in (1, 2)
    )
    step = coarse.sliding - fine.sliding
    halfspace = 2.0 * RADIUS / (1.0 - 0.3**2)
    # A singular edge converges with the size of its elements: as much again as the last step is left.
    assert (fine.sliding - step) / halfspace == pytest.approx(published, abs=0.002 + 0.5 * step / halfspace)
    assert fine.forces[0] / (fine.sharp * depth) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45])
def test_grip_at_small_strain_is_that_of_spence(poisson):
    """On a half-space, which the body is but for 4 % of its force: of the grip too."""
    found = pressed(TipPress(tip=RoundTip(radius=RADIUS), law=FleshLaw(poisson=poisson)), (1e-4,))
    assert found.sharp / found.sliding - 1.0 == pytest.approx(no_slip(poisson), rel=0.06)


@pytest.mark.parametrize("apart", [0.0, 1.5 * module.MOST_APART])
def test_curve_ends_where_no_equilibrium_was_found_or_two(monkeypatch, apart):
    """Both meshes end after four depths, or the finer one finds other forces from there on."""

    def breaking(press_, depths):
        found = press.pressed(press_, depths[: 6 if apart else 4])
        forces = found.forces.copy()
        forces[4:] *= 1.0 + apart * (press_.refinement > 1)
        return replace(found, forces=forces)

    monkeypatch.setattr(module, "pressed", breaking)
    curve = sharp_curve(0.3)
    assert curve.reached == pytest.approx(module.DEPTH_FRACTIONS[3] * 0.6)
    with pytest.raises(InputError) as refused:
        curve.factor(np.array([0.01, 0.3]))
    assert (refused.value.field, refused.value.value) == ("depth", 0.3)


@pytest.mark.study
def test_curve_of_hencky_ends_where_its_meshes_find_two_equilibria():
    """Hencky's law at nu = 0 snaps round a sharp edge where the mesh decides: at 0.25 sides they are 2.4 % apart."""
    curve = force_curve(RoundTip(radius=RADIUS), FleshLaw(name="hencky", poisson=0.0), 0.6)
    assert curve.reached < 0.25
    assert max(curve.errors) < module.MOST_APART


@pytest.mark.parametrize("edge", [0.05, 0.1])
def test_what_a_fillet_takes_off_is_known_to_half_of_it(edge):
    """In closed form, beside the independent program, which solves a fillet: as small ones are not solved here."""
    depths = np.array([0.1, 0.3])
    sharp = np.array(INDEPENDENT[0.30])[[2, 4]]
    found = 1.0 - np.array(ROUNDED[0.30, edge][:2]) / sharp
    lost = fillet_loss(RADIUS, edge, depths)
    np.testing.assert_array_less(np.abs(lost - found), 0.5 * lost)
    np.testing.assert_allclose(lost, found, atol=2.0 * STATED)


def test_small_fillet_is_a_sharp_edge_whose_loss_is_taken_off_and_in_the_error(soft):
    edge = module.LEAST_SOLVED_EDGE * RADIUS
    curve = force_curve(RoundTip(radius=RADIUS, edge=edge), FleshLaw(poisson=0.3), 0.6)
    lost = fillet_loss(RADIUS, edge, np.array(soft.depths))
    np.testing.assert_allclose(curve.factors, np.array(soft.factors) * (1.0 - lost), rtol=1e-12)
    np.testing.assert_allclose(np.array(curve.errors) - soft.errors, 0.5 * lost, atol=1e-12)
    assert 0.5 * lost.max() < 0.003


def test_fillet_in_contact_fills_the_depth_of_sneddon():
    """D = a times the integral of f'(r) / sqrt(a^2 - r^2) up to a, f' = (r - seat) / edge on a narrow fillet."""
    edge, depth = 0.002, 0.005
    covered = float(fillet_covered(RADIUS, edge, np.array([depth]))[0])
    seat = RADIUS - edge
    a = seat + covered
    angle, step = np.linspace(math.asin(seat / a), 0.5 * math.pi, 2001, retstep=True)
    slope = (a * np.sin(angle) - seat) / edge  # dr / sqrt(a^2 - r^2) is the step of the angle
    filled = a * step * (slope.sum() - 0.5 * (slope[0] + slope[-1]))
    assert covered < edge
    assert filled == pytest.approx(depth, rel=2.0 * edge / RADIUS)


def test_step_that_does_not_converge_gives_no_number(monkeypatch):
    monkeypatch.setattr(newton, "MOST_ITERATIONS", 1)
    found = pressed(TipPress(tip=RoundTip(radius=RADIUS), law=FleshLaw()), (0.05, 0.1))
    assert len(found.forces) == 0
    with pytest.raises(newton.SolveError):
        sharp_curve(0.3)


def test_depth_of_nothing_is_refused():
    with pytest.raises(InputError) as refused:
        force_curve(RoundTip(radius=0.5), FleshLaw(), 0.0)
    assert refused.value.field == "deepest"
