"""A unit comes back from its file; a file that is none, or of another design, is refused in one line."""

from dataclasses import replace

import pytest

from cad.quantity import InputError
from pipeline.measure.unit.printed_unit import nominal_unit, read_unit, unit_as_toml
from pipeline.measure.unit.ripeness import ripeness_classes


@pytest.fixture
def unit(paper):
    return replace(nominal_unit(paper.report), K_N_per_m=(1078.0, 23120.0), classes="ripe:0.8,unripe")


def written(tmp_path, text):
    path = tmp_path / "unit.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_unit_comes_back_as_it_was_written(unit, paper, tmp_path):
    assert read_unit(written(tmp_path, unit_as_toml(unit)), paper.report) == unit


def test_nominal_unit_is_as_uncertain_as_its_process_prints(paper):
    process = paper.design.process
    expected = [
        100.0 * (process.E_scatter**2 + (1.5 * process.accuracy_mm / thickness) ** 2) ** 0.5
        for thickness in process.leaf_thicknesses_mm
    ]
    assert nominal_unit(paper.report).K_percent == pytest.approx(expected)


def test_unit_of_another_design_is_refused(unit, paper, mango, tmp_path):
    path = written(tmp_path, unit_as_toml(unit))
    with pytest.raises(InputError, match=r"unit\.tips = 'low, high': must be those of the design, low_1, high_1"):
        read_unit(path, mango.report)
    other = replace(paper.report, design=replace(paper.design, name="other"))
    with pytest.raises(InputError, match=r"unit\.design = 'paper .*must be the unit of design 'other'"):
        read_unit(path, other)
    moved = replace(paper.report, design=replace(paper.design, press=replace(paper.design.press, travel_mm=0.5)))
    with pytest.raises(InputError, match=r"unit\.design = 'paper"):
        read_unit(path, moved)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("K_N_per_m = [1078.0, 23120.0]", "", "K_N_per_m"),
        ("1078.0", "-1.0", r"unit\.K_N_per_m = -1 N/m: must be greater than 0"),
        ("[1078.0, 23120.0]", "[1078.0]", "must be a list of 2 numbers, one for each tip"),
        ("1078.0", "nan", r"unit\.K_N_per_m = nan N/m"),
        ("method", "methods", r"required field missing @ unit\.method"),
        ("nominal", "*/ system(1); /*", r"unit\.method"),
        ("=", "", "Expected"),
    ],
)
def test_damaged_unit_is_one_line(unit, paper, tmp_path, old, new, message):
    path = written(tmp_path, unit_as_toml(unit).replace(old, new))
    with pytest.raises(InputError, match=message) as caught:
        read_unit(path, paper.report)
    assert "\n" not in str(caught.value)


def test_classes_are_names_with_rising_limits():
    classes = ripeness_classes("ripe:0.8,turning:1.6,unripe")
    assert [classes.of(E) for E in (0.5, 0.8, 0.81, 9.0)] == ["ripe", "ripe", "turning", "unripe"]
    for text in ("ripe:0.8", "ripe:2,turning:1,unripe", "ripe,unripe", "ripe:x,unripe", "ripe:-1,unripe", ":1,unripe"):
        with pytest.raises(InputError, match=r"^--classes = .*; write for instance ripe:0\.8,turning:1\.6,unripe$"):
            ripeness_classes(text)
