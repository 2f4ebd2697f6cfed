"""What the benches of contact and flexures share: a reference, rows held against it, a peer, a table, a program."""

import dataclasses
import itertools
import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from cad.quantity import validation_error
from pipeline.bench.peers import PEER_NAMES, absent_peers
from pipeline.bench.resources import ONE_THREAD, resource_usage
from pipeline.bench.table import Measurement, Sheet, percent, work_sheet
from pipeline.storage.announcement import announce
from solve.linear import SolveError

T = TypeVar("T")
ROOT = str(Path(__file__).parents[2])
QUICK = "--quick"
LEVELS = (0.1, 0.01, 1e-3, 1e-4)  # relative errors at which a winner is named


@dataclass(frozen=True, kw_only=True)
class Reference:
    """What should come out: values, how well they are known (errors, same unit), and who says so.

    Without values nobody could say it, and `source` is the reason.
    """

    values: tuple[float, ...]
    errors: tuple[float, ...]
    source: str

    @property
    def relative_error(self) -> float:
        """Return the largest error over its value [1]."""
        return max(error / abs(value) for value, error in zip(self.values, self.errors, strict=True))


@dataclass(frozen=True, kw_only=True)
class Bench:
    """One bench: what is computed, the names and unit of its values, their reference, the product's method.

    `families` are the methods whose rows are one family of meshes each.
    """

    name: str
    scene: str
    values: tuple[str, ...]
    unit: str
    reference: Reference
    ours: str
    families: tuple[str, ...]

    def row(
        self, method: str, mesh: str, values: Iterable[float], cpu: float, dofs: int, error_bar: float | None = None
    ) -> Measurement:
        """Return the row of a method with its relative errors [1] against the reference; CPU in seconds [s]."""
        errors = tuple(float(value / true - 1.0) for value, true in zip(values, self.reference.values, strict=True))
        return Measurement(method=method, mesh=mesh, cpu=cpu, errors=errors, dofs=dofs, error_bar=error_bar)

    def peer_row(
        self, method: str, mesh: str, meshing: float, solve: Callable[[], tuple[Sequence[float], float, int]]
    ) -> Measurement:
        """Return the row of a peer: `solve` gives values, CPU seconds [s] and dofs, or refuses."""
        try:
            values, cpu, dofs = solve()
        except SolveError as refusal:
            return Measurement(method=method, mesh=mesh, cpu=meshing, errors=(), remark=str(refusal))
        return self.row(method, mesh, values, meshing + cpu, dofs)

    def sheet(self, rows: Sequence[Measurement]) -> Sheet:
        """Return the table of error against work."""
        known = zip(self.values, self.reference.values, self.reference.errors, strict=True)
        reference = ", ".join(f"{name} {value:.6g} +- {error:.1g}" for name, value, error in known)
        absent = absent_peers()
        notes = [
            f"{self.scene}; reference {reference} {self.unit} by {self.reference.source}",
            f"meshing included in the CPU seconds; error bar of {self.values[0]}",
            "each level counts every row with dofs by its error, and by its error bar where it states one",
            *(self._winner(rows, level) for level in LEVELS if level >= self.reference.relative_error),
            *self._outside(rows),
            *self._growth(rows),
        ]
        notes += [f"not installed, so not measured: {', '.join(absent)}"] if absent else []
        return work_sheet(self.name, f"{self.name.capitalize()}: work and precision", self.values, rows, notes)

    def _winner(self, rows: Sequence[Measurement], level: float) -> str:
        """Say who is cheapest within a relative error [1], and what the product and the cheapest peer take there.

        A formula, which has no dofs and takes no time, is named beside them.
        """
        near = sorted((row for row in rows if self._is_within(row, level)), key=lambda row: row.cpu)
        within = [row for row in near if row.dofs]
        formulas = "".join(f"; without a mesh: {row.method} at {percent(row.worst)}" for row in near if not row.dofs)
        if not within:
            return f"within {percent(level)}: nobody{formulas}"
        first = within[0]
        said = f"within {percent(level)} wins {first.cost}"
        for name, methods in (("the product", self.ours), ("the cheapest peer", PEER_NAMES)):
            found = next((row for row in within if row.method.startswith(methods)), None)
            if found is None:
                said += f"; {name} is not there"
            elif found is not first:
                said += f"; {name}: {found.cost}, {found.cpu / first.cpu:.2g} times as much"
        return said + formulas

    def _is_within(self, row: Measurement, level: float) -> bool:
        """Say whether a row has a relative error [1]: by the reference, and by its error bar where it states one.

        The product must state one: what it does not vouch for may be luck.
        """
        unstated = math.inf if row.method == self.ours else 0.0
        bar = unstated if row.error_bar is None else row.error_bar
        return max(row.worst, bar) <= level

    def _outside(self, rows: Sequence[Measurement]) -> Iterator[str]:
        """Say which answers are outside the error bar that they state, and whether the reference can tell."""
        name, known = self.values[0], self.reference.errors[0] / abs(self.reference.values[0])
        for row in rows:
            if row.error_bar is not None and row.errors and abs(row.errors[0]) > row.error_bar:
                sure = abs(row.errors[0]) > row.error_bar + known
                told = "the bar is missed" if sure else "it cannot tell"
                yield (
                    f"{row.method}, {row.mesh}: the error of {name}, {percent(abs(row.errors[0]))}, is outside its "
                    f"error bar of {percent(row.error_bar)}; the reference is known to {percent(known)}, so {told}"
                )

    def _growth(self, rows: Sequence[Measurement]) -> Iterator[str]:
        """Say how error falls and time grows with dofs over each family of meshes, by least squares of logarithms."""
        for method in self.families:
            family = [(row.dofs, row.worst, row.cpu) for row in rows if row.method == method and row.errors]
            if len(family) > 1:
                dofs, error, cpu = np.log(np.transpose(family))
                falls, grows = (float(np.polyfit(dofs, logarithm, 1)[0]) for logarithm in (error, cpu))
                yield f"{method}: error ~ dofs^{falls:.2f}, CPU ~ dofs^{grows:.2f}"


def timed(work: Callable[[], T]) -> tuple[T, float]:
    """Return what a piece of work gives, and its CPU seconds [s]."""
    start = time.process_time()
    result = work()
    return result, time.process_time() - start


def print_measurements(rows: Iterable[Measurement], quick_rows: int) -> None:
    """Measure in this process and print JSON: every row, or the first ones where the command line says so."""
    asked = itertools.islice(rows, quick_rows) if QUICK in sys.argv else rows
    print(json.dumps([dataclasses.asdict(row) for row in asked], allow_nan=False))


def measurements_of(module: str, *, quick: bool) -> list[Measurement]:
    """Return what a module measures as a program on one thread; raises InputError when it does not end well."""
    paths = os.pathsep.join(filter(None, (ROOT, os.environ.get("PYTHONPATH", ""))))
    command = [sys.executable, "-m", module, *([QUICK] if quick else [])]
    announce(f"bench: {module.rpartition('.')[2]}, beside other methods")
    usage = resource_usage(command, environment={**ONE_THREAD, "PYTHONPATH": paths})
    if usage.exit_code:
        bound = f"0; it says: {usage.last_line}"
        raise validation_error(module, f"exit code {usage.exit_code}", "", bound, "run pipeline doctor")
    return [Measurement(**{**row, "errors": tuple(row["errors"])}) for row in json.loads(usage.out)]
