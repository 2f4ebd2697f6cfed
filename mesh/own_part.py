"""The mesh of an extruded part: its section in quadrilaterals, small where a wall is thin, swept through the depth.

The named boundaries are the part's named faces and up to four more. `side_faces` are the ends of the sweep, and
`fillets` the round inner corners of the section. `walls` are all other walls, which carry no load. `symmetry` is the
plane of symmetry if only half of the part is meshed.
"""

import dataclasses
import functools
import math
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import gmsh
import numpy as np
from skfem import MeshHex1, MeshHex2

from mesh.cells import facets_area
from mesh.housing.profile import Profile
from mesh.housing.sweep import check_jacobian, curved_nodes, half_depth_shares, sweep_profile
from mesh.session import Ints, MeshError, Nodes, element_nodes, gmsh_session, index_by_nodes, stage, used_nodes
from sensor.arrays import Flags, Floats

if TYPE_CHECKING:
    from cad.checks.own_part import Extrusion

SIDES, FILLETS, WALLS, SYMMETRY = "side_faces", "fillets", "walls", "symmetry"
_HINT = "check the solid at its smallest faces"
_SAMPLES = 2000  # approximate number of points on the outline at which the thickness of the part is measured
_FEWEST = 8  # smallest number of these points on a curve
_PER_THICKNESS = 1.0  # quadrilaterals across a wall, before gmsh divides each into four
_PER_QUARTER = 3.0  # quadrilaterals along a quarter of a round inner corner, before the same division
_APART_MM = 0.4  # distance between the lines along which mesh and part are compared
_MOST_LINES = 10  # maximum number of these lines along a side of a quadrilateral
_IMPLIED = 1.05  # ratio of the size that other points imply to a point's own size, up to which the point is redundant
_BIN_SHARE = 0.02  # width of a bin over the longest side of the part
_GROWTH = 0.45  # growth of the element size per distance [mm per mm]
_NEAR = 1e-6  # distance below which points are taken as equal [mm]; in some tests a fraction of the span
_PARALLEL = 1e-12  # cross product of a ray and a segment [mm] below which they are taken as parallel
_INSIDE = 1e-3  # fraction of the way from a node to the centre of a quadrilateral, where the depth is measured
_SAME_AREA = 0.02  # largest relative difference in area between a face and the facets on it
_FULL_SHARE = 0.5  # a region with more than this fraction of its quadrilaterals at full depth is swept to full depth
_SHARP_RAD = np.radians(15.0)  # smallest turn of the outline at a sharp inner corner
_BESIDE = 1e-4  # distance of a test point from a corner, over the span
_FRONTAL = 6.0  # gmsh's number of the Frontal-Delaunay algorithm
_MOVES = 10  # passes of gmsh that move inner nodes to improve the angles


@dataclass(frozen=True, kw_only=True, eq=False)
class SweptPart:
    """The mesh of a swept part. Over each quadrilateral of the profile it has one column of cells.

    `depth` (points,) [mm] is the length of the mesh along y at each point of the profile. `area` (quadrilaterals,)
    [mm^2] has the areas of the quadrilaterals, and `cells` (layers, quadrilaterals) the indices of the cells in each
    column. `share` is the fraction of the solid that is meshed, 1 or 0.5. `places` (3, quadrilaterals) [mm] are the
    middles of the columns. `corner` (quadrilaterals,) is the number of the sharp inner corner that a quadrilateral
    touches, or -1; `corner_count` is the number of such corners.

    Pockets and ribs of the part that the mesh leaves out make a column too long or too short: see `excess` and
    `effect`.
    """

    mesh: MeshHex2
    extrusion: "Extrusion"
    profile: Profile
    depth: Floats
    area: Floats
    cells: Ints
    share: float
    places: Floats
    corner: Ints
    corner_count: int

    @functools.cached_property
    def _length_errors(self) -> tuple[Floats, Floats]:
        """Return `excess` and `effect`; they take a second, and only the mesh of the result needs them."""
        excess = _sampled_excess(self.extrusion, self.profile, self.depth, self.area)
        narrow, effect = _narrow_excess(self.extrusion, self.profile, self.depth, self.area)
        return np.maximum(excess, narrow), np.maximum(excess, effect)

    @property
    def excess(self) -> Floats:
        """Return the error in the length of each column of cells, compared with the part [mm], (quadrilaterals,)."""
        return self._length_errors[0]

    @property
    def effect(self) -> Floats:
        """Return the error in the length of each column that has the same effect on the stiffness [mm].

        It is `excess`, but larger if the neglected feature is narrower than it is long, or leaves little of the depth.
        For example, a saw cut weakens a part as much as a round hole whose diameter is the length of the cut.
        """
        return self._length_errors[1]


