"""The command line hands designs and options on, prints what comes back, and ends with the right code."""

import errno
import json
import signal
import subprocess
import sys
import types
from pathlib import Path

import pytest

import pipeline
from cad.design.parameters import Design
from cad.design.processes import PROCESSES
from mesh.session import MeshError
from pipeline import cli
from pipeline import options as load
from pipeline.cli import main
from pipeline.options import RunOptions, load_design
from pipeline.storage.folder import Interrupted, output_folder
from solve.fruit.split import SplitDomainError
from solve.linear import SolveError

ROOT = Path(__file__).parents[2]
COMMANDS = ("run", "design", "check", "view", "bench", "doctor")


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    """Return a function that puts stand-ins for modules of pipeline in their place, in an empty current folder."""
    monkeypatch.chdir(tmp_path)

    def put(**modules):
        if "run" in modules:
            modules["fabrication"] = modules["run"]
        tables = types.SimpleNamespace(print_report=lambda report: print("table of", report))
        modules.setdefault("report_tables", tables)
        for name, module in modules.items():
            monkeypatch.setitem(sys.modules, f"pipeline.{name}", module)
            monkeypatch.setattr(pipeline, name, module, raising=False)

    return put


def stages(*, passed=True, error=None, seen=None):
    """Return a stand-in for pipeline.run that writes a report, or raises inside its output folder."""

    def work(design, options):
        with output_folder(options.out) as folder:
            (folder / "report.json").write_text("{}", encoding="utf-8")
            if error is not None:
                raise error
        if seen is not None:
            seen.append((design, options))
        return types.SimpleNamespace(report={"schema": 1}, passed=passed)

    return types.SimpleNamespace(run=work, fabricate=work)


def settle(arguments, capsys):
    code = main(arguments)
    return code, *capsys.readouterr()


@pytest.mark.parametrize("arguments", [[], ["-h"], ["--help"]])
def test_help_names_every_command_and_the_exit_codes(arguments, capsys):
    code, out, err = settle(arguments, capsys)
    assert (code, err) == (0, "")
    assert [name for name in COMMANDS if f"    {name} " not in out] == []
    assert "exit code: 0" in out
    assert "example: pipeline run --nl 0.05" in out


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("flag", ["-h", "--help"])
def test_each_command_has_help_with_an_example(command, flag, capsys):
    code, out, err = settle([command, flag], capsys)
    assert (code, err) == (0, "")
    assert f"example: pipeline {command}" in out


def test_help_says_units_and_bounds(capsys):
    _, out, _ = settle(["run", "-h"], capsys)
    words = " ".join(out.split())
    assert "[fraction, 0.05 = 5 %], greater than 0 and less than 0.5" in words
    assert "displacement [mm] and stress [MPa]" in words


@pytest.mark.parametrize(("passed", "code"), [(True, 0), (False, 1), (None, 1)])
@pytest.mark.parametrize("command", ["run", "design"])
def test_verdict_decides_the_exit_code_and_outputs_stay(command, passed, code, stand_in, capsys):
    stand_in(run=stages(passed=passed))
    assert settle([command], capsys) == (code, "table of {'schema': 1}\n", "")
    assert Path("outputs/paper/report.json").is_file()


def test_flags_become_design_and_options(stand_in, capsys):
    seen = []
    stand_in(run=stages(seen=seen))
    words = "run --nl 0.1 --p-max 4 --process sla-resin --set fruit.E_MPa=[1,2] --set name=mine --fields"
    words += (
        " --fruit-stiffness hayes --contact-method direct --tol 0.02 --out here --set targets.NL_definition=largest"
    )
    assert settle(words.split(), capsys)[0] == 0
    ((design, options),) = seen
    assert (design.targets.NL, design.targets.P_max, design.targets.NL_definition) == (0.1, 4.0, "largest")
    assert (design.print.process, design.fruit.E_MPa, design.name) == ("sla-resin", (1.0, 2.0), "mine")
    asked = {"fruit_stiffness": "hayes", "contact_method": "direct", "fields": True, "tolerance": 0.02}
    assert options == RunOptions(out=Path("here"), **asked)


def test_defaults_are_the_papers_sensor_in_a_folder_of_its_name(stand_in, capsys):
    seen = []
    stand_in(run=stages(seen=seen))
    assert settle(["run"], capsys)[0] == 0
    assert seen == [(Design(), RunOptions(out=Path("outputs/paper")))]


def test_design_file_without_a_name_is_named_for_itself(tmp_path):
    (tmp_path / "kiwi.toml").write_text("[targets]\nNL = 0.1\n", encoding="utf-8")
    design = load_design(str(tmp_path / "kiwi.toml"), {"targets.P_max": "3"})
    assert (design.name, design.targets.NL, design.targets.P_max) == ("kiwi", 0.1, 3.0)


