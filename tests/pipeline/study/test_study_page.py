"""The page of a study stands by itself: it asks for nothing from a network, and its links lead to designs that load."""

import re
from collections.abc import Callable
from pathlib import Path

from pipeline.cli import main
from pipeline.options import load_design
from pipeline.study import read_study, run_study
from pipeline.study.answers.study_page import write_page
from pipeline.study.store import stored_study
from pipeline.study.workers.engine import Engine

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
    assert text.count("<svg") == 4  # effects on two numbers, all points, a map
    assert not re.search(r"(?:src|href)=\"https?:|<script", text)
    links = re.findall(r'<a href="([^"]+)">(\d+)</a>', text)
    assert [int(number) for _, number in links] == sorted(values, key=lambda number: values[number])[:10]
    for link, _ in links:
        assert load_design(tmp_path / "out" / link).nominal_targets.P_max >= 3.0


def test_command_writes_the_page(written: Callable[..., Path], tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert main(["study", str(written()), "--out", str(out), "--processes", "1", "--html"]) == 0
    assert "<svg" in (out / "study.html").read_text(encoding="utf-8")
