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
# The measured commands. Commands of one kind run in turn with one output folder and one cache, both empty at first.
COMMANDS = {
    "cold": PAPER,
    "unchanged": PAPER,
    "another --nl": ["run", "--nl", "0.06"],
    "look, cold": LOOK,
    "look, another --nl": ["run", "--look", "--nl", "0.06"],
    "design, cold": ["design", "--nl", "0.05"],
}
KINDS = {"look, cold": "look", "look, another --nl": "look", "design, cold": "design"}  # all others have the kind "run"
BARE_IMPORTS = "bare imports"  # label of the row with which all commands are compared
REPEATS = 3


def command_section(repeats: int = REPEATS) -> str:
    """Return a table of the time and memory that the imports and each command take, as Markdown.

    The times are medians of several `repeats`. A command that ends with an error instead of verdicts has a remark with
    its exit code.
    """
    usages = _measure_usages(repeats)
    import_wall, import_cpu = _median_times(usages[BARE_IMPORTS])
    rows = []
    for label, repeated in usages.items():
        wall, cpu = _median_times(repeated)
        peak = max(usage.peak_MiB for usage in repeated)
        # Exit code 1 means that a verdict failed, which is a valid run.
        failed = [
            f"exit code {usage.exit_code}: {usage.last_line}" for usage in repeated if usage.exit_code not in (0, 1)
        ]
        numbers = [f"{value:.3g}" for value in (wall, cpu, wall / import_wall, cpu / import_cpu, peak)]
        rows.append([label, *numbers, "; ".join(failed)])
    heads = ["run", "wall s", "CPU s", "wall / imports", "CPU / imports", "peak MiB", "remark"]
    notes = [
        f"Runs write all files. The bare imports are `python -c '{IMPORTS[-1]}'`. A look is `pipeline run --look`.",
        f"The numbers are medians of {repeats} runs. Memory is the peak of the largest process.",
    ]
    return section("Whole command", heads, rows, notes)


def _median_times(repeated: list[ResourceUsage]) -> tuple[float, float]:
    """Return the medians of the wall-clock time and of the CPU time of repeated runs [s]."""
    wall = statistics.median(usage.wall for usage in repeated)
    cpu = statistics.median(usage.cpu for usage in repeated)
    return wall, cpu


def _measure_usages(repeats: int) -> dict[str, list[ResourceUsage]]:
    """Run the bare imports and all commands several times, and return their usages by label, one for each repeat.

    Each repeat starts with empty folders and caches. All processes run on one thread.
    """
    usages: dict[str, list[ResourceUsage]] = {label: [] for label in (BARE_IMPORTS, *COMMANDS)}
    resource_usage(IMPORTS)  # not counted, because it fills the page cache
    for _ in range(repeats):
        usages[BARE_IMPORTS].append(resource_usage(IMPORTS, environment=ONE_THREAD))
        with tempfile.TemporaryDirectory() as name:
            for label, arguments in COMMANDS.items():
                folder = Path(name) / KINDS.get(label, "run")
                environment = {**ONE_THREAD, "XDG_CACHE_HOME": str(folder / "cache")}
                command = [sys.executable, "-m", "twintip", *arguments, "--out", str(folder / "out")]
                usages[label].append(resource_usage(command, ROOT, environment))
    return usages
