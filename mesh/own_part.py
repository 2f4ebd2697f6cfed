"""The meshes of a part of any shape: its section in quadrilaterals, graded to what is thin, swept over the depth.

Boundaries are the names of the part's faces, `side_faces`, the ends of the sweep, `fillets`, the round inner corners of
the section, `walls`, all other walls that carry no load, and `symmetry` where half the part is meshed.
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
from mesh.housing.sweep import check_jacobian, curved, half_depth_shares, swept
from mesh.session import Ints, MeshError, element_nodes, gmsh_session, index_by_nodes, stage, used_nodes
from sensor.arrays import Flags, Floats

if TYPE_CHECKING:
    from cad.checks.own_part import Extrusion

SIDES, FILLETS, WALLS, SYMMETRY = "side_faces", "fillets", "walls", "symmetry"
_HINT = "check the solid at its smallest faces"
_SAMPLES = 2000  # places of the outline at which its thickness is measured
_FEWEST = 8  # least number of these places on a curve
_PER_THICKNESS = 1.0  # quadrilaterals across a wall, before each is divided into four
_PER_QUARTER = 3.0  # quadrilaterals along a quarter of a round inner corner, before the same division
_APART_MM = 0.4  # distance of the lines along which mesh and part are compared
_MOST_LINES = 10  # largest number of lines on a side of a quadrilateral
_IMPLIED = 1.05
_BIN_SHARE = 0.02  # width of a bin over the longest side
_GROWTH = 0.45  # growth of the element size per distance
_NEAR = 1e-6  # [mm]
_PARALLEL = 1e-12
_INSIDE = 1e-3  # share of the way from a node to the middle of a quadrilateral, where the depth is measured
_SAME_AREA = 0.02  # largest relative difference between the area of the facets on a face and its own
_FULL_SHARE = 0.5  # share of nodes with less than the full depth from which the sweep follows a region
_SHARP_RAD = np.radians(15.0)  # least turn of the outline at a sharp inner corner
_BESIDE = 1e-4  # distance from a corner at which the part is probed, over the span
_FRONTAL = 6.0
_MOVES = 10  # passes that move inner nodes to improve the angles


@dataclass(frozen=True, kw_only=True, eq=False)
class SweptPart:
    """The mesh of a swept part, with the error in the length of each of its columns of cells [mm].

    `effect` is `excess`, but larger where what is left out is narrower than it is long, or leaves little of the depth
    [mm]: the cut of a saw weakens as much as a hole as wide as it is long. `area` [mm^2] are the areas of the
    quadrilaterals, `cells` (layers, quadrilaterals) the cells over each. `share` is the part of the solid that is
    meshed, 1 or 0.5. `places` are the middles of the columns [mm]. `corner` (quadrilaterals,) is the number of the
    sharp inner corner that each touches, -1 if none; `corner_count` is the number of these corners. `depth` is the
    depth of the mesh over the points of the profile [mm].
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
    def _wrong(self) -> tuple[Floats, Floats]:
        """Return excess and effect; they take a second, and only the mesh of the answer needs them."""
        excess = _excess(self.extrusion, self.profile, self.depth, self.area)
        narrow, effect = _narrow(self.extrusion, self.profile, self.depth, self.area)
        return np.maximum(excess, narrow), np.maximum(excess, effect)

    @property
    def excess(self) -> Floats:
        """Return the error in the length of each column [mm]."""
        return self._wrong[0]

    @property
    def effect(self) -> Floats:
        """Return the error in the length of each column that has the same effect on the stiffness [mm]."""
        return self._wrong[1]


@dataclass(frozen=True, kw_only=True)
class FineCorners:
    """Sharp inner corners of a section by their numbers, with the size of the elements there.

    `size` is the element size over the thickness of the wall, or over the size without corners if that is less [1].
    """

    numbers: tuple[int, ...] = ()
    size: float = 1.0


