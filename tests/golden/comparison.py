"""What moved between a frozen answer and the one that is found now."""

import json
import math
from collections.abc import Collection
from typing import Any

from golden.freeze import NUMBERS, machine

SAME_MACHINE = 1e-9
"""Relative; round-off times the condition of a spring's stiffness matrix, some 1e6, with room for the order of sums."""

ROUND_OFF = 1e-11
"""Absolute; what is 0 but for round-off: spreads, crosstalk and tilts of a level sensor."""


def differences(expected, found, bar, *, same):
    """Return the paths whose values differ; elsewhere a number may differ by the bar that its report gives it."""
    wrong = [path for path in expected if path not in found]
    wrong += [path for path in found if path not in expected]
    for path, value in expected.items():
        if path not in found or path.endswith("tilt_direction_deg"):
            continue
        other = found[path]
        if isinstance(value, float) and isinstance(other, float):
            if same:
                # An error estimate is a difference of two solutions, each of which rounds off as a number does.
                of_number = 100.0 if path.rstrip(".0123456789").endswith("percent") else 1.0
                least = SAME_MACHINE * of_number if "error" in path else ROUND_OFF
                near = math.isclose(value, other, rel_tol=SAME_MACHINE, abs_tol=least)
            else:
                # an error estimate is a difference of two solutions: elsewhere it is not compared
                near = "error" in path or math.isclose(value, other, rel_tol=bar, abs_tol=ROUND_OFF)
        else:
            near = value == other
        if not near:
            wrong.append(f"{path}: {value!r} was, {other!r} is")
    return wrong


def moved(name: str, found: dict[str, Any], *, without: Collection[str] = ()) -> list[str]:
    """Return what a scene answers otherwise than before; `without` are the parts that were not asked for."""
    expected = json.loads((NUMBERS / f"{name}.json").read_text(encoding="utf-8"))
    same = expected.pop("machine") == machine()
    bar = expected.pop("bar")
    now = {key: value for key, value in found.items() if key != "bar"}
    before = {key: value for key, value in expected.items() if key not in without}
    wrong = [f"{key} is not in both" for key in before.keys() ^ now.keys()]
    for key in before.keys() & now.keys():
        if key == "numbers":
            wrong += differences(before[key], now[key], bar, same=same)
        elif key == "measured":
            pairs = zip(_flat(before[key]), _flat(now[key]), strict=True)
            wrong += [line for one, other in pairs for line in differences(one, other, bar, same=same)]
        elif before[key] != now[key]:
            wrong.append(f"{key}: {before[key]!r} was, {now[key]!r} is")
    return wrong


def _flat(measured):
    """Yield the mappings of numbers in what was measured of a unit."""
    for value in measured.values():
        for item in value if isinstance(value, list) else [value]:
            yield item if isinstance(item, dict) else {"value": item}
