"""The changes of the stiffness of springs if a plate is not mounted as its fabrication sheet states.

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


def compare_designs() -> Iterator[Comparison]:
    """Yield the comparison of each preset, process and mount whose springs can be made; print each as it is ready."""
    for preset in PRESETS:
        for process in PROCESSES:
            for mount in MOUNTS:
                compared = compare_mounts(preset, process, mount)
                print(compared, file=sys.stderr, flush=True)
                if compared is not None:
                    yield compared


def compare_mounts(preset: str, process: str, mount: str) -> Comparison | None:
    """Return the comparison of a preset in one mount with all other mounts, or None if its springs cannot be made."""
    design = load_design(preset, {"print.process": process, "print.mount": mount})
    springs = Sensor(design=design, options=RunOptions(tolerance=ROUGH_TOLERANCE)).springs.as_pair
    if springs.housing is None:
        return None
    changes = mount_changes(springs.housing, springs.process.E_MPa, springs.process.poisson)
    other = max(changes, key=lambda name: max(map(abs, changes[name])))
    changes_by_spring = zip(*changes.values(), strict=True)
    largest = tuple(max(map(abs, spring_changes)) for spring_changes in changes_by_spring)
    return Comparison(preset=preset, process=process, mount=mount, other=other, changes=changes[other], largest=largest)


def mount_changes(housing: Housing, E: float, poisson: float) -> dict[str, tuple[float, ...]]:
    """Return the relative changes of the stiffnesses of the springs [1] in each other mount, by its name.

    `E` [MPa] and `poisson` are the elastic constants of the plate. The other mounts are the other choice in a design,
    covers that press only near the screws, and screws so loose that they only bend. If two plates are mounted back to
    back, a further mount has the other plate loose. The mesh is coarse, which changes the result by a tenth. Raises
    SolveError if a mount cannot be solved.
    """
    half = coarse_half(housing, E, poisson, rough=False)
    own_K = np.array(_tip_stiffness(half))  # in the mount of the design
    mounts = {"screws so loose that they bend": (_screw_layer(housing, E, poisson),), **_other_mounts(housing)}
    changes = {}
    for name, layers in mounts.items():
        other_K = _tip_stiffness(_remount(half, layers, E, poisson))
        changes[name] = tuple((other_K / own_K - 1.0).tolist())
    return changes


def _tip_stiffness(half: ClampedHalf) -> tuple[float, ...]:
    """Return the stiffness of each tip of a clamped half along the press [N/mm].

    Raises SolveError if the half cannot be solved.
    """
    return tip_stiffnesses(tip_means(half.basis, PRESS_AXIS).T @ displacements(half))


def _remount(half: ClampedHalf, layers: Sequence[ElasticLayer], E: float, poisson: float) -> ClampedHalf:
    """Return the same half with the elastic `layers` as its mount, for a load along the press.

    `E` [MPa] and `poisson` are the elastic constants of the plate. No node is clamped.
    """
    without_mount = half.matrix if half.ground is None else half.matrix - half.ground
    ground = layer_matrix(half.basis, layers, E, poisson)
    free = replace(half, matrix=csc_matrix(without_mount + ground), ground=ground, clamped=np.zeros(0, dtype=np.int64))
    return with_symmetry(free, PRESS_AXIS)


def _other_mounts(housing: Housing) -> dict[str, tuple[ElasticLayer, ...]]:
    """Return the elastic layers of each mount that holds the frame differently, by the name of the mount."""
    others = {}
    if housing.mount == "covers":
        others["washers on the frame, no covers"] = mount_layers(replace(housing, mount="washers"))
        # The pressure under a washer spreads over the thickness of the cover on both sides of its diameter.
        pressed_diameter = WASHER_MM + 2.0 * (PLATE_MM + RECESS_MM) * SPREAD
        pressed_discs = discs_at(housing, pressed_diameter)
        near_screws = tuple(replace(layer, discs=pressed_discs) for layer in mount_layers(housing))
        others["covers that press near the screws alone"] = near_screws
    elif housing.mount == "washers":
        others["covers between frame and washers"] = mount_layers(replace(housing, mount="covers"))
    if housing.back_to_back:
        others["the other plate loose"] = mount_layers(housing)[:1]
    return others


def _screw_layer(housing: Housing, E: float, poisson: float) -> ElasticLayer:
    """Return a layer in the holes that is as stiff in shear as loose screws are in bending.

    A screw is a beam with both ends built in and loaded at its middle, whose stiffness is 192 EI / L^3 (S. P.
    Timoshenko, Strength of Materials, part I, 1955). The screw spans the frame and its covers, if any.
    """
    span = housing.stack + (2.0 * (PLATE_MM + RECESS_MM) if housing.mount == "covers" else 0.0)
    bending_stiffness = 192.0 * STEEL_MPA * math.pi / 64.0 * SCREW_CORE_MM**4 / span**3  # [N/mm]
    hole_area = math.pi * housing.hole_diameter * housing.stack  # inner surface of a hole [mm^2]
    # A layer of thickness h has the shear stiffness G A / h, with G = E / (2 (1 + nu)).
    return ElasticLayer(name=HOLES, thickness=0.5 * E / (1.0 + poisson) * hole_area / bending_stiffness)


def main() -> None:
    """Compare every design and write the page."""
    compared = list(compare_designs())
    rows = [
        [row.preset, row.process, row.mount, row.other, *(f"{100.0 * change:+.2g}" for change in row.changes)]
        for row in compared
    ]
    K_l, K_h = map(max, zip(*(row.largest for row in compared), strict=True))  # largest changes [1]
    note = f"largest by any other mount: K_l {100.0 * K_l:.2g} %, K_h {100.0 * K_h:.2g} %"
    page = section("Changes of stiffness", HEADS, rows, [note])
    write_section("Other mounts", INTRODUCTION, [page])


if __name__ == "__main__":
    main()
