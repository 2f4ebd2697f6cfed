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
    MAX_RUNS,
    is_base,
    places,
    prove,
    search,
    stored_candidate,
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
OF_NL = '"targets.NL" = { from = 0.02, to = 0.1 }\n'


def softest(P_max):
    """Return the low stiffness that the law names for a P_max and the largest NL of these files [N/m]."""
    K_m_max = 3.5 * fruit_compliance(load_design("paper"), RunOptions()).K_m_over_E()
    return 1e3 * size_springs(P_max, 0.1, K_m_max).K_l


def short(evaluations):
    return SOFTEST.replace("400", str(evaluations))


@pytest.fixture
def searched(written, engine, tmp_path):
    """Return a function that searches by the text of a file, in a folder of a name."""

    def found(text, name="out", progress=None):
        return search(read_study(written(text)), tmp_path / name, engine, progress)

    return found


@pytest.fixture
def commanded(written, tmp_path):
    """Return a function that gives the text of a file and flags to the command; its exit code is returned."""
    return lambda text, *flags: main(["optimise", str(written(text)), "--out", str(tmp_path / "out"), *flags])


@pytest.fixture
def runs(monkeypatch):
    """Put verdicts in the place of runs; return P_max of the designs that were run."""

    def stand_in(*passed):
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
def test_search_ends_at_the_corner_that_the_law_names(written, searched, text, words):
    best, *others = searched(text)
    assert best.value == pytest.approx(softest(8.0), rel=0.02)
    assert all(best.cost <= other.cost for other in others)
    assert len(others) < 400
    study = read_study(written(text))
    (base,) = (other for other in others if is_base(study, other))
    targets = load_design("paper").nominal_targets
    assert base.changes == {
        "targets.P_max": pytest.approx(targets.P_max),
        "targets.NL": pytest.approx(targets.NL),
        **words,
    }


def test_lists_alone_are_searched_and_each_combination_is_solved_once(searched):
    best, *others = searched(LISTS.replace(OF_NL, ""))
    assert (best.changes["targets.P_max"], len(others)) == (8, 5)


@pytest.mark.usefixtures("in_process")
def test_front_has_a_design_for_each_value_and_says_where_there_is_none(commanded, tmp_path, runs, capsys):
    """With P_max set the softest low spring is that of the largest NL, by the law; the last value's runs all fail."""
    front = tmp_path / "out" / "front"
    ratios = runs(True, True, *[False] * MAX_RUNS)
    assert commanded(FRONT, "--json") == 1
    *proved, missing = json.loads(capsys.readouterr().out)["front"]
    assert ratios == [8.0, 3.0, *[5.0] * MAX_RUNS]
    for one, P_max in zip(proved, (8, 3), strict=True):
        assert (one["at"], one["value"]) == (P_max, pytest.approx(softest(P_max), rel=0.02))
        assert one["design"] == str(front / f"P_max-{P_max}.toml")
        assert load_design(Path(one["design"])).nominal_targets.P_max == P_max
    assert (missing["at"], missing["design"], missing["passed"]) == (5, None, False)
    assert not (front / "P_max-5.toml").exists()
    runs(True, True, True)
    assert commanded(FRONT) == 0
    runs(*[False] * 3 * MAX_RUNS)
    assert commanded(FRONT) == 1
    assert "at targets.P_max = 5" in capsys.readouterr().out
    assert list(front.glob("*.toml")) == []


class Losing:
    """An engine's executor whose first worker is lost again and again."""

    def submit(self, *_):
        lost = Future()
        lost.set_exception(ConnectionError())
        return lost

    def shutdown(self): ...


def test_lost_worker_ends_a_search_whose_next_run_goes_on(written, searched, engine, tmp_path):
    """Later points follow from those before, so that none may be left out."""
    study = read_study(written(short(32)))
    with pytest.raises(BrokenExecutor):
        search(study, tmp_path / "lost", replace(engine, open=Losing, close=Losing.shutdown))
    with study_store(tmp_path / "lost", study) as store:
        assert sum(store.counts().values()) == 0
    assert searched(short(32), "lost") == searched(short(32), "whole")


class EndedError(RuntimeError):
    """Ends a search from outside."""


def end_search(searched, text, at):
    """Begin a search, and end it after so many candidates."""

    def end(solved, _count):
        if solved == at:
            raise EndedError

    with pytest.raises(EndedError):
        searched(text, "ended", end)


def test_front_that_was_ended_goes_on_and_each_value_begins_at_the_last_generation_of_the_one_before(searched):
    """One key that varies has generations of eight; some members are the same. SciPy scales what it is given."""
    whole = searched(FRONT, "whole")
    end_search(searched, FRONT, at=100)  # in the second of three values
    assert [(one.number, one.changes) for one in searched(FRONT, "ended")] == [
        (one.number, one.changes) for one in whole
    ]
    before, after = (
        {one.number: one.changes["targets.NL"] for one in whole if one.changes["targets.P_max"] == P_max}
        for P_max in (8, 3)
    )
    assert min(after) < 100 < max(after)
    first, *next_ones = (after[number] for number in sorted(after)[:4])
    assert first == next(iter(before.values()))
    for NL in next_ones:
        assert min(abs(NL / other - 1.0) for other in before.values()) < 1e-12


