"""Shared code of the benchmarks: measurements of methods against a reference, and tables in Markdown."""

import dataclasses
import json
import math
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from benchmarks.peers import PEER_NAMES, absent_peers
from benchmarks.usage import ONE_THREAD, resource_usage
from solve.linear import SolveError

T = TypeVar("T")
ROOT = Path(__file__).parents[1]
MEASUREMENTS = ROOT / "docs" / "measurements.md"
OURS = "ours: "  # prefix of the methods of the product
LEVELS = (0.1, 0.01, 1e-3, 1e-4)  # relative errors for which the cheapest method is listed
WINNERS = """\
The cheapest method that reaches each error. A row counts by its error, and also by its error bar where it states one;
the product must state one."""
WINNER_HEADS = ["error at most", "cheapest", "the product", "cheapest other program", "formula without a mesh"]


@dataclass(frozen=True, kw_only=True)
class Reference:
    """Reference values with their errors in the same unit, and their source.

    If a reference cannot be computed, there are no values, and `source` is the reason.
    """

    values: tuple[float, ...]
    errors: tuple[float, ...]
    source: str

    @property
    def relative_error(self) -> float:
        """Return the largest relative error of the values [1]."""
        return max(error / abs(value) for value, error in zip(self.values, self.errors, strict=True))


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """The result of a method on a mesh: CPU time after imports [s], signed relative errors of its values [1], and dofs.

    `error_bar` [1] is the relative error that the method itself states for its first value. A method that failed has no
    errors, and its remark states the reason.
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
        """Return the largest absolute value of the relative errors [1]; infinite for a method that failed."""
        return max((abs(error) for error in self.errors), default=math.inf)

    @property
    def cost(self) -> str:
        """Return the method, its largest error and its CPU time as text; a missing error bar is mentioned."""
        bar = " without an error bar" if self.error_bar is None else ""
        return f"{self.method}: {percent(self.worst)}{bar}, {self.cpu:.2g} CPU s"


@dataclass(frozen=True, kw_only=True)
class Solved:
    """The answer of a method on a mesh: values in the unit of their bench, CPU time [s], and dofs.

    `error_bar` [1] is the relative error that the method itself states for its first value, or None.
    """

    values: Sequence[float]
    cpu: float
    dofs: int
    error_bar: float | None = None


@dataclass(frozen=True, kw_only=True)
class Bench:
    """A task that several methods solve: its description, the names and the unit of its values, and their reference."""

    name: str
    scene: str
    values: tuple[str, ...]
    unit: str
    reference: Reference

    def row(self, method: str, mesh: str, solved: Solved) -> Measurement:
        """Return the row of a method with the relative errors [1] of its values against the reference."""
        pairs = zip(solved.values, self.reference.values, strict=True)
        errors = tuple(float(value / true - 1.0) for value, true in pairs)
        return Measurement(
            method=method, mesh=mesh, cpu=solved.cpu, errors=errors, dofs=solved.dofs, error_bar=solved.error_bar
        )

    def peer_row(self, method: str, mesh: str, meshing: float, solve: Callable[[], Solved]) -> Measurement:
        """Return the row of a peer on a mesh. `solve` runs the peer, and `meshing` is the CPU time of the mesh [s].

        If `solve` raises SolveError, the row has no errors, and the message becomes its remark.
        """
        try:
            solved = solve()
        except SolveError as failure:
            return Measurement(method=method, mesh=mesh, cpu=meshing, errors=(), remark=str(failure))
        return self.row(method, mesh, dataclasses.replace(solved, cpu=meshing + solved.cpu))

    def section(self, rows: Sequence[Measurement]) -> str:
        """Return the table of errors and costs with its notes, and the table of the cheapest methods, as Markdown."""
        heads = ["method", "mesh", "dofs", "CPU s", *(f"error {value}" for value in self.values), "error bar", "remark"]
        cells = []
        for row in rows:
            errors = [signed_percent(error) for error in row.errors] or ["-"] * len(self.values)
            bar = "-" if row.error_bar is None else percent(row.error_bar)
            cells.append([row.method, row.mesh, str(row.dofs or "-"), f"{row.cpu:.2g}", *errors, bar, row.remark])
        title = f"{self.name.capitalize()}: work and precision"
        return section(title, heads, cells, list(self._notes(rows))) + self._winners(rows)

    def _notes(self, rows: Sequence[Measurement]) -> Iterator[str]:
        """Yield the notes below the table: the task, the reference, answers outside their bars, and absent peers."""
        truths = zip(self.values, self.reference.values, self.reference.errors, strict=True)
        reference = ", ".join(f"{name} {value:.6g} +- {error:.1g}" for name, value, error in truths)
        yield self.scene
        yield f"Reference: {reference} {self.unit}, by {self.reference.source}."
        yield f"CPU seconds include meshing. The error bar belongs to {self.values[0]}."
        yield from self._notes_on_bars(rows)
        absent = absent_peers()
        if absent:
            yield f"Not installed, so not measured: {', '.join(absent)}."

    def _winners(self, rows: Sequence[Measurement]) -> str:
        """Return the table of the cheapest method at each relative error of `LEVELS`, with its introduction.

        Levels below the error of the reference are omitted.
        """
        levels = [level for level in LEVELS if level >= self.reference.relative_error]
        winners = table(WINNER_HEADS, (self._winner(rows, level) for level in levels))
        return f"\n{WINNERS}\n\n{winners}\n"

    def _winner(self, rows: Sequence[Measurement], level: float) -> list[str]:
        """Return the row for a relative error `level` [1]: the cheapest method, the product, and the cheapest peer.

        Formulas have no dofs and take no time. So they are named only in the last cell, if they reach the level.
        """
        by_cost = sorted((row for row in rows if self._is_within(row, level)), key=lambda row: row.cpu)
        meshed = [row for row in by_cost if row.dofs]  # the cheapest method first
        formulas = "; ".join(f"{row.method}: {percent(row.worst)}" for row in by_cost if not row.dofs)
        cells = [percent(level), meshed[0].cost if meshed else "none"]
        for prefixes in (OURS, PEER_NAMES):  # the names of the product's methods, and of the peers' methods
            cheapest = next((row for row in meshed if row.method.startswith(prefixes)), None)
            if cheapest is None:
                cells.append("none")
            elif cheapest is meshed[0]:
                cells.append("the same")
            else:
                cells.append(f"{cheapest.cost}, {cheapest.cpu / meshed[0].cpu:.2g} times as much")
        return [*cells, formulas or "-"]

    def _is_within(self, row: Measurement, level: float) -> bool:
        """Return whether the error of a row, and its error bar if it has one, are at most `level` [1].

        The product's rows without an error bar are excluded, because their small error may be luck.
        """
        bar = row.error_bar
        if bar is None:
            bar = math.inf if row.method.startswith(OURS) else 0.0
        return max(row.worst, bar) <= level

    def _notes_on_bars(self, rows: Sequence[Measurement]) -> Iterator[str]:
        """Yield a note on each answer outside its error bar.

        The note states whether the error of the reference may explain this. An error bar belongs to the first value.
        """
        uncertainty = self.reference.errors[0] / abs(self.reference.values[0])  # relative error of the reference [1]
        for row in rows:
            if row.error_bar is None or not row.errors:
                continue
            error = abs(row.errors[0])
            if error <= row.error_bar:
                continue
            is_missed = error > row.error_bar + uncertainty
            yield (
                f"{row.method}, {row.mesh}: the error of {self.values[0]}, {percent(error)}, is outside "
                f"its error bar of {percent(row.error_bar)}. The reference is known to {percent(uncertainty)}, so "
                f"{'the bar is missed' if is_missed else 'this shows nothing'}."
            )


def time_call(work: Callable[[], T]) -> tuple[T, float]:
    """Call a function; return its result and the CPU time that it took [s]."""
    start = time.process_time()
    result = work()
    return result, time.process_time() - start


def print_measurements(rows: Iterable[Measurement]) -> None:
    """Print the rows of a benchmark that runs as a program, as JSON."""
    print(json.dumps([dataclasses.asdict(row) for row in rows], allow_nan=False))


def measurements_of(module: str) -> list[Measurement]:
    """Run a module as a program on one thread, and return its measurements; raises RuntimeError if it fails."""
    print(f"{module} ...", file=sys.stderr, flush=True)
    usage = resource_usage([sys.executable, "-m", module], ROOT, ONE_THREAD)
    if usage.exit_code:
        msg = f"{module} ended with exit code {usage.exit_code}: {usage.last_line}. Run it by itself to see its output."
        raise RuntimeError(msg)
    rows = json.loads(usage.out)
    return [Measurement(**{**row, "errors": tuple(row["errors"])}) for row in rows]


def section(title: str, heads: Sequence[str], rows: Iterable[Sequence[str]], notes: Sequence[str] = ()) -> str:
    """Return a table under its title with notes below it, as Markdown."""
    return "\n".join([f"### {title}", "", table(heads, rows), "", *(f"- {note}" for note in notes), ""])


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table as Markdown."""
    rule = ["---"] + ["---:"] * (len(heads) - 1)  # the first column is aligned to the left, the others to the right
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (heads, rule, *rows))


def write_section(title: str, introduction: str, sections: Sequence[str]) -> None:
    """Replace the section with this title in docs/measurements.md, and print it.

    The section ends at the next heading of its level, or at the end of the page. Raises ValueError if the page has no
    such section.
    """
    text = "\n".join([f"## {title}", "", introduction, "", *sections])
    page = MEASUREMENTS.read_text(encoding="utf-8")
    before, heading, section_and_after = page.partition(f"## {title}\n")
    if not heading:
        msg = f"docs/measurements.md has no section {title!r}. Add its heading."
        raise ValueError(msg)
    _, next_heading, after = section_and_after.partition("\n## ")
    MEASUREMENTS.write_text(f"{before}{text.rstrip()}\n{next_heading}{after}", encoding="utf-8")
    print(text)


def percent(value: float) -> str:
    """Return a relative number [1] as a percentage with two digits."""
    return f"{100.0 * value:.2g} %"


def signed_percent(value: float) -> str:
    """Return a relative number [1] as a percentage with two digits and its sign."""
    return f"{100.0 * value:+.2g} %"
