"""The hard suite: right inside the bar or refused with a cause, and planted errors that make it fail."""

import dataclasses
import json
import types
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from skfem import ElementHex1, ElementTetP1

import solve.fruit.direct
import solve.fruit.remainder
from cad.design.parameters import Fruit, Tips
from cad.quantity import InputError
from mesh.housing.sweep import flexure_mesh
from pipeline.bench.flexure import HOUSING
from pipeline.bench.hard import contact as hard_contact
from pipeline.bench.hard import flexure as hard_flexure
from pipeline.bench.hard import press as hard_press
from pipeline.bench.hard import reference_check as ends
from pipeline.bench.hard.reference_check import Claim, HardCase, settle
from pipeline.bench.hard.suite import every_case, hard
from pipeline.stages.contact import contact_compliance
from solve.housing.stiffness import tip_compliance
from solve.linear import SolveError

QUICK = (
    "law: ", "press: E ", "press: travel ", "press: springs ", "press: tilt 5 deg", "press: tilt 21 deg",
    "press: tilt 31", "contact: paper's block, split", "contact: tip 10 mm on the paper's block", "design: E_max",
    "leaf: L/t 1.2", "clamp: ", "mesh: node of a leaf moved by 2 mm",
)  # fmt: skip


def claim(**changed):
    whole = {"name": "s", "value": 1.0, "bar": 1e-3, "reference": 1.0005, "uncertainty": 0.0, "by": "formula"}
    return Claim(**{**whole, **changed})


def ending(work, **changed):
    return settle(HardCase(group="g", what="w", claims=work, **changed))


def raising(error):
    def work():
        raise error

    return work


@pytest.mark.parametrize(
    "case", [c for c in every_case() if f"{c.group}: {c.what}".startswith(QUICK)], ids=lambda c: c.what
)
def test_quick_cases_are_right_or_refused(case):
    found = settle(case)
    assert found.verdict != "WRONG", found.words


def test_every_case_of_the_issue_is_in_the_suite():
    names = " | ".join(f"{case.group}: {case.what}" for case in every_case())
    for word in (
        "nu 0.49,", "nu 0.4999", "NL 0.005", "NL 0.2", "P_max 1.05", "P_max 50", "L/t 5", "L/t 150", "t/w 0.02",
        "t/w 2", "tip 0.2 mm", "tip 10 mm", "spacing 1.05 sides", "fruit 1 mm thin", "tip 0.1 mm from",
        "E 0.001", "E 100000", "travel 1e-06", "travel 5 mm", "tilt 15 deg", "springs 1000:1", "moved by", "clamp",
    ):  # fmt: skip
        assert word in names


def test_an_answer_inside_its_bar_is_right():
    found = ending(lambda: [claim(), claim(reference=1.0001)])
    assert (found.verdict, found.claim.reference) == ("right", 1.0005)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"reference": 1.002}, "off by 2 times"),
        ({"bar": 0.0}, "error bar of s is 0"),
        ({"bar": 0.2}, "20 % wide"),
        ({"value": float("nan")}, "not a finite number"),
        ({"bar": float("inf")}, "not a finite number"),
    ],
)
def test_any_other_answer_is_wrong(changed, words):
    found = ending(lambda: [claim(), claim(**changed)])
    assert found.verdict == "WRONG"
    assert words in found.words


def test_no_answer_at_all_is_wrong():
    assert ending(list).verdict == "WRONG"


def test_a_refusal_names_its_cause_and_stays_outside_what_is_promised():
    refusal = raising(InputError("tips.side_mm = 9 mm: must be less than 8 mm; move them"))
    assert ending(refusal).verdict == "refused"
    assert ending(refusal, answerable=True).verdict == "WRONG"
    for unclear in ("", "two\nlines: must be one", "it failed"):
        assert ending(raising(SolveError(unclear))).verdict == "WRONG"


@pytest.mark.parametrize("error", [ValueError("x"), ZeroDivisionError("x"), KeyError("x"), np.linalg.LinAlgError("x")])
def test_a_crash_is_wrong_and_says_where(error):
    found = ending(raising(error))
    assert found.verdict == "WRONG"
    assert f"{type(error).__name__} in test_hard.py:" in found.words


def test_a_warning_is_a_crash():
    assert "RuntimeWarning" in ending(lambda: warnings.warn("overflow", RuntimeWarning, stacklevel=1)).words


