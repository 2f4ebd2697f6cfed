"""Every wrong input ends with exit code 2 and one line: name, value, unit, bound, remedy; none writes."""

import importlib
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

import pipeline.commands.run
from cad.design.parameters import Design
from cad.design.processes import PROCESSES
from pipeline.cli import main

ROOT = Path(__file__).parents[2]
NL = "must be {}at least 1e-05 and at most 0.4999; give a fraction, for 5 % write 0.05"
LENGTH = "must be at least 1e-06 and at most 1000; "
MODULUS = "must be at least 1e-06 and at most 1e+06; "

VALUES = [
    (("--nl", "0"), "targets.NL = 0: " + NL.format("")),
    (("--nl", "-0.1"), "targets.NL = -0.1: " + NL.format("")),
    (("--nl", "0.5"), "targets.NL = 0.5: " + NL.format("")),
    (("--nl", "nan"), "targets.NL = nan: " + NL.format("")),
    (("--nl=-inf",), "targets.NL = -inf: " + NL.format("")),
    (("--nl", "five"), "targets.NL = 'five': " + NL.format("a number ")),
    (("--nl", ""), "targets.NL = '': " + NL.format("a number ")),
    (("--nl", "true"), "targets.NL = True: " + NL.format("a number ")),
    (("--p-max", "1"), "targets.P_max = 1: must be at least 1.001 and at most 100; the paper uses 5"),
    (("--p-max", "1e9"), "targets.P_max = 1e+09: must be at least 1.001 and at most 100; the paper uses 5"),
    (
        ("--set", "targets.NL_definition=mean"),
        "targets.NL_definition = 'mean': must be one of mid-range, largest; choose",
    ),
    (("--set", "fruit.poisson=0.5"), "fruit.poisson = 0.5: must be greater than -1 and less than 0.5; fruit flesh has"),
    (("--set", "fruit.poisson=-1"), "fruit.poisson = -1: must be greater than -1 and less than 0.5; fruit flesh has"),
    (("--set", "fruit.E_max_MPa=0"), "fruit.E_max_MPa = 0 MPa: " + MODULUS + "give the top of the .*"),
    (("--set", "fruit.E_MPa=[1, 0]"), "fruit.E_MPa = 0 MPa: " + MODULUS + "list the moduli to be shown"),
    (("--set", "fruit.E_MPa=[-2.0]"), "fruit.E_MPa = -2 MPa: " + MODULUS + "list the moduli to be shown"),
    (
        ("--set", "fruit.E_MPa=[]"),
        "fruit.E_MPa = () MPa: must be a list of at least one number, each at least 1e-06 and at most 1e+06; list",
    ),
    (
        ("--set", "tips.spacing_mm=1"),
        "tips.spacing_mm = 1 mm: must be greater than tips.side_mm = 1 mm; the tips overlap, move them apart",
    ),
    (
        ("--set", "tips.spacing_mm=19.5"),
        "tips.spacing_mm = 19.5 mm: must be at most fruit.length_mm - side - 2 |offset| = 19 mm; the tips stand beyond",
    ),
    (
        ("--set", "tips.offset_mm=6"),
        "tips.spacing_mm = 8 mm: must be at most fruit.length_mm - side - 2 |offset| = 7 mm; the tips stand beyond",
    ),
    (("--set", "fruit.length_mm=1e12"), "fruit.length_mm = 1e+12 mm: " + LENGTH + "the paper's block has 20"),
    (("--set", "fruit.height_mm=1e9"), "fruit.height_mm = 1e+09 mm: " + LENGTH + "the paper's block has 12"),
    (("--set", "tips.side_mm=0"), "tips.side_mm = 0 mm: " + LENGTH + "the paper's cube has 1"),
    (("--set", "press.travel_mm=12"), "press.travel_mm = 12 mm: must be less than fruit.height_mm = 12 mm; press less"),
    (("--set", "name=../x"), "name = '../x': must be 1 to 64 letters, digits, - or _; it names files and folders"),
    (
        ("--process", "fdm-abs"),
        f"print.process = 'fdm-abs': must be one of {', '.join(PROCESSES)}; choose one of these",
    ),
]
NAMES = [
    (("--set", "tips.side=1"), "tips.side: unknown key; must be one of .*; did you mean side_mm?"),
    (("--set", "tip.side_mm=1"), "tip.side_mm: unknown setting; must be one of .*; did you mean tips.side_mm?"),
    (("--set", "tips.side_mm"), "--set = 'tips.side_mm': must be TABLE.KEY=VALUE; write for instance .*"),
    (("--nl", "0.1", "--set", "targets.NL=0.2"), "targets.NL = '0.2': must be given once, and it is '0.1' already; .*"),
    (("--nll", "0.1"), "--nll: unknown flag; must be one of .*; did you mean --nl?"),
    (("--p_max=5",), "--p_max: unknown flag; must be one of .*; did you mean --p-max?"),
    (("-n", "0.1"), "-n: unknown flag; must be one of .*; did you mean --.*"),
    (("paper",), "'paper': must be a flag or its value; remove it, or see pipeline run -h"),
    (
        ("--nl",),
        "--nl: expected one argument; write FLAG=VALUE .*; must be as in the example of pipeline run -h",
    ),
    (("--json=yes",), "--json: ignored explicit argument 'yes'; must be as in the example of pipeline run -h"),
    (("--fruit-stiffness", "hays"), "--fruit-stiffness = 'hays': must be one of contact, hayes; did you mean hayes?"),
    (("--tol", "0"), "--tol = 0: must be at least 0.0001 and at most 0.1; the default is 0.001"),
    (("--tol", "nan"), "--tol = nan: must be at least 0.0001 and at most 0.1; the default is 0.001"),
    (("--tol", "1%"), "--tol = '1%': must be a number at least 0.0001 and at most 0.1; 0.001 is 0.1 %"),
    (("--contact-method", "fast"), "--contact-method = 'fast': must be one of auto, split, direct; did you mean .*"),
    (("--design", "papre"), "--design = 'papre': must be one of .*paper.*, or a path .*; did you mean paper?"),
    (("--design", ""), "--design = '': must be one of .*paper.*, or a path that ends in .toml; did you mean .*"),
    (("--design", "no.toml"), "design file no.toml: not found; must be an existing TOML file; check the path"),
    (
        ("--design", "./folder.toml"),
        "design file folder.toml: cannot be read .*; must be a TOML text file; check the file",
    ),
]
FILES = [
    ("targets = 3\n", "targets = 3: must be a table; write [targets] and its keys below it"),
    (
        "[targets]\nNL = \n",
        "design file mine.toml: Invalid value (at line 2, column 6); must be valid TOML; mend that line",
    ),
    ("\xff\x00", "design file mine.toml: .*; must be .*; .*"),
    ("[target]\nNL = 0.1\n", "target: unknown table; must be one of .*; did you mean targets?"),
    ("[targets]\nN = 0.1\n", "targets.N: unknown key; must be one of P_max, NL, NL_definition; did you mean NL?"),
    ("[fruit]\nheight_mm = -1\n", "fruit.height_mm = -1 mm: " + LENGTH + "the paper's block has 12"),
    (
        "[springs]\nK_l_N_per_m = 753\n",
        "springs.K_h_N_per_m = None: must be given together with springs.K_l_N_per_m; .*",
    ),
    ("name = 3\n", "name = 3: must be text; it names files and folders"),
]


