"""What a bench measured: one row per method and mesh, tables for people, records for machines, files that are whole."""

import dataclasses
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from cad.quantity import fault


@dataclass(frozen=True, kw_only=True)
class Measured:
    """One method on one mesh: dofs, CPU seconds after imports, relative errors [1] of a first and a second value.

    `estimated` is the error bar that the method itself states for the first value, relative; None where it has none.
    """

    method: str
    mesh: str
    cpu: float
    error: float
    dofs: int | None = None
    second: float | None = None
    estimated: float | None = None
    remark: str = ""


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """A table: title, column heads, rows of text, and notes below it; `records` is the same for machines."""

    name: str
    title: str
    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()
    records: tuple[dict[str, Any], ...] = ()

    def print_on(self, console: Console) -> None:
        """Print the table and its notes."""
        table = Table(*self.heads, title=self.title)
        for column in table.columns[1:]:
            column.justify = "right"
        for row in self.rows:
            table.add_row(*map(escape, row))
        console.print(table)
        for note in self.notes:
            console.print(f"  {escape(note)}")

    def markdown(self) -> str:
        """Return the table as Markdown."""
        lines = [f"**{self.title}**", "", _line(self.heads), _line(["---"] + ["---:"] * (len(self.heads) - 1))]
        lines += [_line(row) for row in self.rows]
        lines += ["", *(f"- {note}" for note in self.notes)] if self.notes else []
        return "\n".join(lines) + "\n"


def _line(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def work_sheet(name: str, title: str, values: tuple[str, str], rows: Sequence[Measured], notes: Sequence[str]) -> Sheet:
    """Return the work-precision table of some measurements; `values` names the first and the second value."""
    first, second = values
    heads = ["method", "mesh", "dofs", "CPU s", f"error {first}"]
    with_second = any(row.second is not None for row in rows)
    heads += [f"error {second}"] if with_second else []
    heads += ["error bar", "remark"]
    cells = []
    for row in rows:
        line = [row.method, row.mesh, "-" if row.dofs is None else str(row.dofs), seconds(row.cpu), percent(row.error)]
        line += [percent(row.second)] if with_second else []
        line += ["-" if row.estimated is None else percent(row.estimated).lstrip("+"), row.remark]
        cells.append(tuple(line))
    return Sheet(
        name=name,
        title=title,
        heads=tuple(heads),
        rows=tuple(cells),
        notes=tuple(notes),
        records=tuple(dataclasses.asdict(row) for row in rows),
    )


def percent(value: float | None) -> str:
    """Return a relative number as a signed percentage with two digits."""
    return "-" if value is None else f"{100.0 * value:+.2g} %"


def seconds(value: float) -> str:
    """Return seconds with two digits."""
    return f"{value:.2g}" if value < 100.0 else f"{value:.0f}"  # noqa: PLR2004 - digits


def write_whole(folder: Path, texts: Mapping[str, str]) -> None:
    """Write files into a folder, each aside and then in its place; raises InputError where that cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in texts.items():
            with tempfile.NamedTemporaryFile("w", dir=folder, delete=False, encoding="utf-8") as aside:
                aside.write(text)
            Path(aside.name).chmod(0o644)
            Path(aside.name).replace(folder / name)
    except OSError as error:
        bound = f"a folder that can be written ({error.strerror})"
        raise fault("--out", str(folder), "", bound, "name another folder with --out") from error