def test_without_presets_a_path_is_asked_for(tmp_path, monkeypatch):
    monkeypatch.setattr(load, "DESIGNS", tmp_path)
    with pytest.raises(ValueError, match=r"--design = 'paper': must be one of , or a path .*; give a path"):
        load.design_path("paper")


def test_json_is_the_report_and_nothing_else(stand_in, capsys):
    stand_in(run=stages())
    code, out, err = settle(["run", "--json"], capsys)
    assert (code, json.loads(out), err) == (0, {"schema": 1}, "")


@pytest.mark.parametrize(
    "error",
    [
        SolveError("linear solve: residual 1; check the clamp"),
        MeshError("generate", "no room", "take smaller elements"),
        SplitDomainError("tip too near the side; take --contact-method direct"),
    ],
    ids=["solve", "mesh", "split"],
)
def test_scene_that_cannot_be_solved_is_one_line_and_no_output(error, stand_in, capsys):
    stand_in(run=stages(error=error))
    assert settle(["run"], capsys) == (2, "", f"pipeline: {error}\n")
    assert list(Path().iterdir()) == []


@pytest.mark.parametrize(
    ("error", "code"),
    [(KeyboardInterrupt(), 130), (Interrupted(signal.SIGINT), 130), (Interrupted(signal.SIGTERM), 143)],
    ids=["ctrl-c", "sigint", "sigterm"],
)
def test_interruption_leaves_no_output(error, code, stand_in, capsys):
    stand_in(run=stages(error=error))
    assert settle(["run"], capsys) == (code, "", "pipeline: interrupted\n")
    assert list(Path().iterdir()) == []


def test_full_disk_is_one_line(stand_in, capsys):
    stand_in(run=stages(error=OSError(errno.ENOSPC, "No space left on device", "housing.stl")))
    assert settle(["run"], capsys) == (
        2, "", "pipeline: housing.stl: No space left on device; must have room; free some space\n",
    )  # fmt: skip
    assert list(Path().iterdir()) == []


@pytest.mark.parametrize("error", [TypeError("a bug"), FileNotFoundError(errno.ENOENT, "a bug"), ValueError("a bug")])
def test_bug_is_not_hidden(error, stand_in):
    stand_in(run=stages(error=error))
    with pytest.raises(type(error), match="a bug"):
        main(["run"])
    assert list(Path().iterdir()) == []


def test_closed_pipe_keeps_the_verdicts_code():
    """As in `pipeline run | head -1`: the reader leaves, the outputs and the verdict stand, no traceback."""
    program = """if True:
        import sys, types, pipeline
        from pipeline.cli import main
        tables = types.SimpleNamespace(print_report=lambda _: [print("x" * 99) for _ in range(9999)])
        work = lambda design, options: types.SimpleNamespace(report={}, passed=False)
        pipeline.report_tables, pipeline.run = tables, types.SimpleNamespace(run=work)
        sys.modules |= {"pipeline.report.tables": pipeline.report_tables, "pipeline.run": pipeline.run}
        sys.exit(main(["run"]) + 40)
    """
    with subprocess.Popen(
        [sys.executable, "-c", program], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        process.stdout.readline()
        process.stdout.close()
        assert process.stderr.read() == ""
        assert process.wait(60) == 41


@pytest.mark.parametrize(
    ("words", "module", "answer"),
    [
        ("check housing.step --json", "check", (Path("housing.step"), {"as_json": True})),
        ("check outputs/paper", "check", (Path("outputs/paper"), {"as_json": False})),
        ("view outputs/paper", "view", (Path("outputs/paper"), None, {})),
        ("view outputs/paper --png p", "view", (Path("outputs/paper"), Path("p"), {})),
        ("bench --json", "bench", ({"as_json": True},)),
        ("doctor", "doctor", ({},)),
    ],
)
def test_other_commands_hand_their_arguments_on_and_the_code_back(words, module, answer, stand_in):
    seen = []

    def work(*arguments, **keywords):
        seen.append((*arguments, keywords))
        return 1

    stand_in(**{module: types.SimpleNamespace(**{module: work})})
    assert main(words.split()) == 1
    assert seen == [answer]


def test_processes_are_listed_with_every_number(capsys):
    code, out, err = settle(["design", "--list-processes"], capsys)
    assert (code, err) == (0, "")
    assert [name for name in PROCESSES if name not in out] == []
    assert f"{PROCESSES['fdm-petg'].E_MPa}" in out
    code, out, _ = settle(["design", "--list-processes", "--json"], capsys)
    assert [record["name"] for record in json.loads(out)] == list(PROCESSES)


def test_console_script_is_this_function():
    done = subprocess.run(
        [sys.executable, "-c", "import sys; from pipeline.cli import main; sys.exit(main())", "rnu"],
        cwd=ROOT, capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert done.returncode == cli.WRONG_INPUT
    assert done.stderr.startswith("pipeline: rnu: unknown command")
