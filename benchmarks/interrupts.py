"""Ctrl-C and SIGTERM at random moments of commands: each command ends at once with one line, and loses nothing.

`python -m benchmarks.interrupts [--count 40] [--seed 1]` sends this number of each. It exits with 1 where a
command ends in another way. Ctrl-C ends the benchmark with a summary so far.
"""

import argparse
import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path

from benchmarks.harness import ROOT
from benchmarks.usage import ONE_THREAD
from pipeline.commands.console import FAILED, PASSED
from pipeline.storage.folder import whole_report

SECONDS = 600  # until a command is taken to hang
AT_ONCE_S = 20.0  # between a signal and the end: a solve of a library is not cut
LAST_S = 1.0  # between the answer of a command, whose exit code holds from then on, and the end of its process
STUDY = """
base = "paper"
samples = 200
wanted = ["springs.K_l_N_per_m"]
[vary]
"tips.side_mm" = { from = 0.8, to = 1.6 }
"""
WEIGHTS = "tip,weight_g,deflection_mm\n" + "".join(
    f"{tip},{grams},{grams * mm_per_g:.4f}\n"
    for tip, mm_per_g, weights in (("low", 0.013, (5, 10, 15, 20)), ("high", 5.7e-4, (100, 200, 300, 400)))
    for grams in weights
)
COMMANDS = {
    "run": "run --tol 0.1 --nl {nl:.4f} --out {place}/out",
    "watch": "run --watch {place}/mine.toml --out {place}/out",
    "calibrate": "calibrate {unit} {place}/weights.csv --out {place}/unit.toml",
    "study": "study {place}/many.toml --out {place}/study --processes 1",
}
"""What is interrupted, by a name."""
LATEST = {"run": 1.0, "watch": 1.5, "calibrate": 0.4, "study": 1.0}
"""The last moment at which a command is interrupted, from its start, over the time that a run takes [1]."""


@dataclass(frozen=True, kw_only=True)
class Ended:
    """How a command ended: its exit code, None where it was over before the signal, and its fault, if any."""

    code: int | None
    fault: str


def interrupted(name: str, number: int, moment: float, unit: Path, place: Path) -> Ended:
    """Send a signal to a command at a moment [s] from its start, and look at what it left."""
    temporary = place / "tmp"
    temporary.mkdir(parents=True)
    (place / "mine.toml").write_text('name = "mine"\n', encoding="utf-8")
    (place / "many.toml").write_text(STUDY, encoding="utf-8")
    if name in ("run", "watch"):
        shutil.copytree(unit, place / "out")
    before = whole_report(place / "out") if name in ("run", "watch") else None
    (place / "weights.csv").write_text(WEIGHTS, encoding="utf-8")
    words = COMMANDS[name].format(place=place, unit=unit, nl=0.04 + 1e-4 * moment)
    environment = {**os.environ, **ONE_THREAD, "TMPDIR": str(temporary)}
    with subprocess.Popen(
        [sys.executable, "-m", "pipeline", *words.split()],
        cwd=ROOT,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        start_new_session=True,
    ) as process:
        with suppress(subprocess.TimeoutExpired):
            process.wait(moment)
            return Ended(code=None, fault="")
        # A terminal sends Ctrl-C to workers too; a supervisor ends the command.
        if number == signal.SIGINT:
            os.killpg(process.pid, number)
        else:
            process.send_signal(number)
        start = time.monotonic()
        _, said = process.communicate(timeout=SECONDS)
    return Ended(code=process.returncode, fault=_fault(name, number, process.returncode, said, start, before, place))


def _fault(name: str, number: int, code: int, said: str, start: float, before: bytes | None, place: Path) -> str:
    """Return the fault of how a command ended, or of what it left; empty where there is none."""
    took = time.monotonic() - start
    is_answered = code in (PASSED, FAILED) and took < LAST_S
    if is_answered or (code == -number and not said):  # before Python began; a shell says 128 and the number
        code = 128 + number
    if code != 128 + number:
        return f"exit code {code}: {said.strip()[-300:]}"
    if "Traceback" in said or "resource_tracker" in said or said.count("pipeline: interrupted") > 1:
        return f"said {said.strip()[-300:]}"
    if took > AT_ONCE_S:
        return f"ended {took:.0f} s after the signal"
    kept = {"tmp", "mine.toml", "many.toml", "weights.csv", "out", "unit.toml", "study"}
    left = {path.name for path in place.iterdir()} - kept
    left |= {path.name for path in (place / "tmp").iterdir()}
    if left:
        return f"left behind: {', '.join(sorted(left))}"
    if before is not None and whole_report(place / "out") is None:
        return "the outputs are not whole"
    store = place / "study" / "study.sqlite"
    if name == "study" and store.is_file():
        with closing(sqlite3.connect(store)) as connection:
            (state,) = connection.execute("PRAGMA integrity_check").fetchone()
        return "" if state == "ok" else f"study.sqlite: {state}"
    return ""


def main() -> int:
    """Send the signals and print how the commands ended."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=40, help="how many of each signal")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job inherits that it is ignored
    rng = random.Random(asked.seed)
    faults = sent = 0
    with suppress(KeyboardInterrupt), tempfile.TemporaryDirectory() as folder:
        unit = Path(folder) / "paper"
        start = time.monotonic()
        subprocess.run(
            [sys.executable, "-m", "pipeline", "run", "--tol", "0.1", "--out", str(unit)],
            cwd=ROOT,
            stdout=subprocess.DEVNULL,
            check=False,
        )
        pace = time.monotonic() - start
        for number in (signal.SIGINT, signal.SIGTERM):
            count = 0
            while count < asked.count:
                name = list(COMMANDS)[count % len(COMMANDS)]
                moment = rng.uniform(0.0, LATEST[name] * pace)
                place = Path(folder) / f"{number:d}-{sent}"
                ended = interrupted(name, number, moment, unit, place)
                sent += 1
                count += ended.code is not None
                faults += bool(ended.fault)
                outcome = "over before" if ended.code is None else ended.fault or f"exit code {ended.code}"
                print(f"{name}, {number.name} at {moment:.2f} s: {outcome}", flush=True)
                shutil.rmtree(place)
    print(f"{sent} signals, {faults} with a fault")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
