"""Eleven scenes answer what they answered before: a number that moves is a fault, or a correction with its reason."""

import json
import math

import pytest
from golden.freeze import NUMBERS, RUNS, frozen, machine

QUICK = ("paper",)
SLOW = ("mango",)
SCENES = [
    pytest.param(name, marks=() if name in QUICK else pytest.mark.slow if name in SLOW else pytest.mark.study)
    for name in RUNS
]

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


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_answers_what_it_answered(name, tmp_path):
    expected = json.loads((NUMBERS / f"{name}.json").read_text(encoding="utf-8"))
    same = expected.pop("machine") == machine()
    found = frozen(name, tmp_path)
    bar = expected.pop("bar")
    found.pop("bar")
    assert found.keys() == expected.keys()
    measured = (expected.pop("measured", {}), found.pop("measured", {}))
    assert differences(expected.pop("numbers"), found.pop("numbers"), bar, same=same) == []
    assert found == expected
    for before, now in zip(*(list(_flat(tree)) for tree in measured), strict=True):
        assert differences(before, now, bar, same=same) == []


def _flat(measured):
    """Yield the mappings of numbers in what was measured of a unit."""
    for value in measured.values():
        for item in value if isinstance(value, list) else [value]:
            yield item if isinstance(item, dict) else {"value": item}


def test_a_moved_number_is_found():
    before = {"K": 905.85, "n": 3, "passed": True}
    assert differences(before, dict(before), 1e-3, same=True) == []
    assert len(differences(before, before | {"K": 905.85 * (1 + 1e-8)}, 1e-3, same=True)) == 1
    assert differences(before, before | {"K": 905.85 * (1 + 5e-4)}, 1e-3, same=False) == []
    assert len(differences(before, before | {"K": 905.85 * (1 + 2e-3)}, 1e-3, same=False)) == 1
    assert len(differences(before, {"K": 905.85, "n": 4}, 1e-3, same=True)) == 2
