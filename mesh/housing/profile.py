"""The profile of the housing in quadrilaterals, made by gmsh from four-sided blocks."""

from collections.abc import Iterable
from dataclasses import dataclass

import gmsh
import numpy as np

from mesh.housing.blocks import Block, Point, Segment
from mesh.session import Ints, MeshError, element_nodes, gmsh_session, stage, used_nodes
from sensor.arrays import Floats

_SMOOTHING = 10  # steps of gmsh's smoother, which is applied to fans
_DIGITS = 9  # decimals to which coordinates [mm] of points are rounded when equal points are merged


@dataclass(frozen=True, kw_only=True)
class Profile:
    """A mesh of the profile in quadrilaterals.

    `points` (2, n) [mm] are (x, z). `quads` (4, m) are the point indices of the quadrilaterals, counterclockwise.
    `arcs` (2, k) are the edges on arcs, and `midpoints` (2, k) [mm] the middles of these arcs. `surfaces` has the edges
    (2, j) on each named surface.
    """

    points: Floats
    quads: Ints
    arcs: Ints
    midpoints: Floats
    surfaces: dict[str, Ints]


class _Curves:
    """The points and curves added to gmsh, so that blocks that share a segment also share its curve.

    `points` has gmsh's tags, and `curves` the tag and the segment for each pair of end points.
    """

    def __init__(self) -> None:
        self.points: dict[Point, int] = {}
        self.curves: dict[frozenset[Point], tuple[int, Segment]] = {}

    def point(self, point: Point) -> int:
        """Return gmsh's tag of a point, which is added if it is new."""
        key = _rounded(point)
        if key not in self.points:
            self.points[key] = gmsh.model.geo.addPoint(point[0], 0.0, point[1])
        return self.points[key]

    def curve(self, segment: Segment) -> int:
        """Return gmsh's tag of a segment's curve, which is added if it is new.

        Raises MeshError if another block has the same segment with another number of elements.
        """
        key = frozenset((_rounded(segment.start), _rounded(segment.end)))
        if key not in self.curves:
            self.curves[key] = (self._add(segment), segment)
        tag, earlier = self.curves[key]
        if earlier.count != segment.count:
            reason = f"the side from {segment.start} to {segment.end} has {earlier.count} and {segment.count} elements"
            raise MeshError("blocks", reason, "check the dimensions of the housing")
        return tag

    def _add(self, segment: Segment) -> int:
        """Add a line or an arc with its division into elements to gmsh, and return its tag."""
        geo = gmsh.model.geo
        start = self.point(segment.start)
        end = self.point(segment.end)
        if segment.centre is None:
            tag = geo.addLine(start, end)
        else:
            tag = geo.addCircleArc(start, self.point(segment.centre), end)
        spacing = ("Progression", segment.growth) if segment.bump == 1.0 else ("Bump", segment.bump)
        geo.mesh.setTransfiniteCurve(tag, segment.count + 1, *spacing)
        return int(tag)


def _rounded(point: Point) -> Point:
    """Return a point rounded to 1e-9 mm, as a dictionary key; adding 0 converts -0 to 0."""
    return round(point[0], _DIGITS) + 0.0, round(point[1], _DIGITS) + 0.0


def mesh_profile(blocks: Iterable[Block]) -> Profile:
    """Return the mesh of the blocks in quadrilaterals [mm].

    Raises MeshError if two blocks divide a common side differently, and MachineError if gmsh fails.
    """
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
            return _read_profile(curves.curves.values())


def _add_surface(block: Block, curves: _Curves) -> None:
    """Add the surface of a block to gmsh as a transfinite surface, in rows and columns of quadrilaterals."""
    geo = gmsh.model.geo
    tags = [curves.curve(segment) for side in block.sides for segment in side]
    surface = geo.addPlaneSurface([geo.addCurveLoop(tags, reorient=True)])

    # A side may have several segments, so gmsh needs the four corners. A corner is common to a side and the one before.
    points_of_sides = []
    for side in block.sides:
        points = {_rounded(segment.start) for segment in side} | {_rounded(segment.end) for segment in side}
        points_of_sides.append(points)
    corners = []
    for i, points in enumerate(points_of_sides):
        (corner, *_) = points_of_sides[i - 1] & points
        corners.append(curves.point(corner))
    geo.mesh.setTransfiniteSurface(surface, cornerTags=corners)
    geo.mesh.setRecombine(2, surface)
    if block.smooth:
        geo.mesh.setSmoothing(2, surface, _SMOOTHING)


def _read_profile(curves: Iterable[tuple[int, Segment]]) -> Profile:
    """Return the mesh that gmsh has made, given gmsh's tag of each curve with its segment.

    gmsh's edges are straight. For edges on arcs, the middle of the arc is added, so that elements can be curved later.
    Raises MeshError if an element is not a quadrilateral.
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
            continue  # a straight line that is on no named surface
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
    """Return the middles (2, k) [mm] of the pieces of an arc, whose chords are the edges (2, k) of `points` (2, n).

    The middle of a chord is moved away from `centre` to the radius of the arc, the distance of its `start` [mm].
    """
    origin = np.array(centre).reshape(2, 1)
    from_centre = points[:, edges].mean(axis=1) - origin
    radius = np.linalg.norm(np.array(start) - origin[:, 0])
    return np.asarray(origin + radius * from_centre / np.linalg.norm(from_centre, axis=0))
