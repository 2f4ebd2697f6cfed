"""The output folder: whatever runs, users and kills do to it, outputs are whole and no file of a person is lost."""

import hashlib
import json
import os
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from pipeline.storage.digests import is_regular, with_digest
from pipeline.storage.folder import OutputError, output_folder, unchanged_report, unmanaged_files

NAMES = st.sampled_from(["housing.step", "response.csv", "report.json", "thesis.tex", "housing.step.bak"])
BESIDE = st.sets(st.sampled_from([".out.twintip-new", ".out.twintip.bak", "out.bak", ".out"]))
MAKES = {
    "pipe": os.mkfifo,
    "folder": Path.mkdir,
    "link": lambda path: path.symlink_to("../letter"),
    "broken link": lambda path: path.symlink_to("nowhere"),
    "hard link": lambda path: path.hardlink_to(path.parent.parent / "letter"),
}
CHANGES = ("mkdir", "rename", "chmod", "unlink", "rmdir", "write_text")
"""What a run does to files by pathlib: before each of these calls it may be killed."""


def write_outputs(folder, text):
    """Write two files and their report, as a run does."""
    contents = {"housing.step": f"solid {text}", "response.csv": f"table {text}"}
    entries = []
    for name, content in contents.items():
        (folder / name).write_text(content, encoding="utf-8")
        entries.append({"path": name, "sha256": hashlib.sha256(content.encode()).hexdigest()})
    (folder / "report.json").write_text(json.dumps(with_digest({"text": text, "files": entries})), encoding="utf-8")


def run(target, text, *, force=False):
    with output_folder(target, force=force) as folder:
        write_outputs(folder, text)


def text_of(target):
    """Return which run wrote the folder, None for one that is not as a run left it."""
    content = unchanged_report(target)
    return None if content is None else json.loads(content)["text"]


def run_that_is_killed(target, text, moment, *, force):
    """Run in a process of its own that ends, without any clearing up, before its change of that number."""
    child = os.fork()
    if child:
        os.waitpid(child, 0)
        return
    calls = iter(range(moment))

    def counted(change):
        def call(*each, **named):
            if next(calls, None) is None:
                os._exit(9)
            return change(*each, **named)

        return call

    for name in CHANGES:
        setattr(Path, name, counted(getattr(Path, name)))
    with suppress(BaseException):
        run(target, text, force=force)
    os._exit(0)


class OutputFolder(RuleBasedStateMachine):
    """Runs that end, fail or are killed, and a person who writes, links, changes and deletes."""

    def __init__(self):
        """Begin with an empty place."""
        super().__init__()
        self.place = Path(tempfile.mkdtemp())
        self.target = self.place / "out"
        self.count = 0
        self.theirs: set[str] = set()
        self.odd = 0  # links, pipes and folders of the person

    @initialize(names=BESIDE)
    def have_other_things_beside(self, names):
        """Let a person have folders whose names are like ours, and a letter that links lead to."""
        for path in (self.place / "letter", *(self.place / name / "letter" for name in names)):
            path.parent.mkdir(exist_ok=True)
            self.put(path)

    def put(self, path):
        """Write what the person must find again."""
        self.count += 1
        path.write_text(f"precious {self.count}", encoding="utf-8")
        self.theirs.add(f"precious {self.count}")

    def is_theirs(self, path):
        """Say whether anything of the person is there."""
        is_file = path.is_file() and not path.is_symlink()
        return os.path.lexists(path) and not (is_file and path.read_text(encoding="utf-8") not in self.theirs)

    @rule(force=st.booleans(), fails=st.booleans())
    def run(self, force, fails):
        """Run; it is refused just where something is not a run's, and what fails changes nothing."""
        self.count += 1
        before = text_of(self.target)  # and remains of a kill are cleared
        unmanaged = unmanaged_files(self.target)
        refused = (bool(unmanaged) and not force) or any(not is_regular(self.target / name) for name in unmanaged)
        names = self.names()
        try:
            with output_folder(self.target, force=force) as folder:
                write_outputs(folder, str(self.count))
                if fails:
                    raise InterruptedError
        except OutputError:
            assert refused
        except InterruptedError:
            assert fails
        else:
            assert not refused
            assert json.loads((self.target / "report.json").read_bytes())["text"] == str(self.count)
            assert force or text_of(self.target) == str(self.count)
            return
        assert (self.names(), text_of(self.target)) == (names, before)

    def names(self):
        """Return the names of what the folder holds."""
        return sorted(path.name for path in self.target.iterdir()) if self.target.exists() else []

    @rule(force=st.booleans(), moment=st.integers(0, 18))
    def be_killed(self, force, moment):
        """Kill a run before one of its changes: whole outputs stay whole, or the new ones are there."""
        self.count += 1
        before = text_of(self.target)
        run_that_is_killed(self.target, str(self.count), moment, force=force)
        after = text_of(self.target)
        assert after == str(self.count) or before is None or after == before
        assert not (self.place / ".out.twintip").exists(), "the next command clears what the killed one left"

    @rule(name=NAMES)
    def write(self, name):
        """Let a person write a file, over one of ours too."""
        self.target.mkdir(exist_ok=True)
        if not self.is_theirs(self.target / name):
            self.put(self.target / name)

    @rule(name=NAMES, kind=st.sampled_from(sorted(MAKES)))
    def make(self, name, kind):
        """Let a person put what is no file in the place of one."""
        self.target.mkdir(exist_ok=True)
        path = self.target / name
        if not self.is_theirs(path):
            path.unlink(missing_ok=True)
            MAKES[kind](path)
            self.odd += kind != "hard link"

    @rule()
    def delete(self):
        """Let a person delete an output."""
        if not self.is_theirs(self.target / "response.csv"):
            (self.target / "response.csv").unlink(missing_ok=True)

    @invariant()
    def nothing_of_a_person_is_lost(self):
        """Every text that a person wrote is still there, and every link, pipe and folder."""
        texts = set()
        odd = 0
        for path in self.place.rglob("*"):
            if path.is_file() and not path.is_symlink():
                texts.add(path.read_text(encoding="utf-8"))
            elif self.target in path.parents:
                odd += 1
        assert self.theirs <= texts
        assert odd == self.odd

    def teardown(self):
        """Take the place away."""
        shutil.rmtree(self.place)


