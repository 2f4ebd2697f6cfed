"""The hard suite: right inside the bar or refused with a cause, and planted errors that make it fail."""

import dataclasses
import types
import warnings

import numpy as np
import pytest
from hard import contact as hard_contact
from hard import flexure as hard_flexure
from hard import press as hard_press
from hard import reference_check
from hard.cases import cells, every_case
from hard.reference_check import HardCase, ReferenceCheck, attempted, checks, evaluate
from hypothesis import given, settings
from hypothesis import strategies as st
from skfem import ElementHex1, ElementTetP1

import solve.fruit.direct
import solve.fruit.remainder
from benchmarks.contact import pair_and_own
from benchmarks.flexure import HOUSING
from benchmarks.harness import Reference
from cad.design.fruit import Fruit
from cad.design.tips import Tips
from cad.quantity import InputError
from mesh.housing.sweep import flexure_mesh
from mesh.session import MeshError
from pipeline.response.contact import contact_compliance
from solve.housing.stiffness import tip_compliance
from solve.linear import SolveError

QUICK = (
    "level press: ", "press: tilt 5 deg", "press: tilt 21 deg", "paper: split", "contact: tip 10 mm on the paper",
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


def test_a_row_has_the_differences_relative_to_the_value():
    found = outcome(lambda: [check(value=2.0, error=2e-2, reference=2.01, reference_error=2e-3)])
    assert cells(found) == ["g: w", "s 2", "1 %", "2.01", "0.1 %", "-0.5 %", "right", "formula"]
    alone = outcome(lambda: [check(reference=None, source="the reference refused: x")])
    assert cells(alone)[3:7] == ["-", "-", "-", "no reference"]


def test_an_answer_inside_its_bar_is_right():
    found = outcome(lambda: [check(), check(reference=1.0001)])
    assert (found.verdict, found.check.reference, found.reason) == ("right", 1.0005, "formula")
    assert outcome(lambda: [check(reference=1.002, reference_error=1.1e-3)]).verdict == "right"


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"reference": 1.002}, "off by 2 times"),
        ({"error": 0.0}, "error bar of s is 0"),
        ({"error": 0.2}, "20 % wide"),
        ({"value": 0.0, "reference": 0.0}, "inf % wide"),
        ({"value": float("nan")}, "not a finite number"),
        ({"error": float("inf")}, "not a finite number"),
    ],
)
def test_any_other_answer_is_wrong(changed, words):
    found = outcome(lambda: [check(), check(**changed)])
    assert found.verdict == "WRONG"
    assert words in found.reason


def test_no_answer_at_all_is_wrong():
    assert outcome(list).verdict == "WRONG"


def test_a_refusal_names_its_cause_and_stays_outside_what_is_promised():
    refusal = raising(InputError("tips.side_mm = 9 mm: must be less than 8 mm; move them"))
    assert outcome(refusal).verdict == "refused"
    assert outcome(refusal, answerable=True).verdict == "WRONG"
    for unclear in ("", "two\nlines: must be one", "it failed"):
        assert outcome(raising(SolveError(unclear))).verdict == "WRONG"


def test_a_refusal_of_the_reference_does_not_count_against_the_product():
    def judged(value, bar):
        reference = attempted(raising(MeshError("volume", "finer mesh", "none")))
        return checks(("s",), (value,), (bar,), reference)

    found = outcome(lambda: judged(1.0, 1e-3), answerable=True)
    assert (found.verdict, found.check.value, found.check.reference) == ("no reference", 1.0, None)
    assert "the reference refused: mesh, stage 'volume': finer mesh" in found.reason
    assert "error bar of s is 0" in outcome(lambda: judged(1.0, 0.0)).reason
    assert "20 % wide" in outcome(lambda: judged(1.0, 0.2)).reason
    assert outcome(lambda: [*judged(1.0, 1e-3), check(reference=2.0)]).verdict == "WRONG"
    with pytest.raises(KeyError):
        attempted(raising(KeyError("a crash is no refusal")))


