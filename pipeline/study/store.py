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
_WAIT_S = 60.0  # maximum time to wait for another program that reads or writes the file [s]
_TABLES = {
    "study": "CREATE TABLE study (key TEXT PRIMARY KEY, value TEXT NOT NULL)",
    "points": (
        "CREATE TABLE points (number INTEGER PRIMARY KEY, status TEXT NOT NULL, "
        "settings TEXT NOT NULL CHECK (json_valid(settings)), results TEXT NOT NULL CHECK (json_valid(results)), "
        "error TEXT, seconds REAL NOT NULL)"
    ),
}
_MACHINE_FAULTS = "FROM points WHERE status = 'failed' AND error LIKE ?"
_KEY_VALUES = """
WITH
    done AS (
        SELECT number, iif(json_type(results, :path) IS NULL, settings, results) AS record
        FROM points WHERE status = 'done'
    ),
    of_key AS (SELECT number, json_type(record, :path) AS kind, json_extract(record, :path) AS value FROM done),
    numbers AS (SELECT number, iif(kind IN ('integer', 'real'), value, NULL) AS value FROM of_key)
"""
"""Head of a query for one key, in the results of a point or else in its settings.

It provides two tables with a row for each point that is done: `of_key` with any value, and `numbers` with NULL for a
value that is not a number.
"""
_PACKAGES = ("twintip", "numpy", "scipy", "scikit-fem", "gmsh", "cadquery")
_MAX_MESSAGES = 5
_NUMBER = re.compile(r"\d[\d.]*(e[+-]?\d+)?")
_MAX_VALUE_LENGTH = 60  # maximum length of a value in an error message, which is one line [characters]
_ROUND_OFF = 1e-12  # relative difference of two numbers up to which it is round-off


