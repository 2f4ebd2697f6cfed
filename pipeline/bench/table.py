"""Tables of measurements: as a page in Markdown, printed too, and for machines; and files that appear whole."""

import dataclasses
import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markdown import Markdown

from pipeline.storage.placed_files import place_files
from pipeline.storage.seal import without_seal

WIDTH = 200  # of what is printed where there is no terminal


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """One method on one mesh: CPU seconds [s] after imports, relative errors of its values [1], signed, dofs.

    `error_bar` [1] is what the method itself states for its first value. A method that refused has no errors, and its
    remark says why.
    """

    method: str
    mesh: str
    cpu: float
    errors: tuple[float, ...]
    dofs: int = 0
    error_bar: float | None = None
    remark: str = ""

    @property
    def worst(self) -> float:
        """Return the largest error without its sign [1]; infinite for a method that refused."""
        return max(map(abs, self.errors), default=math.inf)

    @property
    def cost(self) -> str:
        """Return method, worst error and CPU seconds in words."""
        return f"{self.method} at {percent(self.worst)} in {self.cpu:.2g} CPU s"


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """A table: title, column heads, rows of text, and notes below it; `records` is the same for machines."""

    name: str
    title: str
    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()
    records: tuple[dict[str, Any], ...] = ()

    def markdown(self) -> str:
        """Return the table under its title as Markdown."""
        rules = ["---", *["---:"] * (len(self.heads) - 1)]
        notes = [*(f"- {note}" for note in self.notes), ""] if self.notes else []
        return "\n".join([f"## {self.title}", "", *map(_markdown_row, (self.heads, rules, *self.rows)), "", *notes])


def _markdown_row(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def page(title: str, introduction: str, *parts: str) -> str:
    """Return a whole page of Markdown: title, what it is and how it was made, then its parts."""
    return "\n".join([f"# {title}", "", introduction, "", *parts])


def work_sheet(
    name: str, title: str, values: Sequence[str], rows: Sequence[Measurement], notes: Sequence[str]
) -> Sheet:
    """Return the work-precision table of measurements whose errors are those of the named values."""
    heads = ("method", "mesh", "dofs", "CPU s", *(f"error {value}" for value in values), "error bar", "remark")
    cells = []
    for row in rows:
        errors = [signed_percent(error) for error in row.errors]
        errors += ["-"] * (len(values) - len(errors))
        bar = "-" if row.error_bar is None else percent(row.error_bar)
        cells.append((row.method, row.mesh, str(row.dofs or "-"), f"{row.cpu:.2g}", *errors, bar, row.remark))
    records = tuple(dataclasses.asdict(row) for row in rows)
    return Sheet(name=name, title=title, heads=heads, rows=tuple(cells), notes=tuple(notes), records=records)


def record_sheet(
    name: str, title: str, records: Sequence[dict[str, str | float]], notes: Sequence[str], digits: int
) -> Sheet:
    """Return the table of records with the same keys, its numbers to some digits."""
    rows = tuple(tuple(f"{v:.{digits}g}" if isinstance(v, float) else v for v in one.values()) for one in records)
    heads = tuple(records[0])
    return Sheet(name=name, title=title, heads=heads, rows=rows, notes=tuple(notes), records=tuple(records))


def percent(value: float) -> str:
    """Return a relative number [1] as a percentage of two digits."""
    return f"{100.0 * value:.2g} %"


def signed_percent(value: float) -> str:
    """Return a relative number [1] as a percentage of two digits with its sign."""
    return f"{100.0 * value:+.2g} %"


def publish(folder: Path, files: Mapping[str, str], *, as_json: bool, force: bool = False) -> None:
    """Write a page and its records into a folder and print one of the two.

    Raises InputError where the folder cannot be written, or has other files of these names and `force` does not keep
    them as NAME.bak.
    """
    paths = place_files(folder, {name: text.encode() for name, text in files.items()}, "--out", force=force)
    shown = next(path for path in paths if path.suffix == (".json" if as_json else ".md")).read_text(encoding="utf-8")
    if as_json:
        print(shown, end="")
        return
    console = Console(width=None if sys.stdout.isatty() else WIDTH)
    console.print(Markdown(without_seal(shown)))
    console.print(f"written: {', '.join(map(str, paths))}", markup=False, highlight=False)
