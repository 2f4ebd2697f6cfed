"""A study solves each of its points once, keeps what goes wrong with it, and goes on where it was ended."""

import errno
import json
from contextlib import nullcontext
from dataclasses import replace
from itertools import chain

import pytest
import stand_ins

from pipeline.options import RunOptions, load_design
from pipeline.report.of_result import SensorParts
from pipeline.response import scaled_scene as scenes
from pipeline.response.contact import contact_compliance, fruit_compliance
from pipeline.response.scaled_scene import scene_compliance, unit_scene
from pipeline.springs.fitted_springs import springs_for
from pipeline.study import read_study, run_study, tasks
from pipeline.study.points import Point
from pipeline.study.store import stored_study
from pipeline.study.wanted import level_of
from sensor.design.parameters import Design
from sensor.machine_error import MachineError
from sensor.quantity import InputError
from sensor.theory.two_spring_law import size_springs
from twintip.cli import main
from twintip.commands import study as command

TASKS = [
    ("contact", 8, 1, {1}),
    ("contact", 600, 1, {37, 8}),  # 600 / 16, and what is left
    ("contact", 600, 4, {9, 6}),
    ("flexures", 40, 1, {1}),
]
"""A level, a number of points, of workers, and how many points the tasks have."""


def solved(study, folder, engine):
    """Return the points of a study that is solved in a folder."""
    run_study(study, folder, engine)
    with stored_study(folder) as store:
        return list(store.rows())


def test_springs_of_a_study_follow_the_law(written, engine, tmp_path):
    rows = solved(read_study(written()), tmp_path / "out", engine)
    K_m_max = 3.5 * fruit_compliance(load_design("paper"), RunOptions()).K_m_over_E()
    assert [row.status for row in rows] == ["done"] * 8
    for row in rows:
        springs = size_springs(row.settings["targets.P_max"], 0.05, K_m_max)
        assert row.values["springs.K_l_N_per_m"] == pytest.approx(1e3 * springs.K_l, rel=1e-12)
        assert row.values["springs.K_h_N_per_m"] == pytest.approx(1e3 * springs.K_h, rel=1e-12)


def test_scene_twice_as_large_gives_half_the_compliance():
    small = load_design("paper")
    lengths = {"fruit.length_mm": 26.0, "fruit.width_mm": 26.0, "fruit.height_mm": 15.6, "tips.side_mm": 1.3}
    large = load_design("paper", {**lengths, "tips.spacing_mm": 10.4})
    assert unit_scene(small) == unit_scene(large)
    S = scene_compliance(unit_scene(large), 1e-3).S
    assert pytest.approx(scene_compliance(unit_scene(small), 1e-3).S, rel=1e-12) == S * 1.3
    assert pytest.approx(fruit_compliance(large, RunOptions()).S, rel=1e-9) == S  # of the run, in its own size


def test_modulus_and_gap_share_a_scene_and_poisson_does_not():
    scene = unit_scene(load_design("paper"))
    assert unit_scene(load_design("paper", {"fruit.E_max_MPa": 2.0, "fruit.E_MPa": [1.0], "tips.gap_mm": 0.2})) == scene
    assert unit_scene(load_design("paper", {"fruit.poisson": 0.31})) != scene


def test_points_out_of_bounds_are_kept_with_their_reasons(written, engine, tmp_path):
    """Of 1,200 points over 90 to 110 those above 100 are refused, each by its own number, and stay so when resumed."""
    study = read_study(written(**{"from = 3, to = 8": "from = 90, to = 110", "samples = 8": "samples = 1200"}))
    rows = solved(study, tmp_path / "out", engine)
    refused = [row for row in rows if row.status == "refused"]
    assert [row.number for row in refused] == [row.number for row in rows if row.settings["targets.P_max"] > 100.0]
    assert all(str(row.settings["targets.P_max"])[:8] in str(row.error) for row in refused)
    with stored_study(tmp_path / "out") as store:
        assert store.messages() == {refused[0].error: len(refused)}  # one reason, told by the first of its points
    again = run_study(study, tmp_path / "out", engine)
    assert (again.solved, again.refused, again.done) == (0, len(refused), 1200 - len(refused))


