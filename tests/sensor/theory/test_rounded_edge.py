"""What a rounded edge costs: its limits by formula, and square tips by unilateral contact."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips
from sensor.theory.rounded_edge import edge_loss
from solve.contact.response import scene_response
from solve.contact.scene import Scene
from solve.fruit.split import split_compliance


def by_quadrature(depth, radius):
    """Return the loss of a round tip of radius 1/2: Sneddon's integrals by adaptive quadrature and a root."""
    flat = 0.5 - radius

    def fall(t):
        def integrand(s):  # r^2 = t^2 - (t^2 - flat^2) s^2 takes both roots away
            r = np.sqrt(t * t - (t * t - flat * flat) * s * s)
            inside = r - flat
            return inside / np.sqrt(radius**2 - inside**2) * np.sqrt(t * t - flat * flat) / r

        return t * quad(integrand, 0.0, 1.0, limit=200)[0]

    contact = brentq(lambda t: fall(t) - depth, flat * (1.0 + 1e-9), 0.5 * (1.0 - 1e-9))
    missing = quad(fall, flat, contact)[0]
    return 1.0 - (depth * contact - missing) / (0.5 * depth)


@pytest.mark.parametrize("radius", [0.02, 0.05, 0.1, 0.3])
@pytest.mark.parametrize("depth", [0.01, 0.05, 0.2, 0.5])
def test_loss_is_sneddons(radius, depth):
    assert edge_loss(depth, 1.0, radius) == pytest.approx(by_quadrature(depth, radius), rel=0.01)


def test_first_touch_is_that_of_the_flat_part_and_a_deep_press_that_of_the_whole():
    for depth in (0.0, 1e-5):  # the curve's first step ends at 1/40 of the contact that the edge can add
        assert edge_loss(depth, 1.0, 0.05) == pytest.approx(0.1, rel=0.025)
    deep = [edge_loss(depth, 1.0, 0.05) for depth in (10.0, 20.0)]
    assert deep[0] == pytest.approx(2.0 * deep[1], rel=1e-9)  # what is missing is a fixed force


def test_sharp_edge_loses_nothing_and_lengths_scale():
    assert edge_loss(0.3, 1.0, 0.0) == 0.0
    assert edge_loss(0.6, 2.0, 0.1) == pytest.approx(edge_loss(0.3, 1.0, 0.05), rel=1e-12)


def test_square_tips_lose_the_same():
    """Unilateral contact of rounded cubes on the paper's block between rigid springs, against sharp ones."""
    compliance, stiff = split_compliance(Fruit(), Tips()), 1e-9 * np.eye(2)
    depths = np.array([0.05, 0.1, 0.2, 0.5])
    sharp, rounded = (
        scene_response(
            Scene(fruit=Fruit(), tips=Tips(fillet_mm=fillet), press=PressMotion()), compliance, stiff, [1.0], depths
        )
        for fillet in (0.0, 0.1)
    )
    lost = 1.0 - rounded.F[0, :, 0] / sharp.F[0, :, 0]
    for depth, loss, error in zip(depths, lost, rounded.F_error[0], strict=True):
        assert edge_loss(depth, 1.0, 0.1) == pytest.approx(loss, abs=error + 0.002)