@dataclass(frozen=True, eq=False)
class _Section:
    """A meshed section: its profile, and of each quadrilateral (m,) its region and the corner that it touches."""

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
    """Return the mesh [mm] of a swept part; `scale` 1 is the mesh to solve on, 2 the coarse one.

    It is the half above the middle of the depth if both halves are equal, are held and pressed equally, and no press
    has a component along the sweep. `layers` is the number of layers over half the depth. Raises MeshError with the
    stage that failed.
    """
    section = _meshed_section(extrusion, scale, fine)
    profile = section.profile
    low, high = _depths(extrusion, section)
    middle = 0.5 * (extrusion.low + extrusion.high)
    is_across = all(abs(direction[1]) < _NEAR for direction in presses)
    is_even = all(extrusion.is_even(name) for name in extrusion.part.faces)
    is_half = is_across and is_even and bool(np.abs(low + high - 2.0 * middle).max() < 2.0 * _NEAR)
    up = half_depth_shares(layers)
    shares = 0.5 + 0.5 * (up if is_half else np.concatenate([-up[:0:-1], up]))
    straight = swept(profile, shares)
    points = straight.p.copy()
    levels = points[1].reshape(len(shares), -1)
    points[1] = (low + levels * (high - low)).ravel()
    straight = MeshHex1(points, straight.t)
    quadratic = MeshHex2.from_mesh(straight)
    mesh = dataclasses.replace(quadratic, doflocs=curved(quadratic, profile))
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


def _excess(extrusion: "Extrusion", profile: Profile, depth: Floats, area: Floats) -> Floats:
    """Return the mean absolute difference in length between the columns over quadrilaterals and the part [mm].

    `depth` (points,) and `area` (quadrilaterals,) belong to the mesh [mm, mm^2].
    """
    excess = np.zeros(len(area))
    counts = np.clip(np.ceil(np.sqrt(area) / _APART_MM), 1, _MOST_LINES).astype(int)
    for count in np.unique(counts):
        quads = np.flatnonzero(counts == count)
        side = (np.arange(count) + 0.5) / count
        r, s = np.repeat(side, count), np.tile(side, count)
        shapes = np.stack([(1.0 - r) * (1.0 - s), r * (1.0 - s), r * s, (1.0 - r) * s])
        corners = profile.quads[:, quads]
        x, z = np.einsum("ijk,jq->ikq", profile.points[:, corners], shapes).reshape(2, -1)
        _, _, inside = extrusion.spans(x, z)
        meshed = (depth[corners].T @ shapes).ravel()
        # A line beside the part misses it only at its curved outline, where the mesh is as curved.
        missed = np.where(inside > 0.0, np.abs(meshed - inside), 0.0)
        excess[quads] = np.where(missed > _NEAR, missed, 0.0).reshape(len(quads), -1).mean(axis=1)
    return excess


def _narrow(extrusion: "Extrusion", profile: Profile, depth: Floats, area: Floats) -> tuple[Floats, Floats]:
    """Return the excess of columns by where the depth of the part changes, and its effect [mm]; see SweptPart."""
    excess, effect = np.zeros(len(area)), np.zeros(len(area))
    pieces = list(extrusion.uneven())
    if not pieces:
        return excess, effect
    places = np.array([place for place, _, _ in pieces]).T
    sizes, widths = (np.array([piece[i] for piece in pieces]) for i in (1, 2))
    corners = profile.points[:, profile.quads]
    sides = np.roll(corners, -1, axis=1) - corners
    _, _, inside = extrusion.spans(*places)
    for i in np.flatnonzero(inside > 0.0):
        place = places[:, i]
        turns = _cross(sides, place[:, None, None] - corners)
        quad = int(np.argmax(turns.min(axis=0)))  # among quadrilaterals that have the place on the left of all sides
        if not turns[:, quad].min() >= -_NEAR:
            continue
        over = depth[profile.quads[:, quad]]
        meshed = float(over.mean())
        missed = abs(meshed - float(inside[i]))
        if np.ptp(over) > _NEAR or not missed > _NEAR:
            continue  # the mesh follows a slanted face there, and lines see what it misses
        excess[quad] += missed * sizes[i] / area[quad]
        weak = max(1.0, missed / widths[i]) * meshed / inside[i] if meshed > inside[i] else 1.0
        effect[quad] += weak * missed * sizes[i] / area[quad]
    return excess, effect


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[0] * b[1] - a[1] * b[0])


