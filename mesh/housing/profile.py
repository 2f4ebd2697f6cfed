"""The profile of the housing in quadrilaterals, made by gmsh from four-sided blocks."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import gmsh
import numpy as np

from mesh.gmsh_arrays import Floats, Ints, element_nodes, used_nodes
from mesh.housing.blocks import Block, Point, Segment
from mesh.session import MeshError, gmsh_session, stage

_SMOOTHING = 10
_DIGITS = 9  # points closer than 1e-9 mm are one point


@dataclass(frozen=True, kw_only=True)
class Profile:
    """Points (2, points) [mm] in (x, z), quadrilaterals (4, m) counterclockwise, edges (2, k) on arcs, their middles.

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
            self.curves[key] = (self._drawn(segment), segment)
        tag, earlier = self.curves[key]
        if earlier.count != segment.count:
            reason = f"the side from {segment.start} to {segment.end} has {earlier.count} and {segment.count} elements"
            raise MeshError("blocks", reason, "check the dimensions of the housing")
        return tag

    def _drawn(self, segment: Segment) -> int:
        geo, start, end = gmsh.model.geo, self.point(segment.start), self.point(segment.end)
        if segment.centre is None:
            tag = geo.addLine(start, end)
        else:
            tag = geo.addCircleArc(start, self.point(segment.centre), end)
        rule = ("Progression", segment.growth) if segment.bump == 1.0 else ("Bump", segment.bump)
        geo.mesh.setTransfiniteCurve(tag, segment.count + 1, *rule)
        return int(tag)


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
    if list(gmsh.model.mesh.getElementTypes(2)) != [gmsh.model.mesh.getElementType("Quadrangle", 1)]:
        raise MeshError("read", "the profile has elements other than quadrilaterals", "check the blocks")
    quads = element_nodes("Quadrangle")
    nodes = used_nodes(quads)
    points = np.ascontiguousarray(nodes.places[[0, 2]])
    edges = [(nodes.index[element_nodes("Line", entity=tag)], segment) for tag, segment in curves]
    arcs = [ends for ends, segment in edges if segment.centre is not None]
    surfaces = sorted({segment.surface for _, segment in edges} - {""})
    return Profile(
        points=points,
        quads=_counterclockwise(points, nodes.index[quads]),
        arcs=np.hstack(arcs),
        midpoints=np.hstack([_midpoints(points[:, ends], arc) for ends, arc in edges if arc.centre is not None]),
        surfaces={name: np.hstack([ends for ends, one in edges if one.surface == name]) for name in surfaces},
    )


def _midpoints(ends: Floats, arc: Segment) -> Floats:
    """Return the middle of each piece of an arc, shape (2, k), from its ends (2, 2, k)."""
    centre = np.array(arc.centre).reshape(2, 1)
    away = ends.mean(axis=1) - centre
    radius = np.linalg.norm(np.array(arc.start) - centre[:, 0])
    return np.asarray(centre + radius * away / np.linalg.norm(away, axis=0))


def _counterclockwise(points: Floats, quads: Ints) -> Ints:
    (x0, x1, x2, x3), (z0, z1, z2, z3) = points[:, quads]
    clockwise = (x2 - x0) * (z3 - z1) - (x3 - x1) * (z2 - z0) < 0.0
    return np.where(clockwise, quads[::-1], quads)
