"""Every wrong input ends with exit code 2 and one line that begins with what is wrong; nothing is solved or written."""

import importlib
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from deadline import DEADLINE_S
from stand_ins import result_of

from pipeline.report.outputs import write_outputs
from pipeline.study.study_file import read_study
from twintip.cli import main

ROOT = Path(__file__).parents[2]

VALUES = [
    *((("--nl", text), "targets.NL = ") for text in ("0", "0.5", "five", "")),
    (("--nl=-inf",), "targets.NL = "),
    (("--p-max", "1"), "targets.P_max = 1"),
    (("--set", "fruit.E_max_MPa=0"), "fruit.E_max_MPa = 0 MPa"),
    (("--set", "tips.spacing_mm=1"), "tips.spacing_mm = 1 mm"),
    (("--set", "tips.shape=cylinder"), "tips.shape = 'cylinder'"),
    (("--set", "tips.shape=sphere", "--process", "sla-resin"), "tips.shape = 'sphere'"),
    (("--set", "tips.shape=cone", "--set", "tips.half_angle_deg=70"), "tips.shape = 'cone'"),
    (("--set", "tips.fillet_mm=0.1", "--process", "dmls-ti64"), "tips.fillet_mm = 0.1 mm"),
    (("--set", "name=../x"), "name = '../x'"),
    (("--process", "fdm-abs"), "print.process = 'fdm-abs'"),
    (("--set", "tips.side=1"), "tips.side is an unknown key"),
    (("--set", "tip.side_mm=1"), "tip.side_mm is an unknown setting"),
    (("--set", "print.leaves=spring-steel"), "print.leaves is gone since 0.3. "),
    (("--set", "tips.side_mm"), "--set = 'tips.side_mm'"),
    (("--nl", "0.1", "--set", "targets.NL=0.2"), "targets.NL = '0.2'"),
    (("--nll", "0.1"), "--nll is an unknown flag"),
    (("papre",), "--design = 'papre'"),
    (("mango", "--design", "gentle"), "--design = 'gentle'"),
    (("paper", "mango"), "'mango' must be "),
    (("--nl",), "--nl: "),
    (("--json=yes",), "--json: "),
    (("--fruit-stiffness", "hays"), "--fruit-stiffness = 'hays'"),
    (("--tol", "0"), "--tol = 0"),
    (("--tol", "1%"), "--tol = '1%'"),
    (("--design", "papre"), "--design = 'papre'"),
    (("--design", "no.toml"), "--design = 'no.toml'"),
    (("--design", "./folder.toml"), "--design = 'folder.toml'"),
    (("--out", "mine"), "--out = "),
    (("--out", "file/out"), "--out = "),
]
FILES = [
    ("targets = 3\n", "targets = 3"),
    ("[targets]\nNL = \n", "--design = 'mine.toml'"),
    ("\xff\x00", "--design = 'mine.toml'"),
    ("[target]\nNL = 0.1\n", "target is an unknown table"),
    ("[targets]\nN = 0.1\n", "targets.N is an unknown key"),
    ("[print]\nclamp_mm = 4\n", "print.clamp_mm is gone since 0.3. "),
    ("[fruit]\nheight_mm = -1\n", "fruit.height_mm = -1 mm"),
    ("[springs]\nK_l_N_per_m = 753\n", "springs.K_h_N_per_m must be given"),
    ("name = 3\n", "name = 3"),
    ("[reading]\nradius_mm = [42, 53]\n", "reading.radius_across_mm must be given"),
    ("[reading]\nthickness_mm = [20, 8]\n", "reading.thickness_mm = [20.0, 8.0] mm"),
    ("[reading]\nuncertainty_limit = [0.1]\n", "reading.uncertainty_limit = [0.1]"),
]
COMMANDS = [
    (["rnu"], "rnu is an unknown command"),
    (["--versoin"], "--versoin is an unknown flag"),
    (["check"], "the following arguments are required: PATH"),
    (["view", "."], "PATH = '.'"),
    (["check", "a.stl"], "PATH = 'a.stl'"),
    (["view", ".", "--pgn", "x"], "--pgn is an unknown flag"),
    (["doctor", "--json"], "--json is an unknown flag"),
]


