"""The table of a study as CSV or Parquet: a row for each point, a column for each key that varies or is wanted."""

import csv
import io
import json
from collections.abc import Iterator
from pathlib import Path

from cad.quantity import fault
from pipeline.study.store import StudyStore
from pipeline.study.study_file import Study

KINDS = (".csv", ".parquet")
_BATCH = 50_000


def export_table(store: StudyStore, study: Study, path: Path) -> None:
    """Write the table of a study to a file of kind .csv or .parquet.

    Raises InputError for another kind, and where Parquet is asked for without the package that writes it.
    """
    refuse_kind(path)
    header = ["number", "status", *study.vary, *(key for key in study.wanted if key not in study.vary), "error"]
    rows = _rows(store, header)
    if path.suffix == ".csv":
        _write_csv(path, header, rows)
    else:
        _write_parquet(path, header, rows)


def refuse_kind(path: Path) -> None:
    """Raise InputError for a file of a kind that is not written, before anything is solved."""
    if path.suffix not in KINDS:
        raise fault("--export", path.name, "", "a file of kind .csv or .parquet", "change its ending")


def _rows(store: StudyStore, header: list[str]) -> Iterator[list[object]]:
    for point in store.rows():
        held = {**point.settings, **point.values}
        yield [point.number, point.status, *(held.get(key) for key in header[2:-1]), point.error]


def _write_csv(path: Path, header: list[str], rows: Iterator[list[object]]) -> None:
    """Write numbers with all their digits, as JSON does; an empty cell stands for nothing."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows([_cell(value) for value in row] for row in rows)


def _cell(value: object) -> str:
    if value is None or isinstance(value, str):
        return value or ""
    return json.dumps(value)


def _write_parquet(path: Path, header: list[str], rows: Iterator[list[object]]) -> None:
    try:
        from pyarrow import csv as arrow_csv
        from pyarrow import parquet
    except ImportError as error:
        remedy = "install it with: pip install 'twintip[study]', or export .csv"
        raise fault("--export", path.name, "", "written with the package pyarrow", remedy) from error
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows([_cell(value) for value in row] for row in rows)
    table = arrow_csv.read_csv(io.BytesIO(text.getvalue().encode()))
    parquet.write_table(table, path, row_group_size=_BATCH)