TestOutputFolder = OutputFolder.TestCase
TestOutputFolder.settings = settings(max_examples=20, stateful_step_count=14, deadline=None)


@pytest.mark.parametrize("path", ["{place}/letter", "../letter", "../../letter"])
def test_report_that_lists_a_file_outside_is_none_of_ours(path, tmp_path):
    letter = tmp_path / "letter"
    letter.write_text("precious", encoding="utf-8")
    run(tmp_path / "out", "1")
    report = json.loads((tmp_path / "out" / "report.json").read_bytes())
    entry = {"path": path.format(place=tmp_path), "sha256": hashlib.sha256(b"precious").hexdigest()}
    forged = with_digest({**report, "files": [*report["files"], entry]})
    (tmp_path / "out" / "report.json").write_text(json.dumps(forged), encoding="utf-8")
    assert unchanged_report(tmp_path / "out") is None
    run(tmp_path / "out", "2", force=True)
    assert letter.read_text(encoding="utf-8") == "precious"


def test_report_that_a_person_changed_is_neither_answered_nor_replaced(tmp_path):
    run(tmp_path / "out", "1")
    path = tmp_path / "out" / "report.json"
    path.write_text(json.dumps({**json.loads(path.read_bytes()), "text": "mine"}), encoding="utf-8")
    assert unchanged_report(tmp_path / "out") is None
    with pytest.raises(OutputError):
        run(tmp_path / "out", "2")
    assert json.loads(path.read_bytes())["text"] == "mine"


def test_second_run_at_the_same_time_is_refused_and_a_repeat_of_the_first_is_answered(tmp_path):
    target = tmp_path / "out"
    with output_folder(target) as folder:
        with pytest.raises(OutputError), output_folder(target):
            pytest.fail("two runs in one folder")
        assert unchanged_report(target) is None
        write_outputs(folder, "1")
    with output_folder(target) as folder:
        assert text_of(target) == "1"
        write_outputs(folder, "2")
    assert text_of(target) == "2"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize(
    ("held", "text"), [("letter", "precious"), ("lock", "precious"), ("new-1", ""), ("new-letter/a", "precious")]
)
def test_folder_of_a_person_with_the_name_of_ours_is_not_touched(held, text, tmp_path):
    mine = tmp_path / ".out.twintip"
    (mine / held).parent.mkdir(parents=True)
    if held != "lock":
        (mine / "lock").touch()
    (mine / held).write_text(text, encoding="utf-8")
    with pytest.raises(OutputError):
        run(tmp_path / "out", "1")
    assert (mine / held).read_text(encoding="utf-8") == text
    assert not (tmp_path / "out").exists()


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
