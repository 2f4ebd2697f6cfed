"""A result passes as its verdicts do, and keeps them where a later solve fails."""

import dataclasses
import re

import pytest
from stand_ins import GOOD, result_of

from pipeline.main_job import with_file_verdicts
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design


def test_result_passes_as_its_verdicts_do():
    result = result_of()
    assert result.passed is True
    first, *rest = result.verdicts
    for outcome in (None, False):
        changed = dataclasses.replace(result, verdicts=(dataclasses.replace(first, passed=outcome), *rest))
        assert changed.passed is outcome


def test_notebook_shows_a_result_in_one_line():
    """A result has some 180,000 characters of numbers."""
    result = result_of()
    shown = repr(dataclasses.replace(result, verdicts=(dataclasses.replace(GOOD, passed=False), *result.verdicts)))
    assert len(shown) <= 80
    assert [int(word) for word in re.findall(r"\d+", shown)] == [len(result.verdicts), 1, 0]


def test_verdicts_on_files_stand_behind_those_on_printing_and_at_the_end():
    result = result_of()
    sensor = dataclasses.replace(result, verdicts=tuple(one for one in result.verdicts if one.row.group != "solid"))
    making = dataclasses.replace(GOOD, name="sideways.low", passed=False)
    *verdicts, last = with_file_verdicts(sensor, [GOOD], [making])
    names = [verdict.name for verdict in verdicts]
    behind = names.index("printable.high") + 1
    assert names.pop(behind) == GOOD.name
    assert names == [verdict.name for verdict in sensor.verdicts]
    assert last.name == making.name
    assert last.remedy


@pytest.mark.parametrize("limit_MPa", [1.2, 5.0])
def test_verdicts_on_numbers_have_a_hint_exactly_where_they_do_not_pass(limit_MPa):
    result = result_of(Design(fruit=Fruit(bruise_limit_MPa=limit_MPa)))
    bruise = next(one for one in result.verdicts if one.name == "bruise")
    assert bruise.passed is (limit_MPa > 2.0)
    assert ("press.travel_mm" in (bruise.remedy or "")) is not bruise.passed
