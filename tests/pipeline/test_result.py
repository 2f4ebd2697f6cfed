"""A result passes as its verdicts do, and keeps them where a later solve fails."""

import dataclasses
import re

from stand_ins import result_of


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
    first, second, *rest = result.verdicts
    shown = repr(
        dataclasses.replace(
            result,
            verdicts=(dataclasses.replace(first, passed=False), dataclasses.replace(second, passed=None), *rest),
        )
    )
    assert len(shown) <= 80
    assert [int(word) for word in re.findall(r"\d+", shown)] == [len(rest), 1, 1]
