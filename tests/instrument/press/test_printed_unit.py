"""A unit comes back from its file; a file that is none, or of another design, is refused by field."""

from dataclasses import replace
from pathlib import Path

import pytest
from firmware_presses import BALL
from refusal import refusal

from instrument.press.fruit_scale import FruitScale
from instrument.press.printed_unit import (
    design_digest,
    digests_of_0_2,
    nominal_unit,
    read_unit,
    unit_as_toml,
)
from instrument.press.ripeness import ripeness_classes
from pipeline.options import load_design

MY_FRUIT = str(Path(__file__).parents[3] / "docs" / "examples" / "my-fruit.toml")


OF_PAPER = {
    "K_N_per_m": (1078.0, 23120.0),
    "classes": "ripe:0.8,unripe",
    "newtons_per_count": ((1e-6, 0.0), (1e-8, 1e-5)),
    "zero_counts": (5.0, -7.0),
    "saturation_counts": 99,
    "force_bend": (0.0, 0.1),
    "force_bend_per_N": (0.0, -0.05),
}
SCALE = FruitScale(unit="N", curve="power", percent=10.0, E_MPa=(0.5, 2.0), firmness=(10.0, 30.0))
HEIGHTS = "height_mm = [0.0, 0.01]\nheight_error_mm = [1e-6, 1e-6]\n"
"""As units of version 0.1 told them."""


@pytest.fixture
def unit(paper):
    return replace(nominal_unit(paper.report), **OF_PAPER)


@pytest.fixture
def refused(tmp_path):
    """Return a function that reads a text as a unit and returns the field of the error."""

    def field(text, report):
        path = tmp_path / "unit.toml"
        path.write_text(text, encoding="utf-8")
        return refusal(read_unit, path, report).field

    return field


@pytest.mark.parametrize(
    ("name", "changes", "above"),
    [
        ("paper", OF_PAPER, ""),
        ("paper", OF_PAPER, HEIGHTS),
        ("mango", {"ball": BALL}, ""),
        ("mango", {"scale": SCALE}, ""),
    ],
)
def test_unit_comes_back_as_it_was_written(name, changes, above, request, tmp_path):
    """One without a ball is written as before there were balls."""
    report = request.getfixturevalue(name).report
    unit = replace(nominal_unit(report), **changes)
    text = above + unit_as_toml(unit)
    assert ("ball" in text) == ("ball" in changes)
    path = tmp_path / "unit.toml"
    path.write_text(text, encoding="utf-8")
    assert read_unit(path, report) == unit


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        ({"factor": 0.0}, "factor"),
        ({"factor": 2.1}, "factor"),
        ({"percent": -1.0}, "percent"),
        ({"E_MPa": 0.0}, "E_MPa"),
        ({"radius_mm": 0.1}, "radius_mm"),
        ({"press_s": 0.0}, "press_s"),
        ({"factor": float("nan")}, "factor"),
    ],
)
def test_damaged_ball_is_refused_by_its_field(changed, field, mango, refused):
    text = unit_as_toml(replace(nominal_unit(mango.report), ball=BALL))
    ((key, value),) = changed.items()
    damaged = text.replace(f"{key} = {getattr(BALL, key)}", f"{key} = {value}")
    assert damaged != text
    assert refused(damaged, mango.report) == f"unit.ball.{field}"


@pytest.mark.parametrize("key", ["spring_slopes", "gain_slopes", "form_percent"])
def test_ball_of_another_number_of_tips_or_errors_is_refused(key, mango, refused):
    unit = replace(nominal_unit(mango.report), ball=replace(BALL, **{key: (0.1, 0.2)}))
    assert refused(unit_as_toml(unit), mango.report) == f"unit.ball.{key}"


def test_ball_of_a_design_that_takes_none_is_refused(unit, paper, refused):
    assert refused(unit_as_toml(replace(unit, ball=BALL)), paper.report) == "unit.ball"


def test_nominal_unit_is_as_uncertain_as_its_process_prints(paper):
    process = paper.design.process
    expected = []
    for thickness in process.leaf_thicknesses_mm:
        expected.append(100.0 * (process.E_scatter**2 + (1.5 * process.accuracy_mm / thickness) ** 2) ** 0.5)
    assert nominal_unit(paper.report).K_percent == pytest.approx(expected)