@dataclass(frozen=True, kw_only=True)
class FineCorners:
    """The sharp inner corners of a section at which elements are refined, and the relative size of elements there.

    `numbers` are the numbers of the corners. `size` [1] is the element size over the thickness of the wall, or over the
    size without refinement if that is smaller.
    """

    numbers: tuple[int, ...] = ()
    size: float = 1.0


@dataclass(frozen=True, eq=False)
class _Section:
    """A meshed section: its profile, and arrays (quadrilaterals,) of regions and of sharp inner corners.

    `region` is the number of the region that contains a quadrilateral. `corner` is the number of the sharp inner corner
    that it touches, or -1.
    """

    profile: Profile
    region: Ints
    corner: Ints
    corner_count: int


def swept_part(
    extrusion: "Extrusion",
    scale: float,
    layers: int,
    presses: Iterable[tuple[float, ...]] = (),
    fine: FineCorners = FineCorners(),
) -> SweptPart:
    """Return the mesh [mm] of an extruded part.

    `scale` [1] is the relative element size: 1 for the mesh of the solve, 2 for the coarse mesh of its error estimate.
    `layers` is the number of layers of cells through half the depth. `presses` are the directions of the loads, and
    `fine` the corners at which elements are refined. Only the half above the middle of the depth is meshed if the part
    and its named faces are symmetric about it. In this case, no load may have a component along the sweep. Raises
    MeshError if no valid mesh is found, and MachineError if gmsh fails.
    """
    section = _meshed_section(extrusion, scale, fine)
    profile = section.profile
    low, high = _sweep_ends(extrusion, section)
    middle = 0.5 * (extrusion.low + extrusion.high)
    is_loaded_across = all(abs(direction[1]) < _NEAR for direction in presses)
    is_even = all(extrusion.is_even(name) for name in extrusion.part.faces)
    is_half = is_loaded_across and is_even and bool(np.abs(low + high - 2.0 * middle).max() < 2.0 * _NEAR)
    half_levels = half_depth_shares(layers)
    # Levels over the depth: from 1/2 to 1 for the upper half, or from 0 to 1 for the whole part.
    shares = 0.5 + 0.5 * (half_levels if is_half else np.concatenate([-half_levels[:0:-1], half_levels]))
    straight = sweep_profile(profile, shares)
    # The same levels, now between the lower and the upper end of the sweep at each point of the profile.
    points = straight.p.copy()
    levels = points[1].reshape(len(shares), -1)
    points[1] = (low + levels * (high - low)).ravel()
    straight = MeshHex1(points, straight.t)
    quadratic = MeshHex2.from_mesh(straight)
    mesh = dataclasses.replace(quadratic, doflocs=curved_nodes(quadratic, profile))
    mesh = mesh.with_boundaries(_boundaries(extrusion, profile, straight, is_half=is_half))
    check_jacobian(mesh)
    corners = profile.points[:, profile.quads]
    area = 0.5 * np.abs(_cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]))
    cells = np.arange(straight.t.shape[1]).reshape(len(shares) - 1, -1)
    x, z = corners.mean(axis=1)
    return SweptPart(
        mesh=mesh,
        extrusion=extrusion,
        profile=profile,
        depth=high - low,
        area=area,
        cells=cells,
        share=0.5 if is_half else 1.0,
        places=np.stack([x, np.full_like(x, middle), z]),
        corner=section.corner,
        corner_count=section.corner_count,
    )


