"""A design from a preset or a file with changes on top, numbers or text; options that name what there is."""

import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from refusal import refusal

from pipeline import RunOptions, load_design, options
from sensor.design.parameters import Design
from sensor.gone import REMOVED
from sensor.quantity import InputError


def test_design_file_without_a_name_is_named_for_itself(tmp_path):
    (tmp_path / "kiwi.toml").write_text("[targets]\nNL = 0.1\n", encoding="utf-8")
    for path in (tmp_path / "kiwi.toml", str(tmp_path / "kiwi.toml")):
        design = load_design(path, {"targets.P_max": "3"})
        assert (design.name, design.targets.NL, design.targets.P_max) == ("kiwi", 0.1, 3.0)


@pytest.mark.parametrize("stem", ["my design", "größe"])
def test_file_that_no_design_can_be_named_for_is_told_to_give_a_name(stem, tmp_path):
    path = tmp_path / f"{stem}.toml"
    path.write_text("", encoding="utf-8")
    with pytest.raises(InputError, match=r"\bname = \"") as error:
        load_design(path)
    assert (error.value.field, error.value.value) == ("name", stem)
    path.write_text('name = "mine"', encoding="utf-8")
    assert load_design(path).name == "mine"


def test_preset_that_is_gone_is_refused_with_what_to_use():
    refused = refusal(load_design, "fruit")
    assert str(refused).endswith(REMOVED["preset fruit"])


def test_text_is_a_preset_from_anywhere_unless_it_looks_like_a_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("paper").write_text("[targets]\nNL = 0.1\n", encoding="utf-8")
    assert load_design() == load_design("paper", {}) == Design()
    assert load_design(Path("paper")).targets.NL == load_design("./paper").targets.NL == 0.1


def test_without_presets_a_path_is_asked_for(tmp_path, monkeypatch):
    monkeypatch.setattr(options, "DESIGNS", tmp_path)
    assert refusal(options.design_path, "paper").field == "--design"


def test_changes_are_numbers_lists_or_their_text():
    given = {"targets.NL": 0.06, "fruit.E_MPa": [1, 2], "name": "mine", "print.process": "fdm-pla"}
    design = load_design("paper", given)
    found = (design.targets.NL, design.fruit.E_MPa, design.name, design.print.process)
    assert found == (0.06, (1.0, 2.0), "mine", "fdm-pla")
    assert load_design("paper", {**given, "targets.NL": "0.06", "fruit.E_MPa": "[1, 2]"}) == design
    for same in ((1.0, 2.0), np.array([1, 2]), [np.float32(1.0), np.int64(2)]):
        assert load_design("paper", {**given, "fruit.E_MPa": same}) == design
    for same in (np.float64(0.06), np.array(0.06), Fraction(6, 100)):
        assert load_design("paper", {**given, "targets.NL": same}) == design
    unset = [
        f"{table}.{key}" for table in ("fruit", "reading") for key in ("radius_mm", "radius_across_mm", "thickness_mm")
    ]
    assert load_design("mango", {**dict.fromkeys(unset), "fruit.shape": "block"}).fruit.radius_mm is None


BAD = [
    *(("targets.NL", value) for value in (math.inf, {1, 2}, 1 + 2j, True, {"a": 1}, np.bool_(True), np.array([0.06]))),
    pytest.param("targets.NL", object(), id="object"),
    *(("fruit.E_MPa", value) for value in ([1.0, math.nan], [], [1, "2"], [[1.0]], 10**400)),
]
"""Values that a file cannot have, or only as another: tests/refused/design.toml has those that it can."""


@pytest.mark.parametrize(("key", "value"), BAD, ids=str)
def test_bad_value_is_one_line(key, value):
    assert refusal(load_design, "paper", {key: value}).field == key


@pytest.mark.parametrize(
    ("option", "value", "flag"),
    [
        *(("out", value, "out") for value in (3, b"outputs/mine", True)),
        *(("tolerance", value, "--tol") for value in (0.0, 0.99e-4, 0.101, math.nan, "0.01", True, None)),
        ("fruit_stiffness", "hays", "--fruit-stiffness"),
    ],
)
def test_option_that_names_nothing_is_refused(option, value, flag):
    """By the name of its flag."""
    assert refusal(RunOptions, **{option: value}).field == flag


@pytest.mark.parametrize(("option", "field"), [("fields", "--fields"), ("fabrication", "fabrication")])
def test_look_writes_no_further_files(option, field):
    assert refusal(RunOptions, look=True, **{option: True}).field == field


def test_folder_of_a_run_is_a_path():
    for out in ("outputs/mine", Path("outputs/mine")):
        assert RunOptions(out=out) == RunOptions(out=Path("outputs/mine"))


@pytest.mark.parametrize("wrong", [None, 3, b"paper"], ids=str)
def test_design_that_is_no_path_is_refused(wrong):
    assert refusal(load_design, wrong).field == "--design"


def test_contact_takes_a_quarter_of_the_tolerance():
    assert RunOptions(tolerance=0.02).contact_tolerance == pytest.approx(0.005)
