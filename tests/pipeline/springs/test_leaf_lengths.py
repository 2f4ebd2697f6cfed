"""Leaf lengths that meet their targets on the cheapest meshes that know them, and what is refused."""

import dataclasses
from concurrent.futures import Future

import numpy as np
import pytest
from stand_ins import PETG, default_housing

from pipeline.springs import leaf_lengths
from pipeline.springs.leaf_lengths import (
    COARSE,
    DEFAULT,
    MESH_PAIRS,
    ROUGH_ERROR,
    ROUGH_LIFT,
    TOLERANCE,
    HousingSolver,
    fit_lengths,
    meet,
)
from sensor.quantity import InputError
from solve.housing.stiffness import TipCompliance
from solve.linear import SolveError

HOUSING = default_housing(lengths=(28.3, 14.0))
MATERIAL = (PETG.E_MPa, PETG.poisson)
TARGETS = (0.906, 20.83)
ONE_THOUSANDTH = 1e-9  # of a length in mm, how near it is to a whole 0.001 mm
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


@pytest.fixture(scope="module")
def fitted():
    return fit_lengths(HOUSING, TARGETS, HousingSolver(*MATERIAL))


def test_both_stiffnesses_meet_their_targets_with_a_bar_under_the_tolerance(fitted):
    assert pytest.approx(TARGETS, rel=TOLERANCE) == fitted.stiffness.K
    assert max(fitted.stiffness.error) < TOLERANCE


def test_only_the_lengths_change_and_are_drawn_to_a_thousandth(fitted):
    lengths = lengths_of(fitted.housing)
    assert lengths == pytest.approx([round(length, 3) for length in lengths], abs=ONE_THOUSANDTH)
    moved = {
        arm.name: dataclasses.replace(arm.flexure, length=length)
        for arm, length in zip(HOUSING.arms, lengths, strict=True)
    }
    assert HOUSING.with_flexures(moved) == fitted.housing


@pytest.mark.slow
def test_solving_the_fitted_housing_finds_the_same_numbers(fitted):
    solver = HousingSolver(*MATERIAL)
    fine, coarse = (solver.solve(fitted.housing, scale) for scale in (DEFAULT.fine, DEFAULT.coarse))
    again = DEFAULT.judged(fitted.housing, fine, coarse)
    assert again.K == fitted.stiffness.K
    # The fit solves the coarse mesh one step before the last, 0.3 % of a length away, and carries it on.
    assert again.error == pytest.approx(fitted.stiffness.error, rel=0.02)
    assert again.weight_sag_error == pytest.approx(fitted.stiffness.weight_sag_error, rel=0.02)


def plant(monkeypatch, slope):
    """Let a mesh be its scale s, and its stiffnesses lie high by slope s^2 of 1 and 10 N/mm, whatever the lengths.

    Return the list of the scales that are solved.
    """
    scales = []

    def solved(scale, *_):
        scales.append(scale)
        return tips(np.array([1.0, 10.0]) * (1.0 + slope * scale**2), dofs=round(1e4 / scale))

    monkeypatch.setattr(leaf_lengths, "flexure_mesh", lambda _, scale: scale)
    monkeypatch.setattr(leaf_lengths, "check_flexure_mesh", lambda *_: None)
    monkeypatch.setattr(leaf_lengths, "solid_size", lambda _: None)
    monkeypatch.setattr(leaf_lengths, "tip_compliance", solved)
    return scales


