"""The command line hands designs and options on, prints what comes back, and ends with the right code."""

import errno
import re
import subprocess
import sys
from concurrent.futures import BrokenExecutor
from importlib.metadata import version
from pathlib import Path

import pytest
from deadline import DEADLINE_S
from programs import PYTHON, ended

from mesh.session import MeshError
from pipeline.options import RunOptions
from sensor.design.parameters import Design
from sensor.gone import REMOVED
from sensor.machine_error import MachineError
from sensor.quantity import InputError
from solve.linear import SolveError
from twintip import cli
from twintip.cli import main
from twintip.commands import console
from twintip.flags import COMMANDS

ROOT = Path(__file__).parents[2]


def settle(arguments, capsys):
    code = main(arguments)
    return code, *capsys.readouterr()


@pytest.mark.parametrize("arguments", [[], ["-h"], ["--help"]])
def test_help_names_every_command_and_the_exit_codes(arguments, capsys):
    code, out, err = settle(arguments, capsys)
    assert (code, err) == (0, "")
    assert [name for name in COMMANDS if not re.search(rf"^    {name}\b", out, re.MULTILINE)] == []
    assert "exit code: 0" in out
    assert "example: pipeline run --nl 0.05" in out


@pytest.mark.parametrize(
    ("words", "opening", "nearest"),
    [
        ("rnu --nl 0.05", "rnu is an unknown command", "run"),
        ("-v", "-v is an unknown flag", "--version"),
        ("run --js", "--js is an unknown flag", "--json"),  # flags are not abbreviated
        ("run --filds=1", "--filds is an unknown flag", "--fields"),
        ("run -x", "-x is an unknown flag", None),
        ("modulus a.csv --height tall", "--height: invalid number value: 'tall'", None),
    ],
)
def test_words_that_no_command_takes_are_one_line(words, opening, nearest, capsys):
    code, out, err = settle(words.split(), capsys)
    assert (code, out, err.count("\n")) == (cli.WRONG_INPUT, "", 1)
    assert err.startswith(f"pipeline: {opening}")
    if nearest is not None:
        assert err.endswith(f"Did you mean {nearest}?\n")


@pytest.mark.parametrize(("passed", "code"), [(True, 0), (False, 1), (None, 1)])
@pytest.mark.parametrize("command", ["run", "design"])
def test_verdict_decides_the_exit_code_and_outputs_stay(command, passed, code, stand_in_run, capsys):
    stand_in_run.passed = passed
    word = {True: "passed", False: "failed", None: "undecided"}[passed]
    found, out, err = settle([command], capsys)
    assert (found, err) == (code, "")
    assert out.startswith(f"{word}  twintip · paper: ")
    assert Path("outputs/paper/report.json").is_file()


def test_flags_become_design_and_options(stand_in_run, capsys):
    words = "run --nl 0.1 --p-max 4 --process sla-resin --set fruit.E_MPa=[1,2] --set name=mine --fields"
    words += " --fruit-stiffness hayes --tol 0.02 --out here --set targets.NL_definition=largest"
    assert settle(words.split(), capsys)[0] == 0
    ((design, options),) = stand_in_run.asked
    assert (design.targets.NL, design.targets.P_max, design.targets.NL_definition) == (0.1, 4.0, "largest")
    assert (design.print.process, design.fruit.E_MPa, design.name) == ("sla-resin", (1.0, 2.0), "mine")
    asked = {"fruit_stiffness": "hayes", "fields": True, "tolerance": 0.02}
    assert options == RunOptions(out=Path("here"), **asked)


@pytest.mark.parametrize(("command", "fabrication"), [("run", False), ("design", True)])
def test_defaults_are_the_papers_sensor_in_a_folder_of_its_name(command, fabrication, stand_in_run, capsys):
    assert settle([command], capsys)[0] == 0
    assert stand_in_run.asked == [(Design(), RunOptions(out=Path("outputs/paper"), fabrication=fabrication))]


