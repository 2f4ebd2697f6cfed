"""Every verdict that did not pass has a hint; what it asks for follows from the verdict's own numbers."""

import dataclasses
from string import Formatter

import pytest
from stand_ins import GOOD, result_of, springs_of

from cad.parts.housing import Pin
from pipeline.find.changes import MOVES
from pipeline.options import DEFAULT_TOLERANCE, RunOptions, load_design
from pipeline.verdicts.hints import CONTACT_SIZES, PARTS, SEARCH, find_shorter_travel, hint, tolerance_hint, with_hints
from sensor.design.bench import Bench
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design, GivenSprings, Print, Targets
from sensor.design.reading import ReadingRequirements
from sensor.design.tips import PressMotion, Tips
from sensor.verdict import verdict_rows

ROUGH = RunOptions(tolerance=0.02)
GIVEN = Design(springs=GivenSprings(K_l_N_per_m=753.0, K_h_N_per_m=17300.0))
MADE = springs_of(Design())
UNMADE = springs_of(Design(), made=False)
LINE = load_design(
    "docs/examples/fouly.toml", {"reading": "", "bench": "", "tips.shape": "sphere", "tips.socket": "pin"}
)
LIMIT = MADE.printable["low"].strain_limit
_STRAINED = dataclasses.replace(MADE.springs["low"], root_strain=1.1 * LIMIT, root_strain_error=0.1 / 1.1)
BENT = dataclasses.replace(MADE, springs=MADE.springs | {"low": _STRAINED})
_PIN = Pin(side=0.3, is_round=False, protruding_length=1.0, pocket_side=0.4, pocket_depth=0.5)
GLUED = dataclasses.replace(
    MADE, fitted=dataclasses.replace(MADE.fitted, housing=dataclasses.replace(MADE.fitted.housing, pin=_PIN))
)
WIDE = {"limit": 900.0, "tolerance": 0.001, "relative": True, "error": 9.0, "passed": None}


def missed(name, **fields):
    return dataclasses.replace(GOOD, **{"name": name, "passed": False, **fields})


@pytest.mark.parametrize("row", verdict_rows(), ids=lambda row: row.name)
def test_what_a_row_names_for_hints_and_changes_is_known(row):
    for template in (row.hint, row.hint_without_value):
        assert {part for _, part, *_ in Formatter().parse(template) if part} <= PARTS.keys()
    assert set(row.mended_by) <= MOVES.keys()


@pytest.mark.parametrize(
    ("design", "made"),
    [
        (Design(), True),
        (Design(fruit=Fruit(bruise_limit_MPa=0.29)), True),
        (GIVEN, True),
        (Design(targets=Targets(NL=0.001)), False),
        (Design(print=Print(process="dmls-17-4ph", max_length_mm=35.0)), False),
    ],
    ids=["passes", "bruised", "given springs", "NL out of reach", "process"],
)
def test_verdicts_that_did_not_pass_have_hints_and_no_others(design, made):
    result = result_of(design, made=made)
    for verdict in with_hints(result.verdicts, design, result.springs, RunOptions()):
        assert bool(verdict.remedy) == (verdict.passed is not True)


@pytest.mark.parametrize(
    ("verdict", "design", "springs", "words"),
    [
        (missed("P_max"), GIVEN, MADE, "--set springs.K_l_N_per_m="),
        # springs of a line are never made, and targets size a pair alone
        (missed("P_max"), LINE, dataclasses.replace(UNMADE, ideal=True), "tips.shape=cube"),
        (missed("P_max"), Design(), UNMADE, "see printable.low"),
        (missed("NL"), Design(press=PressMotion(tilt_deg=1.0)), MADE, "press.tilt_deg=0"),
        (missed("P_displacement_independent"), Design(press=PressMotion(roll_deg=1.0)), MADE, "press.roll_deg=0"),
        (missed("P_monotonic"), Design(tips=Tips(fillet_mm=0.1, socket="pin")), MADE, "tips.fillet_mm=0"),
        (missed("P_monotonic"), Design(tips=Tips(shape="sphere", socket="pin")), MADE, "tips.shape=cube"),
        (missed("P_monotonic"), Design(fruit=Fruit(shape="sphere", radius_mm=40.0)), MADE, "tips.side_mm"),
        (missed("K_l", value=None), Design(), UNMADE, "make both springs printable first"),
        (missed("K_l"), Design(), MADE, SEARCH),
        (missed("printable.low"), Design(), BENT, "less travel: `--set press.travel_mm=0.49`"),
        (missed("reading.relaxation"), Design(), MADE, "press.hold_s"),
        (missed("reading.relaxation"), Design(reading=ReadingRequirements()), MADE, "reading.at_s"),
        (missed("K_l", **WIDE), Design(), MADE, "`--tol 0.001` "),
        (missed("K_l", **WIDE), Design(), GLUED, SEARCH),  # no finer mesh removes the error of glue
    ],
)
def test_hint_follows_from_the_verdict_and_its_design(verdict, design, springs, words):
    assert words in hint(verdict, design, springs, ROUGH)


