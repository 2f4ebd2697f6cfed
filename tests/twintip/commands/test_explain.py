"""`pipeline explain` lists names, explains one, and refuses an unknown one in a line."""

import json

from twintip.cli import main


def test_one_name_has_meaning_formula_and_source(capsys):
    assert main(["explain", "K_m"]) == 0
    out = capsys.readouterr().out
    for words in (
        "K_m: Stiffness of the fruit",
        "formula: K_m = E",
        "source: docs/theory.md",
        "add --out DIR",
    ):
        assert words in out
    assert main(["explain", "K_m", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["name"] == "K_m"


def test_key_of_a_report_has_unit_and_meaning_and_its_value_in_a_folder(stand_in_run, capsys):
    assert main(["run", "--out", "out"]) == 0
    capsys.readouterr()
    assert main(["explain", "response.0.x_mm.-1", "--out", "out", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["unit"], told["number"]) == ("mm", f"{stand_in_run.result.design.press.travel_mm:g} mm")
    assert main(["explain", "files", "--out", "out"]) == 0