def _sampled_excess(extrusion: "Extrusion", profile: Profile, depth: Floats, area: Floats) -> Floats:
    """Return the mean absolute difference in length along y between each column of the mesh and the part [mm].

    The lengths are compared along lines parallel to y, on a grid in each quadrilateral. `depth` (points,) [mm] is the
    length of the mesh, and `area` (quadrilaterals,) [mm^2] the area of the quadrilaterals.
    """
    excess = np.zeros(len(area))
    counts = np.clip(np.ceil(np.sqrt(area) / _APART_MM), 1, _MOST_LINES).astype(int)
    for count in np.unique(counts):
        quads = np.flatnonzero(counts == count)
        coordinates = (np.arange(count) + 0.5) / count
        r, s = np.repeat(coordinates, count), np.tile(coordinates, count)
        shapes = np.stack([(1.0 - r) * (1.0 - s), r * (1.0 - s), r * s, (1.0 - r) * s])  # bilinear shape functions
        corners = profile.quads[:, quads]
        x, z = np.einsum("ijk,jq->ikq", profile.points[:, corners], shapes).reshape(2, -1)
        _, _, part_length = extrusion.spans(x, z)
        mesh_length = (depth[corners].T @ shapes).ravel()
        # A line misses the part only outside its curved outline, which the curved elements follow; there it counts 0.
        difference = np.where(part_length > 0.0, np.abs(mesh_length - part_length), 0.0)
        excess[quads] = np.where(difference > _NEAR, difference, 0.0).reshape(len(quads), -1).mean(axis=1)
    return excess


def _narrow_excess(extrusion: "Extrusion", profile: Profile, depth: Floats, area: Floats) -> tuple[Floats, Floats]:
    """Return the error in column length due to features of the part, and its equivalent `effect`, both [mm].

    Features are pockets, ribs and slanted faces, in small pieces. A narrow feature may lie between the lines of
    `_sampled_excess`. `depth` and `area` are as there; `effect` is as in `SweptPart`. Both results have shape
    (quadrilaterals,).
    """
    excess, effect = np.zeros(len(area)), np.zeros(len(area))
    pieces = list(extrusion.uneven())
    if not pieces:
        return excess, effect
    places = np.array([place for place, _, _ in pieces]).T
    piece_areas, widths = (np.array([piece[i] for piece in pieces]) for i in (1, 2))
    corners = profile.points[:, profile.quads]
    sides = np.roll(corners, -1, axis=1) - corners
    _, _, part_length = extrusion.spans(*places)
    for i in np.flatnonzero(part_length > 0.0):
        place = places[:, i]
        # A place inside a quadrilateral is on the left of all its sides, so that all cross products are positive.
        cross_products = _cross(sides, place[:, None, None] - corners)
        quad = int(np.argmax(cross_products.min(axis=0)))
        if not cross_products[:, quad].min() >= -_NEAR:
            continue
        corner_depths = depth[profile.quads[:, quad]]
        mesh_length = float(corner_depths.mean())
        difference = abs(mesh_length - float(part_length[i]))
        if np.ptp(corner_depths) > _NEAR or not difference > _NEAR:
            continue  # the mesh follows a slanted face there, and `_sampled_excess` has what it misses
        excess[quad] += difference * piece_areas[i] / area[quad]
        weakening = 1.0
        if mesh_length > part_length[i]:
            weakening = max(1.0, difference / widths[i]) * mesh_length / part_length[i]
        effect[quad] += weakening * difference * piece_areas[i] / area[quad]
    return excess, effect


def _cross(a: Floats, b: Floats) -> Floats:
    """Return the cross products, a number each, of vectors (2, ...) in the plane."""
    return np.asarray(a[0] * b[1] - a[1] * b[0])


def _meshed_section(extrusion: "Extrusion", scale: float, fine: FineCorners) -> _Section:
    """Return the section in quadrilaterals. The edges of slanted faces divide it into regions.

    `scale` [1] multiplies the element sizes, and `fine` lists the corners at which elements are refined.
    """
    with gmsh_session():
        surfaces = _import_section(extrusion)
        with stage("size", _HINT):
            gmsh.option.setNumber("Mesh.Algorithm", _FRONTAL)
            gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 1.0)
            gmsh.option.setNumber("Mesh.RecombineAll", 1.0)
            gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 1.0)
            gmsh.option.setNumber("Mesh.SubdivisionAlgorithm", 1.0)
            outline = _Outline(surfaces)
            sizes = GradedSizes(*outline.sizes(scale, fine), _GROWTH)

            def size_at(dimension: int, _tag: int, x: float, _y: float, z: float, default_size: float) -> float:
                # Inside a surface, gmsh's default interpolates the sizes of the outline.
                return default_size if dimension > 1 else sizes.at(x, z)

            gmsh.model.mesh.setSizeCallback(size_at)
        with stage("generate", _HINT):
            gmsh.model.mesh.generate(2)
            gmsh.model.mesh.optimize("Relocate2D", niter=_MOVES)
            gmsh.model.mesh.setOrder(2)
        with stage("read", _HINT):
            return _read_section(surfaces, outline.concave, outline.corners)


