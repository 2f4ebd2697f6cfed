import dataclasses

import numpy as np
import pytest

from cad.parts.housing import Housing
from cad.quantity import InputError
from cad.theory.flexure import Flexure
from pipeline.accuracy import would_decide
from pipeline.fit import leaf_lengths as flexures
from pipeline.fit.leaf_lengths import DEFAULT, MOST_FINE, RUNGS, TOLERANCE, fit_flexures, judge_flexures, judge_on
from pipeline.stages.verdict_rules import STIFFNESS_TOLERANCE
from solve.housing.stiffness import TipCompliance
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
    # The fit solves the coarse mesh one step before the last, 0.3 % of a length away, and carries it on.
    assert judged.error_percent == pytest.approx(fitted.stiffness.error_percent, rel=0.02)


def test_loose_tolerance_is_met_on_the_coarse_mesh(fitted):
    found = fit_flexures(HOUSING, *TARGETS, *PETG, 0.02)
    loose = found.stiffness
    assert loose.dofs < fitted.stiffness.dofs
    assert max(loose.error_percent) < 2.0
    assert list(loose.K) == pytest.approx(TARGETS, rel=5e-3)
    fine = judge_on(DEFAULT, found.housing, *PETG).stiffness
    apart = 100.0 * np.abs(np.array(loose.K) / np.array(fine.K) - 1.0)
    assert np.all(apart < np.add(loose.error_percent, fine.error_percent))


def plant(monkeypatch, slope):
    """Let a mesh be its scale s, and its stiffnesses lie high by slope s^2 of 1 and 10 N/mm, whatever the lengths."""
    tips = TipCompliance(
        C=np.eye(2), strain_per_N=(1.0, 1.0), strain_inside_per_N=(1.0, 1.0), tilt_per_N=(0.0, 0.0), dofs=1, seconds=0.0
    )

    def solved(scale, _E, _poisson, foils):
        C = np.diag([1.0, 0.1]) / (1.0 + slope * scale**2)
        strain = (1.0, 1.0) if foils else None
        return dataclasses.replace(tips, C=C, dofs=round(1e4 / scale), gauge_strain_per_N=strain)

    monkeypatch.setattr(flexures, "flexure_mesh", lambda _, scale: scale)
    monkeypatch.setattr(flexures, "check_flexure_mesh", lambda *_: None)
    monkeypatch.setattr(flexures, "housing_part", lambda _: None)
    monkeypatch.setattr(flexures, "tip_compliance", solved)


@pytest.mark.parametrize(
    ("tolerance", "scale", "words"),
    [
        (0.02, 2.0, "5000 dofs): bars of 0.42 and 0.44 % meet 2 %"),
        (1e-3, 1.0, "meet 0.1 %"),
        (7e-4, 0.5, "meet 0.07 %"),
        (1e-5, 0.5, "are the least there is, but miss 0.001 %"),
    ],
)
def test_cheapest_mesh_that_meets_the_tolerance_is_chosen(tolerance, scale, words, monkeypatch):
    plant(monkeypatch, 1e-3)
    found = judge_flexures(HOUSING, *PETG, tolerance).stiffness
    assert found.dofs == round(1e4 / scale)
    rung = next(rung for rung in RUNGS if rung.fine == scale)
    assert found.status.startswith(f"mesh of scale {scale:g} judged by scale {rung.coarse:g} (")
    assert found.status.endswith(words)
    apart = (1.0 + 1e-3 * rung.coarse**2) / (1.0 + 1e-3 * scale**2) - 1.0
    odd = (1.0 + 1.5 * 0.8 / 10.0, 1.0 + 1.5 * 1.2 / 10.0)
    bars = [100.0 * (one * rung.share * apart + rung.floor) for one in odd]
    assert list(found.error_percent) == pytest.approx(bars, rel=1e-9)


def test_advised_tolerance_does_decide():
    rough = 0.01 * max(judge_flexures(HOUSING, *PETG, 0.02).stiffness.error_percent)
    advice = would_decide(0.02, STIFFNESS_TOLERANCE, rough)
    assert rough > STIFFNESS_TOLERANCE
    assert 0.01 * max(judge_flexures(HOUSING, *PETG, advice).stiffness.error_percent) <= STIFFNESS_TOLERANCE


def test_leaves_of_odd_shape_have_a_wider_share():
    def shaped(**sizes):
        low, high = (dataclasses.replace(one, **sizes) for one in (HOUSING.low, HOUSING.high))
        return dataclasses.replace(HOUSING, low=low, high=high, tip_side=min(1.0, sizes["depth"]))

    assert DEFAULT.bars(shaped(depth=0.4), (1.0, 2.0)) == pytest.approx((2.51, 5.01))
    wide = DEFAULT.bars(shaped(depth=50.0, length=10.0), (1.0, 2.0))
    assert wide == pytest.approx((2.5 + 0.024 + 0.01, 2.0 * (2.5 + 0.036) + 0.01))


@pytest.mark.parametrize(("gauges", "solves"), [("none", (1, 1)), ("foil", (1, 2))])
def test_gauges_are_solved_with_and_judged_on_the_very_housing(gauges, solves, monkeypatch):
    """Without gauges the result of the coarse mesh is carried from the housing that steered."""
    plant(monkeypatch, 1e-4)
    found = fit_flexures(dataclasses.replace(HOUSING, gauges=gauges), 1.0, 10.0, *PETG)
    assert found.solves == solves
    assert (found.stiffness.gauge_strain_per_N is None) == (gauges == "none")


@pytest.fixture
def constant(monkeypatch):
    """Let every solve find the same stiffness, whatever the lengths."""
    tips = TipCompliance(
        C=np.diag([1.0, 0.1]), strain_per_N=(1.0, 1.0), strain_inside_per_N=(1.0, 1.0), tilt_per_N=(0.0, 0.0),
        dofs=1, seconds=0.0,
    )  # fmt: skip
    monkeypatch.setattr(
        flexures, "tip_compliance", lambda mesh, *_: dataclasses.replace(tips, dofs=int(mesh.t.shape[1]))
    )


@pytest.mark.usefixtures("constant")
def test_target_that_leaves_no_leaf_is_refused():
    short = dataclasses.replace(HOUSING, high=dataclasses.replace(HOUSING.high, length=4.0))
    with pytest.raises(InputError, match=r"flexures\.high\.length = .* mm: must be greater than 2 fillets = 1 mm"):
        fit_flexures(short, 1.0, 1e4, *PETG)


@pytest.mark.usefixtures("constant")
def test_targets_that_are_not_met_are_told():
    with pytest.raises(SolveError, match=r"K = 1, 10 N/mm after 4 fine solves: must be 1\.002, 10 N/mm within 0\.001"):
        fit_flexures(HOUSING, 1.002, 10.0, *PETG)
