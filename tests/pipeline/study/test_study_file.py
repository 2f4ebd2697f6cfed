"""A study file is checked when it is read: each wrong word or number is one line that names what is near."""

from collections.abc import Callable
from pathlib import Path

import pytest

from cad.quantity import InputError
from pipeline.options import load_design
from pipeline.study import read_study
from pipeline.study.points import design_of, point_count, points_between
from pipeline.study.variation import Choices, Normal, Span

Write = Callable[..., Path]
PROCESS_FILE = Path(__file__).parents[3] / "cad" / "design" / "processes.toml"


def test_study_file_is_read(written: Write) -> None:
    study = read_study(written())
    assert study.name == "springs"
    assert study.vary == {"targets.P_max": Span(start=3.0, end=8.0)}
    assert (study.samples, study.seed, study.level) == (8, 7, "contact")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("samples", "sampels", "did you mean samples?"),
        ('"targets.P_max"', '"targets.P_mx"', "did you mean targets.P_max?"),
        ("springs.K_l_N_per_m", "springs.K_low", "did you mean springs.K_l_N_per_m?"),
        ("to = 8", "too = 8", "did you mean to?"),
        ("to = 8", "to = 2", "empty range"),
        ("to = 8", "to = 'x'", "must be a number"),
        ("to = 8", "to = 8, distribution = 'normal'", "mean and sd"),
        ("from = 3, to = 8", "mean = 5, sd = 0.1", "source"),
        ("from = 3, to = 8", "mean = 5, sd = 0, source = 'x'", "greater than 0"),
        ("from = 3", "from = 0, log = true", "log"),
        ("{ from = 3, to = 8 }", "[]", "empty list"),
        ("samples = 8", "samples = 0", "at least 1"),
        ("samples = 8", 'how = "grid"', "steps"),
        ("samples = 8", 'how = "gird"', "did you mean grid?"),
        ("samples = 8", 'points = "missing.csv"', "missing.csv"),
        ('"paper"', '"papr"', "did you mean paper?"),
        ("seed = 7", "tol = 1.0", "at most 0.1"),
        ("seed = 7", "seed = -1", "at least 0"),
        ("{ from = 3, to = 8 }", "[3.0, nan]", "vary targets.P_max: value = 'nan'"),
        ("{ from = 3, to = 8 }", "[3.0, 2026-01-01]", "vary targets.P_max: value = '2026-01-01'"),
        ("{ from = 3, to = 8 }", "[[3.0, inf]]", "a finite number"),
        ("seed = 7", "set = 3", "set = '3': must be a table"),
        ("seed = 7", "set = { 'targets.NL' = 2026-01-01 }", "set targets.NL = '2026-01-01'"),
        ("seed = 7", "set = { 'targets.NL' = nan }", "set targets.NL = 'nan'"),
        ("seed = 7", "optimise = { minimize = 'x' }", "did you mean minimise?"),
    ],
)
def test_wrong_study_file_is_refused_in_one_line(written: Write, old: str, new: str, words: str) -> None:
    with pytest.raises(InputError) as refused:
        point_count(read_study(written(**{old: new})))
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_base_may_name_a_process_file_beside_it(written: Write, tmp_path: Path) -> None:
    resin = PROCESS_FILE.read_text(encoding="utf-8").partition("[sla-resin]")[2].partition("[dmls-17-4ph]")[0]
    own = "[tough-resin]" + resin.replace("sla-resin", "tough-resin").replace("E_MPa = 2500.0", "E_MPa = 1900.0")
    (tmp_path / "own.toml").write_text(own, encoding="utf-8")
    (tmp_path / "mine.toml").write_text('[print]\nprocess_file = "own.toml"\n', encoding="utf-8")
    study = read_study(written(**{'"paper"': '"mine.toml"'}))
    assert design_of(study, {}) == load_design(tmp_path / "mine.toml")
    assert design_of(study, {}).process.E_MPa == 1900.0
    named = read_study(written(**{"[vary]": '[set]\n"print.process_file" = "own.toml"\n[vary]'}))
    assert design_of(named, {}).process.E_MPa == 1900.0


def test_grid_takes_every_combination_with_both_ends(written: Write) -> None:
    path = written(
        **{"samples = 8": 'how = "grid"', "to = 8 }": 'to = 12, steps = 3, log = true }\n"targets.NL" = [0.04, 0.05]'}
    )
    study = read_study(path)
    points = list(points_between(study, 0, point_count(study)))
    assert [point.number for point in points] == list(range(6))
    assert [tuple(point.settings.values()) for point in points] == [
        (pytest.approx(P_max), NL) for P_max in (3.0, 6.0, 12.0) for NL in (0.04, 0.05)
    ]


def test_sobol_points_do_not_depend_on_who_asks_and_a_longer_study_begins_alike(written: Write) -> None:
    short, long = (read_study(written(**{"samples = 8": f"samples = {n}"})) for n in (8, 64))
    whole = list(points_between(long, 0, 64))
    assert whole[:8] == list(points_between(short, 0, 8))
    assert whole[20:30] == list(points_between(long, 20, 30))


def test_points_of_a_file(written: Write, tmp_path: Path) -> None:
    (tmp_path / "some.csv").write_text("targets.P_max,print.process\n4,fdm-petg\n6.5,sla-resin\n", encoding="utf-8")
    study = read_study(
        written(**{"samples = 8": 'points = "some.csv"', "[vary]\n": "", '"targets.P_max" = { from = 3, to = 8 }': ""})
    )
    assert [dict(point.settings) for point in points_between(study, 0, 2)] == [
        {"targets.P_max": 4, "print.process": "fdm-petg"},
        {"targets.P_max": 6.5, "print.process": "sla-resin"},
    ]


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("targets.P_max,targets.P_max\n4,5\n", "in the header once"),
        ("targets.P_max\n4\nnan\n", "points targets.P_max: value = 'nan'"),
        ("targets.P_max\n2026-01-01\n", "points targets.P_max: value = '2026-01-01'"),
    ],
)
def test_wrong_file_of_points_is_one_line(written: Write, tmp_path: Path, rows: str, words: str) -> None:
    (tmp_path / "some.csv").write_text(rows, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        read_study(written('base = "paper"\npoints = "some.csv"\nwanted = ["springs.K_l_N_per_m"]\n'))


def test_missing_study_file_is_named_as_one(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"^study file .*not found"):
        read_study(tmp_path / "nothere.toml")


def test_distributions_have_their_quantiles() -> None:
    normal = Normal(mean=5.0, sd=0.2, source="a table")
    assert normal.at(0.5) == 5.0
    assert normal.at(0.975) == pytest.approx(5.0 + 1.959964 * 0.2, abs=1e-6)  # the 97.5 % quantile of tables
    assert Span(start=2.0, end=8.0).at(0.25) == 3.5
    assert Span(start=1.0, end=16.0, log=True).at(0.25) == pytest.approx(2.0)
    assert [Choices(values=("a", "b")).at(share) for share in (0.0, 0.49, 0.5, 1.0)] == ["a", "a", "b", "b"]
