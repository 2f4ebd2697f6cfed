"""The store of a study: one SQLite file that any SQLite tool opens, and that a kill at any moment leaves intact."""

import json
import re
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from importlib.metadata import version
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock, Timeout

from pipeline.storage.plain import Plain, to_plain
from pipeline.storage.versions import code_digest
from pipeline.study.points import Point
from pipeline.study.study_file import Study
from pipeline.study.tasks import MACHINE, PointResult
from pipeline.study.variation import Setting
from sensor.arrays import Floats
from sensor.quantity import validation_error

STORE = "study.sqlite"
_LOCK = "study.lock"
_MARK = 0x74776E74  # "twnt": SQLite reserves this number to identify the application of a file
_WAIT_S = 60.0  # time to wait for another program that reads or writes the file
_TABLES = {
    "study": "CREATE TABLE study (key TEXT PRIMARY KEY, value TEXT NOT NULL)",
    "points": (
        "CREATE TABLE points (number INTEGER PRIMARY KEY, status TEXT NOT NULL, "
        "settings TEXT NOT NULL CHECK (json_valid(settings)), results TEXT NOT NULL CHECK (json_valid(results)), "
        "error TEXT, seconds REAL NOT NULL)"
    ),
}
_OF_MACHINE = "FROM points WHERE status = 'failed' AND error LIKE ?"
_OF_KEY = """
WITH
    done AS (
        SELECT number, iif(json_type(results, :path) IS NULL, settings, results) AS told
        FROM points WHERE status = 'done'
    ),
    of_key AS (SELECT number, json_type(told, :path) AS kind, json_extract(told, :path) AS value FROM done),
    numbers AS (SELECT number, iif(kind IN ('integer', 'real'), value, NULL) AS value FROM of_key)
"""
"""For each point that is done: its number, and its value of a key, as any value and as a number."""
_PACKAGES = ("twintip", "numpy", "scipy", "scikit-fem", "gmsh", "cadquery")
_MOST_MESSAGES = 5
_NUMBER = re.compile(r"\d[\d.]*(e[+-]?\d+)?")
_LONGEST_VALUE = 60  # longest value in an error, which is one line [characters]
_ROUND_OFF = 1e-12  # relative difference of numbers that is round-off


