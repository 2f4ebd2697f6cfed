"""Reader for a table with the sizes of each specimen, so that one command can evaluate tests of different fruit."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from instrument.compress.specimens import Specimen
from pipeline.tables.decoding import place_of
from pipeline.tables.number_formats import is_missing
from pipeline.tables.table import only_table
from pipeline.tables.units import LENGTH, Quantity
from sensor.quantity import validation_error

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

    The key of `rows` is a file and a specimen; the specimen "" represents all specimens of the file. The value of
    `rows` holds the sizes, named like their flags. `summary` describes how the table `source` was read.
    """

    source: str
    summary: str
    rows: Mapping[tuple[str, str], Mapping[str, float]]

    @property
    def files(self) -> list[Path]:
        """Return the paths of the files named in the table; names are relative to the folder of the table."""
        folder = Path(self.source).parent
        return [folder / file for file in dict.fromkeys(file for file, _ in self.rows)]

    def sizes_of(self, specimen: Specimen) -> Mapping[str, float]:
        """Return the sizes of a specimen [mm], named like their flags.

        A row for the specimen has priority over a row for all specimens, if both give the file in the same way. Raises
        InputError if there is no row for it.
        """
        # The table may give a file by its path or by its name, with or without the extension.
        path = Path(specimen.path)
        for file in (specimen.path, path.name, path.stem):
            for name in (specimen.name, ""):
                if (file, name) in self.rows:
                    return self.rows[file, name]
        bound = f"a row of {specimen.path}, specimen {specimen.name!r}"
        raise validation_error(
            self.source, len(self.rows), "rows", f"a table with {bound}", "add the sizes of this specimen"
        )


def read_sizes_table(source: Path, flags: Sequence[str] = ()) -> SpecimenSizes:
    """Read a table with the sizes of specimens, so that each test is evaluated with its own body.

    `flags` are the names of the sizes that are given on the command line, which the table must not contain. Raises
    InputError if the table contains one of them, for a row without a file, and for a second row for the same specimen.
    """
    sizes = {name: Quantity(units=LENGTH, default="mm", most=1e4, words=words) for name, words in _WORDS.items()}
    table = only_table(source, _TEXTS | sizes, [("file",)], "file,height_mm,radius_mm")
    columns = {column.name: column for column in table.columns}
    for name in flags:
        if name in columns:
            place = place_of(table.source, table.header.line, columns[name].label)
            bound = f"left out if --{name.replace('_', '-')} is given"
            raise validation_error(place, columns[name].label, "", bound, "give each size once")
    rows: dict[tuple[str, str], dict[str, float]] = {}
    for row in table.rows:
        # A text is empty if the table has no column for it.
        file, specimen = (columns[name].cell(row) if name in columns else "" for name in _TEXTS)
        key = (file, specimen)
        if not file or key in rows:  # a specimen "" is allowed: the row is for all specimens of the file
            bound = "a file name, with only one row for each specimen of a file"
            raise validation_error(place_of(table.source, row.line), ", ".join(key), "", bound, "correct that line")
        filled = [column for name, column in columns.items() if name in sizes and not is_missing(column.cell(row))]
        rows[key] = {column.name: table.number(row, column) for column in filled}
    return SpecimenSizes(source=table.source, summary=table.summary, rows=rows)
