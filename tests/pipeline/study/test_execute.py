"""A study solves each of its points once, keeps what goes wrong with it, and goes on where it was ended."""

import errno
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from cad.files.export_error import ExportError
from cad.quantity import InputError
from cad.theory.two_spring_law import size_springs
from pipeline.cli import main
from pipeline.options import RunOptions, load_design
from pipeline.response.contact import fruit_compliance
from pipeline.springs.sizing import spring_sizing
from pipeline.study import Study, execute, read_study, run_study, tasks
from pipeline.study.export import export_table
from pipeline.study.levels import sized
from pipeline.study.levels.unit_scene import scene_compliance, unit_scene
from pipeline.study.points import design_of
from pipeline.study.store import stored_study, study_store
from pipeline.study.tasks import Task
from pipeline.study.workers import Engine
from solve.fruit.split import SplitDomainError

Write = Callable[..., Path]
FEW = "from = 0.3, to = 0.5"


def table(folder: Path, study_path: Path) -> str:
    """Return the table of a study as CSV."""
    target = folder.with_suffix(".csv")
    with stored_study(folder) as store:
        export_table(store, read_study(study_path), target)
    return target.read_text(encoding="utf-8")


def test_springs_of_a_study_follow_the_law_and_agree_with_the_run(
    written: Write, engine: Engine, tmp_path: Path
) -> None:
    path = written()
    summary = run_study(read_study(path), tmp_path / "out", engine)
    assert (summary.points, summary.done, summary.refused, summary.failed) == (8, 8, 0, 0)
    design = load_design("paper")
    contact = fruit_compliance(design, RunOptions())
    K_m_max = 3.5 * contact.K_m_over_E()
    with stored_study(tmp_path / "out") as store:
        rows = list(store.rows())
    for row in rows:
        springs = size_springs(float(str(row.settings["targets.P_max"])), 0.05, K_m_max)
        assert row.values["springs.K_l_N_per_m"] == pytest.approx(1e3 * springs.K_l, rel=1e-12)
        assert row.values["springs.K_h_N_per_m"] == pytest.approx(1e3 * springs.K_h, rel=1e-12)
    sized = spring_sizing(
        load_design("paper", {"targets.P_max": rows[0].settings["targets.P_max"]}), contact, RunOptions()
    )
    assert rows[0].values["springs.K_l_N_per_m"] == 1e3 * sized.springs.K_l


def test_scene_twice_as_large_gives_half_the_compliance() -> None:
    one = load_design("paper")
    large = {"fruit.length_mm": 26.0, "fruit.width_mm": 26.0, "fruit.height_mm": 15.6, "tips.side_mm": 1.3}
    two = load_design("paper", {**large, "tips.spacing_mm": 10.4})
    assert unit_scene(one) == unit_scene(two)
    S = scene_compliance(unit_scene(two), 1e-3).S
    assert pytest.approx(scene_compliance(unit_scene(one), 1e-3).S, rel=1e-12) == S * 1.3
    assert pytest.approx(fruit_compliance(two, RunOptions()).S, rel=1e-9) == S  # of the run, in its own size


def test_modulus_and_gap_share_a_scene_and_poisson_does_not() -> None:
    one = unit_scene(load_design("paper"))
    assert unit_scene(load_design("paper", {"fruit.E_max_MPa": 2.0, "fruit.E_MPa": [1.0], "tips.gap_mm": 0.2})) == one
    assert unit_scene(load_design("paper", {"fruit.poisson": 0.31})) != one


def test_point_outside_bounds_is_kept_with_its_reason(written: Write, engine: Engine, tmp_path: Path) -> None:
    path = written(**{"from = 3, to = 8": "from = 90, to = 110"})
    summary = run_study(read_study(path), tmp_path / "out", engine)
    assert summary.refused > 0
    assert summary.done + summary.refused == 8
    with stored_study(tmp_path / "out") as store:
        refused = [row for row in store.rows() if row.status == "refused"]
    assert len(refused) == summary.refused
    assert all("at most 100" in str(row.error) for row in refused)


def test_points_out_of_bounds_of_a_big_study_are_all_kept_and_counted(
    written: Write, engine: Engine, tmp_path: Path
) -> None:
    """Of 1,200 points over 90 to 110 those above 100 are refused, each by its own number, and stay so when resumed."""
    path = written(**{"from = 3, to = 8": "from = 90, to = 110", "samples = 8": "samples = 1200"})
    summary = run_study(read_study(path), tmp_path / "out", engine)
    with stored_study(tmp_path / "out") as store:
        rows = list(store.rows())
        messages = store.messages()
    asked = {row.number: float(str(row.settings["targets.P_max"])) for row in rows}
    above = {number for number, P_max in asked.items() if P_max > 100.0}
    assert {row.number for row in rows if row.status == "refused"} == above
    assert (summary.refused, summary.done, len(rows)) == (len(above), 1200 - len(above), 1200)
    assert all(str(asked[row.number])[:8] in str(row.error) for row in rows if row.number in above)
    assert list(messages.values()) == [len(above)]  # one reason, told by the first of its points
    assert str(asked[min(above)])[:8] in next(iter(messages))
    lines = table(tmp_path / "out", path).splitlines()
    assert sum(",refused," in line and "at most 100" in line for line in lines) == len(above)
    again = run_study(read_study(path), tmp_path / "out", engine)
    assert (again.solved, again.refused) == (0, len(above))


