"""What a program costs: wall and processor seconds and peak memory of a child process, on one thread if asked."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
_KIB_PER_MIB = 1024.0
_LAUNCHER = """
import os, sys, time
start = time.perf_counter()
child = os.posix_spawnp(sys.argv[2], sys.argv[2:], os.environ)
_, status, used = os.wait4(child, 0)
wall = time.perf_counter() - start
with open(sys.argv[1], "w") as told:
    print(os.waitstatus_to_exitcode(status), wall, used.ru_utime + used.ru_stime, used.ru_maxrss, file=told)
"""


@dataclass(frozen=True, kw_only=True)
class Cost:
    """Exit code, wall and CPU seconds of a program and what it waited for, memory [MiB] of its largest process."""

    code: int
    wall: float
    cpu: float
    peak_MiB: float
    out: str
    err: str

    @property
    def last_error(self) -> str:
        """Return the last line on stderr, or on stdout where that is empty."""
        lines = (self.err.strip() or self.out.strip()).splitlines()
        return lines[-1] if lines else "nothing printed"


def cost_of(command: Sequence[str], folder: Path | None = None, environment: Mapping[str, str] | None = None) -> Cost:
    """Run a program to its end and return its cost; `environment` is added to this process's own.

    A child starts with the peak memory of the process that forks it: a small launcher stands between.
    """
    with tempfile.TemporaryDirectory() as aside:
        told = Path(aside) / "used"
        done = subprocess.run(
            [sys.executable, "-I", "-S", "-c", _LAUNCHER, str(told), *command],
            cwd=folder,
            env={**os.environ, **(environment or {})},
            capture_output=True,
            check=False,
        )
        words = told.read_text(encoding="ascii").split() if told.is_file() else []
    if len(words) != 4:  # noqa: PLR2004 - what the launcher tells
        msg = (
            f"program {command[0]!r}: must start; it says {done.stderr.decode(errors='replace').strip()!r}; install it"
        )
        raise OSError(msg)
    wall, cpu, peak = (float(word) for word in words[1:])
    return Cost(
        code=int(words[0]),
        wall=wall,
        cpu=cpu,
        peak_MiB=peak / _KIB_PER_MIB,
        out=done.stdout.decode(errors="replace"),
        err=done.stderr.decode(errors="replace"),
    )


def module_cost(module: str, *arguments: str) -> Cost:
    """Return the cost of one of our modules run as a program in a fresh interpreter on one thread."""
    root = str(Path(__file__).parents[2])
    paths = os.pathsep.join(filter(None, (root, os.environ.get("PYTHONPATH", ""))))
    return cost_of([sys.executable, "-m", module, *arguments], environment={**ONE_THREAD, "PYTHONPATH": paths})