def _import_section(extrusion: "Extrusion") -> list[int]:
    """Load the section into gmsh, split it along the edges of slanted faces, and return the tags of its surfaces."""
    occ = gmsh.model.occ
    with os.fdopen(os.memfd_create("section.brep")) as in_memory, stage("import", _HINT):
        path = Path(f"/proc/self/fd/{in_memory.fileno()}")
        extrusion.section.exportBrep(str(path))
        imported = occ.importShapes(str(path), format="brep")
        section = [pair for pair in imported if pair[0] == 2]  # noqa: PLR2004 - the dimension of a surface
        lines = []
        for (x0, z0), (x1, z1) in extrusion.lines:
            ends = [occ.addPoint(x, extrusion.plane, z) for x, z in ((x0, z0), (x1, z1))]
            lines.append((1, occ.addLine(*ends)))
        if lines:
            occ.fragment(section, lines)
        occ.synchronize()
        surfaces = [tag for _, tag in gmsh.model.getEntities(2)]
        bounding_curves = {
            curve for _, curve in gmsh.model.getBoundary([(2, tag) for tag in surfaces], combined=False, oriented=False)
        }
        # Pieces of the lines that lie outside the section bound no surface.
        unused_curves = [pair for pair in gmsh.model.getEntities(1) if pair[1] not in bounding_curves]
        occ.remove(unused_curves, recursive=True)
        occ.synchronize()
    return surfaces


