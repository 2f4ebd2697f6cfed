"""The store of a study: one SQLite file that any such tool opens, and that a kill at any moment leaves whole.

Every row carries a digest of itself, so that what a person or a disk changed is not believed.
"""

import hashlib
import json
import re
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from cad.quantity import validation_error
from pipeline.storage.plain import Plain, to_plain
from pipeline.storage.versions import code_digest
from pipeline.study.study_file import Study
from pipeline.study.tasks import LOST, PointResult

STORE = "study.sqlite"
_LOCK = "study.lock"
_APPLICATION = 0x74776E74  # twnt, the mark that SQLite keeps for whose file it is
_SCHEMA = 2
_WAIT_S = 60.0  # for another program that reads or writes the file
_TABLES = {
    "study": "key TEXT PRIMARY KEY, value TEXT NOT NULL, digest TEXT NOT NULL",
    "points": (
        "number INTEGER PRIMARY KEY, status TEXT NOT NULL, settings TEXT NOT NULL, results TEXT NOT NULL, "
        "audit TEXT, error TEXT, seconds REAL NOT NULL, digest TEXT NOT NULL"
    ),
}
_PACKAGES = ("twintip", "numpy", "scipy", "scikit-fem", "gmsh", "cadquery")
_AGAIN = "and run the same command again: all points before this one are kept"
_IN_USE = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)
_NO_ROOM = (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR)


class StudyStore:
    """The points of a study that are solved, with what the study is; opened by one process at a time for writing."""

    def __init__(self, connection: sqlite3.Connection, path: Path) -> None:
        """Take an open connection to the file."""
        self._connection = connection
        self.path = path

    def put(self, results: Iterable[PointResult]) -> None:
        """Keep results, all of them or none."""
        rows = []
        for result in results:
            audit = None if result.audit is None else _json(result.audit)
            settings = _json(result.settings)
            values = _json(result.values)
            seconds = round(result.seconds, 6)
            row = (result.number, result.status, settings, values, audit, result.error, seconds)
            rows.append((*row, _digest(row)))
        with self._connection as transaction:
            transaction.executemany("INSERT OR IGNORE INTO points VALUES (?, ?, ?, ?, ?, ?, ?, ?)", rows)

    def remember(self, key: str, value: object) -> None:
        """Keep a fact of the study by its name."""
        row = (key, _json(value))
        with self._connection as transaction:
            transaction.execute("INSERT OR REPLACE INTO study VALUES (?, ?, ?)", (*row, _digest(row)))

    def fact(self, key: str) -> Any:  # noqa: ANN401 - JSON data of any kind
        """Return a fact of the study by its name; None where none is kept. Raises InputError where it was changed."""
        row = self._connection.execute("SELECT key, value, digest FROM study WHERE key = ?", (key,)).fetchone()
        if row is None:
            return None
        self._check_digest(f"fact {key!r}", row)
        return json.loads(row[1])

    def missing(self, start: int, stop: int) -> set[int]:
        """Return the numbers from one up to, not including, another one whose points are not solved."""
        query = "SELECT number FROM points WHERE number >= ? AND number < ?"
        return set(range(start, stop)) - {number for (number,) in self._connection.execute(query, (start, stop))}

    def counts(self) -> dict[str, int]:
        """Return how many points are done, refused and failed."""
        counts = dict(self._connection.execute("SELECT status, COUNT(*) FROM points GROUP BY status").fetchall())
        return {status: counts.get(status, 0) for status in ("done", "refused", "failed")}

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

    def rows(self, numbers: Sequence[int] | None = None) -> Iterator[PointResult]:
        """Yield the points of some numbers in that order, all by default in their own, one at a time in memory.

        Raises InputError for a row that is not as the study wrote it.
        """
        if numbers is None:
            yield from map(self._result, self._connection.execute("SELECT * FROM points ORDER BY number"))
            return
        for number in numbers:
            yield from map(self._result, self._connection.execute("SELECT * FROM points WHERE number = ?", (number,)))

    def begin(self, study: Study) -> None:
        """Make the tables of a study, or check that these are its own; raises InputError that names the difference."""
        execute = self._connection.execute
        execute(f"PRAGMA application_id = {_APPLICATION}")
        execute("PRAGMA journal_mode = WAL")
        for name, columns in _TABLES.items():
            execute(f"CREATE TABLE IF NOT EXISTS {name} ({columns})")
        facts = json.loads(_json(study_facts(study)))
        kept = self.fact("asked")
        if kept is None and max(self.counts().values()) > 0:
            bound = "whole, and what the study is was taken out of it"
            raise validation_error("study store", str(self.path), "", bound, "name another --out")
        if kept is not None:
            _refuse_other(self.path, kept, facts)
        self.remember("asked", facts)
        self._make_view(study)
        if study.how != "search":  # what a search asks for next followed from them
            with self._connection as transaction:
                transaction.execute("DELETE FROM points WHERE status = 'failed' AND error = ?", (LOST,))

    def _make_view(self, study: Study) -> None:
        """Make the view `results`: a column for each key that varies and for each that is wanted."""
        parts = [f'json_extract(settings, \'$."{key}"\') AS "{key}"' for key in study.vary]
        parts += [f'json_extract(results, \'$."{key}"\') AS "{key}"' for key in study.wanted if key not in study.vary]
        self._connection.execute("DROP VIEW IF EXISTS results")
        self._connection.execute(f"CREATE VIEW results AS SELECT number, status, {', '.join(parts)}, error FROM points")

    def _result(self, row: Sequence[Any]) -> PointResult:
        self._check_digest(f"point {row[0]}", row)
        number, status, settings, values, audit, error, seconds, _ = row
        return PointResult(
            number=number,
            settings=json.loads(settings),
            status=status,
            values=json.loads(values),
            error=error,
            seconds=seconds,
            audit=None if audit is None else json.loads(audit),
        )

    def _check_digest(self, name: str, row: Sequence[object]) -> None:
        if row[-1] != _digest(row[:-1]):
            bound = f"as the study wrote it into {self.path}, and its digest is another"
            hint = "delete its row and run the same command again, or name another --out"
            raise validation_error("row", name, "", bound, hint)


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
    try:
        lock = FileLock(folder / _LOCK, timeout=0).acquire()
    except Timeout as error:
        bound = "a study that no other run writes"
        raise validation_error("--out", str(folder), "", bound, "wait for that run") from error
    with lock, _opened(path) as connection:
        store = StudyStore(connection, path)
        store.begin(study)
        yield store