@pytest.mark.parametrize(
    ("tolerance", "solved", "words"),
    [
        (0.015, [2.0, 4.0], "meet 1.5 %"),
        (1e-3, [2.0, 1.0], "meet 0.1 %"),
        (7e-4, [2.0, 0.5], "meet 0.07 %"),
        (1e-5, [2.0, 0.5], "are the least there is, but miss 0.001 %"),
    ],
)
def test_cheapest_pair_of_meshes_that_meets_the_tolerance_is_chosen(tolerance, solved, words, monkeypatch):
    scales = plant(monkeypatch, 1e-3)
    found = fit_lengths(HOUSING, (1.001, 10.01), HousingSolver(*MATERIAL), tolerance).stiffness
    assert scales == solved
    fine = min(solved[:2]) if solved[-1] < COARSE else COARSE
    assert found.info.dofs == round(1e4 / fine)
    assert found.info.status.startswith(f"mesh of scale {fine:g} judged by scale ")
    assert found.info.status.endswith(words)


def test_bars_that_miss_the_tolerance_are_narrowed_on_finer_meshes(monkeypatch):
    """The step from scale 4 to 2 is 3.6 %, of which the bar has 0.3: too wide for 1 %. The lengths stay as found."""
    scales = plant(monkeypatch, 3e-3)
    found = fit_lengths(HOUSING, (1.008, 10.08), HousingSolver(*MATERIAL), 0.01)
    assert scales == [2.0, 4.0, 1.0]
    assert max(found.stiffness.error) < 0.01


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
    found = pair.judged(shaped(**sizes), tips([1.0, 10.0]), tips([1.01, 10.2]))
    shares = [factor * pair.fraction * apart for factor, apart in zip(factors, (0.01, 0.02), strict=True)]
    assert found.error == pytest.approx([share + pair.floor for share in shares], rel=1e-9)
    assert pytest.approx((1.0, 10.0)) == found.K


def test_rough_stiffness_is_of_one_mesh_corrected_for_its_lift_with_bars_by_random_designs(monkeypatch):
    plant(monkeypatch, 0.0)
    monkeypatch.setattr(leaf_lengths, "coarse_half", lambda *_, rough: rough)
    monkeypatch.setattr(leaf_lengths, "compliance_of", lambda rough: tips([1.0, 10.0]) if rough else None)
    found = fit_lengths(HOUSING, (1.0 / ROUGH_LIFT, 10.0 / ROUGH_LIFT), HousingSolver(*MATERIAL), 0.02)
    assert found.housing == HOUSING
    assert pytest.approx((1.0 / ROUGH_LIFT, 10.0 / ROUGH_LIFT)) == found.stiffness.K
    expected = [ROUGH_ERROR * (1.0 + 1.5 * t / 10.0) for t in (0.8, 1.2)]
    assert found.stiffness.error == pytest.approx(expected)
    assert found.stiffness.weight_sag_error == found.stiffness.error
    assert found.stiffness.info.status.endswith("by random designs")


def test_solid_is_begun_beside_the_fine_solve_and_compared_with_its_mesh(monkeypatch):
    plant(monkeypatch, 1e-4)
    begun, compared = [], []

    def begin(housing):
        begun.append(housing)
        size = Future()
        size.set_result(len(begun))
        return size

    monkeypatch.setattr(leaf_lengths, "check_flexure_mesh", lambda mesh, size: compared.append((mesh, size)))
    found = fit_lengths(HOUSING, (1.0, 10.0), HousingSolver(*MATERIAL, begin))
    assert begun == [found.housing]
    assert compared == [(1.0, 1)]


def test_coarse_solution_is_carried_to_the_last_lengths(monkeypatch):
    """On beams K = (c / L)^3 whose coarse mesh is 0.2 % too stiff, that is the step to the fine one at all lengths."""
    cs = np.array([28.0, 38.0])

    def solved(mesh, *_):
        housing, scale = mesh
        K = (cs / lengths_of(housing)) ** 3 * (1.002 if scale == COARSE else 1.0)
        return tips(K, weight_sag=tuple(1.0 / K))

    plant(monkeypatch, 0.0)
    monkeypatch.setattr(leaf_lengths, "flexure_mesh", lambda *mesh: mesh)
    monkeypatch.setattr(leaf_lengths, "stretch_leaves", lambda mesh, _, wanted: (wanted, mesh[1]))
    monkeypatch.setattr(leaf_lengths, "tip_compliance", solved)
    found = fit_lengths(HOUSING, (0.95, 20.0), HousingSolver(*MATERIAL), TOLERANCE).stiffness
    # Secants start with the slope of the beam law, which is not that of these beams.
    factors = [1.0 + 1.5 * t / 10.0 for t in (0.8, 1.2)]
    expected = [factor * DEFAULT.fraction * 0.002 + DEFAULT.floor for factor in factors]
    assert found.error == pytest.approx(expected, rel=0.02)
    assert found.weight_sag_error == pytest.approx((1.0 - 1.0 / 1.002,) * 2, rel=0.02)


