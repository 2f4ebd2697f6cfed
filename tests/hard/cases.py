"""Hard cases: each ends in a right answer inside its error bar, or in a refusal that names the cause; nothing else.

`python tests/hard/cases.py` runs all of them, writes docs/hard-cases.md and exits with 1 where one is wrong.
"""

import sys
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).parents[2]
if __name__ == "__main__":
    sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from hard.contact import compliance_checks, paper_checks  # noqa: E402
from hard.flexure import design_checks, grounded_checks, jittered_checks, leaf_checks  # noqa: E402
from hard.press import level_checks, press_checks  # noqa: E402
from hard.reference_check import HardCase, Outcome, ReferenceCheck, evaluate  # noqa: E402

from benchmarks.harness import percent, section, write_page  # noqa: E402
from cad.design.fruit import Fruit  # noqa: E402
from cad.design.parameters import Targets  # noqa: E402
from cad.design.tips import Press, Tips  # noqa: E402

CASES = Path(__file__).with_name("cases.toml")
CHECKS: Mapping[str, Callable[..., Sequence[ReferenceCheck]]] = {
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
This page is written by `python tests/hard/cases.py`, never typed. The cases are meant to break the solvers: nearly
incompressible flesh, tips that almost touch, thin fruit, extreme springs, damaged meshes, a part that is hardly held.
Each must end in a right answer, one that lies within its error bar of an independent reference, or in a refusal that
says why."""
HEADS = ["case", "number", "error bar", "off, of what is allowed", "verdict", "compared with, or reason"]
NOTES = [
    "allowed: the error bar and the reference's own error together; a closed formula, a target, and a reference of at "
    "least four times the dofs count as exact",
    "no reference: the computation that should tell refused; this says nothing about the value",
]


def every_case() -> Iterator[HardCase]:
    """Yield the cases of cases.toml, each line with the function that checks its group."""
    for group, lines in tomllib.loads(CASES.read_text(encoding="utf-8")).items():
        for what, changes in lines.items():

            def work(group: str = group, changes: Mapping[str, object] = changes) -> Sequence[ReferenceCheck]:
                values = {key: TABLES[key](**value) if key in TABLES else value for key, value in changes.items()}
                return CHECKS[group](**values)

            yield HardCase(name=f"{group}: {what}", work=work, answerable=group in ANSWERABLE)


def cells(outcome: Outcome) -> list[str]:
    """Return the row of a case: the error bar relative to the value."""
    check = outcome.check
    if check is None:
        return [outcome.case, "-", "-", "-", outcome.verdict, outcome.reason]
    off = "-" if check.reference is None else percent(check.excess)
    return [outcome.case, check.name, percent(check.relative_error), off, outcome.verdict, outcome.reason]


def main() -> int:
    """Evaluate every case and write the page."""
    outcomes = []
    for case in every_case():
        outcomes.append(evaluate(case))
        print(f"{outcomes[-1].verdict:12} {case.name}", file=sys.stderr, flush=True)
    count = Counter(outcome.verdict for outcome in outcomes)
    title = ", ".join(f"{number} {verdict}" for verdict, number in count.items())
    table = section(title, HEADS, map(cells, outcomes), NOTES)
    write_page(ROOT / "docs" / "hard-cases.md", "Hard cases", INTRODUCTION, [table])
    return 1 if count["WRONG"] else 0


if __name__ == "__main__":
    sys.exit(main())
