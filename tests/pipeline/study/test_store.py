"""A store belongs to one study and believes nothing that the study did not write; files of a person are kept."""

import re
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from cad.quantity import InputError
from pipeline.cli import main
from pipeline.study import read_study, run_study, store
from pipeline.study.store import STORE, stored_study, study_store
from pipeline.study.workers import Engine

Write = Callable[..., Path]


@pytest.fixture
def solved(written: Write, engine: Engine, tmp_path: Path, in_process: None) -> list[str]:  # noqa: ARG001
    """Return the words of a command whose points are all solved."""
    run_study(read_study(written()), tmp_path / "out", engine)
    return ["study", str(written()), "--out", str(tmp_path / "out")]


def edit(folder: Path, script: str) -> None:
    """Change a store as a tool of SQLite would."""
    with closing(sqlite3.connect(folder / STORE)) as connection:
        connection.executescript(script)


@pytest.mark.parametrize("exported", [True, False])
@pytest.mark.parametrize(
    "script",
    [
        "UPDATE points SET results = replace(results, '1', '2') WHERE number = 3",
        "UPDATE points SET results = '{' WHERE number = 3",
        "UPDATE points SET results = CAST(x'ff' AS TEXT) WHERE number = 3",
        "UPDATE points SET settings = replace(settings, '.', '.0') WHERE number = 3",
        "UPDATE points SET status = 'refused', error = 'x' WHERE number = 3",
        "UPDATE points SET results = (SELECT results FROM points WHERE number = 4) WHERE number = 3",
        "UPDATE points SET digest = '' WHERE number = 3",
        "ALTER TABLE points ADD COLUMN mine TEXT",
        "ALTER TABLE points DROP COLUMN seconds",
        "CREATE TABLE mine (a)",
        "DELETE FROM study",
        "UPDATE study SET value = replace(value, 'paper', 'peper')",
        "PRAGMA application_id = 3",
    ],
)
def test_changed_store_is_not_believed(
    solved: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str], script: str, *, exported: bool
) -> None:
    edit(tmp_path / "out", script)
    assert main([*solved, *(["--export", str(tmp_path / "x.csv")] if exported else [])]) == 2
    answer = capsys.readouterr()
    assert (answer.out, answer.err.count("\n")) == ("", 1)
    assert not (tmp_path / "x.csv").exists()


def test_row_that_is_gone_is_solved_again(written: Write, engine: Engine, tmp_path: Path) -> None:
    study = read_study(written())
    folder = tmp_path / "out"
    run_study(study, folder, engine)
    with stored_study(folder) as kept:
        (before,) = kept.rows([3])
    edit(folder, "DELETE FROM points WHERE number = 3")
    assert run_study(study, folder, engine).solved == 1
    with stored_study(folder) as kept:
        (after,) = kept.rows([3])
    assert after.values == pytest.approx(before.values, rel=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ("[vary]", '[set]\n"targets.NL" = 0.06\n[vary]', "base.targets.NL"),
        ("to = 8", "to = 9", "vary.targets.P_max.high"),
        ("seed = 7", "seed = 8", "seed"),
        ("samples = 8", "samples = 4", "samples"),
        ("samples = 8", 'samples = 8\nhow = "sensitivity"', "how"),
    ],
)
def test_changed_study_is_refused_with_the_difference(
    written: Write, engine: Engine, tmp_path: Path, old: str, new: str, field: str
) -> None:
    run_study(read_study(written()), tmp_path / "out", engine)
    with pytest.raises(InputError) as refused:
        run_study(read_study(written(**{old: new})), tmp_path / "out", engine)
    assert refused.value.field == field


def test_longer_study_of_sensitivities_is_another_one(written: Write, tmp_path: Path) -> None:
    """Its points are numbered in blocks of `samples`."""
    for samples in (2, 4):
        study = read_study(written(**{"samples = 8": f'samples = {samples}\nhow = "sensitivity"'}))
        if samples == 2:
            with study_store(tmp_path / "out", study):
                continue
        with pytest.raises(InputError) as refused, study_store(tmp_path / "out", study):
            pass
        assert refused.value.field == "samples"


def test_two_runs_on_one_study_refuse(written: Write, tmp_path: Path) -> None:
    study = read_study(written())
    with study_store(tmp_path / "out", study), pytest.raises(InputError), study_store(tmp_path / "out", study):
        pass
    with study_store(tmp_path / "out", study):  # the first one is at its end
        pass


