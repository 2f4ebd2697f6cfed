"""Hard cases: each ends in a right answer inside its error bar, or in a refusal that names the cause; nothing else."""

import dataclasses
import json
import math
import sys
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from cad.design.fruit import Fruit
from cad.design.parameters import Targets
from cad.design.tips import Press, Tips
from pipeline.bench.hard.contact import compliance_checks, paper_checks
from pipeline.bench.hard.flexure import design_checks, grounded_checks, jittered_checks, leaf_checks
from pipeline.bench.hard.press import level_checks, press_checks
from pipeline.bench.hard.reference_check import HardCase, Outcome, ReferenceCheck, evaluate
from pipeline.bench.table import Sheet, page, percent, publish, signed_percent
from pipeline.storage.announcement import announce, fresh_line
from pipeline.storage.placed_files import refuse_taken

OUT = Path("outputs") / "bench"
FILES = ("hard-cases.md", "hard.json")
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
PARTS = {"fruit": Fruit, "tips": Tips, "press": Press, "targets": Targets}
INTRODUCTION = """\
This page is written by `pipeline bench --hard`, never typed. The cases are meant to break the solvers: nearly
incompressible flesh, tips that almost touch, thin fruit, extreme springs, damaged meshes, a part that is hardly held.
Each must end in a right answer, one that lies within its error bar of an independent reference, or in a refusal that
says why. A wrong answer makes the command fail."""
HEADS = ("case", "value", "error bar", "reference", "its error", "difference", "verdict", "judged by, or reason")
NOTES = (
    "right: the difference is at most the error bar and the reference's own error together",
    "a reference's error of 0 %: a closed formula, a target, or at least four times the dofs, to which none is granted",
    "no reference: the computation that should judge refused; this says nothing about the value",
)


def hard(*, as_json: bool, out: Path = OUT, cases: Iterable[HardCase] | None = None, force: bool = False) -> int:
    """Evaluate every case, print them or JSON, write hard-cases.md and hard.json; return 0, or 1 where one is wrong.

    Raises InputError where the folder has other files of these names and `force` does not keep them as NAME.bak.
    """
    if not force:
        refuse_taken(out, FILES, "--out")
    outcomes = []
    for case in every_case() if cases is None else cases:
        announce(f"hard case: {case.name}")
        outcomes.append(evaluate(case))
        print(f"{fresh_line()}  {outcomes[-1].verdict:12} {case.name}", file=sys.stderr, flush=True)
    sheet = hard_sheet(outcomes)
    text = json.dumps({"schema": 1, "cases": list(sheet.records)}, indent=2, allow_nan=False)
    files = dict(zip(FILES, (page("Hard cases", INTRODUCTION, sheet.markdown()), text + "\n"), strict=True))
    publish(out, files, as_json=as_json, force=force)
    return 1 if any(outcome.verdict == "WRONG" for outcome in outcomes) else 0


def every_case() -> Iterator[HardCase]:
    """Yield the cases of cases.toml, each line with the function that checks its group."""
    for group, lines in tomllib.loads(CASES.read_text(encoding="utf-8")).items():
        for what, changes in lines.items():
            work = partial(_checked, CHECKS[group], changes)
            yield HardCase(name=f"{group}: {what}", work=work, answerable=group in ANSWERABLE)


def _checked(check: Callable[..., Sequence[ReferenceCheck]], changes: Mapping[str, Any]) -> Sequence[ReferenceCheck]:
    return check(**{key: PARTS[key](**value) if key in PARTS else value for key, value in changes.items()})


def hard_sheet(outcomes: Sequence[Outcome]) -> Sheet:
    """Return the table of the outcomes."""
    count = Counter(outcome.verdict for outcome in outcomes)
    rows = [(one.case, *_numbers(one.check), one.verdict, one.reason) for one in outcomes]
    title = f"{count['right']} right, {count['refused']} refused, {count['no reference']} without a reference"
    return Sheet(
        name="hard",
        title=f"{title}, {count['WRONG']} wrong",
        heads=HEADS,
        rows=tuple(rows),
        notes=NOTES,
        records=tuple(dataclasses.asdict(one, dict_factory=_finite) for one in outcomes),
    )


def _numbers(check: ReferenceCheck | None) -> tuple[str, ...]:
    """Return value, error bar, reference, its error and the difference in words, all errors relative to the value."""
    if check is None:
        return ("-",) * 5
    value, bar, scale = f"{check.name} {check.value:.6g}", percent(check.relative_error), abs(check.value) or 1.0
    if check.reference is None:
        return value, bar, "-", "-", "-"
    difference = signed_percent((check.value - check.reference) / scale)
    return value, bar, f"{check.reference:.6g}", percent(check.reference_error / scale), difference


def _finite(items: list[tuple[str, object]]) -> dict[str, object]:
    return {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in items}
