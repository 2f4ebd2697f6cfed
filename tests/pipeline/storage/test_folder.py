"""Outputs appear whole or not at all: refusals before the work, replacement after it, nothing left when it fails."""

import json
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import pytest

from pipeline.report.outputs import file_entries
from pipeline.storage import folder as outputs
from pipeline.storage.folder import OutputError, output_folder
from pipeline.storage.interruption import Interrupted, interruptible
from pipeline.storage.seal import sealed_mapping

ROOT = Path(__file__).parents[3]
WAIT = 120.0  # seconds until a child process is given up


def fill(folder: Path, text: str = "new", *more: str) -> None:
    """Write files and a report that lists them, as a run does."""
    for name in ("housing.stl", *more):
        (folder / name).write_text(text, encoding="utf-8")
    report = sealed_mapping({"text": text, "files": file_entries(folder)})
    (folder / "report.json").write_text(json.dumps(report), encoding="utf-8")


def ours(place: Path, text: str = "old") -> Path:
    place.mkdir(parents=True)
    fill(place, text)
    return place


def text_of(place: Path) -> str:
    return (place / "housing.stl").read_text(encoding="utf-8")


def everything_in(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


def no_work(_folder: Path) -> None:
    pytest.fail("the work began")


def attempt(target: Path, work=no_work) -> None:
    with output_folder(target) as folder:
        work(folder)


def then_raise(error: BaseException):
    def work(folder: Path) -> None:
        fill(folder, "half")
        raise error

    return work


def one_line(error: BaseException) -> str:
    assert "\n" not in str(error)
    return str(error)


@pytest.fixture
def child():
    """Return a function that starts a process which writes into a folder and then waits; it is ended afterwards."""
    started = []

    def start(target: Path, *, before: str = "") -> subprocess.Popen:
        program = f"""
            import signal, sys, time
            from pathlib import Path
            {before}
            from pipeline.storage.folder import output_folder
            from pipeline.storage.interruption import interruptible
            with interruptible(), output_folder(Path({str(target)!r})) as folder:
                (folder / "report.json").write_text("half")
                print("inside", flush=True)
                time.sleep({WAIT})
        """
        process = subprocess.Popen(
            [sys.executable, "-c", textwrap.dedent(program)],
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        late = threading.Timer(WAIT, process.kill)
        try:
            late.start()
            assert process.stdout.readline() == "inside\n", process.stderr.read()
        finally:
            late.cancel()
        return process

    yield start
    for process in started:
        process.kill()
    for process in started:
        process.communicate(timeout=WAIT)


@pytest.mark.parametrize("place", ["out", "missing/above/out", "out/"])
def test_new_folder_appears_whole(place, tmp_path):
    target = tmp_path / place
    with output_folder(target) as folder:
        assert not target.exists()
        fill(folder)
    assert text_of(target) == "new"
    assert everything_in(target.parent) == ["out", "out/housing.stl", "out/report.json"]


def test_empty_folder_is_filled(tmp_path):
    (tmp_path / "out").mkdir()
    with output_folder(tmp_path / "out") as folder:
        fill(folder)
    assert text_of(tmp_path / "out") == "new"


def test_old_outputs_are_replaced_and_not_mixed(tmp_path):
    target = tmp_path / "out"
    target.mkdir()
    fill(target, "old", "response.csv")
    with output_folder(target) as folder:
        assert text_of(target) == "old"
        fill(folder)
    assert everything_in(tmp_path) == ["out", "out/housing.stl", "out/report.json"]
    assert text_of(target) == "new"


def test_relative_path_and_symlink_lead_to_the_real_place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    real = ours(tmp_path / "elsewhere" / "real")
    (tmp_path / "link").symlink_to(real, target_is_directory=True)
    with output_folder(Path("link")) as folder:
        fill(folder)
    assert (tmp_path / "link").is_symlink()
    assert text_of(real) == "new"


def test_dangling_symlink_gets_its_target(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "later")
    with output_folder(tmp_path / "link") as folder:
        fill(folder)
    assert text_of(tmp_path / "later") == "new"


@pytest.mark.parametrize("error", [RuntimeError("failed"), KeyboardInterrupt(), SystemExit(3)])
def test_failure_leaves_the_old_outputs_as_they_were(error, tmp_path):
    target = ours(tmp_path / "out")
    with pytest.raises(type(error)):
        attempt(target, then_raise(error))
    assert everything_in(tmp_path) == ["out", "out/housing.stl", "out/report.json"]
    assert text_of(target) == "old"


def test_failure_leaves_nothing_where_nothing_was(tmp_path):
    with pytest.raises(RuntimeError, match="failed"):
        attempt(tmp_path / "missing" / "above" / "out", then_raise(RuntimeError("failed")))
    assert everything_in(tmp_path) == []


FOREIGN = [
    "notes.txt",
    "housing.f3d",
    ".hidden",
    "pictures/holiday.jpg",
    "sub/report.json",
    "report.json/inner",
    "housing.step",
]


@pytest.mark.parametrize("name", FOREIGN)
def test_folder_with_a_foreign_file_is_refused_before_the_work(name, tmp_path):
    target = tmp_path / "out"
    target.mkdir()
    fill(target, "old")
    if name.startswith("report.json"):
        (target / "report.json").unlink()
    (target / name).parent.mkdir(exist_ok=True)
    (target / name).write_text("precious", encoding="utf-8")
    before = everything_in(tmp_path)
    with pytest.raises(OutputError, match=r"--out = '.*out': must be .*holds '.*'.*; name another folder") as caught:
        attempt(target)
    one_line(caught.value)
    assert everything_in(tmp_path) == before
    assert (target / name).read_text(encoding="utf-8") == "precious"


def test_lone_design_file_is_not_taken_for_ours(tmp_path):
    """A person keeps a design in a folder and names that folder: no report, so no run wrote it."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "design.toml").write_text("# my own", encoding="utf-8")
    with pytest.raises(OutputError, match=r"holds 'design.toml'"):
        attempt(tmp_path / "mine")
    assert (tmp_path / "mine" / "design.toml").read_text(encoding="utf-8") == "# my own"


def test_file_that_comes_during_the_work_is_not_lost(tmp_path):
    target = ours(tmp_path / "out")

    def work(folder: Path) -> None:
        fill(folder)
        (target / "notes.txt").write_text("precious", encoding="utf-8")

    with pytest.raises(OutputError, match=r"holds 'notes.txt'"):
        attempt(target, work)
    assert (target / "notes.txt").read_text(encoding="utf-8") == "precious"
    assert text_of(target) == "old"


def test_name_that_the_next_run_would_refuse_is_found_at_once(tmp_path):
    with pytest.raises(ValueError, match=r"'scratch.dat': must be listed in report.json; write it before the report"):
        attempt(tmp_path / "out", lambda folder: (fill(folder), (folder / "scratch.dat").touch()))
    assert everything_in(tmp_path) == []


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda at: (at / "out").write_text("a file", encoding="utf-8"), r"must be a folder, and '.*out' is a file"),
        (lambda at: (at / "out").symlink_to(at / "out"), r"must be a path that leads somewhere"),
    ],
)
def test_place_that_is_no_folder_is_refused(make, message, tmp_path):
    make(tmp_path)
    with pytest.raises(OutputError, match=message) as caught, output_folder(tmp_path / "out"):
        pytest.fail("the work began")
    one_line(caught.value)
    assert everything_in(tmp_path) == ["out"]


def test_place_below_a_file_is_refused(tmp_path):
    (tmp_path / "file").write_text("a file", encoding="utf-8")
    with pytest.raises(OutputError, match=r"must be a folder, and '.*file' is a file"):
        attempt(tmp_path / "file" / "out")


def test_name_too_long_for_the_file_system_is_refused(tmp_path):
    with pytest.raises(OutputError, match=r"must be .*[Nn]ame too long"):
        attempt(tmp_path / ("x" * 300))


def test_place_that_cannot_be_written_is_refused(tmp_path, monkeypatch):
    if os.geteuid() == 0:
        place = Path("/proc/out")  # root may write anywhere else
    else:
        tmp_path.chmod(0o500)
        place = tmp_path / "out"
    with pytest.raises(OutputError, match=r"--out = '.*out.*': must be in a folder that can be written") as caught:
        attempt(place)
    one_line(caught.value)
    tmp_path.chmod(0o700)
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(OutputError, match=r"and '.*' cannot; name another folder with --out, or change its perm"):
        attempt(tmp_path / "out")
    assert everything_in(tmp_path) == []


@pytest.mark.parametrize("place", [".", "..", "/", ""])
def test_current_folder_and_those_above_it_are_refused(place, tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    with pytest.raises(OutputError, match=r"not the current one, one above it or a mounted one"):
        attempt(Path(place))


def test_folder_in_use_is_refused_and_the_first_run_goes_on(tmp_path):
    target = ours(tmp_path / "out")
    with output_folder(target) as folder:
        with pytest.raises(OutputError, match=r"no other run is writing; wait for that run"):
            attempt(target)
        fill(folder)
    assert text_of(target) == "new"
    assert everything_in(tmp_path) == ["out", "out/housing.stl", "out/report.json"]


def test_folder_in_use_by_another_process_is_refused(tmp_path, child):
    child(tmp_path / "out")
    with pytest.raises(OutputError, match=r"no other run is writing"):
        attempt(tmp_path / "out")


def test_neighbour_folders_do_not_wait_for_each_other(tmp_path):
    with output_folder(tmp_path / "a") as a, output_folder(tmp_path / "b") as b:
        fill(a)
        fill(b)
    assert (text_of(tmp_path / "a"), text_of(tmp_path / "b")) == ("new", "new")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signal_ends_the_run_and_leaves_the_old_outputs(number, tmp_path, child):
    target = ours(tmp_path / "out")
    before = "signal.signal(signal.SIGINT, signal.default_int_handler)"  # a shell's background job ignores it
    process = child(target, before=before)
    process.send_signal(number)
    _, error = process.communicate(timeout=WAIT)
    assert f"Interrupted: {number.name}" in error
    assert text_of(target) == "old"
    assert everything_in(tmp_path) == ["out", "out/housing.stl", "out/report.json"]


def test_killed_run_is_cleared_away_by_the_next(tmp_path, child):
    target = ours(tmp_path / "out")
    process = child(target)
    process.kill()
    process.wait(WAIT)
    assert len(everything_in(tmp_path)) > 3  # it could not tidy up
    assert text_of(target) == "old"
    with output_folder(target) as folder:
        assert list(folder.iterdir()) == []
        fill(folder)
    assert everything_in(tmp_path) == ["out", "out/housing.stl", "out/report.json"]


def test_result_that_a_killed_run_had_moved_aside_comes_back(tmp_path):
    ours(tmp_path / ".out.twintip-old", "old")
    with pytest.raises(RuntimeError, match="failed"):
        attempt(tmp_path / "out", then_raise(RuntimeError("failed")))
    assert text_of(tmp_path / "out") == "old"
    assert everything_in(tmp_path) == ["out", "out/housing.stl", "out/report.json"]


def test_failed_exchange_brings_the_old_outputs_back(tmp_path, monkeypatch):
    target = ours(tmp_path / "out")
    rename = Path.rename

    def refuse_the_new(self, to):
        if self.name.endswith("-new"):
            raise OSError(28, "No space left on device")
        return rename(self, to)

    monkeypatch.setattr(Path, "rename", refuse_the_new)
    with pytest.raises(OutputError, match=r"No space left on device"), output_folder(target) as folder:
        fill(folder)
    monkeypatch.undo()
    assert text_of(target) == "old"
    assert everything_in(tmp_path) == ["out", "out/housing.stl", "out/report.json"]


def test_signal_during_the_exchange_waits_for_its_end(tmp_path, monkeypatch):
    target = ours(tmp_path / "out")
    rename = Path.rename

    def interrupted(self, to):
        signal.raise_signal(signal.SIGTERM)
        return rename(self, to)

    monkeypatch.setattr(Path, "rename", interrupted)
    with pytest.raises(Interrupted) as caught, interruptible(), output_folder(target) as folder:
        fill(folder)
    assert caught.value.exit_code == 128 + signal.SIGTERM
    assert text_of(target) == "new"
    assert everything_in(tmp_path) == ["out", "out/housing.stl", "out/report.json"]


def test_second_signal_does_not_stop_the_tidying(tmp_path, monkeypatch):
    remove = outputs.shutil.rmtree

    def interrupted(*arguments, **keywords):
        signal.raise_signal(signal.SIGINT)
        remove(*arguments, **keywords)

    def work(folder: Path) -> None:
        fill(folder)
        monkeypatch.setattr(outputs.shutil, "rmtree", interrupted)
        signal.raise_signal(signal.SIGINT)

    with pytest.raises(Interrupted), interruptible():
        attempt(tmp_path / "out", work)
    assert everything_in(tmp_path) == []


def test_handlers_are_given_back_and_ignored_signals_stay_ignored(tmp_path):
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        handlers = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)]
        with interruptible(), output_folder(tmp_path / "out") as folder:
            signal.raise_signal(signal.SIGHUP)
            fill(folder)
        assert [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)] == handlers
    finally:
        signal.signal(signal.SIGHUP, before)
    assert text_of(tmp_path / "out") == "new"


def test_without_signals_taken_the_process_keeps_its_own(tmp_path):
    """From Python a run touches no handler: a notebook's Ctrl-C stays what it is."""
    handlers = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)]
    with output_folder(tmp_path / "out") as folder:
        assert [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)] == handlers
        fill(folder)


