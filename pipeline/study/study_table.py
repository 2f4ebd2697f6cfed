"""The table of a study, with one row for each point and one column for each varied key or requested output."""

import csv
import json
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from pipeline.storage.files import check_paths_are_free, write_files
from pipeline.study.store import StudyStore
from sensor.quantity import validation_error

FLAG = "--export"


def refuse_export(path: Path, folder: Path, *, force: bool) -> None:
    """Raise InputError if the table of a study cannot be written to `path`.

    `folder` is the folder of the study, which need not exist yet, because the study creates it later.
    """
    if path.suffix != ".csv":
        raise validation_error(FLAG, str(path), "", "a file name that ends in .csv", "change its extension")
    if not path.parent.is_dir() and path.parent.resolve() != folder.resolve():
        raise validation_error(FLAG, str(path), "", "a file in an existing folder", "create that folder first")
    check_paths_are_free([path], FLAG, force=force)


def export_table(store: StudyStore, path: Path, *, force: bool = False) -> None:
    """Write the table of a study to a CSV file.

    Raises InputError if the file cannot be written, or if it would replace a file of the user; with `force`, such a
    file is kept as NAME.bak.
    """
    write_files({path: partial(_write_csv, store)}, FLAG, force=force)


def table_rows(store: StudyStore, numbers: Sequence[int] | None = None) -> Iterator[dict[str, Any]]:
    """Yield the rows of the points with the given numbers, by default of all points.

    A row consists of the point's number, its status, its value of each varied key and requested output, and its error.
    Missing values are None.
    """
    keys = store.keys
    for point in store.rows(numbers):
        values = {**point.settings, **point.values}
        cells = {key: values.get(key) for key in keys}
        yield {"number": point.number, "status": point.status, **cells, "error": point.error}


def table_columns(store: StudyStore) -> dict[str, list[Any]]:
    """Return the columns of the table of a study, keyed by name; each is a list with one value for each point."""
    columns: dict[str, list[Any]] = {name: [] for name in _column_names(store)}
    for row in table_rows(store):
        for name, value in row.items():
            columns[name].append(value)
    return columns


def _write_csv(store: StudyStore, path: Path) -> None:
    """Write the table as CSV, point by point, with all digits of each number and empty cells for missing values."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, _column_names(store), lineterminator="\n")
        writer.writeheader()
        for row in table_rows(store):
            writer.writerow({name: _cell_text(value) for name, value in row.items()})


def _column_names(store: StudyStore) -> tuple[str, ...]:
    """Return the names of the columns of the table, in their order."""
    return ("number", "status", *store.keys, "error")


def _cell_text(value: object) -> object:
    """Return a value as it is written to CSV: a string or None unchanged, and any other value in JSON notation."""
    return value if value is None or isinstance(value, str) else json.dumps(value)
