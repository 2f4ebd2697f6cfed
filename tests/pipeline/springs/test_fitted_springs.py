"""Springs of a design: a leaf that the law rules out is not solved, a fit that fails leaves all undecided."""

from concurrent.futures import Future
from dataclasses import replace

import numpy as np
import pytest
from refusal import refusal
from squares import GENTLE, gentle
from stand_ins import ERRORS, PETG, housing_stiffness, sizing_of

import pipeline.springs.fitted_springs
from cad.kernel import draw_part_size
from cad.parts.layout import housing_for
from mesh.session import MeshError
from pipeline.options import RunOptions, load_design
from pipeline.springs.fitted_springs import springs_for, tip_height_offsets, with_lateral_compliance
from pipeline.springs.leaf_lengths import FittedHousing
from pipeline.springs.mounts import solve_lateral_compliance
from pipeline.springs.spring import MadeSpring
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design, Print
from sensor.design.tips import Tips
from sensor.quantity import InputError
from solve.contact.scene import LateralCompliance
from solve.linear import SolveError


class Fit:
    """Notes what the fit was asked for; `error` is raised, else springs are the targets but softer."""

    def __init__(self):
        self.asked, self.error = [], None

    def __call__(self, guess, targets, solver, tolerance):
        self.asked.append((targets, solver.E, solver.poisson, tolerance))
        if self.error is not None:
            raise self.error
        stiffness = housing_stiffness(tuple(0.999 * K for K in targets), strain_per_N=(2e-3, 1e-4))
        longer = {arm.name: replace(arm.flexure, length=1.01 * arm.flexure.length) for arm in guess.arms}
        return FittedHousing(housing=guess.with_flexures(longer), stiffness=stiffness)


@pytest.fixture
def fit(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    stand_in = Fit()
    monkeypatch.setattr(pipeline.springs.fitted_springs, "fit_lengths", stand_in)
    return stand_in


def springs_of(design, options=None):
    options = options or RunOptions()
    springs = springs_for(design, sizing_of(design), "fitted", options.tolerance)
    return with_lateral_compliance(springs, design, options)


@pytest.mark.parametrize(("design", "monolithic"), [(Design(), True), (Design(tips=Tips(socket="pin")), False)])
def test_springs_are_fitted_to_the_targets_of_the_sizing_in_the_material_of_the_process(design, monolithic, fit):
    """Root strain is K d times the strain per newton, over which the limit is the safety factor."""
    springs = springs_of(design, RunOptions(tolerance=0.01))
    targets = sizing_of(design).springs.stiffnesses
    assert fit.asked == [(targets, PETG.E_MPa, PETG.poisson, 0.01)]
    assert (list(springs.springs), springs.monolithic) == (["low", "high"], monolithic)
    rows = zip(
        targets, springs.springs.items(), springs.housing.arms, springs.deflections, (2e-3, 1e-4), ERRORS, strict=True
    )
    for i, (target, (name, spring), arm, d, per_N, error) in enumerate(rows):
        K = 0.999 * target
        assert (arm.name, spring.target, spring.flexure) == (name, target, arm.flexure)
        assert springs.printable[name].length_mm == arm.flexure.length
        found = (springs.stiffnesses.stiffnesses[i], 1.0 / springs.C[i, i], springs.errors[i])
        assert found == pytest.approx((K, K, error * K))
        strain = K * d * per_N
        found = (spring.root_strain, spring.root_strain_error, spring.safety_factor, spring.highest_strain)
        assert found == pytest.approx((strain, 0.01, PETG.strain_limit / strain, 1.01 * strain))


@pytest.mark.usefixtures("fit")
def test_second_plate_of_a_square_gives_sideways_as_the_first_turned_half_round():
    """Seen from the other side, a force along x or y there moves tips the other way, and one up the same way."""
    give = np.arange(36.0).reshape(2, 2, 3, 3)
    springs = replace(springs_of(gentle()), plate_sideways=LateralCompliance(give, 0.1))
    found = springs.sideways
    turn = np.diag([-1.0, -1.0, 1.0])
    np.testing.assert_array_equal(found.compliance[:2, :2], give)
    np.testing.assert_array_equal(found.compliance[2:, 2:], turn @ give @ turn)
    assert not found.compliance[:2, 2:].any()
    assert found.error == 0.1


@pytest.mark.usefixtures("fit")
def test_sideways_give_is_solved_where_a_force_may_lean():
    assert springs_of(Design()).sideways is None
    round_fruit = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=20.0)
    for design in (Design(fruit=round_fruit), gentle()):
        springs = springs_of(design)
        sideways = springs.sideways
        for tip, along_press in enumerate(np.diag(springs.C)):
            x, y, z = np.diag(sideways.compliance[tip, tip])
            # the way of the leaves is stiffest, across less so, and along the press is not in it
            assert 0.0 < x < y < along_press
            assert z == 0.0


@pytest.mark.usefixtures("fit")
@pytest.mark.parametrize("error", [MeshError("generate", "no room", "take smaller elements"), SolveError("residual 1")])
@pytest.mark.parametrize("as_", ["leaning", "fitted"])
def test_springs_whose_sideways_give_is_not_found_are_undecided(as_, error, monkeypatch):
    def failing(*_, **__):
        raise error

    monkeypatch.setattr(pipeline.springs.fitted_springs, "solve_lateral_compliance", failing)
    springs = springs_of(gentle()) if as_ == "fitted" else springs_for(gentle(), sizing_of(gentle()), as_)
    assert_undecided(springs, error)
    assert springs.sideways is None


def assert_undecided(springs, reason):
    assert [(leaves.passed, leaves.reason) for leaves in springs.printable.values()] == [(None, str(reason))] * 2