class StudyStore:
    """The stored points of a study, with the facts that define the study; one process at a time writes to it."""

    def __init__(self, connection: sqlite3.Connection, path: Path) -> None:
        """Store an open connection to the file."""
        self._connection = connection
        self.path = path

    def put(self, results: Iterable[PointResult]) -> None:
        """Store results in one transaction: all of them or none."""
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
        """Return the numbers of the points with the status "done", in order."""
        query = "SELECT number FROM points WHERE status = 'done' ORDER BY number"
        return [number for (number,) in self._connection.execute(query)]

    def missing_points(self, designs: Iterable[Mapping[str, Setting]]) -> list[Point]:
        """Return new points for those designs that are not stored yet, without duplicates.

        A design is given by its settings. The new points get the lowest unused numbers.
        """
        by_text = {settings_text(settings): settings for settings in designs}
        known = {text for (text,) in self._connection.execute("SELECT settings FROM points")}
        used_numbers = self.numbers()
        unused_numbers = (number for number in count() if number not in used_numbers)
        new = [settings for text, settings in by_text.items() if text not in known]
        return [Point(number=number, settings=settings) for settings, number in zip(new, unused_numbers, strict=False)]

    def results(self, designs: Iterable[Mapping[str, Setting]]) -> list[PointResult]:
        """Return the stored point of each design, which is given by its settings; raises KeyError if one is missing."""
        texts = list(map(settings_text, designs))
        query = "SELECT settings, points.* FROM points WHERE settings IN (SELECT value FROM json_each(?))"
        points = {text: _point_of_row(row) for text, *row in self._connection.execute(query, (json.dumps(texts),))}
        return [points[text] for text in texts]

    def rows(self, numbers: Sequence[int] | None = None) -> Iterator[PointResult]:
        """Yield the points with these numbers, in the given order, or all points. Only one is in memory at a time."""
        if numbers is None:
            rows = self._connection.execute("SELECT * FROM points ORDER BY number")
        else:
            query = "SELECT points.* FROM json_each(?) JOIN points ON number = value ORDER BY key"
            rows = self._connection.execute(query, (json.dumps(numbers),))
        yield from map(_point_of_row, rows)

    @property
    def wanted(self) -> tuple[str, ...]:
        """Return the keys of the outputs that are stored for each point."""
        return self._names("wanted")

    @property
    def keys(self) -> tuple[str, ...]:
        """Return the varied and the wanted keys without duplicates."""
        return tuple(dict.fromkeys((*self._names("order"), *self.wanted)))

    def _names(self, fact: str) -> tuple[str, ...]:
        ((names,),) = self._connection.execute("SELECT value FROM study WHERE key = ?", (fact,))
        return tuple(json.loads(names))

    def counts(self) -> dict[str, int]:
        """Return the number of points for each status: done, refused and failed."""
        counts = dict(self._connection.execute("SELECT status, COUNT(*) FROM points GROUP BY status").fetchall())
        return {status: counts.get(status, 0) for status in ("done", "refused", "failed")}

    def machine_faults(self) -> int:
        """Return the number of points that failed due to a fault of the machine, such as a lost worker."""
        ((faults,),) = self._connection.execute(f"SELECT COUNT(*) {_MACHINE_FAULTS}", (f"{MACHINE}%",))
        return int(faults)

    def messages(self) -> dict[str, int]:
        """Return the five most frequent messages of refused and failed points, with their frequencies.

        Messages that differ only in their numbers are counted together, and the message of the first point represents
        them.
        """
        by_pattern: dict[str, list[str]] = {}
        for (error,) in self._connection.execute("SELECT error FROM points WHERE error NOT NULL ORDER BY number"):
            pattern = _NUMBER.sub("#", error)
            by_pattern.setdefault(pattern, []).append(error)
        most_frequent = sorted(by_pattern.values(), key=len, reverse=True)[:_MAX_MESSAGES]
        return {errors[0]: len(errors) for errors in most_frequent}

    def column(self, key: str) -> Floats:
        """Return the values of a key [its unit] for all points that are done, in order of the points.

        The value is nan if a point has no number for the key.
        """
        values = self._query_key(key, "SELECT value FROM numbers ORDER BY number")
        return np.array([value for (value,) in values], dtype=np.float64)

    def span(self, key: str) -> tuple[float, float] | None:
        """Return the smallest and the largest value of a key [its unit]; None if no point has a number for it."""
        ((low, high),) = self._query_key(key, "SELECT MIN(value), MAX(value) FROM numbers")
        return None if low is None else (low, high)

    def differs(self, key: str) -> bool:
        """Return whether a key has numbers that differ between the points by more than round-off."""
        low, high = self.span(key) or (0.0, 0.0)
        return high - low > _ROUND_OFF * max(abs(low), abs(high))

    def best(self, key: str, max_count: int) -> list[int]:
        """Return the numbers of up to `max_count` points with the smallest values of a key, in ascending order.

        Points without a value come last.
        """
        query = "SELECT number FROM numbers ORDER BY value NULLS LAST, number LIMIT :max_count"
        return [number for (number,) in self._query_key(key, query, max_count=max_count)]

    def words(self, key: str) -> dict[str | bool, int]:
        """Return the text and truth values of a key, with the number of points that have each."""
        query = "SELECT kind, value, COUNT(*) FROM of_key WHERE kind IN ('text', 'true', 'false') GROUP BY kind, value"
        counts = self._query_key(key, query)
        return {value if kind == "text" else kind == "true": points for kind, value, points in counts}

    def _query_key(self, key: str, query: str, **values: object) -> sqlite3.Cursor:
        """Run a query on the tables `of_key` and `numbers` of a key; `values` are its named parameters."""
        return self._connection.execute(f"{_KEY_VALUES} {query}", {"path": f'$."{key}"', **values})

    def begin(self, study: Study) -> None:
        """Create the tables of a study in an empty file, or check that the file belongs to this study.

        Points that failed due to a fault of the machine are deleted, so that they are solved again. Raises InputError
        if the file belongs to another study; the message names the difference.
        """
        self._connection.execute("PRAGMA journal_mode = WAL")
        facts = {key: _json(value) for key, value in study_facts(study).items()}
        with self._connection as transaction:
            transaction.execute("BEGIN IMMEDIATE")
            if _is_empty(transaction):
                transaction.execute(f"PRAGMA application_id = {_MARK}")
                for table in _TABLES.values():
                    transaction.execute(table)
            else:
                stored_facts = dict(transaction.execute("SELECT key, value FROM study").fetchall())
                _refuse_other_study(self.path, stored_facts, facts)
            transaction.executemany("INSERT OR REPLACE INTO study VALUES (?, ?)", facts.items())
            transaction.execute(f"DELETE {_MACHINE_FAULTS}", (f"{MACHINE}%",))


