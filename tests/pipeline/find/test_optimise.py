"""The search ends at the best design of the file, is a study like any other, and its best is proved by a run."""

import json
import math
from concurrent.futures import BrokenExecutor, Future
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from refusal import refusal

from mesh.session import MeshError
from pipeline.find import optimise
from pipeline.find import proved_candidate as proof
from pipeline.find.candidate import MARGIN, Candidate
from pipeline.find.optimise import (
    MOST_RUNS,
    candidate_of,
    is_base,
    places,
    prove,
    search,
    value_of_run,
)
from pipeline.options import DEFAULT_TOLERANCE, RunOptions, load_design
from pipeline.response.contact import fruit_compliance
from pipeline.storage.folder import OutputError
from pipeline.study import read_study
from pipeline.study.store import study_store
from pipeline.study.study_file import UNCERTAINTY_KEYS, UNCERTAINTY_LIMIT
from pipeline.study.tasks import PointResult
from sensor.quantity import InputError
from sensor.theory.two_spring_law import size_springs
from sensor.verdict import judge
from solve.linear import SolveError
from twintip.cli import main

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
evaluations = 32
"""


LISTS = SOFTEST.replace("{ from = 3, to = 8 }", '[5, 8, 3]\n"print.process" = ["sla-resin", "fdm-petg"]')
"""The same corner in a list, beside words that move nothing; the base is in both lists."""

FRONT = SOFTEST.replace('"targets.P_max" = { from = 3, to = 8 }\n', "").replace("400", "64")
FRONT += '[optimise.front]\n"targets.P_max" = [8, 3, 5]\n'


def softest(P_max):
    """Return the low stiffness that the law names for a P_max and the largest NL of these files [N/m]."""
    K_m_max = 3.5 * fruit_compliance(load_design("paper"), RunOptions()).K_m_over_E()
    return 1e3 * size_springs(P_max, 0.1, K_m_max).K_l


@pytest.fixture
def runs(monkeypatch):
    """Put verdicts in the place of runs; return P_max of the designs that were run."""

    def stand_in(passed):
        ratios: list[float] = []

        def run(design, options):
            assert options.tolerance <= DEFAULT_TOLERANCE  # more leaves the stiffness of springs undecided
            ratios.append(design.nominal_targets.P_max)
            outcome = passed[len(ratios) - 1]
            if isinstance(outcome, Exception):
                raise outcome
            return SimpleNamespace(passed=outcome, report={"springs": {"K_l_N_per_m": 700.0}}, verdicts=())

        monkeypatch.setattr(proof, "run", run)
        return ratios

    return stand_in


@pytest.mark.parametrize(("text", "words"), [(SOFTEST, {}), (LISTS, {"print.process": "fdm-petg"})])
def test_search_ends_at_the_corner_that_the_law_names(written, engine, tmp_path, text, words):
    study = read_study(written(text))
    best, *others = search(study, tmp_path / "out", engine)
    assert best.value == pytest.approx(softest(8.0), rel=0.02)
    assert all(best.cost <= other.cost for other in others)
    assert len(others) < 400
    (base,) = (other for other in others if is_base(study, other))
    targets = load_design("paper").nominal_targets
    told = {"targets.P_max": targets.P_max, "targets.NL": targets.NL}
    numbers = {key: value for key, value in base.changes.items() if key not in words}
    assert numbers == pytest.approx(told)
    assert {key: base.changes[key] for key in words} == words


def test_lists_alone_are_searched_and_each_combination_is_solved_once(written, engine, tmp_path):
    text = LISTS.replace('"targets.NL" = { from = 0.02, to = 0.1 }', "")
    best, *others = search(read_study(written(text)), tmp_path / "out", engine)
    assert best.changes["targets.P_max"] == 8
    assert len(others) == 5


@pytest.mark.usefixtures("in_process")
def test_front_has_a_design_for_each_value_and_says_where_there_is_none(written, tmp_path, runs, capsys):
    """With P_max set the softest low spring is that of the largest NL, by the law; the last value's runs all fail."""
    out = tmp_path / "out"
    ratios = runs((True, True, *[False] * MOST_RUNS))
    assert main(["optimise", str(written(FRONT)), "--out", str(out), "--json"]) == 1
    *proved, missing = json.loads(capsys.readouterr().out)["front"]
    assert ratios == [8.0, 3.0, *[5.0] * MOST_RUNS]
    assert [one["at"] for one in proved] == [8, 3]
    for one in proved:
        assert one["value"] == pytest.approx(softest(one["at"]), rel=0.02)
        assert one["design"] == str(out / "front" / f"P_max-{one['at']}.toml")
        assert load_design(Path(one["design"])).nominal_targets.P_max == one["at"]
    assert (missing["at"], missing["design"], missing["passed"]) == (5, None, False)
    assert not (out / "front" / "P_max-5.toml").exists()
    runs((True, True, True))
    assert main(["optimise", str(written(FRONT)), "--out", str(out)]) == 0
    assert "at targets.P_max = 5" in capsys.readouterr().out
    runs((False,) * 3 * MOST_RUNS)
    assert main(["optimise", str(written(FRONT)), "--out", str(out)]) == 1
    assert list((out / "front").glob("*.toml")) == []


