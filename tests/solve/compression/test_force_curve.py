"""The force of a pressed body against closed forms and against finite elements that share nothing with it."""

import numpy as np
import pytest
from bars import bars, holds
from scipy.optimize import brentq

from benchmarks.bars.compression import BALL, ball_press
from sensor.theory.hertz import force_factor
from sensor.theory.soft_tissue import FLESH_LAWS
from solve.compression.flesh_law import FleshLaw
from solve.compression.force_curve import fit_force_curve
from solve.compression.half_body import HalfBody, Section
from solve.compression.tool_press import press_forces
from solve.linear import SolveError


@pytest.mark.parametrize("name", bars("compression"))
def test_error_bar_holds(name):
    holds(name)


@pytest.mark.parametrize("poisson", [0.0, pytest.param(0.45, marks=pytest.mark.slow), 0.49])
@pytest.mark.parametrize("law", FLESH_LAWS)
def test_every_law_begins_as_hertz(law, poisson):
    """Of half-spaces the ball is one where the contact is small: at 0.04 % of the radius both laws part by 1 %."""
    body = HalfBody(BALL, FleshLaw(name=law, poisson=poisson), 0.05 * 35.0, 1.5)
    travel = 4e-4 * 35.0
    force = press_forces(body, [travel])[0]
    assert force == pytest.approx(force_factor(1.0 / (1.0 - poisson**2), 35.0) * travel**1.5, rel=0.02)


@pytest.mark.parametrize(
    ("section", "area"),
    [
        (BALL, 2.0 * np.pi * 35.0**2),
        (Section(half_height=10.0, radius=5.0, is_round=False), np.pi * 5.0 * (5.0 + 20.0)),
    ],
)
def test_areas_of_the_surface_nodes_sum_to_the_surface(section, area):
    """The chords of a ball's elements are shorter than its arcs."""
    body = HalfBody(section, FleshLaw(name="neo-hooke", poisson=0.3), 1.0)
    assert body.area.sum() == pytest.approx(area, rel=2e-3)


def uniaxial_force(law, stretch):
    """Return the force on 1 mm^2 of a bar whose sides are free [N at E = 1 MPa], pressed to a stretch."""

    def stress(side, axis):
        theta = np.array(np.log(side**2 * stretch))
        along = (side, side, stretch)[axis]
        return law.phi(np.array(along))[1] + law.U(theta)[1] / along

    side = brentq(lambda value: stress(value, 0), 0.9, 1.3, xtol=1e-14)
    return -stress(side, 2)


@pytest.mark.parametrize("law", FLESH_LAWS)
def test_cylinder_on_its_end_is_a_bar(law):
    """The penalty gives by 1e-5 E / half height under a pressure of E: 1e-5 of the force at a strain of 1."""
    flesh = FleshLaw(name=law, poisson=0.3)
    body = HalfBody(Section(half_height=10.0, radius=5.0, is_round=False), flesh, 5.0)
    travels = [0.1, 1.0, 2.0]
    exact = [25.0 * np.pi * uniaxial_force(flesh, 1.0 - travel / 10.0) for travel in travels]
    assert press_forces(body, travels) == pytest.approx(exact, rel=1e-4)


def test_cylinder_on_its_side_is_a_line_contact():
    """K. L. Johnson, Contact Mechanics (1985), (5.57): half of the approach of two plates, plane strain."""
    radius = 35.0
    length = 10.0
    reduced = 1.0 / 0.91

    def travel(line_force):
        half_width = np.sqrt(4.0 * line_force * radius / (np.pi * reduced))
        return 2.0 * line_force / (np.pi * reduced) * (np.log(4.0 * radius / half_width) - 0.5)

    section = Section(half_height=radius, radius=radius, length=length)
    body = HalfBody(section, FleshLaw(poisson=0.3), 0.2 * radius, 2.0)
    travels = [0.002 * radius, 0.005 * radius]
    exact = [length * brentq(lambda force, at=at: travel(force) - at, 1e-9, 10.0) for at in travels]
    assert press_forces(body, travels) == pytest.approx(exact, rel=0.005)


def test_a_thin_disc_that_plates_grip_is_stiff_and_a_slender_one_hardly():
    """A. N. Gent, P. B. Lindley, Proc. Inst. Mech. Eng. 173 (1959) 111: 1 + 2 S^2, S = radius / (2 height)."""
    flesh = FleshLaw(poisson=0.49)
    ratios = []
    for half_height in (2.5, 10.0):
        body = HalfBody(Section(half_height=half_height, radius=5.0, is_round=False), flesh, 5.0)
        travels = [1e-3 * half_height]
        ratios.append(press_forces(body, travels, grips=True)[0] / press_forces(body, travels)[0])
    shape_factors = np.array([0.5, 0.125])
    assert ratios == pytest.approx((1.0 + 2.0 * shape_factors**2).tolist(), rel=0.15)


def test_forces_are_the_slope_of_the_energy(rng):
    body = HalfBody(BALL, FleshLaw(poisson=0.4), 10.0)
    u = 0.01 * rng.standard_normal((body.count, 2))
    direction = rng.standard_normal((body.count, 2))
    forces, matrix = body.tangent(body.deformed(u), convex=False)
    step = 1e-5
    ahead = body.deformed(u + step * direction)
    behind = body.deformed(u - step * direction)
    slope = (ahead.energy - behind.energy) / (2.0 * step)
    assert slope == pytest.approx(float(forces @ direction.ravel()), rel=1e-6)
    change = (body.tangent(ahead, convex=False)[0] - body.tangent(behind, convex=False)[0]) / (2.0 * step)
    assert np.linalg.norm(change - matrix @ direction.ravel()) < 1e-6 * np.linalg.norm(change)


@pytest.mark.slow
def test_planted_coarse_mesh_has_a_wider_error():
    coarse = fit_force_curve(ball_press(), 0.5)
    fine = fit_force_curve(ball_press(), 1.5)
    assert coarse.error > 2.0 * fine.error


def test_a_press_through_the_body_is_refused():
    body = HalfBody(BALL, FleshLaw(poisson=0.3), 35.0)
    with pytest.raises(SolveError):
        press_forces(body, [34.9])
