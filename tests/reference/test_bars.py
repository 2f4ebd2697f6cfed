"""Error bars: each case ends in a right answer inside its bar, or in a refusal that names the cause; nothing else."""

import numpy as np
import pytest
from bars import bars, holds
from hypothesis import given, settings
from hypothesis import strategies as st

import solve.fruit.remainder
from benchmarks.bars.check import ReferenceCheck, case_outcome, make_checks, try_reference
from benchmarks.bars.table import CASES, MAY_BE_REFUSED
from benchmarks.contact import compliance_values
from benchmarks.harness import Reference
from mesh.session import MeshError
from pipeline.response.contact import contact_compliance
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from sensor.quantity import InputError
from solve.linear import SolveError


@pytest.mark.parametrize(
    "name", bars("contact beside direct elements", "press beside direct elements", "level press", *MAY_BE_REFUSED)
)
def test_a_case_is_right_or_refused(name):
    holds(name)


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
        ([check(widest=0.9e-3)], "WRONG"),
        ([check(value=float("nan"))], "WRONG"),
    ],
)
def test_a_case_is_right_only_inside_its_bar(values, verdict):
    assert case_outcome(lambda: values, False).verdict == verdict


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

    assert case_outcome(work, answerable).verdict == verdict


def test_a_refusal_of_the_reference_does_not_count_against_the_product():
    def refuses():
        raise MeshError("volume", "finer mesh", "none")

    found = case_outcome(lambda: make_checks(("s",), (1.0,), (1e-3,), try_reference(refuses)), True)
    assert (found.verdict, found.check.value, found.check.reference) == ("no reference", 1.0, None)


@pytest.mark.usefixtures("wrong_traction")
def test_wrong_sign_in_a_traction_fails_by_reciprocity_and_without_it_by_the_reference(monkeypatch):
    assert "asymmetry of the compliance" in case_outcome(*CASES["paper: the default"]).reason
    monkeypatch.setattr(solve.fruit.remainder, "RECIPROCITY_LIMIT", np.inf)
    assert case_outcome(*CASES["paper: the default"]).verdict == "WRONG"


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
        return contact_compliance(fruit, tips)

    def work():
        small = solved(1.0)
        own = small.s11_error
        assert compliance_values(small.S)[1] == small.S[0, 0]
        scaled = Reference(values=tuple(10.0 * solved(10.0).S.diagonal()), errors=(), source="scaled")
        return make_checks(("s11", "s22"), small.S.diagonal(), (own, own), scaled)

    found = case_outcome(work, False)
    assert found.verdict != "WRONG", found.reason
