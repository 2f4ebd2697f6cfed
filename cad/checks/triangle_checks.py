"""Verdicts on triangles of any origin: closed, simple, thick enough, open enough, carried, of a plausible size."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
import trimesh

from cad.design.processes import Process
from cad.triangles import Floats, Indices, Triangles, enclosed_volume
from cad.verdict import Verdict, at_least, equal, judged

RAY_TOLERANCE_MM = 1e-3  # a mesh file holds single precision
SHORTEST_MM, LONGEST_MM = 5.0, 1000.0  # a sensor or a coupon; a part in metres is 0.07 long, one in micrometres 70000
REACH_MM = 1.0  # a ledge up to this wide needs no support: Formlabs, design guide, unsupported overhangs
AS_IT_STANDS = "as it stands"
POSES = {
    AS_IT_STANDS: (0.0, 0.0, 1.0), "upside down": (0.0, 0.0, -1.0), "+x up": (1.0, 0.0, 0.0),
    "-x up": (-1.0, 0.0, 0.0), "+y up": (0.0, 1.0, 0.0), "-y up": (0.0, -1.0, 0.0),
}  # fmt: skip
_FACES_OF_AN_EDGE = 2
_SAMPLES = 2000
_PLASTIC = 1.3247179572447460  # steps of the R2 sequence, M. Roberts, 2018: even cover without chance
_OPPOSITE = -0.75  # cosine between two faces of one wall; the faces of a 45 degree wedge are no wall
_FARTHEST_MM = 16.0  # far more than any wall or gap that matters
_OFF_SURFACE_MM = 1e-5  # so that a ray does not meet the triangle that it starts from
_FLAT = 1e-9  # a crossing nearer to an edge than this fraction of the volume spanned is a touch
_BED_MM = 0.05
_SPREAD_DEG = 0.5  # a facet of a round or 45 degree face is this much off


def library_mesh(mesh: Triangles) -> trimesh.Trimesh:
    """Return triangles [mm] as the library's mesh, which knows their neighbours, facets and bodies."""
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)


def closed_verdicts(mesh: Triangles) -> tuple[Verdict, ...]:
    """Return geometry.watertight (count of open edges; 1 inside out) and geometry.manifold (edges of 3 faces)."""
    directed = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    edges, counts = np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)
    loose = edges[counts < _FACES_OF_AN_EDGE]
    shared = edges[counts > _FACES_OF_AN_EDGE]
    inward = 0
    if len(loose) == 0 and len(shared) == 0:  # a triangle that faces inward runs an edge the way its neighbour does
        inward = int(mesh.volume < 0.0 or len(np.unique(directed, axis=0)) < len(directed))
    open_edges = f"edges with one triangle, or triangles that face inward, of {len(edges)} edges{_first(mesh, loose)}"
    joined = f"edges that join more than two triangles, of {len(edges)}{_first(mesh, shared)}"
    return (
        equal("geometry.watertight", float(len(loose) + inward), 0.0, 0.0, unit="1", reference=open_edges),
        equal("geometry.manifold", float(len(shared)), 0.0, 0.0, unit="1", reference=joined),
    )


def _first(mesh: Triangles, edges: Indices) -> str:
    """Return where the first of some edges lies, in words; nothing where there is none."""
    if len(edges) == 0:
        return ""
    start, end = (_point(vertex) for vertex in mesh.vertices[edges[0]])
    return f"; the first from {start} to {end} mm"


def _point(point: Floats) -> str:
    return "({:.3f}, {:.3f}, {:.3f})".format(*point)


def body_verdict(mesh: trimesh.Trimesh) -> Verdict:
    """Return geometry.one_solid: the number of bodies, each a connected set of triangles."""
    count = float(mesh.body_count)
    return equal("geometry.one_solid", count, 1.0, 0.0, unit="1", reference="connected sets of triangles")


def size_verdicts(mesh: trimesh.Trimesh, process: Process) -> tuple[Verdict, ...]:
    """Return geometry.units (longest side [mm]), geometry.volume [mm^3] and geometry.mass [g]."""
    x, y, z = (float(side) for side in mesh.extents)
    longest = max(x, y, z)
    volume = enclosed_volume(np.asarray(mesh.triangles))
    density = process.density_g_per_cm3
    return (
        judged(
            "geometry.units",
            longest,
            passed=SHORTEST_MM <= longest <= LONGEST_MM,
            limit=f"{SHORTEST_MM:g} to {LONGEST_MM:g}",
            unit="mm",
            reference=f"bounding box {x:.4g} x {y:.4g} x {z:.4g} mm; outside, the file is not in millimetres",
        ),
        judged(
            "geometry.volume",
            volume,
            passed=volume > 0.0,
            limit="above 0",
            unit="mm^3",
            reference="enclosed by the triangles, less where they face inward",
        ),
        judged(
            "geometry.mass",
            1e-3 * volume * density,
            passed=volume > 0.0,
            limit="above 0",
            unit="g",
            reference=f"solid {process.material}, {density:g} g/cm^3",
        ),
    )


