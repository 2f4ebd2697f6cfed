"""The search ends at the best design of the file, is a study like any other, and its best is proved by a run."""

import json
import math
from collections.abc import Callable
from pathlib import Path

import pytest

from cad.quantity import InputError
from cad.theory.two_spring_law import size_springs
from pipeline.cli import main
from pipeline.options import RunOptions, load_design
from pipeline.response.contact import fruit_compliance
from pipeline.study import read_study
from pipeline.study.search.optimum import MARGIN, Candidate, candidate, search
from pipeline.study.search.pareto import front
from pipeline.study.tasks import PointResult
from pipeline.study.workers import Engine

SOFTEST = """
base = "paper"
seed = 1
[vary]
"targets.P_max" = { from = 3, to = 8 }
"targets.NL" = { from = 0.02, to = 0.1 }
[optimise]
minimise = "springs.K_l_N_per_m"
under = ["P_max"]
evaluations = 400
"""
"""The softest low spring has the largest P_max and NL: a corner, known by the law."""

GIVEN = """
base = "paper"
seed = 1
[set]
"springs.K_l_N_per_m" = 906
"springs.K_h_N_per_m" = 20831
"targets.P_max" = 5
[vary]
"springs.K_l_N_per_m" = { from = 400, to = 1200 }
[optimise]
minimise = "springs.K_l_N_per_m"
under = ["P_max"]
evaluations = 100
"""


def test_search_ends_at_the_corner_that_the_law_names(
    written: Callable[..., Path], engine: Engine, tmp_path: Path
) -> None:
    study = read_study(written(SOFTEST))
    best, *others = search(study, tmp_path / "out", engine)
    K_m_max = 3.5 * fruit_compliance(load_design("paper"), RunOptions()).K_m_over_E()
    assert best.value == pytest.approx(1e3 * size_springs(8.0, 0.1, K_m_max).K_l, rel=0.02)
    assert all(best.cost <= other.cost for other in others)
    assert len(others) < 400
    own = load_design("paper").nominal_targets
    first = min((best, *others), key=lambda one: one.result.number)
    assert first.result.settings == pytest.approx({"targets.P_max": own.P_max, "targets.NL": own.NL})


def test_ended_search_goes_on_to_the_same_candidates(
    written: Callable[..., Path], engine: Engine, tmp_path: Path
) -> None:
    study = read_study(written(SOFTEST))
    whole = search(study, tmp_path / "whole", engine)

    class EndedError(RuntimeError):
        pass

    def end(solved: int, _count: int) -> None:
        if solved == 70:
            raise EndedError

    with pytest.raises(EndedError):
        search(study, tmp_path / "ended", engine, end)
    again = search(study, tmp_path / "ended", engine)
    assert [one.result.settings for one in again] == [one.result.settings for one in whole]


def test_design_that_fails_a_verdict_is_never_the_best(
    written: Callable[..., Path], engine: Engine, tmp_path: Path
) -> None:
    """With springs that are given a soft one fails the verdict on P_max = 5: the softest searched is not the best."""
    best, *others = search(read_study(written(GIVEN)), tmp_path / "out", engine)
    assert best.violation == 0.0
    assert best.value == pytest.approx(906.0, rel=0.02)  # P_max 5 and NL 5 % ask for 906 and 20831 N/m
    softest = min(others, key=lambda one: one.value)
    assert softest.value < best.value
    assert softest.violation > 0.0


def test_design_that_fails_is_not_the_best_where_the_number_is_large(
    written: Callable[..., Path], engine: Engine, tmp_path: Path
) -> None:
    """K_h is some 20,000 N/m, more than any fixed cost of a failing design might be."""
    text = GIVEN.replace('minimise = "springs.K_l', 'minimise = "springs.K_h').replace("= 100", "= 32")
    best, *others = search(read_study(written(text)), tmp_path / "out", engine)
    assert best.violation == 0.0
    assert best.value > 1e4
    assert any(one.violation > 0.0 for one in others)


def candidate_of(value: float, violation: float = 0.0) -> Candidate:
    result = PointResult(number=0, settings={}, status="done", values={}, error=None, seconds=0.0)
    return Candidate(result=result, value=value, violation=violation)


def test_costs_are_in_the_order_of_the_designs() -> None:
    passing = [candidate_of(value) for value in (-1e6, -2.0, 0.0, 0.1, 2e4, 2.1e4, 1e12)]
    failing = [candidate_of(-5.0, violation) for violation in (0.01, 1.0, 1e6)]
    costs = [one.cost for one in (*passing, *failing, candidate_of(math.nan, math.inf))]
    assert costs == sorted(set(costs))


