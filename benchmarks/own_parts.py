"""The stiffness of ten user-drawn housings by the product and by CalculiX: the tables of docs/your-own-part.md.

CalculiX solves 20-node elements with full integration. Its mesh is the product's section, but finer, in three layers
for each half, and finer still at sharp inner corners. Its error bar is the difference from reduced integration on the
same mesh, because full integration is too stiff, and reduced integration is too soft by about the same amount.

With --files no mesh is shared: gmsh divides the STEP file of the whole part into tetrahedra, on three meshes. Their
observed rate of convergence gives the stiffness at element size 0, and the error bar is the step to this limit.

    python -m benchmarks.own_parts [--files] [NAME ...]
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import cadquery as cq

from benchmarks.deck import TETRAHEDRA
from benchmarks.flexure import E_MPA, HOUSING, POISSON, peer_stiffness
from benchmarks.harness import table
from benchmarks.own_housings import OWN_HOUSINGS
from cad.checks.own_part import (
    combine_shapes,
    faces_at,
    find_extrusion,
    hole_points,
    own_part,
    read_own_solid,
    require_one_solid,
    tip_points,
)
from cad.parts.part import Part
from mesh.own_part import FineCorners, swept_part
from pipeline.springs.own_part import HELD, PartStiffness, stiffness
from reference.tetrahedra import Box, fine_boxes, tetrahedra
from solve.housing.stiffness import tip_face
from solve.own_part import extrapolate_to_size_zero, strained_corners, swept_compliance

ROUGH, FINER = (4.0, 1), (2.0, 3)  # scale of the element size in the section, and layers in half the depth
CORNER = 0.1  # size of elements at sharp corners, divided by the thickness [1]
UP = (0.0, 0.0, 1.0)  # direction of the forces on the tips
INTEGRATIONS = {"full": ("hex 20, full", "C3D20"), "reduced": ("hex 20, reduced", "C3D20R")}
TET_SIZES = (2.0, 1.4, 1.0)  # element sizes of the three meshes of tetrahedra [mm]
TET_VOLUME = 3e-4  # allowed relative error of the volume, because the coarsest mesh has few elements around a hole
HEADS = [
    "housing",
    "K_l [N/m]",
    "CalculiX",
    "K_h [N/m]",
    "CalculiX",
    "inside both bars",
    "unknowns",
    "CPU s",
    "CalculiX: unknowns",
    "CPU s",
]
PeerResult = tuple[list[tuple[float, float]], int, float]
"""The stiffness of each tip with its error bar [N/mm], the number of unknowns, and CPU seconds."""


def housing_row(name: str, solve_by_peer: Callable[[str, cq.Workplane], PeerResult]) -> list[str]:
    """Return the table row of the housing called `name`, solved by the product and by a peer.

    For each tip, the two stiffnesses agree if they differ by at most the sum of their error bars.
    """
    shape = OWN_HOUSINGS[name]()
    product, cpu = _product_stiffness(shape)
    peer_stiffnesses, peer_dofs, peer_cpu = solve_by_peer(name, shape)
    cells = []
    is_inside = True
    for face, (peer_K, peer_bar) in zip(product.faces.values(), peer_stiffnesses, strict=True):
        bar = face.K * face.K_error  # [N/mm]
        cells += [_stiffness_cell(face.K, bar), _stiffness_cell(peer_K, peer_bar)]
        is_inside &= abs(face.K - peer_K) <= bar + peer_bar
    inside = "yes" if is_inside else "no"
    return [name, *cells, inside, str(product.dofs), f"{cpu:.0f}", str(peer_dofs), f"{peer_cpu:.0f}"]


def _product_stiffness(shape: cq.Workplane) -> tuple[PartStiffness, float]:
    """Return the product's stiffness of a housing, and its CPU seconds [s]."""
    start = time.process_time()
    solved = stiffness(shape, held=hole_points(HOUSING), pressed=tip_points(HOUSING), E_MPa=E_MPA, poisson=POISSON)
    return solved, time.process_time() - start


def _stiffness_cell(K: float, bar: float) -> str:
    """Return a stiffness in N/m with its relative error bar, as text; both arguments are in N/mm."""
    return f"{1e3 * K:.5g} ± {100.0 * bar / K:.2f} %"


