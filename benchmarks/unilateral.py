"""Cost and error of unilateral contact: tilted, rigid, flat tips pressed into a curved fruit by a given travel.

As a program it prints its measurements as JSON, so that they come from a fresh interpreter on one thread. Imports are
not counted. The flesh is linear elastic, and contact forces act along the normals of the tips, without friction. The
gap between a tip and the sphere is measured vertically.
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.bars.truths import TRUTHS
from benchmarks.deck import TETRAHEDRA, SkfemMesh
from benchmarks.harness import OURS, Bench, Measurement, Solved, print_measurements, time_call
from benchmarks.peers import GETFEM, Peer, PeerTask, deck_task, peer_answer
from cad.parts.part import Part
from mesh.volume import SizeField, volume_mesh
from pipeline.options import CONTACT_FRACTION, DEFAULT_TOLERANCE, ROUGH_TOLERANCE
from pipeline.response.contact import contact_compliance
from pipeline.storage.deck import Deck, LinearStep, boundary_sets, elements_of
from reference.curved_fruit import curved_half
from reference.direct_fruit import FACES, SIDE
from reference.element_study import element_basis
from reference.fruit_meshes import edge_size
from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips
from solve.contact.linear_response import SensorResponse
from solve.contact.response import scene_response
from solve.contact.scene import Scene

FRUIT = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=20.0, thickness_mm=12.0)
TIPS, PRESS, TRAVEL_MM = Tips(), PressMotion(tilt_deg=1.0), 0.2
SCENE = Scene(fruit=FRUIT, tips=TIPS, press=PRESS)
E_MPA = 1.0
SMALL_SLOPE = 1.0 / math.cos(math.radians(SCENE.steepest_deg)) - 1.0  # relative error due to the slope of the skin
BENCH = Bench(
    name="unilateral contact",
    scene="A piece of a sphere of radius 35 mm: 20 x 20 mm, 12 mm thick, nu 0.3, E 1 MPa. Flat tips of 1 mm, 8 mm "
    f"apart, are tilted by 1 degree and moved {TRAVEL_MM:g} mm from first touch, without springs. Our error bar "
    f"includes {100.0 * SMALL_SLOPE:.2g} % for the slope of {SCENE.steepest_deg:.2g} degrees between tip and skin.",
    values=tuple(name.replace("_", " ") for name in FACES),
    unit="N",
    reference=TRUTHS["tilted pair on a ball"],
)
SCALES = (2.0, 1.0, 0.5, 0.25)  # scales of the element size at the edges of the tips, as in `edge_size`
# The motion of the tips is prescribed; the flesh may lose contact with them.
STEP = LinearStep(held={"base": (1, 2, 3), SIDE: (2,)}, pressed=dict.fromkeys(FACES, -TRAVEL_MM))


def tip_plane() -> tuple[float, float]:
    """Return the height of the plane of the tip faces above the apex at x = 0 [mm], and its slope along x [1]."""
    return -(SCENE.first_touch_mm + TRAVEL_MM), -float(SCENE.tilt_tangents[0])


def half_mesh(part: Part, scale: float) -> SkfemMesh:
    """Return straight tetrahedra of half the fruit [mm]; `scale` multiplies the size at the edges of the tips."""
    smooth = scale**0.25  # factor on the sizes away from the edges, where the solution is smooth
    size = SizeField(
        smallest_mm=edge_size(TIPS, scale),
        growth=0.5 * smooth,
        largest_mm=4.0 * smooth,
        faces=FACES,
        cuts=(SIDE,),
    )
    return volume_mesh(part, size, tolerance=0.05)


def half_deck(mesh: SkfemMesh) -> Deck:
    """Return the deck of half the fruit, with the motion of the tips as its only step."""
    choice, kind = TETRAHEDRA
    basis = element_basis(mesh, choice)
    elements = elements_of(basis, kind)
    sets = boundary_sets(elements, basis, ("base", SIDE, *FACES))
    return Deck(elements=elements, sets=sets, E=E_MPA, poisson=FRUIT.poisson, steps=[STEP], printed_set="base")


def contact_task(deck: Deck) -> PeerTask:
    """Return the task of a peer to press the tips on half the fruit, with the plane of the tip faces."""
    task = deck_task(deck)
    return replace(task, kind="contact", scene={**task.scene, "plane": tip_plane()})


def product_rows() -> Iterator[Measurement]:
    """Yield the rows of the product's forces with their error bars, at two tolerances.

    The CPU time includes the compliance of the fruit. The error bar includes the error due to the slope of the skin.
    """

    def press_rigid_tips(tolerance: float) -> SensorResponse:
        """Return the response of tips without springs, solved to a relative tolerance [1]."""
        no_compliance = np.zeros((len(FACES), len(FACES)))
        compliance = contact_compliance(FRUIT, TIPS, tolerance=CONTACT_FRACTION * tolerance)
        return scene_response(SCENE, compliance, no_compliance, [E_MPA], [TRAVEL_MM])

    press_rigid_tips(ROUGH_TOLERANCE)  # not measured, because the first solve in a process loads libraries
    for tolerance in (ROUGH_TOLERANCE, DEFAULT_TOLERANCE):
        response, cpu = time_call(partial(press_rigid_tips, tolerance))
        # The first indices are the only modulus and the only travel.
        bar = float(response.F_error[0, 0]) + SMALL_SLOPE
        name = f"--tol {tolerance:g}"
        answer = Solved(values=response.F[0, 0], cpu=cpu, dofs=response.info.dofs, error_bar=bar)
        yield BENCH.row(f"{OURS}cells of contact on the split", name, answer)


def peer_rows() -> Iterator[Measurement]:
    """Yield the rows of GetFEM on one family of meshes, by its augmented Lagrangian method."""
    part = curved_half(FRUIT, TIPS)
    for scale in SCALES:
        mesh, meshing = time_call(partial(half_mesh, part, scale))
        deck, name = half_deck(mesh), f"edge {edge_size(TIPS, scale):.3g} mm"
        if GETFEM.interpreter:
            solve = partial(_pressed, GETFEM, contact_task(deck))
            yield BENCH.peer_row(f"{GETFEM.name} P2 tets", name, meshing, solve)


def _pressed(peer: Peer, task: PeerTask) -> Solved:
    """Return a peer's forces on both tips [N], doubled because half the fruit carries half of each force."""
    answer = peer_answer(peer, task)
    (result,) = answer.results
    forces = [2.0 * abs(result.forces[name]) for name in FACES]
    return Solved(values=forces, cpu=answer.cpu, dofs=answer.dofs)


if __name__ == "__main__":
    print_measurements(itertools.chain(product_rows(), peer_rows()))
