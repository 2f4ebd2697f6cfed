"""The table of error bars as tests take it: groups of cases, of which some are slow and most are a study."""

from marks import cases_by_time

from benchmarks.bars.check import case_outcome
from benchmarks.bars.table import CASES

QUICK = (
    "level press: ", "press: tilt 21 deg", "paper: the default", "paper: nu 0.45", "contact: tip 10 mm on the paper",
    "curved body: rigid tips", "curved body: along the normals", "skin: block", "cube on a skin: ",
    "domes: ", "domes beside solids: ", "leaf: L/t 1.2", "springs: ", "design: E_max", "clamp: ",
    "moved nodes: inner ones by 0.3",
)  # fmt: skip
SLOW = (
    "contact: 12 mm wide", "curved body: rigid tips,", "curved body: along the normals,", "curved body: solid egg",
    "skin: ball", "press beside direct elements: ", "compression: ", "bench: ",
)  # fmt: skip


def bars(*groups):
    """Return the names of the cases of some groups as parameters of a test."""
    names = [name for name in CASES if name.partition(":")[0] in groups]
    slow = [name for name in names if name.startswith(SLOW)]
    studies = [name for name in names if not name.startswith((*SLOW, *QUICK))]
    return cases_by_time(names, slow=slow, studies=studies)


def holds(name):
    """Fail unless a case is right within its bar, or is refused as it may be."""
    found = case_outcome(*CASES[name])
    assert found.verdict != "WRONG", f"{found.reason}: {found.check}"
