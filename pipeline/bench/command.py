"""Wall time of the whole command against the bare imports of what it uses, and its peak memory."""

import statistics
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from pipeline.bench.resources import ResourceUsage, resource_usage
from pipeline.bench.table import Sheet

IMPORTS = "import cadquery, gmsh, skfem"
REPEATS = 3
# Each way to call the command: its nonlinearity, and the project's goal for its time over that of the imports.
RUNS = {"cold": ("0.05", 5.0), "unchanged": ("0.05", 1.5), "another --nl": ("0.06", 3.0)}
PEAK_GOAL_MIB = 2048.0
_DONE = (0, 1)  # exit codes of a run that wrote its outputs


def command_sheet(repeats: int = REPEATS) -> Sheet:
    """Return what the imports cost, a run with an empty cache, the same run again, and one with another nonlinearity.

    Seconds [s] are medians, memory [MiB] is that of the largest process. A first import that is not counted warms the
    page cache; each repeat has an empty cache of its own.
    """
    bare = [sys.executable, "-c", IMPORTS]
    resource_usage(bare)
    usages = {"bare imports": [resource_usage(bare) for _ in range(repeats)], **{name: [] for name in RUNS}}
    for _ in range(repeats):
        with tempfile.TemporaryDirectory() as folder:
            for name, (nl, _) in RUNS.items():
                usages[name].append(_run(Path(folder), nl))
    baseline = statistics.median(usage.wall for usage in usages["bare imports"])
    records = tuple(_record(name, repeated, baseline) for name, repeated in usages.items())
    rows = tuple(tuple(f"{v:.3g}" if isinstance(v, float) else v for v in record.values()) for record in records)
    notes = (
        f"pipeline run --nl 0.05 with all its files beside python -c '{IMPORTS}'; median of {repeats}",
        f"memory of the largest process; goal {PEAK_GOAL_MIB:.0f} MiB",
    )
    return Sheet(
        name="command", title="Whole command", heads=tuple(records[0]), rows=rows, notes=notes, records=records
    )


def _record(name: str, usages: Sequence[ResourceUsage], baseline: float) -> dict[str, str | float]:
    failed = [f"exit code {usage.exit_code}: {usage.last_line}" for usage in usages if usage.exit_code not in _DONE]
    wall = statistics.median(usage.wall for usage in usages)
    return {
        "run": name,
        "wall s": wall,
        "CPU s": statistics.median(usage.cpu for usage in usages),
        "ratio to imports": wall / baseline,
        "goal": RUNS[name][1] if name in RUNS else "-",
        "peak MiB": max(usage.peak_MiB for usage in usages),
        "remark": failed[0] if failed else "",
    }


def _run(folder: Path, nl: str) -> ResourceUsage:
    """Run the command with its cache and outputs in a folder, where it stays."""
    words = ["run", "--nl", nl, "--out", str(folder / "out")]
    root = str(Path(__file__).parents[2])
    program = f"import sys; sys.path.insert(0, {root!r})\nfrom pipeline.cli import main\nsys.exit(main({words!r}))"
    return resource_usage([sys.executable, "-c", program], folder, {"XDG_CACHE_HOME": str(folder / "cache")})