class Losing:
    """An engine's executor whose first worker is lost again and again."""

    def submit(self, *_):
        lost = Future()
        lost.set_exception(ConnectionError())
        return lost

    def shutdown(self): ...


def test_lost_worker_ends_a_search_whose_next_run_goes_on(written, engine, tmp_path):
    """Later points follow from those before, so that none may be left out."""
    study = read_study(written(SOFTEST.replace("400", "32")))
    with pytest.raises(BrokenExecutor):
        search(study, tmp_path / "lost", replace(engine, open=Losing, close=Losing.shutdown))
    with study_store(tmp_path / "lost", study) as store:
        assert sum(store.counts().values()) == 0
    again = search(study, tmp_path / "lost", engine)
    assert again == search(study, tmp_path / "whole", engine)


class EndedError(RuntimeError):
    """Ends a search from outside."""


def end_search(study, folder, engine, at):
    """Begin a search, and end it after so many candidates."""

    def end(solved, _count):
        if solved == at:
            raise EndedError

    with pytest.raises(EndedError):
        search(study, folder, engine, end)


def test_front_that_was_ended_goes_on_to_the_same_candidates(written, engine, tmp_path):
    study = read_study(written(FRONT))
    whole = search(study, tmp_path / "whole", engine)

    end_search(study, tmp_path / "ended", engine, at=100)  # in the second of three values
    again = search(study, tmp_path / "ended", engine)
    assert [(one.number, one.changes) for one in again] == [(one.number, one.changes) for one in whole]
    numbers = [one.number for one in whole if one.changes["targets.P_max"] == 3]
    assert min(numbers) < 100 < max(numbers)


def test_each_value_of_a_front_begins_at_the_last_generation_of_the_one_before(written, engine, tmp_path):
    """One key that varies has generations of eight; some members are the same."""
    candidates = search(read_study(written(FRONT)), tmp_path / "out", engine)
    before = [one.changes["targets.NL"] for one in candidates if one.changes["targets.P_max"] == 8]
    after = [one for one in candidates if one.changes["targets.P_max"] == 3]
    first = sorted(after, key=lambda one: one.number)[:4]
    assert first[0].changes["targets.NL"] == before[0]
    for one in first:
        NL = one.changes["targets.NL"]
        assert min(abs(NL / other - 1.0) for other in before) < 1e-12  # SciPy scales what it is given


def test_ended_search_goes_on_to_the_same_candidates_and_a_longer_one_begins_with_them(written, engine, tmp_path):
    study = read_study(written(SOFTEST.replace("400", "96")))
    whole = search(study, tmp_path / "whole", engine)

    end_search(study, tmp_path / "ended", engine, at=40)
    short = replace(study, goal=replace(study.goal, evaluations=64))
    assert refusal(search, short, tmp_path / "ended", engine).field == "goal.evaluations"
    first = search(short, tmp_path / "grown", engine)
    grown = search(study, tmp_path / "grown", engine)
    assert len(grown) > len(first)
    again = search(study, tmp_path / "ended", engine)
    settings = [one.changes for one in whole]
    assert [one.changes for one in again] == settings
    assert [one.changes for one in grown] == settings


@pytest.mark.parametrize(("minimised", "optimum"), [("K_l", 906.0), ("K_h", 20831.0)])
def test_design_that_fails_a_verdict_is_never_the_best(written, engine, tmp_path, minimised, optimum):
    """With springs that are given a soft one fails the verdict on P_max = 5: the softest searched is not the best."""
    text = GIVEN.replace('minimise = "springs.K_l', f'minimise = "springs.{minimised}')
    best, *others = search(read_study(written(text)), tmp_path / "out", engine)
    assert best.passes
    assert best.value == pytest.approx(optimum, rel=0.02)  # P_max 5 and NL 5 % ask for 906 and 20831 N/m
    assert any(not one.passes and one.value <= best.value for one in others)


def planted(value, number=0, *, passes=True, **settings):
    """Return a candidate with one verdict."""
    named = {key.replace("__", "."): value for key, value in settings.items()}
    verdict = judge("P_max", 1.0 if passes else 2.0, "", limit=1.0, tolerance=0.1)
    return Candidate(changes=named, verdicts=(verdict,), value=value, number=number)