def test_folder_of_something_else_is_refused(written: Write, engine: Engine, tmp_path: Path) -> None:
    study = read_study(written())
    (tmp_path / "out").mkdir()
    (tmp_path / "file").touch()
    (tmp_path / "out" / "report.json").touch()
    for folder in (tmp_path / "out", tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(InputError) as refused:
            run_study(study, folder, engine)
        assert refused.value.field == "--out"
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["report.json"]


@pytest.mark.parametrize("content", ["CREATE TABLE a (b)", "CREATE TABLE points (number)", None])
def test_foreign_database_is_refused_and_left_as_it_is(
    written: Write, engine: Engine, tmp_path: Path, content: str | None
) -> None:
    (tmp_path / "out").mkdir()
    path = tmp_path / "out" / STORE
    if content is None:
        path.write_bytes(b"of a person" * 1000)
    else:
        edit(tmp_path / "out", content)
    before = path.read_bytes()
    with pytest.raises(InputError) as refused:
        run_study(read_study(written()), tmp_path / "out", engine)
    assert refused.value.field == "study store"
    assert path.read_bytes() == before
    with pytest.raises(InputError), stored_study(tmp_path / "none"):
        pass


def test_store_that_another_program_holds_is_refused_until_it_is_free(
    written: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store, "_WAIT_S", 0.0)
    study = read_study(written())
    with study_store(tmp_path / "out", study):
        pass
    with closing(sqlite3.connect(tmp_path / "out" / STORE)) as connection:
        connection.execute("BEGIN IMMEDIATE")
        with pytest.raises(InputError) as refused, study_store(tmp_path / "out", study):
            pass
        assert refused.value.field == "study store"
    with study_store(tmp_path / "out", study):
        pass


@pytest.mark.parametrize(("flag", "name"), [("--export", "mine.csv"), ("--html", "mine.html")])
def test_foreign_file_is_kept_and_an_own_one_is_replaced(
    solved: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str], flag: str, name: str
) -> None:
    path = tmp_path / name
    path.write_text("of a person", encoding="utf-8")
    assert main([*solved, flag, str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert path.read_text(encoding="utf-8") == "of a person"
    assert main([*solved, flag, str(path), "--force"]) == 0
    assert (tmp_path / f"{name}.bak").read_text(encoding="utf-8") == "of a person"
    content = path.read_bytes()
    assert main([*solved, flag, str(path)]) == 0
    assert path.read_bytes() == content  # the same bytes every time


@pytest.mark.parametrize("content", ["of a person", None])
def test_design_files_that_a_person_edited_are_refused_before_anything_is_solved(
    solved: list[str], written: Write, tmp_path: Path, content: str | None
) -> None:
    assert main([*solved, "--html"]) == 0
    edited = next((tmp_path / "out" / "best-designs").glob("point-*.toml"))
    if content is not None:
        edited.write_text(content, encoding="utf-8")
    longer = str(written(**{"samples = 8": "samples = 12"}))
    assert main([*solved[:1], longer, *solved[2:], "--html"]) == (0 if content is None else 2)
    with stored_study(tmp_path / "out") as kept:
        assert sum(kept.counts().values()) == (12 if content is None else 8)


def test_table_has_every_point_with_all_digits(solved: list[str], tmp_path: Path) -> None:
    assert main([*solved, "--export", str(tmp_path / "x.csv")]) == 0
    lines = (tmp_path / "x.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "number,status,targets.P_max,springs.K_l_N_per_m,springs.K_h_N_per_m,error"
    with stored_study(tmp_path / "out") as kept:
        for line, row in zip(lines[1:], kept.rows(), strict=True):
            values = [float(cell) for cell in re.findall(r"\d+\.\d+", line)]
            assert values == [*row.settings.values(), *row.values.values()]


def test_answer_has_the_span_of_every_number_and_names_every_file(
    solved: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = tmp_path / "x.csv"
    assert main([*solved, "--export", str(table), "--html"]) == 0
    lines = capsys.readouterr().out.splitlines()
    columns = list(zip(*(line.split(",") for line in table.read_text(encoding="utf-8").splitlines()), strict=True))
    for name, *cells in columns[3:5]:
        numbers = [float(cell) for cell in cells]
        assert f"{name}: {min(numbers):.5g} to {max(numbers):.5g}" in lines
    out = tmp_path / "out"
    assert lines[-3:] == [str(out / STORE), str(table), str(out / "study.html")]
