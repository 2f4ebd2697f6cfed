"""A sensor for one's own fruit: a range in words or from tests, sizes to measure, a design that a run proves."""

import dataclasses
import json
from types import SimpleNamespace

import numpy as np
import pytest
from refusal import refusal

from instrument.compress.pressed_shapes import Ellipsoid
from pipeline.find import fruit_design as room
from pipeline.find import proved_candidate as proof
from pipeline.find.changes import change_design
from pipeline.find.fruit_design import PRESETS, fruit_of, fruit_suggestion, most_alike, scaled_changes
from pipeline.find.fruit_range import FruitRange, bruise_limit, fruit_range
from pipeline.options import load_design
from pipeline.reading.poses import refuse_unsolvable_poses
from pipeline.reading.reading_records import CalibrationLeft
from pipeline.verdicts.hints import least_travel
from sensor.quantity import Estimate
from sensor.verdict import Verdict

MANGO = load_design("mango")
KIWI = FruitRange(radius_mm=26.0, E_min_MPa=0.3, E_max_MPa=2.0)
PASSED = Verdict(
    name="reading.bias", value=0.01, unit="1", limit=0.05, tolerance=0.0, passed=True, reference="", error=0.0
)


@pytest.mark.parametrize("text", ["radius 26, E 0.3 to 2", "radius 26 mm, E .3 to 2e0 MPa", " radius +26, E 0.3 to 2 "])
def test_fruit_in_words(text):
    assert fruit_range(text) == KIWI


def test_fruit_of_a_name_with_ranges_of_its_own():
    """It bruises as the fruit of the table does."""
    text = "pear, radius 24 to 31 by 40 to 51, flesh 14 to 27, E 0.3 to 2"
    fruit = fruit_range(text)
    assert fruit == dataclasses.replace(fruit_range(text.removeprefix("pear, ")), name="pear")
    assert fruit.in_words == text
    changes = scaled_changes(fruit, MANGO)
    assert changes["fruit.name"] == "pear"
    assert changes["fruit.bruise_limit_MPa"][0] == bruise_limit(0.3, "pear") != bruise_limit(0.3)
    assert fruit_range("pear, radius 26, E 0.3 to 2") == dataclasses.replace(KIWI, name="pear")


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("radius 26", "--fruit"),
        ("radius x, E 0.3 to 2", "--fruit"),
        ("radius 26, E 2 to 0.3", "--fruit.E_min_MPa"),
        ("radius 0, E 0.3 to 2", "--fruit.radius_mm"),
        ("radius 26, E 0 to 2", "--fruit.E_min_MPa"),
        ("missing.json", "--fruit"),
        ("pearr, radius 26, E 0.3 to 2", "--fruit"),
    ],
)
def test_wrong_fruit_is_refused(text, field):
    assert refusal(fruit_range, text).field == field


@pytest.mark.parametrize("across", [1.0, 1.5, 2.0, 3.0])
@pytest.mark.parametrize("radius", [16.0, 31.0, 45.0])
def test_fruit_of_any_shape_makes_a_design_whose_corners_lie_on_the_fruit(radius, across):
    ends = (0.9 * radius, 1.1 * radius)
    oblong = FruitRange(
        radius_mm=ends,
        radius_across_mm=(across * ends[0], across * ends[1]),
        thickness_mm=(0.5 * radius, radius),
        E_min_MPa=0.6,
        E_max_MPa=3.0,
    )
    preset = load_design(most_alike(oblong))
    design = change_design(preset, scaled_changes(oblong, preset))
    half = 0.5 * design.fruit.length_mm, 0.5 * design.fruit.width_mm
    assert design.fruit.fall_mm(*half) < 0.65 * design.fruit.depth_mm
    refuse_unsolvable_poses(design)  # the roundest fruit with the thinnest flesh


