"""The half y >= 0 of the housing in curved quadratic hexahedra: its profile swept through half the depth.

The named boundaries are low_tip, high_tip, mounting_holes, side_faces and symmetry, and also low_leaves and
high_leaves, the surfaces of the leaves with the largest strain.
"""

import dataclasses
import functools

import numpy as np
from scipy.spatial import cKDTree
from skfem import MeshHex1, MeshHex2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefHex

from cad.parts.housing import Housing, PartSize
from mesh.cells import cell_jacobian, determinant, facets_area
from mesh.housing.blocks import Counts, counts, straight_ends
from mesh.housing.frame import housing_blocks, post_columns
from mesh.housing.profile import Profile, mesh_profile
from mesh.quality import compare, named_facets
from mesh.session import Ints, MeshError, index_by_nodes
from sensor.arrays import Floats

FlexureMesh = MeshHex2

LEAST_JACOBIAN = 0.1  # smallest allowed scaled Jacobian
LONGEST_STRETCH = 1.25  # largest factor by which a mesh is stretched or compressed; beyond it, a new mesh is made
_VOLUME_TOLERANCE = 1e-4  # relative error in volume where parabolas through three points replace arcs
_AREA_TOLERANCE = 2e-3  # relative error in area of holes, which may consist of only nine such parabolas
_VOLUME_ORDER = 5  # polynomial degree of the quadrature
_LAYER_GROWTH = 2.0  # thickness ratio of successive layers inwards; anticlastic bending decays near the side face
_NEAR = 1e-7  # distance below which points are taken as equal [mm]
_VERY = "mesh the same housing that the solid was made of"
_CORNERS = {(0, 0): 0, (1, 0): 1, (1, 1): 2, (0, 1): 3}  # corners of a quadrilateral, counterclockwise


def flexure_mesh(housing: Housing, scale: float = 1.0, layers: int | None = None) -> MeshHex2:
    """Return the mesh [mm] of the half y >= 0 of a housing, at a relative element size `scale` [1].

    `scale` is 1 for the mesh of the solve, 2 for the coarse mesh of its error estimate, and 0.5 for a reference.
    `layers` is the number of elements through half the depth, by default two or, for a finer mesh, more. Raises
    MeshError if the profile cannot be divided into blocks or an element is folded, and MachineError if gmsh fails.
    """
    if layers is None:
        layers = 2 if scale >= 1.0 else 1 + round(1.0 / scale)
    return mesh_of_counts(housing, counts(housing, scale), layers)


@functools.lru_cache(maxsize=3)  # the mesh of the length fit is also written to a file and solved under other loads
def mesh_of_counts(housing: Housing, count: Counts, layers: int) -> MeshHex2:
    """Return the mesh [mm] of the half y >= 0, with the given numbers of elements along the curves of the profile.

    `layers` is the number of elements through half the depth. Raises the errors of `flexure_mesh`.
    """
    profile = mesh_profile(housing_blocks(housing, count))
    straight = sweep_profile(profile, 0.5 * housing.depth * half_depth_shares(layers))
    quadratic = MeshHex2.from_mesh(straight)
    nodes = curved_nodes(quadratic, profile)
    nodes[1] *= _depth_fraction(housing, nodes[0], nodes[2])  # necks and tips are shallower in y than the housing
    mesh = dataclasses.replace(quadratic, doflocs=nodes)
    mesh = mesh.with_boundaries(_boundaries(housing, profile, straight))
    check_jacobian(mesh)
    return mesh


