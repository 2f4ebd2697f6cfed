"""The mesh of an extruded part: its cross-section is divided into quadrilaterals and swept through the depth.

The elements are small where a wall is thin. The named boundaries are the part's named faces and up to four more.
`side_faces` are the ends of the sweep, and `fillets` are the round inner corners of the section. `walls` are the
remaining walls, which carry no load. `symmetry` is the plane of symmetry if only half of the part is meshed.
"""

import dataclasses
import functools
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import gmsh
import numpy as np
from skfem import MeshHex1, MeshHex2

from mesh.cells import facets_area
from mesh.housing.profile import Profile, order_counterclockwise
from mesh.housing.sweep import check_jacobian, curved_nodes, half_depth_fractions, sweep_profile
from mesh.session import (
    CURVE,
    SURFACE,
    Ints,
    MeshError,
    Nodes,
    bounding_curves,
    element_nodes,
    gmsh_session,
    import_brep,
    index_by_nodes,
    stage,
    used_nodes,
)
from sensor.arrays import Flags, Floats

if TYPE_CHECKING:
    from cad.checks.own_part import Extrusion

SIDES, FILLETS, WALLS, SYMMETRY = "side_faces", "fillets", "walls", "symmetry"
_HINT = "check the solid at its smallest faces"
_OUTLINE_SAMPLES = 2000  # approximate number of points on the outline at which the wall thickness is measured
_MIN_CURVE_SAMPLES = 8  # smallest number of sampled points on one curve of the outline
_QUADS_PER_THICKNESS = 1.0  # number of quadrilaterals across a wall, before gmsh divides each into four
_QUADS_PER_QUARTER_ARC = 3.0  # number along a 90-degree inner fillet, before gmsh divides each into four
_LINE_SPACING_MM = 0.4  # distance between the lines along which the mesh is compared with the part
_MAX_LINES_PER_SIDE = 10  # maximum number of comparison lines along a side of a quadrilateral
# A point is redundant if the other points imply an element size there of at most this multiple of its own size.
_REDUNDANCY_RATIO = 1.05
_BIN_FRACTION = 0.02  # width of a bin as a fraction of the longest side of the part
_GROWTH = 0.45  # growth of the element size with distance [mm per mm]
_NEAR = 1e-6  # distance below which two points are considered equal [mm]
_NEAR_FRACTION = 1e-6  # distance below which two points are considered equal, as a fraction of the section's span
# A point with a cross product [mm^2] down to minus this number is considered to be on a side of a quadrilateral.
_SIDE_TOLERANCE = 1e-6
_ON_FACE = 10.0 * _NEAR  # largest distance of the middle of a facet from the face on which it lies [mm]
_PARALLEL = 1e-12  # a ray and a segment are parallel if their cross product [mm] is smaller than this
# The depth at a node is measured at this fraction of the way from the node to the centre of a quadrilateral.
_INWARD_FRACTION = 1e-3
_AREA_TOLERANCE = 0.02  # largest allowed relative difference in area between a face and the facets on it
# A region is swept through the full depth if more than this fraction of its quadrilaterals has the full depth.
_FULL_DEPTH_FRACTION = 0.5
_SHARP_TURN_RAD = np.radians(15.0)  # smallest change of direction of the outline at a sharp inner corner
_TEST_DISTANCE = 1e-4  # distance of a test point from a corner, as a fraction of the span
# Number of passes in which gmsh moves inner nodes to improve the angles.
_RELOCATION_PASSES = 10
_FRONTAL_DELAUNAY = 6.0  # gmsh's number for the Frontal-Delaunay algorithm
_MIN_CURVATURE_PER_MM = 1e-9  # smallest curvature of a curve [1/mm], so that a straight line has a finite radius
_STRAIGHT_SPANS = 1e3  # smallest radius of curvature of a practically straight curve, as a multiple of the span


@dataclass(frozen=True, kw_only=True, eq=False)
class SweptPart:
    """The mesh of a swept part, with one column of cells on each quadrilateral of the profile.

    `depth` (points,) [mm] is the length of the mesh along y at each point of the profile. `area` (quadrilaterals,)
    [mm^2] holds the areas of the quadrilaterals. `cells` (layers, quadrilaterals) holds the indices of the cells in
    each column. `meshed_fraction` is the fraction of the solid that is meshed, 1 or 0.5. `centres` (3, quadrilaterals)
    [mm] are the centres of the columns in the whole solid. `corner` (quadrilaterals,) is the index of the sharp inner
    corner that a quadrilateral touches, or -1. `corner_count` is the number of such corners.

    The mesh leaves out pockets and ribs of the part, so a column may be too long or too short. `length_error` is the
    error in the length of a column, and `effective_length_error` is the error in length that has the same effect on the
    stiffness.
    """

    mesh: MeshHex2
    extrusion: "Extrusion"
    profile: Profile
    depth: Floats
    area: Floats
    cells: Ints
    meshed_fraction: float
    centres: Floats
    corner: Ints
    corner_count: int

    @functools.cached_property
    def _length_errors(self) -> tuple[Floats, Floats]:
        """Return both errors in length, which take a second to compute and are needed only for the final mesh."""
        sampled = _sampled_length_errors(self.extrusion, self.profile, self.depth, self.area)
        from_features, effect = _feature_length_errors(self.extrusion, self.profile, self.depth, self.area)
        return np.maximum(sampled, from_features), np.maximum(sampled, effect)

    @property
    def length_error(self) -> Floats:
        """Return the absolute error in the length of each column of cells [mm], shape (quadrilaterals,)."""
        return self._length_errors[0]

    @property
    def effective_length_error(self) -> Floats:
        """Return the error in column length [mm] that would change the stiffness as much as the neglected features do.

        This error exceeds `length_error` if a neglected pocket is narrower than it is deep, or if the pocket leaves
        little of the depth. For example, a saw cut weakens a part as much as a round hole whose diameter is the length
        of the cut.
        """
        return self._length_errors[1]


