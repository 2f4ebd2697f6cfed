"""The store of a study: a single SQLite file, which remains intact even if the process is killed."""

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
_APPLICATION_ID = 0x74776E74  # "twnt"; SQLite stores this number in a file to identify the application that wrote it
_WAIT_S = 60.0  # maximum time to wait for another program that reads or writes the file [s]
_TABLES = {
    "study": "CREATE TABLE study (key TEXT PRIMARY KEY, value TEXT NOT NULL)",
    "points": (
        "CREATE TABLE points (number INTEGER PRIMARY KEY, status TEXT NOT NULL, "
        "settings TEXT NOT NULL CHECK (json_valid(settings)), results TEXT NOT NULL CHECK (json_valid(results)), "
        "error TEXT, seconds REAL NOT NULL)"
    ),
}
_FROM_MACHINE_FAULTS = "FROM points WHERE status = 'failed' AND error LIKE ?"  # end of two queries
_KEY_VALUES = """
WITH
    done AS (
        SELECT number, iif(json_type(results, :path) IS NULL, settings, results) AS record
        FROM points WHERE status = 'done'
    ),
    entries AS (SELECT number, json_type(record, :path) AS kind, json_extract(record, :path) AS value FROM done),
    numbers AS (SELECT number, iif(kind IN ('integer', 'real'), value, NULL) AS value FROM entries)
"""
"""Beginning of a query for the values of one key.

The value is taken from the results of a point, or from its settings if the results lack the key. The query provides two
tables with a row for each point that is done. `entries` has any value and its type. In `numbers`, a value that is not a
number is NULL.
"""
_PACKAGES = ("twintip", "numpy", "scipy", "scikit-fem", "gmsh", "cadquery")
_MAX_MESSAGES = 5  # maximum number of messages that the page of a study lists
_NUMBER = re.compile(r"\d[\d.]*(e[+-]?\d+)?")
_MAX_VALUE_LENGTH = 60  # maximum length of a value in a one-line error message [characters]
_ROUND_OFF = 1e-12  # largest relative difference of two numbers that is attributed to round-off


