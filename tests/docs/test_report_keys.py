"""docs/report-json.md explains every key of a report, every verdict and every column, and none that is not there."""

import importlib
import json
import os
import re
from dataclasses import replace
from pathlib import Path

import pytest
from stand_ins import result_of, sensor_of

from cad.design.fruit import Fruit
from cad.design.parameters import Design
from cad.design.tips import Press
from pipeline.cli import main
from pipeline.reading.over_time import reading_over_time
from pipeline.report.explain.entries import entries
from pipeline.report.mapping import report_mapping
from pipeline.report.outputs import write_outputs

PAGE = (Path(__file__).parents[2] / "docs" / "report-json.md").read_text(encoding="utf-8")
WORDS = {
    "SPRING": "(low|high)",
    "NUMBER": "(K_l|K_h|P_max|NL|contact)",
    "TABLE": "[a-z]+",
    "KEY": r"\w+(\[\])?",
    "STAGE": r"\w+",
    "PACKAGE": r"[\w-]+",
    "SOURCE": r"\w+",
    "FILE": r"[\w.-]+",
}
"""What the words in capitals stand for."""


def leaves(value, path=""):
    """Yield the path of every value in nested tables and lists, `[]` for the elements of a list."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from leaves(item, f"{path}.{key}" if path else key)
    elif isinstance(value, list):
        for item in value:
            yield from leaves(item, path if path.endswith("[]") else f"{path}[]")
    else:
        yield path


def all_leaves(*reports):
    """Return the paths of several reports; one that is null in a report and a table in another is a table."""
    paths = {path for report in reports for path in leaves(report)}
    return {path for path in paths if not any(other.startswith((f"{path}.", f"{path}[")) for other in paths)}


def pattern(key):
    return re.compile(re.sub(r"[A-Z]{3,}", lambda word: WORDS[word[0]], re.escape(key)))


def explained(kind):
    """Return the names in the first column of every table of the page whose first column is of a kind."""
    names: list[str] = []
    for table in re.findall(rf"^\| {kind} \|.*\n\|.*\n((?:\|.*\n)+)", PAGE, flags=re.MULTILINE):
        for row in table.splitlines():
            names += re.findall(r"`([^`]+)`", row.split("|")[1])
    return names


def unexplained(names, kind):
    patterns = [pattern(name) for name in explained(kind)]
    return {name for name in names if not any(each.fullmatch(name) for each in patterns)}


@pytest.fixture(scope="module")
def report(designed):
    data: dict[str, object] = json.loads((designed / "report.json").read_text(encoding="utf-8"))
    return data


@pytest.fixture(scope="module")
def read_report(tmp_path_factory):
    """Return the report of a sensor that is judged by what it reads, its springs solved roughly."""
    folder = tmp_path_factory.mktemp("docs") / "mango"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(importlib.import_module("pipeline.report.outputs"), "page_of", lambda *_: "")
        assert main(["run", "--design", "mango", "--tol", "0.02", "--out", os.fspath(folder)]) in (0, 1)
    data: dict[str, object] = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    return data


@pytest.fixture(scope="module")
def timed_report():
    """Return what the report of a sensor has beside the others' keys where its fruit relaxes and a file is stale."""
    design = Design(fruit=Fruit(relaxation=((0.5, 1.0),)), press=Press(speed_mm_per_s=0.5, hold_s=1.0))
    over_time = reading_over_time(sensor_of(design))
    data = report_mapping(replace(result_of(design), over_time=over_time), stale={"sheet.md": "0"})
    return {key: data[key] for key in ("relaxation", "stale")}


@pytest.mark.slow
def test_every_key_is_explained(report, read_report, timed_report):
    assert unexplained(all_leaves(report, read_report, timed_report), "key") == set()


@pytest.mark.slow
def test_no_explained_key_is_missing(report, read_report, timed_report):
    found = all_leaves(report, read_report, timed_report)
    assert [key for key in explained("key") if not any(pattern(key).fullmatch(path) for path in found)] == []
    assert {key.split(".")[0].split("[")[0] for key in explained("key")} == {*report, *timed_report}


@pytest.mark.slow
def test_readme_has_the_numbers_of_the_sensor_that_works(read_report):
    """To two digits; its springs are solved roughly here."""
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    numbers = [
        float(cells.split("|")[2].split()[0])
        for cells in re.findall(r"^\| (?:largest|standard|pressure).*", readme, re.M)
    ]
    reading = read_report["reading"]
    skin = max(row["pressure_MPa"] / row["limit_MPa"] for row in reading["skin_pressure"])
    bias = max(abs(row["E_bias_percent"]) for row in reading["moduli"])
    assert numbers == pytest.approx([bias, reading["uncertainty_percent"], skin], rel=0.03)


@pytest.mark.slow
def test_every_verdict_is_explained(
    report,
    read_report,
    designed,
    capsys,
):
    capsys.readouterr()
    assert main(["check", os.fspath(designed), "--json"]) == 0
    checked = json.loads(capsys.readouterr().out)
    names = {verdict["name"] for verdict in (*report["verdicts"], *read_report["verdicts"], *checked)}
    assert {"P_max", "sideways.low", "files.unchanged"} <= names
    assert names - {name for entry in entries() if entry.is_verdict for name in entry.each or (entry.name,)} == set()


def test_columns_of_the_table_are_explained(tmp_path):
    write_outputs(result_of(), tmp_path)
    heads = (tmp_path / "response.csv").read_text(encoding="utf-8").splitlines()[0].split(",")
    assert explained("column") == heads
