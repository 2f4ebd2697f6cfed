"""A quarter of a curved fruit under a central pair of tips, in curved quadratic tetrahedra by gmsh.

It shares nothing with the bent mesh of the product. The geometry is from CadQuery, the mesh from gmsh, the elements are
different, and no closed form is added to the load. The discretisation error under the tips is nearly equal for a
block on a mesh of the same sizes, whose solution is known. So only differences between fruit and block are used.
"""

from dataclasses import replace
from typing import Any

import cadquery as cq
import numpy as np
from skfem import ElementTetP2, ElementVector, FacetBasis, LinearForm, MeshTet1, MeshTet2

from cad.parts.fruit import whole_fruit
from cad.parts.part import Part, named_part, on_plane
from mesh.volume import SizeField, volume_mesh
from reference.fruit_meshes import MIRROR_PLANES, edge_size, solved_block, tip_centres, top_faces
from sensor.arrays import Floats
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from sensor.theory.sloped_skin import log_coefficient
from solve.elasticity import stiffness_matrix, vector_basis
from solve.fruit.curved_body import LOG_OFFSET
from solve.fruit.curved_shape import CurvedShape, Plan
from solve.fruit.smooth_load import least_deviation
from solve.fruit.split import contact_footprints
from solve.linear import factorise

FACETED = 0.05  # relative error of volume or area while midpoints of edges are not yet moved to the skin
NEAR = 1e-6  # tolerance of coordinates [mm]
NEAR_BOX_MM = 1e-3  # margin by which the kernel's box around a curved face is larger than the face


def is_curved(face: cq.Face) -> bool:
    """Return whether a face belongs to the skin."""
    return face.geomType() != "PLANE"


def curved_half(fruit: Fruit, tips: Tips) -> Part:
    """Return the half y >= 0 of the solid [mm] with the faces base, top, low_tip, high_tip and symmetry_y."""
    whole = whole_fruit(fruit, tips)
    far = whole.BoundingBox().DiagonalLength
    half = whole.intersect(cq.Solid.makeBox(2.0 * far, far, 2.0 * far, cq.Vector(-far, 0.0, -far)))
    planes = {"base": on_plane(2, -fruit.depth_mm), "symmetry_y": MIRROR_PLANES["symmetry_y"]}
    skin = top_faces(tips, tip_centres(tips), is_curved, NEAR_BOX_MM)
    return named_part("half of a curved fruit", half, {**planes, **skin})


def curved_quarter(fruit: Fruit, tips: Tips) -> Part:
    """Return the quarter x, y >= 0 of the solid [mm] with the faces base, top, high_tip, symmetry_x and symmetry_y."""
    whole = whole_fruit(fruit, tips)
    far = whole.BoundingBox().DiagonalLength
    quarter = whole.intersect(cq.Solid.makeBox(far, far, 2.0 * far, cq.Vector(0.0, 0.0, -far))).Solids()[0]
    half_tip = 0.5 * tips.side_mm + 1e-3  # with a margin for the tolerance of the kernel
    start, end = tips.centres_mm[1] - half_tip, tips.centres_mm[1] + half_tip

    def under_tip(face: cq.Face) -> bool:
        box = face.BoundingBox()
        return is_curved(face) and start < box.xmin and box.xmax < end and box.ymax < half_tip

    planes = {"base": on_plane(2, -fruit.depth_mm), **MIRROR_PLANES}
    top = {"high_tip": under_tip, "top": lambda face: is_curved(face) and not under_tip(face)}
    return named_part("quarter of a curved fruit", quarter, {**planes, **top})


def sizes(tips: Tips, scale: float, growth: float, largest: float) -> SizeField:
    """Return the size field [mm]; `scale` multiplies the size at the outline of the tip, as in `edge_size`."""
    smallest, cuts = edge_size(tips, scale), ("symmetry_x", "symmetry_y")
    return SizeField(smallest_mm=smallest, growth=growth, largest_mm=largest, faces=("high_tip",), cuts=cuts)


def block_mesh(fruit: Fruit, tips: Tips, size: SizeField) -> MeshTet2:
    """Return the mesh [mm] of a quarter of the equivalent block."""
    straight = volume_mesh(solved_block(fruit.equivalent_block, tips), size, tolerance=FACETED)
    return MeshTet2.from_mesh(straight).with_boundaries(straight.boundaries)


def bent_by_height(mesh: MeshTet2, fruit: Fruit) -> MeshTet2:
    """Return the mesh of a block, bent to a piece of fruit by shortening its vertical columns."""
    x, y, z = mesh.doflocs
    fall = np.vectorize(fruit.fall_mm)(x, y)
    return replace(mesh, doflocs=np.stack([x, y, -fall + z * (1.0 - fall / fruit.depth_mm)]))


def curved_mesh(fruit: Fruit, tips: Tips, size: SizeField) -> MeshTet2:
    """Return the mesh [mm] of a quarter of the solid, with the midpoints of edges of the skin on the ellipsoid."""
    straight = volume_mesh(curved_quarter(fruit, tips), size, tolerance=FACETED)
    curved = MeshTet2.from_mesh(straight)
    skin = np.concatenate([straight.boundaries["top"], straight.boundaries["high_tip"]])
    nodes = curved.dofs.edge_dofs[0, np.unique(straight.f2e[:, skin])]
    places = curved.doflocs.copy()
    places[:, nodes] = _on_skin(places[:, nodes], fruit)
    return MeshTet2(places, curved.t).with_boundaries(straight.boundaries)


