import dataclasses
import itertools

import numpy as np
import pytest

from cad.flexure import Flexure
from cad.housing import Housing
from cad.quantity import InputError
from pipeline import flexures
from pipeline.flexures import MOST_FINE, TOLERANCE, fit_flexures, judge_flexures
from solve.flexure import TipCompliance
from solve.linear import SolveError

HOUSING = Housing(
    low=Flexure(thickness=0.8, length=28.3, depth=10.0, separation=14.0, fillet=0.5),
    high=Flexure(thickness=1.2, length=14.0, depth=10.0, separation=14.0, fillet=0.5),
    tip_side=1.0, tip_height=1.0, spacing=8.0, shuttle_width=6.0, neck_level=5.5, lower_leaf_level=7.6,
    low_top_level=24.0, high_top_level=24.45, cavity_level=24.75, top_level=30.75, protrusion=1.7,
)  # fmt: skip
PETG = (2000.0, 0.38)
TARGETS = (0.906, 20.83)
ONE_THOUSANDTH = 1e-9  # of a length in mm, how near it is to a whole 0.001 mm


@pytest.fixture(scope="module")
def fitted():
    return fit_flexures(HOUSING, *TARGETS, *PETG)


def test_both_stiffnesses_meet_their_targets_with_a_bar_under_the_tolerance(fitted):
    assert list(fitted.stiffness.K) == pytest.approx(TARGETS, rel=TOLERANCE)
    assert max(fitted.stiffness.error_percent) < 100.0 * TOLERANCE
    assert fitted.solves[0] <= MOST_FINE


def test_only_the_lengths_change_and_are_drawn_to_a_thousandth(fitted):
    lengths = (fitted.housing.low.length, fitted.housing.high.length)
    assert lengths == pytest.approx([round(length, 3) for length in lengths], abs=ONE_THOUSANDTH)
    low, high = (
        dataclasses.replace(getattr(HOUSING, side), length=length)
        for side, length in zip(("low", "high"), lengths, strict=True)
    )
    assert dataclasses.replace(HOUSING, low=low, high=high) == fitted.housing


def test_judging_the_fitted_housing_finds_the_same_numbers(fitted):
    judged = judge_flexures(fitted.housing, *PETG).stiffness
    assert judged.K == fitted.stiffness.K
    assert judged.error_percent == fitted.stiffness.error_percent


@pytest.fixture
def constant(monkeypatch):
    """Let every solve find the same stiffness, whatever the lengths."""
    tips = TipCompliance(
        C=np.diag([1.0, 0.1]), strain_per_N=(1.0, 1.0), strain_inside_per_N=(1.0, 1.0), tilt_per_N=(0.0, 0.0),
        dofs=1, seconds=0.0,
    )  # fmt: skip
    dofs = itertools.count(2, -1)
    monkeypatch.setattr(flexures, "tip_compliance", lambda *_: dataclasses.replace(tips, dofs=next(dofs)))


@pytest.mark.usefixtures("constant")
def test_target_that_leaves_no_leaf_is_refused():
    short = dataclasses.replace(HOUSING, high=dataclasses.replace(HOUSING.high, length=4.0))
    with pytest.raises(InputError, match=r"flexures\.high\.length = .* mm: must be greater than 2 fillets = 1 mm"):
        fit_flexures(short, 1.0, 1e4, *PETG)


@pytest.mark.usefixtures("constant")
def test_targets_that_are_not_met_are_told():
    with pytest.raises(SolveError, match=r"K = 1, 10 N/mm after 4 fine solves: must be 1\.002, 10 N/mm within 0\.001"):
        fit_flexures(HOUSING, 1.002, 10.0, *PETG)
