"""A store belongs to one study and is asked by keys; files of a person are kept."""

import sqlite3
from contextlib import closing

import numpy as np
import pytest
from refusal import refusal

from pipeline.study import read_study, run_study
from pipeline.study.points import Point
from pipeline.study.store import STORE, stored_study, study_store
from pipeline.study.tasks import PointResult
from sensor.quantity import InputError
from twintip.cli import main


@pytest.fixture
def solved(written, engine, tmp_path, in_process):  # noqa: ARG001
    """Return the words of a command whose points are all solved."""
    run_study(read_study(written()), tmp_path / "out", engine)
    return ["study", str(written()), "--out", str(tmp_path / "out")]


def edit(folder, script):
    """Change a store as a tool of SQLite would."""
    with closing(sqlite3.connect(folder / STORE)) as connection:
        connection.executescript(script)


@pytest.mark.parametrize(
    "script",
    [
        "UPDATE points SET error = CAST(x'ff' AS TEXT) WHERE number = 3",
        "ALTER TABLE points ADD COLUMN digest TEXT",  # as in a store of 0.2
        "ALTER TABLE points DROP COLUMN seconds",
        "CREATE TABLE mine (a)",
        "DELETE FROM study",
        "UPDATE study SET value = replace(value, 'paper', 'peper')",
        "PRAGMA application_id = 3",
    ],
)
def test_store_that_is_not_of_this_study_is_one_line(solved, tmp_path, capsys, script):
    edit(tmp_path / "out", script)
    assert main([*solved, "--export", str(tmp_path / "x.csv")]) == 2
    answer = capsys.readouterr()
    assert (answer.out, answer.err.count("\n")) == ("", 1)
    assert not (tmp_path / "x.csv").exists()


@pytest.mark.parametrize("column", ["settings", "results"])
def test_store_takes_nothing_that_is_no_json(solved, tmp_path, column):
    with pytest.raises(sqlite3.IntegrityError):
        edit(tmp_path / "out", f"UPDATE points SET {column} = '{{' WHERE number = 3")
    assert main(solved) == 0


def test_store_tells_the_numbers_and_the_words_of_a_key(written, tmp_path):
    """A null is no number, a text or a truth value has none, and a key that varies is told as the report has it."""
    rows = {
        5: {"contact.dofs": 3, "method": "split", "passed": True, "error": None, "targets.P_max": 7.5},
        7: {"contact.dofs": 3, "method": "split", "passed": None, "error": 0.5},
        3: {"contact.dofs": 3, "method": "direct", "passed": False, "error": 1.5},
    }
    with study_store(tmp_path / "out", read_study(written())) as store:
        for number, values in rows.items():
            settings = {"targets.P_max": 3.0 + number, "side": [1.0, 2.0]}
            store.put([PointResult(number=number, settings=settings, status="done", values=values)])
        store.put([PointResult(number=0, settings={"targets.P_max": 1.0}, status="refused", error="no")])
        assert store.done() == [3, 5, 7]
        np.testing.assert_array_equal(store.column("error"), [1.5, np.nan, 0.5])
        np.testing.assert_array_equal(store.column("targets.P_max"), [6.0, 7.5, 10.0])
        assert [store.span(key) for key in ("error", "targets.P_max")] == [(0.5, 1.5), (6.0, 10.0)]
        assert [store.span(key) for key in ("method", "passed", "side", "none")] == [None] * 4
        assert [store.differs(key) for key in ("error", "contact.dofs", "passed")] == [True, False, False]
        assert store.best("error", 3) == [7, 3, 5]
        assert store.best("none", 2) == [3, 5]
        assert [row.number for row in store.rows(store.best("error", 2))] == [7, 3]
        assert store.text_counts("method") == {"split": 2, "direct": 1}
        assert store.text_counts("passed") == {True: 1, False: 1}
        assert store.text_counts("error") == {}


def test_settings_that_are_stored_are_not_lacking_and_new_ones_take_free_numbers(written, tmp_path):
    known, new, newest = ({"a": "x", "b": b} for b in (1.5, [1.0, 2.0], True))
    with study_store(tmp_path / "out", read_study(written())) as store:
        store.put([PointResult(number=1, settings=known, status="done", values={"v": 2.0})])
        asked = [new, known, newest, new]
        assert store.missing_points(asked) == [Point(number=0, settings=new), Point(number=2, settings=newest)]
        store.put([PointResult(**vars(point), status="refused") for point in store.missing_points(asked)])
        assert store.missing_points(asked) == []
        assert [result.number for result in store.results(asked)] == [0, 1, 2, 0]
        assert store.results([known])[0].values == {"v": 2.0}


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ("[vary]", '[set]\n"targets.NL" = 0.06\n[vary]', "base.targets.NL"),
        ("to = 8", "to = 9", "vary.targets.P_max.high"),
        ("seed = 7", "seed = 8", "seed"),
        ("samples = 8", "samples = 4", "samples"),
        ("samples = 8", 'how = "points"\npoints = "rows.csv"', "vary.targets.P_max.low"),
    ],
)
def test_changed_study_is_refused_with_the_difference(written, engine, tmp_path, old, new, field):
    (tmp_path / "rows.csv").write_text("targets.P_max\n4\n", encoding="utf-8")
    run_study(read_study(written()), tmp_path / "out", engine)
    assert refusal(run_study, read_study(written(**{old: new})), tmp_path / "out", engine).field == field


def test_two_runs_on_one_study_refuse(written, tmp_path):
    study = read_study(written())
    with study_store(tmp_path / "out", study), pytest.raises(InputError), study_store(tmp_path / "out", study):
        pass
    with study_store(tmp_path / "out", study):  # the first one is at its end
        pass


def test_folder_of_something_else_is_refused(written, engine, tmp_path):
    study = read_study(written())
    (tmp_path / "out").mkdir()
    (tmp_path / "file").touch()
    (tmp_path / "out" / "report.json").touch()
    for folder in (tmp_path / "out", tmp_path / "file", tmp_path / "file" / "below"):
        assert refusal(run_study, study, folder, engine).field == "--out"
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["report.json"]


@pytest.mark.parametrize("content", ["CREATE TABLE a (b)", "CREATE TABLE points (number)", None])
def test_foreign_database_is_refused_and_left_as_it_is(written, engine, tmp_path, content):
    (tmp_path / "out").mkdir()
    path = tmp_path / "out" / STORE
    if content is None:
        path.write_bytes(b"of a person" * 1000)
    else:
        edit(tmp_path / "out", content)
    before = path.read_bytes()
    assert refusal(run_study, read_study(written()), tmp_path / "out", engine).field == "study store"
    assert path.read_bytes() == before
    with pytest.raises(InputError), stored_study(tmp_path / "none"):
        pass


@pytest.mark.parametrize("content", ["of a person", pytest.param(None, marks=pytest.mark.slow)])
def test_design_files_that_a_person_edited_are_refused_before_anything_is_solved(solved, written, tmp_path, content):
    assert main([*solved, "--html"]) == 0
    edited = next((tmp_path / "out" / "best-designs").glob("point-*.toml"))
    if content is not None:
        edited.write_text(content, encoding="utf-8")
    longer = str(written(**{"samples = 8": "samples = 12"}))
    assert main([*solved[:1], longer, *solved[2:], "--html"]) == (0 if content is None else 2)
    with stored_study(tmp_path / "out") as kept:
        assert sum(kept.counts().values()) == (12 if content is None else 8)
