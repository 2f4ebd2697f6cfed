"""The store of a study: one SQLite file that any such tool opens, and that a kill at any moment leaves whole.

Every row carries a digest of itself, so that what a person or a disk changed is not believed.
"""

import hashlib
import json
import re
import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from pipeline.storage.plain import Plain, to_plain
from pipeline.storage.versions import code_digest
from pipeline.study.study_file import Study
from pipeline.study.tasks import MACHINE, PointResult
from sensor.quantity import validation_error

STORE = "study.sqlite"
_LOCK = "study.lock"
_MARK = 0x74776E74  # twnt: SQLite keeps for an application whose file it is
_WAIT_S = 60.0  # for another program that reads or writes the file
_TABLES = {
    "study": "CREATE TABLE study (key TEXT PRIMARY KEY, value TEXT NOT NULL, digest TEXT NOT NULL)",
    "points": (
        "CREATE TABLE points (number INTEGER PRIMARY KEY, status TEXT NOT NULL, settings TEXT NOT NULL, "
        "results TEXT NOT NULL, error TEXT, seconds REAL NOT NULL, digest TEXT NOT NULL)"
    ),
}
_OF_MACHINE = "FROM points WHERE status = 'failed' AND error LIKE ?"
_PACKAGES = ("twintip", "numpy", "scipy", "scikit-fem", "gmsh", "cadquery")
_MOST_MESSAGES = 5
_NUMBER = re.compile(r"\d[\d.]*(e[+-]?\d+)?")
_LONGEST_VALUE = 60  # letters of a value in an error, which is one line


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
            seconds = round(result.seconds, 6)
            row = (result.number, result.status, _json(result.settings), _json(result.values), result.error, seconds)
            rows.append((*row, _digest(row)))
        with self._connection as transaction:
            transaction.executemany("INSERT OR IGNORE INTO points VALUES (?, ?, ?, ?, ?, ?, ?)", rows)

    def solved(self, start: int, stop: int) -> set[int]:
        """Return the numbers of the points from one up to, not including, another one that are solved."""
        query = "SELECT number FROM points WHERE number >= ? AND number < ?"
        return {number for (number,) in self._connection.execute(query, (start, stop))}

    def counts(self) -> dict[str, int]:
        """Return the numbers of points that are done, refused and failed."""
        counts = dict(self._connection.execute("SELECT status, COUNT(*) FROM points GROUP BY status").fetchall())
        return {status: counts.get(status, 0) for status in ("done", "refused", "failed")}

    def machine_faults(self) -> int:
        """Return the number of points that failed by a fault of the machine."""
        ((count,),) = self._connection.execute(f"SELECT COUNT(*) {_OF_MACHINE}", (f"{MACHINE}%",))
        return int(count)

    def messages(self) -> dict[str, int]:
        """Return the five commonest messages of refused and failed points, and how many points have each.

        Messages that differ in their numbers alone are one, given as that of the first point.
        """
        by_pattern: dict[str, list[str]] = {}
        for (error,) in self._connection.execute("SELECT error FROM points WHERE error NOT NULL ORDER BY number"):
            pattern = _NUMBER.sub("#", error)
            by_pattern.setdefault(pattern, []).append(error)
        commonest = sorted(by_pattern.values(), key=len, reverse=True)[:_MOST_MESSAGES]
        return {errors[0]: len(errors) for errors in commonest}

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
        """Make the tables of a study, or check that these and all their rows are its own.

        Raises InputError that names the difference, or the row.
        """
        self._connection.execute("PRAGMA journal_mode = WAL")
        with self._connection as transaction:
            transaction.execute("BEGIN")
            transaction.execute(f"PRAGMA application_id = {_MARK}")
            for table in _TABLES.values():
                transaction.execute(table.replace("TABLE", "TABLE IF NOT EXISTS", 1))
        points = sum(1 for _ in self.rows())  # each of which is checked
        asked = ("asked", _json(study_facts(study)))
        kept = self._connection.execute("SELECT * FROM study WHERE key = 'asked'").fetchone()
        if kept is not None:
            self._refuse_changed("fact 'asked'", kept)
            _, kept_facts, _ = kept
            _refuse_other(self.path, json.loads(kept_facts), json.loads(asked[1]))
        elif points:
            bound = "a store that holds the description of its study"
            raise validation_error("study store", str(self.path), "", bound, "name another --out")
        with self._connection as transaction:
            transaction.execute("INSERT OR REPLACE INTO study VALUES (?, ?, ?)", (*asked, _digest(asked)))
            transaction.execute(f"DELETE {_OF_MACHINE}", (f"{MACHINE}%",))

    def _result(self, row: Sequence[Any]) -> PointResult:
        self._refuse_changed(f"point {row[0]}", row)
        number, status, settings, values, error, seconds, _ = row
        return PointResult(
            number=number,
            settings=json.loads(settings),
            status=status,
            values=json.loads(values),
            error=error,
            seconds=seconds,
        )

    def _refuse_changed(self, name: str, row: Sequence[object]) -> None:
        """Raise InputError for a row whose last cell is not the digest of the others."""
        if row[-1] != _digest(row[:-1]):
            bound = f"as the study wrote it into {self.path}, and its digest is another"
            hint = "delete its row and run the same command again, or name another --out"
            raise validation_error("row", name, "", bound, hint)