def self_intersection_verdict(mesh: trimesh.Trimesh) -> Verdict:
    """Return geometry.self_intersection: the number of pairs of triangles that pass through each other."""
    pairs = crossing_pairs(mesh)
    reference = "pairs of triangles that pass through each other"
    if len(pairs):
        reference += f"; the first near {_point(mesh.triangles_center[pairs[0, 0]])} mm"
    return equal("geometry.self_intersection", float(len(pairs)), 0.0, 0.0, unit="1", reference=reference)


def crossing_pairs(mesh: trimesh.Trimesh) -> Indices:
    """Return the pairs (n, 2) of triangles without a common corner of which an edge of one passes through the other."""
    corners = np.asarray(mesh.triangles)
    faces = np.asarray(mesh.faces)
    near, counts = mesh.triangles_tree.intersection_v(corners.min(axis=1), corners.max(axis=1))
    first = np.repeat(np.arange(len(corners)), counts.astype(np.int64))
    pairs = np.stack([first, near.astype(np.int64)], axis=1)
    pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    has_common_corner = (faces[pairs[:, 0], :, None] == faces[pairs[:, 1], None, :]).any(axis=(1, 2))
    pairs = pairs[~has_common_corner]
    one, two = corners[pairs[:, 0]], corners[pairs[:, 1]]
    return np.asarray(pairs[_edges_pierce(one, two) | _edges_pierce(two, one)])


def _edges_pierce(edged: Floats, pierced: Floats) -> npt.NDArray[np.bool_]:
    """Say of each pair of triangles whether an edge of the first passes through the second.

    The ends of the edge lie on both sides of the plane, and the volumes that the edge spans with the three sides have
    one sign. All volumes are six times those of tetrahedra [mm^3].
    """
    a, b, c = pierced.transpose(1, 0, 2)
    crossed = np.zeros(len(edged), dtype=bool)
    for i in range(3):
        start = edged[:, i]
        end = edged[:, (i + 1) % 3]
        above = _spanned_volume(start, a, b, c)
        below = _spanned_volume(end, a, b, c)
        sides = np.stack([_spanned_volume(start, end, *side) for side in ((a, b), (b, c), (c, a))])
        least = _FLAT * (np.abs(above) + np.abs(below) + np.abs(sides).sum(axis=0))
        is_inside = (sides > least).all(axis=0) | (sides < -least).all(axis=0)
        is_through = (above * below < 0.0) & (np.minimum(np.abs(above), np.abs(below)) > least)
        crossed |= is_inside & is_through
    return crossed


def _spanned_volume(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    return np.asarray(np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)))


def printability_verdicts(mesh: trimesh.Trimesh, process: Process, poses: Iterable[str]) -> tuple[Verdict, ...]:
    """Return geometry.min_wall, geometry.min_gap and geometry.overhang [mm] for a process.

    The overhang is that of the best of the poses; a file in print pose has one, "as it stands".
    """
    widths = {pose: widest_ledge(mesh, np.array(POSES[pose]), process.overhang_deg) for pose in poses}
    best_pose = min(widths, key=widths.__getitem__)
    overhang = Verdict(
        name="geometry.overhang",
        value=widths[best_pose],
        unit="mm",
        limit=REACH_MM,
        tolerance=RAY_TOLERANCE_MM,
        passed=widths[best_pose] <= REACH_MM + RAY_TOLERANCE_MM,
        reference=f"widest face beyond {process.overhang_deg:g} deg from the vertical, {best_pose}; {process.name}",
    )
    return (
        _span_verdict("geometry.min_wall", least_wall(mesh), process.min_wall_mm, f"inward rays; {process.name}"),
        _span_verdict("geometry.min_gap", least_gap(mesh), process.min_gap_mm, f"outward rays; {process.name}"),
        overhang,
    )


@dataclass(frozen=True, kw_only=True)
class FacingDistance:
    """The shortest distance [mm] between two faces that look at each other, and the point where it starts."""

    length: float
    start: Floats