@pytest.mark.parametrize("key", ["contact.method", "verdicts.P_max.passed"])
def test_what_is_no_number_cannot_be_made_least(
    written: Callable[..., Path], engine: Engine, tmp_path: Path, key: str
) -> None:
    study = read_study(written(SOFTEST.replace("springs.K_l_N_per_m", key)))
    with pytest.raises(InputError, match="a key whose value is a number"):
        search(study, tmp_path / "out", engine)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("tolerance", "distance"), [(None, 0.5), (0.25, 2.0), (0.0, 0.5)])
def test_limit_of_zero_has_a_violation(written: Callable[..., Path], tolerance: float | None, distance: float) -> None:
    words = {"value": 0.5, "limit": 0.0, "tolerance": tolerance, "passed": False}
    values = {"springs.K_l_N_per_m": 1.0, **{f"verdicts.P_max.{word}": value for word, value in words.items()}}
    result = PointResult(number=0, settings={}, status="done", values=values, error=None, seconds=0.0)
    assert candidate(read_study(written(SOFTEST)), result).violation == pytest.approx(MARGIN + distance)


def test_search_with_more_evaluations_begins_with_those_of_the_shorter(
    written: Callable[..., Path], engine: Engine, tmp_path: Path
) -> None:
    short, whole = (read_study(written(SOFTEST.replace("400", count))) for count in ("32", "64"))
    first = search(short, tmp_path / "grown", engine)
    grown = search(whole, tmp_path / "grown", engine)
    assert len(grown) > len(first)
    assert [one.result.settings for one in grown] == [
        one.result.settings for one in search(whole, tmp_path / "whole", engine)
    ]
    with pytest.raises(InputError, match="evaluations = 32: must be 64"):
        search(short, tmp_path / "grown", engine)


def test_search_whose_candidates_are_all_refused_says_why(
    written: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = SOFTEST.replace("from = 3, to = 8", "from = 101, to = 108").replace("400", "1")
    assert main(["optimise", str(written(text)), "--out", str(tmp_path / "out"), "--processes", "1"]) == 1
    answer = capsys.readouterr().out
    assert "at most 100" in answer
    assert "no candidate has results" in answer


def test_search_needs_spans(written: Callable[..., Path], engine: Engine, tmp_path: Path) -> None:
    study = read_study(written(SOFTEST, **{"{ from = 3, to = 8 }": "[3, 8]"}))
    with pytest.raises(InputError, match="must be a span"):
        search(study, tmp_path / "out", engine)


def test_search_does_not_choose_by_how_much_a_print_misses(
    written: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = written(SOFTEST.replace('"targets.NL"', '"printed.E_offset"')), tmp_path / "out"
    assert main(["optimise", str(path), "--out", str(out), "--processes", "1"]) == 2
    complaint = capsys.readouterr().err
    assert complaint.count("\n") == 1
    assert "printed.E_offset" in complaint
    assert not out.exists()


def test_study_with_a_goal_is_run_by_optimise(written: Callable[..., Path], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", str(written(SOFTEST))]) == 2
    assert "pipeline optimise" in capsys.readouterr().err
    assert main(["optimise", str(written())]) == 2
    assert "[optimise]" in capsys.readouterr().err


def test_front_keeps_what_no_other_place_beats() -> None:
    places = [(1.0, 5.0), (2.0, 4.0), (2.5, 4.5), (3.0, 1.0), (4.0, 1.0), (1.0, 6.0)]
    assert front(places) == ((1.0, 5.0), (2.0, 4.0), (3.0, 1.0))


@pytest.mark.study
def test_optimum_of_mango_is_as_good_as_the_preset_and_its_run_passes(
    written: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A short search around the preset: it begins with the preset, so it ends no worse, and the run decides."""
    text = """
base = "mango"
seed = 1
[vary]
"springs.K_l_N_per_m" = { from = 100, to = 200, log = true }
[optimise]
evaluations = 24
"""
    out = tmp_path / "out"
    assert main(["optimise", str(written(text)), "--out", str(out), "--processes", "1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    preset = 0.12312  # of mango, docs/layouts.md
    assert found["value"] <= preset
    assert json.loads((out / "best" / "report.json").read_text(encoding="utf-8"))["reading"]["uncertainty_percent"] == (
        pytest.approx(100.0 * found["value"], rel=0.02)
    )
    assert (out / "pareto.svg").read_text(encoding="utf-8").startswith("<?xml")
