"""`pipeline suggest` prints a table and a command that gives the design, and writes a design file where asked."""

import json
import re
import shlex

import pytest

from pipeline.find import demand, fruit_design
from pipeline.find import suggestion as room
from pipeline.find.fruit_range import fruit_range
from pipeline.find.suggestion import Suggestion
from pipeline.options import load_design
from sensor.design.design_file import design_as_toml
from sensor.quantity import Estimate
from sensor.verdict import judge
from twintip.cli import main

BRUISED = ["suggest", "paper", "--set", "fruit.bruise_limit_MPa=0.29", "--nl", "0.04"]


@pytest.fixture
def found(monkeypatch, tmp_path):
    """Put a suggestion in the place of the search; return how it was asked."""
    monkeypatch.chdir(tmp_path)
    asked = []

    def stand_in(design, options, keep, _progress):
        asked.append((design, options, keep))
        return Suggestion(design=design, changes={"press.travel_mm": 0.07}, verdicts=(), reason="passes", runs=2)

    monkeypatch.setattr(room, "suggestion", stand_in)
    return asked


def test_command_that_is_printed_gives_the_design(found, capsys):
    assert main([*BRUISED, "--keep", "print.process"]) == 0
    _, *table, command = capsys.readouterr().out.splitlines()
    (design, _, keep) = found[0]
    assert keep == {"print.process"}
    assert [row.split() for row in table[:2]] == [["key", "from", "to"], ["press.travel_mm", "0.6", "0.07"]]
    settings = dict(word.split("=", 1) for word in shlex.split(command) if "=" in word)
    changed = load_design("paper", settings)
    assert (changed.press.travel_mm, changed.targets.NL) == (0.07, 0.04)
    assert changed.fruit == design.fruit


@pytest.mark.usefixtures("found")
def test_design_file_reads_back_as_the_design(tmp_path):
    assert main([*BRUISED, "--out", "mended.toml"]) == 0
    text = (tmp_path / "mended.toml").read_text(encoding="utf-8")
    assert text.startswith("# pipeline run --design paper ")
    assert design_as_toml(load_design(tmp_path / "mended.toml")) in text
    (tmp_path / "mended.toml").write_text(f"{text}# mine\n", encoding="utf-8")
    assert main([*BRUISED, "--out", "mended.toml"]) == 2


@pytest.fixture
def fruits(monkeypatch):
    """Put none found in the place of the search for a fruit; return how it was asked."""
    asked = []

    def stand_in(fruit, preset, keep, _progress):
        asked.append((fruit, preset, keep))
        failed = judge("reading.bias", Estimate(0.0519, 0.0008), "at 2 MPa", limit=0.05)
        return Suggestion(design=preset, changes=None, verdicts=(failed,), reason="none found")

    monkeypatch.setattr(fruit_design, "fruit_suggestion", stand_in)
    monkeypatch.setattr(demand, "nearest_demand", lambda *_: fruit_range("radius 27, E 0.4 to 2"))
    return asked


def test_fruit_starts_from_the_preset_most_like_it_and_is_told_what_it_lacks(fruits, capsys):
    assert (
        main(["suggest", "--fruit", "radius 26, E 0.3 to 2", "--set", "reading.tilt_deg=3", "--out", "ball.toml"]) == 1
    )
    ((fruit, preset, keep),) = fruits
    assert fruit.E_max_MPa == 2.0
    assert preset.fruit == load_design("tomato").fruit
    assert (preset.name, preset.reading.tilt_deg, keep) == ("ball", 3.0, {"reading.tilt_deg"})
    line = capsys.readouterr().out.splitlines()[1]
    assert re.findall(r"[\d.]+", line.partition(": ")[2])[:3] == ["5.190", "0.080", "5"]


@pytest.mark.usefixtures("fruits")
def test_nearest_fruit_that_has_a_sensor_is_told_with_its_command(monkeypatch, capsys):
    asked = ["suggest", "--fruit", "radius 26, E 0.3 to 2"]
    assert main([*asked, "--json"]) == 1
    data = json.loads(capsys.readouterr().out)
    assert (data["preset"], data["nearest_fruit"], data["passes"]) == ("tomato", "radius 27, E 0.4 to 2", False)
    given = ["--set", "reading.tilt_deg=3", "--keep", "press.travel_mm", "--out", "our fruit/my-fruit.toml"]
    assert main([*asked, *given]) == 1
    command = capsys.readouterr().out.splitlines()[-1].partition(": ")[2]
    assert shlex.split(command) == ["pipeline", "suggest", "--fruit", data["nearest_fruit"], *given]
    monkeypatch.setattr(demand, "nearest_demand", lambda *_: None)
    assert main([*asked, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["nearest_fruit"] is None


def test_fruit_of_a_preset_is_known_by_its_name(fruits):
    assert main(["suggest", "--fruit", "kiwi"]) == 1
    assert main(["suggest", "--fruit", "kiwano"]) == 2
    ((fruit, preset, _),) = fruits
    kiwi = load_design("kiwi")
    assert preset.tips == kiwi.tips
    assert (fruit.thickness_mm, fruit.E_max_MPa) == (kiwi.reading.thickness_mm, kiwi.fruit.E_max_MPa)


def test_design_without_a_remedy_ends_with_1(monkeypatch, capsys):
    def none(design, _options, _keep, _progress):
        return Suggestion(design=design, changes=None, verdicts=(), reason="none found: of 3 designs none passes")

    monkeypatch.setattr(room, "suggestion", none)
    assert main(["suggest"]) == 1
    assert capsys.readouterr().out == "paper: none found: of 3 designs none passes\n"
