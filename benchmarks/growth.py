"""How wall-clock time, CPU time and memory grow with the size of each kind of work.

`python -m benchmarks.growth` writes docs/measurements.md. With the name of a kind of work and a size, only this work is
run, and its cost is printed.
"""

import functools
import json
import math
import resource
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.harness import ROOT, section, write_section
from benchmarks.usage import ONE_THREAD, resource_usage
from pipeline import RunOptions, load_design
from pipeline.response.contact import contact_compliance
from pipeline.response.scene_press import scene_of
from pipeline.springs.fitted_springs import springs_for
from pipeline.springs.sizing import spring_sizing
from pipeline.study import process_engine, read_study, run_study
from pipeline.study.engines import Engine, cluster_engine
from solve.contact.linear_response import travels
from solve.contact.pose_forces import Pose, pose_forces
from solve.contact.response import scene_response

INTRODUCTION = """\
`python -m benchmarks.growth` writes this section. Each size is run once, in a process of its own, with one thread for
each worker. Imports and a first small call are not counted. Memory is the peak of the largest process. The exponent
describes the CPU time between the two largest sizes, where fixed costs matter least.

Two exponents are above theory, because the work changes in a step:

- Four tips stand in a square. A line of three lies in a plane of symmetry, so each mesh needs two factors, of 3267
  dofs. A square needs four, of 3993 dofs. The factors take most of the time.
- Meshes of contact come in steps. One of 2673 dofs serves tolerances of 1 / 1000 and 1 / 10000. For 1 / 20000 this
  mesh is solved first and misses the tolerance; then the next mesh, of 7605 dofs, is solved too. Each of its factors
  costs about 8 times as much, which is the square of the ratio of dofs. From 1 / 1000 to 1 / 20000 the exponent is
  below theory.

An exponent is below theory where a cost that does not grow with the size is still a large part of the whole."""
HEADS = ["work", "size", "wall s", "CPU s", "MiB", "exponent", "theory, at most"]
SPRINGS = {"springs.K_l_N_per_m": 906, "springs.K_h_N_per_m": 20800}  # nearly the springs of the paper's sensor
LAYOUTS: dict[int, dict[str, object]] = {
    2: {},
    3: {"tips.layout": "line", "tips.order": "LHL", "tips.spacing_mm": 6, **SPRINGS},
    4: {"tips.layout": "square", **SPRINGS},
}
STUDY = """\
base = "paper"
samples = {samples}
wanted = ["springs.K_l_N_per_m", "springs.K_h_N_per_m", "verdicts.P_max.value"]
[vary]
"targets.P_max" = {{ from = 3, to = 8 }}
"fruit.E_max_MPa" = {{ from = 2, to = 6 }}
"""


def contact_of_tips(count: int) -> None:
    """Solve the compliance of the fruit under `count` tips."""
    design = load_design("paper", LAYOUTS[count])
    contact_compliance(design.fruit, design.tips)


def tilted_moduli(count: int) -> None:
    """Press a tilted pair on fruits with `count` moduli, after solving the compliance of the fruit."""
    design = load_design("paper", {"press.tilt_deg": 1})
    contact = contact_compliance(design.fruit, design.tips)
    springs = springs_for(design, spring_sizing(design, contact, RunOptions()), "sized")
    x = travels(design.press.travel_mm, 12)
    scene_response(scene_of(design), contact, springs.C, np.linspace(0.5, 3.5, count), x)


def poses_of_domes(count: int) -> None:
    """Press the domes of mango on fruits in `count` poses."""
    design = load_design("mango")
    contact = contact_compliance(design.fruit, design.tips)
    springs = springs_for(design, spring_sizing(design, contact, RunOptions()), "sized")
    pose_forces(scene_of(design), contact, springs.C, [Pose(E=E, travel=0.4) for E in np.linspace(0.5, 3.5, count)])


def springs_to_digits(inverse: int) -> None:
    """Fit the springs of the paper's sensor to a relative tolerance of 1 / `inverse`."""
    design = load_design("paper")
    contact = contact_compliance(design.fruit, design.tips)
    springs_for(design, spring_sizing(design, contact, RunOptions()), "fitted", 1.0 / inverse)


def contact_to_digits(inverse: int) -> None:
    """Solve the compliance of the fruit under the paper's pair to a relative tolerance of 1 / `inverse`."""
    design = load_design("paper")
    contact_compliance(design.fruit, design.tips, tolerance=1.0 / inverse)


