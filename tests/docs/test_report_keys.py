"""Every key of a written report has a unit and a meaning, and docs/report-json.md explains it, and none besides."""

import dataclasses
import importlib
import json
import os
import re
from dataclasses import replace
from pathlib import Path

import pytest
from golden.freeze import NUMBERS
from stand_ins import relaxing_result, result_of

from pipeline.reading.read_out import LevelReading
from pipeline.report.keys import report_keys
from pipeline.report.of_result import report_of_result
from pipeline.report.outputs import write_outputs
from pipeline.report.report import Report, report_data
from twintip.cli import main

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "report-json.md").read_text(encoding="utf-8")
WORDS = {
    "SPRING": "(low|high)",
    "NUMBER": "(K_l|K_h|P_max|NL|contact)",
    "KEY": r"\w+(\.\w+)?(\[\])?",
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
        path = path if path.endswith("[]") else f"{path}[]"
        yield from [path] if not value else []
        for item in value:
            yield from leaves(item, path)
    else:
        yield path


def all_leaves(*reports):
    """Return the paths of several reports; one that is null in a report and a table in another is a table."""
    paths = {path for report in reports for path in leaves(report)}
    return {path for path in paths if not any(other.startswith((f"{path}.", f"{path}[")) for other in paths)}


def pattern(key):
    return re.compile(re.sub(r"\b[A-Z]{3,}(?=\b|_)", lambda word: WORDS[word[0]], re.escape(key)))


SUFFIXES = {
    "_N_per_m": "N/m", "_mm_per_N": "mm/N", "mV_per_V": "mV/V", "_per_mm": "1/mm", "_per_N": "1/N",
    "_mm_per_s": "mm/s", "_percent": "%", "_counts": "1", "_fraction": "1", "_rad": "rad", "_MPa": "MPa",
    "_mm": "mm", "_ms": "ms", "_Hz": "Hz", "_N": "N", "_K": "K", "_V": "V", "_s": "s",
}  # fmt: skip
"""What a key that carries its unit ends in, the longer endings first."""


def test_page_has_each_part_of_a_report_once():
    named = [name for names in re.findall(r"<!-- keys: (.+) -->", PAGE) for name in names.split()]
    assert sorted(named) == sorted(item.name for item in dataclasses.fields(Report))


def test_every_key_has_a_meaning_and_the_unit_that_its_name_ends_in():
    for key in report_keys():
        assert key.meaning, key.name
        last = key.name.rpartition(".")[2].removesuffix("[]")
        suffix = next((suffix for suffix in SUFFIXES if last.endswith(suffix)), None)
        if suffix is not None and key.is_value:
            assert key.unit.partition(" of ")[0] == SUFFIXES[suffix], key.name


@pytest.fixture(scope="module")
def report(designed):
    data: dict[str, object] = json.loads((designed / "report.json").read_text(encoding="utf-8"))
    return data


@pytest.fixture(scope="module")
def read_report(tmp_path_factory):
    """Return the report of a sensor that is judged by what it reads, its springs solved roughly."""
    folder = tmp_path_factory.mktemp("docs") / "mango"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(importlib.import_module("pipeline.report.outputs"), "make_page", lambda *_: "")
        assert main(["run", "--design", "mango", "--tol", "0.02", "--out", os.fspath(folder)]) in (0, 1)
    data: dict[str, object] = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    return data


@pytest.fixture(scope="module")
def timed_report():
    """Return what a report has beside the others' keys: fruit that relaxes, a pair that is corrected."""
    result = relaxing_result()
    read_out = replace(result.read_out, level=(LevelReading(E_MPa=1.0, read_MPa=1.1),))
    result = replace(result, read_out=read_out)
    data = report_data(report_of_result(result))
    return {"read_out": {"level": data["read_out"]["level"]}, "relaxation": data["relaxation"]}


def test_tables_of_files_have_every_file_that_a_design_or_a_run_writes():
    """Beside those of the frozen design: the files of pins, of a read-out and of --fields."""
    frozen = json.loads((NUMBERS / "paper.json").read_text(encoding="utf-8"))["design files"]
    tables = "".join((DOCS / name).read_text(encoding="utf-8") for name in ("commands.md", "make-one.md"))
    rows = re.findall(r"^\| (`[^|]*`) \|", tables, re.MULTILINE)
    told = {name for row in rows for name in re.findall(r"`([a-z]+\.[a-z0-9]+)`", row)}
    assert told == {*frozen, "pin.step", "wiring.svg", "fruit.vtu", "flexure.inp"}


@pytest.mark.slow
def test_files_of_the_design_are_those_that_are_frozen(designed):
    frozen = json.loads((NUMBERS / "paper.json").read_text(encoding="utf-8"))["design files"]
    assert sorted(path.name for path in designed.iterdir()) == frozen


@pytest.mark.slow
def test_every_key_is_explained_and_no_explained_key_is_missing(report, read_report, timed_report):
    """But for those of a skin, which none of these three designs has."""
    found = all_leaves(report, read_report, timed_report)
    patterns = {key.name: pattern(key.name) for key in report_keys() if key.is_value}
    assert [path for path in found if not any(each.fullmatch(path) for each in patterns.values())] == []
    asked = {name: each for name, each in patterns.items() if not name.startswith("contact.skin")}
    assert [name for name, each in asked.items() if not any(map(each.fullmatch, found))] == []


def test_columns_of_the_table_are_explained(tmp_path):
    write_outputs(result_of(), tmp_path)
    heads = (tmp_path / "response.csv").read_text(encoding="utf-8").splitlines()[0].split(",")
    (table,) = re.findall(r"^\| column \|.*\n\|.*\n((?:\|.*\n)+)", PAGE, flags=re.MULTILINE)
    assert [name for row in table.splitlines() for name in re.findall(r"`([^`]+)`", row.split("|")[1])] == heads
