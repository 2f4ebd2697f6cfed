"""The page of remedies: the same failing designs for a seed, printed remedies read back, and the goal held."""

import dataclasses
import importlib.util
import sys
from pathlib import Path

import pytest

from pipeline.options import load_design

SCRIPT = Path(__file__).with_name("remedies.py")


@pytest.fixture
def remedies(monkeypatch):
    spec = importlib.util.spec_from_file_location("remedies_table", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)
    spec.loader.exec_module(module)
    return module


def outcome(remedies, **changes):
    good = remedies.Outcome(number=0, kind="tilted", wrong=("NL",), passes=True, by="suggest", said="travel 1")
    return dataclasses.replace(good, **changes)


def test_designs_are_the_same_for_a_seed_and_fail(remedies):
    first = remedies.failing_design(1, 5)
    assert first == remedies.failing_design(1, 5)
    kind, preset, settings = first
    assert kind == "out of reach"
    assert not remedies.Trials(0)(load_design(preset, settings)).passes


def test_printed_remedy_is_read_as_settings(remedies):
    printed = "passes with tips.shape cube or another: --set tips.shape=cube --set tips.dome_radius_mm="
    assert remedies.settings_in(printed) == {"tips.shape": "cube", "tips.dome_radius_mm": ""}
    assert remedies.settings_in("none found: of 3 designs none passes") == {}


def test_goal_is_five_of_six_and_a_reason_for_the_rest(remedies):
    passing = [outcome(remedies)] * 5
    none = outcome(remedies, passes=False, by="none found", said="none found: of 3 designs none passes")
    assert remedies.reached([*passing, none])
    assert not remedies.reached([*passing, none, none])
    assert not remedies.reached([*passing, dataclasses.replace(none, said="no idea")])


def test_outcome_is_kept_and_taken_again(remedies, monkeypatch, tmp_path):
    monkeypatch.setattr(remedies, "failing_design", lambda *_: ("tilted", "paper", {}))
    monkeypatch.setattr(remedies, "outcome", lambda *_: outcome(remedies))
    first = remedies.kept_outcome(tmp_path, 1, 0)
    monkeypatch.setattr(remedies, "outcome", None)
    assert remedies.kept_outcome(tmp_path, 1, 0) == first


def test_page_has_a_row_for_each_design_and_the_sum(remedies, monkeypatch, tmp_path):
    monkeypatch.setattr(remedies, "kept_outcome", lambda *_: outcome(remedies))
    assert remedies.main(["--count", "2", "--out", str(tmp_path)]) == 0
    page = (tmp_path / "remedies.md").read_text(encoding="utf-8")
    assert page.count("| tilted |") == 2
    assert "2 of the 2 designs that were run pass" in page
