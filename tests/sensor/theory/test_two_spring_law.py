"""The paper's numbers: WCECS 2019, ISBN 978-988-14048-7-9; stiffnesses there in N/m, so some tests use N/m."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sensor.theory.two_spring_law import (
    Springs,
    curve_nonlinearity,
    curve_shares,
    force_ratio,
    fruit_stiffness,
    hayes_stiffness,
    nonlinearity,
    size_springs,
    stiffness_at_largest_nonlinearity,
)

PAPER = Springs(K_l=753.0, K_h=17300.0)
PAPER_K_M = 3850.0
ROUND_OFF = 1e-9
P_MAX = st.floats(1.01, 100.0)
NL = st.floats(1e-4, 0.49)
STIFFNESS = st.floats(1e-6, 1e6)
DEFINITION = st.sampled_from(["mid-range", "largest"])
RATIO = st.sampled_from([1.0, 0.8, 0.953, 1.3])


def test_hayes_stiffness_of_the_paper():
    exact = hayes_stiffness(3.5, 0.3, 0.5)
    assert 1e3 * exact == pytest.approx(3846.15, abs=0.005)
    springs = size_springs(5.0, 0.05, 1e3 * exact)
    assert springs.K_l == pytest.approx(752.5, abs=0.05)
    assert springs.K_h == pytest.approx(17308.0, abs=0.5)
    for E, printed in [(0.5, 550), (1.0, 1100), (1.5, 1650), (2.0, 2200), (2.5, 2750), (3.0, 3300)]:
        assert 1e3 * hayes_stiffness(E, 0.3, 0.5) == pytest.approx(printed, rel=1.1e-3)  # the paper rounds 1098.9


def test_largest_nonlinearity_is_not_at_mid_range():
    springs = size_springs(5.0, 0.05, PAPER_K_M)
    assert stiffness_at_largest_nonlinearity(PAPER.K_h, PAPER_K_M) == pytest.approx(1828.0, abs=0.5)
    assert nonlinearity(springs, PAPER_K_M, "largest") == pytest.approx(0.05013, abs=5e-6)


@given(P_max=P_MAX, NL=NL, K_m_max=STIFFNESS, q=RATIO)
def test_largest_is_the_largest_over_the_range(P_max, NL, K_m_max, q):
    springs = size_springs(P_max * q, NL, K_m_max, stiffness_ratio=q)
    steps = [step / 200 for step in range(1, 201)]
    departures = [(force_ratio(springs, x * K_m_max, q) / q - 1.0) / (P_max - 1.0) - x for x in steps]
    largest = nonlinearity(springs, K_m_max, "largest", q)
    assert largest >= max(departures) - 1e-9
    assert largest == pytest.approx(max(departures), rel=1e-2)  # the grid's own error, 1/200 beside a flat top


@given(P_max=P_MAX, NL=NL, K_m_max=STIFFNESS, definition=DEFINITION, q=RATIO)
def test_sized_springs_meet_both_targets(P_max, NL, K_m_max, definition, q):
    """On the middle of a fruit, q = 1, and off it."""
    springs = size_springs(P_max * q, NL, K_m_max, definition, q)
    assert force_ratio(springs, K_m_max, q) == pytest.approx(P_max * q, rel=ROUND_OFF)
    assert nonlinearity(springs, K_m_max, definition, q) == pytest.approx(NL, rel=1e-6, abs=1e-9)  # P - q cancels


@given(P_max=P_MAX, NL=NL, K_m_max=STIFFNESS, share=st.floats(0.001, 1.0))
def test_fruit_stiffness_is_the_inverse_of_the_force_ratio(P_max, NL, K_m_max, share):
    springs = size_springs(P_max, NL, K_m_max)
    K_m = share * K_m_max
    assert fruit_stiffness(springs, force_ratio(springs, K_m)) == pytest.approx(K_m, rel=1e-6)  # P - 1 cancels digits


@pytest.mark.parametrize("P", [1.0, 0.5, 17300.0 / 753.0, 23.0, math.nan, math.inf])
def test_force_ratio_out_of_reach_is_refused(P):
    with pytest.raises(ValueError, match=f"P = {P:g}"):
        fruit_stiffness(PAPER, P)


@pytest.mark.parametrize(
    ("P_max", "NL", "K_m_max"),
    [
        *((P_max, 0.05, 4.0) for P_max in (1.0, math.nan)),
        *((5.0, NL, 4.0) for NL in (0.0, 0.5, math.nan)),
        *((5.0, 0.05, K_m_max) for K_m_max in (0.0, math.inf)),
    ],
)
def test_targets_that_no_springs_meet_are_refused(P_max, NL, K_m_max):
    with pytest.raises(ValueError, match=f"P_max = {P_max:g}, NL = {NL:g}, K_m_max = {K_m_max:g}"):
        size_springs(P_max, NL, K_m_max)


@pytest.mark.parametrize(
    ("argument", "value", "named"),
    [
        *(("definition", value, "definition") for value in ("foo", "Largest", "", None)),
        *(("stiffness_ratio", value, "stiffness_ratio") for value in (0.0, -1.0, math.nan, math.inf, "1", None)),
        *(("stiffening", value, "stiffening") for value in (5.0, "skin", (1e-9, 1.0), (1e-9, 0.3, 0.7, 1.0))),
        *(("stiffening", value, "stiffening") for value in ((0.0, 0.5, 1.0), (0.1, math.nan, 1.0), (0.1, 0.5, 0.9))),
        *(("stiffening", value, "NL") for value in ((0.1, 0.5, 1.0), (1.0, 1.0, 1.0), (0.1, 0.9, 1.0))),
        *((name, value, name) for name in ("P_max", "NL", "K_m_max") for value in ("5", None, True)),
    ],
)
def test_argument_of_springs_that_cannot_be_is_refused(argument, value, named):
    arguments = {"P_max": 5.0, "NL": 0.05, "K_m_max": 4.6, argument: value}
    with pytest.raises(ValueError, match=f"^{named} = [^\n]+ must be [^\n]+$"):
        size_springs(**arguments)


def test_arrays_and_numbers_of_numpy_size_the_same_springs():
    stiffening = (0.01, 0.52, 1.0)
    springs = size_springs(5.0, 0.05, 4.5, stiffening=stiffening)
    for each in (np.array(stiffening), list(stiffening)):
        assert size_springs(np.int64(5), np.float64(0.05), np.float32(4.5), stiffening=each) == springs
    assert size_springs(5.0, 0.05, 4.5, stiffening=np.array([])) == size_springs(5.0, 0.05, 4.5)


@pytest.mark.parametrize("K_m", [0.0, -1.0, math.inf, math.nan, "2", None, np.array([1.0, 0.0])], ids=str)
def test_fruit_without_a_stiffness_has_no_force_ratio(K_m):
    with pytest.raises(ValueError, match=r"^K_m = .+ must be "):
        force_ratio(PAPER, K_m)


@pytest.mark.parametrize("ratio", [0.0, -1.0, math.inf, math.nan, "1"])
def test_stiffness_ratio_that_is_none_is_refused(ratio):
    for convert in (force_ratio, fruit_stiffness):
        with pytest.raises(ValueError, match=r"^stiffness_ratio = .+ must be "):
            convert(PAPER, 2.0, ratio)


def test_force_ratio_of_an_array_is_that_of_each_stiffness():
    K_m = np.array([500.0, 4000.0])
    assert force_ratio(PAPER, K_m).tolist() == [force_ratio(PAPER, each) for each in K_m.tolist()]


@pytest.mark.parametrize(
    ("K_l", "K_h"), [(0.0, 1.0), (-1.0, 1.0), (1.0, 0.0), (1.0, math.inf), (math.nan, 1.0), ("1", 2.0), (None, 2.0)]
)
def test_springs_that_are_none_are_refused(K_l, K_h):
    with pytest.raises(ValueError, match="K_l = "):
        Springs(K_l=K_l, K_h=K_h)


def test_force_ratio_off_the_middle_is_that_of_two_springs_in_series_each():
    """P = (1/K_l + (s11 - s12)/E) / (1/K_h + (s22 - s12)/E) from x = F/K + S F/E with both tips level."""
    s11, s22, s12, E = 0.76, 0.79, 0.011, 3.5
    springs = Springs(K_l=0.9, K_h=20.0)
    exact = (1.0 / 0.9 + (s11 - s12) / E) / (1.0 / 20.0 + (s22 - s12) / E)
    found = force_ratio(springs, E / (s11 - s12), (s11 - s12) / (s22 - s12))
    assert found == pytest.approx(exact, rel=1e-12)
    assert fruit_stiffness(springs, found, (s11 - s12) / (s22 - s12)) == pytest.approx(E / (s11 - s12), rel=1e-9)


@pytest.mark.parametrize("definition", ["mid-range", "largest"])
@pytest.mark.parametrize("steps", [24, 72])
def test_nonlinearity_of_a_curve_is_that_of_the_law(definition, steps):
    """The parabola through three points misses the top by its third difference, under the cube of a step."""
    K_m = [PAPER_K_M * share for share in curve_shares(steps)]
    P = [force_ratio(PAPER, stiffness) for stiffness in K_m]
    exact = nonlinearity(PAPER, PAPER_K_M, definition)
    near = 1e-8 if definition == "mid-range" else steps**-3.0 * exact  # the softest fruit is not quite none
    assert curve_nonlinearity(P, K_m, definition) == pytest.approx(exact, abs=near)


@pytest.mark.parametrize("P", [[1.0, math.nan, 3.0], [math.nan, 2.0, 3.0], [2.0, 2.0, 2.0]])
def test_curve_with_a_tip_off_the_fruit_or_no_rise_has_no_nonlinearity(P):
    assert math.isnan(curve_nonlinearity(P, [0.0, 1.0, 2.0], "largest"))
