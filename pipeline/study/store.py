"""The store of a study: one SQLite file that any such tool opens, and that a kill at any moment leaves whole."""

import fcntl
import json
import os
import re
import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from cad.quantity import validation_error
from pipeline.storage.plain import Plain
from pipeline.study.study_facts import plain_json, refuse_other, study_facts
from pipeline.study.study_file import Study
from pipeline.study.tasks import LOST, PointResult

STORE = "study.sqlite"
_LOCK = "study.lock"
_APPLICATION = 0x74776E74  # twnt, the mark that SQLite keeps for whose file it is
_SCHEMA = 1
_WAIT_S = 60.0  # for another program that reads or writes the file
_AGAIN = "and run the same command again: all points before this one are kept"
_IN_USE = "a file that no other program has open", f"close it there {_AGAIN}"
_NO_ROOM = "a file that can grow", f"free some space {_AGAIN}"
_REASONS = {
    sqlite3.SQLITE_BUSY: _IN_USE,
    sqlite3.SQLITE_LOCKED: _IN_USE,
    sqlite3.SQLITE_FULL: _NO_ROOM,
    sqlite3.SQLITE_IOERR: _NO_ROOM,
}
"""What a file must be, and what to do, by the codes of SQLite's errors."""
_TABLES = """
CREATE TABLE IF NOT EXISTS study (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS points (
    number INTEGER PRIMARY KEY,
    status TEXT NOT NULL CHECK (status IN ('done', 'refused', 'failed')),
    settings TEXT NOT NULL,
    results TEXT NOT NULL,
    error TEXT,
    seconds REAL NOT NULL
);
CREATE TABLE IF NOT EXISTS audits (number INTEGER PRIMARY KEY, results TEXT NOT NULL);
"""


class StudyStore:
    """The points of a study that are solved, with what the study is; opened by one process at a time for writing."""

    def __init__(self, connection: sqlite3.Connection, path: Path) -> None:
        """Take an open connection to the file."""
        self._connection = connection
        self.path = path

    def put(self, results: Iterable[PointResult]) -> None:
        """Keep results, all of them or none."""
        rows = list(results)
        with self._connection as open_transaction:
            open_transaction.executemany(
                "INSERT OR IGNORE INTO points VALUES (?, ?, ?, ?, ?, ?)", [_row(result) for result in rows]
            )
            open_transaction.executemany(
                "INSERT OR IGNORE INTO audits VALUES (?, ?)",
                [(result.number, plain_json(result.audit)) for result in rows if result.audit is not None],
            )

    def forget_lost(self) -> None:
        """Take away the points whose workers were lost: they are solved when the study goes on."""
        with self._connection as open_transaction:
            open_transaction.execute("DELETE FROM points WHERE status = 'failed' AND error = ?", (LOST,))

    def remember(self, key: str, value: object) -> None:
        """Keep a fact of the study by its name."""
        with self._connection as open_transaction:
            open_transaction.execute("INSERT OR REPLACE INTO study VALUES (?, ?)", (key, plain_json(value)))

    def fact(self, key: str) -> Plain | None:
        """Return a fact of the study by its name; None where none is kept."""
        row = self._connection.execute("SELECT value FROM study WHERE key = ?", (key,)).fetchone()
        return None if row is None else json.loads(row[0])

    def missing(self, start: int, stop: int) -> set[int]:
        """Return the numbers from one up to, not including, another one whose points are not solved."""
        query = "SELECT number FROM points WHERE number >= ? AND number < ?"
        return set(range(start, stop)) - {number for (number,) in self._connection.execute(query, (start, stop))}

    def counts(self) -> dict[str, int]:
        """Return how many points are done, refused and failed."""
        found = dict(self._connection.execute("SELECT status, COUNT(*) FROM points GROUP BY status").fetchall())
        return {status: found.get(status, 0) for status in ("done", "refused", "failed")}

    def messages(self, most: int = 5) -> dict[str, int]:
        """Return the commonest messages of refused and failed points, and how many points have each.

        Messages that differ in their numbers alone are one, told by that of the first point.
        """
        self._connection.create_function("without_numbers", 1, _without_numbers, deterministic=True)
        query = (
            "SELECT error, COUNT(*) AS n, MIN(number) AS first FROM points WHERE error NOT NULL "
            "GROUP BY without_numbers(error) ORDER BY n DESC, first LIMIT ?"
        )
        return {error: count for error, count, _ in self._connection.execute(query, (most,))}

    def rows(self) -> Iterator[PointResult]:
        """Yield every point in the order of the numbers; one at a time is in memory."""
        yield from self._selected("ORDER BY number")

    def picked(self, numbers: Sequence[int]) -> list[PointResult]:
        """Return the points of some numbers, in that order; those that are not solved are left out."""
        marks = ", ".join("?" * len(numbers))
        found = {point.number: point for point in self._selected(f"WHERE number IN ({marks})", numbers)}
        return [found[number] for number in numbers if number in found]

    def kinds(self, key: str) -> set[str]:
        """Return the kinds of JSON values, `real` or `text` for instance, that all points have at a key."""
        query = "SELECT DISTINCT coalesce(json_type(results, ?1), json_type(settings, ?1)) FROM points"
        return {kind for (kind,) in self._connection.execute(query, (f'$."{key}"',)) if kind is not None}

    def _selected(self, which: str, values: Sequence[int] = ()) -> Iterator[PointResult]:
        query = f"SELECT points.*, audits.results FROM points LEFT JOIN audits USING (number) {which}"
        for row in self._connection.execute(query, values):
            try:
                result = _result(row)
            except json.JSONDecodeError as error:
                bound = f"as the study wrote it into {self.path}, and it is no JSON ({error})"
                remedy = "delete its row and run the same command again"
                raise validation_error("point", row[0], "", bound, remedy) from error
            yield result