def _meshed_section(extrusion: "Extrusion", scale: float, fine: FineCorners) -> _Section:
    """Return the section in quadrilaterals, with a region for each piece between the edges of slanted faces."""
    with gmsh_session():
        surfaces = _imported(extrusion)
        with stage("size", _HINT):
            gmsh.option.setNumber("Mesh.Algorithm", _FRONTAL)
            gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 1.0)
            gmsh.option.setNumber("Mesh.RecombineAll", 1.0)
            gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 1.0)
            gmsh.option.setNumber("Mesh.SubdivisionAlgorithm", 1.0)
            outline = _Outline(surfaces)
            sizes = GradedSizes(*outline.sizes(scale, fine), _GROWTH)

            def size_at(dim: int, _tag: int, x: float, _y: float, z: float, size: float) -> float:
                # Inside, gmsh takes the sizes of the outline, which are its own.
                return size if dim > 1 else sizes.at(x, z)

            gmsh.model.mesh.setSizeCallback(size_at)
        with stage("generate", _HINT):
            gmsh.model.mesh.generate(2)
            gmsh.model.mesh.optimize("Relocate2D", niter=_MOVES)
            gmsh.model.mesh.setOrder(2)
        with stage("read", _HINT):
            return _read(surfaces, outline.concave, outline.corners)


def _imported(extrusion: "Extrusion") -> list[int]:
    """Read the section into gmsh and divide it along the edges of slanted faces; return the tags of its pieces."""
    occ = gmsh.model.occ
    with os.fdopen(os.memfd_create("section.brep")) as in_memory, stage("import", _HINT):
        path = Path(f"/proc/self/fd/{in_memory.fileno()}")
        extrusion.section.exportBrep(str(path))
        found = [pair for pair in occ.importShapes(str(path), format="brep") if pair[0] == 2]  # noqa: PLR2004
        lines = []
        for (x0, z0), (x1, z1) in extrusion.lines:
            ends = [occ.addPoint(x, extrusion.plane, z) for x, z in ((x0, z0), (x1, z1))]
            lines.append((1, occ.addLine(*ends)))
        if lines:
            occ.fragment(found, lines)
        occ.synchronize()
        surfaces = [tag for _, tag in gmsh.model.getEntities(2)]
        of_surfaces = {
            curve for _, curve in gmsh.model.getBoundary([(2, tag) for tag in surfaces], combined=False, oriented=False)
        }
        loose = [pair for pair in gmsh.model.getEntities(1) if pair[1] not in of_surfaces]
        occ.remove(loose, recursive=True)
        occ.synchronize()
    return surfaces