def pattern(message: str) -> str:
    """Return the regular expression of a message in which only `.*` is open, and so is its end."""
    return "pipeline: " + ".*".join(re.escape(part) for part in message.split(".*"))


def refused(arguments, message, capsys, stand_in_run) -> None:
    before = sorted(Path.cwd().rglob("*"))
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert re.match(pattern(message), err), err
    assert stand_in_run.asked == []
    assert sorted(Path.cwd().rglob("*")) == before


@pytest.mark.parametrize(("flags", "message"), VALUES)
@pytest.mark.parametrize("command", ["run", "design"])
def test_bad_value_is_named_with_its_bound(command, flags, message, capsys, stand_in_run):
    refused([command, *flags], message, capsys, stand_in_run)


@pytest.mark.parametrize(("flags", "message"), NAMES)
def test_bad_name_is_answered_with_the_nearest(flags, message, capsys, stand_in_run, tmp_path):
    (tmp_path / "folder.toml").mkdir()
    refused(["run", *flags], message, capsys, stand_in_run)


@pytest.mark.parametrize(("text", "message"), FILES)
def test_bad_design_file_is_refused(text, message, capsys, stand_in_run, tmp_path):
    (tmp_path / "mine.toml").write_text(text, encoding="latin-1")
    refused(["run", "--design", "mine.toml"], message, capsys, stand_in_run)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["rnu"], "rnu: unknown command; must be one of run, design, suggest, .*, doctor, .*; did you mean run?"),
        (
            ["--fields", "run"],
            "--fields: unknown flag; must be one of --help, --version, --print-completion; did you mean --.*",
        ),
        (
            ["--versoin"],
            "--versoin: unknown flag; must be one of --help, --version, --print-completion; did you mean --version?",
        ),
        (["check"], "the following arguments are required: PATH; must be as in the example of pipeline check -h"),
        (
            ["view", "."],
            "PATH = '.': must hold a report.json that can be read (FileNotFoundError); name an output folder",
        ),
        (
            ["check", "a.stl"],
            "PATH = 'a.stl': must be an existing file or folder; name an output folder, or a STEP, STL or",
        ),
        (
            ["check", ".", "--process", "sla-resin"],
            "--process = 'sla-resin': must be left out for a folder; its design",
        ),
        (
            ["run", "--tol"],
            "--tol: expected one argument; write FLAG=VALUE .*; must be as in the example of pipeline run -h",
        ),
        (
            ["view", ".", "--pgn", "x"],
            "--pgn: unknown flag; must be one of --help, --png, .*; did you mean --png?",
        ),
        (["doctor", "--json"], "--json: unknown flag; must be one of --help; did you mean --help?"),
    ],
)
def test_bad_command_is_refused(arguments, message, capsys, stand_in_run):
    refused(arguments, message, capsys, stand_in_run)