class Beams:
    """A mesh on which K = (c / L)^3, times what it scatters from solve to solve."""

    def __init__(self, c, scatter=()):
        self.c, self.scatter, self.lengths = c, list(scatter), []

    def __call__(self, housing):
        length = lengths_of(housing)[0]
        self.lengths.append(length)
        factor = self.scatter.pop(0) if self.scatter else 1.0
        return tips([factor * (self.c / length) ** 3] * 2)


EQUAL = shaped(length=30.0)
AIM = (25.0 / 20.0) ** 3  # [N/mm], at a length of 20 mm


@pytest.mark.parametrize(
    ("slope", "lengths"),
    [
        (25.0, [30.0, 20.0]),
        # From 30 mm to 20 mm the line is 10 mm long: with twice its slope a step has 20 mm, but at most 30 / 1.6.
        (50.0, [30.0, 18.75, 20.0]),
        (12.5, [30.0, 25.0, 20.0]),
    ],
    ids=["slope of the beam", "twice", "half"],
)
def test_secant_through_two_solves_of_a_beam_is_exact(slope, lengths):
    beams = Beams(25.0)
    found = meet(EQUAL, (slope, slope), np.array([AIM, AIM]), beams, miss=1e-6)
    assert beams.lengths == pytest.approx(lengths, rel=1e-12)
    assert lengths_of(found.housing) == [20.0, 20.0]


@pytest.mark.parametrize(("aim", "length"), [(1e-9, 48.0), (1e6, 18.75)], ids=["longer", "shorter"])
def test_one_step_goes_at_most_1_6_times_away(aim, length):
    beams = Beams(25.0)
    with pytest.raises(SolveError):
        meet(EQUAL, (25.0, 25.0), np.array([aim, aim]), beams, most_solves=2)
    assert beams.lengths[1] == pytest.approx(length)


def test_slope_is_not_learnt_from_a_step_within_the_scatter_of_meshes():
    """A step of 0.03 mm on 30 mm, after which the mesh is 1 % stiffer: the next step has the slope of the first."""
    beams = Beams(25.0, scatter=(1.0, 1.01, 1.01))
    aim = (25.0 / 30.03) ** 3
    found = meet(EQUAL, (25.0, 25.0), np.array([aim, aim]), beams, miss=1e-4)
    expected = 30.03 + 25.0 * (aim ** (-1.0 / 3.0) - (1.01 * aim) ** (-1.0 / 3.0))
    assert lengths_of(found.housing)[0] == pytest.approx(expected, abs=6e-4)


def test_target_that_leaves_no_leaf_is_refused():
    with pytest.raises(InputError) as refused:
        meet(shaped(length=1.5), (25.0, 25.0), np.array([1.0, 1e6]), lambda _: TIPS)
    assert refused.value.field == "flexures.high.length"


def test_targets_that_are_not_met_are_an_error(monkeypatch):
    scales = plant(monkeypatch, 0.0)
    monkeypatch.setattr(leaf_lengths, "stretch_leaves", lambda mesh, *_: mesh)
    with pytest.raises(SolveError):
        fit_lengths(HOUSING, (1.002, 10.0), HousingSolver(*MATERIAL))
    assert scales == [2.0, 1.0, 1.0, 1.0, 1.0]
