"""One rule judges every verdict: targets within a tolerance, limits on one side, words; bars decide what is open."""

import math

import pytest

from sensor.quantity import Estimate
from sensor.verdict import (
    READABLE,
    Verdict,
    all_passed,
    judge,
    row_of,
    verdict_rows,
)

NAMES = [name for row in verdict_rows() for name in row.names]


@pytest.mark.parametrize(
    ("value", "error", "passed"),
    [
        (5.0, 0.0, True),
        (5.0499, 0.0, True),
        (5.0501, 0.0, False),
        (4.9501, 0.05, True),
        (4.94, 0.05, False),
        (5.0, 0.051, None),
        (5.04, 0.2, None),
        (5.3, 0.2, False),
        (math.nan, 0.0, False),
    ],
)
def test_target_is_undecided_only_where_the_error_bar_exceeds_the_tolerance(value, error, passed):
    """P_max is held to 1 % of its target, leaves to a length: here both may miss by 0.05."""
    relative = judge("P_max", Estimate(value, error), "r", limit=5.0)
    absolute = judge("geometry.leaf_thickness_low", Estimate(value, error, "mm"), "r", limit=5.0, tolerance=0.05)
    assert (relative.passed, absolute.passed) == (passed, passed)
    assert (relative.limit, relative.error, relative.relative) == (5.0, error, True)
    assert relative.value == value or math.isnan(value)
    assert relative.allowed_miss == absolute.allowed_miss == pytest.approx(0.05, rel=1e-12)


@pytest.mark.parametrize(
    ("value", "error", "passed"),
    [
        (1.2, 0.1, True),
        (0.8, 0.1, False),
        (1.05, 0.1, None),
        (0.95, 0.1, None),
        (1.0, 0.0, True),
        (1.2, math.nan, None),
    ],
)
def test_limit_is_undecided_where_the_error_bar_reaches_across(value, error, passed):
    """A value above its least is as good as one as far under its largest."""
    reached = judge("sideways.low", Estimate(value, error), "r", limit=1.0)
    kept = judge("bruise", Estimate(2.0 - value, error, "MPa"), "r", limit=1.0)
    assert (reached.passed, kept.passed) == (passed, passed)
    assert (reached.limit_sense, kept.limit_sense) == ("at least", "at most")


@pytest.mark.parametrize(
    ("name", "value", "passed"),
    [
        ("geometry.min_wall", 0.79, True),
        ("geometry.min_wall", 0.77, False),
        ("geometry.overhang", 0.81, True),
        ("geometry.overhang", 0.83, False),
        ("geometry.leaf_thickness_high", 0.81, True),
        ("geometry.leaf_thickness_high", 0.83, False),
        ("geometry.min_wall", math.nan, False),
        ("geometry.overhang", math.nan, False),
    ],
)
def test_value_without_a_bar_is_decided_and_nan_fails(name, value, passed):
    found = judge(name, value, "r", limit=0.8, tolerance=0.02)
    assert (found.passed, found.error, found.tolerance) == (passed, None, 0.02)


def test_what_is_no_number_has_the_outcome_that_is_told():
    """It fails unless told otherwise, whether the value or the limit is missing."""
    for passed in (True, False, None):
        assert judge("geometry.min_gap", None, "r", limit=0.3, passed=passed).passed is passed
        assert judge("geometry.volume", 1.0, "r", passed=passed).passed is passed
    unread = judge(READABLE, None, "no file")
    assert (unread.passed, unread.value, unread.limit, unread.reference) == (False, None, "a readable file", "no file")
    words = judge("reading.bias", None, "r", limit="tips with a dome")
    assert (words.sense, words.limit_sense, words.allowed_miss) == ("at most", None, 0.0)
    assert judge("P_monotonic", None, "r").tolerance is None


def test_row_gives_unit_limit_and_tolerance():
    found = judge("geometry.plates", 0.31, "r")
    assert (found.unit, found.limit, found.tolerance, found.passed) == ("mm", 0.3, 0.0, True)
    stiffness = judge("K_l", Estimate(906.0, 0.1, "N/m"), "r", limit=906.0)
    assert (stiffness.tolerance, stiffness.relative) == (0.001, True)
    assert judge("K_l", None, "r", limit=906.0, tolerance=0.005).tolerance == 0.005


@pytest.mark.parametrize(
    ("name", "value", "limit", "said"),
    [
        ("geometry.wobble", 1.0, 1.0, "geometry.wobble"),
        ("bruise", Estimate(1.0, 0.0, "N"), 1.0, "MPa"),
        ("bruise", Estimate(1.0, 0.0, "MPa"), None, "limit"),
    ],
)
def test_verdict_without_a_row_a_limit_or_its_unit_is_refused(name, value, limit, said):
    with pytest.raises(ValueError, match=said):
        judge(name, value, "r", limit=limit)


@pytest.mark.parametrize(
    ("each", "whole"), [([True, True], True), ([True, None], None), ([None, False], False), ([True, False], False)]
)
def test_one_failed_verdict_fails_the_run(each, whole):
    verdicts = [
        Verdict(name="n", value=1.0, unit="1", limit=1.0, tolerance=0.1, passed=passed, reference="r")
        for passed in each
    ]
    assert all_passed(verdicts) is whole


def test_names_are_unique_and_a_name_without_a_row_is_plain():
    assert len(set(NAMES)) == len(NAMES)
    assert [row.name for row in verdict_rows() if row.each and not row.name.endswith("*")] == []
    plain = row_of("geometry.of_another_program")
    assert (plain.sense, plain.shown, plain.needs, plain.mended_by) == (None, None, None, ())


@pytest.mark.parametrize("row", verdict_rows(), ids=lambda row: row.name)
def test_per_cent_are_shown_of_numbers_without_a_unit_and_a_meaning_is_a_sentence(row):
    assert (row.unit == "1") >= (row.shown == "%") >= row.standard
    assert row.meaning.endswith((".", "?"))
