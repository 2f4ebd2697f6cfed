"""The table of a study as CSV or Parquet: a row for each point, a column for each key that varies or is wanted."""

import csv
import json
from collections.abc import Iterator, Sequence
from functools import partial
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from typing import Any

from cad.quantity import validation_error
from pipeline.study.outputs import refuse_no_folder, refuse_taken, write_output
from pipeline.study.store import StudyStore
from pipeline.study.study_file import Study

FLAG = "--export"
_BATCH = 20_000  # rows


def refuse_export(path: Path, folder: Path, *, force: bool = False) -> None:
    """Raise InputError where the table of the study of a folder cannot be written, before anything is solved."""
    if path.suffix not in (".csv", ".parquet"):
        raise validation_error(FLAG, path.name, "", "a file of kind .csv or .parquet", "change its ending")
    if path.suffix == ".parquet" and find_spec("pyarrow") is None:
        hint = "install it with: pip install 'twintip[study]', or export .csv"
        raise validation_error(FLAG, path.name, "", "written with the package pyarrow", hint)
    refuse_no_folder(path, folder, FLAG)
    if not force:
        refuse_taken(folder, [path], FLAG)


def export_table(store: StudyStore, study: Study, path: Path, *, force: bool = False) -> None:
    """Write the table of a study to a file of kind .csv or .parquet; raises InputError as `write_output`."""
    write = _write_csv if path.suffix == ".csv" else _write_parquet
    write_output(store, path, partial(write, store, study.keys), FLAG, force=force)


def _rows(store: StudyStore, keys: Sequence[str]) -> Iterator[list[object]]:
    """Yield the row of every point, one at a time in memory."""
    for point in store.rows():
        values = {**point.settings, **point.values}
        yield [point.number, point.status, *(values.get(key) for key in keys), point.error]


def _write_csv(store: StudyStore, keys: Sequence[str], path: Path) -> None:
    """Write numbers with all their digits, as JSON does; an empty cell stands for nothing."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("number", "status", *keys, "error"))
        for row in _rows(store, keys):
            writer.writerow(map(_cell, row))


def _cell(value: object) -> str:
    if value is None or isinstance(value, str):
        return value or ""
    return json.dumps(value)


def _write_parquet(store: StudyStore, keys: Sequence[str], path: Path) -> None:
    """Write a batch of rows after the other, so that a long table needs no memory."""
    import pyarrow
    from pyarrow import parquet

    header = ("number", "status", *keys, "error")
    schema = pyarrow.schema(list(zip(header, _column_types(store, keys), strict=True)))
    rows = _rows(store, keys)
    with parquet.ParquetWriter(path, schema) as writer:
        while batch := list(islice(rows, _BATCH)):
            arrays = []
            for column, field in zip(zip(*batch, strict=True), schema, strict=True):
                as_text = field.type == pyarrow.string()
                cells = [_cell(value) if as_text and value is not None else value for value in column]
                arrays.append(pyarrow.array(cells, type=field.type))
            writer.write_batch(pyarrow.record_batch(arrays, schema=schema))


def _column_types(store: StudyStore, keys: Sequence[str]) -> list[Any]:
    """Return the type of Arrow that holds all values of each column, text where they are of several kinds."""
    import pyarrow

    kinds: list[set[type]] = [set() for _ in ("number", "status", *keys, "error")]
    for row in _rows(store, keys):
        for kind, value in zip(kinds, row, strict=True):
            if value is not None:
                kind.add(type(value))
    types = []
    for kind in kinds:
        if kind == {bool}:
            types.append(pyarrow.bool_())
        elif kind == {int}:
            types.append(pyarrow.int64())
        elif kind and kind <= {int, float}:
            types.append(pyarrow.float64())
        else:
            types.append(pyarrow.string())
    return types