class GradedSizes:
    """The element size at any position [mm], from the sizes that some points require.

    Away from a point, its size grows in proportion to the distance; the smallest size applies. gmsh calls `at` a
    million times, so space is divided into cubes, the bins. Each bin has a list of the points that matter in it.
    """

    def __init__(self, points: Floats, sizes: Floats, growth: float) -> None:
        """Take the sizes (n,) [mm] required at points (dim, n) [mm], and their growth [mm per mm].

        A point is dropped if others already imply its size, to 5 %.
        """
        kept = np.zeros(0, dtype=np.int64)
        for i in np.argsort(sizes):
            distance = np.linalg.norm(points[:, kept] - points[:, i, None], axis=0)
            if not len(kept) or (sizes[kept] + growth * distance).min() > _IMPLIED * sizes[i]:
                kept = np.append(kept, i)
        # Points of a plane get a third coordinate, 0.
        self._points = np.vstack([points[:, kept], np.zeros((3 - len(points), len(kept)))])
        self._sizes = sizes[kept]
        self._growth = growth
        self._bin = _BIN_SHARE * float(np.ptp(points, axis=1).max())
        self._near: dict[tuple[int, int, int], list[tuple[float, float, float, float]]] = {}

    def at(self, x: float, y: float, z: float = 0.0) -> float:
        """Return the element size at a position [mm]. Positions in a plane have only two coordinates."""
        key = (int(x // self._bin), int(y // self._bin), int(z // self._bin))
        near = self._near.get(key)
        if near is None:
            near = self._near[key] = self._in_bin(key)
        growth, sqrt = self._growth, math.sqrt
        # A bin has about ten points, for which NumPy would take five times as long.
        return min(
            [size + growth * sqrt((a - x) * (a - x) + (b - y) * (b - y) + (c - z) * (c - z)) for a, b, c, size in near]
        )

    def _in_bin(self, key: tuple[int, int, int]) -> list[tuple[float, float, float, float]]:
        """Return the points (x, y, z, size) that can determine the size somewhere in the bin with these indices."""
        middle = (np.array(key) + 0.5)[:, None] * self._bin
        size_at_middle = self._sizes + self._growth * np.linalg.norm(self._points - middle, axis=0)
        # From the middle to a corner of the bin, one size may grow and another shrink, each by half of this.
        reach = self._growth * self._bin * np.sqrt(len(key))
        relevant = size_at_middle <= size_at_middle.min() + reach
        return [
            (x, y, z, size)
            for (x, y, z), size in zip(self._points.T[relevant].tolist(), self._sizes[relevant].tolist(), strict=True)
        ]


@dataclass(frozen=True, eq=False)
class _CurveEnd:
    """An end of a curve: its position [mm], the unit direction into the curve, and the index of the nearest sample."""

    place: Floats
    into: Floats
    sample: int


class _Outline:
    """The outline of a section, sampled at points, with the element size that it requires at each.

    The curves of the outline are approximated by chords. The samples, `points` (2, n) [mm], are the middles of the
    chords. `corners` (2, m) [mm] are the sharp inner corners. `sizes` also collects `concave`, gmsh's tags of the
    curves that are round inner corners.
    """

    def __init__(self, surfaces: list[int]) -> None:
        """Sample the outline of the section, given gmsh's tags of its surfaces.

        Each sample has the tangent of its curve, the radius of curvature, positive if the curve turns left, and the tag
        of the curve.
        """
        dim_tags = [(2, tag) for tag in surfaces]
        bounding_curves = [tag for _, tag in gmsh.model.getBoundary(dim_tags, combined=False, oriented=False)]
        # A curve between two surfaces is listed twice; it lies inside the section.
        curves = [tag for tag in dict.fromkeys(bounding_curves) if bounding_curves.count(tag) == 1]
        lengths = {tag: gmsh.model.occ.getMass(1, tag) for tag in curves}
        step = sum(lengths.values()) / _SAMPLES
        points, tangents, segments, radii, owners = [], [], [], [], []
        curve_ends: list[_CurveEnd] = []
        for tag in curves:
            (start,), (end,) = gmsh.model.getParametrizationBounds(1, tag)
            count = max(_FEWEST, int(np.ceil(lengths[tag] / step)))
            # Positions with even indices are the ends of chords. Those with odd indices lie on the curve between them.
            parameters = np.linspace(start, end, 2 * count + 1)
            positions = np.reshape(gmsh.model.getValue(1, tag, parameters), (-1, 3))[:, [0, 2]].T
            derivative = np.reshape(gmsh.model.getDerivative(1, tag, parameters), (-1, 3))[:, [0, 2]].T
            curvature = np.asarray(gmsh.model.getCurvature(1, tag, parameters))
            ends = positions[:, ::2]
            segments.append(np.stack([ends[:, :-1], ends[:, 1:]]))
            # Samples lie on the chords: from a point next to its own chord, a ray could hit that chord.
            points.append(ends[:, :-1] + 0.5 * np.diff(ends, axis=1))
            tangents.append(derivative[:, 1::2] / np.linalg.norm(derivative[:, 1::2], axis=0))
            radii.append(1.0 / np.maximum(curvature[1::2], 1e-9) * self._turning_signs(positions))
            owners.append(np.full(count, tag))
            first_sample = sum(map(len, owners[:-1]))
            for end, sign, sample in ((0, 1.0, first_sample), (-1, -1.0, first_sample + count - 1)):
                inward = sign * derivative[:, end]
                curve_ends.append(_CurveEnd(positions[:, end], inward / np.linalg.norm(inward), sample))
        self.points = np.hstack(points)
        self._tangents = np.hstack(tangents)
        self._segments = np.concatenate(segments, axis=2)
        self._radii = np.hstack(radii)
        self._owners = np.hstack(owners)
        self.concave: set[int] = set()
        self.corners, self._samples_at_corners = self._sharp_corners(curve_ends)

    def _sharp_corners(self, ends: "list[_CurveEnd]") -> tuple[Floats, Ints]:
        """Return the sharp inner corners (2, n) [mm], and the indices (2, n) of the samples on both sides of each.

        Curves that meet at an inner corner enclose a region outside the section. So a point on the bisector of the two
        curves, next to the corner, is outside.
        """
        corners, samples = [], []
        for i, curve_end in enumerate(ends):
            for other_end in ends[:i]:
                if np.linalg.norm(other_end.place - curve_end.place) > _NEAR * self.span:
                    continue
                turn = np.pi - np.arccos(np.clip(curve_end.into @ other_end.into, -1.0, 1.0))
                bisector = curve_end.into + other_end.into
                length = max(float(np.linalg.norm(bisector)), _NEAR)
                test_point = curve_end.place + _BESIDE * self.span * bisector / length
                if turn > _SHARP_RAD and not self._is_inside(test_point):
                    corners.append(curve_end.place)
                    samples.append((curve_end.sample, other_end.sample))
        return np.array(corners).reshape(-1, 2).T, np.array(samples, dtype=np.int64).reshape(-1, 2).T

    def _is_inside(self, place: Floats) -> bool:
        """Return whether a point [mm] is in the section: a ray along x crosses the outline an odd number of times."""
        (x0, z0), (x1, z1) = self._segments
        crosses = (z0 > place[1]) != (z1 > place[1])
        x_crossing = x0[crosses] + (place[1] - z0[crosses]) / (z1 - z0)[crosses] * (x1 - x0)[crosses]
        return bool((x_crossing > place[0]).sum() % 2)

    @staticmethod
    def _turning_signs(positions: Floats) -> Floats:
        """Return the sense in which a curve turns at its odd positions, shape (n,): 1 to the left, -1 to the right.

        `positions` (2, 2 n + 1) [mm] are successive points of the curve.
        """
        before, middle, after = positions[:, :-2:2], positions[:, 1:-1:2], positions[:, 2::2]
        return np.asarray(np.where(_cross(middle - before, after - middle) >= 0.0, 1.0, -1.0))

    def sizes(self, scale: float, fine: FineCorners) -> tuple[Floats, Floats]:
        """Return points (2, n) [mm] and the element size (n,) [mm] required at each, before gmsh divides elements.

        The points are the samples of the outline and the corners in `fine`. The size depends on the thickness of the
        part, and at round inner corners also on the radius. All sizes are multiplied by `scale` [1].
        """
        # The part lies to the left of the outline where a ray to the left crosses the outline an odd number of times.
        left_normals = np.stack([-self._tangents[1], self._tangents[0]])
        to_left, is_part_left = self._ray_distances(left_normals)
        to_right, _ = self._ray_distances(-left_normals)
        thickness = np.where(is_part_left, to_left, to_right)
        sizes = thickness / _PER_THICKNESS
        # At an inner corner, the centre of curvature and the part lie on opposite sides of the outline.
        is_concave = (self._radii > 0.0) != is_part_left
        radius = np.abs(self._radii)
        quarter_arc = 0.5 * np.pi * radius
        sizes = np.minimum(sizes, np.where(is_concave, quarter_arc / _PER_QUARTER, quarter_arc))
        for tag in np.unique(self._owners):
            on_curve = self._owners == tag
            # A radius of a thousand spans means a straight line.
            if is_concave[on_curve].all() and (radius[on_curve] < 1e3 * self.span).all():
                self.concave.add(int(tag))
        sizes *= scale
        # At a refined corner, the reference is the size without refinement or the wall thickness, whichever is smaller.
        numbers = list(fine.numbers)
        corners = self.corners[:, numbers]
        distance = np.linalg.norm(corners[:, :, None] - self.points[:, None], axis=0)
        unrefined = (sizes + _GROWTH * distance).min(axis=1, initial=np.inf)
        refined = fine.size * np.minimum(unrefined, thickness[self._samples_at_corners[:, numbers]].min(axis=0))
        return np.hstack([self.points, corners]), np.concatenate([sizes, refined])

    @property
    def span(self) -> float:
        """Return the largest side of the section [mm]."""
        return float(np.ptp(self.points, axis=1).max())

    def _ray_distances(self, direction: Floats) -> tuple[Floats, Flags]:
        """Return the distance [mm] along a ray from each sample to the outline, and whether the ray began in the part.

        `direction` (2, n) are the unit directions of the rays. A ray that begins in the part crosses the outline an odd
        number of times. The distance is infinite without a crossing.
        """
        start, end = self._segments
        segment_vectors = end - start
        distance = np.full(self.points.shape[1], np.inf)
        crossings = np.zeros(self.points.shape[1], dtype=int)
        for i in range(self.points.shape[1]):
            # Solve origin + t ray = start + s segment for all segments. t is the distance, and 0 <= s < 1 on a segment.
            origin, ray = self.points[:, i, None], direction[:, i, None]
            determinant = _cross(np.broadcast_to(ray, segment_vectors.shape), segment_vectors)
            divisor = np.where(np.abs(determinant) > _PARALLEL, determinant, np.inf)
            to_start = start - origin
            t = _cross(to_start, segment_vectors) / divisor
            s = _cross(to_start, np.broadcast_to(ray, segment_vectors.shape)) / divisor
            is_hit = (t > _NEAR * self.span) & (s >= 0.0) & (s < 1.0)
            crossings[i] = is_hit.sum()
            distance[i] = t[is_hit].min(initial=np.inf)
        return distance, crossings % 2 == 1


def _read_section(surfaces: list[int], concave: set[int], sharp: Floats) -> _Section:
    """Return the mesh of the section that gmsh has made.

    `surfaces` are gmsh's tags of the surfaces, each of which is a region, and `concave` the tags of the round inner
    corners. `sharp` (2, n) [mm] are the sharp inner corners. Raises MeshError if an element is not a quadrilateral.
    """
    tags_of_quads, regions = [], []
    for region, tag in enumerate(surfaces):
        kinds = gmsh.model.mesh.getElementTypes(2, tag)
        if list(kinds) != [gmsh.model.mesh.getElementType("Quadrangle", 2)]:
            raise MeshError("read", "the section has elements other than quadrilaterals", _HINT)
        corner_tags = element_nodes("Quadrangle", 2, tag)[:4]
        tags_of_quads.append(corner_tags)
        regions.append(np.full(corner_tags.shape[1], region))
    tags = np.hstack(tags_of_quads)
    nodes = used_nodes(tags)
    points = np.ascontiguousarray(nodes.points[[0, 2]])
    quads = nodes.index[tags]
    corners = points[:, quads]
    # The cross product of the diagonals is negative if the corners are numbered clockwise.
    clockwise = _cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]) < 0.0
    quads = np.where(clockwise, quads[::-1], quads)
    arcs, midpoints, fillets = _read_edges(surfaces, nodes, concave)
    profile = Profile(points=points, quads=quads, arcs=arcs, midpoints=midpoints, surfaces={FILLETS: fillets})
    # A sharp corner is the node nearest to it.
    corner = np.full(quads.shape[1], -1)
    for number, place in enumerate(sharp.T):
        node = int(np.argmin(np.linalg.norm(points - place[:, None], axis=0)))
        corner[(quads == node).any(axis=0)] = number
    return _Section(profile, np.hstack(regions), corner, sharp.shape[1])