class StudyStore:
    """The stored points of a study, and the facts that define the study. Only one process at a time may write to it."""

    def __init__(self, connection: sqlite3.Connection, path: Path) -> None:
        """Keep an open connection to the SQLite file at `path`."""
        self._connection = connection
        self.path = path

    def put(self, results: Iterable[PointResult]) -> None:
        """Store all results in one transaction, so that either all or none of them are stored.

        A result is ignored if a point with its number is already stored.
        """
        rows = []
        for result in results:
            seconds = round(result.seconds, 6)
            row = (result.number, result.status, _json(result.settings), _json(result.values), result.error, seconds)
            rows.append(row)
        with self._connection as transaction:
            transaction.executemany("INSERT OR IGNORE INTO points VALUES (?, ?, ?, ?, ?, ?)", rows)

    def numbers(self) -> set[int]:
        """Return the numbers of all stored points."""
        return {number for (number,) in self._connection.execute("SELECT number FROM points")}

    def done(self) -> list[int]:
        """Return the numbers of the points with the status "done", in ascending order."""
        query = "SELECT number FROM points WHERE status = 'done' ORDER BY number"
        return [number for (number,) in self._connection.execute(query)]

    def missing_points(self, designs: Iterable[Mapping[str, Setting]]) -> list[Point]:
        """Return a new point for each design that is not stored yet, without duplicates.

        Each design is given by its settings. The new points get the lowest unused numbers.
        """
        settings_by_text = {settings_text(settings): settings for settings in designs}
        stored_texts = {text for (text,) in self._connection.execute("SELECT settings FROM points")}
        new_settings = [settings for text, settings in settings_by_text.items() if text not in stored_texts]
        used_numbers = self.numbers()
        unused_numbers = (number for number in count() if number not in used_numbers)  # unlimited
        pairs = zip(new_settings, unused_numbers, strict=False)  # ends with the last new settings
        return [Point(number=number, settings=settings) for settings, number in pairs]

    def results(self, designs: Iterable[Mapping[str, Setting]]) -> list[PointResult]:
        """Return the stored point of each design, given by its settings; raises KeyError if a design is not stored."""
        texts = list(map(settings_text, designs))
        query = "SELECT settings, points.* FROM points WHERE settings IN (SELECT value FROM json_each(?))"
        points = {text: _point_of_row(row) for text, *row in self._connection.execute(query, (json.dumps(texts),))}
        return [points[text] for text in texts]

    def rows(self, numbers: Sequence[int] | None = None) -> Iterator[PointResult]:
        """Yield the points with the given numbers in their order, or all points; only one is in memory at a time."""
        if numbers is None:
            rows = self._connection.execute("SELECT * FROM points ORDER BY number")
        else:
            query = "SELECT points.* FROM json_each(?) JOIN points ON number = value ORDER BY key"
            rows = self._connection.execute(query, (json.dumps(numbers),))
        yield from map(_point_of_row, rows)

    @property
    def wanted(self) -> tuple[str, ...]:
        """Return the keys of the requested outputs, which are stored for each point."""
        return self._names("wanted")

    @property
    def keys(self) -> tuple[str, ...]:
        """Return the varied keys and the keys of the requested outputs, without duplicates."""
        return tuple(dict.fromkeys((*self._names("order"), *self.wanted)))

    def _names(self, fact: str) -> tuple[str, ...]:
        """Return the list of keys that is stored as a fact of the study."""
        ((names,),) = self._connection.execute("SELECT value FROM study WHERE key = ?", (fact,))
        return tuple(json.loads(names))

    def counts(self) -> dict[str, int]:
        """Return the number of points with each status: done, refused and failed."""
        counts = dict(self._connection.execute("SELECT status, COUNT(*) FROM points GROUP BY status").fetchall())
        return {status: counts.get(status, 0) for status in ("done", "refused", "failed")}

    def machine_faults(self) -> int:
        """Return the number of points that failed because of a machine fault, such as a lost worker."""
        ((faults,),) = self._connection.execute(f"SELECT COUNT(*) {_FROM_MACHINE_FAULTS}", (f"{MACHINE}%",))
        return int(faults)

    def messages(self) -> dict[str, int]:
        """Return the most frequent messages of refused and failed points, each with its number of points.

        At most `_MAX_MESSAGES` messages are returned, the most frequent one first. Messages that differ only in their
        numbers are counted together, and the first of them represents the others.
        """
        errors_by_pattern: dict[str, list[str]] = {}  # the pattern is the message with # instead of each number
        for (error,) in self._connection.execute("SELECT error FROM points WHERE error NOT NULL ORDER BY number"):
            pattern = _NUMBER.sub("#", error)
            errors_by_pattern.setdefault(pattern, []).append(error)
        most_frequent = sorted(errors_by_pattern.values(), key=len, reverse=True)[:_MAX_MESSAGES]
        return {errors[0]: len(errors) for errors in most_frequent}

    def column(self, key: str) -> Floats:
        """Return the values of a key [unit of the key] for all points that are done, in the order of the points.

        The value is NaN if a point has no number for the key.
        """
        values = self._query_key(key, "SELECT value FROM numbers ORDER BY number")
        return np.array([value for (value,) in values], dtype=np.float64)

    def span(self, key: str) -> tuple[float, float] | None:
        """Return the smallest and the largest value of a key [unit of the key]; None if no point has a number."""
        ((low, high),) = self._query_key(key, "SELECT MIN(value), MAX(value) FROM numbers")
        return None if low is None else (low, high)

    def differs(self, key: str) -> bool:
        """Return whether the values of a key differ between the points by more than round-off."""
        low, high = self.span(key) or (0.0, 0.0)
        return high - low > _ROUND_OFF * max(abs(low), abs(high))

    def best(self, key: str, max_count: int) -> list[int]:
        """Return the numbers of up to `max_count` points with the smallest values of a key, the smallest value first.

        Points without a value come last.
        """
        query = "SELECT number FROM numbers ORDER BY value NULLS LAST, number LIMIT :max_count"
        return [number for (number,) in self._query_key(key, query, max_count=max_count)]

    def text_counts(self, key: str) -> dict[str | bool, int]:
        """Return the string and Boolean values of a key, and the number of points with each value."""
        query = "SELECT kind, value, COUNT(*) FROM entries WHERE kind IN ('text', 'true', 'false') GROUP BY kind, value"
        counts = self._query_key(key, query)
        return {value if kind == "text" else kind == "true": points for kind, value, points in counts}

    def _query_key(self, key: str, query: str, **values: object) -> sqlite3.Cursor:
        """Run a query on the tables `entries` and `numbers` for a key; `values` are the query's named parameters."""
        return self._connection.execute(f"{_KEY_VALUES} {query}", {"path": f'$."{key}"', **values})

    def prepare(self, study: Study) -> None:
        """Create the tables of a study in an empty file, or check that an existing file belongs to this study.

        The facts of the study are stored, because a longer study may have more points than before. Points that failed
        because of a machine fault are deleted, so that they are solved again. Raises InputError if the file belongs to
        another study; the message names the first difference.
        """
        self._connection.execute("PRAGMA journal_mode = WAL")  # other programs can read the file while a run writes
        facts = {key: _json(value) for key, value in study_facts(study).items()}
        with self._connection as transaction:
            transaction.execute("BEGIN IMMEDIATE")  # no other program can write between the check and the insertion
            if _is_empty(transaction):
                transaction.execute(f"PRAGMA application_id = {_APPLICATION_ID}")
                for table in _TABLES.values():
                    transaction.execute(table)
            else:
                stored_facts = dict(transaction.execute("SELECT key, value FROM study").fetchall())
                _check_same_study(self.path, stored_facts, facts)
            transaction.executemany("INSERT OR REPLACE INTO study VALUES (?, ?)", facts.items())
            transaction.execute(f"DELETE {_FROM_MACHINE_FAULTS}", (f"{MACHINE}%",))