def test_what_is_wanted_alone_is_what_it_is_among_all(written: Write, engine: Engine, tmp_path: Path) -> None:
    keys = ("springs.K_l_N_per_m", "level.NL", "verdicts.printable.low.value", "verdicts.NL.error", "response.0.P.3")
    together = run_values(read_study(written()), keys, tmp_path / "all", engine)
    for key in keys:
        alone = run_values(read_study(written()), (key,), tmp_path / key, engine)
        assert alone == [{key: values[key]} for values in together]


def run_values(study: Study, wanted: tuple[str, ...], folder: Path, engine: Engine) -> list[dict[str, object]]:
    """Return what is wanted of every point of a study."""
    run_study(replace(study, wanted=wanted), folder, engine)
    with stored_study(folder) as store:
        return [dict(row.values) for row in store.rows()]


def test_springs_alone_ask_no_printer(
    written: Write, engine: Engine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise NotImplementedError

    monkeypatch.setattr(sized, "springs_as_sized", refuse)
    assert run_study(read_study(written()), tmp_path / "out", engine).done == 8
    asked = replace(read_study(written()), wanted=("verdicts.printable.low.value",))
    assert run_study(asked, tmp_path / "asked", engine).failed == 8


@pytest.mark.parametrize("base", ["paper", "mango"])
def test_design_of_a_point_is_that_of_its_settings(written: Write, base: str) -> None:
    study = read_study(written(**{'"paper"': f'"{base}"', "targets.P_max": "press.travel_mm", "from = 3, to = 8": FEW}))
    settings = {"press.travel_mm": 0.4, "fruit.E_max_MPa": 2.5}
    assert design_of(study, settings) == load_design(base, settings)
    assert design_of(study, {}) == load_design(base)


def test_tasks_do_not_carry_all_rows_of_a_file(written: Write, engine: Engine, tmp_path: Path) -> None:
    """600 rows make two tasks, each with its own points and no others."""
    rows = "\n".join(f"{3.0 + 0.01 * place}" for place in range(600))
    (tmp_path / "rows.csv").write_text(f"targets.P_max\n{rows}\n", encoding="utf-8")
    study = read_study(written('points = "rows.csv"\nwanted = ["springs.K_l_N_per_m"]\n'))
    sent: list[Task] = []

    class Noting(type(engine.open())):
        def submit(self, fn, /, *args, **kwargs):
            sent.extend(args)
            return super().submit(fn, *args, **kwargs)

    assert run_study(study, tmp_path / "out", replace(engine, open=Noting)).done == 600
    assert [len(task.points) for task in sent] == [500, 100]
    assert [(task.study.rows, len(task.study.vary["targets.P_max"].grid())) for task in sent] == [((), 1)] * 2


def test_ended_study_goes_on_to_the_same_table(
    written: Write, engine: Engine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written()
    study = read_study(path)
    run_study(study, tmp_path / "whole", engine)
    monkeypatch.setattr(execute, "RANGE", 3)  # so that it ends after one of three tasks

    class EndedError(RuntimeError):
        pass

    def end(solved: int, _count: int) -> None:
        if solved >= 1:
            raise EndedError

    with pytest.raises(EndedError):
        run_study(study, tmp_path / "ended", engine, end)
    monkeypatch.setattr(execute, "RANGE", 5)
    again = run_study(study, tmp_path / "ended", engine)
    assert again.done == 8
    assert again.solved in (5, 6)  # tasks of 3, 3 and 2 points end in any order
    assert table(tmp_path / "ended", path) == table(tmp_path / "whole", path)
    assert run_study(study, tmp_path / "ended", engine).solved == 0


def test_longer_study_solves_only_what_is_new(written: Write, engine: Engine, tmp_path: Path) -> None:
    run_study(read_study(written()), tmp_path / "out", engine)
    longer = run_study(read_study(written(**{"samples = 8": "samples = 12"})), tmp_path / "out", engine)
    assert (longer.done, longer.solved) == (12, 4)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"paper"', '"paper"\n[set]\n"targets.NL" = 0.06\n[x]\n', "base.targets.NL = 0.06: must be 0.05"),
        ("to = 8", "to = 9", "vary.targets.P_max.end = 9.0: must be 8.0"),
        ("seed = 7", "seed = 8", "seed = 8: must be 7"),
        ("samples = 8", "samples = 4", "samples = 4: must be 8"),
    ],
)
def test_changed_study_is_refused_with_the_difference(
    written: Write, engine: Engine, tmp_path: Path, old: str, new: str, words: str
) -> None:
    run_study(read_study(written()), tmp_path / "out", engine)
    if "[x]" in new:
        text = written().read_text(encoding="utf-8") + '[set]\n"targets.NL" = 0.06\n'
        changed = written(text)
    else:
        changed = written(**{old: new})
    with pytest.raises(InputError, match=words.replace("[", r"\[")):
        run_study(read_study(changed), tmp_path / "out", engine)


