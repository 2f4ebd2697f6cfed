"""The store of a study: one SQLite file that any such tool opens, and that a kill at any moment leaves whole."""

import fcntl
import json
import os
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

from cad.quantity import InputError, fault
from pipeline.storage.cache import code_digest
from pipeline.storage.plain import Plain, to_plain
from pipeline.study.study_file import Study
from pipeline.study.tasks import PointResult

STORE = "study.sqlite"
_LOCK = "study.lock"
_PACKAGES = ("twintip", "numpy", "scipy", "scikit-fem", "gmsh", "cadquery")
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
_GROWS = "samples"


class StudyStore:
    """The points of a study that are solved, with what the study is; opened by one process at a time for writing."""

    def __init__(self, connection: sqlite3.Connection, path: Path) -> None:
        """Take an open connection to the file."""
        self._connection = connection
        self.path = path

    def put(self, results: Iterable[PointResult]) -> None:
        """Keep results, all of them or none; raises InputError where there is no room, with nothing lost."""
        rows = list(results)
        try:
            with self._connection as open_transaction:
                open_transaction.executemany(
                    "INSERT OR IGNORE INTO points VALUES (?, ?, ?, ?, ?, ?)", [_row(result) for result in rows]
                )
                open_transaction.executemany(
                    "INSERT OR IGNORE INTO audits VALUES (?, ?)",
                    [(result.number, _json(result.audit)) for result in rows if result.audit is not None],
                )
        except sqlite3.OperationalError as error:
            remedy = "free some space and run the same command again: all points before this one are kept"
            raise fault(str(self.path), str(error), "", "a file that can grow", remedy) from error

    def remember(self, key: str, value: object) -> None:
        """Keep a fact of the study by its name."""
        with self._connection as open_transaction:
            open_transaction.execute("INSERT OR REPLACE INTO study VALUES (?, ?)", (key, _json(value)))

    def fact(self, key: str) -> Plain | None:
        """Return a fact of the study by its name; None where none is kept."""
        row = self._connection.execute("SELECT value FROM study WHERE key = ?", (key,)).fetchone()
        return None if row is None else json.loads(row[0])

    def numbers(self) -> set[int]:
        """Return the numbers of the points that are solved."""
        return {number for (number,) in self._connection.execute("SELECT number FROM points")}

    def counts(self) -> dict[str, int]:
        """Return how many points are done, refused and failed."""
        found = dict(self._connection.execute("SELECT status, COUNT(*) FROM points GROUP BY status").fetchall())
        return {status: found.get(status, 0) for status in ("done", "refused", "failed")}

    def messages(self, most: int = 5) -> dict[str, int]:
        """Return the commonest messages of refused and failed points, and how many points have each."""
        query = (
            "SELECT error, COUNT(*) AS n FROM points WHERE error NOT NULL GROUP BY error ORDER BY n DESC, error LIMIT ?"
        )
        return dict(self._connection.execute(query, (most,)).fetchall())

    def rows(self) -> Iterator[PointResult]:
        """Yield every point in the order of the numbers."""
        query = "SELECT points.*, audits.results FROM points LEFT JOIN audits USING (number) ORDER BY number"
        for number, status, settings, results, error, seconds, audit in self._connection.execute(query):
            yield PointResult(
                number=number,
                settings=json.loads(settings),
                status=status,
                values=json.loads(results),
                error=error,
                seconds=seconds,
                audit=None if audit is None else json.loads(audit),
            )


@contextmanager
def study_store(folder: Path, study: Study) -> Iterator[StudyStore]:
    """Open the store of a study in a folder, made where there is none, for one run at a time.

    Raises InputError where another run has it, where it holds another study, naming the difference, or where the folder
    holds anything else than a study.
    """
    _make(folder)
    with _locked(folder), _opened(folder / STORE) as connection:
        store = StudyStore(connection, folder / STORE)
        try:
            connection.execute("PRAGMA journal_mode = WAL")
            connection.executescript(_TABLES)
            _refuse_other(store, study)
            _make_table_view(connection, study)
        except sqlite3.DatabaseError as error:
            raise fault("study store", STORE, "", f"a whole SQLite file ({error})", "name another --out") from error
        yield store


