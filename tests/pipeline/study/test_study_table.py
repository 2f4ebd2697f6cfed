"""The table of a study as columns and as a CSV file, and its best point."""

import csv
import json
from dataclasses import replace

import pytest
from refusal import refusal

from pipeline.study import read_study, run_study
from pipeline.study.store import stored_study
from pipeline.study.study_table import export_table

P_MAX, STIFFNESS, LEAVES, PASSED = (
    "targets.P_max", "springs.K_l_N_per_m", "springs.beam_law_leaves_mm.0", "verdicts.printable.low.passed",
)  # fmt: skip


@pytest.fixture
def summary(tmp_path, written, engine):
    """Return a study of which half of the points are refused: P_max above 100."""
    changes = {"from = 3, to = 8": "from = 90, to = 110"}
    study = replace(read_study(written(**changes)), wanted=(STIFFNESS, LEAVES, PASSED))
    return run_study(study, tmp_path / "out", engine)


def test_columns_are_those_of_the_exported_file_and_refused_points_have_no_values(summary, tmp_path):
    table = summary.table()
    refused = [P > 100.0 for P in table[P_MAX]]
    assert 0 < sum(refused) == summary.refused < summary.points
    for name in (STIFFNESS, LEAVES, PASSED):
        assert [value is None for value in table[name]] == refused
    assert [bool(error) for error in table["error"]] == refused
    assert list(table) == ["number", "status", P_MAX, STIFFNESS, LEAVES, PASSED, "error"]
    assert {len(column) for column in table.values()} == {summary.points}
    with stored_study(summary.folder) as store:
        export_table(store, tmp_path / "table.csv")
    with (tmp_path / "table.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    as_text = {
        name: ["" if each is None else each if isinstance(each, str) else json.dumps(each) for each in column]
        for name, column in table.items()
    }
    assert as_text == {name: [row[name] for row in rows] for name in table}


def test_best_point_has_the_least_number_of_the_first_wanted_key(summary):
    table = summary.table()
    least = min(value for value in table[STIFFNESS] if value is not None)
    place = table[STIFFNESS].index(least)
    assert summary.best == {name: column[place] for name, column in table.items()}


def test_study_without_numbers_has_no_best_point(tmp_path, written, engine):
    study = replace(read_study(written(**{"from = 3, to = 8": "from = 101, to = 110"})), samples=2)
    assert run_study(study, tmp_path / "out", engine).best is None


def test_folder_that_is_gone_is_refused(summary, tmp_path):
    assert refusal(replace(summary, folder=tmp_path / "none").table).field == "study store"
