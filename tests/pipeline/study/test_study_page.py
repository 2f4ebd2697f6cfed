"""The page of a study stands by itself: it asks for nothing from a network, and its links lead to designs that load."""

import re
import tracemalloc
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.cli import main
from pipeline.options import load_design
from pipeline.study import Study, read_study, run_study
from pipeline.study.answers.point_columns import point_columns
from pipeline.study.answers.study_page import write_page
from pipeline.study.answers.study_plots import bin_means, drawn_at_random
from pipeline.study.export import export_table
from pipeline.study.points import points_between
from pipeline.study.store import StudyStore, stored_study, study_store
from pipeline.study.tasks import PointResult
from pipeline.study.workers import Engine

TWO = '"targets.P_max" = { from = 3, to = 8 }\n"targets.NL" = { from = 0.03, to = 0.08 }'


def test_page_has_plots_and_the_best_ten_and_no_network(
    written: Callable[..., Path], engine: Engine, tmp_path: Path
) -> None:
    path = written(**{'"targets.P_max" = { from = 3, to = 8 }': TWO, "samples = 8": "samples = 16"})
    study = read_study(path)
    run_study(study, tmp_path / "out", engine)
    pages = []
    for _ in range(2):
        with stored_study(tmp_path / "out") as store:
            write_page(store, study, tmp_path / "out" / "study.html")
            values = {row.number: float(str(row.values["springs.K_l_N_per_m"])) for row in store.rows()}
        pages.append((tmp_path / "out" / "study.html").read_text(encoding="utf-8"))
    text = pages[0]
    assert pages[1] == text  # the same bytes every time
    assert text.count("<svg") == 6  # effects of two keys on two numbers, a map, points as lines
    assert not re.search(r"(?:src|href)=\"https?:|<script", text)
    links = re.findall(r'<a href="([^"]+)">(\d+)</a>', text)
    assert [int(number) for _, number in links] == sorted(values, key=lambda number: values[number])[:10]
    for link, _ in links:
        assert load_design(tmp_path / "out" / link).nominal_targets.P_max >= 3.0


def test_best_prints_have_no_design_files_and_the_page_says_why(
    written: Callable[..., Path], engine: Engine, tmp_path: Path
) -> None:
    miss = "mean = 0, sd = 0.1, source = 'test'"
    study = read_study(written(**{"targets.P_max": "printed.E_offset", "from = 3, to = 8": miss}))
    assert run_study(study, tmp_path / "out", engine).done == 8
    with stored_study(tmp_path / "out") as store:
        write_page(store, study, tmp_path / "out" / "study.html")
    text = (tmp_path / "out" / "study.html").read_text(encoding="utf-8")
    assert "<a href" not in text
    assert "They have no design files" in text
    assert not (tmp_path / "out" / "best-designs").exists()


