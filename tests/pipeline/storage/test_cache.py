"""The cache gives back what was stored for the same inputs and code, and never anything else."""

import hashlib
import math
import os
import re
import sys
import tomllib
from pathlib import Path

import pytest

from pipeline.storage import cache, versions
from pipeline.storage.cache import cache_folder, load_or_compute
from pipeline.storage.digests import is_regular
from pipeline.storage.versions import code_digest, computing_versions, sources_digest


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "twintip"


class Counted:
    """A stage that counts how often it was made."""

    def __init__(self, value):
        self.value, self.times = value, 0

    def __call__(self):
        self.times += 1
        return {"value": self.value}


def remembered(stage, inputs, make):
    return load_or_compute(stage, inputs, make, dict[str, float])


def test_second_time_is_not_made_and_is_the_same_to_the_last_bit():
    stage = Counted(0.1 + 0.2)
    first, second = (remembered("contact", {"a": 1.0}, stage) for _ in range(2))
    assert first == second == {"value": 0.1 + 0.2}
    assert stage.times == 1


@pytest.mark.parametrize(("stage", "inputs"), [("flexures", {"a": 1.0}), ("contact", {"a": 1.0000000000000002})])
def test_another_stage_or_input_is_made(stage, inputs):
    remembered("contact", {"a": 1.0}, Counted(1))
    other = Counted(2)
    assert remembered(stage, inputs, other) == {"value": 2}
    assert other.times == 1


def test_other_code_is_made_again(monkeypatch):
    remembered("contact", {}, Counted(1))
    monkeypatch.setattr(cache, "code_digest", lambda: "changed")
    assert remembered("contact", {}, Counted(2)) == {"value": 2}


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_no_number_that_json_lacks_is_stored(value, folder):
    with pytest.raises(ValueError, match="JSON"):
        remembered("contact", {}, Counted(value))
    assert not [*folder.glob("*.json")]


def digested(name, body):
    """Return an entry whose digest is right, whoever made it."""
    digest = hashlib.sha256(f"{name}\n{body}".encode()).hexdigest()
    return f"{digest}\n{body}"


def copied(entry):
    """Put another stage's entry into this one's place."""
    remembered("flexures", {}, Counted(7))
    (other,) = entry.parent.glob("flexures-*.json")
    entry.write_bytes(other.read_bytes())


def endless(entry):
    with entry.open("r+b") as file:
        file.truncate(2**40)  # a hole, that no disk holds


ENTRIES = {
    "empty": lambda entry: entry.write_text(""),
    "wrong digest": lambda entry: entry.write_text("0" * 64 + '\n{"value": 3}'),
    "a digit changed": lambda entry: entry.write_text(entry.read_text().replace("1.25", "1.26")),
    "another kind": lambda entry: entry.write_text(digested(entry.name, '["value", 3]')),
    "a text for a number": lambda entry: entry.write_text(digested(entry.name, '{"value": "3"}')),
    "of another stage": copied,
    "endless": endless,
    "pipe": lambda entry: (entry.unlink(), os.mkfifo(entry)),
    "link to a device": lambda entry: (entry.unlink(), entry.symlink_to("/dev/zero")),
    "folder": lambda entry: (entry.unlink(), entry.mkdir()),
}


@pytest.mark.parametrize("damage", ENTRIES.values(), ids=ENTRIES)
def test_entry_that_is_not_as_it_was_stored_is_made_again(folder, damage):
    remembered("contact", {}, Counted(1.25))
    (entry,) = folder.glob("contact-*.json")
    damage(entry)
    assert remembered("contact", {}, Counted(2)) == {"value": 2}
    if is_regular(entry):
        assert remembered("contact", {}, Counted(3)) == {"value": 2}, "and stored in its place"
    assert list(folder.glob("*.part")) == []


@pytest.mark.parametrize("link", [Path.hardlink_to, Path.symlink_to])
@pytest.mark.parametrize("suffix", ["", f".{os.getpid()}.part"], ids=["entry", "part"])
def test_nothing_is_written_through_a_link(folder, link, suffix, tmp_path):
    """A person's file under the name of an entry, or of the part that is written first, stays as it is."""
    remembered("contact", {}, Counted(1))
    (entry,) = folder.glob("contact-*.json")
    entry.unlink()
    letter = tmp_path / "letter"
    letter.write_text("precious")
    link(entry.with_name(entry.name + suffix), letter)
    assert remembered("contact", {}, Counted(2)) == {"value": 2}
    assert letter.read_text() == "precious"


def test_part_of_a_process_that_was_killed_is_cleared_by_the_next(folder):
    remembered("contact", {}, Counted(1))
    (entry,) = folder.glob("contact-*.json")
    entry.rename(entry.with_name(f"{entry.name}.4194305.part"))
    assert remembered("contact", {}, Counted(2)) == {"value": 2}
    assert list(folder.iterdir()) == [entry]


def test_cache_that_cannot_be_written_is_no_error(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("", encoding="utf-8")
    monkeypatch.setenv("XDG_CACHE_HOME", str(blocked))
    assert remembered("contact", {}, Counted(1)) == {"value": 1}


def test_folder_follows_the_environment(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache_folder() == tmp_path / ".cache" / "twintip"


def test_another_python_or_package_is_another_code(monkeypatch):
    own = computing_versions()
    assert own["python"] == ".".join(map(str, sys.version_info[:3]))
    digests = {code_digest()}
    for name in ("python", "scipy", "gmsh"):
        monkeypatch.setattr(versions, "computing_versions", lambda name=name: {**own, name: "0.0.1"})
        digests.add(code_digest.__wrapped__())
    assert len(digests) == 4


def test_every_source_file_counts_in_sub_folders_too(plant):
    """A changed file that the digest does not see would serve results of other code."""
    files = {"cad/a.py": "", "mesh/deep/b.py": "", "solve/deep/er/c.py": "", "pipeline/d.toml": ""}
    root = plant(files)
    seen = [sources_digest(root)]
    for name in (*files, "solve/deep/c.py"):
        (root / name).write_text("changed", encoding="utf-8")
        seen.append(sources_digest(root))
    (root / "solve/deep/c.py").rename(root / "solve/deep/e.py")
    seen.append(sources_digest(root))
    assert len(set(seen)) == len(files) + 3
    pages = sources_digest(root, of_pages=True)
    (root / "pipeline/page.js").write_text("a plot", encoding="utf-8")  # shows numbers and makes none
    assert sources_digest(root, of_pages=True) != pages
    (root / "cad/__pycache__").mkdir()
    (root / "cad/__pycache__/a.pyc").write_text("", encoding="utf-8")
    assert sources_digest(root) == seen[-1]


def test_every_run_needs_the_packages_of_the_project_file_and_no_extra():
    project = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    declared = {name.lower() for name in versions.declared_packages()}
    assert declared == {re.split(r"[^A-Za-z0-9._-]", line)[0].lower() for line in project["dependencies"]}
