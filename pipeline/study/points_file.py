"""The points of a study in a CSV file: a header of keys, and a row for each point."""

from pathlib import Path

from cad.quantity import InputError, validation_error
from pipeline.measure.measured_table import read_csv, refuse_other_length
from pipeline.study.variation import Choices, Variation, setting_of_cell

Row = tuple[str, ...]


def read_rows(path: Path) -> tuple[Row, tuple[Row, ...]]:
    """Return the header and the rows of a CSV file of points; raises InputError for one that is none."""
    form, lines = read_csv(path)
    header, *points = [row for row in lines if not row.empty]
    if not points:
        raise validation_error("points", path.name, "", "a header of keys and at least one row", "add a point")
    for key in header.cells:
        if header.cells.count(key) > 1:
            hint = f"leave one of its columns out of {path.name}"
            raise validation_error("points", key, "", "in the header once", hint)
    for row in points:
        refuse_other_length(form, row, len(header.cells))
    return header.cells, tuple(row.cells for row in points)


def columns_of(header: Row, rows: tuple[Row, ...]) -> dict[str, Variation]:
    """Return what varies in a file of points: the values of each column; raises InputError for what is none."""
    cells = {key: sorted({row[place] for row in rows}) for place, key in enumerate(header)}
    for key, different in cells.items():
        for cell in different:
            _check_cell(key, cell)
    return {key: Choices(values=tuple(different)) for key, different in cells.items()}


def _check_cell(key: str, cell: str) -> None:
    try:
        setting_of_cell(cell)
    except InputError as error:
        msg = f"points {key}: {error}"
        raise InputError(msg) from error
