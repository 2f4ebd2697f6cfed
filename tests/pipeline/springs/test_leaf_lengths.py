"""Leaf lengths that meet their targets on the cheapest meshes that know them, and what is refused."""

import dataclasses
from concurrent.futures import Future
from contextlib import suppress

import numpy as np
import pytest
from refusal import refusal
from stand_ins import PETG, default_housing, housing_stiffness

from cad.parts.pin import pin_compliance
from pipeline.springs import leaf_lengths
from pipeline.springs.leaf_lengths import (
    COARSE,
    DEFAULT,
    MESH_PAIRS,
    ROUGH_ERROR,
    ROUGH_LIFT,
    TOLERANCE,
    HousingSolver,
    add_pin_compliance,
    fit_lengths,
    fit_on_mesh,
    targets_without_pins,
)
from sensor.design.parameters import Design
from sensor.design.tips import Tips
from solve.housing.stiffness import TipCompliance
from solve.linear import SolveError

HOUSING = default_housing(lengths=(28.3, 14.0))
PINNED = default_housing(Design(tips=Tips(socket="pin")), lengths=(28.3, 14.0))
MATERIAL = (PETG.E_MPa, PETG.poisson)
TARGETS = (0.906, 20.83)


TIPS = TipCompliance(
    C=np.diag([1.0, 0.1]),
    strain_per_N=(1.0, 1.0),
    strain_inside_per_N=(1.0, 1.0),
    tilt_per_N=(0.0, 0.0),
    weight_sag=(1.0, 0.1),
    weight_sag_lengthwise=(0.0, 0.0),
    dofs=1,
    seconds=0.0,
)


def tips(K, **changes):
    """Return a solve that has found the stiffnesses [N/mm]."""
    return dataclasses.replace(TIPS, C=np.diag(1.0 / np.array(K)), **changes)


def lengths_of(housing):
    return [arm.flexure.length for arm in housing.arms]


def shaped(**sizes):
    """Return the housing with leaves of other sizes [mm]."""
    flexures = {arm.name: dataclasses.replace(arm.flexure, **sizes) for arm in HOUSING.arms}
    return dataclasses.replace(HOUSING, tip_side=min(1.0, sizes.get("depth", 1.0))).with_flexures(flexures)


def with_leaves(lengths):
    """Return the housing with leaves of other lengths [mm]."""
    rows = zip(HOUSING.arms, lengths, strict=True)
    return HOUSING.with_flexures({arm.name: dataclasses.replace(arm.flexure, length=length) for arm, length in rows})


@pytest.fixture(scope="module")
def fitted():
    return fit_lengths(HOUSING, TARGETS, HousingSolver(*MATERIAL))


def test_both_stiffnesses_meet_their_targets_by_lengths_that_are_drawn_to_a_thousandth(fitted):
    assert pytest.approx(TARGETS, rel=TOLERANCE) == fitted.stiffness.K
    assert max(fitted.stiffness.error) < TOLERANCE
    lengths = lengths_of(fitted.housing)
    assert lengths == pytest.approx(np.round(lengths, 3), abs=1e-9)
    assert with_leaves(lengths) == fitted.housing


@pytest.mark.slow
def test_solving_the_fitted_housing_finds_the_same_numbers(fitted):
    solver = HousingSolver(*MATERIAL)
    fine, coarse = (solver.solve(fitted.housing, scale) for scale in (DEFAULT.fine, DEFAULT.coarse))
    again = DEFAULT.stiffness_with_errors(fitted.housing, fine, coarse)
    assert again.K == fitted.stiffness.K
    # The fit solves the coarse mesh one step before the last, 0.3 % of a length away, and carries it on.
    assert again.error == pytest.approx(fitted.stiffness.error, rel=0.02)
    assert again.weight_sag_error == pytest.approx(fitted.stiffness.weight_sag_error, rel=0.02)


class Planted:
    """Meshes that are a housing and a scale, on which each spring has K = (c / L)^n times the factor of its scale."""

    def __init__(self, factors, c=(28.0, 38.0), n=3.0):
        self.factors, self.c, self.n = factors, np.array(c), n
        self.solved = []  # scale and housing of each solve
        self.compared = []  # mesh and size of the solid of each comparison

    def __call__(self, mesh, *_):
        housing, scale = mesh
        self.solved.append((scale, housing))
        K = self.factors.get(scale, 1.0) * (self.c / lengths_of(housing)) ** self.n
        return tips(K, weight_sag=tuple(1.0 / K), dofs=round(1e4 / scale))

    def stretched(self, mesh, _, wanted):
        """Return a mesh for other lengths; a finer one than the coarse one is made anew, as a solid would be."""
        assert mesh[1] == COARSE
        return wanted, COARSE

    @property
    def scales(self):
        return [scale for scale, _ in self.solved]