class GradedSizes:
    """Sizes of elements at points, which grow with the distance from them [mm]; gmsh calls this a million times."""

    def __init__(self, points: Floats, sizes: Floats, growth: float) -> None:
        """Take points (dim, n) and sizes (n,), of which those are kept that others do not imply to a twentieth."""
        kept = np.zeros(0, dtype=np.int64)
        for i in np.argsort(sizes):
            away = np.linalg.norm(points[:, kept] - points[:, i, None], axis=0)
            if not len(kept) or (sizes[kept] + growth * away).min() > _IMPLIED * sizes[i]:
                kept = np.append(kept, i)
        self._points = np.vstack([points[:, kept], np.zeros((3 - len(points), len(kept)))])
        self._sizes = sizes[kept]
        self._growth = growth
        self._bin = _BIN_SHARE * float(np.ptp(points, axis=1).max())
        self._near: dict[tuple[int, int, int], list[tuple[float, float, float, float]]] = {}

    def at(self, x: float, y: float, z: float = 0.0) -> float:
        """Return the size at a place [mm], in a plane by two coordinates."""
        key = (int(x // self._bin), int(y // self._bin), int(z // self._bin))
        near = self._near.get(key)
        if near is None:
            near = self._near[key] = self._in_bin(key)
        growth, sqrt = self._growth, math.sqrt
        # Some ten points: arrays of them would take five times as long.
        return min(
            [size + growth * sqrt((a - x) * (a - x) + (b - y) * (b - y) + (c - z) * (c - z)) for a, b, c, size in near]
        )

    def _in_bin(self, key: tuple[int, int, int]) -> list[tuple[float, float, float, float]]:
        """Return the points that may set a size within a cube of space, each with its size."""
        middle = (np.array(key) + 0.5)[:, None] * self._bin
        there = self._sizes + self._growth * np.linalg.norm(self._points - middle, axis=0)
        reach = self._growth * self._bin * np.sqrt(len(key))  # either way, from the middle to a corner
        near = there <= there.min() + reach
        return [
            (x, y, z, size)
            for (x, y, z), size in zip(self._points.T[near].tolist(), self._sizes[near].tolist(), strict=True)
        ]


@dataclass(frozen=True, eq=False)
class _CurveEnd:
    """The end of a curve: its place [mm], the unit direction into the curve, and the outline's point nearest to it."""

    place: Floats
    into: Floats
    sample: int


class _Outline:
    """Places along the outline of a section: points (2, n), how thick it is there, radii of round inner corners."""

    def __init__(self, surfaces: list[int]) -> None:
        """Sample the curves that bound one piece of the section; curves between two pieces are inside."""
        pieces = [(2, tag) for tag in surfaces]
        around = [tag for _, tag in gmsh.model.getBoundary(pieces, combined=False, oriented=False)]
        curves = [tag for tag in dict.fromkeys(around) if around.count(tag) == 1]
        lengths = {tag: gmsh.model.occ.getMass(1, tag) for tag in curves}
        step = sum(lengths.values()) / _SAMPLES
        points, tangents, segments, radii, owners = [], [], [], [], []
        curve_ends: list[_CurveEnd] = []
        for tag in curves:
            (start,), (end,) = gmsh.model.getParametrizationBounds(1, tag)
            count = max(_FEWEST, int(np.ceil(lengths[tag] / step)))
            at = np.linspace(start, end, 2 * count + 1)
            place = np.reshape(gmsh.model.getValue(1, tag, at), (-1, 3))[:, [0, 2]].T
            derivative = np.reshape(gmsh.model.getDerivative(1, tag, at), (-1, 3))[:, [0, 2]].T
            curvature = np.asarray(gmsh.model.getCurvature(1, tag, at))
            ends = place[:, ::2]
            segments.append(np.stack([ends[:, :-1], ends[:, 1:]]))
            points.append(ends[:, :-1] + 0.5 * np.diff(ends, axis=1))  # on the chord: beside it a ray meets it
            tangents.append(derivative[:, 1::2] / np.linalg.norm(derivative[:, 1::2], axis=0))
            radii.append(1.0 / np.maximum(curvature[1::2], 1e-9) * self._bend(place))
            owners.append(np.full(count, tag))
            start_at = sum(map(len, owners[:-1]))
            for end, sign, sample in ((0, 1.0, start_at), (-1, -1.0, start_at + count - 1)):
                away = sign * derivative[:, end]
                curve_ends.append(_CurveEnd(place[:, end], away / np.linalg.norm(away), sample))
        self.points = np.hstack(points)
        self._tangents = np.hstack(tangents)
        self._segments = np.concatenate(segments, axis=2)
        self._radii = np.hstack(radii)
        self._owners = np.hstack(owners)
        self.concave: set[int] = set()
        self.corners, self._beside_corner = self._sharp_corners(curve_ends)

    def _sharp_corners(self, ends: "list[_CurveEnd]") -> tuple[Floats, Ints]:
        """Return the sharp inner corners (2, n) [mm], with the outline's points on both sides of each (2, n)."""
        corners, samples = [], []
        for i, one in enumerate(ends):
            for other in ends[:i]:
                if np.linalg.norm(other.place - one.place) > _NEAR * self.span:
                    continue
                turn = np.pi - np.arccos(np.clip(one.into @ other.into, -1.0, 1.0))
                between = one.into + other.into
                beside = one.place + _BESIDE * self.span * between / max(float(np.linalg.norm(between)), _NEAR)
                if turn > _SHARP_RAD and not self._is_inside(beside):
                    corners.append(one.place)
                    samples.append((one.sample, other.sample))
        return np.array(corners).reshape(-1, 2).T, np.array(samples, dtype=np.int64).reshape(-1, 2).T

    def _is_inside(self, place: Floats) -> bool:
        """Return whether a place [mm] is in the section: a ray from it crosses the outline an odd number of times."""
        (x0, z0), (x1, z1) = self._segments
        crosses = (z0 > place[1]) != (z1 > place[1])
        at = x0[crosses] + (place[1] - z0[crosses]) / (z1 - z0)[crosses] * (x1 - x0)[crosses]
        return bool((at > place[0]).sum() % 2)

    @staticmethod
    def _bend(place: Floats) -> Floats:
        """Return 1 where a curve through places (2, 2 n + 1) bends to the left, -1 to the right, at the odd places."""
        before, at, after = place[:, :-2:2], place[:, 1:-1:2], place[:, 2::2]
        return np.asarray(np.where(_cross(at - before, after - at) >= 0.0, 1.0, -1.0))

    def sizes(self, scale: float, fine: FineCorners) -> tuple[Floats, Floats]:
        """Return places (2, n), with the size of an element at each before it is divided [mm], shape (n,)."""
        left = np.stack([-self._tangents[1], self._tangents[0]])
        to_left, odd_left = self._across(left)
        to_right, _ = self._across(-left)
        thickness = np.where(odd_left, to_left, to_right)
        sizes = thickness / _PER_THICKNESS
        # The centre of an inner corner lies outside: it is left of the curve where the part is right of it.
        is_concave = (self._radii > 0.0) != odd_left
        radius = np.abs(self._radii)
        quarter = 0.5 * np.pi * radius
        sizes = np.minimum(sizes, np.where(is_concave, quarter / _PER_QUARTER, quarter))
        for tag in np.unique(self._owners):
            on = self._owners == tag
            if is_concave[on].all() and (radius[on] < 1e3 * self.span).all():
                self.concave.add(int(tag))
        sizes *= scale
        numbers = list(fine.numbers)
        corners = self.corners[:, numbers]
        away = np.linalg.norm(corners[:, :, None] - self.points[:, None], axis=0)
        own = (sizes + _GROWTH * away).min(axis=1, initial=np.inf)
        finer = fine.size * np.minimum(own, thickness[self._beside_corner[:, numbers]].min(axis=0))
        return np.hstack([self.points, corners]), np.concatenate([sizes, finer])

    @property
    def span(self) -> float:
        """Return the largest side of the section [mm]."""
        return float(np.ptp(self.points, axis=1).max())

    def _across(self, direction: Floats) -> tuple[Floats, Flags]:
        """Return the distance from the places to the outline along rays [mm], and whether they began inside."""
        start, end = self._segments
        along = end - start
        distance = np.full(self.points.shape[1], np.inf)
        crossings = np.zeros(self.points.shape[1], dtype=int)
        for i in range(self.points.shape[1]):
            origin, ray = self.points[:, i, None], direction[:, i, None]
            cross = _cross(np.broadcast_to(ray, along.shape), along)
            safe = np.where(np.abs(cross) > _PARALLEL, cross, np.inf)
            gap = start - origin
            t = _cross(gap, along) / safe
            s = _cross(gap, np.broadcast_to(ray, along.shape)) / safe
            hit = (t > _NEAR * self.span) & (s >= 0.0) & (s < 1.0)
            crossings[i] = hit.sum()
            distance[i] = t[hit].min(initial=np.inf)
        return distance, crossings % 2 == 1


def _read(surfaces: list[int], concave: set[int], sharp: Floats) -> _Section:
    """Return the mesh that gmsh has made, with its quadrilaterals at sharp corners (2, n) [mm]; raises MeshError."""
    quads, regions = [], []
    for region, tag in enumerate(surfaces):
        kinds = gmsh.model.mesh.getElementTypes(2, tag)
        if list(kinds) != [gmsh.model.mesh.getElementType("Quadrangle", 2)]:
            raise MeshError("read", "the section has elements other than quadrilaterals", _HINT)
        of_region = element_nodes("Quadrangle", 2, tag)[:4]
        quads.append(of_region)
        regions.append(np.full(of_region.shape[1], region))
    tags = np.hstack(quads)
    nodes = used_nodes(tags)
    points = np.ascontiguousarray(nodes.points[[0, 2]])
    found = nodes.index[tags]
    corners = points[:, found]
    clockwise = _cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]) < 0.0
    found = np.where(clockwise, found[::-1], found)
    around = gmsh.model.getBoundary([(2, tag) for tag in surfaces], combined=False, oriented=False)
    arcs, middles, fillets = [], [], []
    everything = used_nodes(np.hstack([element_nodes("Line", 2, tag) for _, tag in around]))
    for tag in dict.fromkeys(curve for _, curve in around):
        line = element_nodes("Line", 2, tag)
        arcs.append(nodes.index[line[:2]])
        middles.append(everything.points[:, everything.index[line[2]]][[0, 2]])
        if tag in concave:
            fillets.append(nodes.index[line[:2]])
    empty = np.zeros((2, 0), dtype=np.int64)
    profile = Profile(
        points=points,
        quads=found,
        arcs=np.hstack(arcs),
        midpoints=np.hstack(middles),
        surfaces={FILLETS: np.hstack([empty, *fillets])},
    )
    corner = np.full(found.shape[1], -1)
    for number, place in enumerate(sharp.T):
        node = int(np.argmin(np.linalg.norm(points - place[:, None], axis=0)))
        corner[(found == node).any(axis=0)] = number
    return _Section(profile, np.hstack(regions), corner, sharp.shape[1])


