"""Test of the error bars: each case must give an answer within its error bar, or an error message that names the cause.

`python -m benchmarks.bars` runs all cases of bars.toml, writes docs/measurements.md and exits with 1 if one is wrong.
With names of groups as arguments, it runs and prints only these groups.
"""

import sys
from collections import Counter

from benchmarks.bars.check import ReferenceCheck, case_outcome
from benchmarks.bars.table import CASES
from benchmarks.harness import percent, section, write_section

INTRODUCTION = """\
`python -m benchmarks.bars` writes this section. `benchmarks/bars/bars.toml` holds its cases. Most are built to
break the solvers. They have nearly incompressible flesh, tips that almost touch, thin fruit, extreme springs, damaged
meshes, and a part that is nearly free. Each case must end in a right answer, or in a refusal with its reason. A right
answer lies within its error bar of an independent reference."""
HEADS = ["case", "number", "error bar", "difference, of what is allowed", "verdict", "compared with, or reason"]
NOTES = [
    "A difference of the error bar plus the error of the reference is allowed. A closed formula, a target, and a "
    "reference with at least four times the dofs are taken as exact.",
    "Skins have bars of 0.3 to 1 %, which are for all tips and layers. Here at most 0.3 % are allowed.",
    "Without a reference: the independent computation refused, so the value is not judged.",
]


def main() -> int:
    """Run all cases, or only the groups named on the command line, and write the page. Return the exit code.

    The exit code is 1 if a case is wrong, else 0. With named groups, the table is only printed.
    """
    groups = sys.argv[1:]
    verdict_counts: Counter[str] = Counter()
    rows = []
    for name, case in CASES.items():
        if groups and name.partition(":")[0] not in groups:  # the name of a case is "group: case"
            continue
        outcome = case_outcome(*case)
        verdict_counts[outcome.verdict] += 1
        rows.append([name, *_check_cells(outcome.check), outcome.verdict, outcome.reason])
    title = ", ".join(f"{number} {verdict}" for verdict, number in verdict_counts.items())
    table = section(title, HEADS, rows, NOTES)
    if groups:
        print(table)
    else:
        write_section("Error bars beside the truth", INTRODUCTION, [table])
    return 1 if verdict_counts["WRONG"] else 0


def _check_cells(check: ReferenceCheck | None) -> list[str]:
    """Return three table cells: the name of a value, its error bar, and its deviation relative to the allowed one.

    All cells are "-" if there is no check, because the case ended in an error. The last cell is "-" if the check has no
    reference.
    """
    if check is None:
        return ["-", "-", "-"]
    deviation = "-" if check.reference is None else percent(check.excess)
    return [check.name, percent(check.relative_error), deviation]


if __name__ == "__main__":
    sys.exit(main())