def _read_edges(surfaces: list[int], nodes: Nodes, concave: set[int]) -> tuple[Ints, Floats, Ints]:
    """Return the edges on the curves that bound the surfaces, their middles, and the edges on round inner corners.

    Edges (2, k) are pairs of indices in `nodes`. Their middles (2, k) [mm] are gmsh's midside nodes, which lie on the
    curves. `concave` are the tags of the curves that are round inner corners.
    """
    bounding_curves = gmsh.model.getBoundary([(2, tag) for tag in surfaces], combined=False, oriented=False)
    edges, midpoints, fillets = [], [], [np.zeros((2, 0), dtype=np.int64)]
    line_nodes = used_nodes(np.hstack([element_nodes("Line", 2, tag) for _, tag in bounding_curves]))
    for tag in dict.fromkeys(curve for _, curve in bounding_curves):
        line = element_nodes("Line", 2, tag)
        edges.append(nodes.index[line[:2]])
        midpoints.append(line_nodes.points[:, line_nodes.index[line[2]]][[0, 2]])
        if tag in concave:
            fillets.append(nodes.index[line[:2]])
    return np.hstack(edges), np.hstack(midpoints), np.hstack(fillets)


def _sweep_ends(extrusion: "Extrusion", section: _Section) -> tuple[Floats, Floats]:
    """Return the lower and the upper end of the sweep in y at each point of the profile [mm], (points,) each.

    By default, the sweep goes through the full depth, and pockets or ribs of the part are left out. In some regions,
    such as necks and tips, at least half of the quadrilaterals have less than the full depth. There the sweep ends at
    the surface of the part. Raises MeshError if a point of such a region lies outside the part.
    """
    profile = section.profile
    points, quads = profile.points, profile.quads
    centres = points[:, quads].mean(axis=1)
    _, _, inside = extrusion.spans(*centres)
    low = np.full(points.shape[1], extrusion.low)
    high = np.full(points.shape[1], extrusion.high)
    full_depth = extrusion.high - extrusion.low
    for region in np.unique(section.region):
        in_region = section.region == region
        if (inside[in_region] > full_depth - _NEAR).mean() > _FULL_SHARE:
            continue
        # A node may lie on the outline, so the part is probed a little towards the centre of an adjacent quadrilateral.
        region_quads = quads[:, in_region]
        nodes, first = np.unique(region_quads, return_index=True)
        adjacent_centres = centres[:, in_region][:, first % region_quads.shape[1]]
        probes = points[:, nodes] + _INSIDE * (adjacent_centres - points[:, nodes])
        lower, upper, length = extrusion.spans(*probes)
        if (length <= 0.0).any():
            raise MeshError("depth", "the sweep leaves the part", _HINT)
        low[nodes] = np.maximum(low[nodes], lower)
        high[nodes] = np.minimum(high[nodes], upper)
    return low, high


