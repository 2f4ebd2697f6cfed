"""The cases of bars.toml, each with the function that computes its checks."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from benchmarks.bars.benches import bench_checks
from benchmarks.bars.check import ReferenceCheck
from benchmarks.bars.compression import ball_checks
from benchmarks.bars.contact import compliance_checks, direct_checks, truth_checks
from benchmarks.bars.curved_body import body_checks
from benchmarks.bars.domes import dome_checks, solid_checks
from benchmarks.bars.press import direct_press_checks, level_checks, press_checks
from benchmarks.bars.skin import cube_checks, skin_checks
from benchmarks.bars.springs import (
    design_checks,
    grounded_checks,
    leaf_checks,
    mount_checks,
    moved_node_checks,
    short_leaf_checks,
)
from benchmarks.bars.truths import BARS, TRUTHS
from sensor.design.fruit import Fruit
from sensor.design.parameters import Targets
from sensor.design.tips import PressMotion, Tips

CHECKS: dict[str, Callable[..., Sequence[ReferenceCheck]]] = {
    "paper": truth_checks,
    "contact": compliance_checks,
    "contact beside direct elements": direct_checks,
    "curved body": body_checks,
    "skin": skin_checks,
    "cube on a skin": cube_checks,
    "level press": level_checks,
    "press": press_checks,
    "press beside direct elements": direct_press_checks,
    "domes": dome_checks,
    "domes beside solids": solid_checks,
    "compression": ball_checks,
    "leaf": leaf_checks,
    "springs": short_leaf_checks,
    "mount": mount_checks,
    "design": design_checks,
    "moved nodes": moved_node_checks,
    "clamp": grounded_checks,
    "bench": bench_checks,
}
TABLES = {"fruit": Fruit, "tips": Tips, "press": PressMotion, "targets": Targets}
MAY_BE_REFUSED = ("contact", "press", "leaf", "design", "moved nodes", "clamp")


def every_case() -> Iterator[tuple[str, Callable[[], Sequence[ReferenceCheck]], bool]]:
    """Yield the name of each case, the function that computes its checks, and whether the case must be answered."""
    for group, check in CHECKS.items():
        for case, changes in BARS[group].items():
            answerable = "bar" in changes or group not in MAY_BE_REFUSED
            yield f"{group}: {case}", partial(run_case, check, changes), answerable


def run_case(check: Callable[..., Sequence[ReferenceCheck]], changes: Mapping[str, Any]) -> Sequence[ReferenceCheck]:
    """Return the checks of a case from its keys in bars.toml; raises InputError if these are no valid design."""
    values = {key: TABLES[key](**value) if key in TABLES else value for key, value in changes.items()}
    if "truth" in values:
        values["truth"] = TRUTHS[values["truth"]]
    widest = values.pop("bar", None)
    results = check(**values)
    return results if widest is None else [replace(each, widest=widest) for each in results]


CASES = {name: (work, answerable) for name, work, answerable in every_case()}