def _result(row: tuple[Any, ...]) -> PointResult:
    """Return a row of the table of points with that of its audit; raises JSONDecodeError where a person edited it."""
    number, status, settings, results, error, seconds, audit = row
    return PointResult(
        number=number,
        settings=json.loads(settings),
        status=status,
        values=json.loads(results),
        error=error,
        seconds=seconds,
        audit=None if audit is None else json.loads(audit),
    )


def _without_numbers(message: str) -> str:
    return re.sub(r"\d[\d.]*(e[+-]?\d+)?", "#", message)


@contextmanager
def study_store(folder: Path, study: Study) -> Iterator[StudyStore]:
    """Open the store of a study in a folder, made where there is none, for one run at a time.

    Raises InputError where another run has it, where it holds another study, naming the difference, or where the folder
    holds anything else than a study.
    """
    _make(folder)
    path = folder / STORE
    if path.exists():
        with _opened(path) as connection:
            _refuse_foreign(connection, path)
    with _locked(folder), _opened(path) as connection:
        connection.execute(f"PRAGMA application_id = {_APPLICATION}")
        connection.execute("PRAGMA journal_mode = WAL")
        connection.executescript(_TABLES)
        store, facts = StudyStore(connection, path), study_facts(study)
        refuse_other(path, store.fact("asked"), facts)
        store.remember("asked", facts)
        store.remember("schema", _SCHEMA)
        _make_table_view(connection, study)
        if study.how != "search":  # what a search asks for next followed from them
            store.forget_lost()
        yield store


@contextmanager
def stored_study(folder: Path) -> Iterator[StudyStore]:
    """Open the store of a study for reading; raises InputError where there is none, or another file of this name."""
    path = folder / STORE
    if not path.is_file():
        raise validation_error("study store", str(path), "", "an existing file", "run the study first")
    with _opened(path) as connection:
        _refuse_foreign(connection, path)
        yield StudyStore(connection, path)


@contextmanager
def _opened(path: Path) -> Iterator[sqlite3.Connection]:
    """Give a connection; whatever SQLite has against the file, then or later, is an InputError of one line."""
    try:
        with closing(sqlite3.connect(path, timeout=_WAIT_S)) as connection:
            yield connection
    except sqlite3.DatabaseError as error:
        code = getattr(error, "sqlite_errorcode", 0) & 0xFF  # without the details of an extended code
        bound, remedy = _REASONS.get(code, ("a whole SQLite file that can be read and written", "name another --out"))
        raise validation_error("study store", str(path), "", f"{bound} ({error})", remedy) from error


def _refuse_foreign(connection: sqlite3.Connection, path: Path) -> None:
    """Raise InputError, with nothing written, where a database is neither empty nor that of a study."""
    (application,) = connection.execute("PRAGMA application_id").fetchone()
    tables = {name for (name,) in connection.execute("SELECT name FROM sqlite_master")}
    if application == 0 and not tables:
        return
    if application == _APPLICATION:  # a run that was killed at its start has left no table or no schema
        schema: object = StudyStore(connection, path).fact("schema") if "study" in tables else None
        if schema is None or schema == _SCHEMA:
            return
    bound = f"empty or the store of a study of schema {_SCHEMA}, and it is another database"
    raise validation_error("study store", str(path), "", bound, "name another --out")


def _make(folder: Path) -> None:
    try:
        if folder.exists() and not folder.is_dir():
            raise validation_error("--out", str(folder), "", "a folder, and it is a file", "name another folder")
        if folder.is_dir() and not (folder / STORE).exists() and {path.name for path in folder.iterdir()} - {_LOCK}:
            raise validation_error(
                "--out", str(folder), "", "new, empty or the folder of this study", "name another folder"
            )
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        bound = f"a folder that can be written ({error.strerror})"
        raise validation_error("--out", str(folder), "", bound, "name another folder") from error


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a study; the kernel frees it when a run is killed."""
    handle = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(handle)
        raise validation_error(
            "--out", str(folder), "", "a study that no other run writes", "wait for that run"
        ) from error
    try:
        yield
    finally:
        os.close(handle)


def _make_table_view(connection: sqlite3.Connection, study: Study) -> None:
    """Make the view `results`: a column for each key that varies and for each that is wanted."""
    columns = [(key, "settings") for key in study.vary] + [(key, "results") for key in study.wanted]
    parts = [f'json_extract({column}, \'$."{key}"\') AS "{key}"' for key, column in dict(columns).items()]
    connection.execute("DROP VIEW IF EXISTS results")
    connection.execute(f"CREATE VIEW results AS SELECT number, status, {', '.join(parts)}, error FROM points")


def _row(result: PointResult) -> tuple[int, str, str, str, str | None, float]:
    settings, values = plain_json(result.settings), plain_json(result.values)
    return result.number, result.status, settings, values, result.error, round(result.seconds, 6)