@contextmanager
def study_store(folder: Path, study: Study) -> Iterator[StudyStore]:
    """Open the store of a study in a folder, or create it if there is none; only one run at a time can use it.

    Raises InputError if another run is using the folder, if the folder cannot be created, or if it contains other
    files. If the folder contains a different study, InputError is raised too, and the message names the first
    difference.
    """
    _make_folder(folder)
    try:
        lock = FileLock(folder / _LOCK, timeout=0).acquire()
    except Timeout as error:
        bound = "a study that no other run is writing"
        raise validation_error("--out", str(folder), "", bound, "wait until the other run has finished") from error
    with lock, _open_store(folder / STORE) as store:
        store.prepare(study)
        yield store


def _make_folder(folder: Path) -> None:
    """Create the folder of a study if it does not exist.

    Raises InputError if this is not possible, or if the folder contains files but no study.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        names = {path.name for path in folder.iterdir()}
    except OSError as error:
        bound = f"a folder that can be written ({error.strerror})"
        raise validation_error("--out", str(folder), "", bound, "choose another folder") from error
    if names - {_LOCK} and STORE not in names:  # a run that was killed early leaves only the lock
        bound = "new, empty or the folder of this study"
        raise validation_error("--out", str(folder), "", bound, "choose another folder")


@contextmanager
def stored_study(folder: Path) -> Iterator[StudyStore]:
    """Open the store of an existing study; raises InputError if the folder contains no valid store."""
    path = folder / STORE
    if not path.is_file():
        raise validation_error("study store", str(path), "", "an existing file", "run the study first")
    with _open_store(path) as store:
        yield store


@contextmanager
def _open_store(path: Path) -> Iterator[StudyStore]:
    """Open the store in a file; any SQLite error is raised as a one-line InputError.

    A database is rejected with InputError unless it is empty or a store with exactly the tables of this version. The
    check comes before the first write, so a database of another program is never changed.
    """
    try:
        with closing(sqlite3.connect(path, timeout=_WAIT_S)) as connection:
            if not _is_empty(connection):
                _check_is_store(connection, path)
            yield StudyStore(connection, path)
    except sqlite3.Error as error:
        bound = f"a SQLite file that can be read and written ({error})"
        hint = "correct the cause and repeat the command, or choose another folder with --out; finished points are kept"
        raise validation_error("study store", str(path), "", bound, hint) from error


def _is_empty(connection: sqlite3.Connection) -> bool:
    """Return whether a database has neither tables nor the application id of any program."""
    (application_id,) = connection.execute("PRAGMA application_id").fetchone()
    return application_id == 0 and connection.execute("SELECT 1 FROM sqlite_master").fetchone() is None


def _check_is_store(connection: sqlite3.Connection, path: Path) -> None:
    """Raise InputError for a database of another program, and for a store of another version."""
    (application_id,) = connection.execute("PRAGMA application_id").fetchone()
    tables = dict(connection.execute("SELECT name, sql FROM sqlite_master WHERE type = 'table'").fetchall())
    hint = "choose another folder with --out"
    if application_id != _APPLICATION_ID:
        bound = "empty or the store of a study, not another database"
        raise validation_error("study store", str(path), "", bound, hint)
    if tables != _TABLES:
        bound = "the store of a study of this version, with unchanged tables"
        raise validation_error("study store", str(path), "", bound, hint)


def study_facts(study: Study) -> Plain:
    """Return all facts that determine the results of a study, keyed by dotted names.

    The facts are the keys of the study, the base design, the order of the varied keys, and the versions of packages and
    code.
    """
    facts: Plain = to_plain(study)
    del facts["name"]  # the name does not affect the results
    facts["base"] = {**study.base.tables, "own processes": study.base.custom_processes}
    packages = {name: version(name) for name in _PACKAGES}
    return _flatten("", {**facts, "order": list(study.vary), "versions": packages, "code": code_digest()[:16]})


def _check_same_study(path: Path, stored_facts: Mapping[str, str], new_facts: Mapping[str, str]) -> None:
    """Raise InputError if the stored facts differ from the facts of the study; the message names the first difference.

    `stored_facts` and `new_facts` hold JSON texts, keyed by dotted names, and `path` is the store. The number of points
    may increase, because a longer study begins with the points of the shorter one. With the method `sensitivity`, it
    may not, because SciPy draws different points for each number of samples.
    """
    may_increase = ["goal.evaluations"]
    if json.loads(new_facts["how"]) != "sensitivity":
        may_increase.append("samples")
    for key in {**stored_facts, **new_facts}:
        before = json.loads(stored_facts.get(key, "null"))  # None if only the new study has this fact
        now = json.loads(new_facts.get(key, "null"))
        is_longer_study = key in may_increase and before is not None and now > before
        if before == now or is_longer_study:
            continue
        bound = f"{_json(before)[:_MAX_VALUE_LENGTH]}, as in {path}"
        raise validation_error(key, _json(now), "", bound, "change it back, or choose another folder with --out")


def settings_text(settings: Mapping[str, Setting]) -> str:
    """Return settings as the text under which they are stored; points with equal texts have the same design."""
    return _json(settings)


def _flatten(name: str, data: object) -> Plain:
    """Return the values in nested tables, keyed by dotted names that begin with `name`."""
    if not isinstance(data, Mapping):
        return {name: data}
    leaves: Plain = {}
    for key, value in data.items():
        leaves |= _flatten(f"{name}.{key}".strip("."), value)
    return leaves


def _point_of_row(row: Sequence[Any]) -> PointResult:
    """Return the point that is stored in a row of the table `points`."""
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
    """Return plain data or a mapping as JSON.

    Raises TypeError for data of any other type, and ValueError for a number that is not finite.
    """
    return json.dumps(value, allow_nan=False, default=dict)