def stretch_leaves(mesh: MeshHex2, made_for: Housing, wanted: Housing) -> MeshHex2 | None:
    """Return the mesh of the housing `made_for`, adapted to the leaf lengths of the housing `wanted`.

    x is stretched along the straight leaves and in the plain cells of the walls; everything else is shifted. Returns
    None if the required stretch is larger than `LONGEST_STRETCH`. Raises MeshError if the housings differ in more than
    their leaf lengths, or if the stretched mesh has a folded element.
    """
    flexures = {}
    for old_arm, new_arm in zip(made_for.arms, wanted.arms, strict=True):
        flexures[old_arm.name] = dataclasses.replace(old_arm.flexure, length=new_arm.flexure.length)
    if made_for.with_flexures(flexures) != wanted:
        raise MeshError("stretch", "the housings differ in more than their leaf lengths", "make a fresh mesh")
    old = _knots(made_for)
    new = _knots(wanted)
    if len(old) != len(new):  # only one of the housings has a wall with plain cells
        return None
    ratios = np.diff(new) / np.diff(old)
    if ratios.min() < 1.0 / LONGEST_STRETCH or ratios.max() > LONGEST_STRETCH:
        return None
    points = mesh.doflocs.copy()
    points[0] = np.interp(points[0], old, new)
    stretched = dataclasses.replace(mesh, doflocs=points)
    check_jacobian(stretched)
    return stretched


def check_flexure_mesh(mesh: MeshHex2, solid: PartSize) -> None:
    """Raise MeshError unless the volume, the surface area and the named areas of the mesh agree with the solid.

    The values of the mesh are doubled, because it is half the housing. Relative differences of 1e-4 in volume and 2e-3
    in area are allowed. The surface area is too large if neighbouring elements do not share their facets.
    """
    points, weights = get_quadrature(RefHex, _VOLUME_ORDER)
    volume = 2.0 * float((np.abs(determinant(cell_jacobian(mesh, points))) * weights).sum())
    compare("volume", volume, solid.volume, _VOLUME_TOLERANCE, _VERY)
    skin = np.setdiff1d(mesh.boundary_facets(), (mesh.boundaries or {}).get("symmetry", []))
    compare("surface", 2.0 * facets_area(mesh, skin), solid.surface, _AREA_TOLERANCE, _VERY)
    for name, expected in solid.areas.items():
        area = 2.0 * facets_area(mesh, named_facets(mesh, name))
        compare(f"area of face {name!r}", area, expected, _AREA_TOLERANCE, _VERY)


def check_jacobian(mesh: MeshHex2) -> None:
    """Raise MeshError if an element is folded or nearly folded, at its corners or at quadrature points.

    The measure is the scaled Jacobian: det J over the product of the lengths of the columns of J. It is 1 for a brick
    and 0 for a flat element.
    """
    jacobian = cell_jacobian(mesh, np.hstack([RefHex.p, get_quadrature(RefHex, 3)[0]]))
    quality = determinant(jacobian) / np.linalg.norm(jacobian, axis=0).prod(axis=0)
    # The nodes of an element may be numbered in the opposite sense, but the sign must not change inside it.
    quality = (quality * np.sign(quality[:, :1])).min(axis=1)
    worst_element = int(np.argmin(quality))
    if not quality[worst_element] >= LEAST_JACOBIAN:
        x, y, z = mesh.p[:, mesh.t[:, worst_element]].mean(axis=1)
        reason = f"smallest scaled Jacobian = {quality[worst_element]:.3g} at ({x:.3g}, {y:.3g}, {z:.3g}) mm"
        raise MeshError("quality", f"{reason}: must be at least {LEAST_JACOBIAN:g}", "check the dimensions there")


def _depth_fraction(housing: Housing, x: Floats, z: Floats) -> Floats:
    """Return the depth of the housing in y at points (x, z) [mm] over its full depth [1].

    It is less than 1 in necks and tips, and 1 in the rest of the housing.
    """
    levels = (housing.tip_height, housing.neck_level)
    fraction = np.interp(z, levels, [housing.depth_share(level) for level in levels])
    reach = 0.5 * (housing.spacing + housing.shuttle_width)
    return np.where(np.abs(x) < reach + _NEAR, fraction, 1.0)


def half_depth_shares(layers: int) -> Floats:
    """Return the boundaries of layers, from 0 at the middle of the depth to 1 at the side face, shape (layers + 1,).

    Layers get thinner towards the side face.
    """
    thicknesses = _LAYER_GROWTH ** -np.arange(layers)
    return np.concatenate([[0.0], np.cumsum(thicknesses) / thicknesses.sum()])


