"""A unit comes back from its file; a file that is none, or of another design, is refused by field."""

import math
from dataclasses import replace
from types import SimpleNamespace

import pytest

from pipeline.measure.unit.printed_unit import design_digest, nominal_unit, percent_as_made, read_unit, unit_as_toml
from pipeline.measure.unit.ripeness import ripeness_classes
from sensor.design.leaves import leaves_of
from sensor.design.parameters import Design, Print
from sensor.quantity import InputError
from sensor.theory.two_spring_law import Springs


@pytest.fixture
def unit(paper):
    return replace(
        nominal_unit(paper.report),
        K_N_per_m=(1078.0, 23120.0),
        classes="ripe:0.8,unripe",
        newtons_per_count=((1e-6, 0.0), (1e-8, 1e-5)),
        zero_counts=(5.0, -7.0),
        saturation_counts=99,
        force_bend=(0.0, 0.1),
        force_bend_per_N=(0.0, -0.05),
    )


@pytest.fixture
def refused(tmp_path):
    """Return a function that reads a text as a unit and returns the field of the error."""

    def field(text, report):
        path = tmp_path / "unit.toml"
        path.write_text(text, encoding="utf-8")
        with pytest.raises(InputError) as caught:
            read_unit(path, report)
        assert "\n" not in str(caught.value)
        return caught.value.field

    return field


def test_unit_comes_back_as_it_was_written(unit, paper, tmp_path):
    path = tmp_path / "unit.toml"
    path.write_text(unit_as_toml(unit), encoding="utf-8")
    assert read_unit(path, paper.report) == unit


def test_unit_of_version_0_1_that_tells_heights_is_read(unit, paper, tmp_path):
    path = tmp_path / "unit.toml"
    heights = "height_mm = [0.0, 0.01]\nheight_error_mm = [1e-6, 1e-6]\n"
    path.write_text(heights + unit_as_toml(unit), encoding="utf-8")
    assert read_unit(path, paper.report) == unit


def test_nominal_unit_is_as_uncertain_as_its_process_prints(paper):
    process = paper.design.process
    expected = []
    for thickness in process.leaf_thicknesses_mm:
        expected.append(100.0 * (process.E_scatter**2 + (1.5 * process.accuracy_mm / thickness) ** 2) ** 0.5)
    assert nominal_unit(paper.report).K_percent == pytest.approx(expected)


def test_strips_are_as_uncertain_as_their_causes(paper):
    design = replace(paper.design, print=Print(leaves="spring-steel"))
    leaves = leaves_of(design, Springs(K_l=0.9057, K_h=20.831))
    lengths = (16.0, 15.0)
    found = percent_as_made(SimpleNamespace(design=design, leaves=leaves, leaf_lengths=lengths))
    causes = [sizes for _, sizes in leaves.causes(lengths)]
    assert found == pytest.approx([50.0 * math.hypot(*of_spring) for of_spring in zip(*causes, strict=True)])
    assert max(found) < 0.6 * min(nominal_unit(paper.report).K_percent)


def test_unit_of_version_0_1_is_one_of_its_design():
    """The digest that 0.1 wrote into the units of its default design."""
    assert design_digest(Design()) == "9279a9d7514dd03c4597188a5314cbb2346e47512d3ce2b7fa0b8f3eff27bc00"


def test_unit_of_another_design_is_refused(unit, paper, mango, refused):
    text = unit_as_toml(unit)
    assert refused(text, mango.report) == "unit.design"
    assert refused(text, replace(paper.report, design=replace(paper.design, name="other"))) == "unit.design"
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
        with pytest.raises(InputError):
            replace(counted, saturation_counts=wrong)


def test_classes_are_names_with_rising_limits():
    classes = ripeness_classes("ripe:0.8,turning:1.6,unripe")
    assert [classes.class_of(E) for E in (0.5, 0.8, 0.81, 9.0)] == ["ripe", "ripe", "turning", "unripe"]
    for text in (
        *("ripe:0.8", "ripe:2,turning:1,unripe", "ripe,unripe", "ripe:x,unripe", "ripe:-1,unripe", "ripe:0,unripe"),
        *(":1,unripe", "ripe:1,turning:1,unripe", "ripe:nan,unripe", "ripe:inf,unripe"),
    ):
        with pytest.raises(InputError) as caught:
            ripeness_classes(text)
        assert caught.value.field == "--classes"
