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
from pipeline.find.fruit_design import (
    PRESETS,
    fruit_range_of_design,
    fruit_suggestion,
    most_similar_preset,
    scaled_changes,
)
from pipeline.find.fruit_range import FruitRange, bruise_limit, fruit_range
from pipeline.options import load_design
from pipeline.reading.poses import refuse_unsolvable_poses
from pipeline.verdicts.hints import least_travel
from sensor.quantity import Estimate
from sensor.verdict import Verdict

MANGO = load_design("mango")
KIWI = FruitRange(radius_mm=26.0, E_min_MPa=0.3, E_max_MPa=2.0)
PASSED = Verdict(
    name="reading.bias", value=0.01, unit="1", limit=0.05, tolerance=0.0, passed=True, reference="", error=0.0
)


@pytest.mark.parametrize(
    ("text", "fruit"),
    [
        ("radius 26, E 0.3 to 2", KIWI),
        ("radius 26 mm, E .3 to 2e0 MPa", KIWI),
        (" radius +26, E 0.3 to 2 ", KIWI),
        ("pear, radius 26, E 0.3 to 2", dataclasses.replace(KIWI, name="pear")),
    ],
)
def test_fruit_in_words(text, fruit):
    assert fruit_range(text) == fruit
    assert fruit_range(fruit.in_words) == fruit


def test_fruit_of_a_name_with_ranges_of_its_own_bruises_as_that_of_the_table():
    fruit = fruit_range("pear, radius 24 to 31 by 40 to 51, flesh 14 to 27, E 0.3 to 2")
    assert fruit_range(fruit.in_words) == fruit
    changes = scaled_changes(fruit, MANGO)
    assert changes["fruit.name"] == "pear"
    assert changes["fruit.bruise_limit_MPa"][0] == bruise_limit(0.3, "pear") != bruise_limit(0.3)


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


def measured(E):
    return f'[{{"E_MPa": {E}, "u_percent": 1, "geometry": {{"radius_mm": 35}}}}]'


@pytest.mark.parametrize(
    "text",
    ['[{"E_MPa": 1.0}]', 100_000 * "[", measured(E=400 * "9"), measured(E="NaN")],
    ids=["keys left out", "nested", "beyond floats", "nan"],
)
def test_file_that_tells_no_fruit_is_one_line(text, tmp_path):
    path = tmp_path / "tests.json"
    path.write_text(text, encoding="utf-8")
    assert refusal(fruit_range, str(path)).field.startswith("--fruit")


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
    preset = load_design(most_similar_preset(oblong))
    design = change_design(preset, scaled_changes(oblong, preset))
    half = 0.5 * design.fruit.length_mm, 0.5 * design.fruit.width_mm
    assert design.fruit.fall_mm(*half) < 0.65 * design.fruit.depth_mm
    refuse_unsolvable_poses(design)  # the roundest fruit with the thinnest flesh


@pytest.mark.parametrize("radius", [10.0, 20.0, 26.0, 33.0, 50.0, 100.0])
def test_sizes_can_be_measured_and_the_press_is_deep_against_the_print(radius):
    """The radii of a ball lie within a fifth."""
    fruit = dataclasses.replace(KIWI, radius_mm=radius)
    design = change_design(MANGO, scaled_changes(fruit, MANGO))
    lengths = (design.tips.spacing_mm, design.tips.side_mm, design.tips.dome_radius_mm, design.fruit.thickness_mm)
    assert [round(length, 2) for length in lengths] == list(lengths)
    assert design.press.travel_mm >= 5.0 * design.process.accuracy_mm == least_travel(design)
    assert list(design.fruit.bruise_limits_MPa) == [bruise_limit(E) for E in design.fruit.E_MPa]
    for ends in (design.reading.radius_mm, design.reading.radius_across_mm):
        assert ends == pytest.approx((0.8 * radius, 1.2 * radius))


def test_fruit_from_compression_tests_has_their_error_bars(tmp_path):
    geometry = vars(Ellipsoid(height_mm=70.0, radius_mm=35.0, radius_across_mm=35.0))  # as pipeline modulus tells it
    rows = [{"E_MPa": E, "u_percent": 11.0, "geometry": geometry} for E in (0.5, 2.0)]
    path = tmp_path / "tests.json"
    path.write_text(json.dumps(rows), encoding="utf-8")
    assert fruit_range(str(path)) == FruitRange(radius_mm=35.0, E_min_MPa=0.44, E_max_MPa=2.3)  # outwards