def least_wall(mesh: trimesh.Trimesh) -> FacingDistance | None:
    """Return the thinnest wall, or None where no two faces within 16 mm are opposite each other."""
    return _least_distance(mesh, -1.0)


def least_gap(mesh: trimesh.Trimesh) -> FacingDistance | None:
    """Return the narrowest gap between two faces of the mesh, or None where there is none within 16 mm."""
    return _least_distance(mesh, 1.0)


def _least_distance(mesh: trimesh.Trimesh, sense: float) -> FacingDistance | None:
    """Return the shortest ray from the surface along its normal, or against it, to a face that looks back."""
    points, faces = surface_points(mesh)
    normals = np.asarray(mesh.face_normals)
    rays = sense * normals[faces]
    hits, source, target = mesh.ray.intersects_location(points + _OFF_SURFACE_MM * rays, rays, multiple_hits=False)
    if len(hits) == 0:
        return None
    lengths = np.linalg.norm(hits - points[source], axis=1)
    is_facing = np.einsum("ij,ij->i", normals[faces[source]], normals[target]) < _OPPOSITE
    lengths[~is_facing | (lengths > _FARTHEST_MM)] = np.inf
    shortest = int(np.argmin(lengths))
    if not np.isfinite(lengths[shortest]):
        return None
    return FacingDistance(length=float(lengths[shortest]), start=points[source[shortest]])


def surface_points(mesh: trimesh.Trimesh) -> tuple[Floats, Indices]:
    """Return points [mm] spread evenly over the surface, one at least on every plane face, and their triangles."""
    areas = np.asarray(mesh.area_faces)
    steps = (np.arange(_SAMPLES) + 0.5) / _SAMPLES * areas.sum()
    even = np.searchsorted(np.cumsum(areas), steps).clip(max=len(areas) - 1)
    largest_of_planes = [facet[np.argmax(areas[facet])] for facet in mesh.facets]
    faces = np.concatenate([even, np.array(largest_of_planes, dtype=np.int64)])

    # Barycentric coordinates: evenly spread, and the middle of the triangle on the plane faces.
    u, v = np.arange(1, len(faces) + 1) / np.array([[_PLASTIC], [_PLASTIC**2]]) % 1.0
    u[_SAMPLES:] = v[_SAMPLES:] = 1.0 / 3.0
    beyond = u + v > 1.0
    u[beyond] = 1.0 - u[beyond]
    v[beyond] = 1.0 - v[beyond]
    a, b, c = np.asarray(mesh.triangles)[faces].transpose(1, 0, 2)
    return a + u[:, None] * (b - a) + v[:, None] * (c - a), faces


def _span_verdict(name: str, distance: FacingDistance | None, limit: float, method: str) -> Verdict:
    if distance is None:
        reference = f"{method}; none within {_FARTHEST_MM:g} mm"
        return Verdict(name=name, value=None, unit="mm", limit=limit, tolerance=0.0, passed=True, reference=reference)
    reference = f"{method}; least at {_point(distance.start)} mm"
    return at_least(name, distance.length, limit, RAY_TOLERANCE_MM, unit="mm", reference=reference)


def widest_ledge(mesh: trimesh.Trimesh, up: Floats, limit_deg: float) -> float:
    """Return the width [mm] of the widest patch of faces that hang over more than the limit [deg from the vertical].

    The width of a patch is the short side of the smallest rectangle around it, seen from above. Faces on the
    print bed carry themselves. Up is one of the six axes.
    """
    level = np.asarray(mesh.triangles) @ up
    is_steep = -(np.asarray(mesh.face_normals) @ up) > np.sin(np.radians(min(limit_deg + _SPREAD_DEG, 90.0)))
    hangs_over = is_steep & (level.max(axis=1) - level.min() > _BED_MM)
    if not hangs_over.any():
        return 0.0
    neighbours = np.asarray(mesh.face_adjacency)
    joined = neighbours[hangs_over[neighbours].all(axis=1)]
    patches = trimesh.graph.connected_components(joined, nodes=np.flatnonzero(hangs_over))
    plan = np.asarray(mesh.triangles)[:, :, up == 0.0]
    return max(_width(plan[patch].reshape(-1, 2)) for patch in patches)


def _width(points: Floats) -> float:
    """Return the short side of the smallest rectangle around points (n, 2) [mm]."""
    rectangle = shapely.MultiPoint(points).minimum_rotated_rectangle
    if not isinstance(rectangle, shapely.Polygon):
        return 0.0
    sides = np.linalg.norm(np.diff(np.array(rectangle.exterior.coords), axis=0), axis=1)
    return float(min(sides[0], sides[1]))
