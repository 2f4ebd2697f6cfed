"""Work and precision of the contact compliance on the paper's block: split, direct FE, peers on the same mesh.

Run as a program it prints its measurements as JSON: a fresh interpreter on one thread, imports not counted.
"""

import dataclasses
import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cad.design.parameters import Fruit, Press, Tips
from cad.parts.fruit import fruit_quarter
from cad.parts.part import Part
from mesh.fruit import REFINEMENTS, fruit_mesh, fruit_size
from mesh.volume import volume_mesh
from pipeline.bench.calculix import LinearStep, SkfemMesh, absent, calculix, node_set, tetrahedra
from pipeline.bench.table import Measured
from solve.contact.linear_response import linear_response, spring_compliance, travels
from solve.contact.response import scene_response
from solve.contact.scene import Scene
from solve.fruit.compliance import Compliance
from solve.fruit.direct import direct_compliance, mesh_compliance
from solve.fruit.split import (
    LARGEST_ERROR,
    LEVELS,
    ROUGH,
    Foot,
    feet_compliance,
    level_errors,
    nodes_between,
    nodes_within,
    split_compliance,
)
from solve.halfspace.punch import square_punch
from solve.housing.element_study import boundary_places
from solve.linear import SolveError

Floats = NDArray[np.float64]

# Two independent methods agree to 2e-6: half-space split with graded spectral elements, and hp finite elements of
# order 5, 6, 7 extrapolated, on the block 20 x 20 x 12 mm, nu 0.3, sides 1 mm, 8 mm apart.
REFERENCE = {"s11": 0.766603, "s12": 0.010526, "uncertainty": 2e-6}
FRUIT, TIPS = Fruit(), Tips()
FEET = (Foot(-4.0, 1.0), Foot(4.0, 1.0))
MODULI, TRAVELS = 7, 13
SCENES = (1, 10, 50)
PEER = "CalculiX C3D10"
ROUGH_SPLIT = "rough split"  # without a coarser partner: its digits may be luck, so it is no row against a peer
TOLERANCES = (0.02, 1e-3, 1e-4, 5e-5)
# A peer's best at a minute of work: size at the edges [mm], growth, largest size of the finest mesh of the family.
PEER_MESH = (0.008, 0.26, 0.8)


def errors(S: Floats) -> tuple[float, float]:
    """Return the relative errors of s11 - s12 and of s11 against the reference."""
    s11, s12 = REFERENCE["s11"], REFERENCE["s12"]
    return float((S[0, 0] - S[0, 1]) / (s11 - s12) - 1.0), float(S[0, 0] / s11 - 1.0)


def timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """Return what a piece of work gives and its CPU seconds."""
    start = time.process_time()
    found = work()
    return found, time.process_time() - start


def punch_tables() -> list[Measured]:
    """Return what the punch tables of the scene cost, built once and then kept."""
    orders = sorted({nodes_within(FRUIT, FEET), nodes_between(FEET)})
    _, cpu = timed(lambda: [square_punch(order) for order in orders])
    table = square_punch(orders[-1])
    error = table.flat_stiffness / 1.152302 - 1.0  # electrified square plate, PHYSICS of the rigid square punch
    return [Measured(method="punch table", mesh="once a process", cpu=cpu, error=error, estimated=table.error)]


def split_rows() -> Iterator[Measured]:
    """Yield the split on each of its meshes with the bar it states, and as the product calls it."""
    for grading in (ROUGH, *LEVELS):
        fine, cpu = timed(partial(feet_compliance, FRUIT, FEET, grading))
        first, second = errors(fine.S)
        yield Measured(
            method="split" if grading in LEVELS else ROUGH_SPLIT,
            mesh=f"step {grading.step:g}",
            cpu=cpu,
            dofs=fine.dofs,
            error=first,
            second=second,
            estimated=level_errors(FRUIT, FEET, grading, fine.S)[0],
        )
    for tolerance in TOLERANCES:
        found, cpu = timed(partial(split_compliance, FRUIT, TIPS, tolerance))
        method = "split, with its error pair" if tolerance <= LARGEST_ERROR else ROUGH_SPLIT
        yield _product(method, f"to {100.0 * tolerance:g} %", found, cpu)


def _product(method: str, mesh: str, found: Compliance, cpu: float) -> Measured:
    first, second = errors(np.array(found.S))
    estimated = 0.01 * found.error_percent
    return Measured(method=method, mesh=mesh, cpu=cpu, dofs=found.dofs, error=first, second=second, estimated=estimated)