def study_points(count: int, engine: Callable[[], AbstractContextManager[Engine]]) -> None:
    """Solve a study of `count` points that share their contact solution, on the engine that `engine` opens."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "growth.toml"
        file.write_text(STUDY.format(samples=count), encoding="utf-8")
        with engine() as open_engine:
            run_study(read_study(file), Path(folder) / "out", open_engine)


def study_on_cluster(count: int, workers: int) -> None:
    """Solve the study on a Dask cluster on this machine; its time includes the start of the cluster."""
    from distributed import LocalCluster

    cluster = LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None)
    with cluster:
        study_points(count, functools.partial(cluster_engine, cluster.scheduler_address))


@dataclass(frozen=True, kw_only=True)
class Growth:
    """A kind of work, the sizes at which it is measured, and the largest exponent of its CPU time in theory [1].

    `work` is called with a size. The sizes increase, and there are at least two of them.
    """

    work: Callable[[int], None]
    sizes: tuple[int, ...]
    theory: float


POINTS = (100, 1000, 10000)
GROWTHS = {
    # A dense compliance for n loads needs n solves with one factor of constant size; a square needs more factors.
    "tips of a sensor": Growth(work=contact_of_tips, sizes=(2, 3, 4), theory=2.0),
    "moduli, tilted pair": Growth(work=tilted_moduli, sizes=(2, 20, 200), theory=1.0),
    "poses of domes": Growth(work=poses_of_domes, sizes=(1, 10, 100, 1000, 10000, 100000), theory=1.0),
    # Nested dissection of bricks in a plate costs n^1.5 to n^2, in two to three dimensions; errors fall as n^(-4/3).
    "1 / tolerance of springs": Growth(work=springs_to_digits, sizes=(50, 200, 1000, 10000), theory=1.0),
    "1 / tolerance of contact": Growth(work=contact_to_digits, sizes=(50, 1000, 10000, 20000), theory=1.3),
    **{
        f"points of a study, processes: {count}": Growth(
            work=functools.partial(study_points, engine=functools.partial(process_engine, count)),
            sizes=POINTS,
            theory=1.0,
        )
        for count in (1, 2)
    },
    **{
        f"points of a study, Dask workers: {count}": Growth(
            work=functools.partial(study_on_cluster, workers=count), sizes=POINTS, theory=1.0
        )
        for count in (1, 2, 4)
    },
}


def print_cost(name: str, size: int) -> None:
    """Run the kind of work called `name` at one size, and print its wall-clock and CPU time [s] as JSON.

    A first call at the smallest size is not counted, because it loads libraries.
    """
    growth = GROWTHS[name]
    growth.work(growth.sizes[0])
    start, cpu_start = time.perf_counter(), _cpu_seconds()
    growth.work(size)
    print(json.dumps({"wall": time.perf_counter() - start, "cpu": _cpu_seconds() - cpu_start}))


def _cpu_seconds() -> float:
    """Return the CPU time of this process and of its finished children [s]."""
    usages = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def growth_rows() -> Iterator[list[str]]:
    """Yield a table row for each size of each kind of work; the last row of each kind shows the exponent.

    The exponent describes the CPU time between the two largest sizes. Raises RuntimeError if a run fails.
    """
    for name, growth in GROWTHS.items():
        previous_cpu = math.nan  # CPU time at the previous size [s]
        for index, size in enumerate(growth.sizes):
            cost, peak_MiB = measured_cost(name, size)
            exponent_cells = ["", ""]
            if index == len(growth.sizes) - 1:
                exponent = math.log(cost["cpu"] / previous_cpu) / math.log(size / growth.sizes[index - 1])
                exponent_cells = [f"{exponent:.2f}", f"{growth.theory:g}"]
            previous_cpu = cost["cpu"]
            cost_cells = [f"{cost['wall']:.2g}", f"{cost['cpu']:.2g}", f"{peak_MiB:.0f}"]
            yield [name, str(size), *cost_cells, *exponent_cells]


def measured_cost(name: str, size: int) -> tuple[dict[str, float], float]:
    """Run the kind of work called `name` at one size in a process of its own; return its cost and peak memory [MiB].

    The cost is the JSON object of `print_cost`, with the keys "wall" and "cpu" [s]. Raises RuntimeError if the run
    fails.
    """
    usage = resource_usage([sys.executable, "-m", "benchmarks.growth", name, str(size)], ROOT, ONE_THREAD)
    if usage.exit_code:
        failure = f"exit code {usage.exit_code}: {usage.last_line}"
        msg = f"{name!r} at the size {size} ended with {failure}. Run this size by itself to see its output."
        raise RuntimeError(msg)
    return json.loads(usage.out.splitlines()[-1]), usage.peak_MiB


if __name__ == "__main__":
    if sys.argv[1:]:
        print_cost(sys.argv[1], int(sys.argv[2]))
    else:
        write_section("Growth", INTRODUCTION, [section("Cost over size", HEADS, growth_rows())])