class Noting:
    """An engine's executor that notes the numbers of the points in each task."""

    def __init__(self, engine, workers):
        self.tasks: list[list[int]] = []
        self.engine = replace(engine, open=lambda: self, workers=workers)
        self._executor = engine.open()

    def submit(self, work, points):
        self.tasks.append([point.number for point in points])
        assert work.args[0].rows == ()  # a worker is not sent all rows of a file with each task
        return self._executor.submit(work, points)

    def shutdown(self): ...


@pytest.mark.parametrize(("level", "points", "workers", "sizes"), TASKS)
def test_cheap_points_go_together_and_no_worker_waits(
    written, engine, tmp_path, monkeypatch, level, points, workers, sizes
):
    monkeypatch.setattr(tasks, "_wanted_values", lambda *_: {"springs.K_l_N_per_m": 1.0})
    rows = "\n".join(f"{3.0 + 0.01 * i}" for i in range(points))
    (tmp_path / "rows.csv").write_text(f"targets.P_max\n{rows}\n", encoding="utf-8")
    noting = Noting(engine, workers)
    study = read_study(written(f'points = "rows.csv"\nlevel = "{level}"\nwanted = ["springs.K_l_N_per_m"]\n'))
    assert run_study(study, tmp_path / "out", noting.engine).done == points
    assert sorted(chain.from_iterable(noting.tasks)) == list(range(points))
    assert {len(numbers) for numbers in noting.tasks} == sizes


