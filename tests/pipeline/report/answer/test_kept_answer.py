"""A run whose files are there already answers from what it kept; anything else in the folder is handled as ever."""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from stand_ins import result_of

import pipeline
from pipeline.cli import main
from pipeline.report.outputs import write_outputs
from pipeline.storage import cache
from pipeline.storage.cache import cache_folder
from pipeline.storage.folder import output_folder

ROOT = Path(__file__).parents[4]
UNNEEDED = ("cadquery", "OCP", "gmsh", "skfem", "scipy", "matplotlib", "vtkmodules", "pyvista", "trimesh", "ezdxf")
"""Packages that only a run which solves, draws or builds something has to load."""
MOST_SECONDS = 120.0
RUN = ["run", "--out", "out"]
MOST_NL = 0.3  # with which the stand-in for a run passes
RESULT = result_of()


@pytest.fixture
def runs(tmp_path, monkeypatch):
    """Return the list of designs that were run, in an empty current folder with a cache of its own."""
    designs = []

    def run(design, options, **_):
        designs.append(design)
        verdicts = tuple(replace(verdict, passed=design.targets.NL < MOST_NL) for verdict in RESULT.verdicts)
        result = replace(RESULT, design=design, options=options, verdicts=verdicts)
        with output_folder(options.out, force=options.force) as folder:
            (folder / "part.step").write_text(f"part {len(designs)}")
            write_outputs(result, folder)
        return result

    monkeypatch.setattr(pipeline, "run", run)

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    return designs


def files_of(folder):
    return {path.name: path.read_bytes() for path in Path(folder).iterdir()}


def test_unchanged_run_loads_no_kernel_and_leaves_every_byte(default_run):
    before = files_of(default_run.folder)
    program = f"""if True:
        import sys
        from pipeline.cli import main
        code = main(["run", "--nl", "0.05", "--out", {str(default_run.folder)!r}])
        print(*sorted(set({UNNEEDED!r}) & set(sys.modules)), file=sys.stderr)
        sys.exit(code)
    """
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=ROOT,
        env=dict(os.environ),  # readline puts the width of a terminal into that of C
        capture_output=True,
        text=True,
        timeout=MOST_SECONDS,
        check=False,
    )
    assert (done.returncode, done.stderr, done.stdout) == (default_run.code, "\n", default_run.printed)
    assert files_of(default_run.folder) == before


@pytest.mark.parametrize("more", [[], ["--verbose"], ["--json"], ["--force"]], ids=str)
@pytest.mark.parametrize("design", [[], ["--nl", "0.4"]], ids=["passed", "failed"])
def test_same_run_answers_the_same_and_runs_once(design, more, runs, capsys):
    code = main([*RUN, *design])
    first, before = capsys.readouterr().out, files_of("out")
    assert main([*RUN, *design, *more]) == code
    again = capsys.readouterr().out
    assert (len(runs), files_of("out")) == (1, before)
    if more == ["--json"]:
        assert json.loads(again) == json.loads(before["report.json"])
    elif more != ["--verbose"]:
        assert again == first


def test_an_unchanged_folder_answers_wherever_it_was_moved(runs, capsys):
    main(RUN)
    first = capsys.readouterr().out
    Path("out").rename("moved")
    main(["run", "--out", "moved"])
    assert capsys.readouterr().out == first.replace("out", "moved").replace("withmoved", "without")
    assert len(runs) == 1


@pytest.mark.parametrize(
    "change",
    [["--nl", "0.06"], ["--set", "press.travel_mm=0.5"], ["--tol", "0.01"], ["--fields"]],
    ids=lambda change: change[0],
)
def test_another_design_or_option_runs(change, runs):
    main(RUN)
    main([*RUN, *change])
    assert len(runs) == 2


def test_making_the_files_for_fabrication_runs(runs):
    main(RUN)
    main(["design", *RUN[1:]])
    assert len(runs) == 2


def test_another_date_of_files_runs(runs, monkeypatch):
    main(RUN)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1600000000")
    main(RUN)
    assert len(runs) == 2