@contextmanager
def stored_study(folder: Path) -> Iterator[StudyStore]:
    """Open the store of a study for reading; raises InputError where there is none."""
    path = folder / STORE
    if not path.is_file():
        raise fault("study store", str(path), "", "an existing file", "run the study first")
    with _opened(path) as connection:
        yield StudyStore(connection, path)


@contextmanager
def _opened(path: Path) -> Iterator[sqlite3.Connection]:
    try:
        connection = sqlite3.connect(path, timeout=60.0)
    except sqlite3.OperationalError as error:
        raise fault("study store", str(path), "", "a file that can be written", "name another --out") from error
    try:
        yield connection
    finally:
        connection.close()


def _make(folder: Path) -> None:
    if folder.exists() and not folder.is_dir():
        raise fault("--out", str(folder), "", "a folder, and it is a file", "name another folder")
    if folder.is_dir() and not (folder / STORE).exists() and {path.name for path in folder.iterdir()} - {_LOCK}:
        raise fault("--out", str(folder), "", "new, empty or the folder of this study", "name another folder")
    folder.mkdir(parents=True, exist_ok=True)


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a study; the kernel frees it when a run is killed."""
    handle = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(handle)
        raise fault("--out", str(folder), "", "a study that no other run writes", "wait for that run") from error
    try:
        yield
    finally:
        os.close(handle)


def _refuse_other(store: StudyStore, study: Study) -> None:
    """Raise InputError that names the difference where a store holds another study; a longer one may go on."""
    asked, kept = _facts(study), store.fact("asked")
    if kept is not None:
        for place, before, now in _differences("", kept, asked):
            if place == _GROWS and isinstance(before, int) and isinstance(now, int) and now >= before:
                continue
            remedy = "change it back, or name another --out"
            msg = f"{place} = {_short(now)}: must be {_short(before)}, as in {store.path}; {remedy}"
            raise InputError(msg)
    store.remember("asked", asked)
    store.remember("schema", 1)


def _facts(study: Study) -> Plain:
    """Return what decides the results of a study."""
    vary = {key: {"kind": type(varied).__name__, **asdict(varied)} for key, varied in study.vary.items()}
    plain: Plain = {
        "base": study.base,
        "vary": vary,
        "order": list(study.vary),
        "wanted": list(study.wanted),
        "goal": to_plain(study.goal),
        **{name: getattr(study, name) for name in ("how", "samples", "seed", "tol", "level", "contact", "audit")},
        "rows": [list(row) for row in study.rows],
        "versions": {name: version(name) for name in _PACKAGES},
        "code": code_digest()[:16],
    }
    facts: Plain = json.loads(_json(plain))
    return facts


def _differences(place: str, before: object, now: object) -> Iterator[tuple[str, object, object]]:
    """Yield each dotted place where two trees of plain data differ, with both values; None stands for nothing there."""
    if isinstance(before, dict) and isinstance(now, dict):
        for key in (*before, *(key for key in now if key not in before)):
            yield from _differences(f"{place}.{key}" if place else key, before.get(key), now.get(key))
    elif before != now:
        yield place, before, now


def _short(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."  # noqa: PLR2004 - of one line


def _make_table_view(connection: sqlite3.Connection, study: Study) -> None:
    """Make the view `results`: a column for each key that varies and for each that is wanted."""
    columns = [(key, "settings") for key in study.vary] + [(key, "results") for key in study.wanted]
    parts = [f'json_extract({column}, \'$."{key}"\') AS "{key}"' for key, column in dict(columns).items()]
    connection.execute("DROP VIEW IF EXISTS results")
    connection.execute(f"CREATE VIEW results AS SELECT number, status, {', '.join(parts)}, error FROM points")


def _row(result: PointResult) -> tuple[int, str, str, str, str | None, float]:
    settings, values = _json(result.settings), _json(result.values)
    return result.number, result.status, settings, values, result.error, round(result.seconds, 6)


def _json(value: object) -> str:
    return json.dumps(value, allow_nan=False, default=_as_list)


def _as_list(value: object) -> object:
    if isinstance(value, Mapping):
        return dict(value)
    msg = f"{type(value).__name__}: must be plain data; turn it into some first"
    raise TypeError(msg)