def test_scene_is_solved_once_and_then_read_from_the_cache(written, engine, tmp_path, monkeypatch):
    """Of 2 sides and 3 ratios two scenes are solved; a worker that begins later finds both in the cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    solves = []

    def noted(fruit, tips, tolerance):
        solves.append(tips.spacing_mm)
        return contact_compliance(fruit, tips, tolerance)

    monkeypatch.setattr(scenes, "contact_compliance", noted)
    text = {
        "samples = 8": 'how = "grid"\ntol = 0.02',
        "{ from = 3, to = 8 }": '[4, 5, 6]\n"tips.side_mm" = [1.0, 1.25]',
    }
    study = read_study(written(**text))
    for folder in ("one", "later"):
        scenes._unit_compliance.cache_clear()  # as in a process of its own
        assert run_study(study, tmp_path / folder, engine).done == 6
    assert len(solves) == len(set(solves)) == 2
    with stored_study(tmp_path / "one") as one, stored_study(tmp_path / "later") as later:
        assert [row.values for row in one.rows()] == [row.values for row in later.rows()]


def test_ended_study_goes_on_to_the_same_points(written, engine, tmp_path):
    study = read_study(written())
    whole = solved(study, tmp_path / "whole", engine)

    class EndedError(RuntimeError):
        pass

    def end(ended, _points):
        if ended:
            raise EndedError

    with pytest.raises(EndedError):
        run_study(study, tmp_path / "ended", engine, end)
    again = run_study(study, tmp_path / "ended", engine)
    assert (again.done, again.solved) == (8, 7)
    ended = solved(study, tmp_path / "ended", engine)
    assert [(row.number, row.values) for row in ended] == [(row.number, row.values) for row in whole]


def failing(monkeypatch, error, *, always=False):
    """Let the second point of a study raise an error, or all."""
    count = iter(range(8))

    def solve(*_):
        if next(count) == 1 or always:
            raise error
        return {"springs": {"K_l_N_per_m": 1.0, "K_h_N_per_m": 2.0}}

    monkeypatch.setattr(tasks, "SensorParts", solve)


def test_point_that_fails_in_any_way_does_not_stop_the_others(written, engine, tmp_path, monkeypatch):
    """The exit code of the command is then 1."""
    failing(monkeypatch, KeyError())
    summary = run_study(read_study(written()), tmp_path / "out", engine)
    assert (summary.done, summary.failed) == (7, 1)
    failing(monkeypatch, KeyError())
    monkeypatch.setattr(command, "chosen_engine", lambda *_: nullcontext(engine))
    assert main(["study", str(written()), "--out", str(tmp_path / "other")]) == 1


@pytest.mark.parametrize("error", [MemoryError("9 GiB"), OSError(errno.EIO, "I/O error"), MachineError("gmsh says")])
def test_fault_of_the_machine_is_exit_code_2_and_tried_again(written, engine, tmp_path, monkeypatch, capsys, error):
    """The other points are solved; a search ends, because its next points follow from those before."""
    monkeypatch.setattr(command, "chosen_engine", lambda *_: nullcontext(engine))
    words = ["study", str(written()), "--out", str(tmp_path / "out")]
    with monkeypatch.context() as patch:
        failing(patch, error)
        assert main(words) == 2
        assert capsys.readouterr().err.count("\n") == 1
        with stored_study(tmp_path / "out") as store:
            assert (store.counts()["done"], store.machine_faults()) == (7, 1)
        failing(patch, error, always=True)
        with pytest.raises(type(error)):
            tasks.solve_points(replace(read_study(written()), how="search"), tmp_path, [Point(number=0, settings={})])
    assert main(words) == 0
    with stored_study(tmp_path / "out") as store:
        assert store.counts() == {"done": 8, "refused": 0, "failed": 0}


def test_full_disk_is_no_fault_of_a_point(written, engine, tmp_path, monkeypatch):
    full = OSError(errno.ENOSPC, "No space left on device", "response.csv")
    wrapped = InputError("--out: must have room")
    wrapped.__cause__ = full
    study = read_study(written())
    for error in (full, wrapped):
        with monkeypatch.context() as patch:
            failing(patch, error, always=True)
            with pytest.raises(type(error)):
                run_study(study, tmp_path / "out", engine)
    assert run_study(study, tmp_path / "out", engine).done == 8


FLEXURES = """
base = "paper"
how = "grid"
tol = 0.02
wanted = [
    "flexures.low.stiffness_N_per_m", "flexures.high.error_percent", "deflections_mm.0", "verdicts.K_l.value",
    "springs.K_h_N_per_m", "contact.K_m_over_E_mm", "verdicts.P_max.value", "verdicts.NL.error", "response.3.P.5",
]
[vary]
"targets.P_max" = [4.5]
"""


@pytest.mark.slow
def test_point_with_flexures_has_the_numbers_of_a_whole_run_to_the_bit(written, engine, tmp_path):
    (flexures,) = solved(read_study(written(FLEXURES)), tmp_path / "flexures", engine)
    study = read_study(written(FLEXURES.replace("tol =", 'level = "files"\ntol =')))
    (whole,) = solved(study, tmp_path / "files", engine)
    assert flexures.values == whole.values
    assert (tmp_path / "files" / "designs" / "0000000" / "report.json").is_file()


def numbers_of(sensor):
    """Return the numbers, truths and nulls of the parts of a report, by the keys that a study asks for."""
    parts = dict(SensorParts(sensor))
    parts["verdicts"] = dict(parts["verdicts"])
    parts = json.loads(json.dumps(parts, default=vars))
    verdicts = parts.pop("verdicts")
    found = {}
    for name, verdict in verdicts.items():
        found |= {f"verdicts.{name}.{field}": verdict[field] for field in ("value", "error", "passed")}

    def collect(name, value):
        inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
        for key, part in inside:
            collect(f"{name}.{key}", part)
        if not isinstance(value, dict | list | str):
            found[name] = value

    for name, part in parts.items():
        collect(name, part)
    return found


def test_key_has_one_meaning_whatever_was_solved():
    """Springs as they were sized and as they were made give each key that needs no springs, to their tolerance."""
    design = Design()
    sizing = stand_ins.sizing_of(design)
    as_made, as_sized = (
        numbers_of(stand_ins.solved(stand_ins.draw_sensor(design, springs)))
        for springs in (stand_ins.springs_of(design), springs_for(design, sizing, "sized"))
    )
    told = {}
    for key, value in as_made.items():
        try:
            level = level_of("wanted", [key])
        except InputError:  # its cost, which no study asks for
            continue
        if level == "contact" and "error" not in key:  # sized springs are exact
            told[key] = value
    assert {"verdicts.printable.low.passed", "verdicts.P_max.value", "response.0.P.3"} <= told.keys()
    for key, value in told.items():
        same = value if value is None or isinstance(value, bool) else pytest.approx(value, rel=1e-3, abs=1e-12)
        assert as_sized[key] == same, key