def test_two_runs_on_one_study_refuse(written: Write, tmp_path: Path) -> None:
    study = read_study(written())
    with (
        study_store(tmp_path / "out", study),
        pytest.raises(InputError, match="no other run writes"),
        study_store(tmp_path / "out", study),
    ):
        pass


def test_folder_of_something_else_is_refused(written: Write, engine: Engine, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "report.json").touch()
    with pytest.raises(InputError, match="new, empty or the folder of this study"):
        run_study(read_study(written()), tmp_path / "out", engine)


@pytest.mark.parametrize(("losses", "done"), [(4, 8), (5, 0)])
def test_lost_worker_is_tried_again_and_at_last_a_failed_point(
    written: Write, engine: Engine, tmp_path: Path, losses: int, done: int
) -> None:
    left = iter(range(losses))

    class Losing(type(engine.open())):
        def submit(self, fn, /, *args, **kwargs):
            def lose():
                raise ConnectionError

            return super().submit(fn, *args, **kwargs) if next(left, None) is None else super().submit(lose)

    summary = run_study(read_study(written()), tmp_path / "out", replace(engine, open=Losing))
    assert (summary.done, summary.failed) == (done, 8 - done)
    with stored_study(tmp_path / "out") as store:
        assert all(row.error is None or "lost again and again" in row.error for row in store.rows())
    again = run_study(read_study(written()), tmp_path / "out", engine)
    assert (again.done, again.failed, again.solved) == (8, 0, 8 - done)


@pytest.mark.parametrize("error", [KeyError, IndexError, MemoryError, TypeError, ExportError, SplitDomainError])
def test_point_that_fails_in_any_way_does_not_stop_the_others(
    written: Write, engine: Engine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: type[Exception]
) -> None:
    count = iter(range(8))

    def solve(*_: object) -> dict[str, object]:
        if next(count) == 1:
            raise error("of this test")
        return {"springs": {"K_l_N_per_m": 1.0, "K_h_N_per_m": 2.0}}

    monkeypatch.setattr(tasks, "sized_report", solve)
    monkeypatch.setattr(tasks, "scene_compliance", lambda *_: None)
    summary = run_study(read_study(written()), tmp_path / "out", engine)
    assert (summary.done, summary.failed) == (7, 1)


@pytest.mark.parametrize("wrapped", [False, True])
def test_full_disk_is_no_fault_of_a_point(
    written: Write, engine: Engine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, wrapped: bool
) -> None:
    def solve(*_: object) -> dict[str, object]:
        full = OSError(errno.ENOSPC, "No space left on device", "response.csv")
        if not wrapped:
            raise full
        message = "--out: must have room"
        raise InputError(message) from full

    study = read_study(written())
    with monkeypatch.context() as patch:
        patch.setattr(tasks, "sized_report", solve)
        with pytest.raises((OSError, InputError), match=r"room|No space"):
            run_study(study, tmp_path / "out", engine)
    assert run_study(study, tmp_path / "out", engine).done == 8


def test_contact_alone_imports_no_solids(written: Write) -> None:
    program = (
        "import sys; from pathlib import Path; from pipeline.study import read_study\n"
        "from pipeline.study.tasks import Task, solve_task\n"
        "from pipeline.study.points import points_between\n"
        "study = read_study(Path(sys.argv[1]))\n"
        "results = solve_task(Task(study=study, points=tuple(points_between(study, 0, 2))))\n"
        "assert {one.status for one in results} == {'done'}, results\n"
        "print([name for name in ('cadquery', 'OCP', 'gmsh', 'pyvista') if name in sys.modules])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, written()], capture_output=True, text=True, timeout=600, check=True
    )
    assert done.stdout == "[]\n"


def test_command_prints_counts_and_writes_the_table(
    written: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, csv = tmp_path / "out", tmp_path / "springs.csv"
    words = ["study", str(written()), "--out", str(out), "--processes", "1"]
    assert main([*words, "--export", str(csv)]) == 0
    assert "8 points: 8 done, 0 refused, 0 failed" in capsys.readouterr().out
    assert csv.read_text(encoding="utf-8") == table(out, written())
    assert main([*words, "--export", str(tmp_path / "x.parquet")]) == 0
    parquet = pytest.importorskip("pyarrow.parquet").read_table(tmp_path / "x.parquet")
    assert parquet.num_rows == 8
    assert "springs.K_l_N_per_m" in parquet.column_names


@pytest.mark.parametrize(
    "words", [["--export", "x.xlsx"], ["--processes", "0"], ["--processes", "2", "--scheduler", "tcp://x:1"]]
)
def test_wrong_flags_are_one_line(
    written: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str]
) -> None:
    assert main(["study", str(written()), "--out", str(tmp_path / "out"), *words]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "out").exists()
