"""Cost and error of the stiffness of one housing: other elements, integration rules, beam formulas, and peers.

As a program it prints its measurements as JSON, so that they come from a fresh interpreter on one thread. Imports are
not counted.
"""

import itertools
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import cadquery as cq

from benchmarks.bars.truths import TRUTHS
from benchmarks.calculix import calculix
from benchmarks.deck import SkfemMesh, flexure_deck
from benchmarks.harness import OURS, Bench, Measurement, Solved, print_measurements, time_call
from benchmarks.peers import NGSOLVE, Solver, deck_solvers
from cad.parts.housing import Arm, Housing
from cad.parts.housing_solid import housing_part, named_housing
from cad.parts.part import FaceTest, Part, named_part, plane_face_test
from mesh.housing.blocks import element_counts
from mesh.housing.sweep import flexure_mesh, mesh_of_counts
from mesh.volume import SizeField, volume_mesh
from pipeline.springs.leaf_lengths import MESH_PAIRS, HousingSolver, MeshPair, rough_compliance, rough_stiffness
from reference.element_study import element_stiffness
from sensor.theory.leaf_spring import Flexure, pair_stiffness
from solve.housing.stiffness import HousingStiffness

BENCH = Bench(
    name="flexures",
    scene="Springs of the default sensor in PETG, half of the housing, clamped at its holes. The product solves a "
    "second, coarser mesh for its error bar; a program without an error bar saves that time. The solid with "
    "which a run compares its mesh is not counted.",
    values=("K_l", "K_h"),
    unit="N/mm",
    # Reduced and full integration agree to 1.1e-4, the latter extrapolated from 111k dofs.
    reference=TRUTHS["default springs in PETG"],
)
# The default sensor in PETG [mm], copied from its layout, so that the reference stays valid if the layout changes.
HOUSING = Housing(
    low=Flexure(thickness=0.8, length=24.2, depth=10.0, separation=14.0, fillet=0.5),
    high=Flexure(thickness=1.2, length=12.1, depth=10.0, separation=14.0, fillet=0.5),
    tip_side=1.0, tip_height=1.0, spacing=8.0, shuttle_width=6.0, neck_level=5.5, lower_leaf_level=7.6,
    low_top_level=23.7, high_top_level=24.09, cavity_level=24.39, top_level=30.39, protrusion=1.7,
)  # fmt: skip
E_MPA, POISSON = 2000.0, 0.38
HEXAHEDRA = ("hex 20, reduced", "hex 20, full", "hex 27, full", "hex 8")
SCALES = (2.0, 1.0)
FAMILY_ENDS = (4.0, 0.5)  # additional mesh scales for the product's element
PEER_KINDS = {"hex 20, reduced": "C3D20R", "hex 20, full": "C3D20"}  # types of the elements in CalculiX
ELEMENTS = {"C3D20R": "hex 20, reduced", "C3D20": "hex 20, full", "C3D10": "P2 tets"}  # their names in the table
TET_SIZES = (0.8, 0.4)  # sizes of tetrahedra at the outline of the leaves [mm]
SHEAR = 5.0 / 6.0  # shear coefficient of a rectangle, S. Timoshenko 1921


def beam_rows() -> Iterator[Measurement]:
    """Yield the rows of closed forms: Euler and Timoshenko beams, and Timoshenko's with the plane-strain modulus."""
    plane_strain = E_MPA / (1.0 - POISSON**2)
    for name, modulus, shear in (
        ("Euler", E_MPA, 0.0),
        ("Timoshenko", E_MPA, 1.0),
        ("wide Timoshenko", plane_strain, 1.0),
    ):
        K = [beam_stiffness(arm.flexure, modulus, shear) for arm in HOUSING.arms]
        yield BENCH.row(f"beam, {name}", "-", Solved(values=K, cpu=0.0, dofs=0))


def beam_stiffness(flexure: Flexure, modulus: float, shear: float) -> float:
    """Return the stiffness of two guided leaves [N/mm] by beam theory, for a bending `modulus` [MPa].

    `shear` is the fraction of the shear compliance that is included: 0 for Euler's beam, 1 for Timoshenko's.
    """
    # Compliances [mm/N]; the two leaves share the load.
    bending = 1.0 / pair_stiffness(modulus, flexure.depth, flexure.thickness, flexure.length)
    G = 0.5 * E_MPA / (1.0 + POISSON)
    return 1.0 / (bending + shear * flexure.length / (2.0 * SHEAR * G * flexure.depth * flexure.thickness))


