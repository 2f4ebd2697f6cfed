"""The profile of the housing in quadrilaterals, made by gmsh from four-sided blocks."""

from collections.abc import Iterable
from dataclasses import dataclass

import gmsh
import numpy as np

from mesh.housing.blocks import Block, Point, Segment
from mesh.session import Ints, MeshError, element_nodes, gmsh_session, stage, used_nodes
from sensor.arrays import Floats

_SMOOTHING = 10  # steps of gmsh's smoother, used on fans
_DIGITS = 9  # decimals [mm] of a point, to merge equal points


@dataclass(frozen=True, kw_only=True)
class Profile:
    """Points (2, points) [mm] in (x, z), quadrilaterals (4, m) counterclockwise, edges (2, k) on arcs, their midpoints.

    `surfaces` has the edges (2, k) on each named surface.
    """

    points: Floats
    quads: Ints
    arcs: Ints
    midpoints: Floats
    surfaces: dict[str, Ints]


class _Curves:
    """The curves added to gmsh; blocks that share a segment share its curve."""

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
        """Return the tag of a segment's curve; raises MeshError if a neighbour has another number of elements."""
        key = frozenset((_rounded(segment.start), _rounded(segment.end)))
        if key not in self.curves:
            self.curves[key] = (self._add(segment), segment)
        tag, earlier = self.curves[key]
        if earlier.count != segment.count:
            reason = f"the side from {segment.start} to {segment.end} has {earlier.count} and {segment.count} elements"
            raise MeshError("blocks", reason, "check the dimensions of the housing")
        return tag

    def _add(self, segment: Segment) -> int:
        """Add a line or an arc with its elements to gmsh and return its tag."""
        geo = gmsh.model.geo
        start = self.point(segment.start)
        end = self.point(segment.end)
        if segment.centre is None:
            tag = geo.addLine(start, end)
        else:
            tag = geo.addCircleArc(start, self.point(segment.centre), end)
        rule = ("Progression", segment.growth) if segment.bump == 1.0 else ("Bump", segment.bump)
        geo.mesh.setTransfiniteCurve(tag, segment.count + 1, *rule)
        return int(tag)


def _rounded(point: Point) -> Point:
    """Return a point rounded to 1e-9 mm, as a key; adding 0 converts -0 to 0."""
    return round(point[0], _DIGITS) + 0.0, round(point[1], _DIGITS) + 0.0


def meshed_profile(blocks: Iterable[Block]) -> Profile:
    """Return the quadrilaterals of the blocks [mm]; raises MeshError with the failed stage."""
    hint = "check the dimensions of the housing"
    with gmsh_session():
        with stage("blocks", hint):
            curves = _Curves()
            for block in blocks:
                _add_surface(block, curves)
            gmsh.model.geo.synchronize()
        with stage("generate", hint):
            gmsh.model.mesh.generate(2)
        with stage("read", hint):
            return _read(curves.curves.values())


def _add_surface(block: Block, curves: _Curves) -> None:
    """Add the four-sided surface of a block to gmsh, with the divisions of its sides."""
    geo = gmsh.model.geo
    tags = [curves.curve(segment) for side in block.sides for segment in side]
    surface = geo.addPlaneSurface([geo.addCurveLoop(tags, reorient=True)])

    # A side may have several segments; a corner is the point that a side shares with the previous one.
    ends = []
    for side in block.sides:
        points = {_rounded(segment.start) for segment in side} | {_rounded(segment.end) for segment in side}
        ends.append(points)
    corners = []
    for i, points in enumerate(ends):
        (corner, *_) = ends[i - 1] & points
        corners.append(curves.point(corner))
    geo.mesh.setTransfiniteSurface(surface, cornerTags=corners)
    geo.mesh.setRecombine(2, surface)
    if block.smooth:
        geo.mesh.setSmoothing(2, surface, _SMOOTHING)


def _read(curves: Iterable[tuple[int, Segment]]) -> Profile:
    """Return the mesh that gmsh has made, given the tag of each curve with its segment; raises MeshError.

    gmsh's straight edges on arcs are kept with their midpoints on the arc, so that the elements can be curved later.
    """
    if list(gmsh.model.mesh.getElementTypes(2)) != [gmsh.model.mesh.getElementType("Quadrangle", 1)]:
        raise MeshError("read", "the profile has elements other than quadrilaterals", "check the blocks")
    quads = element_nodes("Quadrangle")
    nodes = used_nodes(quads)
    points = np.ascontiguousarray(nodes.points[[0, 2]])

    quads = nodes.index[quads]
    (x0, x1, x2, x3), (z0, z1, z2, z3) = points[:, quads]
    clockwise = (x2 - x0) * (z3 - z1) - (x3 - x1) * (z2 - z0) < 0.0  # sign of the cross product of the diagonals
    quads = np.where(clockwise, quads[::-1], quads)

    arcs = []
    midpoints = []
    surfaces: dict[str, list[Ints]] = {}
    for tag, segment in curves:
        if segment.centre is None and not segment.surface:
            continue  # a line inside the profile, or on a face without a name
        edges = nodes.index[element_nodes("Line", entity=tag)]
        if segment.centre is not None:
            arcs.append(edges)
            midpoints.append(_arc_midpoints(points, edges, segment.start, segment.centre))
        if segment.surface:
            surfaces.setdefault(segment.surface, []).append(edges)
    return Profile(
        points=points,
        quads=quads,
        arcs=np.hstack(arcs),
        midpoints=np.hstack(midpoints),
        surfaces={name: np.hstack(surfaces[name]) for name in sorted(surfaces)},
    )


def _arc_midpoints(points: Floats, edges: Ints, start: Point, centre: Point) -> Floats:
    """Return the midpoints (2, k) [mm] of the pieces of an arc, given as edges (2, k) of points (2, n) [mm].

    They have the same distance from the centre as the start of the arc.
    """
    middle = np.array(centre).reshape(2, 1)
    from_centre = points[:, edges].mean(axis=1) - middle
    radius = np.linalg.norm(np.array(start) - middle[:, 0])
    return np.asarray(middle + radius * from_centre / np.linalg.norm(from_centre, axis=0))
