"""The shortfall of verdicts with planted values, and the order of candidates that it makes."""

import math

import pytest

from pipeline.find.candidate import MARGIN, Candidate, shortfall
from sensor.verdict import Verdict


def verdict(name="P_max", value=1.0, limit=1.0, **changes):
    told = {"unit": "1", "tolerance": 0.1, "passed": True, "reference": "", "error": 0.0, **changes}
    return Verdict(name=name, value=value, limit=limit, **told)


def falling_short(by):
    """Return a verdict that falls short by so much, at least the margin."""
    return verdict(value=1.0 + by - MARGIN, passed=False) if by else verdict()


@pytest.mark.parametrize(
    ("name", "value", "limit", "tolerance", "passed", "off"),
    [
        # the distance over the limit
        ("P_max", 0.5, 0.0, None, False, MARGIN + 0.5),
        ("P_max", 0.5, 0.0, 0.25, False, MARGIN + 2.0),
        ("P_max", 3.0, 2.0, 0.0, False, MARGIN + 0.5),
        ("P_max", 1.995, 2.0, 0.0, True, MARGIN - 0.0025),
        ("P_max", 1.9, 2.0, 0.0, True, 0.0),
        ("P_max", 1.995, 2.0, 0.01, True, 0.0),
        ("P_max", None, 2.0, 0.0, False, 1.0),
        ("P_max", None, None, None, True, 0.0),
        # of a limit on one side how far the bar of 0.2 reaches beyond it
        ("reading.bias", 3.0, 2.0, 0.0, False, MARGIN + 0.6),
        ("reading.bias", 1.9, 2.0, 0.0, None, MARGIN + 0.05),
        ("geometry.min_wall", 1.0, 2.0, 0.0, False, MARGIN + 0.6),
        ("geometry.min_wall", 2.1, 2.0, 0.0, None, MARGIN + 0.05),
        ("geometry.min_wall", 3.0, 2.0, 0.0, True, 0.0),
    ],
)
def test_shortfall(name, value, limit, tolerance, passed, off):
    one = verdict(name, value, limit, tolerance=tolerance, passed=passed, error=0.2)
    assert shortfall(one) == pytest.approx(off)


def test_poses_without_a_reading_add_their_fraction():
    """The value is that of the other poses, and keeps the limit."""
    told = "3 of 60 poses have no reading, as at 1 MPa, level: all off"
    one = verdict("reading.bias", 1.0, 2.0, tolerance=0.0, passed=False, reference=told)
    assert shortfall(one) == pytest.approx(MARGIN + 0.05)


@pytest.mark.parametrize(("passed", "off", "failed"), [(None, 0.0, 1), (False, 1.0, 1), (True, 0.0, 0)])
def test_leaf_that_the_beam_law_cannot_tell_is_left_to_the_run(passed, off, failed):
    candidate = Candidate(changes={}, verdicts=(verdict("printable.low", 60.0, "4 to 60", passed=passed),))
    assert (candidate.shortfall, candidate.passes, candidate.rank) == (off, off == 0.0, (off, failed))


def test_costs_are_in_the_order_of_the_designs():
    def cost(value, off=0.0):
        return Candidate(changes={}, verdicts=(falling_short(off),), value=value).cost

    passing = [cost(value) for value in (-1e6, -2.0, 0.0, 0.1, 2e4, 2.1e4, 1e12)]
    failing = [cost(-5.0, off) for off in (MARGIN, 1.0, 1e6)]
    refused = Candidate(changes={}, verdicts=None)
    costs = [*passing, *failing, refused.cost]
    assert costs == sorted(set(costs))
    assert Candidate(changes={}, verdicts=(), value=math.nan).cost == refused.cost
