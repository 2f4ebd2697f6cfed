"""Hard cases: each ends in a right answer inside its error bar, or in a refusal that names the cause; nothing else.

`PYTHONPATH=.:tests python -m hard.test_hard_cases` runs all, writes docs/hard-cases.md and exits with 1 where one is
wrong.
"""

import sys
import tomllib
from collections import Counter
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hard.contact import compliance_checks, paper_checks
from hard.flexure import design_checks, grounded_checks, jittered_checks, leaf_checks
from hard.press import level_checks, press_checks
from hard.reference_check import ReferenceCheck, attempted, checks, ending
from hypothesis import given, settings
from hypothesis import strategies as st

import solve.fruit.remainder
from benchmarks.contact import pair_and_own
from benchmarks.harness import Reference, percent, section, write_page
from cad.design.fruit import Fruit
from cad.design.parameters import Targets
from cad.design.tips import Press, Tips
from cad.quantity import InputError
from mesh.session import MeshError
from pipeline.response.contact import contact_compliance
from solve.linear import SolveError

ROOT = Path(__file__).parents[2]
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
QUICK = (
    "level press: ", "press: tilt 21 deg", "paper: split", "contact: tip 10 mm on the paper",
    "design: E_max", "leaf: L/t 1.2", "clamp: ", "moved nodes: inner ones by 0.3",
)  # fmt: skip
INTRODUCTION = """\
This page is written by `PYTHONPATH=.:tests python -m hard.test_hard_cases`, never typed. The cases are meant to break
the solvers: nearly incompressible flesh, tips that almost touch, thin fruit, extreme springs, damaged meshes, a part
that is hardly held. Each must end in a right answer, one that lies within its error bar of an independent reference,
or in a refusal that says why."""
HEADS = ["case", "number", "error bar", "off, of what is allowed", "verdict", "compared with, or reason"]
NOTES = [
    "allowed: the error bar and the reference's own error together; a closed formula, a target, and a reference of at "
    "least four times the dofs count as exact",
    "no reference: the computation that should tell refused; this says nothing about the value",
]


def every_case():
    """Yield the name of each case, the work that ends in its checks, and whether an answer is promised."""
    text = Path(__file__).with_name("cases.toml").read_text(encoding="utf-8")
    for group, lines in tomllib.loads(text).items():
        for what, changes in lines.items():
            yield f"{group}: {what}", partial(checked, group, changes), group in ANSWERABLE


def checked(group, changes):
    """Return the checks of a case: what its tables of a design refuse counts as its end."""
    return CHECKS[group](**{key: TABLES[key](**value) if key in TABLES else value for key, value in changes.items()})


CASES = {name: (work, answerable) for name, work, answerable in every_case()}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name.startswith(QUICK) else pytest.mark.study) for name in CASES]
)
def test_a_hard_case_is_right_or_refused(name):
    found = ending(*CASES[name])
    assert found.verdict != "WRONG", found.reason


def check(**changed):
    whole = {"name": "s", "value": 1.0, "error": 1e-3, "reference": 1.0005, "reference_error": 0.0, "source": "formula"}
    return ReferenceCheck(**{**whole, **changed})


@pytest.mark.parametrize(
    ("values", "verdict"),
    [
        ([check(), check(reference=1.0001)], "right"),
        ([check(reference=1.002, reference_error=1.1e-3)], "right"),
        ([check(reference=None)], "no reference"),
        ([check(), check(reference=1.002)], "WRONG"),
        ([check(reference=None), check(reference=2.0)], "WRONG"),
        ([check(error=0.0)], "WRONG"),
        ([check(error=0.2)], "WRONG"),
        ([check(value=float("nan"))], "WRONG"),
    ],
)
def test_a_case_is_right_only_inside_its_bar(values, verdict):
    assert ending(lambda: values, False).verdict == verdict


@pytest.mark.parametrize(
    ("error", "answerable", "verdict"),
    [
        (InputError("tips.side_mm = 9 mm: must be less than 8 mm; move them"), False, "refused"),
        (InputError("tips.side_mm = 9 mm: must be less than 8 mm; move them"), True, "WRONG"),
        (SolveError("it failed"), False, "WRONG"),
        (SolveError("two\nlines: must be one"), False, "WRONG"),
    ],
)
def test_a_case_is_refused_only_with_a_cause(error, answerable, verdict):
    def work():
        raise error

    assert ending(work, answerable).verdict == verdict


def test_a_refusal_of_the_reference_does_not_count_against_the_product():
    def refuses():
        raise MeshError("volume", "finer mesh", "none")

    found = ending(lambda: checks(("s",), (1.0,), (1e-3,), attempted(refuses)), True)
    assert (found.verdict, found.check.value, found.check.reference) == ("no reference", 1.0, None)


@pytest.mark.usefixtures("wrong_traction")
def test_wrong_sign_in_a_traction_fails_by_reciprocity_and_without_it_by_the_reference(monkeypatch):
    assert "loads differ from their reciprocals" in ending(*CASES["paper: split"]).reason
    monkeypatch.setattr(solve.fruit.remainder, "RECIPROCITY_LIMIT", np.inf)
    assert ending(*CASES["paper: split"]).verdict == "WRONG"


SIZES = st.floats(-1.5, 1.9).map(lambda power: 10.0**power)


@pytest.mark.study
@settings(max_examples=25)
@given(
    block=st.tuples(SIZES, SIZES, SIZES),
    side=st.floats(-2.0, 1.0).map(lambda power: 10.0**power),
    spacing=st.floats(1.01, 20.0),
    offset=st.floats(-2.0, 2.0),
    poisson=st.one_of(st.floats(-0.6, 0.49), st.floats(0.49, 0.49999)),
)
def test_random_designs_have_no_third_kind_of_end(block, side, spacing, offset, poisson):
    """The same scene ten times as large has a tenth of the compliance, or is refused."""

    def solved(scale):
        length, width, height = (scale * size for size in block)
        fruit = Fruit(length_mm=length, width_mm=width, height_mm=height, poisson=poisson)
        tips = Tips(side_mm=scale * side, spacing_mm=scale * spacing * side, offset_mm=scale * offset * side)
        return contact_compliance(fruit, tips, "split")

    def work():
        small = solved(1.0)
        own = small.error_own
        assert pair_and_own(small.S)[1] == small.S[0, 0]
        scaled = Reference(values=tuple(10.0 * solved(10.0).S.diagonal()), errors=(), source="scaled")
        return checks(("s11", "s22"), small.S.diagonal(), (own, own), scaled)

    found = ending(work, False)
    assert found.verdict != "WRONG", found.reason


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
    write_page(ROOT / "docs" / "hard-cases.md", "Hard cases", INTRODUCTION, [table])
    return 1 if count["WRONG"] else 0


if __name__ == "__main__":
    sys.exit(main())
