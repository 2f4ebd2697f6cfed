"""Coverage of the error bars: random contact scenes, presses and springs, compared with finer or other solutions.

`python -m benchmarks.coverage [--count 100] [--seed 1]` writes docs/measurements.md, and exits with 1 if fewer than
95 % of the numbers lie inside their bars.
"""

import argparse
import random
import statistics
import sys
from collections.abc import Callable, Sequence

from benchmarks.bars.check import REFUSALS, ReferenceCheck
from benchmarks.bars.contact import compliance_checks
from benchmarks.bars.press import press_checks
from benchmarks.bars.springs import process_checks
from benchmarks.harness import percent, section, write_section
from sensor.design.fruit import Fruit
from sensor.design.processes import PROCESSES
from sensor.design.tips import PressMotion, Tips

GOAL = 0.95  # fraction of the numbers that must lie inside their error bars
HEADS = ["kind", "scenes", "refused", "numbers", "inside", "largest error / bar", "median bar"]
INTRODUCTION = """\
`python -m benchmarks.coverage --count {count} --seed {seed}` writes this table. It draws scenes at random and compares
each number with a reference. The reference is the same solve with four times the unknowns, the other method, or another
solver. Inside means that the difference is at most the error bar plus the error of the reference. Goal: 95 % inside."""


def random_contact(rng: random.Random) -> Sequence[ReferenceCheck]:
    """Return the checks of the compliance of a random block under a random pair of flat tips.

    The side of a tip is uniform in its logarithm. All other lengths are random multiples of it.
    """
    side = 10.0 ** rng.uniform(-1.0, 1.0)  # [mm]
    spacing = side * rng.uniform(1.1, 10.0)
    length = spacing + side * rng.uniform(2.0, 20.0)
    width = side * rng.uniform(2.0, 20.0)
    height = side * rng.uniform(1.0, 20.0)
    fruit = Fruit(length_mm=length, width_mm=width, height_mm=height, poisson=rng.uniform(0.0, 0.49))
    return compliance_checks(fruit, Tips(side_mm=side, spacing_mm=spacing))


def random_press(rng: random.Random) -> Sequence[ReferenceCheck]:
    """Return the checks of the forces on the paper's tips, which press a random sphere at a random tilt."""
    size = {"length_mm": 20.0, "width_mm": 20.0, "thickness_mm": 12.0}
    fruit = Fruit(shape="sphere", radius_mm=10.0 ** rng.uniform(1.4, 2.5), poisson=rng.uniform(0.0, 0.45), **size)
    press = PressMotion(travel_mm=rng.uniform(0.2, 0.6), tilt_deg=rng.uniform(-3.0, 3.0))
    return press_checks(fruit, press, E=10.0 ** rng.uniform(-1.0, 1.0))


def random_springs(rng: random.Random) -> Sequence[ReferenceCheck]:
    """Return the checks of both springs, sized for random targets in a random process."""
    return process_checks(rng.choice(sorted(PROCESSES)), P_max=rng.uniform(3.0, 8.0), NL=rng.uniform(0.03, 0.1))


# The kinds of random scenes. The count of scenes is divided by the number, which is larger for costly kinds.
KINDS: dict[str, tuple[Callable[[random.Random], Sequence[ReferenceCheck]], int]] = {
    "contact compliance": (random_contact, 1),
    "forces of a tilted press": (random_press, 4),
    "stiffness of springs": (random_springs, 8),
}


def check_random_scenes(kind: str, count: int, seed: int) -> tuple[list[ReferenceCheck], int]:
    """Draw `count` random scenes of a kind, and return their checks and the number of scenes that were rejected.

    Checks whose reference could not be computed are left out. Each scene has its own random generator, so that a single
    scene can be repeated. Progress is printed to stderr.
    """
    check_random_scene, _ = KINDS[kind]
    checks: list[ReferenceCheck] = []
    refused_count = 0
    for number in range(count):
        try:
            scene_checks = check_random_scene(random.Random(f"{kind} {seed} {number}"))
        except REFUSALS:
            refused_count += 1
            continue
        checks += [check for check in scene_checks if check.reference is not None]
        print(f"{kind} {number}", file=sys.stderr, flush=True)
    return checks, refused_count


def coverage_row(kind: str, count: int, seed: int) -> tuple[list[str], bool]:
    """Return the table row of `count` random scenes of a kind, and whether they meet `GOAL`."""
    checks, refused_count = check_random_scenes(kind, count, seed)
    # A check is inside its error bar if its excess is at most 1.
    inside = statistics.fmean(check.excess <= 1.0 for check in checks)  # fraction [1]
    median_bar = statistics.median(check.relative_error for check in checks)
    largest_excess = max(check.excess for check in checks)
    counts = [str(count), str(refused_count), str(len(checks))]
    row = [kind, *counts, f"{100.0 * inside:.1f} %", f"{largest_excess:.2f}", percent(median_bar)]
    return row, inside >= GOAL


def main() -> int:
    """Draw and check the random scenes, and write the table.

    Return the exit code: 1 if a kind of scene misses `GOAL`, else 0.
    """
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rows = []
    meets_goals = []  # for each kind of scene
    for kind, (_, divisor) in KINDS.items():
        row, meets_goal = coverage_row(kind, max(1, options.count // divisor), options.seed)
        rows.append(row)
        meets_goals.append(meets_goal)
    introduction = INTRODUCTION.format(count=options.count, seed=options.seed)
    write_section("Do the error bars hold?", introduction, [section("Random scenes and springs", HEADS, rows)])
    return 0 if all(meets_goals) else 1


if __name__ == "__main__":
    sys.exit(main())