def test_table_and_exit_code(tmp_path, capsys):
    good = HardCase(group="g", what="good", claims=lambda: [claim()])
    bad = HardCase(group="g", what="bad", claims=lambda: [claim(value=float("nan"))])
    assert hard(as_json=True, out=tmp_path, cases=[good]) == 0
    assert hard(as_json=True, out=tmp_path, cases=[good, bad]) == 1
    found = json.loads((tmp_path / "hard.json").read_text(encoding="utf-8"))
    assert [case["verdict"] for case in found["cases"]] == ["right", "WRONG"]
    assert "1 right, 0 refused, 1 wrong" in (tmp_path / "hard.md").read_text(encoding="utf-8")
    assert hard(as_json=False, out=tmp_path, cases=[good]) == 0
    assert "1 right, 0 refused, 0 wrong" in capsys.readouterr().out


def paper(method):
    names = (f"paper's block, {method}", f"paper's block {method}")
    return next(case for case in hard_contact.cases() if case.what in names)


@pytest.mark.usefixtures("wrong_traction")
def test_wrong_sign_in_a_traction_fails_by_reciprocity_and_without_it_by_the_reference(monkeypatch):
    assert "loads differ from their reciprocals" in settle(paper("split")).words
    assert settle(paper("split")).verdict == "WRONG"
    monkeypatch.setattr(solve.fruit.remainder, "_check_reciprocity", lambda _: None)
    assert settle(paper("split")).verdict == "WRONG"


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
    assert settle(paper(method)).verdict == "WRONG"


def test_an_error_bar_of_zero_fails(monkeypatch):
    found = contact_compliance(Fruit(), Tips())
    without = dataclasses.replace(found, error_percent=0.0, s11_error_percent=0.0)
    monkeypatch.setattr(hard_contact, "contact_compliance", lambda *_: without)
    assert "error bar of" in settle(paper("split")).words


@pytest.mark.parametrize(("factor", "bar", "verdict"), [(1.0, 0.2, "right"), (1.01, 0.2, "WRONG"), (1.0, 0.0, "WRONG")])
def test_a_spring_1_percent_off_or_with_a_bar_of_zero_fails(factor, bar, verdict, monkeypatch):
    """Judged and judging mesh are the same coarse one here, to be quick."""
    mesh = flexure_mesh(HOUSING, 4.0)

    def judged(_rung, _housing, E, poisson):
        K_l, K_h = tip_compliance(mesh, E, poisson).K
        stiffness = types.SimpleNamespace(K=(factor * K_l, K_h), error_percent=(bar, bar), dofs=1)
        return types.SimpleNamespace(stiffness=stiffness)

    monkeypatch.setattr(hard_flexure, "flexure_mesh", lambda *_: mesh)
    monkeypatch.setattr(hard_flexure, "judge_on", judged)
    found = settle(HardCase(group="leaf", what="default", claims=lambda: hard_flexure.leaf_claims(0.8, 24.2, 10.0)))
    assert found.verdict == verdict


def test_an_independent_solver_disagrees_with_a_force_1_percent_off(monkeypatch):
    responded = hard_press.scene_response

    def off(*arguments):
        found = responded(*arguments)
        first = dataclasses.replace(found.responses[0], F_h=1.01 * found.responses[0].F_h)
        return dataclasses.replace(found, responses=(first,))

    monkeypatch.setattr(hard_press, "scene_response", off)
    case = next(case for case in hard_press.cases() if case.what == "tilt 5 deg")
    assert "F_h is off" in settle(case).words


def scaled_claims(fruit, tips):
    """Claim that the same scene ten times as large has a tenth of the compliance."""
    found = contact_compliance(fruit, tips, "split")
    lengths = {key: 10.0 * getattr(fruit, key) for key in ("length_mm", "width_mm", "height_mm")}
    pair = {key: 10.0 * getattr(tips, key) for key in ("side_mm", "spacing_mm", "offset_mm")}
    larger = contact_compliance(dataclasses.replace(fruit, **lengths), dataclasses.replace(tips, **pair), "split")
    (s11, s12), (_, s22) = found.S
    assert min(s11, s22) > abs(s12)
    return [
        claim(name=name, value=a, bar=0.01 * error * abs(s11), reference=10.0 * b)
        for name, a, b, error in (
            ("s11", s11, larger.S[0][0], found.s11_error_percent),
            ("s22", s22, larger.S[1][1], found.s11_error_percent),
        )
    ]


SIZES = st.floats(-1.5, 1.9).map(lambda power: 10.0**power)


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
        return scaled_claims(fruit, tips)

    found = ending(work)
    assert found.verdict != "WRONG", found.words


def test_an_unknown_error_of_a_stage_would_be_seen(monkeypatch):
    monkeypatch.setattr(ends, "REFUSALS", ())
    assert ending(raising(SolveError("must be caught as a crash then"))).verdict == "WRONG"