def test_ended_search_goes_on_to_the_same_candidates_and_a_longer_one_begins_with_them(searched):
    whole = searched(short(96), "whole")
    end_search(searched, short(96), at=40)
    assert refusal(searched, short(64), "ended").field == "goal.evaluations"
    first = searched(short(64), "grown")
    settings = [one.changes for one in whole]
    for again in (searched(short(96), "grown"), searched(short(96), "ended")):
        assert [one.changes for one in again] == settings
    assert len(settings) > len(first)


@pytest.mark.parametrize("evaluations", [5, 18, 32, 40])
def test_search_has_no_more_candidates_than_it_is_given(searched, evaluations):
    """Two generations of two keys are 32: of fewer the first ones are solved, and a longer search goes on with them."""
    first = searched(short(evaluations))
    assert len(first) == min(evaluations, 32)
    settings = {one.number: one.changes for one in searched(short(48))}
    assert len(settings) == 48
    assert all(settings[one.number] == one.changes for one in first)


@pytest.mark.parametrize(("minimised", "optimum"), [("K_l", 906.0), ("K_h", 20831.0)])
def test_design_that_fails_a_verdict_is_never_the_best(searched, minimised, optimum):
    """With springs that are given a soft one fails the verdict on P_max = 5: the softest searched is not the best."""
    best, *others = searched(GIVEN.replace('minimise = "springs.K_l', f'minimise = "springs.{minimised}'))
    assert best.passes
    assert best.value == pytest.approx(optimum, rel=0.02)  # P_max 5 and NL 5 % ask for 906 and 20831 N/m
    assert any(not one.passes and one.value <= best.value for one in others)


def planted(P_max, number=0, *, passes=True):
    """Return a candidate with one verdict."""
    verdict = judge("P_max", 1.0 if passes else 2.0, "", limit=1.0, tolerance=0.1)
    return Candidate(changes={"targets.P_max": P_max}, verdicts=(verdict,), value=1.0, number=number)


def solved(study, values, value, limit, **settings):
    """Return the candidate of a point with values by key of the report; its verdicts have a value and a limit."""
    words = {"value": value, "limit": limit, "error": 0.0, "tolerance": 0.0, "passed": value <= limit}
    verdicts = {f"verdicts.{name}.{word}": told for name in study.goal.under for word, told in words.items()}
    named = {key.replace("__", "."): setting for key, setting in settings.items()}
    point = PointResult(number=0, settings=named, status="done", values=verdicts | values, error=None, seconds=0.0)
    return stored_candidate(study, point)


def test_poses_without_a_reading_count_as_a_shortfall(written):
    study = read_study(written(SOFTEST.replace('"P_max"]', '"reading.bias"]')))
    values = {"springs.K_l_N_per_m": 1.0, "reading.refused": "3 of 60 poses have no reading"}
    failed = {**values, "verdicts.reading.bias.passed": False}
    assert solved(study, failed, 1.0, 2.0).shortfall == pytest.approx(MARGIN + 0.05)


@pytest.mark.parametrize("key", UNCERTAINTY_KEYS)
def test_uncertainty_with_a_limit_at_each_modulus_is_compared_over_its_limit(written, key):
    """The value jumps from 0.049 to 0.098 where another modulus has the largest multiple of its limit, 0.98."""
    text = f'base = "mango"\n[vary]\n"press.travel_mm" = [1.0, 1.1]\n[optimise]\nminimise = "{key}"'
    study = read_study(written(text))

    def candidate(value, limit, **settings):
        of_reading = {UNCERTAINTY_LIMIT: limit, "verdicts.reading.uncertainty.value": value}
        return solved(study, of_reading | {"reading.uncertainty_percent": value}, 0.5, 1.0, **settings)

    better, softest, firmest = candidate(0.097, 0.1), candidate(0.049, 0.05), candidate(0.098, 0.1)
    assert better.passes
    assert better.cost < softest.cost == pytest.approx(firmest.cost, rel=1e-12)
    assert (softest.value, firmest.value) == (0.049, 0.098)
    one_limit = {"reading__uncertainty_limit": 0.1}
    assert candidate(0.049, 0.1, **one_limit).cost < candidate(0.05, 0.2, **one_limit).cost


def test_distribution_is_refused_before_anything_is_written(searched, tmp_path):
    text = SOFTEST.replace("{ from = 3, to = 8 }", "{ mean = 5, sd = 0.1, source = 'x' }")
    assert refusal(searched, text).field == "targets.P_max"
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("in_process")
def test_search_whose_candidates_are_all_refused_says_why(commanded, capsys):
    assert commanded(short(1).replace("from = 3, to = 8", "from = 101, to = 108")) == 1
    assert "at most 100" in capsys.readouterr().out


