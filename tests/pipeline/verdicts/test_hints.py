"""Every verdict that did not pass has a hint; what it asks for follows from the verdict's own numbers."""

import dataclasses
from string import Formatter

import pytest
from stand_ins import GOOD, result_of, springs_of

from pipeline.options import DEFAULT_TOLERANCE, ROUGH_TOLERANCE, RunOptions, load_design
from pipeline.study.suggest.changes import MOVES, sweeps
from pipeline.verdicts.hints import CLAUSES, CONTACT_SIZES, SEARCH, hint, shorter_travel, tolerance_hint, with_hints
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design, GivenSprings, Print, Targets
from sensor.design.tips import Press, Tips
from sensor.tips.flat import Cylinder
from sensor.verdict import verdict_rows

ROUGH = RunOptions(tolerance=0.02)
UNDECIDED = dataclasses.replace(GOOD, passed=None, tolerance=0.1)


@pytest.mark.parametrize("row", verdict_rows(), ids=lambda row: row.name)
def test_clauses_and_moves_of_a_row_are_known(row):
    for template in (row.hint, row.hint_without_value):
        assert {clause for _, clause, *_ in Formatter().parse(template) if clause} <= CLAUSES.keys()
    assert set(row.mended_by) <= MOVES.keys()


def hinted(design, *, made=True, options=None):
    result = result_of(design, made=made)
    return with_hints(result.verdicts, design, result.springs, options or RunOptions())


@pytest.mark.parametrize(
    ("design", "made"),
    [
        (Design(), True),
        (Design(fruit=Fruit(bruise_limit_MPa=0.29)), True),
        (Design(springs=GivenSprings(K_l_N_per_m=753.0, K_h_N_per_m=17300.0)), True),
        (Design(targets=Targets(NL=0.001)), False),
        (Design(print=Print(process="dmls-17-4ph", max_length_mm=35.0)), False),
    ],
    ids=["passes", "bruised", "given springs", "NL out of reach", "process"],
)
def test_verdicts_that_did_not_pass_have_hints_and_no_others(design, made):
    for verdict in hinted(design, made=made):
        assert bool(verdict.remedy) == (verdict.passed is not True)


def test_line_that_misses_P_max_is_told_of_its_tips_and_not_of_its_springs():
    """Its springs are never made, and targets size a pair alone."""
    line = load_design("docs/examples/fouly.toml", {"reading": "", "tips.shape": "sphere", "tips.socket": "pin"})
    ideal = dataclasses.replace(springs_of(Design(), made=False), ideal=True)
    missed = dataclasses.replace(GOOD, name="P_max", passed=False)
    assert "tips.shape=cube" in hint(missed, line, ideal, ROUGH)


def test_given_springs_that_miss_P_max_are_left_to_the_targets():
    design = Design(springs=GivenSprings(K_l_N_per_m=753.0, K_h_N_per_m=17300.0))
    hints = {verdict.name: verdict.remedy for verdict in hinted(design, made=True)}
    assert "--set springs.K_l_N_per_m=" in hints["P_max"]


@pytest.mark.parametrize(
    ("changes", "flag"),
    [
        ({"press": Press(tilt_deg=1.0)}, "press.tilt_deg=0"),
        ({"tips": Tips(fillet_mm=0.1, socket="pin")}, "tips.fillet_mm=0"),
        ({"tips": Tips(shape="sphere", socket="pin")}, "tips.shape=cube"),
        ({"fruit": Fruit(shape="sphere", radius_mm=40.0)}, "tips.side_mm"),
    ],
)
def test_ratio_that_drifts_asks_for_a_level_press_and_flat_tips(changes, flag):
    drifting = dataclasses.replace(GOOD, name="P_displacement_independent", passed=False)
    assert flag in hint(drifting, Design(**changes), springs_of(Design()), ROUGH)


def test_shape_that_is_not_flat_is_changed_before_its_edge(monkeypatch):
    """The keys of a new shape may share `fillet_mm`; without it such a tip is not flat either."""
    monkeypatch.setattr(Cylinder, "has_flat_face", False)
    drifting = dataclasses.replace(GOOD, name="P_displacement_independent", passed=False)
    design = Design(tips=Tips(shape="cylinder", fillet_mm=0.1, socket="pin"))
    assert "tips.shape=cube" in hint(drifting, design, springs_of(Design()), ROUGH)
    words = [sweep[0] for sweep in sweeps(design, {"P_monotonic"}, on_cells=False)]
    assert {"tips.shape": "cube", "tips.fillet_mm": 0.0} in words
    assert {"tips.fillet_mm": 0.0} not in words


def test_travel_under_a_bruise_limit_is_that_of_its_pressure():
    """Under a flat face the pressure is proportional to the travel: 0.6 mm x limit / pressure at most."""
    design = Design(fruit=Fruit(bruise_limit_MPa=1.2))
    (bruise,) = (verdict for verdict in result_of(design).verdicts if verdict.name == "bruise")
    bound = 0.6 * 1.2 / (bruise.value + bruise.error)
    assert 0.97 * bound < shorter_travel(bruise, design, springs_of(design)) < bound
    hard = dataclasses.replace(bruise, limit=0.29)  # 0.08 mm, where printed tips stand within 0.05 mm
    assert shorter_travel(hard, design, springs_of(design)) is None