def _name_faces(solid: cq.Solid) -> Part:
    """Return the solid as a part whose pressed and held faces have names."""
    faces = {tip_face(tip): faces_at(solid, tip, [point]) for tip, point in tip_points(HOUSING).items()}
    faces[HELD] = faces_at(solid, "held", hole_points(HOUSING))
    return own_part(solid, faces)


def calculix_on_section(name: str, shape: cq.Workplane) -> PeerResult:
    """Return CalculiX's stiffness of the housing called `name` on a finer mesh of the product's section.

    A rough solution of the product shows at which inner corners the mesh must be fine. The error bar is the difference
    between full and reduced integration. Raises ValueError if the housing is not an extrusion.
    """
    extrusion = find_extrusion(_name_faces(require_one_solid(combine_shapes(shape), name)))
    if extrusion is None:
        msg = f"The housing {name!r} is not an extrusion. Solve it with --files."
        raise ValueError(msg)
    material = (E_MPA, POISSON)
    presses = {tip_face(tip): UP for tip in tip_points(HOUSING)}
    rough_solution = swept_compliance(swept_part(extrusion, *ROUGH, presses.values()), material, presses)
    fine_corners = FineCorners(numbers=strained_corners(rough_solution), size=CORNER)
    mesh = swept_part(extrusion, *FINER, presses.values(), fine_corners).mesh
    full, reduced = (peer_stiffness(mesh, kind, material) for kind in INTEGRATIONS.values())
    stiffnesses = [(K, abs(K - reduced_K)) for K, reduced_K in zip(full.values, reduced.values, strict=True)]
    return stiffnesses, full.dofs, full.cpu + reduced.cpu


def calculix_on_step_file(name: str, shape: cq.Workplane) -> PeerResult:
    """Return CalculiX's stiffness of the housing called `name` on tetrahedra of its STEP file.

    The stiffness is extrapolated to element size 0. The number of unknowns is the number on the finest mesh.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "part.step"
        cq.exporters.export(cq.Workplane(combine_shapes(shape)), str(path))
        part = _name_faces(read_own_solid(path))
    solutions = []  # one per mesh
    for size in TET_SIZES:
        mesh = tetrahedra(part, boxes_for(name, size), size, tolerance=TET_VOLUME)
        solutions.append(peer_stiffness(mesh, TETRAHEDRA, (E_MPA, POISSON)))
        print(name, size, solutions[-1], file=sys.stderr, flush=True)
    K_by_tip = zip(*(solution.values for solution in solutions), strict=True)  # for each tip, its K on all meshes
    stiffnesses = [extrapolate_to_size_zero(TET_SIZES, K_on_meshes) for K_on_meshes in K_by_tip]
    return stiffnesses, solutions[-1].dofs, sum(solution.cpu for solution in solutions)


def boxes_for(name: str, size: float) -> list[Box]:
    """Return the boxes with small tetrahedra in the housing called `name`, for the general element `size` [mm].

    They lie in the leaves of the design, and in the folds and the hinges of the two housings that have them. The sizes
    in folds and hinges are judgements: small enough for the thinnest parts, without too many elements.
    """
    low, high = HOUSING.arms
    boxes = fine_boxes(HOUSING, size)
    if name == "folded leaf":
        (wall, shuttle), level = low.roots, low.levels[1]
        # The corners of a box are the smaller x and z and the larger x and z [mm].
        boxes.append(Box(corners=(wall, level - 4.5, shuttle, level + 0.5), size=0.6 * size))
        for x, z in ((wall, level - 4.0), (shuttle, level)):  # the two ends of the leaf
            boxes.append(Box(corners=(x - 0.5, z - 1.0, x + 0.5, z + 1.0), size=0.2 * size))
    if name == "hinge":
        for z in high.levels:
            for x in (high.roots[0] + 2.0, high.roots[1] - 2.0):  # the hinges of a leaf
                boxes.append(Box(corners=(x - 0.8, z - 0.3, x + 0.8, z + 0.3), size=0.22 * size))
    return boxes


def main() -> int:
    """Print the table of the housings that the command line names, by default all of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=list(OWN_HOUSINGS))
    parser.add_argument("--files", action="store_true", help="solve tetrahedra of the STEP file of the whole part")
    options = parser.parse_args()
    solve_by_peer = calculix_on_step_file if options.files else calculix_on_section
    rows = []
    for name in options.names:
        rows.append(housing_row(name, solve_by_peer))
        print(rows[-1], file=sys.stderr, flush=True)
    print(table(HEADS, rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