def _boundaries(extrusion: "Extrusion", profile: Profile, straight: MeshHex1, *, is_half: bool) -> dict[str, Ints]:
    """Return the indices of the facets on each named boundary of a swept part.

    `straight` is the straight-sided swept mesh; node k n + i is point i of the n points of the profile, at level k. It
    starts at the plane of symmetry if `is_half`. Raises MeshError if a named face of the part has no facets, or if its
    area differs from the area of its facets.
    """
    # A facet is recognised by the levels and the profile points of its four corners.
    n = profile.points.shape[1]
    boundary_facets = straight.boundary_facets()
    corners = straight.facets[:, boundary_facets]
    lowest_level, highest_level = corners.min(axis=0) // n, corners.max(axis=0) // n
    top_level = straight.p.shape[1] // n - 1
    is_level = lowest_level == highest_level  # all corners of the facet at the same level
    boundaries: dict[str, Ints] = {}
    profile_points = corners % n
    ends = np.stack([profile_points.min(axis=0), profile_points.max(axis=0)])
    if is_half:
        boundaries[SYMMETRY] = boundary_facets[is_level & (lowest_level == 0)]
    y = straight.p[1, corners]
    on_end = is_level & (lowest_level == top_level) & (np.abs(y - extrusion.high).max(axis=0) < _NEAR)
    if not is_half:
        on_end |= is_level & (lowest_level == 0) & (np.abs(y - extrusion.low).max(axis=0) < _NEAR)
    boundaries[SIDES] = boundary_facets[on_end]
    fillets = profile.surfaces[FILLETS]
    if fillets.shape[1]:
        boundaries[FILLETS] = boundary_facets[~is_level & (index_by_nodes(fillets, ends) >= 0)]
    # A facet belongs to a face of the part if its middle lies on the face.
    middles = _facet_middles(profile, straight, boundary_facets, profile_points)
    for name in extrusion.part.faces:
        on_face = extrusion.are_on_face(name, middles, 10.0 * _NEAR)
        boundaries[name] = boundary_facets[on_face]
        if not on_face.any():
            raise MeshError("faces", f"no facet of the swept section lies on {name}", "take another face")
        meshed_area = (2.0 if is_half else 1.0) * facets_area(straight, boundaries[name])
        _check_face_area(extrusion, name, meshed_area)
    named_facets = np.concatenate(list(boundaries.values()))
    boundaries[WALLS] = np.setdiff1d(boundary_facets[~is_level], named_facets)
    return boundaries