def result_of(values, **settings):
    """Return a point that was solved, with values by key of the report."""
    named = {key.replace("__", "."): value for key, value in settings.items()}
    return PointResult(number=0, settings=named, status="done", values=values, error=None, seconds=0.0)


def verdict_values(name, value, limit, **changes):
    """Return what a point holds of a verdict."""
    words = {"value": value, "limit": limit, "error": 0.0, "tolerance": 0.0, "passed": value <= limit, **changes}
    return {f"verdicts.{name}.{word}": told for word, told in words.items()}


def test_poses_without_a_reading_count_as_a_shortfall(written):
    study = read_study(written(SOFTEST.replace('"P_max"]', '"reading.bias"]')))
    values = {"springs.K_l_N_per_m": 1.0, "reading.refused": "3 of 60 poses have no reading"}
    values |= verdict_values("reading.bias", 1.0, 2.0, passed=False)
    assert candidate_of(study, result_of(values)).shortfall == pytest.approx(MARGIN + 0.05)


@pytest.mark.parametrize("key", UNCERTAINTY_KEYS)
def test_uncertainty_with_a_limit_at_each_modulus_is_compared_over_its_limit(written, key):
    """The value jumps from 0.049 to 0.098 where another modulus has the largest multiple of its limit, 0.98."""
    study = read_study(
        written(f'base = "mango"\n[vary]\n"press.travel_mm" = [1.0, 1.1]\n[optimise]\nminimise = "{key}"')
    )
    assert UNCERTAINTY_LIMIT in study.wanted
    others = {name: value for name in study.goal.under for name, value in verdict_values(name, 0.5, 1.0).items()}

    def candidate(value, limit, **settings):
        values = {**others, **verdict_values("reading.uncertainty", value, limit), "reading.uncertainty_percent": value}
        return candidate_of(study, result_of(values, **settings))

    better, softest, firmest = candidate(0.097, 0.1), candidate(0.049, 0.05), candidate(0.098, 0.1)
    assert better.passes
    assert better.cost < softest.cost == pytest.approx(firmest.cost, rel=1e-12)
    assert (softest.value, firmest.value) == (0.049, 0.098)
    one_limit = [
        candidate(value, limit, reading__uncertainty_limit=0.1) for value, limit in ((0.049, 0.1), (0.05, 0.2))
    ]
    assert one_limit[0].cost < one_limit[1].cost


def test_distribution_is_refused_before_anything_is_written(written, engine, tmp_path):
    normal = "{ mean = 5, sd = 0.1, source = 'x' }"
    study = read_study(written(SOFTEST.replace("{ from = 3, to = 8 }", normal)))
    assert refusal(search, study, tmp_path / "out", engine).field == "targets.P_max"
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("in_process")
def test_search_whose_candidates_are_all_refused_says_why(written, tmp_path, capsys):
    text = SOFTEST.replace("from = 3, to = 8", "from = 101, to = 108").replace("400", "1")
    assert main(["optimise", str(written(text)), "--out", str(tmp_path / "out")]) == 1
    assert "at most 100" in capsys.readouterr().out


@pytest.mark.usefixtures("in_process")
@pytest.mark.parametrize(("largest_ratio", "better"), [(5.0, False), (5.04, True)])
def test_base_that_is_the_best_is_told(
    written,
    tmp_path,
    runs,
    capsys,
    largest_ratio,
    *,
    better,
):
    """The softest low spring has the largest P_max of the span; the base has 5."""
    text = SOFTEST.replace("to = 8", f"to = {largest_ratio}").replace('"targets.NL" = { from = 0.02, to = 0.1 }\n', "")
    runs((True,))
    assert main(["optimise", str(written(text.replace("400", "32"))), "--out", str(tmp_path / "out")]) == 0
    assert ("no candidate improves on the base" in capsys.readouterr().out) is not better


@pytest.mark.usefixtures("in_process")
@pytest.mark.parametrize("outcome", [InputError("tips"), False, True])
@pytest.mark.parametrize("verdicts", [None, ()])
def test_base_without_a_number_in_the_search_is_told_by_its_run(
    written, tmp_path, runs, capsys, monkeypatch, outcome, verdicts
):
    """Without verdicts the search refuses it, without a number it has no reading: neither nan nor 0 is its number."""

    def without_number(_, result):
        return Candidate(changes=result.settings, verdicts=verdicts, value=math.nan, number=result.number)

    monkeypatch.setattr(optimise, "candidate_of", without_number)
    search_file = str(written(SOFTEST.replace("400", "1")))
    is_proved = outcome is True
    for flags in ([], ["--json"]):
        ratios = runs((outcome,))
        code = main(["optimise", search_file, "--out", str(tmp_path / "out"), "--force", *flags])
        assert (code, ratios) == (0 if is_proved else 1, [5.0])
        printed = capsys.readouterr().out
        if flags:
            answer = json.loads(printed, parse_constant=pytest.fail)
            assert (answer["value"], answer["passed"]) == (None, is_proved)
        else:
            assert " nan " not in printed
            assert ("700 in its run" in printed) is is_proved


