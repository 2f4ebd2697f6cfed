"""Speed against error: contact, unilateral contact and flexures compared with peers, and the cost of the whole command.

`python -m benchmarks` writes docs/measurements.md and docs/benchmarks.svg.
"""

import os
import platform

from benchmarks import contact, flexure, unilateral
from benchmarks.command import command_section
from benchmarks.harness import ROOT, measurements_of, write_section
from benchmarks.plot import error_over_cost

INTRODUCTION = """\
`make bench` writes this section. Each method solves the same task. The tables give the error of each answer against a
reference, and its cost. CPU seconds are on one thread, without imports. Measured on {cores} cores (load at the start:
{load:.1f}), Python {python}.

A program that is not installed is named below the table. `make bench-peers` installs all but CalculiX. GetFEM is a
Debian package, which only root can install: `apt-get install --yes --no-install-recommends python3-getfem`. felupe
assembles only; SciPy's SuperLU solves for it, in its symmetric mode, as in our solver. It uses one factor for all steps
that hold the same nodes.

![error against CPU seconds](benchmarks.svg)"""


def main() -> None:
    """Measure all methods and the command, and write their section and its plot."""
    introduction = INTRODUCTION.format(cores=os.cpu_count(), load=os.getloadavg()[0], python=platform.python_version())
    measured = {module.BENCH: measurements_of(module.__name__) for module in (contact, unilateral, flexure)}
    sections = [bench.section(rows) for bench, rows in measured.items()]
    sections.append(command_section())
    docs = ROOT / "docs"
    plot = error_over_cost({bench.name: rows for bench, rows in measured.items()})
    (docs / "benchmarks.svg").write_text(plot, encoding="utf-8")
    write_section("Speed against error", introduction, sections)


if __name__ == "__main__":
    main()
