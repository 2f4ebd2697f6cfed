"""Wall-clock time, CPU time and peak memory of the command, compared with only importing its libraries."""

import statistics
import sys
import tempfile
from pathlib import Path

from benchmarks.harness import ROOT, section
from benchmarks.usage import ONE_THREAD, ResourceUsage, resource_usage

IMPORTS = [sys.executable, "-c", "import cadquery, gmsh, skfem"]
PAPER = ["run", "--nl", "0.05"]
LOOK = ["run", "--look", "--nl", "0.05"]
COMMANDS = {
    "cold": PAPER,
    "unchanged": PAPER,
    "another --nl": ["run", "--nl", "0.06"],
    "look, cold": LOOK,
    "look, another --nl": ["run", "--look", "--nl", "0.06"],
    "design, cold": ["design", "--nl", "0.05"],
}
"""The measured commands. Those of one kind run in turn with one folder and one cache, both empty at first."""
KINDS = {"look, cold": "look", "look, another --nl": "look", "design, cold": "design"}

REPEATS = 3


def command_section(repeats: int = REPEATS) -> str:
    """Return a table of the time and memory that the imports and each command take, as medians of several repeats."""
    usages = _measure_usages(repeats)
    bare = [statistics.median(getattr(usage, key) for usage in usages["bare imports"]) for key in ("wall", "cpu")]
    rows = []
    for label, repeated in usages.items():
        wall, cpu = (statistics.median(getattr(usage, key) for usage in repeated) for key in ("wall", "cpu"))
        peak = max(usage.peak_MiB for usage in repeated)
        failed = [
            f"exit code {usage.exit_code}: {usage.last_line}" for usage in repeated if usage.exit_code not in (0, 1)
        ]
        numbers = [f"{value:.3g}" for value in (wall, cpu, wall / bare[0], cpu / bare[1], peak)]
        rows.append([label, *numbers, "; ".join(failed)])
    heads = ["run", "wall s", "CPU s", "wall / imports", "CPU / imports", "peak MiB", "remark"]
    notes = [
        f"Runs write all files. The bare imports are `python -c '{IMPORTS[-1]}'`. A look is `pipeline run --look`.",
        f"The numbers are medians of {repeats} runs. Memory is the peak of the largest process.",
    ]
    return section("Whole command", heads, rows, notes)


def _measure_usages(repeats: int) -> dict[str, list[ResourceUsage]]:
    """Return the usages of the bare imports and of each command by name, one for each repeat."""
    usages: dict[str, list[ResourceUsage]] = {name: [] for name in ("bare imports", *COMMANDS)}
    resource_usage(IMPORTS)  # not counted, because it fills the page cache
    for _ in range(repeats):
        usages["bare imports"].append(resource_usage(IMPORTS, environment=ONE_THREAD))
        with tempfile.TemporaryDirectory() as name:
            for label, arguments in COMMANDS.items():
                folder = Path(name) / KINDS.get(label, "run")
                environment = {**ONE_THREAD, "XDG_CACHE_HOME": str(folder / "cache")}
                command = [sys.executable, "-m", "twintip", *arguments, "--out", str(folder / "out")]
                usages[label].append(resource_usage(command, ROOT, environment))
    return usages
