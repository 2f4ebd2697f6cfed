"""The bare work of a cold run: what each stage cannot leave out, done once more by itself.

Run as a program it prints its measurements as JSON: a fresh interpreter on one thread, imports not counted, on an empty
cache. The number of pictures on the page is its argument.
"""

import dataclasses
import json
import math
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from cad.design.parameters import Design
from cad.files.stl import ANGLE_RAD, CHORD_MM
from cad.parts.assembly import assembly_bodies, sensor_of
from cad.parts.housing import Housing
from pipeline.bench.harness import timed
from pipeline.options import RunOptions, load_design
from pipeline.report.page.drawing.picture import plot_panel, plot_picture
from pipeline.report.page.drawing.scale import Scale
from pipeline.response.characteristics import sensor_modes
from pipeline.response.contact import fruit_compliance
from pipeline.springs.fitted_springs import fit_springs, other_mounts
from pipeline.springs.sizing import spring_sizing
from solve.linear import Factor, factorised

REPEATS = 3


@dataclass(frozen=True, kw_only=True)
class BareWork:
    """A stage, the least CPU seconds that its bare work took [s], and what that work is, in words."""

    stage: str
    cpu: float
    what: str


def bare_work(design: Design, pictures: int) -> Iterator[BareWork]:
    """Yield the bare work of the stages of a run; the stages themselves are solved to know their systems."""
    options = RunOptions()
    with recorded_systems() as systems:
        contact = fruit_compliance(design, options)
    yield _of_systems("contact", systems)
    sizing = spring_sizing(design, contact, options)
    with recorded_systems() as systems:
        springs = fit_springs(design, sizing, options)
    # Leaves are fitted in steps on one mesh: with the right length at once each mesh needs one.
    yield _of_systems("springs", tuple({factor.matrix.shape: factor for factor in systems}.values()))
    if springs.housing is not None:
        yield _least("solids", _solids(design, springs.housing), "solids built once, a STEP file each, triangles once")
    for stage, solved in (("mounts", other_mounts), ("behaviour", sensor_modes)):
        with recorded_systems() as systems:
            solved(springs)
        yield _of_systems(stage, systems)
    yield _least("page", partial(_empty_plots, pictures), f"{pictures} empty plots")


@contextmanager
def recorded_systems() -> Iterator[list[Factor]]:
    """Yield a list that gets every system factorised inside the block."""
    systems: list[Factor] = []
    work: Callable[..., Factor] = factorised

    def recording(*system: object) -> Factor:
        systems.append(work(*system))
        return systems[-1]

    users = [module for module in list(sys.modules.values()) if vars(module).get("factorised") is factorised]
    users.remove(sys.modules[__name__])
    for module in users:
        vars(module)["factorised"] = recording
    try:
        yield systems
    finally:
        for module in users:
            vars(module)["factorised"] = factorised


def _of_systems(stage: str, systems: Sequence[Factor]) -> BareWork:
    """Return what one factorisation and one solve of each system take; their assembly is not counted."""

    def solved() -> None:
        for factor in systems:
            unknowns = factor.matrix.shape[0]
            factorised(factor.matrix, factor.fixed).solve(np.cos(np.arange(unknowns, dtype=np.float64)))

    sizes = ", ".join(str(factor.matrix.shape[0]) for factor in systems)
    return _least(stage, solved, f"a factorisation and a solve of each system, of {sizes} dofs")


def _solids(design: Design, housing: Housing) -> Callable[[], None]:
    """Return the work of the CAD kernel: every solid built, each written as STEP, the printed one in triangles."""

    def built() -> None:
        sensor = sensor_of(design, housing)
        printed = sensor.printed_part().shape
        with tempfile.TemporaryDirectory() as folder:
            for body in (sensor.housing_body(), *assembly_bodies(sensor)):
                body.shape.exportStep(str(Path(folder) / "body.step"))
            printed.mesh(CHORD_MM, ANGLE_RAD)

    return built


def _empty_plots(count: int) -> None:
    """Draw empty plots of the page, as often as it has pictures."""
    scale = Scale(start=0.0, end=1.0)
    for _ in range(count):
        plot_picture((plot_panel("empty", scale, "x", scale, "y"),), "empty", "empty", ("", ""))


def _least(stage: str, work: Callable[[], None], what: str) -> BareWork:
    """Return the least CPU seconds that a piece of work takes when it is repeated."""
    cpu = math.inf
    for _ in range(REPEATS):
        cpu = min(cpu, timed(work)[1])
    return BareWork(stage=stage, cpu=cpu, what=what)


def print_bare_work(found: Iterable[BareWork]) -> None:
    """Print measurements as JSON."""
    print(json.dumps([dataclasses.asdict(work) for work in found], allow_nan=False))


if __name__ == "__main__":
    print_bare_work(bare_work(load_design(), int(sys.argv[1])))