@contextmanager
def study_store(folder: Path, study: Study) -> Iterator[StudyStore]:
    """Open the store of a study in a folder, made where there is none, for one run at a time.

    Raises InputError where another run has it, and where it holds another study, whose difference is named. It does so
    too where the folder cannot be made or holds anything else than a study.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        names = {path.name for path in folder.iterdir()}
    except OSError as error:
        bound = f"a folder that can be written ({error.strerror})"
        raise validation_error("--out", str(folder), "", bound, "name another folder") from error
    if names - {_LOCK} and STORE not in names:
        bound = "new, empty or the folder of this study"
        raise validation_error("--out", str(folder), "", bound, "name another folder")
    try:
        lock = FileLock(folder / _LOCK, timeout=0).acquire()
    except Timeout as error:
        bound = "a study that no other run writes"
        raise validation_error("--out", str(folder), "", bound, "wait for that run") from error
    with lock, _opened(folder / STORE) as store:
        store.begin(study)
        yield store


@contextmanager
def stored_study(folder: Path) -> Iterator[StudyStore]:
    """Open the store of a study that is there; raises InputError where there is none, or another file of this name."""
    path = folder / STORE
    if not path.is_file():
        raise validation_error("study store", str(path), "", "an existing file", "run the study first")
    with _opened(path) as store:
        yield store


@contextmanager
def _opened(path: Path) -> Iterator[StudyStore]:
    """Give the store in a file; whatever SQLite has against the file, then or later, is an InputError of one line.

    A database that is neither empty nor a store of just these tables and columns is refused, with nothing written.
    """
    try:
        with closing(sqlite3.connect(path, timeout=_WAIT_S)) as connection:
            (mark,) = connection.execute("PRAGMA application_id").fetchone()
            tables = dict(connection.execute("SELECT name, sql FROM sqlite_master WHERE type = 'table'").fetchall())
            if (mark, tables) not in ((0, {}), (_MARK, _TABLES)):
                bound = "empty or the store of a study, not another database"
                raise validation_error("study store", str(path), "", bound, "name another --out")
            yield StudyStore(connection, path)
    except sqlite3.Error as error:
        bound = f"a SQLite file that can be read and written ({error})"
        hint = "mend that and run the same command again, all points that ended are kept; or name another --out"
        raise validation_error("study store", str(path), "", bound, hint) from error


def study_facts(study: Study) -> Plain:
    """Return the facts that decide the results of a study: all of it but its name."""
    facts: Plain = to_plain(study)
    del facts["name"]
    facts["base"] = {**study.base.tables, "own processes": study.base.own}
    packages = {name: version(name) for name in _PACKAGES}
    return {**facts, "order": list(study.vary), "versions": packages, "code": code_digest()[:16]}


def _refuse_other(path: Path, kept: Plain, asked: Plain) -> None:
    """Raise InputError that names the difference where a store holds another study; a longer one may go on.

    The points of a longer study begin with those of the shorter one, but not those of sensitivities, whose numbers
    count blocks of `samples`.
    """
    growing = ("goal.evaluations",) if asked["how"] == "sensitivity" else ("goal.evaluations", "samples")
    before = _leaves("", kept)
    now = _leaves("", asked)
    for key in {**before, **now}:
        if before.get(key) == now.get(key) or (key in growing and now[key] > before[key]):
            continue
        bound = f"{_json(before.get(key))[:_LONGEST_VALUE]}, as in {path}"
        raise validation_error(key, _json(now.get(key)), "", bound, "change it back, or name another --out")


def _leaves(name: str, data: object) -> Plain:
    """Return the values in nested tables by their dotted names."""
    if not isinstance(data, dict):
        return {name: data}
    leaves: Plain = {}
    for key, value in data.items():
        leaves |= _leaves(f"{name}.{key}".strip("."), value)
    return leaves


def _json(value: object) -> str:
    """Return plain data as JSON; raises TypeError for anything else, ValueError for a number not finite."""
    return json.dumps(value, allow_nan=False, default=dict)


def _digest(cells: Sequence[object]) -> str:
    return hashlib.sha256(repr(tuple(cells)).encode()).hexdigest()[:32]
