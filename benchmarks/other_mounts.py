"""How much the stiffness of springs changes if a plate is mounted otherwise than its fabrication sheet says.

`python -m benchmarks.other_mounts` writes a section of docs/measurements.md, the source of a bound in the error bars.
"""

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csc_matrix

from benchmarks.harness import section, write_section
from cad.parts.cover import PLATE_MM, RECESS_MM, WASHER_MM
from cad.parts.housing import Housing
from cad.parts.pin import STEEL_MPA
from pipeline import RunOptions, load_design
from pipeline.options import ROUGH_TOLERANCE
from pipeline.sensor import Sensor
from pipeline.springs.mounts import coarse_half, discs_at, mount_layers
from sensor.design.processes import PROCESSES
from solve.housing.clamped_half import HOLES, PRESS_AXIS, ClampedHalf, with_symmetry
from solve.housing.elastic_layer import ElasticLayer, layer_matrix
from solve.housing.stiffness import displacements, tip_means, tip_stiffnesses

SCREW_CORE_MM = 2.387  # core diameter of M3, ISO 724
SPREAD = 0.5  # tangent of the cone in which the pressure of a screw spreads, VDI 2230
PRESETS = ("paper", "mango", "paper-on-mango", "apple", "avocado", "kiwi", "peach", "tomato")
MOUNTS = ("covers", "washers")
HEADS = ["preset", "process", "mount", "the other mount that moves them most", "K_l, %", "K_h, %"]
INTRODUCTION = """\
`python -m benchmarks.other_mounts` writes this section. Each preset is made by each process and held by each mount. Its
springs are then solved in every other mount, on one mesh. Each row names, for one mount, the other mount that changes
K_l or K_h most. Springs that a process cannot make have no row.

A run does not solve other mounts. Its error bars use `LARGEST_MOUNT_CHANGES` of `pipeline/errors/causes.py`.
These are the largest changes of this section, plus a quarter. Another mesh moves a change by a tenth of it.

`orange`, `pear` and `plum` came later and are not in the table. In `fdm-pla`, with covers and screws so loose that they
bend, K_h moves by -0.42, -0.92 and -0.43 %. That of `pear` is more than the 0.86 % of the bars."""


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A design in one mount, and the other mount that changes a stiffness most, with the changes of both springs [1].

    `largest` holds for each spring its largest absolute change in any other mount [1].
    """

    preset: str
    process: str
    mount: str
    other: str
    changes: tuple[float, ...]
    largest: tuple[float, ...]


def comparisons() -> Iterator[Comparison]:
    """Yield the comparison of each preset, process and mount that can be made."""
    for preset in PRESETS:
        for process in PROCESSES:
            for mount in MOUNTS:
                found = comparison(preset, process, mount)
                print(found, file=sys.stderr, flush=True)
                if found is not None:
                    yield found


def comparison(preset: str, process: str, mount: str) -> Comparison | None:
    """Return the comparison of a preset in one mount with all other mounts, or None if its springs cannot be made."""
    design = load_design(preset, {"print.process": process, "print.mount": mount})
    springs = Sensor(design=design, options=RunOptions(tolerance=ROUGH_TOLERANCE)).springs.as_pair
    if springs.housing is None:
        return None
    changes = mount_changes(springs.housing, springs.process.E_MPa, springs.process.poisson)
    other = max(changes, key=lambda name: max(map(abs, changes[name])))
    largest = tuple(max(map(abs, of_spring)) for of_spring in zip(*changes.values(), strict=True))
    return Comparison(preset=preset, process=process, mount=mount, other=other, changes=changes[other], largest=largest)


def mount_changes(housing: Housing, E: float, poisson: float) -> dict[str, tuple[float, ...]]:
    """Return the relative change of the stiffness of each spring [1] in each other mount, by its name; E in MPa.

    The other mounts are the other choice in a design, covers that press only near the screws, and screws so loose that
    they only bend. The mesh is coarse, which changes the result by a tenth. Raises SolveError.
    """
    half = coarse_half(housing, E, poisson, rough=False)
    own_K = np.array(_tip_stiffness(half))
    mounts = {"screws so loose that they bend": (_screw_layer(housing, E, poisson),), **_other_mounts(housing)}
    changes = {}
    for name, layers in mounts.items():
        other_K = _tip_stiffness(_remount(half, layers, E, poisson))
        changes[name] = tuple((other_K / own_K - 1.0).tolist())
    return changes


def _tip_stiffness(half: ClampedHalf) -> tuple[float, ...]:
    """Return the stiffness of each tip of a clamped half along the press [N/mm]; raises SolveError."""
    return tip_stiffnesses(tip_means(half.basis, PRESS_AXIS).T @ displacements(half))


def _remount(half: ClampedHalf, layers: Sequence[ElasticLayer], E: float, poisson: float) -> ClampedHalf:
    """Return the same half with the elastic `layers` as its mount, for a load along the press; E in MPa."""
    without_mount = half.matrix if half.ground is None else half.matrix - half.ground
    ground = layer_matrix(half.basis, layers, E, poisson)
    free = replace(half, matrix=csc_matrix(without_mount + ground), ground=ground, clamped=np.zeros(0, dtype=np.int64))
    return with_symmetry(free, PRESS_AXIS)


def _other_mounts(housing: Housing) -> dict[str, tuple[ElasticLayer, ...]]:
    """Return the elastic layers of each mount that holds the frame differently, by the name of the mount."""
    others = {}
    if housing.mount == "covers":
        others["washers on the frame, no covers"] = mount_layers(replace(housing, mount="washers"))
        pressed = discs_at(housing, WASHER_MM + 2.0 * (PLATE_MM + RECESS_MM) * SPREAD)
        near_screws = tuple(replace(layer, discs=pressed) for layer in mount_layers(housing))
        others["covers that press near the screws alone"] = near_screws
    elif housing.mount == "washers":
        others["covers between frame and washers"] = mount_layers(replace(housing, mount="covers"))
    if housing.back_to_back:
        others["the other plate loose"] = mount_layers(housing)[:1]
    return others


def _screw_layer(housing: Housing, E: float, poisson: float) -> ElasticLayer:
    """Return a layer in the holes that is as stiff in shear as loose screws are in bending, 192 EI / L^3.

    S. P. Timoshenko, Strength of Materials, part I, 1955: a beam with both ends built in, loaded at its middle.
    """
    span = housing.stack + (2.0 * (PLATE_MM + RECESS_MM) if housing.mount == "covers" else 0.0)
    bending = 192.0 * STEEL_MPA * math.pi / 64.0 * SCREW_CORE_MM**4 / span**3
    inside = math.pi * housing.hole_diameter * housing.stack
    return ElasticLayer(name=HOLES, thickness=0.5 * E / (1.0 + poisson) * inside / bending)


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
