"""The output folder: whatever runs, users and kills do to it, outputs are whole and no file of a person is lost."""

import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from pipeline.storage.digests import with_digest
from pipeline.storage.folder import OutputError, output_folder, unmanaged_files, whole_report

ROOT = Path(__file__).parents[3]
NAMES = st.sampled_from(["housing.step", "response.csv", "report.json", "thesis.tex", "housing.step.bak"])


def write_outputs(folder: Path, text: str) -> None:
    """Write two files and their report, as a run does."""
    contents = {"housing.step": f"solid {text}", "response.csv": f"table {text}"}
    entries = []
    for name, content in contents.items():
        (folder / name).write_text(content, encoding="utf-8")
        entries.append({"path": name, "sha256": hashlib.sha256(content.encode()).hexdigest()})
    (folder / "report.json").write_text(json.dumps(with_digest({"text": text, "files": entries})), encoding="utf-8")


def run(target: Path, text: str, *, force: bool = False) -> None:
    with output_folder(target, force=force) as folder:
        write_outputs(folder, text)


class OutputFolder(RuleBasedStateMachine):
    """Runs with and without --force, runs that fail, a person who writes, changes, links and deletes."""

    def __init__(self) -> None:
        """Begin with an empty place."""
        super().__init__()
        self.place = Path(tempfile.mkdtemp())
        self.target = self.place / "out"
        self.count = 0
        self.theirs: set[str] = set()

    def contents(self) -> set[str]:
        """Return what the files hold, wherever they are."""
        paths = [path for path in self.place.rglob("*") if path.is_file() and not path.is_symlink()]
        return {path.read_text(encoding="utf-8") for path in paths}

    def names(self) -> list[str]:
        """Return the names of what the folder holds."""
        return sorted(path.name for path in self.target.iterdir()) if self.target.exists() else []

    @rule(force=st.booleans(), fails=st.booleans())
    def run(self, force: bool, fails: bool) -> None:
        """Run; it is refused just where something is not a run's, and what fails changes nothing."""
        self.count += 1
        killed_before = (self.place / ".out.twintip").exists()
        refused = not force and bool(unmanaged_files(self.target))
        before = self.names()
        try:
            with output_folder(self.target, force=force) as folder:
                write_outputs(folder, str(self.count))
                if fails:
                    raise InterruptedError
        except OutputError:
            assert refused or killed_before
        except InterruptedError:
            assert fails
        else:
            assert not refused or killed_before
            assert json.loads((self.target / "report.json").read_bytes())["text"] == str(self.count)
            return
        assert killed_before or self.names() == before

    @rule(name=NAMES)
    def write(self, name: str) -> None:
        """Let a person write a file, over one of ours too."""
        self.target.mkdir(exist_ok=True)
        self.count += 1
        path = self.target / name
        if path.exists() and path.read_text(encoding="utf-8") in self.theirs:
            return
        content = f"precious {self.count}"
        path.write_text(content, encoding="utf-8")
        self.theirs.add(content)

    @rule()
    def leave_the_remains_of_a_kill(self) -> None:
        """Leave what a run leaves that is killed between its two renames, or while it writes."""
        aside = self.place / ".out.twintip"
        (aside / "new-1").mkdir(parents=True, exist_ok=True)
        (aside / "lock").touch()
        (aside / "new-1" / "half.step").write_text("half", encoding="utf-8")
        if self.target.exists() and not (aside / "old").exists() and self.count % 2:
            self.target.rename(aside / "old")

    @rule()
    def delete(self) -> None:
        """Let a person delete an output."""
        with suppress(FileNotFoundError):
            path = self.target / "response.csv"
            if path.read_text(encoding="utf-8") not in self.theirs:
                path.unlink()

    @invariant()
    def nothing_of_a_person_is_lost(self) -> None:
        """Every text that a person wrote is still there."""
        assert self.theirs <= self.contents()

    def teardown(self) -> None:
        """Take the place away."""
        shutil.rmtree(self.place)


TestOutputFolder = OutputFolder.TestCase
TestOutputFolder.settings = settings(max_examples=60, stateful_step_count=20, deadline=None)