def test_fruit_from_compression_tests_has_their_error_bars(tmp_path):
    geometry = vars(Ellipsoid(height_mm=70.0, radius_mm=35.0, radius_across_mm=35.0))  # as pipeline modulus tells it
    rows = [{"E_MPa": E, "u_percent": 10.0, "geometry": geometry} for E in (0.5, 2.0)]
    path = tmp_path / "tests.json"
    path.write_text(json.dumps(rows), encoding="utf-8")
    assert fruit_range(str(path)) == FruitRange(radius_mm=35.0, E_min_MPa=0.45, E_max_MPa=2.2)


@pytest.mark.parametrize(
    "text",
    [
        '[{"E_MPa": 1.0}]',
        100_000 * "[",
        f'[{{"E_MPa": {400 * "9"}, "u_percent": 1, "geometry": {{"radius_mm": 35}}}}]',
        '[{"E_MPa": NaN, "u_percent": 1, "geometry": {"radius_mm": 35}}]',
    ],
    ids=["keys left out", "nested", "beyond floats", "nan"],
)
def test_file_that_tells_no_fruit_is_one_line(text, tmp_path):
    path = tmp_path / "tests.json"
    path.write_text(text, encoding="utf-8")
    refused = refusal(fruit_range, str(path))
    assert refused.field.startswith("--fruit")


def test_bruise_limits_are_the_stated_law_never_wider():
    """0.1 E^0.85: at 1 MPa it is 0.1 itself; the rounding goes down by less than a hundredth."""
    assert bruise_limit(1.0) == 0.1
    for E in (0.05, 0.3, 0.56, 3.5, 12.0):
        assert 0.99 * 0.1 * E**0.85 < bruise_limit(E) <= 0.1 * E**0.85


@pytest.mark.parametrize("name", PRESETS)
def test_preset_in_the_size_of_its_own_fruit_is_the_preset(name):
    preset = load_design(name)
    fruit = fruit_of(preset)
    assert most_alike(fruit) == name
    same = change_design(preset, scaled_changes(fruit, preset))
    shown = ("E_MPa", "bruise_limit_MPa")
    assert dataclasses.replace(same.fruit, **{key: getattr(preset.fruit, key) for key in shown}) == preset.fruit
    assert (same.tips, same.springs, same.reading) == (preset.tips, preset.springs, preset.reading)
    assert same.press.travel_mm == pytest.approx(preset.press.travel_mm, abs=0.00501)  # half a step, and round-off


@pytest.mark.parametrize(
    "text", ["radius 10, E 0.5 to 3", "radius 36 to 40 by 36 to 40, flesh 4 to 6, E 0.3 to 2", "radius 100, E 0.3 to 9"]
)
def test_fruit_unlike_any_preset_is_a_design(text):
    """The piece that is modelled is cut so small that its corners lie on the fruit."""
    fruit = fruit_range(text)
    preset = load_design(most_alike(fruit))
    assert change_design(preset, scaled_changes(fruit, preset)).fruit.E_max_MPa == fruit.E_max_MPa


def test_ball_occurs_as_fruit_whose_radii_lie_within_a_fifth():
    assert KIWI.radii_mm == ((20.8, 31.2), (20.8, 31.2))
    design = change_design(MANGO, scaled_changes(KIWI, MANGO))
    assert (design.reading.radius_mm, design.reading.radius_across_mm) == KIWI.radii_mm


@pytest.mark.parametrize("radius", [20.0, 26.0, 33.0, 50.0])
def test_sizes_can_be_measured_and_the_press_is_deep_against_the_print(radius):
    fruit = dataclasses.replace(KIWI, radius_mm=radius)
    design = change_design(MANGO, scaled_changes(fruit, MANGO))
    lengths = (design.tips.spacing_mm, design.tips.side_mm, design.tips.dome_radius_mm, design.fruit.thickness_mm)
    assert [round(length, 2) for length in lengths] == list(lengths)
    assert design.press.travel_mm >= 5.0 * design.process.accuracy_mm == least_travel(design)
    limits = [bruise_limit(E) for E in design.fruit.E_MPa]
    assert list(design.fruit.bruise_limits_MPa) == limits