def direct_rows(with_peers: bool) -> Iterator[Measured]:
    """Yield direct finite elements on each mesh of the family, CalculiX on the same meshes, and the extrapolation."""
    part = fruit_quarter(FRUIT, TIPS)
    meshes, total = [], 0.0
    for scale in REFINEMENTS:
        mesh, meshing = timed(partial(fruit_mesh, part, FRUIT, TIPS, scale))
        found, cpu = timed(partial(mesh_compliance, mesh, FRUIT.poisson))
        first, second = errors(found.S)
        name = f"edge {0.1 * scale:.3g} mm"
        yield Measured(
            method="direct P2 tets", mesh=name, cpu=meshing + cpu, dofs=found.dofs, error=first, second=second
        )
        if with_peers:
            yield from _calculix_row(mesh, name, meshing)
        meshes.append(mesh)
        total += meshing
    found, cpu = timed(lambda: direct_compliance(meshes, FRUIT, TIPS))
    yield _product("direct, three meshes extrapolated", "default", found, total + cpu)
    if with_peers:
        mesh, meshing = timed(partial(peer_mesh, part))
        yield from _calculix_row(mesh, f"edge {PEER_MESH[0]:g} mm", meshing, f"{PEER}, finer")


def peer_mesh(part: Part) -> SkfemMesh:
    """Return a mesh [mm] finer than the family, graded for what a peer reaches in about a minute: 150k dofs."""
    edge, growth, largest = PEER_MESH
    size = fruit_size(part, FRUIT, TIPS, REFINEMENTS[-1])
    return volume_mesh(
        part, dataclasses.replace(size, smallest_mm=edge, growth=growth, largest_mm=largest * size.largest_mm)
    )


def _calculix_row(mesh: SkfemMesh, name: str, meshing: float, method: str = PEER) -> Iterator[Measured]:
    elements = tetrahedra(mesh)
    sets = {
        one: node_set(elements, boundary_places(mesh, "tet P2", one))
        for one in ("base", "symmetry_x", "symmetry_y", "high_tip")
    }
    steps = [
        LinearStep(
            held={"base": (1, 2, 3), "symmetry_y": (2,), "symmetry_x": held}, pressed={"high_tip": 1.0}, loads={}
        )
        for held in ((1,), (2, 3))
    ]
    try:
        found = calculix(elements, sets, (1.0, FRUIT.poisson), steps, "high_tip")
    except SolveError as refused:
        print(f"{refused}", file=sys.stderr)
        return
    alike, against = (0.5 / forces["high_tip"] for forces in found.forces)
    S = 0.5 * np.array([[alike + against, alike - against], [alike - against, alike + against]])
    first, second = errors(S)
    dofs = 3 * elements.nodes.shape[1]
    yield Measured(method=method, mesh=name, cpu=meshing + found.cpu, dofs=dofs, error=first, second=second)


def _compliances(fruits: Sequence[Fruit]) -> list[Compliance]:
    return [split_compliance(fruit, TIPS) for fruit in fruits]


def scene_times() -> dict[str, float]:
    """Return CPU seconds: compliances of 1, 10, 50 different scenes, and the table of 7 moduli by 13 travels."""
    seconds = {}
    for count in SCENES:
        fruits = [dataclasses.replace(FRUIT, height_mm=12.0 + 0.1 * i) for i in range(count)]
        seconds[f"split, {count} scenes"] = timed(partial(_compliances, fruits))[1]
    compliance = split_compliance(FRUIT, TIPS)
    x, E = travels(0.6, TRAVELS), np.linspace(0.5, 3.5, MODULI)
    C = spring_compliance(0.9057, 20.831)
    S = np.array(compliance.S)
    seconds["flat level, 7 x 13 responses"] = timed(lambda: [linear_response(S, C, modulus, x) for modulus in E])[1]
    curved = dataclasses.replace(FRUIT, shape="sphere", radius_mm=35.0)
    for name, fruit, press in (
        ("tilted 1 degree, 7 x 13 responses", FRUIT, Press(tilt_deg=1.0)),
        ("sphere of radius 35 mm, 7 x 13 responses", curved, Press()),
    ):
        scene = Scene(fruit=fruit, tips=TIPS, press=press)
        _, seconds[name] = timed(partial(scene_response, scene, compliance, C, E.tolist(), x))
    return seconds


def measure(quick: bool) -> dict[str, Any]:
    """Return every measurement; `quick` leaves out peers, the finer gradings and the growth with scenes."""
    rows = punch_tables()
    if quick:
        rows += [row for row, _ in zip(split_rows(), range(2), strict=False)]
        return {"rows": [dataclasses.asdict(row) for row in rows], "scenes": {}}
    rows += [*split_rows(), *direct_rows("CalculiX (ccx)" not in absent())]
    return {"rows": [dataclasses.asdict(row) for row in rows], "scenes": scene_times()}


def main(arguments: Sequence[str]) -> None:
    """Print the measurements as JSON."""
    print(json.dumps(measure("--quick" in arguments), allow_nan=False))


if __name__ == "__main__":
    main(sys.argv[1:])