@pytest.mark.parametrize(
    "error", [ValueError("x"), ZeroDivisionError("x"), KeyError("x"), np.linalg.LinAlgError("x"), SystemExit(3)]
)
def test_a_crash_of_any_kind_is_wrong_and_says_where(error):
    found = outcome(raising(error))
    assert found.verdict == "WRONG"
    assert f"{type(error).__name__} in test_hard_cases.py:" in found.reason


def test_a_warning_is_a_crash():
    assert "RuntimeWarning" in outcome(lambda: warnings.warn("overflow", RuntimeWarning, stacklevel=1)).reason


def test_an_unknown_error_of_a_stage_would_be_seen(monkeypatch):
    monkeypatch.setattr(reference_check, "REFUSALS", ())
    assert outcome(raising(SolveError("must be caught as a crash then"))).verdict == "WRONG"


@pytest.mark.usefixtures("wrong_traction")
def test_wrong_sign_in_a_traction_fails_by_reciprocity_and_without_it_by_the_reference(monkeypatch):
    assert "loads differ from their reciprocals" in evaluate(case("paper: split")).reason
    assert evaluate(case("paper: split")).verdict == "WRONG"
    monkeypatch.setattr(solve.fruit.remainder, "RECIPROCITY_LIMIT", np.inf)
    assert evaluate(case("paper: split")).verdict == "WRONG"


@pytest.mark.parametrize(
    ("method", "module", "name", "lower"),
    [
        ("direct", solve.fruit.direct, "ElementTetP2", ElementTetP1),
        ("split", solve.fruit.remainder, "ElementHex2", ElementHex1),
        ("to 0.01 %", solve.fruit.remainder, "ElementHex2", ElementHex1),
    ],
)
def test_a_mesh_at_order_1_fails(method, module, name, lower, monkeypatch):
    monkeypatch.setattr(module, name, lower)
    assert evaluate(case(f"paper: {method}")).verdict == "WRONG"


def test_an_error_bar_of_zero_fails(monkeypatch):
    monkeypatch.setattr(hard_contact, "relative_errors", lambda _: (0.0, 0.0))
    assert "error bar of" in evaluate(case("paper: split")).reason


@pytest.mark.parametrize(
    ("factor", "bar", "verdict"), [(1.0, 2e-3, "right"), (1.01, 2e-3, "WRONG"), (1.0, 0.0, "WRONG")]
)
def test_a_spring_1_percent_off_or_with_a_bar_of_zero_fails(factor, bar, verdict, monkeypatch):
    """Judged and judging mesh are the same coarse one here, to be quick."""
    mesh = flexure_mesh(HOUSING, 4.0)

    def judged(_pair, _housing, E, poisson):
        K_l, K_h = tip_compliance(mesh, E, poisson).K
        return types.SimpleNamespace(stiffness=types.SimpleNamespace(K=(factor * K_l, K_h), error=(bar, bar)))

    monkeypatch.setattr(hard_flexure, "flexure_mesh", lambda *_: mesh)
    monkeypatch.setattr(hard_flexure, "solve_on", judged)
    assert outcome(lambda: hard_flexure.leaf_checks(0.8, 24.2, 10.0)).verdict == verdict


def test_a_finer_mesh_that_cannot_be_solved_is_no_reference(monkeypatch):
    monkeypatch.setattr(hard_flexure, "FINER", 4.0)
    monkeypatch.setattr(hard_flexure, "tip_compliance", lambda *_: raising(SolveError("out of memory"))())
    found = outcome(lambda: hard_flexure.leaf_checks(0.8, 24.2, 10.0))
    assert (found.verdict, found.reason) == ("no reference", "the reference refused: out of memory")


def test_an_independent_solver_disagrees_with_a_force_1_percent_off(monkeypatch):
    forces = hard_press.forces

    def off(*arguments):
        F, error = forces(*arguments)
        return F * [1.0, 1.01], error

    monkeypatch.setattr(hard_press, "forces", off)
    assert "F_h is off" in evaluate(case("press: tilt 5 deg")).reason


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


@pytest.mark.slow
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