BEAMS = (0.95, 20.0)  # [N/mm], at 28.482 mm and 14.0 mm
STEPS = {4.0: 1.008, 2.0: 1.002, 1.0: 1.0005, 0.5: 1.000125}  # errors with the square of the scale
WIDE = {4.0: 1.035, 2.0: 1.002}


@pytest.fixture
def fit(monkeypatch):
    """Return a function that fits the leaves to targets on planted meshes, and returns the stiffness."""

    def found(meshes, targets=BEAMS, tolerance=TOLERANCE, of=HOUSING, begin=None):
        stand_ins = {
            "flexure_mesh": lambda *mesh: mesh,
            "stretch_leaves": meshes.stretched,
            "check_flexure_mesh": lambda *both: meshes.compared.append(both),
            "draw_part_size": lambda _: None,
            "tip_compliance": meshes,
        }
        for name, stand_in in stand_ins.items():
            monkeypatch.setattr(leaf_lengths, name, stand_in)
        return fit_lengths(of, targets, HousingSolver(*MATERIAL, begin), tolerance).stiffness

    return found


@pytest.mark.parametrize(
    ("factors", "tolerance", "scales", "words"),
    [
        (STEPS, 0.015, [2.0, 2.0, 4.0], "meet 1.5 %"),
        (STEPS, 1e-3, [2.0, 2.0, 1.0], "meet 0.1 %"),
        (STEPS, 7e-4, [2.0, 2.0, 0.5], "meet 0.07 %"),
        (STEPS, 1e-5, [2.0, 2.0, 0.5], "are the smallest of all meshes, but exceed 0.001 %"),
        (WIDE, 0.01, [2.0, 2.0, 4.0, 1.0], "meet 1 %"),  # 0.3 of the step from scale 4 to 2 is too wide
    ],
)
def test_cheapest_pair_of_meshes_that_meets_the_tolerance_is_chosen(factors, tolerance, scales, words, fit):
    meshes = Planted(factors)
    found = fit(meshes, tolerance=tolerance)
    assert meshes.scales == scales
    fine = min(scales[-1], COARSE)
    assert found.info.dofs == round(1e4 / fine)
    assert found.info.status.startswith(f"mesh of scale {fine:g} judged by scale ")
    assert found.info.status.endswith(words)
    assert pytest.approx(BEAMS, rel=min(max(tolerance, TOLERANCE), 5e-3)) == found.K


def test_coarse_solution_is_carried_to_the_last_lengths(fit):
    """The step between the meshes is in the bars, and nothing of the lengths at which the coarse one was solved."""
    meshes = Planted({COARSE: 1.002})
    found = fit(meshes)
    assert meshes.scales == [COARSE, COARSE, 1.0]
    assert meshes.solved[1][1] != meshes.solved[2][1]
    factors = [1.0 + 1.5 * t / 10.0 for t in (0.8, 1.2)]
    assert found.error == pytest.approx([f * DEFAULT.fraction * 0.002 + DEFAULT.floor for f in factors], rel=0.02)
    assert found.weight_sag_error == pytest.approx((1.0 - 1.0 / 1.002,) * 2, rel=0.02)


def test_slope_that_the_coarse_mesh_has_found_is_right_on_the_fine_one(fit):
    """A fine mesh 2 % softer than expected is solved twice: the first solve tells the miss, the second has none."""
    meshes = Planted({1.0: 0.98}, c=(32.0, 40.0))
    fit(meshes)
    assert meshes.scales.count(1.0) == 2


def test_targets_that_are_not_met_are_an_error(fit):
    """Lengths that do not move the stiffness of the fine mesh, which is 0.2 % off."""
    meshes = Planted({1.0: 1.002}, c=(1.0, 1.0), n=0.0)
    with pytest.raises(SolveError):
        fit(meshes, (1.0, 1.0))
    assert meshes.scales == [2.0, 1.0, 1.0, 1.0, 1.0]


def test_pins_in_series_are_made_good_by_stiffer_feet(fit):
    """A pin gives 1.4e-5 mm/N: 0.28 % of a high spring of 200 N/mm, more than its tolerance."""
    meshes = Planted(STEPS, c=(28.0, 81.5))
    targets = (0.95, 200.0)
    pinned, bare = (fit(meshes, targets, of=of) for of in (PINNED, HOUSING))
    assert pytest.approx(targets, rel=TOLERANCE) == pinned.K
    give = pin_compliance(PINNED.pin, *MATERIAL)
    expected = [error + K * give.error for error, K in zip(bare.error, targets, strict=True)]
    assert pinned.error == pytest.approx(expected, rel=0.02)
    assert meshes.scales.count(1.0) == 2


