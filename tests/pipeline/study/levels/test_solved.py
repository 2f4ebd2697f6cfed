"""A point with flexures, or with all files, has the numbers of a run to the bit, wherever it was solved."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from pipeline.study import read_study, run_study
from pipeline.study.report_keys import value_at_key
from pipeline.study.store import stored_study
from pipeline.study.workers import Engine

Start = Callable[..., Any]
Write = Callable[..., Path]

FLEXURES = """
base = "paper"
how = "grid"
tol = 0.02
wanted = [
    "flexures.low.stiffness_N_per_m", "flexures.high.error_percent", "deflections_mm.0", "verdicts.K_l.value",
    "springs.K_h_N_per_m", "contact.K_m_over_E_mm", "verdicts.P_max.value", "verdicts.NL.error", "response.3.P.5",
]
[vary]
"targets.P_max" = [4.5, 5.5]
"""


@pytest.fixture
def by_two_processes(start: Start, written: Write, tmp_path: Path) -> bytes:
    """Return the table of the study with flexures, by two processes."""
    return table(start, written(FLEXURES), tmp_path, "two", "--processes", "2")


def table(start: Start, path: Path, folder: Path, name: str, *flags: str) -> bytes:
    """Return the table of a study, solved with a cache of its own so that nothing is read that another one solved."""
    export = folder / f"{name}.csv"
    words = "-m", "pipeline", "study", path, "--out", folder / name, "--export", export, *flags
    code, _, complaint = start(*words, XDG_CACHE_HOME=str(folder / f"{name}-cache")).ended()
    assert (code, complaint) == (0, "")
    return export.read_bytes()


@pytest.mark.slow
@pytest.mark.usefixtures("by_two_processes")
def test_point_with_flexures_and_one_with_files_have_the_numbers_of_a_run(
    written: Write, engine: Engine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "files-cache"))
    text = FLEXURES.replace("[4.5, 5.5]", "[4.5]").replace('how = "grid"', 'how = "grid"\nlevel = "files"')
    study = read_study(written(text))
    assert run_study(study, tmp_path / "files", engine).done == 1
    report = json.loads((tmp_path / "files" / "designs" / "0000000" / "report.json").read_text(encoding="utf-8"))
    of_run = {key: value_at_key(report, key) for key in study.wanted}
    with stored_study(tmp_path / "files") as store:
        assert next(iter(store.rows())).values == of_run
    with stored_study(tmp_path / "two") as store:
        first, second = store.rows()
    assert first.values == of_run
    assert second.values["flexures.low.stiffness_N_per_m"] != first.values["flexures.low.stiffness_N_per_m"]


@pytest.mark.study
def test_points_with_flexures_are_equal_to_the_bit_by_one_process_and_by_a_cluster(
    start: Start, written: Write, by_two_processes: bytes, dask_cluster: tuple[Any, str], tmp_path: Path
) -> None:
    path = written(FLEXURES)
    assert table(start, path, tmp_path, "one", "--processes", "1") == by_two_processes
    assert table(start, path, tmp_path, "dask", "--scheduler", dask_cluster[1]) == by_two_processes
