"""The linear response: the paper's law where it is exact, lift-off where a tip leaves the fruit."""

import numpy as np
import pytest

from sensor.theory.two_spring_law import Springs, force_ratio
from sensor.tips.layouts import SpringGroups
from solve.contact.linear_response import linear_response, spring_compliance, travels

S = np.array([[0.766603, 0.010526], [0.010526, 0.766603]])
K_M_OVER_E = 1.0 / (S[0, 0] - S[0, 1])
PAPER = spring_compliance(0.753, 17.3)
X = travels(0.6, 12)


def test_travels_end_at_the_travel_and_start_above_zero():
    assert X[0] == pytest.approx(0.05)
    assert X[-1] == pytest.approx(0.6)


@pytest.mark.parametrize(
    ("E", "P"),
    [(0.5, 1.8091), (1, 2.5607), (1.5, 3.2608), (2, 3.9144), (2.5, 4.5261), (3, 5.0997), (3.5, 5.6388)],
)
def test_paper_springs_under_the_true_contact(E, P):
    found = linear_response(S, PAPER, [E], X)
    assert list(found.P[0]) == pytest.approx([P] * 12, rel=2e-5)
    assert found.P[0, 0] == pytest.approx(force_ratio(Springs(K_l=0.753, K_h=17.3), E * K_M_OVER_E), rel=1e-12)


def test_slope_ratio_is_the_ratio_of_differences():
    found = linear_response(S, PAPER, [3.5], X, height_offsets=(-0.02, 0.02))
    ratio = np.diff(found.F[0, :, 1]) / np.diff(found.F[0, :, 0])
    assert found.slope_ratio[0, 1:] == pytest.approx(ratio, rel=1e-9)


def test_four_tips_touch_where_force_and_gap_allow():
    """Random springs, fruits and tilts: force and gap are never negative, one of them is 0, and forces close travel."""
    rng = np.random.default_rng(3)
    for _ in range(30):
        coupling = rng.uniform(-0.1, 0.1, (4, 4))
        compliance = np.diag(rng.uniform(0.5, 1.0, 4)) + coupling @ coupling.T
        springs, ahead = np.diag(rng.uniform(0.1, 2.0, 4)), rng.uniform(-0.6, 0.3, 4)
        found = linear_response(compliance, springs, [2.0], X, ahead, SpringGroups(low=(0, 2), high=(1, 3)))
        F = found.F[0]
        gap = F @ (compliance / 2.0 + springs) - (X[:, None] + ahead)
        assert F.min() >= 0.0
        assert gap.min() >= -1e-12
        assert np.abs(F * gap).max() <= 1e-12
        touching = (F > 0.0).all(axis=1)
        expected = (F[:, 1] + F[:, 3]) / np.where(touching, F[:, 0] + F[:, 2], np.nan)
        np.testing.assert_allclose(found.P[0], expected, rtol=1e-14)
