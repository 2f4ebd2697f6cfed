"""The hard suite: right inside the bar or refused with a cause, and planted errors that make it fail."""

import dataclasses
import warnings

import numpy as np
import pytest
from hard.cases import every_case
from hard.reference_check import HardCase, ReferenceCheck, attempted, checks, evaluate
from hypothesis import given, settings
from hypothesis import strategies as st

import solve.fruit.direct
import solve.fruit.remainder
from benchmarks.contact import pair_and_own
from benchmarks.harness import Reference
from cad.design.fruit import Fruit
from cad.design.tips import Tips
from cad.quantity import InputError
from mesh.session import MeshError
from pipeline.response.contact import contact_compliance
from solve.linear import SolveError

QUICK = (
    "level press: ", "press: tilt -5 deg", "press: tilt 21 deg", "paper: split", "contact: tip 10 mm on the paper",
    "design: E_max", "leaf: L/t 1.2", "clamp: ", "moved nodes: inner ones by 0.3",
)  # fmt: skip


def check(**changed):
    whole = {"name": "s", "value": 1.0, "error": 1e-3, "reference": 1.0005, "reference_error": 0.0, "source": "formula"}
    return ReferenceCheck(**{**whole, **changed})


def outcome(work, **changed):
    return evaluate(HardCase(name="g: w", work=work, **changed))


def raising(error):
    def work():
        raise error

    return work


def case(name):
    return next(case for case in every_case() if case.name == name)


@pytest.mark.parametrize(
    "case",
    [pytest.param(c, id=c.name, marks=() if c.name.startswith(QUICK) else pytest.mark.study) for c in every_case()],
)
def test_a_hard_case_is_right_or_refused(case):
    found = evaluate(case)
    assert found.verdict != "WRONG", found.reason


@pytest.mark.parametrize(
    ("work", "verdict"),
    [
        (lambda: [check(), check(reference=1.0001)], "right"),
        (lambda: [check(reference=1.002, reference_error=1.1e-3)], "right"),
        (lambda: [check(reference=None)], "no reference"),
        (lambda: [check(), check(reference=1.002)], "WRONG"),
        (lambda: [check(reference=None), check(reference=2.0)], "WRONG"),
        (lambda: [check(error=0.0)], "WRONG"),
        (lambda: [check(error=0.2)], "WRONG"),
        (lambda: [check(value=0.0, reference=0.0)], "WRONG"),
        (lambda: [check(value=float("nan"))], "WRONG"),
        (lambda: [check(error=float("inf"))], "WRONG"),
        (list, "WRONG"),
        (raising(InputError("tips.side_mm = 9 mm: must be less than 8 mm; move them")), "refused"),
        (raising(SolveError("it failed")), "WRONG"),
        (raising(SolveError("two\nlines: must be one")), "WRONG"),
        (raising(ZeroDivisionError("x")), "WRONG"),
        (raising(SystemExit(3)), "WRONG"),
        (lambda: warnings.warn("overflow", RuntimeWarning, stacklevel=1), "WRONG"),
    ],
)
def test_a_case_is_right_only_inside_its_bar_and_refused_only_with_a_cause(work, verdict):
    assert outcome(work).verdict == verdict


def test_a_refusal_is_wrong_where_an_answer_is_promised():
    assert outcome(raising(InputError("x = 9: must be less than 8; move it")), answerable=True).verdict == "WRONG"


def test_a_refusal_of_the_reference_does_not_count_against_the_product():
    reference = attempted(raising(MeshError("volume", "finer mesh", "none")))
    found = outcome(lambda: checks(("s",), (1.0,), (1e-3,), reference), answerable=True)
    assert (found.verdict, found.check.value, found.check.reference) == ("no reference", 1.0, None)
    with pytest.raises(KeyError):
        attempted(raising(KeyError("a crash is no refusal")))


@pytest.mark.usefixtures("wrong_traction")
def test_wrong_sign_in_a_traction_fails_by_reciprocity_and_without_it_by_the_reference(monkeypatch):
    assert "loads differ from their reciprocals" in evaluate(case("paper: split")).reason
    assert evaluate(case("paper: split")).verdict == "WRONG"
    monkeypatch.setattr(solve.fruit.remainder, "RECIPROCITY_LIMIT", np.inf)
    assert evaluate(case("paper: split")).verdict == "WRONG"


def scaled_checks(fruit, tips):
    """Check that the same scene ten times as large has a tenth of the compliance."""
    found = contact_compliance(fruit, tips, "split")
    lengths = {key: 10.0 * getattr(fruit, key) for key in ("length_mm", "width_mm", "height_mm")}
    pair = {key: 10.0 * getattr(tips, key) for key in ("side_mm", "spacing_mm", "offset_mm")}
    larger = contact_compliance(dataclasses.replace(fruit, **lengths), dataclasses.replace(tips, **pair), "split")
    small, large = found.S, larger.S
    assert small.diagonal().min() > abs(small[0, 1])
    reference = Reference(values=tuple(10.0 * large.diagonal()), errors=(), source="scaled")
    own = found.error_own
    assert pair_and_own(small)[1] == small[0, 0]
    return checks(("s11", "s22"), small.diagonal(), (own, own), reference)


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
    def work():
        fruit = Fruit(length_mm=block[0], width_mm=block[1], height_mm=block[2], poisson=poisson)
        tips = Tips(side_mm=side, spacing_mm=spacing * side, offset_mm=offset * side)
        return scaled_checks(fruit, tips)

    found = outcome(work)
    assert found.verdict != "WRONG", found.reason