@dataclass(frozen=True, kw_only=True)
class FineCorners:
    """The sharp inner corners of a section at which the mesh is refined, and the relative element size there.

    `numbers` are the indices of the corners. `size` [1] is the ratio of the element size to the wall thickness, or to
    the element size without refinement if that is smaller.
    """

    numbers: tuple[int, ...] = ()
    size: float = 1.0


@dataclass(frozen=True, eq=False)
class _Section:
    """A meshed section: its profile, and the region and the sharp inner corner of each quadrilateral.

    `region` (quadrilaterals,) is the index of the region that contains each quadrilateral. `corner` (quadrilaterals,)
    is the index of the sharp inner corner that it touches, or -1. `corner_count` is the number of such corners.
    """

    profile: Profile
    region: Ints
    corner: Ints
    corner_count: int


def swept_part(
    extrusion: "Extrusion",
    scale: float,
    layers: int,
    load_directions: Iterable[tuple[float, ...]] = (),
    fine: FineCorners = FineCorners(),
) -> SweptPart:
    """Divide the section of an extruded part into quadrilaterals, and sweep them through the depth [mm].

    `scale` [1] is the relative element size: 1 for the mesh of the solution, 2 for the coarse mesh of its error
    estimate. `layers` is the number of layers of cells through half the depth. `load_directions` are the directions
    (x, y, z) of the loads, and `fine` lists the corners at which the mesh is refined. If the part, its named faces and
    the loads are symmetric about the middle of the depth, only the upper half is meshed. Raises MeshError if no valid
    mesh is found, and MachineError if gmsh fails.
    """
    section = _meshed_section(extrusion, scale, fine)
    profile = section.profile
    low, high = _sweep_ends(extrusion, section)
    is_half = _can_mesh_half(extrusion, load_directions, low, high)
    levels = _layer_boundaries(layers, is_half=is_half)
    straight = _sweep_between(profile, levels, low, high)
    curved = _curve_edges(straight, profile)
    boundaries = _boundaries(extrusion, profile, straight, is_half=is_half)
    check_jacobian(curved)
    x, z = profile.points[:, profile.quads].mean(axis=1)
    middle = 0.5 * (extrusion.low + extrusion.high)
    return SweptPart(
        mesh=curved.with_boundaries(boundaries),
        extrusion=extrusion,
        profile=profile,
        depth=high - low,
        area=_quadrilateral_areas(profile),
        cells=np.arange(straight.t.shape[1]).reshape(len(levels) - 1, -1),  # the sweep numbers cells layer by layer
        meshed_fraction=0.5 if is_half else 1.0,
        centres=np.stack([x, np.full_like(x, middle), z]),
        corner=section.corner,
        corner_count=section.corner_count,
    )


def _quadrilateral_areas(profile: Profile) -> Floats:
    """Return the area of each quadrilateral of a profile [mm^2]: half the cross product of its diagonals."""
    corners = profile.points[:, profile.quads]
    return np.asarray(0.5 * np.abs(_cross_product(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])))


def _curve_edges(straight: MeshHex1, profile: Profile) -> MeshHex2:
    """Return quadratic elements whose edges are curved where the outline of the section is curved."""
    quadratic = MeshHex2.from_mesh(straight)
    return dataclasses.replace(quadratic, doflocs=curved_nodes(quadratic, profile))


def _can_mesh_half(
    extrusion: "Extrusion", load_directions: Iterable[tuple[float, ...]], low: Floats, high: Floats
) -> bool:
    """Return whether the upper half of the depth represents the whole part under its loads.

    The part and its named faces must be symmetric about the middle of the depth. No load may have a component along
    the sweep, because such a load is not symmetric. `load_directions` are vectors (x, y, z). `low` and `high` (points,)
    [mm] are the ends of the sweep.
    """
    middle = 0.5 * (extrusion.low + extrusion.high)
    is_loaded_in_plane = all(abs(y) < _NEAR for _, y, _ in load_directions)
    has_symmetric_faces = all(extrusion.has_centred_faces(name) for name in extrusion.part.faces)
    has_symmetric_ends = bool(np.abs(low + high - 2.0 * middle).max() < 2.0 * _NEAR)  # each end may deviate by _NEAR
    return is_loaded_in_plane and has_symmetric_faces and has_symmetric_ends


def _layer_boundaries(layers: int, *, is_half: bool) -> Floats:
    """Return the boundaries of the layers, relative to the depth: from 1/2 to 1 for the upper half, or from 0 to 1.

    `layers` is the number of layers through half the depth.
    """
    # The boundaries are first measured from the middle of the depth, in units of half the depth.
    from_middle = half_depth_fractions(layers)
    if not is_half:
        mirrored = -from_middle[:0:-1]  # in increasing order, without the middle, which would be repeated
        from_middle = np.concatenate([mirrored, from_middle])
    return 0.5 + 0.5 * from_middle


def _sweep_between(profile: Profile, levels: Floats, low: Floats, high: Floats) -> MeshHex1:
    """Return the straight-sided hexahedra of a profile, swept from y = `low` to y = `high` (points,) [mm].

    `levels` are the boundaries of the layers, relative to the depth at each point of the profile: 0 at `low`, 1 at
    `high`.
    """
    relative_mesh = sweep_profile(profile, levels)
    points = relative_mesh.p.copy()
    relative_y = points[1].reshape(len(levels), -1)  # one row per level
    points[1] = (low + relative_y * (high - low)).ravel()
    return MeshHex1(points, relative_mesh.t)


