"""Wall time of the whole command against the bare imports of what it uses, and its peak memory."""

import statistics
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pipeline.bench.resources import Cost, cost_of

IMPORTS = "import cadquery, gmsh, skfem"
REPEATS = 3
# The goals of the project for the ratio to the imports.
GOALS = {"cold": 5.0, "unchanged": 1.5, "another --nl": 3.0}
PEAK_GOAL_MIB = 2048.0
_DONE = (0, 1)  # exit codes of a run that wrote its outputs


@dataclass(frozen=True, kw_only=True)
class CommandCost:
    """One way to call the command: medians of wall seconds and CPU seconds, ratio to the imports, peak memory [MiB].

    `failure` is the last line of a run that did not end well.
    """

    name: str
    wall: float
    cpu: float
    ratio: float
    peak_MiB: float
    failure: str = ""


def command_costs(repeats: int = REPEATS) -> tuple[CommandCost, ...]:
    """Return the imports, a run with an empty cache, the same run again, and a run with another nonlinearity.

    A first import that is not counted warms the page cache; each repeat has an empty cache of its own.
    """
    cost_of([sys.executable, "-c", IMPORTS])
    imports = [cost_of([sys.executable, "-c", IMPORTS]) for _ in range(repeats)]
    runs: dict[str, list[Cost]] = {name: [] for name in GOALS}
    for _ in range(repeats):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            for kind, nl in zip(GOALS, ("0.05", "0.05", "0.06"), strict=True):
                runs[kind].append(_run(folder, ["--nl", nl]))
    bare = _median("bare imports", imports, None)
    return bare, *(_median(name, costs, bare.wall) for name, costs in runs.items())


def _run(folder: Path, flags: Sequence[str]) -> Cost:
    """Run the command with its cache and outputs in a folder, where it stays."""
    main = f"import sys; sys.path.insert(0, {str(Path(__file__).parents[2])!r})\nfrom pipeline.cli import main\n"
    words = ["run", *flags, "--out", str(folder / "out")]
    program = f"{main}sys.exit(main({words!r}))"
    return cost_of([sys.executable, "-c", program], folder, {"XDG_CACHE_HOME": str(folder / "cache")})


def _median(name: str, costs: Sequence[Cost], bare: float | None) -> CommandCost:
    wall = statistics.median(cost.wall for cost in costs)
    failed = [cost for cost in costs if cost.code not in _DONE]
    return CommandCost(
        name=name,
        wall=wall,
        cpu=statistics.median(cost.cpu for cost in costs),
        ratio=1.0 if bare is None else wall / bare,
        peak_MiB=max(cost.peak_MiB for cost in costs),
        failure=f"exit code {failed[0].code}: {failed[0].last_error}" if failed else "",
    )