def test_springs_sized_by_another_formula_are_mended_by_the_contact():
    assert hint(missed("P_max"), Design(), MADE, RunOptions(fruit_stiffness="hayes")) == CONTACT_SIZES


def test_tips_that_touch_late_ask_for_the_travel_of_which_it_is_half():
    """All touch by 0.7 of 0.6 mm, give or take 0.02: the depth at which they do stays, and is half of 0.864 mm."""
    late = missed("reading.touch", value=0.7, error=0.02, limit=0.5)
    words = hint(late, Design(press=PressMotion(travel_mm=0.6)), MADE, ROUGH)
    assert 0.864 <= float(words.partition("travel_mm=")[2].rstrip("`")) < 1.03 * 0.864


@pytest.mark.parametrize(
    ("cause", "words"),
    [("balance", "`--set bench.balance_g=0.02`"), ("dial", "`--set bench.dial_mm=0.002`"), ("noise", SEARCH)],
)
def test_springs_that_a_bench_leaves_unknown_ask_for_a_finer_one(cause, words):
    """4.5 times over the limit: what a bench leaves is proportional to its last digits, of 0.1 g and 0.01 mm."""
    reference = f"uncertainty of low_1, most of it by the {cause}"
    over = missed("reading.calibration", value=0.225, limit=0.05, reference=reference)
    assert words in hint(over, Design(reading=ReadingRequirements(), bench=Bench(balance_g=0.1)), MADE, ROUGH)


@pytest.mark.parametrize(
    ("verdict", "tips", "springs", "bound"),
    [
        # the pressure of a bruise: proportional to the travel under a flat face, to its root under a dome (Hertz)
        (missed("bruise", value=0.08, limit=0.06), Tips(), MADE, 0.6 * 0.75),
        (missed("bruise", value=0.078, error=0.002, limit=0.06), Tips(), MADE, 0.6 * 0.75),
        (missed("bruise", value=0.08, limit=0.06), Tips(shape="dome", dome_radius_mm=2.0), MADE, 0.6 * 0.75**2),
        (missed("bruise", value=2.2, limit=0.29), Tips(), MADE, None),  # 0.08 mm, where printed tips stand within 0.05
        # strain goes with the travel: 1.1 times its limit, and an error of 0.1 times
        (missed("printable.low"), Tips(), BENT, 0.6 / 1.2),
        (missed("printable.high"), Tips(), BENT, None),
        # 0.2 mm short of its clearance at a travel of 0.6 mm; under 5 times 0.05 mm of print the heights decide
        (missed("geometry.frame_clearance", value=0.1, limit=0.3), Tips(), MADE, 0.4),
        (missed("geometry.neck_clearance", value=-0.03, limit=0.3), Tips(), MADE, 0.27),
        (missed("geometry.cover_over_fruit", value=-0.05, limit=0.3), Tips(), MADE, None),
        (missed("geometry.frame_clearance", value=0.4, limit=0.3), Tips(), MADE, None),
        (missed("geometry.min_wall", value=0.1, limit=0.3), Tips(), MADE, None),
    ],
)
def test_shorter_travel_is_just_within_its_bound(verdict, tips, springs, bound):
    travel = find_shorter_travel(verdict, Design(tips=tips), springs)
    assert travel is None if bound is None else 0.97 * bound < travel < bound


AT_LIMIT = {"limit": 5.0, "tolerance": 0.01}


@pytest.mark.parametrize(
    ("name", "changes", "asked", "words"),
    [
        ("P_max", AT_LIMIT | {"error": 0.1}, 0.02, "; `--tol 0.005` "),
        ("P_max", AT_LIMIT | {"error": 0.07}, 0.02, "; `--tol 0.005` "),
        ("P_max", AT_LIMIT | {"error": 0.5}, 0.02, "no `--tol` "),
        # the tolerance of a run is the error that it allows to a spring: 0.1 %, which is what the verdict allows
        ("K_h", {}, 0.02, f"; `--tol {DEFAULT_TOLERANCE:g}` "),
        ("K_h", {"passed": False}, 0.02, None),
        ("K_h", {"error": 0.09}, 0.02, None),  # undecided as the springs were not made
    ],
)
def test_only_an_undecided_verdict_says_which_tolerance_would_decide(name, changes, asked, words):
    found = tolerance_hint(missed(name, **WIDE | changes), asked)
    assert found is None if words is None else words in found