def test_pins_add_their_give_to_the_compliance_and_half_its_span_to_the_error():
    give = pin_compliance(PINNED.pin, *MATERIAL)
    pinned = add_pin_compliance(housing_stiffness(TARGETS, error=(5e-4, 5e-4)), give)
    for K, foot, error in zip(pinned.K, TARGETS, pinned.error, strict=True):
        assert pytest.approx(1.0 / foot + give.value) == 1.0 / K
        assert error == pytest.approx(5e-4 * K / foot + K * give.error)
    stiffest = 1.0 / give.value
    assert targets_without_pins((1.0, 0.99 * stiffest), give)[1] > 0.0
    assert refusal(targets_without_pins, (1.0, 1.01 * stiffest), give).field == "flexures.high.stiffness"


def test_solid_is_begun_beside_the_fine_solve_and_compared_with_its_mesh(fit):
    begun = []

    def begin(housing):
        begun.append(housing)
        size = Future()
        size.set_result(len(begun))
        return size

    meshes = Planted(STEPS)
    fit(meshes, begin=begin)
    (housing,) = begun
    assert meshes.compared == [((housing, 1.0), 1)]
    assert meshes.solved[-1] == (1.0, housing)


def test_rough_stiffness_is_of_one_mesh_corrected_for_its_lift_with_bars_by_random_designs(fit, monkeypatch):
    meshes = Planted({3.0: ROUGH_LIFT})
    monkeypatch.setattr(leaf_lengths, "coarse_half", lambda housing, *_, rough: (housing, 3.0 if rough else 4.0))
    monkeypatch.setattr(leaf_lengths, "compliance_of", meshes)
    found = fit(meshes, tolerance=0.02)
    assert pytest.approx(BEAMS, rel=5e-3) == found.K
    assert found.error == pytest.approx([ROUGH_ERROR * (1.0 + 1.5 * t / 10.0) for t in (0.8, 1.2)])
    assert found.weight_sag_error == found.error
    assert found.info.status.endswith("by random designs")


@pytest.mark.parametrize("pair", MESH_PAIRS, ids=lambda pair: f"{pair.fine:g} by {pair.coarse:g}")
@pytest.mark.parametrize(
    ("sizes", "factors"),
    [
        ({}, (1.0 + 1.5 * 0.8 / 10.0, 1.0 + 1.5 * 1.2 / 10.0)),
        ({"depth": 0.4}, (2.5, 2.5)),
        ({"depth": 50.0, "length": 10.0}, [1.0 + 1.5 * t / 50.0 + 2.0 * (1.0 - 10.0 / 40.0) for t in (0.8, 1.2)]),
    ],
    ids=["usual", "as thick as deep", "deeper than long"],
)
def test_error_bar_is_a_share_of_the_step_between_meshes_and_a_floor_and_wider_for_odd_leaves(pair, sizes, factors):
    found = pair.stiffness_with_errors(shaped(**sizes), tips([1.0, 10.0]), tips([1.01, 10.2]))
    shares = [factor * pair.fraction * apart for factor, apart in zip(factors, (0.01, 0.02), strict=True)]
    assert found.error == pytest.approx([share + pair.floor for share in shares], rel=1e-9)
    assert pytest.approx((1.0, 10.0)) == found.K


@pytest.mark.parametrize(
    ("slope", "aim", "scatter", "lengths"),
    [
        (25.0, 20.0, 1.0, [30.0, 20.0]),
        # From 30 mm to 20 mm the line is 10 mm long: with twice its slope a step has 20 mm, but at most 30 / 1.6.
        (50.0, 20.0, 1.0, [30.0, 18.75, 20.0]),
        (12.5, 20.0, 1.0, [30.0, 25.0, 20.0]),
        (25.0, 900.0, 1.0, [30.0, 48.0, 76.8]),
        # A step of 0.03 mm, after which the mesh is 1 % softer, leaves the slope as it is.
        (25.0, 30.03, 0.99, [30.0, 30.03, round(30.03 * (2.0 - 0.99 ** (-1.0 / 3.0)), 3)]),
    ],
    ids=["slope of the beam", "twice the slope", "half the slope", "longest step", "scatter"],
)
def test_secants_of_a_beam_lead_to_its_length(slope, aim, scatter, lengths):
    """K = (25 / L)^3 is a straight line of slope 25 in K^(-1/3). `scatter` is a factor of all solves but the first."""
    tried = []

    def solve(housing):
        tried.append(lengths_of(housing)[0])
        return tips([(25.0 / tried[-1]) ** 3 * (1.0 if len(tried) == 1 else scatter)] * 2)

    aims = np.full(2, (25.0 / aim) ** 3)
    with suppress(SolveError):
        fit_on_mesh(with_leaves([30.0, 30.0]), (slope, slope), aims, solve, max_deviation=1e-6, max_solves=len(lengths))
    assert tried == pytest.approx(lengths, rel=1e-12)


def test_target_that_leaves_no_leaf_is_refused():
    refused = refusal(fit_on_mesh, shaped(length=1.5), (25.0, 25.0), np.array([1.0, 1e6]), lambda _: TIPS)
    assert refused.field == "flexures.high.length"