def test_without_a_path_the_folder_vanishes():
    with output_folder(None) as folder:
        fill(folder)
    assert not folder.exists()


def test_two_runs_at_once_end_with_one_whole_result_each_time(tmp_path):
    """Threads start together on one folder, again and again: each is refused or writes all of its files."""
    target, refused, written = tmp_path / "out", [], []

    def write(text: str) -> None:
        for _ in range(20):
            try:
                with output_folder(target) as folder:
                    fill(folder, text)
                    time.sleep(0.001)
                written.append(text)
            except OutputError:
                refused.append(text)

    threads = [threading.Thread(target=write, args=(text,)) for text in ("a", "b")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(written) + len(refused) == 40
    assert written
    report = json.loads((target / "report.json").read_text(encoding="utf-8"))
    assert text_of(target) == report["text"]
    assert everything_in(tmp_path) == ["out", "out/housing.stl", "out/report.json"]


@pytest.mark.parametrize("out", ["out", None])
def test_full_disk_names_the_folder_and_an_error_with_a_file_keeps_it(tmp_path, out):
    path = out and tmp_path / out
    with pytest.raises(OSError, match="No space left") as full, output_folder(path) as folder:
        Path("/dev/full").write_text("more than there is room for")
    assert full.value.filename == str(path or folder)
    with pytest.raises(FileNotFoundError) as missing, output_folder(path) as folder:
        (folder / "none" / "response.csv").write_text("")
    assert missing.value.filename.endswith("response.csv")
    with pytest.raises(OSError, match="descriptor") as closed, output_folder(path):
        os.close(-1)
    assert closed.value.filename is None