class StudyStore:
    """The solved points of a study, with the facts that define it; one process at a time writes to it."""

    def __init__(self, connection: sqlite3.Connection, path: Path) -> None:
        """Store an open connection to the file."""
        self._connection = connection
        self.path = path

    def put(self, results: Iterable[PointResult]) -> None:
        """Store results, all of them or none."""
        rows = []
        for result in results:
            seconds = round(result.seconds, 6)
            row = (result.number, result.status, _json(result.settings), _json(result.values), result.error, seconds)
            rows.append(row)
        with self._connection as transaction:
            transaction.executemany("INSERT OR IGNORE INTO points VALUES (?, ?, ?, ?, ?, ?)", rows)

    def numbers(self) -> set[int]:
        """Return the numbers of all solved points."""
        return {number for (number,) in self._connection.execute("SELECT number FROM points")}

    def done(self) -> list[int]:
        """Return the numbers of the points that are done, in order."""
        query = "SELECT number FROM points WHERE status = 'done' ORDER BY number"
        return [number for (number,) in self._connection.execute(query)]

    def lacking(self, asked: Iterable[Mapping[str, Setting]]) -> list[Point]:
        """Return the settings without a point, each once, as points with the lowest free numbers."""
        by_text = {settings_text(settings): settings for settings in asked}
        known = {text for (text,) in self._connection.execute("SELECT settings FROM points")}
        taken = self.numbers()
        free = (number for number in count() if number not in taken)
        new = [settings for text, settings in by_text.items() if text not in known]
        return [Point(number=number, settings=settings) for settings, number in zip(new, free, strict=False)]

    def results(self, asked: Iterable[Mapping[str, Setting]]) -> list[PointResult]:
        """Return the point of each of some settings, all of which are solved."""
        texts = list(map(settings_text, asked))
        query = "SELECT settings, points.* FROM points WHERE settings IN (SELECT value FROM json_each(?))"
        found = {text: _result(row) for text, *row in self._connection.execute(query, (json.dumps(texts),))}
        return [found[text] for text in texts]

    def rows(self, numbers: Sequence[int] | None = None) -> Iterator[PointResult]:
        """Yield points by their numbers in the given order, all by default, one at a time in memory."""
        if numbers is None:
            rows = self._connection.execute("SELECT * FROM points ORDER BY number")
        else:
            query = "SELECT points.* FROM json_each(?) JOIN points ON number = value ORDER BY key"
            rows = self._connection.execute(query, (json.dumps(numbers),))
        yield from map(_result, rows)

    @property
    def wanted(self) -> tuple[str, ...]:
        """Return the keys that the study wants of each point."""
        return self._names("wanted")

    @property
    def keys(self) -> tuple[str, ...]:
        """Return the varied and the wanted keys, each once."""
        return tuple(dict.fromkeys((*self._names("order"), *self.wanted)))

    def _names(self, fact: str) -> tuple[str, ...]:
        ((names,),) = self._connection.execute("SELECT value FROM study WHERE key = ?", (fact,))
        return tuple(json.loads(names))

    def counts(self) -> dict[str, int]:
        """Return the numbers of points that are done, refused and failed."""
        counts = dict(self._connection.execute("SELECT status, COUNT(*) FROM points GROUP BY status").fetchall())
        return {status: counts.get(status, 0) for status in ("done", "refused", "failed")}

    def machine_faults(self) -> int:
        """Return the number of points that failed by a fault of the machine."""
        ((faults,),) = self._connection.execute(f"SELECT COUNT(*) {_OF_MACHINE}", (f"{MACHINE}%",))
        return int(faults)

    def messages(self) -> dict[str, int]:
        """Return the five most frequent messages of refused and failed points, with their frequencies.

        Messages that differ only in their numbers are one, represented by the first point's.
        """
        by_pattern: dict[str, list[str]] = {}
        for (error,) in self._connection.execute("SELECT error FROM points WHERE error NOT NULL ORDER BY number"):
            pattern = _NUMBER.sub("#", error)
            by_pattern.setdefault(pattern, []).append(error)
        commonest = sorted(by_pattern.values(), key=len, reverse=True)[:_MOST_MESSAGES]
        return {errors[0]: len(errors) for errors in commonest}

    def column(self, key: str) -> Floats:
        """Return the numbers of a key [its unit] for all points that are done, in order; nan for a missing number."""
        values = self._of_key(key, "SELECT value FROM numbers ORDER BY number")
        return np.array([value for (value,) in values], dtype=np.float64)

    def span(self, key: str) -> tuple[float, float] | None:
        """Return the least and the largest number of a key [its unit]; None if no point has a number."""
        ((low, high),) = self._of_key(key, "SELECT MIN(value), MAX(value) FROM numbers")
        return None if low is None else (low, high)

    def differs(self, key: str) -> bool:
        """Return whether the values of a key are numbers that differ by more than round-off."""
        low, high = self.span(key) or (0.0, 0.0)
        return high - low > _ROUND_OFF * max(abs(low), abs(high))

    def best(self, key: str, most: int) -> list[int]:
        """Return the numbers of the points with the least values of a key, least first, missing values last."""
        query = "SELECT number FROM numbers ORDER BY value NULLS LAST, number LIMIT :most"
        return [number for (number,) in self._of_key(key, query, most=most)]

    def words(self, key: str) -> dict[str | bool, int]:
        """Return the texts and truth values of a key, with the number of points for each."""
        query = "SELECT kind, value, COUNT(*) FROM of_key WHERE kind IN ('text', 'true', 'false') GROUP BY kind, value"
        counts = self._of_key(key, query)
        return {value if kind == "text" else kind == "true": points for kind, value, points in counts}

    def _of_key(self, key: str, query: str, **values: object) -> sqlite3.Cursor:
        return self._connection.execute(f"{_OF_KEY} {query}", {"path": f'$."{key}"', **values})

    def begin(self, study: Study) -> None:
        """Create the tables of a study, or check that they belong to it; raises InputError, which names the difference.

        Points that failed by a fault of the machine are deleted.
        """
        self._connection.execute("PRAGMA journal_mode = WAL")
        asked = {key: _json(value) for key, value in study_facts(study).items()}
        with self._connection as transaction:
            transaction.execute("BEGIN IMMEDIATE")
            if _is_empty(transaction):
                transaction.execute(f"PRAGMA application_id = {_MARK}")
                for table in _TABLES.values():
                    transaction.execute(table)
            else:
                kept = dict(transaction.execute("SELECT key, value FROM study").fetchall())
                _refuse_other(self.path, kept, asked)
            transaction.executemany("INSERT OR REPLACE INTO study VALUES (?, ?)", asked.items())
            transaction.execute(f"DELETE {_OF_MACHINE}", (f"{MACHINE}%",))


