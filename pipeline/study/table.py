"""The table of a study as CSV: a row for each point, a column for each key that varies or is wanted."""

import csv
import json
from functools import partial
from pathlib import Path

from pipeline.storage.files import refuse_taken, write_files
from pipeline.study.store import StudyStore
from pipeline.study.study_file import Study
from sensor.quantity import validation_error

FLAG = "--export"


def refuse_export(path: Path, folder: Path, *, force: bool) -> None:
    """Raise InputError where the table of the study of a folder, made later, cannot be written to a file."""
    if path.suffix != ".csv":
        raise validation_error(FLAG, str(path), "", "a file name that ends in .csv", "change its ending")
    if not path.parent.is_dir() and path.parent.resolve() != folder.resolve():
        raise validation_error(FLAG, str(path), "", "a file in a folder that is there", "make that folder first")
    refuse_taken([path], FLAG, force=force)


def export_table(store: StudyStore, study: Study, path: Path, *, force: bool = False) -> None:
    """Write the table of a study to a CSV file; raises InputError as `write_files`."""
    write_files({path: partial(_write_csv, store, study)}, FLAG, force=force)


def _write_csv(store: StudyStore, study: Study, path: Path) -> None:
    """Write one point at a time, numbers with all their digits, as JSON does; an empty cell stands for nothing."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("number", "status", *study.keys, "error"))
        for point in store.rows():
            values = {**point.settings, **point.values}
            cells = [_cell(values.get(key)) for key in study.keys]
            writer.writerow((point.number, point.status, *cells, point.error))


def _cell(value: object) -> object:
    return value if value is None or isinstance(value, str) else json.dumps(value)