def product_rows() -> Iterator[Measurement]:
    """Yield the rows of the product's solver with its error bars: on the rough mesh, and on pairs of meshes."""
    rough, cpu = time_call(partial(rough_compliance, HOUSING, E_MPA, POISSON))
    yield BENCH.row(f"{OURS}hex 20, one rough mesh", "rough", _solved(rough_stiffness(HOUSING, rough), cpu))
    for pair in MESH_PAIRS:
        stiffness, cpu = time_call(partial(stiffness_on, pair, HOUSING, HousingSolver(E_MPA, POISSON)))
        yield BENCH.row(f"{OURS}hex 20, error pair", f"scale {pair.fine:g}", _solved(stiffness, cpu))


def stiffness_on(pair: MeshPair, housing: Housing, solver: HousingSolver) -> HousingStiffness:
    """Return the stiffness of a housing [N/mm] on a pair of meshes, with its error bars."""
    return pair.stiffness_with_errors(housing, solver.solve(housing, pair.fine), solver.solve(housing, pair.coarse))


def _solved(stiffness: HousingStiffness, cpu: float) -> Solved:
    """Return the product's stiffness as the answer of a method, with the error bar of K_l."""
    return Solved(values=stiffness.K, cpu=cpu, dofs=stiffness.info.dofs, error_bar=stiffness.error[0])


def element_rows() -> Iterator[Measurement]:
    """Yield the rows of single meshes of hexahedra and tetrahedra, without error bars, and of peers on some of them."""
    yield from _hexahedron_rows()
    yield from _tetrahedron_rows()


def _hexahedron_rows() -> Iterator[Measurement]:
    """Yield the rows of each hexahedron on swept meshes, followed by the rows of peers on the same mesh.

    The product's element, the first of `HEXAHEDRA`, is also solved on a coarser and on a finer mesh.
    """
    for choice in HEXAHEDRA:
        for scale in (*SCALES, *(FAMILY_ENDS if choice == HEXAHEDRA[0] else ())):
            mesh, meshing_cpu = time_call(partial(flexure_mesh, HOUSING, scale))
            mesh_name = f"scale {scale:g}"
            yield _element_row(f"{choice}, curved", mesh_name, mesh, choice, meshing_cpu)
            if scale in SCALES and choice in PEER_KINDS:
                yield from peer_rows(mesh_name, mesh, choice, PEER_KINDS[choice], meshing_cpu)


def _tetrahedron_rows() -> Iterator[Measurement]:
    """Yield the rows of linear and quadratic tetrahedra, and of peers on the coarser mesh."""
    half = housing_half(HOUSING)
    for finest in TET_SIZES:
        field = SizeField(largest_mm=5.0, smallest_mm=finest, growth=0.4, faces=("low_leaves", "high_leaves"))
        mesh, meshing_cpu = time_call(partial(volume_mesh, half, field, tolerance=0.05))
        mesh_name = f"leaf {finest:g} mm"
        for choice in ("tet P1", "tet P2"):
            yield _element_row(f"{choice}, straight", mesh_name, mesh, choice, meshing_cpu)
        if finest == TET_SIZES[0]:
            yield from peer_rows(mesh_name, mesh, "tet P2", "C3D10", meshing_cpu)


def mesh_rows() -> Iterator[Measurement]:
    """Yield the rows of the product's element on cheaper meshes, to show that scale 1 is a good choice.

    Each has fewer elements in the frame, around the holes, in the necks or along the leaves. None reaches an error of
    0.1 % at two thirds of the cost of scale 1.
    """
    scale_1 = element_counts(HOUSING, 1.0)
    # The element size of the frame is proportional to the square root of the scale.
    wide_frame = replace(scale_1, frame_size=2.0**0.5 * scale_1.frame_size, neck=3)
    # Each mesh has its numbers of elements in the plane of the plate, and its layers through half of the depth.
    meshes = {
        "frame of scale 2": (wide_frame, 2),
        "and one element less round a hole": (replace(wide_frame, ring=1), 2),
        "and fewer along leaves": (replace(wide_frame, along_leaf=8, beside_fillet=3), 2),
        "leaves of scale 1.25": (replace(scale_1, neck=3, along_leaf=8, beside_fillet=3), 2),
        "leaves of scale 1.7": (replace(scale_1, neck=2, along_leaf=6, beside_fillet=3), 2),
        "one layer": (scale_1, 1),
        "scale 2, one layer": (element_counts(HOUSING, 2.0), 1),
    }
    for mesh_name, (counts, layers) in meshes.items():
        mesh, meshing_cpu = time_call(partial(mesh_of_counts, HOUSING, counts, layers))
        yield _element_row(f"{HEXAHEDRA[0]}, curved", mesh_name, mesh, HEXAHEDRA[0], meshing_cpu)


