"""Every wrong input ends with exit code 2 and one line that begins with what is wrong; nothing is solved or written."""

import os
import signal
import sys
from pathlib import Path

import pytest
from programs import PYTHON, ended
from stand_ins import write_paper

from pipeline.study.study_file import read_study
from twintip.cli import main

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", ["a\x1b[2Jb.csv", "a\0b.csv", "a\u202eb.csv", os.fsdecode(b"a\xffb.csv")])
def test_name_that_would_steer_a_terminal_is_written_as_its_escape(name, capsys):
    for words in (["modulus", name], [name], ["run", f"--{name}"]):
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


@pytest.mark.parametrize("flags", [["--nl", "five"], ["--out", str(ROOT)]])
def test_refusal_imports_nothing_heavy(flags):
    program = f"import sys; from twintip.cli import main; main(['run', *{flags!r}]); print(*sys.modules)"
    done = ended(PYTHON, "-c", program)
    assert done.stderr.startswith("pipeline: ")
    assert {"numpy", "cadquery", "gmsh", "skfem", "rich", "pyvista"} & set(done.stdout.split()) == set()


ATTACKED = [
    ("run --design {file}", "--design"),
    ("run --set print.process_file={file}", "print.process_file"),
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
    return write_paper(tmp_path_factory.mktemp("attacked"))


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
def test_byte_order_mark_is_no_part_of_a_file(output):
    """Excel and Notepad write it before UTF-8: into design files, points and tables alike."""
    mark = b"\xef\xbb\xbf"
    Path("mine.toml").write_bytes(mark + b"name = 'mine'\r\n")
    assert main(["run", "--design", "mine.toml"]) == 0
    Path("press.csv").write_bytes(mark + b"t_s,F_l_N,F_h_N\r\n0,0.2,0.5\r\n")
    assert main(["read", str(output), "press.csv", "--each"]) in (0, 1)
    Path("points.csv").write_bytes(mark + b"tips.side_mm\r\n1\r\n")
    Path("study.toml").write_bytes(mark + b"points = 'points.csv'\r\nwanted = ['springs.K_l_N_per_m']\r\n")
    assert list(read_study(Path("study.toml")).vary) == ["tips.side_mm"]


def test_closed_input_is_an_empty_stream(output):
    line = f'exec "{sys.executable}" -m twintip read "$0" - <&-'
    done = ended("/bin/bash", "-c", line, output)
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith("pipeline: -, line 1 = ''")
    assert "Traceback" not in done.stderr