def _depths(extrusion: "Extrusion", section: _Section) -> tuple[Floats, Floats]:
    """Return the ends of the sweep over each node [mm].

    A region of the section follows the part where most of its nodes have less than the full depth: necks and tips. Else
    what lies inside it, as a pocket, is left out.
    """
    profile = section.profile
    points, quads = profile.points, profile.quads
    middles = points[:, quads].mean(axis=1)
    _, _, inside = extrusion.spans(*middles)
    low = np.full(points.shape[1], extrusion.low)
    high = np.full(points.shape[1], extrusion.high)
    for region in np.unique(section.region):
        of_region = section.region == region
        full = extrusion.high - extrusion.low
        if (inside[of_region] > full - _NEAR).mean() > _FULL_SHARE:
            continue
        own = quads[:, of_region]
        nodes, first = np.unique(own, return_index=True)
        toward = middles[:, of_region][:, first % own.shape[1]]
        looked = points[:, nodes] + _INSIDE * (toward - points[:, nodes])
        lower, upper, length = extrusion.spans(*looked)
        if (length <= 0.0).any():
            raise MeshError("depth", "the sweep leaves the part", _HINT)
        low[nodes] = np.maximum(low[nodes], lower)
        high[nodes] = np.minimum(high[nodes], upper)
    return low, high