def refused(arguments, start, capsys, stand_in_run):
    before = sorted(Path.cwd().rglob("*"))
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert err.startswith(f"pipeline: {start}"), err
    assert stand_in_run.asked == []
    assert sorted(Path.cwd().rglob("*")) == before


@pytest.mark.parametrize(("flags", "start"), VALUES)
def test_bad_flag_is_one_line_with_its_name(flags, start, capsys, stand_in_run, tmp_path):
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "file").touch()
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("precious", encoding="utf-8")
    refused(["run", *flags], start, capsys, stand_in_run)


@pytest.mark.parametrize(("text", "start"), FILES)
def test_bad_design_file_is_one_line(text, start, capsys, stand_in_run, tmp_path):
    (tmp_path / "mine.toml").write_text(text, encoding="latin-1")
    refused(["run", "--design", "mine.toml"], start, capsys, stand_in_run)


@pytest.mark.parametrize("name", ["a\x1b[2Jb.csv", "a\0b.csv", "a\u202eb.csv", os.fsdecode(b"a\xffb.csv")])
def test_name_that_would_steer_a_terminal_is_written_as_its_escape(name, capsys):
    for words in (["modulus", name], ["calibrate", name, "x.csv"], [name], ["run", name], ["run", f"--{name}"]):
        assert main(words) == 2
        line = capsys.readouterr().err.removesuffix("\n")
        assert line.isprintable(), line


def test_name_without_end_is_cut_in_its_line(tmp_path, capsys):
    path = tmp_path / "mine.toml"
    path.write_text(f"{100_000 * 'a'} = 1\n", encoding="utf-8")
    assert main(["run", "--design", str(path)]) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    assert len(line) < 4000
    assert line.endswith("?\n"), "what to do is not cut off"


@pytest.mark.parametrize(("words", "start"), COMMANDS)
def test_bad_command_is_one_line(words, start, capsys, stand_in_run):
    refused(words, start, capsys, stand_in_run)


