"""The table of a study as CSV or Parquet: a row for each point, a column for each key that varies or is wanted."""

import csv
import json
from functools import partial
from importlib.util import find_spec
from pathlib import Path

from cad.quantity import validation_error
from pipeline.storage.files import write_files
from pipeline.study.outputs import refuse_output
from pipeline.study.store import StudyStore
from pipeline.study.study_file import Study

FLAG = "--export"


def refuse_export(path: Path, folder: Path, *, force: bool = False) -> None:
    """Raise InputError where the table of the study of a folder cannot be written, before anything is solved."""
    refuse_output(path, (".csv", ".parquet"), folder, FLAG, force=force)
    if path.suffix == ".parquet" and find_spec("pyarrow") is None:
        hint = "install it with: pip install 'twintip[study]', or export .csv"
        raise validation_error(FLAG, path.name, "", "written with the package pyarrow", hint)


def export_table(store: StudyStore, study: Study, path: Path, *, force: bool = False) -> None:
    """Write the table of a study to a file of kind .csv or .parquet; raises InputError as `write_files`."""
    write = _write_csv if path.suffix == ".csv" else _write_parquet
    write_files({path: partial(write, store, study)}, FLAG, force=force, renew=True)


def _write_csv(store: StudyStore, study: Study, path: Path) -> None:
    """Write one point at a time, numbers with all their digits, as JSON does; an empty cell stands for nothing."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("number", "status", *study.keys, "error"))
        for point in store.rows():
            values = {**point.settings, **point.values}
            cells = [_cell(values.get(key)) for key in study.keys]
            writer.writerow((point.number, point.status, *cells, point.error or ""))


def _cell(value: object) -> str:
    if value is None or isinstance(value, str):
        return value or ""
    return json.dumps(value)


def _write_parquet(store: StudyStore, study: Study, path: Path) -> None:
    """Write the columns of the CSV as Arrow understands them: numbers, truth values, else text."""
    from pyarrow import csv as arrow_csv
    from pyarrow import parquet, string

    as_csv = path.with_suffix(".csv")
    _write_csv(store, study, as_csv)
    texts = {"status": string(), "error": string()}
    options = arrow_csv.ConvertOptions(column_types=texts, strings_can_be_null=True)
    parquet.write_table(arrow_csv.read_csv(as_csv, convert_options=options), path)
