"""Hard cases: each ends in a right answer inside its error bar, or in a refusal that names the cause; nothing else.

`python -m benchmarks.hard_cases` runs all, writes docs/measurements.md and exits with 1 where one is wrong.
"""

import sys
import tomllib
from collections import Counter
from functools import partial
from pathlib import Path

from benchmarks.hard.contact import compliance_checks, paper_checks
from benchmarks.hard.flexure import design_checks, grounded_checks, jittered_checks, leaf_checks
from benchmarks.hard.press import level_checks, press_checks
from benchmarks.hard.reference_check import ending
from benchmarks.harness import percent, section, write_section
from sensor.design.fruit import Fruit
from sensor.design.parameters import Targets
from sensor.design.tips import Press, Tips

CHECKS = {
    "paper": paper_checks,
    "contact": compliance_checks,
    "level press": level_checks,
    "press": press_checks,
    "leaf": leaf_checks,
    "design": design_checks,
    "moved nodes": jittered_checks,
    "clamp": grounded_checks,
}
ANSWERABLE = ("paper", "level press")
TABLES = {"fruit": Fruit, "tips": Tips, "press": Press, "targets": Targets}
INTRODUCTION = """\
`python -m benchmarks.hard_cases` writes this section. The cases are built to break the solvers. They have nearly
incompressible flesh, tips that almost touch, thin fruit, extreme springs, damaged meshes, and a part that is hardly
held. Each case must end in a right answer or in a refusal that says why. A right answer lies within its error bar of
an independent reference."""
HEADS = ["case", "number", "error bar", "off, of what is allowed", "verdict", "compared with, or reason"]
NOTES = [
    "Allowed is the error bar plus the error of the reference. A closed formula, a target, and a reference with at "
    "least four times the dofs count as exact.",
    "Without a reference: the independent computation refused, so the value is not judged.",
]


def every_case():
    """Yield the name of each case, the work that ends in its checks, and whether an answer is promised."""
    text = (Path(__file__).parent / "hard" / "cases.toml").read_text(encoding="utf-8")
    for group, lines in tomllib.loads(text).items():
        for what, changes in lines.items():
            yield f"{group}: {what}", partial(checked, group, changes), group in ANSWERABLE


def checked(group, changes):
    """Return the checks of a case: what its tables of a design refuse counts as its end."""
    return CHECKS[group](**{key: TABLES[key](**value) if key in TABLES else value for key, value in changes.items()})


CASES = {name: (work, answerable) for name, work, answerable in every_case()}


def main():
    """Evaluate every case and write the page."""
    count = Counter()
    rows = []
    for name, case in CASES.items():
        found = ending(*case)
        count[found.verdict] += 1
        numbers = ["-", "-", "-"]
        if found.check:
            off = "-" if found.check.reference is None else percent(found.check.excess)
            numbers = [found.check.name, percent(found.check.relative_error), off]
        rows.append([name, *numbers, found.verdict, found.reason])
    title = ", ".join(f"{number} {verdict}" for verdict, number in count.items())
    table = section(title, HEADS, rows, NOTES)
    write_section("Hard cases", INTRODUCTION, [table])
    return 1 if count["WRONG"] else 0


if __name__ == "__main__":
    sys.exit(main())
