"""Wall and processor time of the whole command against the bare imports of what it uses, and its peak memory."""

import statistics
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipeline.bench.command.stages import ColdRun, bare_works, stage_sheet, stages_of
from pipeline.bench.resources import ONE_THREAD, ResourceUsage, resource_usage
from pipeline.bench.table import Sheet, record_sheet

IMPORTS = "import cadquery, gmsh, skfem"
OUR_IMPORTS = {"our imports": "import pipeline.run", "those of the modeller": "import pipeline.storage.modeller.tasks"}
REPEATS = 3
PEAK_GOAL_MIB = 2048.0
_LEAST_S = 0.01  # of a stage that is named
_DONE = (0, 1)  # exit codes of a run that wrote its outputs
_ROOT = str(Path(__file__).parents[3])


@dataclass(frozen=True, kw_only=True)
class CommandRun:
    """One way to call the command, and the project's goals for its seconds over those of the imports [1].

    `place` names its cache and its output folder: runs of one place come after each other.
    """

    words: tuple[str, ...]
    place: str
    wall_goal: float | None = None
    cpu_goal: float | None = None


_PAPER = ("run", "--nl", "0.05")
RUNS = {
    "cold": CommandRun(words=_PAPER, place="run", wall_goal=1.8, cpu_goal=2.4),
    "unchanged": CommandRun(words=_PAPER, place="run", wall_goal=0.3, cpu_goal=0.3),
    "another --nl": CommandRun(words=("run", "--nl", "0.06"), place="run", wall_goal=1.8, cpu_goal=1.8),
    "design, cold": CommandRun(words=("design", "--nl", "0.05"), place="design"),
}


def command_sheets(repeats: int = REPEATS) -> list[Sheet]:
    """Return what the imports and every way to call the command cost, and what the stages of a cold run do.

    Seconds [s] are medians, memory [MiB] is that of the largest process. A first import that is not counted warms the
    page cache; each repeat has empty caches of its own. The remark of a run that solved has the processor seconds of
    its stages [s], of the last repeat.
    """
    usages, outs = _measured(repeats)
    remarks = {name: _in_words(seconds) for name, (seconds, _) in outs.items() if name != "unchanged"}
    baseline = usages["bare imports"]
    records = tuple(_record(name, repeated, baseline, remarks) for name, repeated in usages.items())
    notes = (
        f"pipeline run --nl 0.05 with all its files beside python -c '{IMPORTS}'; median of {repeats}; one thread",
        f"memory of the largest process; goal {PEAK_GOAL_MIB:.0f} MiB",
        goals_note(records),
    )
    sheet = record_sheet("command", "Whole command", records, notes, digits=3)
    if "cold" not in outs:
        return [sheet]
    stages, pictures = outs["cold"]
    imports = sum(usages[name][-1].cpu for name in OUR_IMPORTS)
    run = ColdRun(imports=imports, stages=stages, whole=usages["cold"][-1].cpu)
    return [sheet, stage_sheet(run, bare_works(pictures, _ROOT))]


def goals_note(records: Sequence[Mapping[str, str | float]]) -> str:
    """Say which goals are missed by the rows of the table, each with its value."""
    missed = []
    for record in records:
        goals = ("wall / imports", record["goal"]), ("CPU / imports", record["CPU goal"]), ("peak MiB", PEAK_GOAL_MIB)
        for name, goal in goals:
            if goal != "-" and float(record[name]) > float(goal):
                missed.append(f"{record['run']}: {name} {float(record[name]):.3g} for {float(goal):g}")
    return f"missed goals: {'; '.join(missed)}" if missed else "missed goals: none"


def _measured(repeats: int) -> tuple[dict[str, list[ResourceUsage]], dict[str, tuple[dict[str, float], int]]]:
    """Return what each program used every time; by run its stages [s] and pictures, where it has a report."""
    programs = {"bare imports": IMPORTS, **{name: _of_ours(program) for name, program in OUR_IMPORTS.items()}}
    usages: dict[str, list[ResourceUsage]] = {name: [] for name in (*programs, *RUNS)}
    outs: dict[str, tuple[dict[str, float], int]] = {}
    resource_usage([sys.executable, "-c", IMPORTS])
    for _ in range(repeats):
        for name, program in programs.items():
            usages[name].append(resource_usage([sys.executable, "-c", program], environment=ONE_THREAD))
        with tempfile.TemporaryDirectory() as folder:
            for name, run in RUNS.items():
                usages[name].append(_run(Path(folder), run))
                out = Path(folder) / run.place / "out"
                if (out / "report.json").is_file():
                    outs[name] = stages_of(out)
    return usages, outs


def _record(
    name: str, usages: Sequence[ResourceUsage], baseline: Sequence[ResourceUsage], stages: Mapping[str, str]
) -> dict[str, str | float]:
    failed = [f"exit code {usage.exit_code}: {usage.last_line}" for usage in usages if usage.exit_code not in _DONE]
    wall, cpu = (statistics.median(values) for values in _seconds(usages))
    bare_wall, bare_cpu = (statistics.median(values) for values in _seconds(baseline))
    run = RUNS.get(name, CommandRun(words=(), place=""))
    return {
        "run": name,
        "wall s": wall,
        "CPU s": cpu,
        "wall / imports": wall / bare_wall,
        "goal": _goal(run.wall_goal),
        "CPU / imports": cpu / bare_cpu,
        "CPU goal": _goal(run.cpu_goal),
        "peak MiB": max(usage.peak_MiB for usage in usages),
        "remark": failed[0] if failed else stages.get(name, ""),
    }


def _seconds(usages: Sequence[ResourceUsage]) -> tuple[list[float], list[float]]:
    return [usage.wall for usage in usages], [usage.cpu for usage in usages]


def _goal(goal: float | None) -> str | float:
    return "-" if goal is None else goal


def _in_words(seconds: Mapping[str, float]) -> str:
    """Return the processor seconds of the dearer stages of a run in words."""
    dearer = sorted((stage for stage in seconds if seconds[stage] >= _LEAST_S), key=seconds.__getitem__, reverse=True)
    return ", ".join(f"{stage} {seconds[stage]:.2f}" for stage in dearer)


def _of_ours(program: str) -> str:
    """Return a program that finds this project wherever it is started."""
    return f"import sys; sys.path.insert(0, {_ROOT!r})\n{program}"


def _run(folder: Path, run: CommandRun) -> ResourceUsage:
    """Run the command with its cache and outputs in its place in a folder, where they stay."""
    place = folder / run.place
    place.mkdir(exist_ok=True)
    words = [*run.words, "--out", str(place / "out")]
    program = _of_ours(f"from pipeline.cli import main\nsys.exit(main({words!r}))")
    environment = {**ONE_THREAD, "XDG_CACHE_HOME": str(place / "cache")}
    return resource_usage([sys.executable, "-c", program], place, environment)
