"""The profile of the housing in quadrilaterals, made by gmsh from four-sided blocks."""

from collections import defaultdict
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

    def point(self, point: Point) -> int:
        """Return the tag of a point."""
        key = _rounded(point)
        if key not in self.points:
            self.points[key] = gmsh.model.geo.addPoint(point[0], 0.0, point[1])
        return self.points[key]

    def curve(self, segment: Segment) -> int:
        """Return the tag of a segment's curve; raises MeshError when its neighbour has another count."""
        key = frozenset((_rounded(segment.start), _rounded(segment.end)))
        if key not in self.curves:
            self.curves[key] = (self._add(segment), segment)
        tag, neighbour = self.curves[key]
        if neighbour.count != segment.count:
            reason = (
                f"the side from {segment.start} to {segment.end} has {neighbour.count} and {segment.count} elements"
            )
            raise MeshError("blocks", reason, "check the dimensions of the housing")
        return tag

    def _add(self, segment: Segment) -> int:
        geo = gmsh.model.geo
        start = self.point(segment.start)
        end = self.point(segment.end)
        if segment.centre is None:
            tag = geo.addLine(start, end)
        else:
            tag = geo.addCircleArc(start, self.point(segment.centre), end)
        if segment.bump == 1.0:
            geo.mesh.setTransfiniteCurve(tag, segment.count + 1, "Progression", segment.growth)
        else:
            geo.mesh.setTransfiniteCurve(tag, segment.count + 1, "Bump", segment.bump)
        return int(tag)


def _rounded(point: Point) -> Point:
    """Return the key by which points are the same; adding 0 turns -0.0 into 0.0."""
    return round(point[0], _DIGITS) + 0.0, round(point[1], _DIGITS) + 0.0


def meshed_profile(blocks: Iterable[Block]) -> Profile:
    """Return the quadrilaterals of the blocks [mm]; raises MeshError with the stage that failed."""
    with gmsh_session():
        with stage("blocks", "check the dimensions of the housing"):
            curves = _Curves()
            for block in blocks:
                _add_block(block, curves)
            gmsh.model.geo.synchronize()
        with stage("generate", "check the dimensions of the housing"):
            gmsh.model.mesh.generate(2)
        with stage("read", "check the dimensions of the housing"):
            return _profile_of(list(curves.curves.values()))


def _add_block(block: Block, curves: _Curves) -> None:
    geo = gmsh.model.geo
    boundary = [curves.curve(segment) for side in block.sides for segment in side]
    surface = geo.addPlaneSurface([geo.addCurveLoop(boundary, reorient=True)])
    corners = [curves.point(corner) for corner in _corners(block.sides)]
    geo.mesh.setTransfiniteSurface(surface, cornerTags=corners)
    geo.mesh.setRecombine(2, surface)
    if block.smooth:
        geo.mesh.setSmoothing(2, surface, _SMOOTHING)


def _corners(sides: Sequence[Sequence[Segment]]) -> list[Point]:
    """Return the point that each side shares with the one before it."""
    ends = []
    for side in sides:
        points = {_rounded(segment.start) for segment in side}
        ends.append(points | {_rounded(segment.end) for segment in side})
    return [next(iter(ends[i - 1] & ends[i])) for i in range(len(sides))]


def _profile_of(curves: Sequence[tuple[int, Segment]]) -> Profile:
    """Return the mesh that gmsh holds, with the edges of the curves, given by their tags."""
    if list(gmsh.model.mesh.getElementTypes(2)) != [gmsh.model.mesh.getElementType("Quadrangle", 1)]:
        raise MeshError("read", "the profile has elements other than quadrilaterals", "check the blocks")
    quads = element_nodes("Quadrangle")
    nodes = used_nodes(quads)
    points = np.ascontiguousarray(nodes.points[[0, 2]])

    arcs = []
    midpoints = []
    surfaces: dict[str, list[Ints]] = defaultdict(list)
    for tag, segment in curves:
        edges = nodes.index[element_nodes("Line", entity=tag)]
        if segment.centre is not None:
            arcs.append(edges)
            midpoints.append(_arc_midpoints(points[:, edges], segment))
        if segment.surface:
            surfaces[segment.surface].append(edges)

    return Profile(
        points=points,
        quads=_counterclockwise(points, nodes.index[quads]),
        arcs=np.hstack(arcs),
        midpoints=np.hstack(midpoints),
        surfaces={name: np.hstack(surfaces[name]) for name in sorted(surfaces)},
    )


def _arc_midpoints(ends: Floats, arc: Segment) -> Floats:
    """Return the middle of each piece of an arc, shape (2, k), from its ends (2, 2, k)."""
    centre = np.array(arc.centre).reshape(2, 1)
    chord = ends.mean(axis=1) - centre
    radius = np.linalg.norm(np.array(arc.start) - centre[:, 0])
    return np.asarray(centre + radius * chord / np.linalg.norm(chord, axis=0))


def _counterclockwise(points: Floats, quads: Ints) -> Ints:
    corners = points[:, quads]
    first_diagonal = corners[:, 2] - corners[:, 0]
    second_diagonal = corners[:, 3] - corners[:, 1]
    clockwise = first_diagonal[0] * second_diagonal[1] - second_diagonal[0] * first_diagonal[1] < 0.0
    return np.where(clockwise, quads[::-1], quads)
