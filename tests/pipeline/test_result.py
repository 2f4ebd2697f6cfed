"""A result passes as its verdicts do, and keeps them where a later solve fails."""

import dataclasses
import re

import pytest
from stand_ins import result_of, sensor_of

import pipeline.evaluate
from pipeline.evaluate import check_targets, complete_evaluation
from pipeline.options import RunOptions
from pipeline.storage.stopwatch import Stopwatch
from pipeline.verdicts.errors import sensor_errors
from pipeline.verdicts.errors.effects import LARGEST_MOUNT_CHANGES
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


def test_run_solves_no_other_mount_and_no_modes(monkeypatch):
    """Its error bars hold a bound in place of the mounts."""
    for name in ("other_mounts", "sensor_modes"):
        monkeypatch.setattr(pipeline.evaluate, name, lambda _: pytest.fail("it was solved"))
    result = complete_evaluation(check_targets(sensor_of(Design())), Stopwatch())
    assert result.left_out == ()
    assert result.behaviour.modes is None
    (size,) = (part.size for part in result.errors.budgets.K_h.model if part.effect == "mount")
    assert size == LARGEST_MOUNT_CHANGES[1]


@pytest.mark.parametrize("stage", ["other_mounts", "sensor_modes"])
def test_solve_that_fails_after_the_verdicts_is_named_and_loses_no_number(stage, monkeypatch):
    """Neither other mounts nor modes are part of a verdict."""

    def fail(_):
        msg = "linear solve: residual"
        raise SolveError(msg)

    solves = {"other_mounts": lambda _: {}, "sensor_modes": lambda _: None, stage: fail}
    for name, solve in solves.items():
        monkeypatch.setattr(pipeline.evaluate, name, solve)
    monkeypatch.setattr(sensor_errors, "print_scatter", lambda _: None)
    result = complete_evaluation(check_targets(sensor_of(Design()), RunOptions(fabrication=True)), Stopwatch())
    assert [text.endswith("linear solve: residual") for text in result.left_out] == [True]
    assert [verdict.name for verdict in result.verdicts if verdict.passed is not True] == []
    assert result.behaviour.modes is None
