"""The table of a study as CSV or Parquet: a row for each point, a column for each key that varies or is wanted."""

import csv
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import islice
from pathlib import Path

from cad.quantity import InputError, validation_error
from pipeline.storage.digests import file_digest, is_regular, keep_aside
from pipeline.storage.plain import Plain
from pipeline.study.store import STORE, StudyStore, stored_study
from pipeline.study.study_file import Study

FLAG = "--export"
KINDS = (".csv", ".parquet")
_EXPORTS = "exports"  # sha256 by place of the tables that were written: neither kind has room for a seal
_BATCH = 20_000  # rows


@dataclass(frozen=True, kw_only=True)
class _Table:
    """The points of a store as rows: the number, the status, the values of some keys, and the error."""

    store: StudyStore
    keys: tuple[str, ...]

    @property
    def header(self) -> tuple[str, ...]:
        return "number", "status", *self.keys, "error"

    def rows(self) -> Iterator[list[object]]:
        """Yield the row of every point, one at a time in memory."""
        for point in self.store.rows():
            held = {**point.settings, **point.values}
            yield [point.number, point.status, *(held.get(key) for key in self.keys), point.error]


def export_table(store: StudyStore, study: Study, path: Path, *, force: bool = False) -> None:
    """Write the table of a study to a file of kind .csv or .parquet, whole or not at all.

    Raises InputError as `refuse_export`, and where the file cannot be written.
    """
    _refuse_kind(path)
    exports = store.fact(_EXPORTS) or {}
    table = _Table(store=store, keys=tuple(dict.fromkeys((*study.vary, *study.wanted))))
    write = _write_csv if path.suffix == ".csv" else _write_parquet
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        write(part, table)
        digest = file_digest(part)
        if os.path.lexists(path) and not _is_own(path, exports):
            if not force:
                raise _taken(path)
            keep_aside(path, path.parent)
        part.replace(path)
    except OSError as error:
        bound = f"a file that can be written ({error.strerror})"
        raise validation_error(FLAG, str(path), "", bound, "name another one") from error
    finally:
        if part.exists():
            part.unlink()
    store.remember(_EXPORTS, {**exports, str(path.resolve()): digest})


def refuse_export(path: Path, folder: Path, *, force: bool = False) -> None:
    """Raise InputError where the table of the study of a folder cannot be written, before anything is solved.

    A file that is there is replaced only where it is as this study wrote it, unless `force` keeps it as NAME.bak.
    """
    _refuse_kind(path)
    if not path.parent.is_dir() and path.parent.resolve() != folder.resolve():
        raise validation_error(FLAG, str(path), "", "a file in a folder that is there", "make that folder first")
    if force or not os.path.lexists(path):
        return
    if not (folder / STORE).is_file():
        raise _taken(path)
    with stored_study(folder) as store:
        if not _is_own(path, store.fact(_EXPORTS) or {}):
            raise _taken(path)


def _refuse_kind(path: Path) -> None:
    if path.suffix not in KINDS:
        raise validation_error(FLAG, path.name, "", "a file of kind .csv or .parquet", "change its ending")
    if path.suffix == ".parquet" and find_spec("pyarrow") is None:
        remedy = "install it with: pip install 'twintip[study]', or export .csv"
        raise validation_error(FLAG, path.name, "", "written with the package pyarrow", remedy)


def _is_own(path: Path, exports: Plain) -> bool:
    """Say whether a file still is as this study wrote it there."""
    return is_regular(path) and exports.get(str(path.resolve())) == file_digest(path)


def _taken(path: Path) -> InputError:
    bound = "a new file, or the unchanged table of this study"
    return validation_error(FLAG, str(path), "", bound, "name another one, or keep this one as NAME.bak with --force")


def _write_csv(path: Path, table: _Table) -> None:
    """Write numbers with all their digits, as JSON does; an empty cell stands for nothing."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(table.header)
        writer.writerows([_cell(value) for value in row] for row in table.rows())


def _cell(value: object) -> str:
    if value is None or isinstance(value, str):
        return value or ""
    return json.dumps(value)


def _write_parquet(path: Path, table: _Table) -> None:
    """Write a batch of rows after the other, so that a long table needs no memory."""
    import pyarrow
    from pyarrow import parquet

    kinds = {name: _arrow_kind(table.store.kinds(name)) for name in table.keys}
    fixed = {"number": "int64", "status": "string", "error": "string"}
    schema = pyarrow.schema([(name, getattr(pyarrow, (fixed | kinds)[name])()) for name in table.header])
    with parquet.ParquetWriter(path, schema) as writer:
        rows = table.rows()
        while batch := list(islice(rows, _BATCH)):
            columns = zip(*batch, strict=True)
            arrays = [
                pyarrow.array([_as_kind(value, field.type) for value in column], type=field.type)
                for field, column in zip(schema, columns, strict=True)
            ]
            writer.write_batch(pyarrow.record_batch(arrays, schema=schema))


def _arrow_kind(kinds: set[str]) -> str:
    """Return the name of Arrow's type that holds all values of some kinds of JSON."""
    held = kinds - {"null"}
    if held <= {"true", "false"} and held:
        return "bool_"
    if held == {"integer"}:
        return "int64"
    return "float64" if held <= {"integer", "real"} else "string"


def _as_kind(value: object, kind: object) -> object:
    """Return a value as Arrow takes it: in a column of texts, those of other kinds as CSV has them."""
    return _cell(value) if value is not None and str(kind) == "string" else value