def test_good_input_reaches_the_stages(capsys, stand_in_run, tmp_path):
    """The refusals above are not those of a command that refuses everything."""
    assert main(["run", "--nl", "0.08", "--set", "tips.spacing_mm=6", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["schema"] == 1
    (design,) = stand_in_run.designs
    assert (design.targets.NL, design.tips.spacing_mm, design.targets.P_max) == (0.08, 6.0, 5.0)
    assert [path.name for path in (tmp_path / "outputs" / "paper").iterdir()] == ["report.json"]


@pytest.mark.parametrize("flags", [["--nl", "five"], ["--out", str(ROOT)]])
def test_refusal_imports_nothing_heavy(flags):
    program = f"import sys; from twintip.cli import main; main(['run', *{flags!r}]); print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, encoding="utf-8", check=True, timeout=DEADLINE_S
    )
    assert done.stderr.startswith("pipeline: ")
    assert {"numpy", "cadquery", "gmsh", "skfem", "rich", "pyvista"} & set(done.stdout.split()) == set()


@pytest.mark.parametrize(
    ("design", "settings", "start"),
    [
        ("mango", ["tips.spacing_mm=5.8", "tips.side_mm=5.6"], "tips.spacing_mm = "),
        ("mango", ["tips.spacing_mm=5.5", "tips.side_mm=5.3"], "tips.spacing_mm = "),
        ("mango", ["tips.spacing_mm=5.8", "tips.side_mm=5.3", "tips.socket=pin"], "tips.spacing_mm = "),
        ("mango", ["reading.tilt_deg=15", "reading.radius_mm=[22,30]"], "reading.tilt_deg = "),
        ("paper", ["reading.tilt_deg=4", "fruit.width_mm=2.9"], "gap from tip to side face = 0.95 mm"),
        ("paper", ["reading.tilt_deg=0", "fruit.length_mm=10.9"], "gap from tip to side face = 0.95 mm"),
    ],
)
def test_sensor_that_cannot_be_bolted_or_read_is_refused_before_anything_is_solved(
    design, settings, start, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(
        importlib.import_module("pipeline.sensor"), "fruit_compliance", lambda *_: pytest.fail("solved")
    )
    flags = [word for setting in settings for word in ("--set", setting)]
    assert main(["run", "--design", design, *flags, "--out", str(tmp_path / "out")]) == 2
    (error,) = capsys.readouterr().err.splitlines()
    assert error.startswith(f"pipeline: {start}")
    assert not (tmp_path / "out").exists()


ATTACKED = [
    ("run --design {file}", "--design"),
    ("run --set print.process_file={file}", "print.process_file"),
    ("design --design {file}", "--design"),
    ("suggest {file}", "--design"),
    ("study {file}", "FILE.toml"),
    ("study base.toml", "base"),
    ("study points.toml", "FILE"),
    ("optimise {file}", "FILE.toml"),
    ("modulus {file} --height 70 --radius 35", "FILE"),
    ("calibrate folder {file}", "FILE"),
    ("read folder --unit {file} --forces 0.4,1", "--unit"),
    ("read folder {file}", "FILE"),
]


@pytest.fixture(scope="module")
def output(tmp_path_factory):
    """Return an output folder whose contact and springs stand in for solved ones."""
    folder = tmp_path_factory.mktemp("attacked") / "paper"
    folder.mkdir()
    write_outputs(result_of(None), folder)
    return folder


@pytest.fixture
def no_waiting():
    """Raise TimeoutError in a test that waits for a pipe, or reads without end."""

    def stop(*_):
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(30)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.usefixtures("no_waiting")
@pytest.mark.parametrize(("words", "field"), ATTACKED, ids=[words for words, _ in ATTACKED])
def test_pipe_for_a_file_is_one_line_at_once(words, field, output, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").symlink_to(output)
    os.mkfifo(tmp_path / "odd.toml")
    Path("base.toml").write_text('base = "odd.toml"\nwanted = ["springs.K_l_N_per_m"]\nsamples = 2\n', encoding="utf-8")
    Path("points.toml").write_text('points = "odd.toml"\nwanted = ["springs.K_l_N_per_m"]\n', encoding="utf-8")
    assert main(words.format(file="./odd.toml").split()) == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.startswith(f"pipeline: {field} = "), line
    assert sorted(path.name for path in tmp_path.iterdir()) == ["base.toml", "folder", "odd.toml", "points.toml"]


@pytest.mark.usefixtures("stand_in_run")
def test_byte_order_mark_is_no_part_of_a_file(output, capsys):
    """Excel and Notepad write it before UTF-8: into design files, units, points and tables alike."""
    mark = b"\xef\xbb\xbf"
    Path("mine.toml").write_bytes(mark + b"name = 'mine'\r\n")
    assert main(["run", "--design", "mine.toml"]) == 0
    Path("unit.toml").write_bytes(mark + b"tips = 1\r\n")
    assert main(["read", str(output), "--unit", "unit.toml", "--forces", "0.4,1"]) == 2
    assert "unit.design" in capsys.readouterr().err, "TOML it is, but no unit"
    Path("press.csv").write_bytes(mark + b"t_s,F_l_N,F_h_N\r\n0,0.2,0.5\r\n")
    assert main(["read", str(output), "press.csv", "--each"]) in (0, 1)
    Path("points.csv").write_bytes(mark + b"tips.side_mm\r\n1\r\n")
    Path("study.toml").write_bytes(mark + b"points = 'points.csv'\r\nwanted = ['springs.K_l_N_per_m']\r\n")
    assert list(read_study(Path("study.toml")).vary) == ["tips.side_mm"]


def test_closed_input_is_an_empty_stream(output):
    line = f'exec "{sys.executable}" -m twintip read "$0" - <&-'
    done = subprocess.run(
        ["/bin/bash", "-c", line, str(output)],
        cwd=ROOT,
        capture_output=True,
        encoding="utf-8",
        check=False,
        timeout=DEADLINE_S,
    )
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith("pipeline: -, line 1 = ''")
    assert "Traceback" not in done.stderr
