"""Ended at any moment, a run leaves the old outputs or the new ones whole, and the next run clears up and is right."""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import pytest

from pipeline.report.outputs import file_entries
from pipeline.storage.belongings import foreign_files
from pipeline.storage.seal import sealed_mapping

ROOT = Path(__file__).parents[3]
COMMANDS = ("run", "design")
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
SECONDS = 300  # until a command is taken to hang
SEED = 13
STUDIED = 10  # moments of each command and signal
LATE = 0.8  # of a command's time: about then its files are written, and nearly half of the moments lie after it


@dataclass(frozen=True)
class Place:
    """Where a command runs: the folder with its outputs, a cache and temporary files of its own."""

    root: Path

    @property
    def out(self) -> Path:
        return self.root / "place" / "out"

    def start(self, command: str) -> subprocess.Popen[bytes]:
        """Start a command in coarse meshes; it may be ended, its stdout is not read."""
        for name in ("cache", "temporary"):
            (self.root / name).mkdir(parents=True, exist_ok=True)
        variables = {"XDG_CACHE_HOME": str(self.root / "cache"), "TMPDIR": str(self.root / "temporary")}
        words = [command, "--tol", "0.1", "--out", str(self.out)]
        return subprocess.Popen(
            [sys.executable, "-m", "pipeline", *words],
            cwd=ROOT,
            env={**os.environ, **variables},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
        )

    def left(self) -> list[str]:
        """Return what lies about besides the outputs and the entries of the cache."""
        there = [*(self.root / "place").iterdir(), *(self.root / "temporary").iterdir()]
        there += [path for path in (self.root / "cache").rglob("*") if path.is_file() and path.suffix != ".json"]
        return sorted(str(path.relative_to(self.root)) for path in there if path != self.out)

    def processes(self) -> list[int]:
        """Return the processes of a command that still run: they have its cache in their environment."""
        mark, found = f"XDG_CACHE_HOME={self.root / 'cache'}".encode(), []
        for path in Path("/proc").glob("[0-9]*/environ"):
            with suppress(OSError):  # ended since, or somebody else's
                if mark in path.read_bytes().split(b"\0"):
                    found.append(int(path.parent.name))
        return found

    def wait_for_processes(self) -> None:
        """Wait until no process of a command runs: that of a run that was killed ends a moment after it."""
        until = time.monotonic() + SECONDS
        while self.processes():
            assert time.monotonic() < until, self.processes()
            time.sleep(0.05)


def plant_old(place: Place) -> None:
    """Write files and a report that lists them, as an earlier run did."""
    place.out.mkdir(parents=True)
    (place.out / "housing.stl").write_text("old", encoding="utf-8")
    report = sealed_mapping({"files": file_entries(place.out)})
    (place.out / "report.json").write_text(json.dumps(report), encoding="utf-8")


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def numbers(folder: Path) -> dict[str, object]:
    """Return all that a folder says, but for seconds and what follows from them, as the page that shows them."""

    def timeless(value: object) -> object:
        if isinstance(value, dict):
            return {key: timeless(one) for key, one in value.items() if not key.endswith("seconds") and key != "digest"}
        return [timeless(one) for one in value] if isinstance(value, list) else value

    files = content(folder)
    report = timeless(json.loads(files["report.json"]))
    report["files"] = [file for file in report["files"] if file["path"] != "report.html"]
    return {**files, "report.html": None, "report.json": report}


@dataclass(frozen=True)
class WholeRun:
    """A run that nobody ends: its exit code, what it writes and how long it takes."""

    code: int
    numbers: dict[str, object]
    seconds: float


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> dict[str, WholeRun]:
    runs = {}
    for command in COMMANDS:
        place, started = Place(tmp_path_factory.mktemp(command)), time.perf_counter()
        process = place.start(command)
        process.communicate(timeout=SECONDS)
        seconds = time.perf_counter() - started
        assert place.left() == []
        runs[command] = WholeRun(process.returncode, numbers(place.out), seconds)
    return runs


def check_moment(place: Place, command: str, number: signal.Signals, share: float, whole: WholeRun) -> None:
    """End a command after a share of its time, look at its folder, run it again and look once more."""
    plant_old(place)
    old = content(place.out)
    process = place.start(command)
    time.sleep(share * whole.seconds)
    process.send_signal(number)
    _, said = process.communicate(timeout=SECONDS)
    assert b"Traceback" not in said
    if number != signal.SIGKILL:
        assert place.processes() == []
        assert place.left() == []
    place.wait_for_processes()
    there = place.out if place.out.exists() else place.out.with_name(".out.twintip-old")  # killed between two renames
    if content(there) != old:
        assert foreign_files(there) == []
        assert numbers(there) == whole.numbers
    again = place.start(command)
    _, said = again.communicate(timeout=SECONDS)
    assert (again.returncode, said) == (whole.code, b"")
    assert numbers(place.out) == whole.numbers
    assert (place.left(), place.processes()) == ([], [])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "number"), [("run", signal.SIGTERM), ("run", signal.SIGKILL), ("design", signal.SIGKILL)]
)
def test_run_ended_at_a_moment_leaves_nothing_half(command, number, whole, tmp_path):
    share = random.Random(f"{SEED} {command} {number}").uniform(0.2, 1.0)
    check_moment(Place(tmp_path), command, number, share, whole[command])


@pytest.mark.study
@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("command", COMMANDS)
def test_run_ended_at_any_of_sixty_moments_leaves_nothing_half(command, number, whole, tmp_path):
    rng = random.Random(f"{SEED} {command} {number}")
    shares = [rng.uniform(start, 1.05) for start in (0.0, LATE) for _ in range(STUDIED // 2)]
    for count, share in enumerate(shares):
        check_moment(Place(tmp_path / str(count)), command, number, share, whole[command])
        shutil.rmtree(tmp_path / str(count))