def test_another_program_runs(runs, monkeypatch):
    main(RUN)
    monkeypatch.setattr(cache, "code_digest", lambda: "another")
    main(RUN)
    assert len(runs) == 2


def test_missing_file_is_made_again(runs):
    main(RUN)
    Path("out/part.step").unlink()
    assert main(RUN) == 0
    assert len(runs) == 2
    assert Path("out/part.step").read_text() == "part 2"


@pytest.mark.parametrize("name", ["part.step", "report.json", "notes.txt"])
def test_changed_or_foreign_file_is_refused_and_kept_aside_with_force(name, runs, capsys):
    main(RUN)
    Path("out", name).write_text("mine")
    capsys.readouterr()
    assert main(RUN) == 2
    assert name in capsys.readouterr().err
    assert Path("out", name).read_text() == "mine"
    assert main([*RUN, "--force"]) == 0
    assert Path("out", f"{name}.bak").read_text() == "mine"
    assert len(runs) == 2


@pytest.mark.usefixtures("runs")
def test_folder_in_use_is_refused_though_unchanged(capsys):
    main(RUN)
    with output_folder(Path("out")):
        assert main(RUN) == 2
        assert "no other run is writing" in capsys.readouterr().err


def test_whole_folder_of_another_run_is_replaced(runs):
    """Both folders are ours and unchanged, and the second was made from another design."""
    main(RUN)
    main(["run", "--nl", "0.06", "--out", "other"])
    shutil.rmtree("out")
    Path("other").rename("out")
    main(RUN)
    assert len(runs) == 3


@pytest.fixture
def overtaken(runs, monkeypatch):
    """Let another run take the folder as soon as a run has left it, before its answer is kept."""
    own = pipeline.run

    def run(design, options, **given):
        result = own(design, options, **given)
        other = Path("taken")
        if other.exists():
            shutil.rmtree("out")
            other.rename("out")
        return result

    main(["run", "--nl", "0.4", "--out", "taken"])
    monkeypatch.setattr(pipeline, "run", run)
    return runs


def test_answer_is_not_kept_for_the_files_of_another_run(overtaken, capsys):
    """The files in the end are those of a design that fails: the same command must solve again, not say passed."""
    assert main(RUN) == 0
    theirs = files_of("out")
    capsys.readouterr()
    assert main([*RUN, "--nl", "0.4"]) == 1
    assert files_of("out") == theirs
    assert len(overtaken) == 2
    assert main(RUN) == 0
    assert len(overtaken) == 3


def test_report_of_another_run_is_not_printed_as_ones_own(overtaken, capsys):
    capsys.readouterr()
    assert main([*RUN, "--json"]) == 2
    said = capsys.readouterr()
    assert (said.out, len(overtaken)) == ("", 2)
    assert "report.json is not that of this run any longer; run again" in said.err


@pytest.mark.parametrize("left", [None, "", "[]", '{"schema": 1}'], ids=str)
def test_folder_that_is_gone_or_spoilt_after_the_run_is_no_error(left, runs, monkeypatch):
    own = pipeline.run

    def run(design, options, **given):
        result = own(design, options, **given)
        shutil.rmtree("out")
        if left is not None:
            Path("out").mkdir()
            Path("out/report.json").write_text(left)
        return result

    monkeypatch.setattr(pipeline, "run", run)
    assert main(RUN) == 0
    assert not list(cache_folder().glob("answer-*"))
    assert len(runs) == 1


@pytest.mark.parametrize("damage", [Path.unlink, lambda path: path.write_text("{}")], ids=["lost", "damaged"])
def test_answer_that_is_not_kept_well_is_made_again(damage, runs):
    main(RUN)
    for path in cache_folder().glob("answer-*"):
        damage(path)
    main(RUN)
    assert len(runs) == 2


def test_cache_that_cannot_be_written_is_no_error(runs, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", os.devnull)
    assert [main(RUN), main(RUN)] == [0, 0]
    assert len(runs) == 2
