"""What of a curve is its loading, to the edge of each limit; a curve that is no compression is refused at its place."""

import math
from dataclasses import replace

import numpy as np
import pytest
from refusal import refusal
from stand_ins import specimen
from virtual_compression import VirtualTest

from instrument.compress.phases import noise_of, split_phases, subtract_frame

X = np.linspace(0.0, 5.0, 601)  # [mm]
F = 20.0 * np.maximum(X - 1.0, 0.0) ** 1.5  # [N]: from 0 to 160
TEST_X, TEST_F = VirtualTest(E_MPa=1.0, noise_percent=0.05, toe_mm=0.0, offset_N=0.0, failure_strain=0.11).curve()


def moved(values, rows, step):
    values = values.copy()
    values[rows] += step
    return values


REFUSED = {
    "one force far below zero": (moved(TEST_F, 300, -500.0), TEST_X, "line 302, column 'force_N'"),
    "plate turns back": (TEST_F, moved(TEST_X, slice(300, 500), -3.0), "line 302, column 'travel_mm'"),
    "dead load cell": (np.ones(600), TEST_X, "specimen '1'"),
    "stuck travel": (TEST_F, np.ones(600), "line 2, column 'travel_mm'"),
    "force falls": (-TEST_F, TEST_X, "line 511, column 'force_N'"),
    "few rows": (F[:11], X[:11], "specimen '1'"),
    "few rows before the plate turns": (F[:601:50], np.r_[X[:501:50], 0.0, 0.0], "specimen '1'"),
    "columns are swapped": (TEST_X, TEST_F, "specimen '1'"),
    "noisy columns are swapped": (*VirtualTest(E_MPa=1.0, noise_percent=1.0).curve(), "line 5, column 'travel_mm'"),
}


@pytest.mark.parametrize(("force", "travel", "place"), REFUSED.values(), ids=REFUSED)
def test_impossible_curve_is_refused_at_its_place(force, travel, place):
    assert refusal(split_phases, specimen(travel, force)).field == f"virtual.csv, {place}"


def power_law(exponent):
    """Return a curve whose slope between loads of 0.3 and 0.6 falls, to 0.73 and 0.66 of that before."""
    return X, 10.0 * X**exponent


LIMITS = {
    "rows": ((X[:12] + 1.0, X[:12] ** 1.5), (X[:11] + 1.0, X[:11] ** 1.5)),
    "travel steps back by 2 % of it": ((moved(X, 400, -0.105), F), (moved(X, 400, -0.115), F)),  # one row is 0.0083 mm
    "force below its begin by 10 %": ((X, moved(F, 300, -F[300] - 15.9)), (X, moved(F, 300, -F[300] - 16.1))),
    "slope falls to 0.75": (power_law(0.72), power_law(0.66)),
}


@pytest.mark.parametrize(("allowed", "refused"), LIMITS.values(), ids=LIMITS)
def test_limit_is_where_it_is_said(allowed, refused):
    split_phases(specimen(*allowed))
    refusal(split_phases, specimen(*refused))


@pytest.mark.parametrize("signs", [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0)])
def test_compression_that_is_counted_negative_is_turned_by_its_flag(signs):
    turned = specimen(signs[0] * X, signs[1] * F)
    np.testing.assert_array_equal(split_phases(turned, compression_negative=True).loading.force, F)
    refusal(split_phases, turned)


@pytest.mark.parametrize(("fall", "fails"), [(0.028, False), (0.032, True)])
def test_fall_of_three_per_cent_of_the_force_is_the_failure(fall, fails):
    """The force stays at its largest from 5 to 6 mm, and lower behind, where moving means do not hide it."""
    further = np.linspace(5.0, 7.0, 241)[1:]
    force = np.r_[F, np.where(further <= 6.0, F[-1], (1.0 - fall) * F[-1])]
    curve = split_phases(specimen(np.r_[X, further], force)).loading
    if fails:
        assert 5.0 <= curve.failure <= 6.0
        assert curve.travel[-1] == curve.failure
    else:
        assert (curve.failure, curve.travel[-1]) == (None, 7.0)