@pytest.mark.parametrize(
    "error",
    [
        SolveError("linear solve: residual 1;\ncheck the clamp"),
        MeshError("generate", "no room", "take smaller elements"),
    ],
    ids=["solve", "mesh"],
)
def test_scene_that_cannot_be_solved_is_one_line_and_no_output(error, stand_in_run, capsys):
    stand_in_run.error = error
    assert settle(["run"], capsys) == (2, "", f"pipeline: {' '.join(str(error).split())}\n")
    assert list(Path().iterdir()) == []


@pytest.mark.parametrize(
    "error",
    [
        OSError(errno.ENOSPC, "No space left on device", "housing.stl"),
        OSError("no room for housing.stl"),
        OSError(),
        MemoryError(),
        BrokenExecutor(),
        MachineError("mesh, stage 'generate': gmsh says 'std::bad_alloc'; free memory"),
    ],
    ids=lambda each: type(each).__name__,
)
def test_fault_of_the_machine_is_one_line_and_leaves_no_output(error, stand_in_run, capsys):
    stand_in_run.error = error
    ended, out, err = settle(["run"], capsys)
    assert (ended, out, err.count("\n")) == (cli.WRONG_INPUT, "", 1)
    assert len(err) > len("pipeline: \n")
    assert list(Path().iterdir()) == []


@pytest.mark.parametrize("error", [TypeError("a bug"), ValueError("a bug")])
def test_bug_is_not_hidden(error, stand_in_run):
    stand_in_run.error = error
    with pytest.raises(type(error), match="a bug"):
        main(["run"])
    assert list(Path().iterdir()) == []


@pytest.mark.parametrize("error", [BrokenPipeError(), SystemExit(1)])
def test_reader_that_leaves_does_not_undo_the_work(error, monkeypatch, capsys):
    dropped = []
    monkeypatch.setattr(console, "discard_output", lambda: dropped.append(True))
    with console.printing_answer():
        raise error
    assert dropped == [True]
    assert capsys.readouterr().err == ""


def test_answer_that_is_lost_is_an_error(monkeypatch):
    def fill(*_, **__):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(console, "discard_output", lambda: None)
    monkeypatch.setattr("builtins.print", fill)
    with pytest.raises(InputError), console.printing_answer():
        print("a modulus")


def test_reader_that_leaves_ends_a_command_without_a_traceback():
    """As in `pipeline explain | head -1`."""
    with subprocess.Popen(
        [sys.executable, "-m", "twintip", "explain", "--json"],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
    ) as process:
        process.stdout.readline()
        process.stdout.close()
        assert process.stderr.read() == ""
        assert process.wait(DEADLINE_S) in (0, 1)


def test_module_of_0_2_is_refused_with_what_to_use():
    done = ended(PYTHON, "-m", "pipeline", "run")
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (cli.WRONG_INPUT, "", 1)
    assert done.stderr.endswith(f" {REMOVED['python -m pipeline']}\n")


def test_version_is_that_of_the_package(capsys):
    assert settle(["--version"], capsys) == (0, f"twintip {version('twintip')}\n", "")


@pytest.mark.parametrize("name", [name for name in REMOVED if name.startswith("pipeline ")])
def test_flag_that_is_gone_is_refused_with_what_to_use(name, capsys):
    _, command, flag = name.split()
    for words in ([command, "here", flag, "1,2"], [command, f"{flag}=1,2"]):
        code, out, err = settle(words, capsys)
        assert (code, out) == (cli.WRONG_INPUT, "")
        assert re.fullmatch(rf"pipeline: {name} .* {re.escape(REMOVED[name])}\n", err)


@pytest.mark.parametrize("name", [name for name in REMOVED if name.startswith("verdicts.")])
def test_verdict_that_is_gone_is_explained_by_what_to_use(name, capsys):
    for words in (name, name.removeprefix("verdicts.")):
        code, out, err = settle(["explain", words], capsys)
        assert (code, out, err) == (cli.WRONG_INPUT, "", f"pipeline: {name} was removed in 0.3. {REMOVED[name]}\n")
