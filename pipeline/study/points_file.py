"""The points of a study in a CSV file: a header of keys, and a row for each point."""

from pathlib import Path

from cad.quantity import InputError, validation_error
from pipeline.study.variation import Choices, Variation, setting_of_cell

Row = tuple[str, ...]


def read_rows(path: Path) -> tuple[Row, tuple[Row, ...]]:
    """Return the header and the rows of a CSV file of points; raises InputError for one that is none."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise validation_error("points", path.name, "", "a CSV file beside the study file", "check the name") from error
    rows = [tuple(cell.strip() for cell in line.split(",")) for line in lines if line.strip()]
    if len(rows) < 2:  # noqa: PLR2004 - a header and a point
        raise validation_error(
            "points", path.name, "", "a header of keys and at least one row", "the file has no points"
        )
    repeated = [key for key in rows[0] if rows[0].count(key) > 1]
    if repeated:
        raise validation_error(
            "points", repeated[0], "", "in the header once", f"leave one of its columns out of {path.name}"
        )
    for number, row in enumerate(rows[1:], 2):
        if len(row) != len(rows[0]):
            name, bound = f"points row {number}", f"as many cells as the header has, {len(rows[0])}"
            raise validation_error(name, len(row), "", bound, "mend that row")
    return rows[0], tuple(rows[1:])


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