def test_bruise_limits_are_the_stated_law_never_wider():
    """0.1 E^0.85: at 1 MPa it is 0.1 itself; the rounding goes down by less than a hundredth."""
    assert bruise_limit(1.0) == 0.1
    for E in (0.05, 0.3, 0.56, 3.5, 12.0):
        assert 0.99 * 0.1 * E**0.85 < bruise_limit(E) <= 0.1 * E**0.85


@pytest.mark.parametrize("name", PRESETS)
def test_preset_in_the_size_of_its_own_fruit_is_the_preset(name):
    preset = load_design(name)
    fruit = fruit_range_of_design(preset)
    assert most_similar_preset(fruit) == name
    same = change_design(preset, scaled_changes(fruit, preset))
    shown = ("E_MPa", "bruise_limit_MPa")
    assert dataclasses.replace(same.fruit, **{key: getattr(preset.fruit, key) for key in shown}) == preset.fruit
    assert (same.tips, same.springs, same.reading) == (preset.tips, preset.springs, preset.reading)
    assert same.press.travel_mm == pytest.approx(preset.press.travel_mm, abs=0.00501)  # half a step, and round-off


def outcome(name="reading.bias", *, passed=False, **changes):
    """Return what the search looks at of an evaluation or a run, with one verdict."""
    verdict = dataclasses.replace(PASSED, name=name, passed=passed, **changes)
    return SimpleNamespace(verdicts=(verdict,), readings=None, passed=passed)


FINE = outcome(passed=True)


@pytest.fixture
def trials(monkeypatch):
    """Let trials and runs end as told; return the designs that were tried."""
    tried = []

    def arranged(*outcomes, proved=FINE):
        rest = list(outcomes)

        def trial(design):
            tried.append(design)
            return rest.pop(0) if rest else FINE

        monkeypatch.setattr(room, "_solve_sized", trial)
        monkeypatch.setattr(proof, "run", lambda *_: proved)
        return tried

    return arranged


def stepped(found):
    """Return the factors by which a suggestion has changed its start."""
    start = scaled_changes(KIWI, MANGO)
    return {key: value / start[key] for key, value in found.changes.items() if value != start[key]}


@pytest.mark.parametrize(
    ("first", "key", "factor"),
    [
        (None, "tips.dome_radius_mm", lambda radius: 1.0 - 0.5 / radius),
        (outcome("geometry.tip_face"), "tips.dome_radius_mm", lambda radius: 1.0 - 0.5 / radius),
        (outcome("bruise"), "springs.K_l_N_per_m", lambda _: 0.9),
        (outcome("reading.touch"), "press.travel_mm", lambda travel: 1.0 + 0.01 / travel),
        (outcome("reading.uncertainty"), "springs.K_h_N_per_m", lambda _: 1.12),
    ],
)
def test_each_verdict_has_its_step(trials, first, key, factor):
    """Springs are rounded to three digits."""
    tried = trials(first)
    found = fruit_suggestion(KIWI, MANGO)
    changes = stepped(found)
    assert changes.pop(key) == pytest.approx(factor(scaled_changes(KIWI, MANGO)[key]), rel=5e-3)
    assert set(changes) <= {"springs.K_h_N_per_m"}
    assert len(tried) == found.tried == 2
    assert found.changed == tried[-1]


@pytest.mark.parametrize(
    ("tip", "by", "key"),
    [
        ("low_2", "balance", "springs.K_l_N_per_m"),
        ("high_1", "balance", "springs.K_h_N_per_m"),
        ("low_1", "noise", "springs.K_l_N_per_m"),
        ("low_1", "dial", "press.travel_mm"),
    ],
)
@pytest.mark.parametrize("over", [1.2, 9.0])
def test_what_the_bench_shows_too_little_of_grows(trials, tip, by, key, over):
    """By as much as is missing and a twentieth, at most by a half at once."""
    left = SimpleNamespace(largest_stiffness=0.05 * over, worst_tip=tip, by=by)
    first = outcome("reading.calibration")
    first.readings = SimpleNamespace(calibration=left, face_mm=0.0, refused=None, moduli=())
    trials(first)
    assert stepped(fruit_suggestion(KIWI, MANGO)) == {key: pytest.approx(min(1.05 * over, 1.5), rel=1e-2)}