def _boundaries(extrusion: "Extrusion", profile: Profile, straight: MeshHex1, *, is_half: bool) -> dict[str, Ints]:
    """Return the named facets of a swept part; raises MeshError where a face of the part has none."""
    n = profile.points.shape[1]
    outside = straight.boundary_facets()
    corners = straight.facets[:, outside]
    lowest, highest = corners.min(axis=0) // n, corners.max(axis=0) // n
    top = straight.p.shape[1] // n - 1
    is_level = lowest == highest
    boundaries: dict[str, Ints] = {}
    below = corners % n
    ends = np.stack([below.min(axis=0), below.max(axis=0)])
    if is_half:
        boundaries[SYMMETRY] = outside[is_level & (lowest == 0)]
    y = straight.p[1, corners]
    on_end = is_level & (lowest == top) & (np.abs(y - extrusion.high).max(axis=0) < _NEAR)
    if not is_half:
        on_end |= is_level & (lowest == 0) & (np.abs(y - extrusion.low).max(axis=0) < _NEAR)
    boundaries[SIDES] = outside[on_end]
    fillets = profile.surfaces[FILLETS]
    if fillets.shape[1]:
        boundaries[FILLETS] = outside[~is_level & (index_by_nodes(fillets, ends) >= 0)]
    # A facet lies on a face of the part where its middle does: between curved edges it bulges as the face does.
    middles = _facet_middles(profile, straight, outside, below)
    for name in extrusion.part.faces:
        on_face = extrusion.lies_on(name, middles, 10.0 * _NEAR)
        boundaries[name] = outside[on_face]
        if not on_face.any():
            raise MeshError("faces", f"no facet of the swept section lies on {name}", "take another face")
        area = extrusion.polygon_area(name)
        meshed = (2.0 if is_half else 1.0) * facets_area(straight, boundaries[name])
        if area is not None and abs(meshed / area - 1.0) > _SAME_AREA:
            # An edge of the face lies between two layers of the sweep, or between nodes of the section.
            raise MeshError("faces", f"{name} has {area:g} mm^2, its facets {meshed:g}", "take another face")
    named = np.concatenate(list(boundaries.values()))
    boundaries[WALLS] = np.setdiff1d(outside[~is_level], named)
    return boundaries


def _facet_middles(profile: Profile, straight: MeshHex1, outside: Ints, below: Ints) -> Floats:
    """Return the middles of outer facets [mm], (3, n): over the middle of a curved edge where they stand on one."""
    middles = straight.p[:, straight.facets[:, outside]].mean(axis=1)
    ends = np.stack([below.min(axis=0), below.max(axis=0)])
    arc = index_by_nodes(profile.arcs, ends)
    standing = (arc >= 0) & np.array([len(set(column)) == 2 for column in below.T.tolist()])  # noqa: PLR2004
    middles[0, standing] = profile.midpoints[0, arc[standing]]
    middles[2, standing] = profile.midpoints[1, arc[standing]]
    return np.asarray(middles)