@contextmanager
def study_store(folder: Path, study: Study) -> Iterator[StudyStore]:
    """Open the store of a study in a folder, for one run at a time; create the store if there is none.

    Raises InputError if another run is using the folder, or if it holds a different study; the message names the
    difference. It also raises InputError for a folder that cannot be created or that holds other files.
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
        bound = "a study that no other run is writing"
        raise validation_error("--out", str(folder), "", bound, "wait for that run") from error
    with lock, _open_store(folder / STORE) as store:
        store.begin(study)
        yield store


@contextmanager
def stored_study(folder: Path) -> Iterator[StudyStore]:
    """Open the store of an existing study; raises InputError if the folder has none, or its file is no store."""
    path = folder / STORE
    if not path.is_file():
        raise validation_error("study store", str(path), "", "an existing file", "run the study first")
    with _open_store(path) as store:
        yield store


@contextmanager
def _open_store(path: Path) -> Iterator[StudyStore]:
    """Yield the store in a file; every SQLite error about the file becomes an InputError of one line.

    A database that is neither empty nor a store with exactly these tables is rejected, and nothing is written to it.
    """
    try:
        with closing(sqlite3.connect(path, timeout=_WAIT_S)) as connection:
            if not _is_empty(connection):
                _refuse_foreign(connection, path)
            yield StudyStore(connection, path)
    except sqlite3.Error as error:
        bound = f"a SQLite file that can be read and written ({error})"
        hint = "correct that and repeat the command, all finished points are kept; or name another folder with --out"
        raise validation_error("study store", str(path), "", bound, hint) from error


def _is_empty(connection: sqlite3.Connection) -> bool:
    """Return whether a database has no tables, and no application id that marks it as a file of some program."""
    (mark,) = connection.execute("PRAGMA application_id").fetchone()
    return mark == 0 and connection.execute("SELECT 1 FROM sqlite_master").fetchone() is None


def _refuse_foreign(connection: sqlite3.Connection, path: Path) -> None:
    """Raise InputError for a database of another program, and for a store of another version."""
    (mark,) = connection.execute("PRAGMA application_id").fetchone()
    tables = dict(connection.execute("SELECT name, sql FROM sqlite_master WHERE type = 'table'").fetchall())
    if mark != _MARK:
        raise validation_error(
            "study store", str(path), "", "empty or the store of a study, not another database", "name another --out"
        )
    if tables != _TABLES:
        bound = "the store of a study of this version, with unchanged tables"
        raise validation_error("study store", str(path), "", bound, "name another --out")


def study_facts(study: Study) -> Plain:
    """Return everything that determines the results of a study, by dotted names.

    These are its keys, the base design, the order of the varied keys, and the versions of packages and code.
    """
    facts: Plain = to_plain(study)
    del facts["name"]  # it does not affect the results
    facts["base"] = {**study.base.tables, "own processes": study.base.own}
    packages = {name: version(name) for name in _PACKAGES}
    return _flatten("", {**facts, "order": list(study.vary), "versions": packages, "code": code_digest()[:16]})


def _refuse_other_study(path: Path, stored_facts: Mapping[str, str], new_facts: Mapping[str, str]) -> None:
    """Raise InputError if a store holds a study with other facts; the message names the first difference.

    The number of points may increase, because a longer study begins with the points of the shorter one. That is not
    the case for `sensitivity`, whose points SciPy draws anew for each number of samples.
    """
    may_increase = ("goal.evaluations",) if new_facts["how"] == '"sensitivity"' else ("goal.evaluations", "samples")
    for key in {**stored_facts, **new_facts}:
        before, now = (json.loads(facts.get(key, "null")) for facts in (stored_facts, new_facts))
        if before == now or (key in may_increase and before is not None and now > before):
            continue
        bound = f"{_json(before)[:_MAX_VALUE_LENGTH]}, as in {path}"
        raise validation_error(key, _json(now), "", bound, "change it back, or name another --out")


def settings_text(settings: Mapping[str, Setting]) -> str:
    """Return settings as the text that the store holds; points with equal texts have the same design."""
    return _json(settings)


def _flatten(name: str, data: object) -> Plain:
    """Return the values in nested tables by dotted names, which begin with `name`."""
    if not isinstance(data, Mapping):
        return {name: data}
    leaves: Plain = {}
    for key, value in data.items():
        leaves |= _flatten(f"{name}.{key}".strip("."), value)
    return leaves


def _point_of_row(row: Sequence[Any]) -> PointResult:
    """Return the point that a row of the table `points` holds."""
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

    Raises TypeError for data of another type, and ValueError for a number that is not finite.
    """
    return json.dumps(value, allow_nan=False, default=dict)