def _on_skin(places: np.ndarray, fruit: Fruit) -> np.ndarray:
    """Return points near the skin of a fruit (3, n) [mm], moved onto its ellipsoid.

    Points of a whole fruit move towards its centre, except for points of its base, which keep their height. Points of a
    piece move along z.
    """
    radius = fruit.radius_mm or 0.0  # a curved fruit has one
    axes = np.array([radius, (radius * (fruit.radius_across_mm or radius)) ** 0.5, radius])
    centre = np.array([0.0, 0.0, -radius])
    u = (places - centre[:, None]) / axes[:, None]
    if fruit.whole:
        on_base = places[2] < -fruit.depth_mm + NEAR
        ring = np.sqrt(np.maximum(0.0, 1.0 - u[2] ** 2)) / np.hypot(u[0], u[1])
        factor = np.where(on_base, ring, 1.0 / np.linalg.norm(u, axis=0))
        u = u * np.array([factor, factor, np.where(on_base, 1.0, factor)])
    else:
        u[2] = np.sqrt(1.0 - u[0] ** 2 - u[1] ** 2)
    return centre[:, None] + axes[:, None] * u


def smooth_pair(mesh: MeshTet1, poisson: float, tips: Tips, slope: float = 0.0, plan: MeshTet1 | None = None) -> float:
    """Return s11 - s12 [1/mm] under smooth loads, normal distributions with the half-space compliance of rigid tips.

    Loads and displacements are along the normals of a skin that falls by `slope` at the tips, or vertical for 0. `plan`
    is the mesh before bending by height; loads are then distributed over its flat top.
    """
    deviation, centre = least_deviation(contact_footprints(Fruit(), tips)[1]), tips.centres_mm[1]
    basis = vector_basis(mesh, ElementTetP2(), 4)
    stiffness = stiffness_matrix(basis, 1.0, poisson)
    skin = np.concatenate([mesh.boundaries["top"], mesh.boundaries["high_tip"]])
    surface = FacetBasis(plan or mesh, ElementVector(ElementTetP2()), facets=skin, intorder=8)

    def density(x: np.ndarray, place: float) -> np.ndarray:
        """Return the density of a unit load around a place on the x axis, per area in plan [1/mm^2]."""
        square = (x[0] - place) ** 2 + x[1] ** 2
        return np.exp(-0.5 * square / deviation**2) / (2.0 * np.pi * deviation**2)

    along, up = slope / np.hypot(1.0, slope), 1.0 / np.hypot(1.0, slope)

    @LinearForm
    def opposed(v: Any, w: Any) -> Floats:
        """Return the work of opposite loads under the tips; the factor w.n[2] projects the surface to its plan."""
        right, left = density(w.x, centre), density(w.x, -centre)
        return ((right - left) * up * v[2] + (right + left) * along * v[0]) * w.n[2]

    force = opposed.assemble(surface)
    # Opposed loads are odd in x and even in y.
    held = {"base": ("u^1", "u^2", "u^3"), "symmetry_y": ("u^2",), "symmetry_x": ("u^2", "u^3")}
    fixed = [basis.get_dofs(name).all(list(components)) for name, components in held.items()]
    return 2.0 * float(force @ factorise(stiffness, np.concatenate(fixed)).solve(force))


def change_along_normals(fruit: Fruit, tips: Tips, size: SizeField) -> float:
    """Return the change of s11 - s12 along the normals by the curvature of a piece [1/mm], on a mesh bent by height.

    It is for loads that are round on the skin. The loads on the mesh are round in plan, so on a slope s they are longer
    downhill by sqrt(1 + s^2). This reduces their own compliance by the share s^2 / 4, which is added again.
    """
    shape, place = CurvedShape(fruit, Plan(0.0, 0.0)), tips.centres_mm[1]
    sharper = LOG_OFFSET * shape.mean_curvature(place, 0.0) * log_coefficient(fruit.poisson, 0.0)
    block, slope = block_mesh(fruit, tips, size), shape.slope(place, 0.0)
    bent = smooth_pair(bent_by_height(block, fruit), fruit.poisson, tips, slope, block)
    own = 0.5 * (1.0 - fruit.poisson**2) / np.sqrt(np.pi) / least_deviation(contact_footprints(fruit, tips)[1])
    bent += own * 0.25 * slope**2
    return bent - smooth_pair(block, fruit.poisson, tips) - sharper


def solid_change(fruit: Fruit, tips: Tips, size: SizeField) -> float:
    """Return the change of s11 - s12 from the equivalent block to the curved solid [1/mm], on meshes of equal sizes."""
    shape, place = CurvedShape(fruit, Plan(0.0, 0.0)), tips.centres_mm[1]
    curvature = shape.mean_curvature(place, 0.0)
    sharper = LOG_OFFSET * curvature * log_coefficient(fruit.poisson, shape.slope(place, 0.0))
    block, solid = block_mesh(fruit, tips, size), curved_mesh(fruit, tips, size)
    return smooth_pair(solid, fruit.poisson, tips) - smooth_pair(block, fruit.poisson, tips) - sharper
