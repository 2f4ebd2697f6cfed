"""Memory: what a factorised matrix takes, and what this process may still take."""

import math
import resource
from pathlib import Path

# 14 bytes for each nonzero of a factor, of which there are about 31 n^(4/3): bricks of a housing at 1e5 unknowns.
# Tetrahedra of a fruit have 19 at 2e5 and 50 at 3e4, where it does not matter.
_BYTES = 14.0 * 31.0
_LIMITS = ((resource.RLIMIT_AS, "VmSize"), (resource.RLIMIT_DATA, "VmData"))
_OF_CONTAINERS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")


def factor_bytes(unknowns: int) -> float:
    """Return about how much memory a factorised matrix takes [byte], by its unknowns [1]."""
    return _BYTES * math.pow(unknowns, 4.0 / 3.0)


def free_bytes() -> float:
    """Return how much memory this process may still take [byte]: of the machine, its container and its own limits."""
    used = _kilobytes("/proc/self/status")
    rooms = [_kilobytes("/proc/meminfo")["MemAvailable"]]
    for kind, key in _LIMITS:
        limit, _ = resource.getrlimit(kind)
        if limit != resource.RLIM_INFINITY:
            rooms.append(limit - used[key])
    for name in _OF_CONTAINERS:
        text = Path(name).read_text(encoding="ascii").strip() if Path(name).is_file() else ""
        if text.isdecimal():
            rooms.append(int(text) - used["VmRSS"])
    return float(min(rooms))


def _kilobytes(name: str) -> dict[str, int]:
    """Return the sizes in a table of the kernel by their names [byte]."""
    rows = (line.split() for line in Path(name).read_text(encoding="utf-8", errors="replace").splitlines())
    return {row[0].rstrip(":"): 1024 * int(row[1]) for row in rows if row[2:] == ["kB"]}