@pytest.mark.usefixtures("in_process")
@pytest.mark.parametrize(("largest_ratio", "is_base_best"), [(5.0, True), (5.04, False)])
def test_base_that_is_the_best_is_told(commanded, runs, capsys, largest_ratio, is_base_best):
    """The softest low spring has the largest P_max of the span; the base has 5."""
    runs(True)
    assert commanded(short(32).replace("to = 8", f"to = {largest_ratio}").replace(OF_NL, "")) == 0
    assert ("no candidate improves on the base" in capsys.readouterr().out) is is_base_best


@pytest.mark.usefixtures("in_process")
@pytest.mark.parametrize("outcome", [InputError("tips"), False, True])
@pytest.mark.parametrize("verdicts", [None, ()])
def test_base_without_a_number_in_the_search_is_told_by_its_run(
    commanded, runs, capsys, monkeypatch, outcome, verdicts
):
    """Without verdicts the search refuses it, without a number it has no reading: neither nan nor 0 is its number."""
    base = Candidate(changes={}, verdicts=verdicts, value=math.nan)
    monkeypatch.setattr(
        optimise, "stored_candidate", lambda _, point: replace(base, changes=point.settings, number=point.number)
    )
    is_proved = outcome is True
    for flags in (["--force"], ["--force", "--json"]):
        runs(outcome)
        assert commanded(short(1), *flags) == (0 if is_proved else 1)
        printed = capsys.readouterr().out
        if flags == ["--force"]:
            assert (" nan " in printed, "700 in its run" in printed) == (False, is_proved)
    answer = json.loads(printed, parse_constant=pytest.fail)
    assert (answer["value"], answer["passed"]) == (None, is_proved)


def test_study_with_a_goal_is_run_by_optimise(written):
    assert main(["study", str(written(SOFTEST))]) == 2
    assert main(["optimise", str(written())]) == 2


CANDIDATES = [planted(P_max, number) for number, P_max in enumerate((4.0, 5.0, 6.0))]


@pytest.fixture
def place(written, tmp_path):
    """Return a study and the place of its best design, in the folder of its store."""
    study = read_study(written("tol = 0.01" + SOFTEST))
    (place,) = places(study, tmp_path / "out")
    with study_store(tmp_path / "out", study):
        yield study, place


def test_design_of_the_first_run_that_passes_is_written_and_gone_where_no_run_passes(place, runs):
    study, place = place
    for failed in (False, InputError("face"), MeshError("housing", "flat", "none"), SolveError("residual")):
        ratios = runs(failed, True)
        proved = prove(study, CANDIDATES, place)
        assert (ratios, proved.candidate, proved.passed) == ([4.0, 5.0], CANDIDATES[1], True)
    runs(OutputError("full"))
    with pytest.raises(OutputError):
        prove(study, CANDIDATES, place)
    assert load_design(place.design).nominal_targets.P_max == 5.0
    ratios = runs(False, False, False)
    assert prove(study, CANDIDATES, place).passed is False
    assert ratios == [4.0, 5.0, 6.0]
    assert not place.design.exists()
    assert prove(study, [planted(1.0, number=1, passes=False)], place) is None


def test_base_that_passes_is_never_lost_though_the_search_says_it_fails(place, runs, written):
    study, place = place
    base = planted(5.0, passes=False)
    ratios = runs(False, True)
    proved = prove(study, [CANDIDATES[2], base], place)
    assert (ratios, proved.candidate, proved.passed) == ([6.0, 5.0], base, True)
    assert load_design(place.design).nominal_targets.P_max == 5.0
    assert value_of_run(study, proved) == 700.0
    assert value_of_run(study, replace(proved, result=None)) is None
    front = read_study(written(FRONT))
    assert (is_base(front, base), is_base(front, planted(8.0))) == (True, False), (
        "of a front the base has its own value"
    )


def test_design_of_a_person_is_refused_before_anything_is_solved(commanded, tmp_path):
    (tmp_path / "out").mkdir()
    path = tmp_path / "out" / "design.toml"
    path.write_text("mine", encoding="utf-8")
    assert commanded(SOFTEST) == 2
    assert [file.name for file in path.parent.iterdir()] == ["design.toml"]


@pytest.mark.study
def test_optimum_of_mango_is_as_good_as_the_preset_and_its_run_passes(commanded, tmp_path, capsys):
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
    assert commanded(text, "--processes", "1", "--json") == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["value"] <= 0.12312  # of mango, docs/presets.md#layouts-of-tips
    report = json.loads((out / "best" / "report.json").read_text(encoding="utf-8"))
    assert report["reading"]["uncertainty_percent"] == pytest.approx(100.0 * answer["value"], rel=0.02)
    assert (out / "best-designs" / "base.toml").is_file()
    assert (out / "study.html").is_file()