def _sampled_length_errors(extrusion: "Extrusion", profile: Profile, depth: Floats, area: Floats) -> Floats:
    """Return the mean absolute error in the length of each column of cells [mm], shape (quadrilaterals,).

    The length of the mesh along y is compared with the length of the part, along the lines of a grid in each
    quadrilateral. `depth` (points,) [mm] is the length of the mesh at the points of the profile. `area`
    (quadrilaterals,) [mm^2] holds the areas of the quadrilaterals, which determine the number of lines.
    """
    mean_errors = np.zeros(len(area))
    lines_per_side = np.clip(np.ceil(np.sqrt(area) / _LINE_SPACING_MM), 1, _MAX_LINES_PER_SIDE).astype(int)
    # All quadrilaterals with the same number of lines are evaluated together.
    for count in np.unique(lines_per_side):
        quads = np.flatnonzero(lines_per_side == count)
        shapes = _grid_shapes(count)
        corners = profile.quads[:, quads]
        # The indices are i for x and z, j for the corner, k for the quadrilateral and q for the line.
        x, z = np.einsum("ijk,jq->ikq", profile.points[:, corners], shapes).reshape(2, -1)
        _, _, part_length = extrusion.material_spans(x, z)
        mesh_length = (depth[corners].T @ shapes).ravel()
        # A line can miss the part only just outside a curved outline. The final, curved elements follow that outline,
        # so such a line has no error.
        errors = np.where(part_length > 0.0, np.abs(mesh_length - part_length), 0.0)
        significant_errors = np.where(errors > _NEAR, errors, 0.0)  # smaller errors are round-off
        mean_errors[quads] = significant_errors.reshape(len(quads), -1).mean(axis=1)
    return mean_errors


def _grid_shapes(count: int) -> Floats:
    """Return the bilinear shape functions [1] of a quadrilateral at a grid of points, shape (4, count^2).

    The points are the middles (r, s) of `count` by `count` equal squares in the unit square. The shape functions
    interpolate values at the four corners, such as positions, to these points.
    """
    coordinates = (np.arange(count) + 0.5) / count
    r, s = np.repeat(coordinates, count), np.tile(coordinates, count)
    return np.stack([(1.0 - r) * (1.0 - s), r * (1.0 - s), r * s, (1.0 - r) * s])


def _feature_length_errors(
    extrusion: "Extrusion", profile: Profile, depth: Floats, area: Floats
) -> tuple[Floats, Floats]:
    """Return the errors in column length that neglected pockets and ribs cause, and their equivalents in stiffness.

    The faces of these features are taken from the solid, in small pieces, because a narrow feature may lie between the
    lines of `_sampled_length_errors`. At a piece, the lengths of the mesh and of the part along y differ by d [mm]. The
    piece adds two errors [mm] to the quadrilateral in which it lies: d A_p / A to its length error, and f d A_p / A to
    its equivalent error. Here A_p is the area of the piece, A is the area of the quadrilateral [mm^2], and f is given
    by `_weakening`.

    `depth` (points,) [mm] is the length of the mesh along y, and `area` (quadrilaterals,) [mm^2] the area of each
    quadrilateral. Both results [mm] have shape (quadrilaterals,).
    """
    length_errors, equivalent_errors = np.zeros(len(area)), np.zeros(len(area))
    pieces = list(extrusion.feature_pieces())
    if not pieces:
        return length_errors, equivalent_errors
    # Each piece has a position (x, z) [mm], an area seen along y [mm^2], and the mean width of its face [mm].
    positions = np.array([position for position, _, _ in pieces]).T
    corners = profile.points[:, profile.quads]
    _, _, part_lengths = extrusion.material_spans(*positions)
    # A piece is left out if the line along y through its position misses the part.
    for i in np.flatnonzero(part_lengths > 0.0):
        _, piece_area, width = pieces[i]
        quad = _quadrilateral_at(positions[:, i], corners)
        if quad is None:
            continue
        corner_depths = depth[profile.quads[:, quad]]
        # Where its depth varies, the mesh follows a slanted face. `_sampled_length_errors` covers the error there.
        follows_slanted_face = np.ptp(corner_depths) > _NEAR
        mesh_length = float(corner_depths.mean())
        part_length = float(part_lengths[i])
        difference = abs(mesh_length - part_length)
        if follows_slanted_face or difference <= _NEAR:
            continue
        length_errors[quad] += difference * piece_area / area[quad]
        weakening = _weakening(mesh_length, part_length, width)
        equivalent_errors[quad] += weakening * difference * piece_area / area[quad]
    return length_errors, equivalent_errors


def _weakening(mesh_length: float, part_length: float, width: float) -> float:
    """Return the factor f [1] that converts the length error of a neglected feature to the error of equal stiffness.

    Along y, the mesh has the length L = `mesh_length` and the part the length l = `part_length` [mm]. `width` [mm] is
    the width of the feature. If L <= l, the feature is a rib, and f is 1. If L > l, the mesh fills a pocket of the part
    that is L - l deep. A pocket that is deeper than wide weakens the part as much as one that is as wide as deep. The
    stress in the remaining depth is L / l times as large.
    """
    if mesh_length <= part_length:
        return 1.0
    pocket_depth = mesh_length - part_length
    return max(1.0, pocket_depth / width) * mesh_length / part_length


def _quadrilateral_at(position: Floats, corners: Floats) -> int | None:
    """Return the index of the quadrilateral that contains a position (2,) [mm], or None if none of them does.

    `corners` (2, 4, quadrilaterals) [mm] are in counterclockwise order. A position inside a quadrilateral is therefore
    on the left of all its sides. A position on a side is considered to be inside.
    """
    sides = np.roll(corners, -1, axis=1) - corners
    cross_products = _cross_product(sides, position[:, None, None] - corners)  # positive on the left of a side
    quad = int(np.argmax(cross_products.min(axis=0)))
    return quad if cross_products[:, quad].min() >= -_SIDE_TOLERANCE else None


def _cross_product(a: Floats, b: Floats) -> Floats:
    """Return the scalar cross products of plane vectors (2, ...), shape (...)."""
    return np.asarray(a[0] * b[1] - a[1] * b[0])


