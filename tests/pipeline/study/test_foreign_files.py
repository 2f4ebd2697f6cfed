"""What a study finds in a place is replaced only where the study wrote it: tables, pages, designs and its own store."""

import sqlite3
from collections.abc import Callable
from pathlib import Path

import pytest

from cad.quantity import InputError
from pipeline.cli import main
from pipeline.study import read_study, run_study, store
from pipeline.study.store import STORE, stored_study
from pipeline.study.workers import Engine

Write = Callable[..., Path]


@pytest.fixture
def solved(written: Write, engine: Engine, tmp_path: Path) -> list[str]:
    """Return the words of a command whose points are all solved, and so which starts no process that solves."""
    run_study(read_study(written()), tmp_path / "out", engine)
    return ["study", str(written()), "--out", str(tmp_path / "out"), "--processes", "1"]


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
    written = path.read_bytes()
    assert main([*solved, flag, str(path)]) == 0
    assert path.read_bytes() == written
    path.write_bytes(written + b"\n")
    assert main([*solved, flag, str(path)]) == 2


@pytest.mark.parametrize(("flag", "name"), [("--export", "none/x.csv"), ("--html", "none/x.html"), ("--html", "x.txt")])
def test_place_that_cannot_be_written_is_refused_before_anything_is_solved(
    written: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str], flag: str, name: str
) -> None:
    out = tmp_path / "out"
    assert main(["study", str(written()), "--out", str(out), flag, str(tmp_path / name)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not out.exists()


def test_foreign_database_is_refused_and_left_as_it_is(written: Write, engine: Engine, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    path = tmp_path / "out" / STORE
    connection = sqlite3.connect(path)
    connection.executescript("CREATE TABLE a (b); CREATE VIEW results AS SELECT b FROM a")
    connection.close()
    before = path.read_bytes()
    with pytest.raises(InputError, match="another database"):
        run_study(read_study(written()), tmp_path / "out", engine)
    assert path.read_bytes() == before
    assert [file.name for file in path.parent.iterdir()] == [STORE]


def test_store_of_another_schema_is_refused(solved: list[str], tmp_path: Path) -> None:
    connection = sqlite3.connect(tmp_path / "out" / STORE)
    connection.execute("UPDATE study SET value = '2' WHERE key = 'schema'")
    connection.commit()
    connection.close()
    assert main(solved) == 2


def test_store_that_breaks_later_is_one_line(solved: list[str], tmp_path: Path) -> None:
    assert solved
    connection = sqlite3.connect(tmp_path / "out" / STORE)
    connection.executescript("DROP VIEW results; DROP TABLE points")
    connection.close()
    with pytest.raises(InputError, match="no such table"), stored_study(tmp_path / "out") as kept:
        kept.counts()


def test_folder_below_a_file_is_one_line(written: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file.csv").touch()
    for command, text in (("study", ""), ("optimise", '[optimise]\nminimise = "springs.K_l_N_per_m"\nunder = []\n')):
        words = [command, str(written()), "--out", str(tmp_path / "file.csv" / "foo"), "--processes", "1"]
        if text:
            words[1] = str(written(written().read_text(encoding="utf-8").replace("samples = 8", "") + text))
        assert main(words) == 2
        assert capsys.readouterr().err.count("\n") == 1


def test_row_that_a_person_broke_is_named(
    solved: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    connection = sqlite3.connect(tmp_path / "out" / STORE)
    connection.execute("UPDATE points SET results = '{' WHERE number = 3")
    connection.commit()
    connection.close()
    assert main([*solved, "--export", str(tmp_path / "x.csv")]) == 2
    complaint = capsys.readouterr().err
    assert complaint.count("\n") == 1
    assert "point = 3" in complaint


def test_store_that_another_program_holds_is_said_so(
    solved: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(store, "_WAIT_S", 0.0)
    connection = sqlite3.connect(tmp_path / "out" / STORE)
    connection.execute("BEGIN IMMEDIATE")
    try:
        assert main(solved) == 2
    finally:
        connection.close()
    assert "no other program has open (database is locked); close it there" in capsys.readouterr().err
    assert main(solved) == 0


def test_full_disk_at_the_start_is_said_so(tmp_path: Path) -> None:
    whole = "PRAGMA max_page_count = 1; CREATE TABLE a (b); CREATE TABLE c (d)"
    with pytest.raises(InputError, match="free some space"), store._opened(tmp_path / STORE) as connection:
        connection.executescript(whole)


@pytest.mark.parametrize("content", ["of a person", None])
def test_design_files_that_a_person_edited_are_refused_before_anything_is_solved(
    written: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str], content: str | None
) -> None:
    out = tmp_path / "out"
    words = ["study", "--processes", "1", "--out", str(out), "--html", str(tmp_path / "study.html")]
    assert main([*words, str(written())]) == 0
    edited = next((out / "best-designs").glob("point-*.toml"))
    if content is not None:
        edited.write_text(content, encoding="utf-8")
    capsys.readouterr()
    longer = written(**{"samples = 8": "samples = 12"})
    assert main([*words, str(longer)]) == (0 if content is None else 2)
    with stored_study(out) as kept:
        assert sum(kept.counts().values()) == (12 if content is None else 8)
