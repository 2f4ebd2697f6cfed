"""What the benches of contact and flexures share: a reference, rows held against it, a peer, a table, a program."""

import dataclasses
import itertools
import json
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from cad.quantity import fault
from pipeline.bench.calculix import CALCULIX, is_installed
from pipeline.bench.resources import ONE_THREAD, resource_usage
from pipeline.bench.table import Measurement, Sheet, percent, work_sheet
from pipeline.progress.announcement import announce
from solve.linear import SolveError

T = TypeVar("T")
ROOT = str(Path(__file__).parents[2])
QUICK = "--quick"


@dataclass(frozen=True, kw_only=True)
class Reference:
    """What should come out: values, how well they are known (errors, same unit), and who says so.

    Without values nobody could say it, and `source` is the reason.
    """

    values: tuple[float, ...]
    errors: tuple[float, ...]
    source: str


@dataclass(frozen=True, kw_only=True)
class Bench:
    """One bench: what is computed, the names and unit of its values, their reference, the product's method, its goal.

    `goal` is the relative error [1] at which the product is compared with peers; `families` are the methods whose
    rows are one family of meshes each.
    """

    name: str
    scene: str
    values: tuple[str, ...]
    unit: str
    reference: Reference
    ours: str
    goal: float
    families: tuple[str, ...]

    def row(
        self, method: str, mesh: str, values: Iterable[float], cpu: float, dofs: int, error_bar: float | None = None
    ) -> Measurement:
        """Return the row of a method with its relative errors [1] against the reference; CPU in seconds [s]."""
        errors = tuple(float(value / true - 1.0) for value, true in zip(values, self.reference.values, strict=True))
        return Measurement(method=method, mesh=mesh, cpu=cpu, errors=errors, dofs=dofs, error_bar=error_bar)

    def peer_rows(
        self, method: str, mesh: str, meshing: float, dofs: int, solve: Callable[[], tuple[Sequence[float], float]]
    ) -> Iterator[Measurement]:
        """Yield the row of CalculiX where it is installed: `solve` gives values and CPU seconds [s], or refuses."""
        if not is_installed():
            return
        try:
            values, cpu = solve()
        except SolveError as refusal:
            yield Measurement(method=method, mesh=mesh, cpu=meshing, errors=(), dofs=dofs, remark=str(refusal))
        else:
            yield self.row(method, mesh, values, meshing + cpu, dofs)

    def sheet(self, rows: Sequence[Measurement]) -> Sheet:
        """Return the table of error against work."""
        known = zip(self.values, self.reference.values, self.reference.errors, strict=True)
        reference = ", ".join(f"{name} {value:.6g} +- {error:.1g}" for name, value, error in known)
        notes = [
            f"{self.scene}; reference {reference} {self.unit} by {self.reference.source}",
            f"meshing included in the CPU seconds; error bar of {self.values[0]}",
            *self._against_peer(rows),
            *self._growth(rows),
        ]
        notes += [] if is_installed() else [f"not installed, so not measured: {CALCULIX}"]
        return work_sheet(self.name, f"{self.name.capitalize()}: work and precision", self.values, rows, notes)

    def _against_peer(self, rows: Sequence[Measurement]) -> Iterator[str]:
        """Compare our cheapest row, error and bar within the goal, with the cheapest peer there, or the nearest."""
        within = [row for row in rows if row.method == self.ours and max(row.worst, row.error_bar or 1.0) <= self.goal]
        peers = [row for row in rows if row.method.startswith("CalculiX") and row.errors]
        if not within or not peers:
            return
        reaching = [row for row in peers if row.worst <= self.goal]
        peer = min(reaching, key=lambda row: row.cpu) if reaching else min(peers, key=lambda row: row.worst)
        words = "cheapest peer within" if reaching else "nearest peer, none within"
        ours = min(within, key=lambda row: row.cpu)
        yield f"{ours.cost}; {words} {percent(self.goal)}: {peer.cost}, {peer.cpu / ours.cpu:.2g} times as much"

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
        raise fault(module, f"exit code {usage.exit_code}", "", bound, "run pipeline doctor")
    return [Measurement(**{**row, "errors": tuple(row["errors"])}) for row in json.loads(usage.out)]