@pytest.mark.parametrize("name", ["mango", pytest.param("kiwi", marks=pytest.mark.slow)])
def test_sideways_compliance_of_sized_springs_is_that_of_a_finer_mesh(name):
    """To 1 %, on leaves as the beam law has them; more than two cantilevers L^3 / (6 E I) alone, as they twist too."""
    design = load_design(name)
    sizing = sizing_of(design)
    springs = springs_for(design, sizing, "leaning")
    process = design.process
    lengths = [leaves.length_mm for leaves in springs.printable.values()]
    housing = housing_for(design, process, tuple(lengths), springs.deflections)
    finer = solve_lateral_compliance(housing, process.E_MPa, process.poisson, sizing.springs.stiffnesses, rough=False)
    for tip, leaf in enumerate((housing.low, housing.high)):
        across = springs.sideways.compliance[tip, tip, 1, 1]
        assert across == pytest.approx(finer.compliance[tip, tip, 1, 1], rel=0.01)
        second_moment = leaf.thickness * leaf.depth**3 / 12.0
        assert across > leaf.length**3 / (6.0 * process.E_MPa * second_moment)
    assert springs.ideal


LINE = gentle(layout="line", order="LHL")
TOO_LONG = replace(gentle(), print=Print(max_length_mm=8.0))


@pytest.mark.parametrize(
    ("as_", "design"),
    [
        ("sized", Design()),
        ("sized", gentle()),
        ("leaning", Design()),
        ("leaning", LINE),
        ("leaning", TOO_LONG),
        ("fitted", LINE),
    ],
    ids=["sized", "sized domes", "flat tips", "leaning line", "leaf too long", "fitted line"],
)
def test_springs_without_a_housing_are_just_as_stiff_as_they_were_sized(as_, design, fit):
    """None of them is solved, leans or sags, and no tip moves another one."""
    sizing = sizing_of(design)
    springs = springs_for(design, sizing, as_)
    assert (fit.asked, springs.ideal, springs.housing, springs.sideways) == ([], True, None, None)
    assert springs.stiffnesses == sizing.springs
    assert (springs.errors, springs.monolithic, tip_height_offsets(springs, "down")) == ((0.0, 0.0), True, ())
    K = dict(zip(("low", "high"), sizing.springs.stiffnesses, strict=True))
    np.testing.assert_allclose(springs.C, np.diag([1.0 / K[kind] for kind in design.tips.springs]), rtol=1e-12)


def test_same_springs_are_not_fitted_again(fit):
    first, second = springs_of(Design()), springs_of(Design(name="other"))
    assert len(fit.asked) == 1
    assert second.housing == first.housing
    springs_of(Design(), RunOptions(tolerance=0.01))
    assert len(fit.asked) == 2


def test_leaf_that_the_law_rules_out_is_not_solved(fit):
    springs = springs_of(Design(print=Print(max_length_mm=20.0)))
    assert fit.asked == []
    assert [leaves.passed for leaves in springs.printable.values()] == [False, True]
    assert (springs.housing, springs.monolithic, springs.errors) == (None, True, (0.0, 0.0))
    for spring, compliance in zip(springs.springs.values(), np.diag(springs.C), strict=True):
        assert spring == MadeSpring(target=spring.target)
        assert compliance == pytest.approx(1.0 / spring.target)


@pytest.mark.parametrize(
    "error",
    [InputError("leaf too short"), MeshError("generate", "no room", "take smaller elements"), SolveError("residual 1")],
    ids=["input", "mesh", "solve"],
)
def test_fit_that_fails_leaves_all_undecided_with_its_reason(error, fit):
    fit.error = error
    springs = springs_of(Design())
    assert_undecided(springs, error)
    assert springs.housing is None


def test_square_is_fitted_as_one_plate_within_which_its_tips_are_coupled(fit):
    """Tips 1 and 2 are low and high of one plate, 3 and 4 those of the other, whose frame is another body."""
    springs = springs_of(GENTLE)
    assert springs.housing.back_to_back
    assert [targets for targets, *_ in fit.asked] == [(1.2, 20.0)]
    coupled = np.array([[0.8, 1e-3], [1e-3, 0.05]])
    fitted = replace(springs.fitted, stiffness=replace(springs.fitted.stiffness, C=coupled))
    np.testing.assert_array_equal(replace(springs, fitted=fitted).C, np.kron(np.eye(2), coupled))


def test_mesh_that_is_not_its_solid_leaves_the_springs_undecided(tmp_path, monkeypatch):
    """The solid that was begun has leaves 1 % thicker than the mesh."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    begun = []

    def begin_solid(housing, deflections):
        begun.append(deflections)
        thicker = {arm.name: replace(arm.flexure, thickness=1.01 * arm.flexure.thickness) for arm in housing.arms}
        size = Future()
        size.set_result(draw_part_size(housing.with_flexures(thicker)))
        return size

    springs = springs_for(Design(), sizing_of(Design()), "fitted", 0.01, begin_solid)
    assert begun == [springs.deflections]
    assert springs.housing is None
    assert all(leaves.passed is None and "'compare'" in leaves.reason for leaves in springs.printable.values())
    assert not list(tmp_path.rglob("flexures-*"))


@pytest.mark.usefixtures("fit")
@pytest.mark.parametrize("tips", [{"side_mm": 5.8}, {"side_mm": 1.0, "spacing_mm": 1.5, "dome_radius_mm": 2.0}])
def test_square_whose_plates_cannot_be_bolted_is_bad_input(tips):
    assert refusal(springs_of, gentle(**tips)).field == "tips.spacing_mm"