def _meshed_section(extrusion: "Extrusion", scale: float, fine: FineCorners) -> _Section:
    """Divide the section of a part into quadrilaterals, and into regions bounded by the edges of slanted faces.

    `scale` [1] multiplies the element sizes, and `fine` lists the corners at which the mesh is refined. Raises
    MeshError if an element is not a quadrilateral, and MachineError if gmsh fails.
    """
    with gmsh_session():
        surfaces = _import_section(extrusion)
        with stage("size", _HINT):
            _request_quadrilaterals()
            outline = _Outline(surfaces)
            sizes = GradedSizes(*outline.element_sizes(scale, fine), _GROWTH)

            def size_at(dimension: int, _tag: int, x: float, _y: float, z: float, default_size: float) -> float:
                """Return the element size [mm] that gmsh requests at a position on an entity of this dimension."""
                # Inside a surface, gmsh by default interpolates the sizes on the outline.
                return default_size if dimension > CURVE else sizes.at(x, z)

            gmsh.model.mesh.setSizeCallback(size_at)
        with stage("generate", _HINT):
            gmsh.model.mesh.generate(2)
            gmsh.model.mesh.optimize("Relocate2D", niter=_RELOCATION_PASSES)
            gmsh.model.mesh.setOrder(2)  # adds the midside nodes, which lie on the curves of the outline
        with stage("read", _HINT):
            return _read_section(surfaces, outline.concave, outline.corners)


def _request_quadrilaterals() -> None:
    """Set gmsh's options so that it divides surfaces into quadrilaterals only.

    Triangles are recombined to quadrilaterals by the blossom algorithm. All elements are then divided into
    quadrilaterals, because some triangles may remain. Inside a surface, the element size follows the outline.
    """
    gmsh.option.setNumber("Mesh.Algorithm", _FRONTAL_DELAUNAY)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 1.0)
    gmsh.option.setNumber("Mesh.RecombineAll", 1.0)
    gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 1.0)
    gmsh.option.setNumber("Mesh.SubdivisionAlgorithm", 1.0)


def _import_section(extrusion: "Extrusion") -> list[int]:
    """Load the section into gmsh, split it along the edges of slanted faces, and return the tags of its surfaces."""
    occ = gmsh.model.occ
    imported = import_brep(lambda path: extrusion.section.exportBrep(str(path)), _HINT)
    with stage("import", _HINT):
        section = [(dimension, tag) for dimension, tag in imported if dimension == SURFACE]
        dividing_lines = []
        for ends in extrusion.lines:
            start, end = (occ.addPoint(x, extrusion.plane, z) for x, z in ends)  # the section lies in y = plane
            dividing_lines.append((CURVE, occ.addLine(start, end)))
        if dividing_lines:
            occ.fragment(section, dividing_lines)  # cuts the section along the lines into several surfaces
        occ.synchronize()
        surfaces = [tag for _, tag in gmsh.model.getEntities(SURFACE)]
        used_curves = set(bounding_curves(surfaces))
        # Pieces of the lines that lie outside the section are not the boundary of any surface.
        unused_curves = [(CURVE, tag) for _, tag in gmsh.model.getEntities(CURVE) if tag not in used_curves]
        occ.remove(unused_curves, recursive=True)
        occ.synchronize()
    return surfaces


