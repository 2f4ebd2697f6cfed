"""What each stage of a cold run costs beside its bare work, both measured in one bench."""

import json
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from cad.quantity import validation_error
from pipeline.bench.command.bare_work import BareWork
from pipeline.bench.resources import ONE_THREAD, resource_usage
from pipeline.bench.table import Sheet, record_sheet

LIBRARIES = "import OCP, gmsh, skfem"
MODULE = "pipeline.bench.command.bare_work"
PICTURE = '<svg class="picture"'  # as the page has each of its pictures
NOTES = (
    "of the last cold run above; at best is measured in the same bench: the bare work that a stage cannot leave out, "
    "done again by itself, the least of three; meshes, assembly, checks and files are on top of it",
    "imports are those of both processes of a run; page is all that comes after the stages: report.html, report.json "
    "and the other files",
)
HEADS = ("stage", "CPU s", "CPU s at best", "ratio", "at best it is")


@dataclass(frozen=True, kw_only=True)
class ColdRun:
    """CPU seconds [s] of a cold run: of the imports, of each stage and `total` of all stages, and of the whole."""

    imports: float
    stages: Mapping[str, float]
    whole: float

    def parts(self) -> dict[str, float]:
        """Return the seconds of the imports, the stages, and what comes after them [s]."""
        stages = {stage: seconds for stage, seconds in self.stages.items() if stage != "total"}
        between = self.stages["total"] - sum(stages.values())
        after = self.whole - self.imports - self.stages["total"]
        return {"imports": self.imports, **stages, "between the stages": between, "page": after}


def stages_of(out: Path) -> tuple[dict[str, float], int]:
    """Return the CPU seconds of the stages of a finished run [s], and how many pictures its page has."""
    seconds = json.loads((out / "report.json").read_bytes())["cpu_seconds"]
    page = out / "report.html"
    return seconds, page.read_text(encoding="utf-8").count(PICTURE) if page.is_file() else 0


def bare_works(pictures: int, root: str) -> list[BareWork]:
    """Return the bare work of a cold run of the project in a folder; raises InputError when it does not end well."""
    imports = resource_usage([sys.executable, "-c", LIBRARIES], environment=ONE_THREAD)
    with tempfile.TemporaryDirectory() as cache:
        command = [sys.executable, "-m", MODULE, str(pictures)]
        usage = resource_usage(command, environment={**ONE_THREAD, "XDG_CACHE_HOME": cache, "PYTHONPATH": root})
    for ended in (imports, usage):
        if ended.exit_code:
            bound = f"0; it says: {ended.last_line}"
            raise validation_error(MODULE, f"exit code {ended.exit_code}", "", bound, "run pipeline doctor")
    of_imports = BareWork(stage="imports", cpu=imports.cpu, what=f"python -c '{LIBRARIES}'")
    return [of_imports, *(BareWork(**work) for work in json.loads(usage.out))]


def stage_sheet(run: ColdRun, bare: Sequence[BareWork]) -> Sheet:
    """Return the table of the stages that have a bare work, the others in one row, and all together."""
    parts = run.parts()
    stages = sorted(((parts.pop(work.stage, 0.0), work) for work in bare), key=lambda stage: -stage[0])
    records = [_record(work.stage, cpu, work.cpu, work.what) for cpu, work in stages]
    others = ", ".join(stage for stage, seconds in parts.items() if seconds > 0.0)
    records.append(dict(zip(HEADS, (f"others: {others}", sum(parts.values()), "-", "-", "-"), strict=True)))
    at_best = sum(work.cpu for work in bare)
    records.append(_record("all", run.whole, at_best, "all of these one after the other"))
    return record_sheet("stages", "Stages of a cold run", records, NOTES, digits=2)


def _record(stage: str, cpu: float, at_best: float, what: str) -> dict[str, str | float]:
    return dict(zip(HEADS, (stage, cpu, at_best, cpu / at_best, what), strict=True))