def test_travel_of_a_bruised_soft_fruit():
    """At 0.08 MPa of 0.06: proportional to the travel under a flat face, to its root under a dome (Hertz)."""
    springs, fruit = springs_of(Design()), Fruit(bruise_limit_MPa=0.06)
    bruise = dataclasses.replace(GOOD, name="bruise", value=0.08, error=0.0, limit=0.06, passed=False)
    dome = Tips(shape="dome", dome_radius_mm=2.0)
    for design, bound in ((Design(fruit=fruit), 0.6 * 0.75), (Design(fruit=fruit, tips=dome), 0.6 * 0.75**2)):
        assert 0.97 * bound < shorter_travel(bruise, design, springs) < bound


def test_strain_by_finite_elements_asks_for_less_travel():
    """Strain goes with the travel: 1.1 times its limit, and an error of 0.1 times, ask for 0.6 mm / 1.2."""
    springs = springs_of(Design())
    limit = springs.printable["low"].strain_limit
    bent = dataclasses.replace(springs.springs["low"], root_strain=1.1 * limit, root_strain_error=0.1 / 1.1)
    bent_springs = dataclasses.replace(springs, springs=springs.springs | {"low": bent})
    verdict = dataclasses.replace(GOOD, name="printable.low", passed=False)
    assert 0.97 * 0.6 / 1.2 < shorter_travel(verdict, Design(), bent_springs) < 0.6 / 1.2


def test_leaf_that_is_too_long_is_not_told_to_travel_less():
    design = Design(print=Print(process="dmls-17-4ph", max_length_mm=35.0))
    hints = {verdict.name: verdict.remedy for verdict in hinted(design, made=False)}
    assert hints["printable.low"] == SEARCH


@pytest.mark.parametrize(
    ("clearance", "low", "high"),
    [(0.1, 0.38, 0.4), (-0.03, 0.26, 0.27), (-0.05, None, None), (-1.0, None, None), (0.4, None, None)],
)
def test_frame_on_the_fruit_asks_for_as_much_less_travel_as_it_lacks(clearance, low, high):
    """0.2 mm short of its clearance of 0.3 mm at a travel of 0.6 mm: 0.4 mm at most; 1.3 mm short: no travel helps.

    Under five times 0.05 mm of print the heights of the tips decide: 0.27 mm is enough, 0.25 mm is not.
    """
    verdict = dataclasses.replace(GOOD, name="geometry.frame_clearance", value=clearance, limit=0.3, passed=False)
    travel = shorter_travel(verdict, Design(), springs_of(Design()))
    assert travel is None if low is None else low < travel < high


def test_error_bar_asks_for_a_tolerance_where_the_springs_are_of_one_piece():
    wide = dataclasses.replace(GOOD, name="K_l", limit=900.0, tolerance=0.001, relative=True, error=9.0, passed=None)
    springs = springs_of(Design())
    assert "`--tol 0.001` " in hint(wide, Design(), springs, ROUGH)
    pins = {"pin_side": 0.3, "pin_out": 1.0, "pocket_side": 0.4, "pocket_depth": 0.5}
    fitted = dataclasses.replace(springs.fitted, housing=dataclasses.replace(springs.fitted.housing, **pins))
    assert hint(wide, Design(), dataclasses.replace(springs, fitted=fitted), ROUGH) == SEARCH


def test_tips_that_touch_late_ask_for_the_travel_of_which_it_is_half():
    """All touch by 0.7 of 0.6 mm, give or take 0.02: the depth at which they do stays, and is half of 0.864 mm."""
    late = dataclasses.replace(GOOD, name="reading.touch", value=0.7, error=0.02, limit=0.5, passed=False)
    design = Design(press=Press(travel_mm=0.6))
    travel = float(hint(late, design, springs_of(Design()), ROUGH).partition("travel_mm=")[2].rstrip("`"))
    assert 0.864 <= travel < 1.03 * 0.864


def test_springs_sized_by_another_formula_are_mended_by_the_contact():
    failed = dataclasses.replace(GOOD, name="P_max", passed=False)
    assert hint(failed, Design(), springs_of(Design()), RunOptions(fruit_stiffness="hayes")) == CONTACT_SIZES


@pytest.mark.parametrize(
    ("error", "asked", "words"),
    [
        (0.1, 0.02, "undecided by its error bar, `--tol 0.005` would decide"),
        (0.07, 0.02, "undecided by its error bar, `--tol 0.005` would decide"),
        (0.5, 0.02, "undecided by its error bar, no `--tol` would decide"),
        (1000.0, 0.001, "undecided by its error bar, no `--tol` would decide"),
    ],
)
def test_an_undecided_verdict_says_which_tolerance_would_decide(error, asked, words):
    P_max = dataclasses.replace(UNDECIDED, name="P_max", limit=5.0, tolerance=0.01, relative=True, error=error)
    assert tolerance_hint(P_max, asked) == words


@pytest.mark.parametrize("name", ["K_l", "K_h"])
def test_a_stiffness_is_decided_by_the_tolerance_of_a_run_as_it_comes(name):
    """The tolerance of a run is the error that it allows to a spring: 0.1 %, which is what the verdict allows."""
    K = dataclasses.replace(UNDECIDED, name=name, limit=900.0, tolerance=0.001, relative=True, error=9.0)
    assert f"`--tol {DEFAULT_TOLERANCE:g}`" in str(tolerance_hint(K, ROUGH_TOLERANCE))


def test_a_decided_verdict_needs_no_advice():
    for passed in (True, False):
        decided = dataclasses.replace(GOOD, passed=passed, error=1.0, tolerance=0.1)
        assert tolerance_hint(decided, 0.02) is None
    of_springs_not_made = dataclasses.replace(UNDECIDED, error=1e-4)
    assert tolerance_hint(of_springs_not_made, 0.02) is None