@contextmanager
def study_store(folder: Path, study: Study) -> Iterator[StudyStore]:
    """Open the store of a study in a folder for one run at a time; it is created if there is none.

    Raises InputError if another run uses it, and if it holds another study, whose difference is named. It also refuses
    a folder that cannot be created or holds something else.
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
    """Open the store of an existing study; raises InputError if there is none, or another file has its name."""
    path = folder / STORE
    if not path.is_file():
        raise validation_error("study store", str(path), "", "an existing file", "run the study first")
    with _opened(path) as store:
        yield store


@contextmanager
def _opened(path: Path) -> Iterator[StudyStore]:
    """Yield the store in a file; all SQLite errors about the file become one-line InputErrors.

    A database that is neither empty nor a store with exactly these tables is refused without writing.
    """
    try:
        with closing(sqlite3.connect(path, timeout=_WAIT_S)) as connection:
            if not _is_empty(connection):
                _refuse_foreign(connection, path)
            yield StudyStore(connection, path)
    except sqlite3.Error as error:
        bound = f"a SQLite file that can be read and written ({error})"
        hint = "mend that and run the same command again, all points that ended are kept; or name another --out"
        raise validation_error("study store", str(path), "", bound, hint) from error


def _is_empty(connection: sqlite3.Connection) -> bool:
    """Return whether a database has neither tables nor the mark of an application."""
    (mark,) = connection.execute("PRAGMA application_id").fetchone()
    return mark == 0 and connection.execute("SELECT 1 FROM sqlite_master").fetchone() is None


def _refuse_foreign(connection: sqlite3.Connection, path: Path) -> None:
    """Raise InputError for a database that is no store, and for a store of another version."""
    (mark,) = connection.execute("PRAGMA application_id").fetchone()
    tables = dict(connection.execute("SELECT name, sql FROM sqlite_master WHERE type = 'table'").fetchall())
    if mark != _MARK:
        raise validation_error(
            "study store", str(path), "", "empty or the store of a study, not another database", "name another --out"
        )
    if tables != _TABLES:
        bound = "the store of a study of this version, with its tables as they were made"
        raise validation_error("study store", str(path), "", bound, "name another --out")


def study_facts(study: Study) -> Plain:
    """Return the facts that determine the results of a study, by dotted names; only its name does not."""
    facts: Plain = to_plain(study)
    del facts["name"]
    facts["base"] = {**study.base.tables, "own processes": study.base.own}
    packages = {name: version(name) for name in _PACKAGES}
    return _leaves("", {**facts, "order": list(study.vary), "versions": packages, "code": code_digest()[:16]})


def _refuse_other(path: Path, kept: Mapping[str, str], asked: Mapping[str, str]) -> None:
    """Raise InputError, which names the difference, if a store holds another study; a longer one may continue.

    A longer study begins with the points of the shorter one, except for sensitivities, whose points SciPy draws.
    """
    growing = ("goal.evaluations",) if asked["how"] == '"sensitivity"' else ("goal.evaluations", "samples")
    for key in {**kept, **asked}:
        before, now = (json.loads(facts.get(key, "null")) for facts in (kept, asked))
        if before == now or (key in growing and before is not None and now > before):
            continue
        bound = f"{_json(before)[:_LONGEST_VALUE]}, as in {path}"
        raise validation_error(key, _json(now), "", bound, "change it back, or name another --out")


def settings_text(settings: Mapping[str, Setting]) -> str:
    """Return settings as stored text; points with the same text are the same design."""
    return _json(settings)


def _leaves(name: str, data: object) -> Plain:
    """Return the values in nested tables by dotted names."""
    if not isinstance(data, Mapping):
        return {name: data}
    leaves: Plain = {}
    for key, value in data.items():
        leaves |= _leaves(f"{name}.{key}".strip("."), value)
    return leaves


def _result(row: Sequence[Any]) -> PointResult:
    """Return the point of a table row."""
    number, status, settings, values, error, seconds = row
    return PointResult(
        number=number,
        settings=json.loads(settings),
        status=status,
        values=json.loads(values),
        error=error,
        seconds=seconds,
    )


def _json(value: object) -> str:
    """Return plain data as JSON; raises TypeError for other data, ValueError for a number that is not finite."""
    return json.dumps(value, allow_nan=False, default=dict)
