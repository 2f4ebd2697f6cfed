"""A check in a process of its own, with limits of memory and time: a hostile file ends that process and no other."""

import ctypes
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

from cad.quantity import InputError
from cad.verdict import Verdict, failed
from pipeline.limits import lower_limit
from pipeline.storage.interruption import interruptible

SECONDS = 50  # of wall time: whole folders take some seconds
MEMORY_BYTES = 3 << 30  # of data of the process: a check needs less than 1 GiB
_PROGRAM = (
    "import sys; sys.path[:] = {path!r}; from pipeline.report.check.limited_check import work; work(sys.argv[1:])"
)
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
_DIES_WITH_PARENT = 1  # PR_SET_PDEATHSIG of prctl(2)


def verdicts_apart(path: Path, process: str | None) -> tuple[Verdict, ...]:
    """Return the verdicts on a file by the rules of a process, or on an output folder without one.

    A process that dies over it leaves the verdicts that it had, and the failed verdict geometry.readable with the
    reason. Raises InputError as the check does.
    """
    with interruptible(), tempfile.TemporaryDirectory(prefix="twintip-") as folder:
        words = [str(path), *([] if process is None else [process])]
        answer, reason = _answer_of(words, Path(folder))
    lines = [json.loads(line) for line in answer.splitlines(keepends=True) if line.endswith(b"\n")]
    for line in lines:
        if "refused" in line:
            raise InputError(line["refused"])
    verdicts = tuple(Verdict(**line["verdict"]) for line in lines if "verdict" in line)
    if any("done" in line for line in lines):
        return verdicts
    died = " ".join(f"reading {path.name} {reason}; export it again".split())
    return (*verdicts, failed("geometry.readable", "a readable file", unit="1", reference=died))


def _answer_of(words: list[str], folder: Path) -> tuple[bytes, str]:
    """Return what a process with these words wrote, and how it died; its temporary files are in the folder."""
    with (folder / "stderr").open("w+b") as errors:
        child = subprocess.Popen(
            [sys.executable, "-I", "-W", "ignore", "-c", _PROGRAM.format(path=sys.path), *words],
            env={**os.environ, **_ONE_THREAD, "TMPDIR": str(folder)},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=errors,
            process_group=0,
        )
        answer, reason = _ended(child)
        errors.seek(0)
        last = errors.read().decode(errors="replace").strip().splitlines()[-1:]
    return answer, reason or f"failed ({''.join(last)[:200]})"


def _ended(child: subprocess.Popen[bytes]) -> tuple[bytes, str]:
    """Return what a process wrote, and by what it was ended; nothing where it ended of itself."""
    reason = ""
    try:
        answer, _ = child.communicate(timeout=SECONDS)
    except subprocess.TimeoutExpired:
        reason = f"took more than {SECONDS} s"
    finally:
        with suppress(ProcessLookupError):
            os.killpg(child.pid, signal.SIGKILL)  # what it started too
    if reason:
        answer, _ = child.communicate()
    elif child.returncode < 0:
        reason = f"ended the process by {signal.Signals(-child.returncode).name}"
    return answer, reason


def work(words: list[str]) -> None:
    """Check a path in this process, with limits, and write each verdict as a line of JSON to stdout."""
    ctypes.CDLL(None).prctl(_DIES_WITH_PARENT, signal.SIGKILL)
    for kind, most in ((resource.RLIMIT_DATA, MEMORY_BYTES), (resource.RLIMIT_CORE, 0), (resource.RLIMIT_CPU, SECONDS)):
        lower_limit(kind, most)
    with os.fdopen(os.dup(1), "w", encoding="ascii") as channel:
        os.dup2(2, 1)  # what libraries print is no answer
        try:
            for verdict in _verdicts(Path(words[0]), *words[1:]):
                print(json.dumps({"verdict": asdict(verdict)}), file=channel, flush=True)
        except InputError as error:
            print(json.dumps({"refused": str(error)}), file=channel, flush=True)
        print(json.dumps({"done": True}), file=channel, flush=True)


def _verdicts(path: Path, process: str | None = None) -> Iterator[Verdict]:
    from cad.checks.part_checks import check_file
    from cad.design.processes import PROCESSES
    from pipeline.report.check.folder_check import folder_verdicts

    if process is None:
        yield from folder_verdicts(path)
    else:
        yield from check_file(path, PROCESSES[process])