def housing_half(housing: Housing) -> Part:
    """Return the half y >= 0 of a housing [mm], cut from the solid of the whole housing.

    Its faces are the named faces of the housing, the plane `symmetry`, and the flat faces `low_leaves` and
    `high_leaves`.
    """
    # The box extends beyond the housing by 1 mm along x and z, so that only its face y = 0 cuts the housing.
    width, height = housing.right - housing.left + 2.0, housing.top_level + 2.0
    box = cq.Solid.makeBox(width, housing.depth, height, cq.Vector(housing.left - 1.0, 0.0, -1.0))
    outside = named_housing(housing_part(housing).shape.intersect(box), housing)
    tests: dict[str, FaceTest] = {f"{arm.name}_leaves": _leaf_test(arm) for arm in housing.arms}
    tests["symmetry"] = plane_face_test(1, 0.0)
    inside = named_part("housing half", outside.shape, tests)
    return Part(name=inside.name, shape=outside.shape, faces={**outside.faces, **inside.faces})


def _leaf_test(arm: Arm) -> FaceTest:
    """Return a function that finds the flat faces of both leaves, which need small elements."""
    half = 0.5 * arm.flexure.thickness
    surfaces = [plane_face_test(2, level + side) for level in arm.levels for side in (-half, half)]
    start, end = arm.roots
    return lambda face: start < face.Center().x < end and any(on_surface(face) for on_surface in surfaces)


def _element_row(method: str, mesh_name: str, mesh: SkfemMesh, choice: str, meshing_cpu: float) -> Measurement:
    """Return the row of the element `choice` of `reference.element_study` on a mesh.

    `meshing_cpu` [s] is the CPU time of the mesh, which the row includes.
    """
    solution, cpu = time_call(partial(element_stiffness, mesh, choice, E_MPA, POISSON))
    return BENCH.row(method, mesh_name, Solved(values=solution.K, cpu=meshing_cpu + cpu, dofs=solution.dofs))


def peer_rows(mesh_name: str, mesh: SkfemMesh, choice: str, kind: str, meshing_cpu: float) -> Iterator[Measurement]:
    """Yield the row of each installed peer on a mesh [mm].

    `choice` is the name of the element in `reference.element_study`, and `kind` its type in CalculiX. `meshing_cpu` [s]
    is the CPU time of the mesh, which the rows include.
    """
    for peer, solver in deck_solvers(kind).items():
        # The program for NGSolve only prescribes displacements, but these decks apply nodal forces.
        if peer != NGSOLVE.name:
            solve = partial(peer_stiffness, mesh, (choice, kind), (E_MPA, POISSON), solver)
            yield BENCH.peer_row(f"{peer}, {ELEMENTS[kind]}", mesh_name, meshing_cpu, solve)


def peer_stiffness(
    mesh: SkfemMesh, element: tuple[str, str], material: tuple[float, float], solver: Solver = calculix
) -> Solved:
    """Return a peer's stiffness of each spring [N/mm] on a mesh of half of the housing [mm].

    `element` is a name in `reference.element_study`, which places nodes and loads, and a type of CalculiX. `material`
    is E [MPa] and Poisson's ratio. `solver` runs the peer on a deck, with one step for each tip. Raises SolveError if
    the peer fails.
    """
    deck = flexure_deck(mesh, *element, *material)
    results, cpu = solver(deck)
    node_count = deck.elements.count
    K = []
    for result, mean in zip(results, deck.means.values(), strict=True):
        # The mean displacement of the tip under 1 N. The nodes of the elements come first in a deck.
        K.append(1.0 / float(result.displacements[:node_count] @ mean))
    return Solved(values=tuple(K), cpu=cpu, dofs=3 * node_count)


if __name__ == "__main__":
    print_measurements(itertools.chain(beam_rows(), product_rows(), element_rows(), mesh_rows()))