@pytest.mark.study
def test_springs_are_found_that_a_coarser_balance_calibrates():
    """On a balance of 0.35 g the low springs of the apple preset are too soft; a run proves stiffer ones."""
    preset = load_design("apple", {"bench.balance_g": 0.35})
    found = fruit_suggestion(fruit_range_of_design(preset), preset)
    assert found.changes["springs.K_l_N_per_m"] > 1.2 * preset.springs.K_l_N_per_m
    (calibration,) = [verdict for verdict in found.verdicts if verdict.name == "reading.calibration"]
    assert calibration.passed
    assert found.changed.bench.balance_g == 0.35


def test_a_limit_that_is_kept_without_a_margin_has_its_step_too(trials):
    """An uncertainty of 0.0499 where 0.05 is allowed: a run may move it by more."""
    trials(outcome("bruise"), outcome("reading.uncertainty", value=0.0499, passed=True))
    found = fruit_suggestion(KIWI, MANGO)
    assert stepped(found)["springs.K_h_N_per_m"] == pytest.approx(0.9 * 1.12, rel=1e-2)
    assert found.tried == 3


def test_first_design_that_only_its_bars_leave_undecided_is_run(trials):
    """A later one is not: its step is tried first."""
    undecided = outcome("reading.uncertainty", passed=None)
    trials(undecided)
    found = fruit_suggestion(KIWI, MANGO)
    assert (found.tried, found.runs, stepped(found)) == (1, 1, {})
    trials(outcome("bruise"), undecided)
    assert fruit_suggestion(KIWI, MANGO).tried == 3


def test_step_of_a_key_that_stays_ends_the_search(trials):
    trials(outcome("reading.touch"))
    found = fruit_suggestion(KIWI, MANGO, frozenset({"press.travel_mm"}))
    assert (found.changes, found.tried, found.runs) == (None, 1, 0)


def test_design_that_no_run_proves_is_not_suggested(trials):
    """The same step again and again ends where it returns to a design, or after all trials."""
    tried = trials(proved=outcome("bruise"))
    found = fruit_suggestion(KIWI, MANGO)
    assert (found.changes, found.runs, len(tried)) == (None, room.MAX_RUNS, room.MAX_RUNS)


def biased(bias):
    """Return the outcome of a design whose largest bias fails."""
    found = outcome(value=abs(bias))
    row = SimpleNamespace(bias=Estimate(bias, 0.0))
    found.readings = SimpleNamespace(face_mm=0.0, refused=None, moduli=(row,), worst_bias=row)
    return found


def test_fruit_of_the_design_is_centred_and_the_nearest_design_told_where_none_passes(trials):
    """Fruit read too firm makes it flatter by 4 %, read too soft then rounder by 2 %, with less travel.

    No step mends the last verdict; of the biases 0.09, 0.06 and 0.07 the second is nearest to its limit.
    """
    tried = trials(biased(0.09), biased(0.06), biased(-0.07), outcome("sideways.low"))
    found = fruit_suggestion(KIWI, MANGO)
    assert (found.changes, found.runs) == (None, 0)
    assert [verdict.value for verdict in found.verdicts] == [0.06]
    radii = [design.fruit.radius_mm for design in tried]
    assert np.divide(radii[1:], radii[:-1]) == pytest.approx([1.04, 1.04, 1.04**-0.5], rel=0.005)  # three digits
    assert np.diff([design.press.travel_mm for design in tried]) == pytest.approx([0.0, 0.0, -0.02])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["pear", pytest.param("apple", marks=pytest.mark.study)])
def test_a_preset_is_suggested_for_its_own_fruit(name):
    """Bars of sized springs leave verdicts undecided that a whole run decides."""
    preset = load_design(name)
    found = fruit_suggestion(fruit_range_of_design(preset), preset)
    assert found.runs == 1
    assert set(found.changes) <= {"press.travel_mm"}