def test_command_writes_the_page(written: Callable[..., Path], tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert main(["study", str(written()), "--out", str(out), "--processes", "1", "--html"]) == 0
    assert "<svg" in (out / "study.html").read_text(encoding="utf-8")


def planted(study: Study) -> Iterable[PointResult]:
    """Yield points whose numbers follow formulas; every tenth is refused, each with a number of its own."""
    for point in points_between(study, 0, study.samples):
        P_max = float(str(point.settings["targets.P_max"]))
        refused = point.number % 10 == 9
        yield PointResult(
            number=point.number,
            settings=point.settings,
            status="refused" if refused else "done",
            values={} if refused else {"springs.K_l_N_per_m": 1e3 / P_max, "springs.K_h_N_per_m": 7.0},
            error=f"targets.P_max = {P_max:g}: must be another" if refused else None,
            seconds=0.0,
        )


def many(written: Callable[..., Path], folder: Path, samples: int) -> tuple[Study, Path]:
    """Return a study of so many planted points with the folder of its store."""
    text = {'"targets.P_max" = { from = 3, to = 8 }': TWO, "samples = 8": f"samples = {samples}"}
    study = read_study(written(**text))
    with study_store(folder, study) as store:
        store.put(planted(study))
    return study, folder


def test_page_of_many_points_is_small_and_says_what_it_shows(written: Callable[..., Path], tmp_path: Path) -> None:
    study, out = many(written, tmp_path / "out", 5_000)
    with stored_study(out) as store:
        write_page(store, study, out / "study.html")
        values = {row.number: row.values["springs.K_l_N_per_m"] for row in store.rows() if row.status == "done"}
    text = (out / "study.html").read_text(encoding="utf-8")
    assert len(text) < 1_000_000  # dots as shapes of their own would take more, and more with each point
    assert "4,500 points done, 500 refused, 0 failed" in text
    assert "1,000 of them as dots and 300 as lines, drawn at random" in text
    assert "springs.K_h_N_per_m = 7." in text  # the same at every point, and not drawn
    assert text.count("<svg") == 4  # effects of two keys on one number, a map, points as lines
    assert "500 points, for instance: targets.P_max = " in text
    best = [int(number) for number in re.findall(r"<a href=\"[^\"]+\">(\d+)</a>", text)]
    assert best == sorted(values, key=lambda number: float(str(values[number])))[:10]


def test_means_are_those_of_the_formula() -> None:
    """The mean of x^2 over a part from a to b of a span is (a^2 + a b + b^2) / 3; there are twelve parts."""
    x = (np.arange(120_000) + 0.5) / 10_000.0
    places, means = bin_means(x, x**2)
    low = np.arange(12.0)
    assert places == pytest.approx(low + 0.5, abs=1e-3)
    assert means == pytest.approx((low**2 + low * (low + 1.0) + (low + 1.0) ** 2) / 3.0, rel=1e-3)
    unknown = np.where(x < 6.0, np.nan, x**2)
    last = (11.5**2 + 11.5 * 12.0 + 12.0**2) / 3.0  # the parts of what is known, from 6 to 12, are half as wide
    assert bin_means(x, unknown)[1][-1] == pytest.approx(last, rel=1e-3)
    assert bin_means(np.array([3.0, 5.0, 3.0]), np.array([1.0, 4.0, 2.0]))[1] == pytest.approx([1.5, 4.0])


def test_dots_are_drawn_from_all_points() -> None:
    """Points of a grid in their order would show its first corner alone."""
    places = drawn_at_random(1_000_000, 1000)
    assert len(set(places.tolist())) == 1000
    assert np.histogram(places, bins=4, range=(0, 1_000_000))[0].min() > 150  # of 250; 8 standard deviations
    assert drawn_at_random(5, 1000).tolist() == [0, 1, 2, 3, 4]


def test_null_is_no_number_and_texts_have_no_column(written: Callable[..., Path], tmp_path: Path) -> None:
    keys = ("contact.dofs", "contact.method", "verdicts.P_max.passed", "verdicts.P_max.error")
    study = replace(read_study(written()), wanted=keys)
    rows = [(5, "split", True, None), (7, "split", None, 0.5), (3, "direct", False, 1.5)]
    with study_store(tmp_path / "out", study) as store:
        store.put(_point(number, dict(zip(keys, row, strict=True))) for number, row in enumerate(rows))
        columns = point_columns(store, keys)
        assert set(columns.values) == {"contact.dofs", "verdicts.P_max.error"}
        assert columns.best("verdicts.P_max.error", 3) == [1, 2, 0]
        assert [point.number for point in store.picked(columns.best("contact.dofs", 2))] == [2, 0]
        _check_parquet(store, study, tmp_path / "table.parquet")


def _point(number: int, values: dict[str, object]) -> PointResult:
    settings = {"targets.P_max": 3.0}
    return PointResult(number=number, settings=settings, status="done", values=values, error=None, seconds=0.0)


def _check_parquet(store: StudyStore, study: Study, path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    export_table(store, study, path)
    read = parquet.read_table(path)
    assert [str(field.type) for field in read.schema] == [
        "int64", "string", "double", "int64", "string", "bool", "double", "string"
    ]  # fmt: skip
    assert read.column("verdicts.P_max.error").to_pylist() == [None, 0.5, 1.5]
    assert read.column("verdicts.P_max.passed").to_pylist() == [True, None, False]


def test_export_holds_a_few_rows_at_a_time(written: Callable[..., Path], tmp_path: Path) -> None:
    """Eight times the points ask for no more memory; held as a list they ask for eight times as much."""
    peaks = []
    for samples in (1_000, 8_000):
        study, out = many(written, tmp_path / str(samples), samples)
        with stored_study(out) as store:
            tracemalloc.start()
            export_table(store, study, tmp_path / f"{samples}.csv")
            peaks.append(tracemalloc.get_traced_memory()[1])
            tracemalloc.stop()
    assert peaks[1] < 2.0 * peaks[0]
