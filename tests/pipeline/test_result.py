"""A result is frozen and passes as its verdicts do."""

import dataclasses

import pytest
from stand_ins import result_of

from cad.design.parameters import Design, GivenSprings


def test_result_passes_as_its_verdicts_do():
    result = result_of()
    assert result.passed is True
    first, *rest = result.verdicts
    for outcome in (None, False):
        changed = dataclasses.replace(result, verdicts=(dataclasses.replace(first, passed=outcome), *rest))
        assert changed.passed is outcome


def test_the_papers_own_verdicts_do_not_count():
    result = result_of()
    assert [verdict.name for verdict in result.paper if verdict.passed is False] == ["P_max", "NL"]
    assert result.passed is True
    paper = Design(springs=GivenSprings(K_l_N_per_m=753.0, K_h_N_per_m=17300.0))
    assert result_of(paper).passed is False


def test_result_and_what_it_holds_are_frozen():
    result = result_of()
    records = (result.design, result.contact, result.sizing, result.springs, result.press, result.errors.budgets)
    for record in (result, *records):
        name = dataclasses.fields(record)[0].name
        with pytest.raises(dataclasses.FrozenInstanceError, match=name):
            setattr(record, name, None)