def test_unchanged_folder_is_whole_and_any_change_is_not(tmp_path):
    target = tmp_path / "out"
    assert whole_report(target) is None
    run(target, "1")
    assert json.loads(whole_report(target))["text"] == "1"
    (target / "response.csv").write_text("other", encoding="utf-8")
    assert whole_report(target) is None
    run(target, "2", force=True)
    assert (target / "response.csv.bak").read_text(encoding="utf-8") == "other"
    (target / "response.csv").unlink()
    assert whole_report(target) is None


def test_second_run_at_the_same_time_is_refused_and_the_first_is_whole(tmp_path):
    with output_folder(tmp_path / "out") as folder:
        with pytest.raises(OutputError), output_folder(tmp_path / "out"):
            pytest.fail("two runs in one folder")
        with pytest.raises(OutputError):
            whole_report(tmp_path / "out")
        write_outputs(folder, "1")
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("make", [Path.mkdir, Path.touch, lambda path: path.symlink_to("x"), os.mkfifo])
def test_anything_that_is_not_listed_is_refused_by_name_and_kept_by_force(make, tmp_path):
    run(tmp_path / "out", "1")
    make(tmp_path / "out" / "mine")
    with pytest.raises(OutputError) as refused:
        run(tmp_path / "out", "2")
    assert "'mine'" in refused.value.bound
    run(tmp_path / "out", "2", force=True)
    assert os.path.lexists(tmp_path / "out" / "mine.bak")


def test_folder_of_a_person_with_the_name_of_ours_is_not_touched(tmp_path):
    mine = tmp_path / ".out.twintip"
    mine.mkdir()
    (mine / "letter").write_text("precious", encoding="utf-8")
    with pytest.raises(OutputError):
        run(tmp_path / "out", "1")
    assert (mine / "letter").read_text(encoding="utf-8") == "precious"


@pytest.mark.parametrize("place", [".", "..", "/", "/proc/out", "file/out", "loop/out", "x" * 300])
def test_place_that_cannot_be_replaced_is_refused(place, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    Path("loop").symlink_to("loop")
    with pytest.raises(OutputError):
        run(Path(place), "1")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "loop"]


def test_file_that_the_report_does_not_list_is_a_mistake_of_the_program(tmp_path):
    def forget_one(folder):
        write_outputs(folder, "1")
        (folder / "late.txt").touch()

    with pytest.raises(ValueError, match=r"late\.txt"), output_folder(tmp_path / "out") as folder:
        forget_one(folder)
    assert list(tmp_path.iterdir()) == []


def test_failed_run_leaves_no_folder_above_its_place(tmp_path):
    with pytest.raises(ZeroDivisionError), output_folder(tmp_path / "a" / "b" / "out"):
        _ = 1 / 0
    assert list(tmp_path.iterdir()) == []


KILLED = """
import os, sys, signal
from pathlib import Path
sys.path[:0] = [{root!r}, {tests!r}]
from test_folder import run
names = {{"rename": Path.rename, "unlink": Path.unlink, "write_text": Path.write_text, "rmdir": Path.rmdir}}
left = [int(sys.argv[1])]
def counted(name):
    def call(*each, **named):
        left[0] -= 1
        if left[0] < 0:
            os.kill(os.getpid(), signal.SIGKILL)
        return names[name](*each, **named)
    return call
for name in names:
    setattr(Path, name, counted(name))
run(Path("out"), "new")
"""


@pytest.mark.parametrize("moment", range(0, 14, 2))
def test_kill_at_any_moment_leaves_the_old_or_the_new_outputs(moment, tmp_path):
    """The kill comes before the call of that number which changes a file; the next run finds whole outputs."""
    run(tmp_path / "out", "old")
    program = KILLED.format(root=str(ROOT), tests=str(Path(__file__).parent))
    done = subprocess.run([sys.executable, "-c", program, str(moment)], cwd=tmp_path, check=False, timeout=120)
    assert done.returncode in (0, -signal.SIGKILL)
    assert json.loads(whole_report(tmp_path / "out"))["text"] in ("old", "new")
    run(tmp_path / "out", "next")
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert unmanaged_files(tmp_path / "out") == []
