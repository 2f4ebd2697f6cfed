"""What a program uses: wall and processor seconds and peak memory of a child process, on one thread if asked."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
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
    """Exit code and text of a program; wall and CPU seconds [s] with its children, memory [MiB] of the largest."""

    exit_code: int
    wall: float
    cpu: float
    peak_MiB: float
    out: str
    err: str

    @property
    def last_line(self) -> str:
        """Return the last line on stderr, or on stdout where that is empty."""
        lines = (self.err.strip() or self.out.strip()).splitlines()
        return lines[-1] if lines else "nothing printed"


def resource_usage(
    command: Sequence[str],
    folder: Path | None = None,
    environment: Mapping[str, str] | None = None,
    *,
    deadline: float = 0.0,
) -> ResourceUsage:
    """Run a program to its end and return what it used; `environment` is added to this process's own.

    One that is at work after `deadline` [s] is killed; 0 waits for ever.

    A small launcher stands between, as a child starts with the peak memory of the process that forks it. Raises
    OSError when the program does not start.
    """
    with tempfile.TemporaryDirectory() as name:
        record = Path(name) / "usage.json"
        launcher = subprocess.run(
            [sys.executable, "-I", "-S", "-c", _LAUNCHER, str(record), str(deadline), *command],
            cwd=folder,
            env={**os.environ, **(environment or {})},
            capture_output=True,
            check=False,
        )
        out, err = (text.decode(errors="replace") for text in (launcher.stdout, launcher.stderr))
        if not record.is_file():
            msg = f"program {command[0]!r}: must start; it says {err.strip()!r}; install it"
            raise OSError(msg)
        usage = json.loads(record.read_text(encoding="ascii"))
    return ResourceUsage(**usage, out=out, err=err)