@pytest.mark.parametrize(("height", "fails"), [(0.095, False), (0.105, True)])
def test_fall_of_the_zero_line_is_no_failure(height, fails):
    """Before a tenth of the range a fall by half of it is one of the load cell."""
    bump = height * F[-1] * np.interp(X, [0.2, 0.4, 0.6, 1.0], [0.0, 1.0, 1.0, 0.5], right=0.5)
    force = np.maximum(bump, F)
    assert (split_phases(specimen(X, force)).loading.failure is not None) == fails


def test_failure_has_to_be_more_than_noise():
    """A fall by 4 % under noise of 4 % is none; the noise alone of a flat end is none either."""
    noise = 0.04 * F[-1] * np.random.default_rng(3).normal(size=601)
    further = np.linspace(5.0, 6.0, 121)[1:]
    force = np.r_[F + noise, 0.96 * F[-1] + noise[:120]]
    assert split_phases(specimen(np.r_[X, further], force)).loading.failure is None


def test_many_points_are_averaged_and_the_zero_is_that_of_the_low_ones():
    x = np.linspace(0.0, 5.0, 2402)
    force = 20.0 * np.maximum(x - 1.0, 0.0) ** 1.5 + 40.0
    force[:6] += 3.0  # a load cell that settles
    curve = split_phases(specimen(x, force)).loading
    assert len(curve.travel) == 2402 // 3
    assert curve.travel[0] == pytest.approx(x[:3].mean())
    assert (curve.force[0], curve.zero) == (pytest.approx(43.0), pytest.approx(40.0))


def test_noise_is_seen_below_a_curve():
    smooth = np.linspace(0.0, 5.0, 2000) ** 1.5
    noise = np.random.default_rng(2).normal(0.0, 0.03, 2000)
    assert noise_of(smooth + noise) == pytest.approx(0.03, rel=0.1)
    assert noise_of(np.round(smooth, 1)) == pytest.approx(0.1 / math.sqrt(12.0), rel=0.01)


def tail(travel, force):
    """Return the clean curve followed by some rows."""
    return specimen(np.r_[X, travel], np.r_[F, force])


TAILS = {
    "sticks": tail([3.0, 0.2], [40.0, -30.0]),
    "returns beyond its start": tail([3.0, 0.2, -8.0], [40.0, 0.0, 0.0]),
    "second bite one micrometre deeper": tail([4.0, 3.0, 4.0, 5.001], [90.0, 40.0, 90.0, 159.0]),
    "second bite far deeper": tail([3.0, 4.0, 8.0], [40.0, 90.0, 400.0]),
}


@pytest.mark.parametrize("curve", TAILS.values(), ids=TAILS)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_comes_after_the_first_loading_is_left_out(curve, sign):
    turned = replace(curve, travel=sign * curve.travel, force=sign * curve.force)
    found = split_phases(turned, compression_negative=sign < 0.0)
    np.testing.assert_array_equal(found.specimen.travel, X)
    np.testing.assert_array_equal(found.loading.force, F)


def test_curve_from_a_preload_ends_where_its_plate_turns_back():
    """Its last forces lie below the first ones."""
    start = 300
    curve = specimen(np.r_[X[start:], 2.0, 0.0], np.r_[F[start:], 10.0, 0.0])
    np.testing.assert_array_equal(split_phases(curve).loading.force, F[start:])


def test_second_loading_is_noted_where_it_is_deeper():
    (note,) = split_phases(TAILS["second bite one micrometre deeper"]).specimen.notes
    assert f"line {len(X) + 1}," in note  # the header and the clean curve
    assert split_phases(TAILS["sticks"]).specimen.notes == ()


@pytest.mark.parametrize(("reached", "is_first"), [(0.22, True), (0.18, False)])
def test_tap_before_the_test_is_no_loading(reached, is_first):
    """It reaches a fifth of the largest force, above which it is a loading of its own."""
    last = int(np.searchsorted(F, reached * F[-1])) + 1
    curve = specimen(np.r_[X[:last], X], np.r_[F[:last], F])
    if is_first:
        assert len(split_phases(curve).specimen.lines) == last
    else:
        assert refusal(split_phases, curve).field == curve.cell(last, "travel")


def test_travel_of_the_frame_is_taken_off():
    """A frame of 3 um/N under 160 N."""
    curve = split_phases(specimen(X + 3e-3 * F, F)).loading
    np.testing.assert_allclose(subtract_frame(specimen(X, F), curve, 3.0).travel, X, atol=1e-12)
    assert refusal(subtract_frame, specimen(X, F), curve, 60.0).value == 60.0