@pytest.mark.parametrize(
    ("name", "digest"),
    [
        ("paper", "9279a9d7514dd03c4597188a5314cbb2346e47512d3ce2b7fa0b8f3eff27bc00"),
        ("mango", "bda5b9192e0873d0effa44eaf3cbb47724167bb5609b0bbb2e50389f3abd6bd0"),
        (MY_FRUIT, "7b532037446524a254668104b34048b186c82b7c544a30ed7361a6118cd37634"),
    ],
    ids=["paper", "mango", "my-fruit"],
)
@pytest.mark.parametrize(
    "changed",
    [
        {},
        {"reading.stiffness_percent": "", "reading.gain_percent": ""},
        {"reading.stiffness_percent": "", "bench.dial_mm": 0.02},
    ],
    ids=["as it is", "by its bench", "by another bench"],
)
def test_unit_of_version_0_2_is_one_of_its_design(name, digest, changed):
    """The digests that version 0.2 wrote into units of its default design, of a preset and of an example."""
    design = load_design(name, changed if name != "paper" else {})
    assert digest in digests_of_0_2(design)
    assert digest not in digests_of_0_2(replace(design, name="other"))
    assert digest not in digests_of_0_2(replace(design, press=replace(design.press, travel_mm=0.4)))


@pytest.mark.parametrize(
    ("setting", "is_another"),
    [
        ("targets.NL=0.04", True),
        ("fruit.E_max_MPa=4", True),
        ("tips.side_mm=2.5", True),
        ("press.travel_mm=0.5", True),
        ("print.leaf_thickness_low_mm=1.2", True),
        ("print.E_MPa=2100", True),
        ("name=other", False),
        ("press.attitude=side", False),
        ("fruit.bruise_limit_MPa=0.4", False),
        ("print.max_length_mm=200", False),
    ],
)
def test_digest_is_of_what_sets_springs_tips_and_read_out(setting, is_another):
    key, _, value = setting.partition("=")
    assert (design_digest(load_design("paper", {key: value})) != design_digest(load_design("paper"))) == is_another


def test_digest_is_of_the_read_out_and_not_of_its_temperatures():
    warmer, noisier = (load_design("mango", {key: "2"}) for key in ("readout.drift_K", "readout.noise_um"))
    assert design_digest(warmer) == design_digest(load_design("mango")) != design_digest(noisier)


def test_unit_of_another_design_is_refused(unit, paper, mango, refused):
    text = unit_as_toml(unit)
    assert refused(text, mango.report) == "unit.design"
    press = replace(paper.design.press, travel_mm=0.5)
    assert refused(text, replace(paper.report, design=replace(paper.design, press=press))) == "unit.design"


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ("K_N_per_m = [1078.0, 23120.0]", "", "--unit"),
        ("1078.0", '"1078"', "--unit"),
        ("method", "methods", "--unit"),
        ("=", "", "--unit"),
        ("1078.0", "-1.0", "unit.K_N_per_m"),
        ("1078.0", "0.0", "unit.K_N_per_m"),
        ("1078.0", "nan", "unit.K_N_per_m"),
        ("[1078.0, 23120.0]", "[1078.0]", "unit.K_N_per_m"),
        ("K_percent = [", "K_percent = [0.0, 0.0]#", "unit.K_percent"),
        ("gain_percent = [", "gain_percent = [-0.1, 0.1]#", "unit.gain_percent"),
        ("gain = [", "gain = [0.0, 1.0]#", "unit.gain"),
        ("tips = [", 'tips = ["high", "low"]#', "unit.design"),
        ("nominal", "*/ system(1); /*", "unit.method"),
        ("zero_counts = [5.0, ", "zero_counts = [", "unit.newtons_per_count"),
        ("saturation_counts = 99", "saturation_counts = 0", "unit.newtons_per_count"),
        ("force_bend = [0.0, 0.1]", "", "unit.force_bend"),
        ("force_bend_per_N = [0.0, -0.05]", "", "unit.force_bend_per_N"),
        ("[0.0, -0.05]", "[0.0, inf]", "unit.force_bend_per_N"),
        ("[0.0, -0.05]", "[0.0]", "unit.force_bend_per_N"),
    ],
)
def test_damaged_unit_is_refused_by_its_field(unit, paper, old, new, field, refused):
    assert refused(unit_as_toml(unit).replace(old, new), paper.report) == field


def test_counts_that_firmware_cannot_hold_are_refused(unit):
    counted = replace(
        unit, newtons_per_count=((1.0, 0.0), (0.0, 1.0)), zero_counts=(0.0, 0.0), saturation_counts=2**31 - 1
    )
    for wrong in (0, 2**31, 10**30):
        refusal(replace, counted, saturation_counts=wrong)


def test_classes_are_names_with_rising_limits():
    classes = ripeness_classes("ripe:0.8,turning:1.6,unripe")
    assert [classes.class_of(E) for E in (0.5, 0.8, 0.81, 9.0)] == ["ripe", "ripe", "turning", "unripe"]
    for text in (
        *("ripe:0.8", "ripe:2,turning:1,unripe", "ripe,unripe", "ripe:x,unripe", "ripe:-1,unripe", "ripe:0,unripe"),
        *(":1,unripe", "ripe:1,turning:1,unripe", "ripe:nan,unripe", "ripe:inf,unripe"),
    ):
        assert refusal(ripeness_classes, text).field == "--classes"