@contextmanager
def stored_study(folder: Path) -> Iterator[StudyStore]:
    """Open the store of a study that is there; raises InputError where there is none, or another file of this name."""
    path = folder / STORE
    if not path.is_file():
        raise validation_error("study store", str(path), "", "an existing file", "run the study first")
    with _opened(path) as connection:
        _refuse_foreign(connection, path)
        yield StudyStore(connection, path)


def study_facts(study: Study) -> Plain:
    """Return what decides the results of a study."""
    names = ("base", "wanted", "how", "samples", "seed", "tol", "level", "contact", "audit", "rows")
    return {
        **{name: getattr(study, name) for name in names},
        "vary": {key: {"kind": type(varied).__name__, **asdict(varied)} for key, varied in study.vary.items()},
        "order": list(study.vary),
        "goal": to_plain(study.goal),
        "versions": {name: version(name) for name in _PACKAGES},
        "code": code_digest()[:16],
    }


def _refuse_other(path: Path, kept: Plain, asked: Plain) -> None:
    """Raise InputError that names the difference where a store holds another study; a longer one may go on.

    The points of a longer study begin with those of the shorter one, but not those of sensitivities, whose numbers
    count blocks of `samples`.
    """
    growing = ("goal.evaluations",) if asked["how"] == "sensitivity" else ("goal.evaluations", "samples")
    for key, before, now in _differences("", kept, asked):
        if key not in growing or now < before:
            bound = f"{_short(before)}, as in {path}"
            raise validation_error(key, _short(now), "", bound, "change it back, or name another --out")


def _differences(path: str, before: Any, now: Any) -> Iterator[tuple[str, Any, Any]]:  # noqa: ANN401 - JSON data
    """Yield each dotted path where two trees of plain data differ, with both values; None stands for nothing there."""
    if isinstance(before, dict) and isinstance(now, dict):
        for key in {**before, **now}:
            yield from _differences(f"{path}.{key}".strip("."), before.get(key), now.get(key))
    elif before != now:
        yield path, before, now


def _short(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."  # noqa: PLR2004 - of one line


def _json(value: object) -> str:
    """Return a value as JSON; raises TypeError for what is no plain data, ValueError for a number not finite."""
    return json.dumps(value, allow_nan=False, default=_as_dict)


def _as_dict(value: object) -> object:
    if isinstance(value, Mapping):
        return dict(value)
    msg = f"{type(value).__name__}: must be plain data; turn it into some first"
    raise TypeError(msg)


def _digest(cells: Sequence[object]) -> str:
    return hashlib.sha256(repr(tuple(cells)).encode()).hexdigest()[:32]


def _without_numbers(message: str) -> str:
    return re.sub(r"\d[\d.]*(e[+-]?\d+)?", "#", message)


@contextmanager
def _opened(path: Path) -> Iterator[sqlite3.Connection]:
    """Give a connection; whatever SQLite has against the file, then or later, is an InputError of one line."""
    try:
        with closing(sqlite3.connect(path, timeout=_WAIT_S)) as connection:
            yield connection
    except sqlite3.Error as error:
        code = getattr(error, "sqlite_errorcode", 0) & 0xFF  # without the details of an extended code
        bound = "a whole SQLite file that can be read and written"
        hint = "name another --out"
        if code in _IN_USE:
            bound = "a file that no other program has open"
            hint = f"close it there {_AGAIN}"
        elif code in _NO_ROOM:
            bound = "a file that can grow"
            hint = f"free some space {_AGAIN}"
        raise validation_error("study store", str(path), "", f"{bound} ({error})", hint) from error


def _refuse_foreign(connection: sqlite3.Connection, path: Path) -> None:
    """Raise InputError, with nothing written, where a database is neither empty nor a store of just these columns."""
    (application,) = connection.execute("PRAGMA application_id").fetchone()
    tables = [name for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
    ours = application == _APPLICATION or not (application or tables)
    for table in tables:
        columns = [row[1] for row in connection.execute(f'PRAGMA table_info("{table}")')]
        declared = [column.split()[0] for column in _TABLES.get(table, "").split(", ")] if table in _TABLES else []
        ours = ours and columns == declared
    if not ours:
        bound = f"empty or the store of a study of schema {_SCHEMA}, and it is another database"
        raise validation_error("study store", str(path), "", bound, "name another --out")


def _make(folder: Path) -> None:
    try:
        if folder.exists() and not folder.is_dir():
            raise validation_error("--out", str(folder), "", "a folder, and it is a file", "name another folder")
        if folder.is_dir() and not (folder / STORE).exists() and {path.name for path in folder.iterdir()} - {_LOCK}:
            bound = "new, empty or the folder of this study"
            raise validation_error("--out", str(folder), "", bound, "name another folder")
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        bound = f"a folder that can be written ({error.strerror})"
        raise validation_error("--out", str(folder), "", bound, "name another folder") from error
