"""What a suggestion is: the nearest candidate that a run shows to pass, or why there is none."""

import dataclasses

import pytest
from stand_ins import GOOD, result_of

from cad.design.fruit import Fruit
from cad.design.parameters import Design
from cad.quantity import InputError
from pipeline.options import RunOptions
from pipeline.study.suggest import suggestion as room
from pipeline.study.suggest.suggestion import suggestion

BRUISED = Design(fruit=Fruit(bruise_limit_MPa=0.29))
ROUGH = RunOptions(tolerance=0.02)


@pytest.fixture
def runs(monkeypatch):
    """Return the designs that were run: contact and springs are the reference's, no solid is looked at."""
    asked = []

    def stand_in(design, _options):
        asked.append(design)
        return result_of(design)

    monkeypatch.setattr(room, "judged", stand_in)
    return asked


def test_design_that_passes_stays(runs):
    found = suggestion(Design(), RunOptions())
    assert (found.changes, found.runs, found.changed) == ({}, 1, Design())
    assert len(runs) == 1


def test_candidate_is_proved_by_a_run(runs):
    found = suggestion(BRUISED, RunOptions())
    assert list(found.changes) == ["press.travel_mm"]
    assert runs[1:] == [found.changed]
    assert all(verdict.passed for verdict in found.verdicts)


@pytest.mark.slow
@pytest.mark.usefixtures("runs")
def test_key_that_is_kept_stays():
    found = suggestion(BRUISED, RunOptions(), frozenset({"press.travel_mm"}))
    assert found.changes is None or "press.travel_mm" not in found.changes


def test_candidate_that_its_run_refutes_is_not_suggested(monkeypatch):
    """Each changed design fails a check of its solid, or is refused."""
    outcomes = iter([result_of(BRUISED)])

    def refuted(design, _options):
        for result in outcomes:
            return result
        if design.press.travel_mm > 0.05:
            wrong = dataclasses.replace(GOOD, passed=False)
            return dataclasses.replace(result_of(design), verdicts=(wrong,))
        msg = "refused"
        raise InputError(msg)

    monkeypatch.setattr(room, "judged", refuted)
    found = suggestion(BRUISED, RunOptions())
    assert found.changes is None
    assert found.reason.startswith("none found: what passes with ideal springs, press.travel_mm = ")
    assert found.reason.endswith("fails its run")


def test_undecided_design_is_told_its_tolerance(monkeypatch):
    open_ = dataclasses.replace(GOOD, name="K_l", limit=900.0, tolerance=0.001, relative=True, error=9.0, passed=None)
    monkeypatch.setattr(room, "judged", lambda design, _: dataclasses.replace(result_of(design), verdicts=(open_,)))
    found = suggestion(Design(), ROUGH)
    assert (found.changes, found.reason) == (None, "undecided by its error bar, --tol 0.0005 would decide")