def test_output_folder_with_foreign_files_is_refused(capsys, stand_in_run, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("precious", encoding="utf-8")
    message = (
        "--out = '.*mine': must be a new or empty folder, or one with the unchanged files of its last run, "
        "and it holds 'thesis.tex'; "
    )
    refused(["run", "--out", "mine"], message + "name another folder with --out", capsys, stand_in_run)


def test_output_folder_that_cannot_be_written_is_refused(capsys, stand_in_run, tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    message = "--out = '.*out': must be a folder, and '.*file' is a file; name another folder with --out"
    refused(["run", "--out", "file/out"], message, capsys, stand_in_run)
    message = "--out = '/proc.*': must be in a folder that can be written.*; name another folder with --out"
    refused(["run", "--out", "/proc/out"], message, capsys, stand_in_run)


def test_good_input_reaches_the_stages(capsys, stand_in_run, tmp_path):
    """The refusals above are not those of a command that refuses everything."""
    assert main(["run", "--nl", "0.08", "--set", "tips.spacing_mm=6", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["schema"] == 1
    (design,) = stand_in_run.designs
    assert (design.targets.NL, design.tips.spacing_mm, design.targets.P_max) == (0.08, 6.0, 5.0)
    assert [path.name for path in (tmp_path / "outputs" / "paper").iterdir()] == ["report.json"]


def test_unchecked_value_would_be_seen(capsys, stand_in_run, monkeypatch):
    """Without its check a bad value reaches the stages, and the test above would say so."""
    monkeypatch.setattr(pipeline.commands.run, "load_design", lambda *_: Design())
    with pytest.raises(AssertionError):
        refused(["run", "--nl", "five"], VALUES[5][1], capsys, stand_in_run)


@pytest.mark.parametrize("flags", [["--nl", "five"], ["--out", str(ROOT)]])
def test_refusal_imports_nothing_heavy(flags):
    program = f"import sys; from pipeline.cli import main; main(['run', *{flags!r}]); print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stderr.startswith("pipeline: ")
    assert {"numpy", "cadquery", "gmsh", "skfem", "rich", "pyvista"} & set(done.stdout.split()) == set()


@pytest.mark.parametrize(
    ("settings", "line"),
    [
        (
            ["tips.spacing_mm=5.8", "tips.side_mm=5.6"],
            "tips.spacing_mm = 5.8 mm: must be at least 6 mm: a plate as deep as a tip is wide, 5.6 mm",
        ),
        (
            ["tips.spacing_mm=5.5", "tips.side_mm=5.3"],
            "tips.spacing_mm = 5.5 mm: must be at least 5.7 mm: a plate as deep as a tip is wide",
        ),
        (
            ["tips.spacing_mm=5.8", "tips.side_mm=5.3", "tips.socket=pin"],
            "tips.spacing_mm = 5.8 mm: must be at least 12.7 mm, for feet of 12.4 mm with pins in them",
        ),
        (
            ["reading.tilt_deg=14"],
            "reading.tilt_deg = 14 deg: must be such that no tip meets the fruit at more than 20",
        ),
        (["reading.off_centre_mm=9"], "reading.off_centre_mm = 9 mm: must be such that no tip meets the fruit at more"),
    ],
)
def test_square_that_cannot_be_bolted_or_read_is_refused_before_anything_is_solved(
    settings, line, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(importlib.import_module("pipeline.run"), "fruit_compliance", lambda *_: pytest.fail("solved"))
    flags = [word for setting in settings for word in ("--set", setting)]
    assert main(["run", "--design", "mango", *flags, "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err.splitlines()
    assert len(error) == 1
    assert error[0].startswith(f"pipeline: {line}")
    assert not (tmp_path / "out").exists()
