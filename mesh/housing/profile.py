"""The profile of the housing in quadrilaterals, made by gmsh from four-sided blocks."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import gmsh
import numpy as np
from numpy.typing import NDArray

from mesh.housing.blocks import Block, Point, Segment
from mesh.session import MeshError, gmsh_session, stage

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_SMOOTHING = 10
_DIGITS = 9  # points closer than 1e-9 mm are one point


@dataclass(frozen=True, kw_only=True)
class Profile:
    """Points (2, n) [mm] in (x, z), quadrilaterals (4, m) counterclockwise, edges (2, k) on arcs with their midpoints.

    `surfaces` gives by name the edges (2, k) that lie on a named surface.
    """

    points: Floats
    quads: Ints
    arcs: Ints
    midpoints: Floats
    surfaces: dict[str, Ints]


class _Curves:
    """The curves that gmsh has so far: blocks that share a segment share its curve."""

    def __init__(self) -> None:
        self.points: dict[Point, int] = {}
        self.curves: dict[frozenset[Point], tuple[int, Segment]] = {}

    def point(self, place: Point) -> int:
        """Return the tag of a point."""
        key = _key(place)
        if key not in self.points:
            self.points[key] = gmsh.model.geo.addPoint(place[0], 0.0, place[1])
        return self.points[key]

    def curve(self, segment: Segment) -> int:
        """Return the tag of a segment's curve; raises MeshError when its neighbour has another count."""
        key = frozenset((_key(segment.start), _key(segment.end)))
        if key not in self.curves:
            start, end = self.point(segment.start), self.point(segment.end)
            geo = gmsh.model.geo
            tag = (
                geo.addLine(start, end)
                if segment.centre is None
                else geo.addCircleArc(start, self.point(segment.centre), end)
            )
            rule = ("Progression", segment.growth) if segment.bump == 1.0 else ("Bump", segment.bump)
            geo.mesh.setTransfiniteCurve(tag, segment.count + 1, *rule)
            self.curves[key] = (tag, segment)
        tag, known = self.curves[key]
        if known.count != segment.count:
            reason = f"the side from {segment.start} to {segment.end} has {known.count} and {segment.count} elements"
            raise MeshError("blocks", reason, "check the dimensions of the housing")
        return tag


def _key(place: Point) -> Point:
    x, z = (round(one, _DIGITS) + 0.0 for one in place)
    return x, z


def meshed_profile(blocks: Iterable[Block]) -> Profile:
    """Return the quadrilaterals of the blocks [mm]; raises MeshError with the stage that failed."""
    with gmsh_session():
        with stage("blocks", "check the dimensions of the housing"):
            curves = _Curves()
            for block in blocks:
                _add(block, curves)
            gmsh.model.geo.synchronize()
        with stage("generate", "check the dimensions of the housing"):
            gmsh.model.mesh.generate(2)
        with stage("read", "check the dimensions of the housing"):
            return _read(list(curves.curves.values()))


def _add(block: Block, curves: _Curves) -> None:
    sides = [[curves.curve(segment) for segment in side] for side in block.sides]
    geo = gmsh.model.geo
    surface = geo.addPlaneSurface([geo.addCurveLoop([tag for side in sides for tag in side], reorient=True)])
    geo.mesh.setTransfiniteSurface(surface, cornerTags=[curves.point(one) for one in _corners(block.sides)])
    geo.mesh.setRecombine(2, surface)
    if block.smooth:
        geo.mesh.setSmoothing(2, surface, _SMOOTHING)


def _corners(sides: Sequence[Sequence[Segment]]) -> list[Point]:
    """Return the point that each side shares with the one before it."""
    ends = [{_key(point) for one in side for point in (one.start, one.end)} for side in sides]
    return [next(iter(ends[i - 1] & ends[i])) for i in range(len(sides))]


def _read(curves: Sequence[tuple[int, Segment]]) -> Profile:
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    kinds, _, nodes = gmsh.model.mesh.getElements(2)
    if list(kinds) != [gmsh.model.mesh.getElementType("Quadrangle", 1)]:
        raise MeshError("read", "the profile has elements other than quadrilaterals", "check the blocks")
    quads = np.asarray(nodes[0], dtype=np.int64).reshape(-1, 4).T
    used = np.unique(quads)
    place = np.full(int(np.max(tags)) + 1, -1, dtype=np.int64)
    where = np.empty_like(place)
    where[np.asarray(tags, dtype=np.int64)] = np.arange(len(tags))
    place[used] = np.arange(len(used))
    points = np.ascontiguousarray(np.reshape(coordinates, (-1, 3))[where[used]][:, [0, 2]].T)
    edges = {tag: place[_edges(tag)] for tag, _ in curves}
    round_ones = [(edges[tag], segment, segment.centre) for tag, segment in curves if segment.centre is not None]
    surfaces = {segment.surface for _, segment in curves} - {""}
    return Profile(
        points=points,
        quads=_counterclockwise(points, place[quads]),
        arcs=np.hstack([ends for ends, _, _ in round_ones]),
        midpoints=np.hstack([_midpoints(points[:, ends], one.start, centre) for ends, one, centre in round_ones]),
        surfaces={
            name: np.hstack([edges[tag] for tag, segment in curves if segment.surface == name])
            for name in sorted(surfaces)
        },
    )


def _edges(curve: int) -> Ints:
    return np.asarray(gmsh.model.mesh.getElements(1, curve)[2][0], dtype=np.int64).reshape(-1, 2).T


def _midpoints(ends: Floats, start: Point, centre: Point) -> Floats:
    """Return the middle of each piece of an arc, shape (2, k), from its ends (2, 2, k)."""
    middle = np.array(centre).reshape(2, 1)
    away = ends.mean(axis=1) - middle
    return np.asarray(middle + math.dist(start, centre) * away / np.linalg.norm(away, axis=0))


def _counterclockwise(points: Floats, quads: Ints) -> Ints:
    (x0, x1, x2, x3), (z0, z1, z2, z3) = points[:, quads]
    clockwise = (x2 - x0) * (z3 - z1) - (x3 - x1) * (z2 - z0) < 0.0
    return np.where(clockwise, quads[::-1], quads)
