"""Wall-clock time, CPU time and peak memory of a child process, and the environment that keeps it on one thread."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

# Environment variables that keep a program on one thread.
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
# The launcher runs a command, kills it after a deadline, and writes its usage into a file: FILE DEADLINE COMMAND ...
_LAUNCHER = """
import json, os, signal, sys, time
start = time.perf_counter()
child = os.posix_spawnp(sys.argv[3], sys.argv[3:], os.environ)
signal.signal(signal.SIGALRM, lambda *_: os.kill(child, signal.SIGKILL))
signal.setitimer(signal.ITIMER_REAL, float(sys.argv[2]))
_, status, used = os.wait4(child, 0)
usage = {"exit_code": os.waitstatus_to_exitcode(status), "wall": time.perf_counter() - start,
         "cpu": used.ru_utime + used.ru_stime, "peak_MiB": used.ru_maxrss / 1024.0}
with open(sys.argv[1], "w") as file:
    json.dump(usage, file)
"""


@dataclass(frozen=True, kw_only=True)
class ResourceUsage:
    """The exit code and output of a program, its wall-clock and CPU time [s], and its peak memory [MiB].

    CPU time includes children. The peak memory is the memory of the largest process.
    """

    exit_code: int
    wall: float
    cpu: float
    peak_MiB: float
    out: str
    err: str

    @property
    def last_line(self) -> str:
        """Return the last line on stderr, or on stdout if stderr is empty."""
        lines = (self.err.strip() or self.out.strip()).splitlines()
        return lines[-1] if lines else "nothing printed"


def resource_usage(
    command: Sequence[str],
    folder: Path | None = None,
    environment: Mapping[str, str] | None = None,
    *,
    deadline: float = 0.0,
) -> ResourceUsage:
    """Run a program in a `folder` and return its usage; `environment` is added to the environment of this process.

    The program is killed after `deadline` [s]; 0 means no deadline. It is started by a small launcher, because a forked
    child inherits the peak memory of its parent. Raises OSError if the program does not start.
    """
    with tempfile.TemporaryDirectory() as temporary_folder:
        record = Path(temporary_folder) / "usage.json"
        # The options -I and -S keep the launcher small, because Python then ignores all installed packages.
        launcher = subprocess.run(
            [sys.executable, "-I", "-S", "-c", _LAUNCHER, str(record), str(deadline), *command],
            cwd=folder,
            env={**os.environ, **(environment or {})},
            capture_output=True,
            check=False,
        )
        out, err = (text.decode(errors="replace") for text in (launcher.stdout, launcher.stderr))
        if not record.is_file():
            msg = f"The program {command[0]!r} does not start: {err.strip()!r}. Install it."
            raise OSError(msg)
        usage = json.loads(record.read_text(encoding="ascii"))
    return ResourceUsage(**usage, out=out, err=err)
