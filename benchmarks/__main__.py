"""Speed against error: contact, unilateral contact and flexures beside peers, and the cost of the whole command.

`python -m benchmarks` writes docs/benchmarks.md and docs/benchmarks.svg.
"""

import os
import platform

from benchmarks import contact, flexure, unilateral
from benchmarks.command import command_section
from benchmarks.harness import ROOT, measurements_of, write_page
from benchmarks.plot import error_over_cost

INTRODUCTION = """\
This page is written by `make bench`; only its table of direct solvers is typed. Each method solves the same task; the
tables say how far its answer is from a reference and what it cost. CPU seconds are on one thread, imports not counted.
Measured on {cores} cores (load before it began: {load:.1f}), Python {python}.

A peer that is not installed is named. `make bench-peers` installs all but CalculiX; GetFEM comes from Debian, which it
can install only as root: else root runs `apt-get install --yes --no-install-recommends python3-getfem`. felupe
assembles, and SciPy's SuperLU solves for it: in its symmetric mode, like ours, and with one factor for all steps that
hold the same nodes.

![error against CPU seconds](benchmarks.svg)"""
DIRECT_SOLVERS = """\
## Direct solvers

SuperLU is the only direct solver. CHOLMOD, by cvxopt 1.3.3, was measured on the twelve matrices that the default run
factorises, on one thread. It was to save at least 10 % of the 9.5 to 11 CPU seconds of that run, and was not adopted.
Cvxopt is no peer that `make bench-peers` installs: these numbers were measured once.

| direct solver | CPU s | saved of the run |
| --- | ---: | ---: |
| SuperLU | 1.38 |  |
| CHOLMOD, each matrix made from triplets | 1.1 | 3 % |
| CHOLMOD, four patterns used again | 1.0 | 4 % |
"""


def main() -> None:
    """Measure everything and write the page."""
    introduction = INTRODUCTION.format(cores=os.cpu_count(), load=os.getloadavg()[0], python=platform.python_version())
    measured = {module.BENCH: measurements_of(module.__name__) for module in (contact, unilateral, flexure)}
    sections = [bench.section(rows) for bench, rows in measured.items()]
    sections += [DIRECT_SOLVERS, command_section()]
    docs = ROOT / "docs"
    plot = error_over_cost({bench.name: rows for bench, rows in measured.items()})
    (docs / "benchmarks.svg").write_text(plot, encoding="utf-8")
    write_page(docs / "benchmarks.md", "Speed against error", introduction, sections)


if __name__ == "__main__":
    main()
