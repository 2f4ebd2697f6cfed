"""Cost and error of the contact compliance on the paper's block: split, direct FE, and peers on the same meshes.

As a program it prints its measurements as JSON, so that they come from a fresh interpreter on one thread. Imports are
not counted.
"""

import itertools
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from benchmarks.bars.truths import TRUTHS
from benchmarks.calculix import StepResult
from benchmarks.deck import SkfemMesh, contact_deck
from benchmarks.harness import OURS, Bench, Measurement, Solved, print_measurements, time_call
from benchmarks.peers import NGSOLVE, PeerTask, Solver, deck_solvers, peer_answer
from pipeline.storage.deck import LinearStep
from reference.direct_fruit import MIDDLE, SIDE, Held, direct_compliance, mesh_compliance
from reference.fruit_meshes import REFINEMENTS, edge_size, fruit_mesh, solved_block
from sensor.arrays import Floats
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from solve.fruit.compliance import FruitCompliance
from solve.fruit.footprints import Footprint
from solve.fruit.split import LARGEST_ERROR, LEVELS, footprint_compliance, split_compliance

# The split is the product's method: half-space solution plus finite-element correction.
SPLIT, DIRECT = "split", "direct P2 tets"
BENCH = Bench(
    name="contact",
    scene="The paper's block of 20 x 20 x 12 mm, nu 0.3, tips of side 1 mm, 8 mm apart.",
    values=("s11 - s12", "s11"),
    unit="/mm",
    reference=TRUTHS["paper's block"],
)
FRUIT, TIPS = Fruit(), Tips()
FOOTPRINTS = (Footprint(-4.0, 0.0, 1.0), Footprint(4.0, 0.0, 1.0))
TOLERANCES = (0.02, 1e-3, 1e-4, 5e-5)  # relative tolerances of the product's compliance
SPRINGS = np.diag([1.0 / 0.9057, 1.0 / 20.831])  # compliance [mm/N]
HIGH_ORDERS = ((3, 2), (4, 3), (5, 4))  # polynomial orders, each with the number of refinements towards the tip's edges
# The quarter of the block that NGSolve meshes for these orders [mm].
HIGH_ORDER_BLOCK = {
    "factor": 0.125,  # relative position at which each refinement divides an element at the edge of the tip
    "tip_size": 0.5,  # largest element size under the tip
    "size_mm": 4.0,  # largest element size elsewhere
    "size": (0.5 * FRUIT.length_mm, 0.5 * FRUIT.width_mm, FRUIT.height_mm),
    "tip_x": (TIPS.centres_mm[1] - 0.5 * TIPS.side_mm, TIPS.centres_mm[1] + 0.5 * TIPS.side_mm),
    "tip_y": 0.5 * TIPS.side_mm,
    "E": 1.0,
    "poisson": FRUIT.poisson,
}
MODULI, TRAVELS = np.linspace(0.5, 3.5, 7).tolist(), 0.6 * np.arange(1, 14) / 13


def compliance_values(S: Floats) -> tuple[float, float]:
    """Return s11 - s12 and s11 [1/mm] of a compliance S (tips, tips) [1/mm].

    s11 - s12 is the mean of the diagonal minus the mean of the other entries.
    """
    tips = len(S)
    diagonal_sum = float(np.trace(S))
    return diagonal_sum / tips - (float(S.sum()) - diagonal_sum) / (tips * (tips - 1)), float(S[0, 0])


def relative_errors(compliance: FruitCompliance) -> tuple[float, float]:
    """Return the relative error bars of the two values of `compliance_values` [1]."""
    return compliance.difference_error, compliance.s11_error


def split_rows() -> Iterator[Measurement]:
    """Yield the rows of the split: as the product calls it, with an error bar, and on each single mesh without one.

    The split computes the half-space in closed form, and only the effect of the finite size on a mesh.
    """
    for tolerance in TOLERANCES:
        compliance, cpu = time_call(partial(split_compliance, FRUIT, TIPS, tolerance))
        # Above this tolerance, the product solves only one mesh. Its bar is the largest error over random scenes.
        meshes = "its error pair" if tolerance <= LARGEST_ERROR else "one rough mesh"
        yield _product_row(f"{OURS}split, {meshes}", f"to {100.0 * tolerance:g} %", compliance, cpu)
    for grading in LEVELS:
        solved, cpu = time_call(partial(footprint_compliance, FRUIT, FOOTPRINTS, grading))
        answer = Solved(values=compliance_values(solved.S), cpu=cpu, dofs=solved.dofs)
        yield BENCH.row(SPLIT, f"step {grading.step:g}", answer)