@dataclasses.dataclass
class Outcome:
    """What the search looks at of an evaluation or a run."""

    verdicts: tuple
    readings: object = None
    passed: bool = True


@pytest.fixture
def trials(monkeypatch):
    """Let trials and runs end as told; return the designs that were tried."""
    tried = []

    def arranged(*outcomes, proved=None):
        rest = list(outcomes)

        def trial(design):
            tried.append(design)
            return rest.pop(0) if rest else Outcome(verdicts=(PASSED,))

        monkeypatch.setattr(room, "_sized", trial)
        monkeypatch.setattr(proof, "run", lambda *_: proved or Outcome(verdicts=(PASSED,)))
        return tried

    return arranged


def failing(name):
    return Outcome(verdicts=(dataclasses.replace(PASSED, name=name, passed=False),))


@pytest.mark.parametrize(
    ("outcome", "key", "step"),
    [
        (None, "tips.dome_radius_mm", lambda radius: radius - 0.5),
        (failing("geometry.tip_face"), "tips.dome_radius_mm", lambda radius: radius - 0.5),
        (failing("bruise"), "springs.K_l_N_per_m", lambda K: 0.9 * K),
        (failing("reading.touch"), "press.travel_mm", lambda travel: travel + 0.01),
        (failing("reading.uncertainty"), "springs.K_h_N_per_m", lambda K: 1.12 * K),
    ],
)
def test_each_verdict_has_its_step(trials, outcome, key, step):
    """Springs are rounded to three digits."""
    tried = trials(outcome)
    found = fruit_suggestion(KIWI, MANGO)
    start = scaled_changes(KIWI, MANGO)
    changes = {name: value for name, value in found.changes.items() if value != start[name]}
    assert changes.pop(key) == pytest.approx(step(start[key]), rel=5e-3)
    assert set(changes) <= {"springs.K_h_N_per_m"}
    assert len(tried) == found.tried == 2
    assert found.changed == tried[-1]


@pytest.mark.parametrize(
    ("tip", "by", "key", "factor"),
    [
        ("low_2", "balance", "springs.K_l_N_per_m", 1.05 * 1.2),
        ("high_1", "balance", "springs.K_h_N_per_m", 1.05 * 1.2),
        ("low_1", "noise", "springs.K_l_N_per_m", 1.05 * 1.2),
        ("low_1", "dial", "press.travel_mm", 1.05 * 1.2),
    ],
)
@pytest.mark.parametrize("over", [1.2, 9.0])
def test_what_the_bench_shows_too_little_of_grows(trials, tip, by, key, factor, over):
    """By as much as is missing, at most by a half at once."""
    left = CalibrationLeft(
        balance_g=1.0,
        balance_max_g=200.0,
        dial_mm=0.01,
        stiffness_percent=(5.0 * over, 1.0, 1.0, 1.0),
        gain_percent=4 * (0.1,),
        typed=(),
        worst_tip=tip,
        by=by,
    )
    outcome = failing("reading.calibration")
    outcome.readings = SimpleNamespace(calibration=left, face_mm=0.0, refused=None, moduli=())
    trials(outcome)
    found = fruit_suggestion(KIWI, MANGO)
    start = scaled_changes(KIWI, MANGO)
    changes = {name: value for name, value in found.changes.items() if value != start[name]}
    assert set(changes) == {key}
    assert changes[key] == pytest.approx(min(factor / 1.2 * over, 1.5) * start[key], rel=1e-2)


@pytest.mark.study
def test_springs_are_found_that_a_coarser_balance_calibrates():
    """On a balance of 0.35 g the low springs of the apple preset are too soft; a run proves stiffer ones."""
    preset = load_design("apple", {"bench.balance_g": 0.35})
    found = fruit_suggestion(fruit_of(preset), preset)
    assert found.changes["springs.K_l_N_per_m"] > 1.2 * preset.springs.K_l_N_per_m
    (calibration,) = [verdict for verdict in found.verdicts if verdict.name == "reading.calibration"]
    assert calibration.passed
    assert found.changed.bench.balance_g == 0.35