def sweep_profile(profile: Profile, levels: Floats) -> MeshHex1:
    """Return the straight-sided hexahedra of a profile swept through rising levels y [mm].

    If the profile has n points, node k n + i of the mesh is point i of the profile at level k.
    """
    n = profile.points.shape[1]
    layers = len(levels) - 1
    x, z = profile.points
    points = np.vstack([np.tile(x, layers + 1), np.repeat(levels, n), np.tile(z, layers + 1)])
    # Corner (r, s, t) of the unit cube is corner (r, s) of a quadrilateral at the lower (t = 0) or upper (t = 1) level.
    cells = []
    for layer in range(layers):
        corners = [profile.quads[_CORNERS[r, s]] + n * (layer + t) for r, s, t in RefHex.p.T.astype(int).tolist()]
        cells.append(np.stack(corners))
    return MeshHex1(points, np.hstack(cells))


def curved_nodes(mesh: MeshHex2, profile: Profile) -> Floats:
    """Return the nodes (3, n) [mm] of a swept mesh, with the middles of edges on arcs moved onto these arcs.

    The centre nodes of quadrilaterals and of hexahedra are moved accordingly.
    """
    points = np.asarray(mesh.doflocs, dtype=np.float64).copy()
    straight = profile.points[:, profile.arcs].mean(axis=1)
    shift = profile.midpoints - straight

    # The centre of a quadrilateral moves by half the sum over its curved edges, as in a 20-node element.
    centres = profile.points[:, profile.quads].mean(axis=1)
    centre_shift = np.zeros_like(centres)
    for side in range(4):
        arc = index_by_nodes(profile.arcs, profile.quads[[side, (side + 1) % 4]])
        on_arc = arc >= 0
        centre_shift[:, on_arc] += 0.5 * shift[:, arc[on_arc]]

    # These shifts are known in the profile. A node of the swept mesh has the shift of the profile point below it, and
    # no shift if no such point is there.
    moved_points = np.hstack([straight, centres])
    shifts = np.hstack([shift, centre_shift])
    distance, index = cKDTree(moved_points.T).query(points[[0, 2]].T)
    points[[0, 2]] += np.where(distance < _NEAR, shifts[:, index], 0.0)
    return points


def _boundaries(housing: Housing, profile: Profile, mesh: MeshHex1) -> dict[str, Ints]:
    """Return the indices of the facets on each named boundary of the half housing.

    `mesh` is the straight-sided swept mesh at full depth. Its node numbers identify facets, as in `sweep_profile`.
    """
    n = profile.points.shape[1]
    boundary_facets = mesh.boundary_facets()
    corners = mesh.facets[:, boundary_facets]
    x, y, z = mesh.p[:, corners]  # each (4 corners, facets)
    on_base = np.abs(z).max(axis=0) < _NEAR
    nearest = np.argmin([np.abs(x.mean(axis=0) - arm.centre) for arm in housing.arms], axis=0)
    boundaries = {}
    for i, arm in enumerate(housing.arms):
        boundaries[f"{arm.name}_tip"] = boundary_facets[on_base & (nearest == i)]
    boundaries["symmetry"] = boundary_facets[(corners < n).all(axis=0)]  # the first n nodes lie at y = 0
    # On tapered necks the side of the mesh does not lie in the side face.
    y_solid = y * _depth_fraction(housing, x, z)
    boundaries["side_faces"] = boundary_facets[(np.abs(y_solid - 0.5 * housing.depth) < _NEAR).all(axis=0)]
    # A facet swept from an edge of the profile has the two end points of this edge, each at two levels.
    profile_points = corners % n
    ends = np.stack([profile_points.min(axis=0), profile_points.max(axis=0)])
    for name, edges in profile.surfaces.items():
        boundaries[name] = boundary_facets[index_by_nodes(edges, ends) >= 0]
    return boundaries


def _knots(housing: Housing) -> list[float]:
    """Return x [mm], from left to right, of the outer faces and of both ends of each part that may be stretched.

    These parts are the straight leaves, and the plain cells of a wall that is wider than its post.
    """
    ends: list[float] = []
    for arm in housing.arms:
        ends += straight_ends(arm)
        start, end = post_columns(housing, arm, counts(housing, 1.0))
        if start != end:
            ends += (start, end)
    return [housing.left, *sorted(ends), housing.right]