def _product_row(method: str, mesh: str, compliance: FruitCompliance, cpu: float) -> Measurement:
    """Return the table row of a compliance solved by the product, with its error bar."""
    values, bar = compliance_values(compliance.S), relative_errors(compliance)[0]
    return BENCH.row(method, mesh, Solved(values=values, cpu=cpu, dofs=compliance.info.dofs, error_bar=bar))


def direct_rows() -> Iterator[Measurement]:
    """Yield the rows of direct FE and of peers on each mesh of a family, then the extrapolation to element size 0.

    Direct FE also resolves the singular field at the edges of the tips by its elements, which are quadratic tetrahedra.
    The CPU time of a row includes the meshing.
    """
    part = solved_block(FRUIT, TIPS)
    meshes = []
    total_meshing_cpu = 0.0
    for scale in REFINEMENTS:
        mesh, meshing_cpu = time_call(partial(fruit_mesh, part, FRUIT, TIPS, scale))
        solved, cpu = time_call(partial(mesh_compliance, mesh, FRUIT.poisson))
        answer = Solved(values=compliance_values(solved.S), cpu=meshing_cpu + cpu, dofs=solved.dofs)
        mesh_name = f"edge {edge_size(TIPS, scale):.3g} mm"
        yield BENCH.row(DIRECT, mesh_name, answer)
        for name, solver in deck_solvers("C3D10").items():
            yield _peer_deck_row(f"{name} P2 tets", mesh_name, mesh, meshing_cpu, solver)
        meshes.append(mesh)
        total_meshing_cpu += meshing_cpu
    compliance, cpu = time_call(partial(direct_compliance, meshes, FRUIT.poisson))
    yield _product_row("direct, three meshes extrapolated", "default", compliance, total_meshing_cpu + cpu)


def _peer_deck_row(method: str, mesh_name: str, mesh: SkfemMesh, meshing_cpu: float, solver: Solver) -> Measurement:
    """Return the row of a peer on a mesh of a quarter of the block [mm].

    `solver` runs the peer on a deck. `meshing_cpu` [s] is the CPU time of the mesh, which the row includes. If the peer
    fails, the row has the reason instead of errors.
    """
    deck = contact_deck(mesh, E=1.0, poisson=FRUIT.poisson, shift=1.0)

    def solve() -> Solved:
        results, cpu = solver(deck)
        return Solved(values=_pair_and_own_of_modes(results), cpu=cpu, dofs=3 * deck.elements.count)

    return BENCH.peer_row(method, mesh_name, meshing_cpu, solve)


def _pair_and_own_of_modes(results: Sequence[StepResult]) -> tuple[float, float]:
    """Return s11 - s12 and s11 [1/mm] from the results of two steps, in which the tip on a quarter is pressed by 1 mm.

    In the first step, the mirror image of the tip has the same displacement, which gives s11 + s12. In the second step,
    it has the opposite displacement, which gives s11 - s12. A quarter carries half the force of its tip.
    """
    s11_plus_s12, s11_minus_s12 = (0.5 / result.forces["high_tip"] for result in results)
    return s11_minus_s12, 0.5 * (s11_plus_s12 + s11_minus_s12)


def high_order_rows() -> Iterator[Measurement]:
    """Yield the rows of NGSolve, if installed, with elements of high order on its own mesh.

    The mesh is a quarter of the block, refined towards the edges of the tip.
    """
    if NGSOLVE.interpreter is None:
        return
    # The directions held at 0 on each face: 1, 2 and 3 are x, y and z. The plane between the tips holds x in the first
    # step, where both tips move equally. It holds y and z in the second step, where they move oppositely.
    held: Held = {"base": (1, 2, 3), SIDE: (2,)}
    steps = [LinearStep(held={**held, MIDDLE: fixed}, pressed={"high_tip": 1.0}) for fixed in ((1,), (2, 3))]
    for order, levels in HIGH_ORDERS:
        task = PeerTask(kind="block", scene={**HIGH_ORDER_BLOCK, "order": order, "levels": levels}, steps=steps)
        solve = partial(_solve_by_ngsolve, task)
        # NGSolve meshes the block itself, so the CPU time of its answer includes the mesh.
        yield BENCH.peer_row(f"{NGSOLVE.name}, order {order}", f"{levels} levels to the edge", 0.0, solve)


def _solve_by_ngsolve(task: PeerTask) -> Solved:
    """Return NGSolve's answer to a task whose two steps are described in `_pair_and_own_of_modes`."""
    answer = peer_answer(NGSOLVE, task)
    return Solved(values=_pair_and_own_of_modes(answer.results), cpu=answer.cpu, dofs=answer.dofs)


if __name__ == "__main__":
    print_measurements(itertools.chain(split_rows(), direct_rows(), high_order_rows()))
