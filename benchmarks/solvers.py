"""The optional direct solver beside SuperLU, on the systems that the product solves.

Run as a program it prints its measurements as JSON: assembly, factor and solves of each system, meshing not counted.
"""

from collections.abc import Iterator
from functools import partial

from benchmarks.flexure import E_MPA, HOUSING, POISSON
from benchmarks.harness import FAST, Measurement, measurements_of, print_measurements, section, timed
from cad.parts.fruit import solved_block
from mesh.fruit import REFINEMENTS, fruit_mesh
from mesh.housing.sweep import flexure_mesh
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from solve.fruit.direct import mesh_compliance
from solve.housing.stiffness import tip_compliance

SCALES = (3.0, 2.0, 1.0, 0.5)
HEADS = ["system", "dofs", "SuperLU, CPU s", "pardiso, CPU s", "ratio"]


def rows() -> Iterator[Measurement]:
    """Yield what each system costs."""
    tip_compliance(flexure_mesh(HOUSING, SCALES[0]), E_MPA, POISSON)  # not counted: what the first solve loads
    for scale in SCALES:
        found, cpu = timed(partial(tip_compliance, flexure_mesh(HOUSING, scale), E_MPA, POISSON))
        yield Measurement(method="housing", mesh=f"scale {scale:g}", cpu=cpu, errors=(), dofs=found.dofs)
    fruit, tips = Fruit(), Tips()
    for scale in REFINEMENTS:
        mesh = fruit_mesh(solved_block(fruit, tips), fruit, tips, scale)
        solved, cpu = timed(partial(mesh_compliance, mesh, fruit.poisson))
        yield Measurement(method="fruit", mesh=f"scale {scale:g}", cpu=cpu, errors=(), dofs=solved.dofs)


def solver_section() -> str:
    """Return the table of both solvers; without pardiso, one line that says how to install it."""
    cells = []
    if FAST:
        for slow, fast in zip(measurements_of(__name__), measurements_of(__name__, FAST), strict=True):
            numbers = [f"{slow.cpu:.2g}", f"{fast.cpu:.2g}", f"{slow.cpu / fast.cpu:.2g}"]
            cells.append([f"{slow.method}, {slow.mesh}", str(slow.dofs), *numbers])
    note = (
        "what the extra `fast` adds, one thread" if FAST else "pardiso is not installed: make bench-peers installs it"
    )
    return section("Direct solvers", HEADS, cells, [note])


if __name__ == "__main__":
    print_measurements(rows())