def test_study_with_a_goal_is_run_by_optimise(written):
    assert main(["study", str(written(SOFTEST))]) == 2
    assert main(["optimise", str(written())]) == 2


CANDIDATES = [planted(P_max, number=i, targets__P_max=P_max) for i, P_max in enumerate((4.0, 5.0, 6.0))]


def test_design_of_the_first_run_that_passes_is_written_and_gone_where_no_run_passes(written, tmp_path, runs):
    study = read_study(written("tol = 0.01" + SOFTEST))
    (place,) = places(study, tmp_path / "out")
    with study_store(tmp_path / "out", study):
        for failed in (False, InputError("face"), MeshError("housing", "flat", "none"), SolveError("residual")):
            ratios = runs((failed, True))
            proved = prove(study, CANDIDATES, place)
            assert (ratios, proved.candidate, proved.passed) == ([4.0, 5.0], CANDIDATES[1], True)
        runs((OutputError("full"),))
        with pytest.raises(OutputError):
            prove(study, CANDIDATES, place)
        assert load_design(place.design).nominal_targets.P_max == 5.0
        ratios = runs((False, False, False))
        proved = prove(study, CANDIDATES, place)
        assert (ratios, proved.passed) == ([4.0, 5.0, 6.0], False)
        assert not (tmp_path / "out" / "design.toml").exists()
        assert prove(study, [planted(1.0, number=1, passes=False)], place) is None


def test_base_that_passes_is_never_lost_though_the_search_says_it_fails(written, tmp_path, runs):
    study = read_study(written("tol = 0.01" + SOFTEST))
    (place,) = places(study, tmp_path / "out")
    base = planted(1.0, number=0, passes=False, targets__P_max=5.0)
    with study_store(tmp_path / "out", study):
        ratios = runs((False, True))
        proved = prove(study, [CANDIDATES[2], base], place)
        assert (ratios, proved.candidate, proved.passed) == ([6.0, 5.0], base, True)
        assert load_design(place.design).nominal_targets.P_max == 5.0
    assert value_of_run(study, proved) == 700.0
    assert value_of_run(study, replace(proved, result=None)) is None
    front = read_study(written(FRONT))
    at_first = [planted(1.0, number=0, passes=False, targets__P_max=P_max) for P_max in (5.0, 8.0)]
    assert [is_base(front, one) for one in at_first] == [True, False], "of a front the base has its own value"


@pytest.mark.parametrize("evaluations", [5, 18, 32, 40])
def test_search_has_no_more_candidates_than_it_is_given(written, engine, tmp_path, evaluations):
    """Two generations of two keys are 32: of fewer the first ones are solved, and a longer search goes on with them."""
    short = search(read_study(written(SOFTEST.replace("400", str(evaluations)))), tmp_path / "out", engine)
    assert len(short) == min(evaluations, 32)
    longer = search(read_study(written(SOFTEST.replace("400", "48"))), tmp_path / "out", engine)
    settings = {one.number: one.changes for one in longer}
    assert len(longer) == 48
    assert all(settings[one.number] == one.changes for one in short)


def test_design_of_a_person_is_refused_before_anything_is_solved(written, tmp_path):
    (tmp_path / "out").mkdir()
    path = tmp_path / "out" / "design.toml"
    path.write_text("mine", encoding="utf-8")
    assert main(["optimise", str(written(SOFTEST)), "--out", str(tmp_path / "out")]) == 2
    assert [file.name for file in path.parent.iterdir()] == ["design.toml"]


@pytest.mark.study
def test_optimum_of_mango_is_as_good_as_the_preset_and_its_run_passes(written, tmp_path, capsys):
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
    answer = json.loads(capsys.readouterr().out)
    assert answer["value"] <= 0.12312  # of mango, docs/presets.md#layouts-of-tips
    report = json.loads((out / "best" / "report.json").read_text(encoding="utf-8"))
    assert report["reading"]["uncertainty_percent"] == pytest.approx(100.0 * answer["value"], rel=0.02)
    assert (out / "best-designs" / "base.toml").is_file()
    assert (out / "study.html").is_file()
