"""The mesh of the half y >= 0 of the housing: curved quadratic hexahedra, swept from the profile along y.

The named boundaries are low_tip, high_tip, mounting_holes, side_faces, symmetry, low_leaves and high_leaves. The
boundaries low_leaves and high_leaves are the surfaces of the leaves, where the strain is largest.
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
from mesh.housing.blocks import ElementCounts, element_counts, straight_ends
from mesh.housing.frame import housing_blocks, post_columns
from mesh.housing.profile import Profile, mesh_profile
from mesh.quality import compare, named_facets
from mesh.session import Ints, MeshError, index_by_nodes
from sensor.arrays import Floats

FlexureMesh = MeshHex2

MIN_SCALED_JACOBIAN = 0.1  # smallest allowed scaled Jacobian
MAX_STRETCH = 1.25  # largest factor by which a mesh is stretched or compressed; beyond it, a new mesh is made
# Elements replace arcs by parabolas through three points, which changes volume and area. The hole is the worst case,
# because its circle may consist of only nine parabolas.
_VOLUME_TOLERANCE = 1e-4  # allowed relative difference in volume
_AREA_TOLERANCE = 2e-3  # allowed relative difference in area
_VOLUME_ORDER = 5  # polynomial degree up to which the volume quadrature is exact
_CHECK_ORDER = 3  # degree of the quadrature whose points, 2^3 in each element, are used to check the Jacobian
# Thickness ratio of successive layers, from the side face inwards. Anticlastic bending decays near the side face.
_LAYER_GROWTH = 2.0
_NEAR = 1e-7  # distance below which two points are considered equal [mm]
_SAME_HOUSING = "make the mesh and the solid from the same housing"
_CORNERS = {(0, 0): 0, (1, 0): 1, (1, 1): 2, (0, 1): 3}  # corners of a quadrilateral, counterclockwise


def flexure_mesh(housing: Housing, scale: float = 1.0, layers: int | None = None) -> MeshHex2:
    """Return the mesh [mm] of the half y >= 0 of a housing, with the relative element size `scale` [1].

    `scale` is 1 for the mesh of the solution, 2 for the coarse mesh of its error estimate, and 0.5 for a reference
    solution. `layers` is the number of elements through half the depth. By default it is two, or more if `scale` is
    less than 1. Raises MeshError if the profile cannot be divided into blocks or an element is folded, and MachineError
    if gmsh fails.
    """
    if layers is None:
        layers = 2 if scale >= 1.0 else 1 + round(1.0 / scale)
    return mesh_of_counts(housing, element_counts(housing, scale), layers)


# The mesh for which the leaf lengths are fitted is also written to a file, and solved under other loads.
@functools.lru_cache(maxsize=3)
def mesh_of_counts(housing: Housing, counts: ElementCounts, layers: int) -> MeshHex2:
    """Return the mesh [mm] of the half y >= 0, with the given numbers of elements along the curves of the profile.

    `layers` is the number of elements through half the depth. Raises MeshError if the profile cannot be divided into
    blocks or an element is folded, and MachineError if gmsh fails.
    """
    profile = mesh_profile(housing_blocks(housing, counts))
    straight = sweep_profile(profile, 0.5 * housing.depth * half_depth_fractions(layers))
    quadratic = MeshHex2.from_mesh(straight)
    nodes = curved_nodes(quadratic, profile)
    nodes[1] *= _depth_fraction(housing, nodes[0], nodes[2])  # necks and tips do not have the full depth
    mesh = dataclasses.replace(quadratic, doflocs=nodes)
    mesh = mesh.with_boundaries(_boundaries(housing, profile, straight))
    check_jacobian(mesh)
    return mesh


def stretch_leaves(mesh: MeshHex2, old_housing: Housing, new_housing: Housing) -> MeshHex2 | None:
    """Adapt the mesh of the housing `old_housing` to the leaf lengths of the housing `new_housing`, without remeshing.

    The mesh is stretched in x along the straight leaves and in the plain cells of the walls. All other elements are
    only shifted. Plain cells lie between the leaf roots and the screw holes of a wall that is wider than its post. The
    result is None if the mesh would be stretched or compressed by more than `MAX_STRETCH`. It is also None if only one
    of the housings has plain cells. Raises MeshError if the housings differ in more than their leaf lengths, or if the
    stretched mesh has a folded element.
    """
    flexures = {}
    for old_arm, new_arm in zip(old_housing.arms, new_housing.arms, strict=True):
        flexures[old_arm.name] = dataclasses.replace(old_arm.flexure, length=new_arm.flexure.length)
    if old_housing.with_flexures(flexures) != new_housing:
        raise MeshError("stretch", "the housings differ in more than their leaf lengths", "make a new mesh")
    old_knots = _stretch_knots(old_housing)
    new_knots = _stretch_knots(new_housing)
    if len(old_knots) != len(new_knots):  # only one of the housings has a wall with plain cells
        return None
    ratios = np.diff(new_knots) / np.diff(old_knots)  # the factor by which each interval is stretched
    if ratios.min() < 1.0 / MAX_STRETCH or ratios.max() > MAX_STRETCH:
        return None
    points = mesh.doflocs.copy()
    points[0] = np.interp(points[0], old_knots, new_knots)  # only x changes
    stretched = dataclasses.replace(mesh, doflocs=points)
    check_jacobian(stretched)
    return stretched


def check_flexure_mesh(mesh: MeshHex2, solid: PartSize) -> None:
    """Raise MeshError unless the mesh agrees with the solid in volume, surface area and the areas of named faces.

    The mesh is half the housing, so its volume and areas are doubled. Relative differences of 1e-4 in volume and 2e-3
    in area are allowed. The check of the surface area also detects adjacent elements that do not share a facet, because
    their facets are counted as surface.
    """
    points, weights = get_quadrature(RefHex, _VOLUME_ORDER)
    volume = 2.0 * float((np.abs(determinant(cell_jacobian(mesh, points))) * weights).sum())
    compare("volume", volume, solid.volume, _VOLUME_TOLERANCE, _SAME_HOUSING)
    outer_facets = np.setdiff1d(mesh.boundary_facets(), (mesh.boundaries or {}).get("symmetry", []))
    compare("surface", 2.0 * facets_area(mesh, outer_facets), solid.surface, _AREA_TOLERANCE, _SAME_HOUSING)
    for name, expected_area in solid.areas.items():
        area = 2.0 * facets_area(mesh, named_facets(mesh, name))
        compare(f"area of face {name!r}", area, expected_area, _AREA_TOLERANCE, _SAME_HOUSING)


def check_jacobian(mesh: MeshHex2) -> None:
    """Raise MeshError if an element is folded or nearly folded at one of its corners or quadrature points.

    The measure is the scaled Jacobian: det J divided by the product of the lengths of the columns of J. The scaled
    Jacobian is 1 for a brick and 0 for a flat element.
    """
    points = np.hstack([RefHex.p, get_quadrature(RefHex, _CHECK_ORDER)[0]])
    jacobian = cell_jacobian(mesh, points)
    scaled = determinant(jacobian) / np.linalg.norm(jacobian, axis=0).prod(axis=0)  # shape (elements, points)
    # The nodes of an element may be numbered in the opposite order, which makes its determinant negative. The sign of
    # the determinant must not change inside an element.
    quality = (scaled * np.sign(scaled[:, :1])).min(axis=1)
    worst_element = int(np.argmin(quality))
    if not quality[worst_element] >= MIN_SCALED_JACOBIAN:
        x, y, z = mesh.p[:, mesh.t[:, worst_element]].mean(axis=1)
        reason = f"smallest scaled Jacobian = {quality[worst_element]:.3g} at ({x:.3g}, {y:.3g}, {z:.3g}) mm"
        raise MeshError("quality", f"{reason}: must be at least {MIN_SCALED_JACOBIAN:g}", "check the dimensions there")


def _depth_fraction(housing: Housing, x: Floats, z: Floats) -> Floats:
    """Return the depth of the housing at points (x, z) [mm], as a fraction of its full depth [1].

    The fraction is less than 1 in necks and tips, and 1 everywhere else.
    """
    levels = (housing.tip_height, housing.neck_level)
    fraction = np.interp(z, levels, [housing.depth_share(level) for level in levels])
    largest_x = 0.5 * (housing.spacing + housing.shuttle_width)  # necks and tips lie within this distance of x = 0
    return np.where(np.abs(x) < largest_x + _NEAR, fraction, 1.0)


def half_depth_fractions(layers: int) -> Floats:
    """Return the boundaries of the layers through half the depth, shape (layers + 1,).

    The boundaries increase from 0 at the middle of the depth to 1 at the side face. The layers become thinner towards
    the side face.
    """
    thicknesses = _LAYER_GROWTH ** -np.arange(layers)
    return np.concatenate([[0.0], np.cumsum(thicknesses) / thicknesses.sum()])


def sweep_profile(profile: Profile, levels: Floats) -> MeshHex1:
    """Sweep a profile through increasing levels y [mm], and return the straight-sided hexahedra.

    If the profile has n points, node k n + i of the mesh is point i of the profile at level k.
    """
    n = profile.points.shape[1]
    layers = len(levels) - 1
    x, z = profile.points
    points = np.vstack([np.tile(x, layers + 1), np.repeat(levels, n), np.tile(z, layers + 1)])
    # Corner (r, s, t) of the unit cube maps to corner (r, s) of the quadrilateral. The lower level of a layer has
    # t = 0, and the upper level has t = 1.
    cells = []
    for layer in range(layers):
        corners = [profile.quads[_CORNERS[r, s]] + n * (layer + t) for r, s, t in RefHex.p.T.astype(int).tolist()]
        cells.append(np.stack(corners))
    return MeshHex1(points, np.hstack(cells))


def curved_nodes(mesh: MeshHex2, profile: Profile) -> Floats:
    """Return the nodes (3, n) [mm] of a swept mesh after moving the midside nodes of edges on arcs onto these arcs.

    The centre nodes of quadrilaterals and hexahedra are moved accordingly.
    """
    points = np.asarray(mesh.doflocs, dtype=np.float64).copy()
    chord_middles = profile.points[:, profile.arcs].mean(axis=1)
    edge_shifts = profile.midpoints - chord_middles

    # The centre of a quadrilateral moves by half the sum of the shifts of its edges. The shape functions of an
    # eight-node quadrilateral, which has no node at its centre, map the centre to the same position.
    centres = profile.points[:, profile.quads].mean(axis=1)
    centre_shifts = np.zeros_like(centres)
    for side in range(4):
        next_corner = (side + 1) % 4  # the last side ends at the first corner
        arc = index_by_nodes(profile.arcs, profile.quads[[side, next_corner]])  # -1 for a straight side
        is_arc = arc >= 0
        centre_shifts[:, is_arc] += 0.5 * edge_shifts[:, arc[is_arc]]

    # A node of the swept mesh gets the shift of the edge middle or centre of the profile that has the same x and z. A
    # node without such a partner does not move.
    moved_points = np.hstack([chord_middles, centres])
    shifts = np.hstack([edge_shifts, centre_shifts])
    distance, index = cKDTree(moved_points.T).query(points[[0, 2]].T)
    points[[0, 2]] += np.where(distance < _NEAR, shifts[:, index], 0.0)
    return points


def _boundaries(housing: Housing, profile: Profile, mesh: MeshHex1) -> dict[str, Ints]:
    """Return the indices of the facets on each named boundary of the half housing.

    `mesh` is the straight-sided swept mesh, before necks and tips are made shallower. Facets are identified by their
    node numbers, which `sweep_profile` defines.
    """
    n = profile.points.shape[1]
    boundary_facets = mesh.boundary_facets()
    corners = mesh.facets[:, boundary_facets]
    x, y, z = mesh.p[:, corners]  # each of shape (4, facets), for the four corners of a facet
    # The tip faces consist of the facets at z = 0. Each facet belongs to the nearest tip.
    is_tip_facet = np.abs(z).max(axis=0) < _NEAR
    nearest_arm = np.argmin([np.abs(x.mean(axis=0) - arm.centre) for arm in housing.arms], axis=0)
    boundaries = {}
    for i, arm in enumerate(housing.arms):
        boundaries[f"{arm.name}_tip"] = boundary_facets[is_tip_facet & (nearest_arm == i)]
    boundaries["symmetry"] = boundary_facets[(corners < n).all(axis=0)]  # the first n nodes lie at y = 0
    # On necks and tips, the side of the housing does not lie in the side face.
    y_solid = y * _depth_fraction(housing, x, z)
    boundaries["side_faces"] = boundary_facets[(np.abs(y_solid - 0.5 * housing.depth) < _NEAR).all(axis=0)]
    # The corners of a facet that is swept from an edge of the profile are the two ends of this edge, at two levels. The
    # remainder of a node number is the number of its point in the profile.
    profile_points = corners % n
    edge_ends = np.stack([profile_points.min(axis=0), profile_points.max(axis=0)])
    for name, edges in profile.surfaces.items():
        boundaries[name] = boundary_facets[index_by_nodes(edges, edge_ends) >= 0]
    return boundaries


def _stretch_knots(housing: Housing) -> list[float]:
    """Return the knots of the map that stretches a mesh along x: its x coordinates [mm], from left to right.

    The map is linear between two knots. The knots are the outer faces of the housing, and both ends of each part that
    may be stretched. These parts are the straight leaves, and the plain cells of a wall that is wider than its post.
    """
    ends: list[float] = []
    for arm in housing.arms:
        ends += straight_ends(arm)
        start, end = post_columns(housing, arm, element_counts(housing, 1.0))  # the same for all element counts
        if start != end:
            ends += (start, end)
    return [housing.left, *sorted(ends), housing.right]
