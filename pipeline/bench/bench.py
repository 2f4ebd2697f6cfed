"""The bench: work and precision of contact and flexures beside a peer, and the cost of the whole command."""

import json
import os
import platform
from pathlib import Path

from pipeline.bench import contact, flexure, unilateral
from pipeline.bench.command.runs import command_sheets
from pipeline.bench.harness import measurements_of
from pipeline.bench.plot import error_over_cost
from pipeline.bench.table import page, publish
from pipeline.storage.placed_files import refuse_taken
from solve.linear import solver_in_words

OUT = Path("outputs") / "bench"
FILES = ("benchmarks.md", "benchmarks.svg", "bench.json")
MODULES = (contact, unilateral, flexure)
INTRODUCTION = """\
This page is written by `pipeline bench`, never typed. Each method solves the same task; the tables say how far its
answer is from a reference and what it cost. CPU seconds are on one thread, imports not counted. Measured on {cores}
cores (load before it began: {load}), Python {python}; our own finite elements are solved by {solver}. All of it took
{cpu_s} CPU seconds.

A peer that is not installed is named. `make bench-peers` installs all but CalculiX; GetFEM comes from Debian, which it
can install only as root: else root runs `apt-get install --yes --no-install-recommends python3-getfem`. felupe and
sfepy assemble, and SciPy's SuperLU solves for them: in its symmetric mode, like ours, and with one factor for all steps
that hold the same nodes.

![error against CPU seconds](benchmarks.svg)"""


def bench(*, as_json: bool, out: Path = OUT, quick: bool = False, force: bool = False) -> int:
    """Measure, print the page or JSON, write benchmarks.md, benchmarks.svg and bench.json into a folder; return 0.

    `quick` leaves out the peer, fine meshes and the command. Raises InputError when a measurement does not end well or
    the folder cannot be written; with `force` other files of these names are kept as NAME.bak.
    """
    if not force:
        refuse_taken(out, FILES, "--out")
    machine = _machine()
    measured = {module.BENCH: measurements_of(module.__name__, quick=quick) for module in MODULES}
    sheets = [kind.sheet(rows) for kind, rows in measured.items()]
    sheets += [] if quick else command_sheets()
    machine["cpu_s"] = round(sum(os.times()[:4]))  # of this process and of those that it waited for
    records = {sheet.name: {"records": list(sheet.records), "notes": list(sheet.notes)} for sheet in sheets}
    tables = [sheet.markdown() for sheet in sheets]
    texts = (
        page("Speed against error", INTRODUCTION.format(**machine), *tables),
        error_over_cost({kind.name: rows for kind, rows in measured.items()}),
        json.dumps({"schema": 1, "machine": machine, **records}, indent=2, allow_nan=False) + "\n",
    )
    files = dict(zip(FILES, texts, strict=True))
    publish(out, files, as_json=as_json, force=force)
    return 0


def _machine() -> dict[str, int | str | None]:
    """Return what the numbers hang on beside the code; the load is that of the last minute before."""
    return {
        "cores": os.cpu_count(),
        "processor": platform.machine(),
        "python": platform.python_version(),
        "load": f"{os.getloadavg()[0]:.1f}",
        "solver": solver_in_words(),
    }
