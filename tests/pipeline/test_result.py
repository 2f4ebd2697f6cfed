"""A result passes as its verdicts do, and keeps them where a later solve fails."""

import dataclasses
import re

import pytest
from stand_ins import result_of, sensor_of

import pipeline.evaluate
from pipeline.evaluate import check_targets, complete_evaluation
from pipeline.storage.stopwatch import Stopwatch
from sensor.design.parameters import Design
from solve.linear import SolveError


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


@pytest.mark.parametrize("stage", ["other_mounts", "sensor_modes"])
def test_solve_that_fails_after_the_verdicts_is_named_and_loses_no_number(stage, monkeypatch):
    """Neither other mounts nor modes are part of a verdict."""

    def fail(_):
        msg = "linear solve: residual"
        raise SolveError(msg)

    solves = {"other_mounts": lambda _: {}, "sensor_modes": lambda _: None, stage: fail}
    for name, solve in solves.items():
        monkeypatch.setattr(pipeline.evaluate, name, solve)
    result = complete_evaluation(check_targets(sensor_of(Design())), Stopwatch())
    assert [text.endswith("linear solve: residual") for text in result.left_out] == [True]
    assert [verdict.name for verdict in result.verdicts if verdict.passed is not True] == []
    assert result.behaviour.modes is None