class GradedSizes:
    """The element size at any position [mm], given the sizes required at some points.

    The size h at a position x is the minimum over all points i of h_i + growth * |x - x_i|. Because gmsh calls `at` a
    million times, space is divided into cubic bins. Each bin has a list of the points that can determine the size in
    it.
    """

    def __init__(self, points: Floats, sizes: Floats, growth: float) -> None:
        """Store the points that affect the size.

        `sizes` (n,) [mm] are required at `points` (dim, n) [mm], in a plane or in space, and grow with distance by
        `growth` [mm per mm]. A point is redundant, and is not stored, if the other points already imply its size to
        within 5 %.
        """
        relevant = np.zeros(0, dtype=np.int64)  # indices of the points that affect the size
        for i in np.argsort(sizes):  # the smallest size first, because it can make others redundant
            distance = np.linalg.norm(points[:, relevant] - points[:, i, None], axis=0)
            if not len(relevant) or (sizes[relevant] + growth * distance).min() > _REDUNDANCY_RATIO * sizes[i]:
                relevant = np.append(relevant, i)
        # Points in a plane get 0 as their third coordinate.
        self._points = np.vstack([points[:, relevant], np.zeros((3 - len(points), len(relevant)))])
        self._sizes = sizes[relevant]
        self._growth = growth
        self._bin_size = _BIN_FRACTION * float(np.ptp(points, axis=1).max())
        self._bins: dict[tuple[int, int, int], list[tuple[float, float, float, float]]] = {}

    def at(self, x: float, y: float, z: float = 0.0) -> float:
        """Return the element size at a position [mm]. In a plane, only two coordinates are given."""
        bin_indices = (int(x // self._bin_size), int(y // self._bin_size), int(z // self._bin_size))
        points = self._bins.get(bin_indices)
        if points is None:
            points = self._bins[bin_indices] = self._points_of_bin(bin_indices)
        growth, sqrt = self._growth, math.sqrt
        # A bin has only about ten points (a, b, c), for which NumPy would take five times as long as this loop.
        return min(
            [
                size + growth * sqrt((a - x) * (a - x) + (b - y) * (b - y) + (c - z) * (c - z))
                for a, b, c, size in points
            ]
        )

    def _points_of_bin(self, bin_indices: tuple[int, int, int]) -> list[tuple[float, float, float, float]]:
        """Return the points (x, y, z, size) that can determine the size somewhere in the bin with these indices."""
        middle = (np.array(bin_indices) + 0.5)[:, None] * self._bin_size
        size_at_middle = self._sizes + self._growth * np.linalg.norm(self._points - middle, axis=0)
        # From the middle of the bin to a corner, the size implied by one point may grow, and the size implied by
        # another point may shrink. Each changes by at most the growth over half a diagonal of the bin, so their
        # difference changes by at most the growth over a diagonal.
        margin = self._growth * self._bin_size * np.sqrt(len(bin_indices))
        relevant = size_at_middle <= size_at_middle.min() + margin
        points, sizes = self._points.T[relevant].tolist(), self._sizes[relevant].tolist()
        return [(x, y, z, size) for (x, y, z), size in zip(points, sizes, strict=True)]


@dataclass(frozen=True, eq=False)
class _CurveEnd:
    """One end of a curve.

    `position` (2,) [mm] is the end point, and `direction` (2,) the unit tangent from there into the curve. `sample` is
    the index of the nearest sample.
    """

    position: Floats
    direction: Floats
    sample: int


@dataclass(frozen=True, eq=False)
class _SampledCurve:
    """One curve of the outline, approximated by n chords, with one sample at the middle of each chord.

    `tag` is gmsh's tag of the curve. `chords` (2, 2, n) [mm] are the start points and the end points of the chords, and
    `points` (2, n) [mm] their middles. `tangents` (2, n) are the unit tangents of the curve. `radii` (n,) [mm] are its
    radii of curvature, positive if the curve turns left. `ends` are the two end points of the curve [mm], each with the
    unit tangent into the curve.
    """

    tag: int
    chords: Floats
    points: Floats
    tangents: Floats
    radii: Floats
    ends: list[tuple[Floats, Floats]]


class _Outline:
    """The outline of a section, sampled at n points, with the wall thickness at each sample.

    `points` (2, n) [mm] are the samples. `corners` (2, m) [mm] are the sharp inner corners. `concave` is the set of
    gmsh's tags of the curves that are round inner corners.
    """

    def __init__(self, surfaces: list[int]) -> None:
        """Sample the outline of the section whose surfaces have these gmsh tags, and find its inner corners."""
        curves = _sample_outline(surfaces)
        self.points = np.hstack([curve.points for curve in curves])
        self._tangents = np.hstack([curve.tangents for curve in curves])
        self._chords = np.concatenate([curve.chords for curve in curves], axis=2)
        self._radii = np.hstack([curve.radii for curve in curves])
        self._curve_tags = np.repeat([curve.tag for curve in curves], [len(curve.radii) for curve in curves])
        self._thickness, is_part_left = self._wall_thickness()
        # At a round inner corner, the centre of curvature and the part lie on opposite sides of the outline.
        self._is_concave = (self._radii > 0.0) != is_part_left
        self.concave = self._round_inner_corners()
        self.corners, self._samples_at_corners = self._find_sharp_corners(_curve_ends(curves))

    def _find_sharp_corners(self, ends: list[_CurveEnd]) -> tuple[Floats, Ints]:
        """Return the sharp inner corners (2, n) [mm], and the indices (2, n) of the samples on both sides of each.

        `ends` are the ends of all curves of the outline.
        """
        corners, samples = [], []
        for i, curve_end in enumerate(ends):
            for other_end in ends[:i]:  # every pair of ends once
                if self._form_sharp_inner_corner(curve_end, other_end):
                    corners.append(curve_end.position)
                    samples.append((curve_end.sample, other_end.sample))
        # Without corners, the lists are empty, and reshaping gives them the right shape.
        return np.array(corners).reshape(-1, 2).T, np.array(samples, dtype=np.int64).reshape(-1, 2).T

    def _form_sharp_inner_corner(self, curve_end: _CurveEnd, other_end: _CurveEnd) -> bool:
        """Return whether two ends of curves meet at a sharp inner corner of the outline.

        Two curves that meet at an inner corner enclose a region outside the section. A point on their bisector, just
        beside the corner, therefore lies outside the section.
        """
        if np.linalg.norm(other_end.position - curve_end.position) > _NEAR_FRACTION * self.span:
            return False
        # Both directions lead away from the corner, so they are opposite if the outline does not turn there.
        turn = np.pi - np.arccos(np.clip(curve_end.direction @ other_end.direction, -1.0, 1.0))
        if not turn > _SHARP_TURN_RAD:
            return False
        bisector = curve_end.direction + other_end.direction
        bisector_length = float(np.linalg.norm(bisector))
        return not self._is_inside(curve_end.position + _TEST_DISTANCE * self.span * bisector / bisector_length)

    def _is_inside(self, point: Floats) -> bool:
        """Return whether a point (x, z) [mm] is in the section.

        The ray from such a point in the direction of x crosses the outline an odd number of times.
        """
        x, z = point
        (x0, z0), (x1, z1) = self._chords
        crosses = (z0 > z) != (z1 > z)  # whether the line through the point along x crosses a chord
        x_crossing = x0[crosses] + (z - z0[crosses]) / (z1 - z0)[crosses] * (x1 - x0)[crosses]
        return bool((x_crossing > x).sum() % 2)

    def element_sizes(self, scale: float, fine: FineCorners) -> tuple[Floats, Floats]:
        """Return points (2, n) [mm] and the element size (n,) [mm] required at each, before gmsh divides the elements.

        The points are the samples of the outline and the corners in `fine`. The size at a sample is the thickness of
        the part there. On a curve, the size is at most a quarter of the circle of curvature. At a round inner corner,
        the size is at most a third of this length. All sizes are multiplied by `scale` [1].
        """
        sizes = self._thickness / _QUADS_PER_THICKNESS
        quarter_arc = 0.5 * np.pi * np.abs(self._radii)
        sizes = np.minimum(sizes, np.where(self._is_concave, quarter_arc / _QUADS_PER_QUARTER_ARC, quarter_arc))
        sizes *= scale
        corners = self.corners[:, list(fine.numbers)]
        return np.hstack([self.points, corners]), np.concatenate([sizes, self._refined_sizes(sizes, fine)])

    def _refined_sizes(self, sizes: Floats, fine: FineCorners) -> Floats:
        """Return the element size at each refined corner [mm], shape (refined corners,).

        `sizes` (n,) [mm] are the sizes at the samples. `fine.size` multiplies the size without refinement or the wall
        thickness, whichever is smaller.
        """
        refined = list(fine.numbers)
        distance = np.linalg.norm(self.corners[:, refined][:, :, None] - self.points[:, None], axis=0)
        # The minimum is over the samples, along the second axis of (refined corners, samples).
        unrefined_sizes = (sizes + _GROWTH * distance).min(axis=1, initial=np.inf)
        wall_thickness = self._thickness[self._samples_at_corners[:, refined]].min(axis=0)
        return np.asarray(fine.size * np.minimum(unrefined_sizes, wall_thickness))

    def _wall_thickness(self) -> tuple[Floats, Flags]:
        """Return the thickness of the part at each sample [mm], and whether the part lies to the left there, (n,) each.

        The thickness is the distance to the opposite side of the outline, along the normal through the part. The part
        lies to the left of the curve if a ray to the left crosses the outline an odd number of times.
        """
        left_normals = np.stack([-self._tangents[1], self._tangents[0]])
        to_left, is_part_left = self._ray_distances(left_normals)
        to_right, _ = self._ray_distances(-left_normals)
        return np.where(is_part_left, to_left, to_right), is_part_left

    def _round_inner_corners(self) -> set[int]:
        """Return gmsh's tags of the curves that are round inner corners.

        All samples of such a curve are concave, and none of them is practically straight.
        """
        tags = set()
        for tag in np.unique(self._curve_tags):
            on_curve = self._curve_tags == tag
            is_curved = np.abs(self._radii)[on_curve] < _STRAIGHT_SPANS * self.span
            if self._is_concave[on_curve].all() and is_curved.all():
                tags.add(int(tag))
        return tags

    @property
    def span(self) -> float:
        """Return the longer side of the bounding box of the section [mm]."""
        return float(np.ptp(self.points, axis=1).max())

    def _ray_distances(self, direction: Floats) -> tuple[Floats, Flags]:
        """Return the distance [mm] along a ray from each sample to the outline, and whether the ray begins in the part.

        Both results have shape (n,), and `direction` (2, n) are the unit directions of the rays. A ray that begins in
        the part crosses the outline an odd number of times, not counting its start. If a ray does not cross the
        outline, its distance is infinite.
        """
        start, end = self._chords
        chord_vectors = end - start
        sample_count = self.points.shape[1]
        distance = np.full(sample_count, np.inf)
        crossings = np.zeros(sample_count, dtype=int)
        for i in range(sample_count):
            # Solve origin + t ray = start + s chord for all chords. t is the distance, and 0 <= s < 1 on a chord.
            origin, ray = self.points[:, i, None], direction[:, i, None]
            determinant = _cross_product(np.broadcast_to(ray, chord_vectors.shape), chord_vectors)
            # An infinite divisor gives t = 0 for a parallel chord, which is then not a hit.
            divisor = np.where(np.abs(determinant) > _PARALLEL, determinant, np.inf)
            to_start = start - origin
            t = _cross_product(to_start, chord_vectors) / divisor
            s = _cross_product(to_start, np.broadcast_to(ray, chord_vectors.shape)) / divisor
            # The lower bound of t excludes the chord on which the ray begins.
            is_hit = (t > _NEAR_FRACTION * self.span) & (s >= 0.0) & (s < 1.0)
            crossings[i] = is_hit.sum()
            distance[i] = t[is_hit].min(initial=np.inf)
        return distance, crossings % 2 == 1


def _sample_outline(surfaces: list[int]) -> list[_SampledCurve]:
    """Return samples of the curves on the outline of the section whose surfaces have these gmsh tags.

    The samples are evenly spaced, except that each curve has at least `_MIN_CURVE_SAMPLES`.
    """
    curve_tags = bounding_curves(surfaces)
    # A curve that is listed twice bounds two surfaces, so it lies inside the section and not on its outline.
    tags = [tag for tag in dict.fromkeys(curve_tags) if curve_tags.count(tag) == 1]
    lengths = {tag: gmsh.model.occ.getMass(CURVE, tag) for tag in tags}  # the mass of a curve is its length [mm]
    sample_spacing = sum(lengths.values()) / _OUTLINE_SAMPLES
    curves = []
    for tag in tags:
        count = max(_MIN_CURVE_SAMPLES, int(np.ceil(lengths[tag] / sample_spacing)))
        curves.append(_sample_curve(tag, count))
    return curves


def _curve_ends(curves: list[_SampledCurve]) -> list[_CurveEnd]:
    """Return both ends of each curve, with the number of the nearest sample among the samples of all curves."""
    ends = []
    first_sample = 0  # number of the first sample on the curve
    for curve in curves:
        last_sample = first_sample + len(curve.radii) - 1
        for (position, direction), sample in zip(curve.ends, (first_sample, last_sample), strict=True):
            ends.append(_CurveEnd(position, direction, sample))
        first_sample = last_sample + 1
    return ends


def _sample_curve(tag: int, count: int) -> _SampledCurve:
    """Approximate the curve with this gmsh tag by `count` chords, and return its samples."""
    (start,), (end,) = gmsh.model.getParametrizationBounds(CURVE, tag)
    # Positions with even indices are the ends of chords. Positions with odd indices lie on the curve between them.
    parameters = np.linspace(start, end, 2 * count + 1)
    # The section is normal to y, so only x and z are kept.
    positions = np.reshape(gmsh.model.getValue(CURVE, tag, parameters), (-1, 3))[:, [0, 2]].T
    derivatives = np.reshape(gmsh.model.getDerivative(CURVE, tag, parameters), (-1, 3))[:, [0, 2]].T
    curvature = np.asarray(gmsh.model.getCurvature(CURVE, tag, parameters))
    chord_ends = positions[:, ::2]
    ends = []
    for end_index, sign in ((0, 1.0), (-1, -1.0)):  # the derivative leads out of the curve at its last point
        inward = sign * derivatives[:, end_index]
        ends.append((positions[:, end_index], inward / np.linalg.norm(inward)))
    return _SampledCurve(
        tag=tag,
        chords=np.stack([chord_ends[:, :-1], chord_ends[:, 1:]]),
        # The samples lie on the chords. From a point beside its own chord, a ray could hit that chord.
        points=chord_ends[:, :-1] + 0.5 * np.diff(chord_ends, axis=1),
        tangents=derivatives[:, 1::2] / np.linalg.norm(derivatives[:, 1::2], axis=0),
        radii=1.0 / np.maximum(curvature[1::2], _MIN_CURVATURE_PER_MM) * _turning_signs(positions),
        ends=ends,
    )


def _turning_signs(positions: Floats) -> Floats:
    """Return for each chord of a curve whether the curve turns left (1) or right (-1), shape (n,).

    `positions` (2, 2 n + 1) [mm] are successive points of the curve. Points with even indices are the ends of chords.
    """
    before, middle, after = positions[:, :-2:2], positions[:, 1:-1:2], positions[:, 2::2]
    return np.asarray(np.where(_cross_product(middle - before, after - middle) >= 0.0, 1.0, -1.0))


def _read_section(surfaces: list[int], concave: set[int], sharp_corners: Floats) -> _Section:
    """Return the mesh of the section that gmsh has generated.

    `surfaces` are gmsh's tags of the surfaces, each of which is one region. `concave` holds the tags of the curves that
    are round inner corners. `sharp_corners` (2, n) [mm] are the sharp inner corners. Raises MeshError if an element is
    not a quadrilateral.
    """
    tags, regions = _read_quadrilaterals(surfaces)
    nodes = used_nodes(tags)
    points = np.ascontiguousarray(nodes.points[[0, 2]])  # x and z, because the section is normal to y
    quads = order_counterclockwise(points, nodes.index[tags])
    edges = _read_boundary_edges(surfaces, nodes, concave)
    profile = Profile(
        points=points,
        quads=quads,
        arcs=edges.ends,
        midpoints=edges.midpoints,
        surfaces={FILLETS: edges.fillets},
    )
    corner_of_quad = _corner_of_each_quadrilateral(points, quads, sharp_corners)
    return _Section(profile=profile, region=regions, corner=corner_of_quad, corner_count=sharp_corners.shape[1])


def _corner_of_each_quadrilateral(points: Floats, quads: Ints, sharp_corners: Floats) -> Ints:
    """Return the index of the sharp inner corner that each quadrilateral touches, or -1, shape (m,).

    `quads` (4, m) are indices into `points` (2, k) [mm]. `sharp_corners` (2, n) [mm] are the positions of the corners.
    The node at a corner is the one nearest to it.
    """
    corner_of_quad = np.full(quads.shape[1], -1)
    for corner, position in enumerate(sharp_corners.T):
        node = int(np.argmin(np.linalg.norm(points - position[:, None], axis=0)))
        corner_of_quad[(quads == node).any(axis=0)] = corner
    return corner_of_quad


def _read_quadrilaterals(surfaces: list[int]) -> tuple[Ints, Ints]:
    """Return gmsh's node tags (4, m) at the corners of all quadrilaterals, and the region (m,) of each.

    `surfaces` are gmsh's tags of the surfaces, each of which is one region. Raises MeshError if an element is not a
    quadrilateral.
    """
    tags, regions = [], []
    for region, surface in enumerate(surfaces):
        element_types = gmsh.model.mesh.getElementTypes(SURFACE, surface)
        if list(element_types) != [gmsh.model.mesh.getElementType("Quadrangle", 2)]:
            raise MeshError("read", "the section has elements other than quadrilaterals", _HINT)
        corner_tags = element_nodes("Quadrangle", 2, surface)[:4]  # the midside nodes and the centre follow
        tags.append(corner_tags)
        regions.append(np.full(corner_tags.shape[1], region))
    return np.hstack(tags), np.hstack(regions)


class _BoundaryEdges(NamedTuple):
    """The edges on the curves that bound the surfaces of a section.

    `ends` (2, k) are pairs of node indices. `midpoints` (2, k) [mm] are the points (x, z) halfway along the edges on
    the curves. `fillets` (2, j) are the ends of the edges on round inner corners.
    """

    ends: Ints
    midpoints: Floats
    fillets: Ints


def _read_boundary_edges(surfaces: list[int], nodes: Nodes, concave: set[int]) -> _BoundaryEdges:
    """Return the edges on the curves that bound the surfaces with these gmsh tags, as indices in `nodes`.

    The midpoints of the edges are gmsh's midside nodes, which lie on the curves. `concave` holds the tags of the curves
    that are round inner corners.
    """
    curve_tags = bounding_curves(surfaces)
    edges, midpoints = [], []
    fillets = [np.zeros((2, 0), dtype=np.int64)]  # not empty, because `hstack` needs at least one array
    line_nodes = used_nodes(np.hstack([element_nodes("Line", 2, tag) for tag in curve_tags]))
    for tag in dict.fromkeys(curve_tags):  # each curve once
        *end_tags, midside_tags = element_nodes("Line", 2, tag)
        ends = nodes.index[np.stack(end_tags)]
        edges.append(ends)
        midpoints.append(line_nodes.points[:, line_nodes.index[midside_tags]][[0, 2]])  # x and z
        if tag in concave:
            fillets.append(ends)
    return _BoundaryEdges(ends=np.hstack(edges), midpoints=np.hstack(midpoints), fillets=np.hstack(fillets))


def _sweep_ends(extrusion: "Extrusion", section: _Section) -> tuple[Floats, Floats]:
    """Return the lower and the upper end of the sweep in y at each point of the profile [mm], shape (points,) each.

    By default, the sweep goes through the full depth, and pockets and ribs of the part are left out. The sweep ends at
    the surface of the part in regions such as necks and tips, where at least half of the quadrilaterals have less than
    the full depth. Raises MeshError if a point of such a region lies outside the part.
    """
    points, quads = section.profile.points, section.profile.quads
    centres = points[:, quads].mean(axis=1)
    _, _, part_depth = extrusion.material_spans(*centres)
    low = np.full(points.shape[1], extrusion.low)
    high = np.full(points.shape[1], extrusion.high)
    full_depth = extrusion.high - extrusion.low
    for region in np.unique(section.region):
        in_region = section.region == region
        # The mean of Booleans is the fraction of the quadrilaterals that have the full depth.
        if (part_depth[in_region] > full_depth - _NEAR).mean() > _FULL_DEPTH_FRACTION:
            continue
        nodes, probes = _probes_inside(points, quads[:, in_region])
        lower, upper, length = extrusion.material_spans(*probes)
        if (length <= 0.0).any():
            raise MeshError("depth", "the sweep leaves the part", _HINT)
        # On the border of two regions, the sweep ends where the shallower region ends.
        low[nodes] = np.maximum(low[nodes], lower)
        high[nodes] = np.minimum(high[nodes], upper)
    return low, high


def _probes_inside(points: Floats, quads: Ints) -> tuple[Ints, Floats]:
    """Return the nodes (n,) of quadrilaterals, and a position (2, n) [mm] near each node at which to measure the depth.

    `quads` (4, m) are indices into `points` (2, k) [mm]. A line through a node on the outline may miss the part. The
    position is therefore slightly inside, on the way to the centre of an adjacent quadrilateral.
    """
    centres = points[:, quads].mean(axis=1)
    nodes, flat_index = np.unique(quads, return_index=True)
    # The remainder converts the index of a node in the flattened array to the column of its quadrilateral.
    adjacent_centres = centres[:, flat_index % quads.shape[1]]
    return nodes, points[:, nodes] + _INWARD_FRACTION * (adjacent_centres - points[:, nodes])


def _boundaries(extrusion: "Extrusion", profile: Profile, straight: MeshHex1, *, is_half: bool) -> dict[str, Ints]:
    """Return the indices of the facets on each named boundary of a swept part.

    `straight` is the straight-sided swept mesh. Node k n + i of this mesh is point i of the n points of the profile, at
    level k. If `is_half` is true, level 0 is the plane of symmetry. Raises MeshError if a named face of the part has no
    facets, or if its area differs from the area of its facets.
    """
    n = profile.points.shape[1]
    boundary_facets = straight.boundary_facets()
    corners = straight.facets[:, boundary_facets]
    # A node number is the level times n, plus the number of the profile point.
    profile_points = corners % n
    level = _facet_levels(corners, n)
    is_swept = level < 0
    boundaries: dict[str, Ints] = {}
    if is_half:
        boundaries[SYMMETRY] = boundary_facets[level == 0]
    # Side faces are the ends of the sweep at the full depth. The surfaces of shallower regions do not belong to them.
    y = straight.p[1, corners]
    top_level = straight.p.shape[1] // n - 1
    on_end = (level == top_level) & (np.abs(y - extrusion.high).max(axis=0) < _NEAR)
    if not is_half:
        on_end |= (level == 0) & (np.abs(y - extrusion.low).max(axis=0) < _NEAR)
    boundaries[SIDES] = boundary_facets[on_end]
    fillets = profile.surfaces[FILLETS]
    if fillets.shape[1]:
        edge_ends = np.stack([profile_points.min(axis=0), profile_points.max(axis=0)])
        boundaries[FILLETS] = boundary_facets[is_swept & (index_by_nodes(fillets, edge_ends) >= 0)]
    middles = _facet_middles(profile, straight, boundary_facets, profile_points)
    boundaries |= _named_faces(extrusion, straight, boundary_facets, middles, is_half=is_half)
    facets_with_name = np.concatenate(list(boundaries.values()))
    boundaries[WALLS] = np.setdiff1d(boundary_facets[is_swept], facets_with_name)
    return boundaries


def _facet_levels(corners: Ints, n: int) -> Ints:
    """Return the level of each facet that lies at one level of the sweep, and -1 for any other facet.

    The other facets are swept from the edges of the profile. `corners` (4, facets) holds the node numbers at the
    corners. Node k n + i lies at level k, where `n` is the number of points of the profile.
    """
    lowest_level, highest_level = corners.min(axis=0) // n, corners.max(axis=0) // n
    return np.where(lowest_level == highest_level, lowest_level, -1)


def _named_faces(
    extrusion: "Extrusion", straight: MeshHex1, boundary_facets: Ints, middles: Floats, *, is_half: bool
) -> dict[str, Ints]:
    """Return the indices of the facets on each named face of the part.

    A facet lies on a face if its middle does. `middles` (3, n) [mm] are the middles of the `boundary_facets` (n,).
    Raises MeshError if a named face has no facets, or if its area differs from the area of its facets.
    """
    faces = {}
    copies = 2.0 if is_half else 1.0  # the whole part consists of two copies of the meshed half
    for name in extrusion.part.faces:
        faces[name] = boundary_facets[extrusion.are_on_face(name, middles, _ON_FACE)]
        if not len(faces[name]):
            raise MeshError("faces", f"no facet of the swept section lies on {name}", "choose another face")
        _check_face_area(extrusion, name, copies * facets_area(straight, faces[name]))
    return faces


def _check_face_area(extrusion: "Extrusion", name: str, meshed_area: float) -> None:
    """Raise MeshError if the area of a named polygonal face differs from `meshed_area`, the area of its facets [mm^2].

    The areas differ if the mesh does not conform to the face. An edge of the face then lies between two layers of the
    sweep, or between nodes of the section. Faces with curved edges are not checked.
    """
    area = extrusion.polygon_area(name)
    if area is not None and abs(meshed_area / area - 1.0) > _AREA_TOLERANCE:
        reason = f"the area of face {name!r} is {area:g} mm^2, but {meshed_area:g} mm^2 in the mesh"
        raise MeshError("faces", reason, "choose another face")


def _facet_middles(profile: Profile, straight: MeshHex1, facets: Ints, profile_points: Ints) -> Floats:
    """Return the middles of the given facets [mm], shape (3, n), by which facets are assigned to named faces.

    The middle of a facet swept from an arc lies on the curved surface. `facets` (n,) are the indices of the facets in
    `straight`. `profile_points` (4, n) are the indices of the profile points at their corners.
    """
    middles = straight.p[:, straight.facets[:, facets]].mean(axis=1)
    ends = np.stack([profile_points.min(axis=0), profile_points.max(axis=0)])
    arc = index_by_nodes(profile.arcs, ends)  # index of the arc edge with these ends, or -1
    # The corners of a facet that is swept from an edge are at only two different points of the profile. A facet at the
    # end of the sweep has four.
    has_two_points = np.array([len(set(points)) == 2 for points in profile_points.T.tolist()])  # noqa: PLR2004
    from_arc = (arc >= 0) & has_two_points
    middles[0, from_arc] = profile.midpoints[0, arc[from_arc]]  # x
    middles[2, from_arc] = profile.midpoints[1, arc[from_arc]]  # z
    return np.asarray(middles)