def _check_face_area(extrusion: "Extrusion", name: str, meshed_area: float) -> None:
    """Raise MeshError if the area of the facets on a named polygonal face, `meshed_area` [mm^2], differs from its own.

    The mesh does not conform to the face if an edge of the face lies between two layers of the sweep, or between nodes
    of the section. Faces with curved edges are not checked.
    """
    area = extrusion.polygon_area(name)
    if area is not None and abs(meshed_area / area - 1.0) > _SAME_AREA:
        reason = f"the area of face {name!r} is {area:g} mm^2, but {meshed_area:g} mm^2 in the mesh"
        raise MeshError("faces", reason, "take another face")


def _facet_middles(profile: Profile, straight: MeshHex1, facets: Ints, profile_points: Ints) -> Floats:
    """Return the middles of the outer facets [mm], shape (3, n). On a facet swept from an arc, it lies on the arc.

    `facets` (n,) are the indices of the facets. `profile_points` (4, n) are the points of the profile at the corners.
    """
    middles = straight.p[:, straight.facets[:, facets]].mean(axis=1)
    ends = np.stack([profile_points.min(axis=0), profile_points.max(axis=0)])
    arc = index_by_nodes(profile.arcs, ends)
    # A facet swept from an edge has only two different points of the profile.
    has_two_points = np.array([len(set(points)) == 2 for points in profile_points.T.tolist()])  # noqa: PLR2004
    from_arc = (arc >= 0) & has_two_points
    middles[0, from_arc] = profile.midpoints[0, arc[from_arc]]
    middles[2, from_arc] = profile.midpoints[1, arc[from_arc]]
    return np.asarray(middles)
