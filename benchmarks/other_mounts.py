"""How far another mount than the sheet's moves the stiffness of the springs, over presets, processes and mounts.

`python -m benchmarks.other_mounts` writes docs/measurements.md, from which the bound of an error bar is taken.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass

from benchmarks.harness import section, write_section
from pipeline import RunOptions, load_design
from pipeline.evaluate import fitted_sensor
from pipeline.options import ROUGH_TOLERANCE
from pipeline.springs.mounts import mount_changes
from sensor.design.processes import PROCESSES

PRESETS = ("paper", "mango", "paper-on-mango", "apple", "avocado", "kiwi", "peach", "tomato")
MOUNTS = ("covers", "washers")
HEADS = ["preset", "process", "mount", "the other mount that moves them most", "K_l, %", "K_h, %"]
INTRODUCTION = """\
`python -m benchmarks.other_mounts` writes this section. Each preset is made by each process and held by each mount. Its
springs are then solved in every other mount, on one mesh. Each row names, for one mount, the other mount that changes
K_l or K_h most. Springs that a process cannot make have no row.

A run does not solve other mounts. Its error bars use `LARGEST_MOUNT_CHANGES` of `pipeline/verdicts/errors/effects.py`.
These are the largest changes of this section, plus a quarter. Another mesh moves a change by a tenth of it."""


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A design in one mount, and the other mount that changes a stiffness most, with both changes [1].

    `largest` are the largest changes of each spring by any other mount [1], in size.
    """

    preset: str
    process: str
    mount: str
    other: str
    changes: tuple[float, ...]
    largest: tuple[float, ...]


def comparisons() -> Iterator[Comparison]:
    """Yield each design that can be made."""
    for preset in PRESETS:
        for process in PROCESSES:
            for mount in MOUNTS:
                found = comparison(preset, process, mount)
                print(found, file=sys.stderr, flush=True)
                if found is not None:
                    yield found


def comparison(preset: str, process: str, mount: str) -> Comparison | None:
    """Return the largest change of a preset by another mount; None where its springs cannot be made."""
    design = load_design(preset, {"print.process": process, "print.mount": mount})
    springs = fitted_sensor(design, RunOptions(tolerance=ROUGH_TOLERANCE)).springs.per_spring
    if springs.housing is None:
        return None
    changes = mount_changes(springs.housing, springs.process.E_MPa, springs.process.poisson)
    other = max(changes, key=lambda name: max(map(abs, changes[name])))
    largest = tuple(max(map(abs, of_spring)) for of_spring in zip(*changes.values(), strict=True))
    return Comparison(preset=preset, process=process, mount=mount, other=other, changes=changes[other], largest=largest)


def main() -> None:
    """Compare every design and write the page."""
    found = list(comparisons())
    rows = [
        [row.preset, row.process, row.mount, row.other, *(f"{100.0 * change:+.2g}" for change in row.changes)]
        for row in found
    ]
    K_l, K_h = (max(of_spring) for of_spring in zip(*(row.largest for row in found), strict=True))
    note = f"largest by any other mount: K_l {100.0 * K_l:.2g} %, K_h {100.0 * K_h:.2g} %"
    page = section("Changes of stiffness", HEADS, rows, [note])
    write_section("Other mounts", INTRODUCTION, [page])


if __name__ == "__main__":
    main()