def test_a_limit_that_is_kept_without_a_margin_has_its_step_too(trials):
    """An uncertainty of 0.0499 where 0.05 is allowed: a run may move it by more."""
    close = dataclasses.replace(PASSED, name="reading.uncertainty", value=0.0499)
    trials(failing("bruise"), Outcome(verdicts=(close,)))
    found = fruit_suggestion(KIWI, MANGO)
    stiffer = 0.9 * 1.12 * scaled_changes(KIWI, MANGO)["springs.K_h_N_per_m"]
    assert found.changes["springs.K_h_N_per_m"] == pytest.approx(stiffer, rel=1e-2)
    assert found.tried == 3


def test_first_design_that_only_its_bars_leave_undecided_is_run(trials):
    """A later one is not: its step is tried first."""
    undecided = Outcome(verdicts=(dataclasses.replace(PASSED, name="reading.uncertainty", passed=None),))
    trials(undecided)
    found = fruit_suggestion(KIWI, MANGO)
    assert (found.tried, found.runs) == (1, 1)
    assert found.changes["springs.K_h_N_per_m"] == scaled_changes(KIWI, MANGO)["springs.K_h_N_per_m"]
    trials(failing("bruise"), undecided)
    assert fruit_suggestion(KIWI, MANGO).tried == 3


def test_step_of_a_key_that_stays_ends_the_search(trials):
    trials(failing("reading.touch"))
    found = fruit_suggestion(KIWI, MANGO, frozenset({"press.travel_mm"}))
    assert (found.changes, found.tried, found.runs) == (None, 1, 0)


def test_design_that_no_run_proves_is_not_suggested(trials):
    """The same step again and again ends where it returns to a design, or after all trials."""
    tried = trials(proved=Outcome(verdicts=failing("bruise").verdicts, passed=False))
    found = fruit_suggestion(KIWI, MANGO)
    assert (found.changes, found.runs) == (None, room.MOST_RUNS)
    assert len(tried) == room.MOST_RUNS


def biased(bias):
    """Return the outcome of a design whose largest bias fails."""
    row = SimpleNamespace(bias=Estimate(bias, 0.0))
    readings = SimpleNamespace(face_mm=0.0, refused=None, moduli=(row,), worst_bias=row)
    return Outcome(verdicts=(dataclasses.replace(PASSED, value=abs(bias), passed=False),), readings=readings)


def test_fruit_of_the_design_is_centred_and_the_nearest_design_told_where_none_passes(trials):
    """Fruit read too firm makes it flatter by 4 %, read too soft then rounder by 2 %, with less travel.

    No step mends the last verdict; of the biases 0.09, 0.06 and 0.07 the second is nearest to its limit.
    """
    tried = trials(biased(0.09), biased(0.06), biased(-0.07), failing("sideways.low"))
    found = fruit_suggestion(KIWI, MANGO)
    assert (found.changes, found.runs) == (None, 0)
    assert [verdict.value for verdict in found.verdicts] == [0.06]
    radii = [design.fruit.radius_mm for design in tried]
    assert np.divide(radii[1:], radii[:-1]) == pytest.approx([1.04, 1.04, 1.04**-0.5], rel=0.005)  # three digits
    travels = [design.press.travel_mm for design in tried]
    assert travels == pytest.approx([travels[0], travels[0], travels[0], travels[0] - 0.02])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["pear", pytest.param("apple", marks=pytest.mark.study)])
def test_a_preset_is_suggested_for_its_own_fruit(name):
    """Bars of sized springs leave verdicts undecided that a whole run decides."""
    preset = load_design(name)
    found = fruit_suggestion(fruit_of(preset), preset)
    assert found.runs == 1
    assert set(found.changes) <= {"press.travel_mm"}
