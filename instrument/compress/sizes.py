"""Reader for a table with the sizes of each specimen, so that one command can evaluate tests of different fruit."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from instrument.compress.specimens import Specimen
from pipeline.tables.columns import Column
from pipeline.tables.decoding import place_of
from pipeline.tables.number_formats import is_missing
from pipeline.tables.table import FoundTable, only_table
from pipeline.tables.units import LENGTH, Quantity
from sensor.quantity import validation_error

# Further names of each size in the header of a table.
_WORDS = {
    "height": ("h",),
    "radius": ("r", "radius 1", "radius along"),
    "radius_across": ("radius 2", "across"),
    "length": (),
    "width": (),
    "plunger_radius": ("plunger",),
}
SIZES = tuple(_WORDS)
"""The sizes of a test, named like their flags."""
_TEXTS = {"file": Quantity(units={}), "specimen": Quantity(units={}, words=("sample",))}


@dataclass(frozen=True, kw_only=True)
class SpecimenSizes:
    """The sizes of specimens [mm].

    `rows` maps a file and a specimen to the sizes, which are named like their flags. The specimen "" means all
    specimens of the file. `summary` describes how the table `source` was read.
    """

    source: str
    summary: str
    rows: Mapping[tuple[str, str], Mapping[str, float]]

    @property
    def files(self) -> list[Path]:
        """Return the path of each file named in the table once; names are relative to the folder of the table."""
        folder = Path(self.source).parent
        names = dict.fromkeys(file for file, _ in self.rows)
        return [folder / name for name in names]

    def sizes_of(self, specimen: Specimen) -> Mapping[str, float]:
        """Return the sizes of a specimen [mm], named like their flags.

        The table may give a file by its path or by its name, with or without the extension. If several rows fit, the
        more exact name of the file has priority, and then the row for only this specimen. Raises InputError if no row
        fits.
        """
        path = Path(specimen.path)
        for file in (specimen.path, path.name, path.stem):
            for name in (specimen.name, ""):
                if (file, name) in self.rows:
                    return self.rows[file, name]
        bound = f"a table with a row of {specimen.path}, specimen {specimen.name!r}"
        raise validation_error(self.source, len(self.rows), "rows", bound, "add the sizes of this specimen")


def read_sizes_table(source: Path, flags: Sequence[str] = ()) -> SpecimenSizes:
    """Read a table with the sizes of specimens, so that each test is evaluated with its own body.

    `flags` are the names of the sizes that are given on the command line, which the table must not contain. Raises
    InputError if the table contains one of them, for a row without a file, and for a second row of the same specimen.
    """
    sizes = {name: Quantity(units=LENGTH, default="mm", most=1e4, words=words) for name, words in _WORDS.items()}
    table = only_table(source, _TEXTS | sizes, [("file",)], "file,height_mm,radius_mm")
    columns = {column.name: column for column in table.columns}
    _check_columns(table, columns, flags)
    rows: dict[tuple[str, str], dict[str, float]] = {}
    for row in table.rows:
        file = columns["file"].cell(row)
        # Without a name of a specimen, the row is for all specimens of the file.
        specimen = columns["specimen"].cell(row) if "specimen" in columns else ""
        key = (file, specimen)
        if not file or key in rows:
            bound = "a file name, with only one row for each specimen of a file"
            raise validation_error(place_of(table.source, row.line), ", ".join(key), "", bound, "correct that line")
        filled = [column for name, column in columns.items() if name in sizes and not is_missing(column.cell(row))]
        rows[key] = {column.name: table.number(row, column) for column in filled}
    return SpecimenSizes(source=table.source, summary=table.summary, rows=rows)


def _check_columns(table: FoundTable, columns: Mapping[str, Column], flags: Sequence[str]) -> None:
    """Raise InputError if a table has a size that a flag gives too.

    `columns` are the columns of the table by their names, and `flags` are the names of the sizes that flags give.
    """
    for name in flags:
        if name in columns:
            place = place_of(table.source, table.header.line, columns[name].label)
            bound = f"left out if --{name.replace('_', '-')} is given"
            raise validation_error(place, columns[name].label, "", bound, "give each size once")
