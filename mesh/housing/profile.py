"""The quadrilateral mesh of the housing's profile, which gmsh makes from four-sided blocks."""

from collections.abc import Iterable
from dataclasses import dataclass

import gmsh
import numpy as np

from mesh.housing.blocks import Block, Point, Segment
from mesh.session import SURFACE, Ints, MeshError, element_nodes, gmsh_session, stage, used_nodes
from sensor.arrays import Floats

_SMOOTHING_STEPS = 10  # number of steps of gmsh's smoother, which is applied to fans
_DECIMALS = 9  # number of decimals to which coordinates [mm] are rounded, so that equal points are recognised


@dataclass(frozen=True, kw_only=True)
class Profile:
    """The quadrilateral mesh of a profile.

    `points` (2, n) [mm] are the nodes (x, z). `quads` (4, m) holds the node indices of each quadrilateral,
    counterclockwise. `arcs` (2, k) are the edges whose curve is an arc, and `midpoints` (2, k) [mm] the points halfway
    along these arcs. `surfaces` maps the name of each surface to the edges (2, j) on it. Edges are pairs of node
    indices.
    """

    points: Floats
    quads: Ints
    arcs: Ints
    midpoints: Floats
    surfaces: dict[str, Ints]


class _Curves:
    """The points and curves that have been added to gmsh, so that blocks with a common segment share one curve.

    `points` maps each point to gmsh's tag. `curves` maps each pair of end points to gmsh's tag and the segment.
    """

    def __init__(self) -> None:
        self.points: dict[Point, int] = {}
        self.curves: dict[frozenset[Point], tuple[int, Segment]] = {}

    def point_tag(self, point: Point) -> int:
        """Return gmsh's tag of a point. Add the point if it is new."""
        key = _rounded(point)
        if key not in self.points:
            self.points[key] = gmsh.model.geo.addPoint(point[0], 0.0, point[1])
        return self.points[key]

    def curve_tag(self, segment: Segment) -> int:
        """Return gmsh's tag of the curve of a segment. Add the curve if it is new.

        Raises MeshError if another block divides the same segment into a different number of elements.
        """
        key = frozenset((_rounded(segment.start), _rounded(segment.end)))
        if key not in self.curves:
            self.curves[key] = (self._add_curve(segment), segment)
        tag, existing = self.curves[key]
        if existing.count != segment.count:
            reason = (
                f"one block divides the side from {segment.start} to {segment.end} into {existing.count} elements, "
                f"and another into {segment.count}"
            )
            raise MeshError("blocks", reason, "check the dimensions of the housing")
        return tag

    def _add_curve(self, segment: Segment) -> int:
        """Add a line or an arc to gmsh, set how it is divided into elements, and return its tag.

        The element sizes form a geometric progression with the ratio `growth`. If `bump` is not 1, they follow gmsh's
        "Bump" rule instead, which refines both ends.
        """
        geo = gmsh.model.geo
        start = self.point_tag(segment.start)
        end = self.point_tag(segment.end)
        if segment.centre is None:
            tag = geo.addLine(start, end)
        else:
            tag = geo.addCircleArc(start, self.point_tag(segment.centre), end)
        spacing = ("Progression", segment.growth) if segment.bump == 1.0 else ("Bump", segment.bump)
        geo.mesh.setTransfiniteCurve(tag, segment.count + 1, *spacing)  # gmsh counts nodes, not elements
        return int(tag)


def _rounded(point: Point) -> Point:
    """Round a point to 1e-9 mm, so that it can be a dictionary key. Adding 0 converts -0 to 0."""
    return round(point[0], _DECIMALS) + 0.0, round(point[1], _DECIMALS) + 0.0


def mesh_profile(blocks: Iterable[Block]) -> Profile:
    """Divide the blocks of a profile into quadrilaterals [mm] with gmsh.

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
    tags = [curves.curve_tag(segment) for side in block.sides for segment in side]
    surface = geo.addPlaneSurface([geo.addCurveLoop(tags, reorient=True)])

    # A side may have several segments, so gmsh must be given the four corners. Each corner is the point that a side has
    # in common with the previous side.
    points_of_sides = []
    for side in block.sides:
        points = {_rounded(segment.start) for segment in side} | {_rounded(segment.end) for segment in side}
        points_of_sides.append(points)
    corners = []
    for i, points in enumerate(points_of_sides):
        (corner, *_) = points_of_sides[i - 1] & points  # the first side follows the last, at index -1
        corners.append(curves.point_tag(corner))
    geo.mesh.setTransfiniteSurface(surface, cornerTags=corners)
    geo.mesh.setRecombine(SURFACE, surface)
    if block.smooth:
        geo.mesh.setSmoothing(SURFACE, surface, _SMOOTHING_STEPS)


def _read_profile(curves: Iterable[tuple[int, Segment]]) -> Profile:
    """Return the mesh of the profile from gmsh. `curves` are pairs of gmsh's tag of a curve and its segment.

    The edges in gmsh are straight. For edges on arcs, the point halfway along the arc is added, so that the elements
    can be curved later. Raises MeshError if an element is not a quadrilateral.
    """
    # The profile must have one type of element, the four-node quadrilateral.
    if list(gmsh.model.mesh.getElementTypes(SURFACE)) != [gmsh.model.mesh.getElementType("Quadrangle", 1)]:
        raise MeshError("read", "the profile has elements other than quadrilaterals", "check the blocks")
    node_tags = element_nodes("Quadrangle")
    nodes = used_nodes(node_tags)
    points = np.ascontiguousarray(nodes.points[[0, 2]])  # x and z, because the profile lies in the plane y = 0

    quads = order_counterclockwise(points, nodes.index[node_tags])
    arcs = []
    midpoints = []
    surfaces: dict[str, list[Ints]] = {}
    for tag, segment in curves:
        if segment.centre is None and not segment.surface:
            continue  # a straight line that lies on no named surface
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


def order_counterclockwise(points: Floats, quads: Ints) -> Ints:
    """Return quadrilaterals (4, m) with their corners in counterclockwise order; gmsh may number them clockwise.

    `quads` (4, m) are indices into `points` (2, n) [mm].
    """
    (x0, x1, x2, x3), (z0, z1, z2, z3) = points[:, quads]
    # The cross product of the diagonals is negative if the corners are numbered clockwise.
    is_clockwise = (x2 - x0) * (z3 - z1) - (x3 - x1) * (z2 - z0) < 0.0
    return np.where(is_clockwise, quads[::-1], quads)


def _arc_midpoints(points: Floats, edges: Ints, start: Point, centre: Point) -> Floats:
    """Return the points halfway along the pieces of an arc [mm], shape (2, k).

    `edges` (2, k) are the chords of these pieces, as indices into `points` (2, n) [mm]. The middle of each chord is
    moved away from `centre`, to the radius of the arc. This radius is the distance of `start` from `centre` [mm].
    """
    origin = np.array(centre).reshape(2, 1)
    from_centre = points[:, edges].mean(axis=1) - origin
    radius = np.linalg.norm(np.array(start) - origin[:, 0])
    return np.asarray(origin + radius * from_centre / np.linalg.norm(from_centre, axis=0))
