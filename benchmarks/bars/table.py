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
# The records whose fields are tables in bars.toml.
TABLES = {"fruit": Fruit, "tips": Tips, "press": PressMotion, "targets": Targets}
# Groups whose cases may end in an error that names a bound, unless the case states a `bar`.
MAY_BE_REFUSED = ("contact", "press", "leaf", "design", "moved nodes", "clamp")


def every_case() -> Iterator[tuple[str, Callable[[], Sequence[ReferenceCheck]], bool]]:
    """Yield the name of each case, the function that computes its checks, and whether the case must be answered."""
    for group, compute_checks in CHECKS.items():
        for case, settings in BARS[group].items():
            answerable = "bar" in settings or group not in MAY_BE_REFUSED
            yield f"{group}: {case}", partial(run_case, compute_checks, settings), answerable


def run_case(
    compute_checks: Callable[..., Sequence[ReferenceCheck]], settings: Mapping[str, Any]
) -> Sequence[ReferenceCheck]:
    """Return the checks of a case, given its keys in bars.toml.

    The keys are the arguments of `compute_checks`, except that `bar` is the widest error bar [1] that is accepted.
    Raises InputError if the keys are not a valid design.
    """
    arguments = {key: TABLES[key](**value) if key in TABLES else value for key, value in settings.items()}
    if "truth" in arguments:
        arguments["truth"] = TRUTHS[arguments["truth"]]
    widest = arguments.pop("bar", None)
    checks = compute_checks(**arguments)
    return checks if widest is None else [replace(check, widest=widest) for check in checks]


CASES = {name: (work, answerable) for name, work, answerable in every_case()}
