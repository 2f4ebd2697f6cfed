"""Verdicts on a triangle mesh of any origin: closed surface, size, walls, gaps and overhangs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import trimesh

from sensor.arrays import Floats
from sensor.design.processes import Process
from sensor.verdict import Verdict, judge

Indices = npt.NDArray[np.int64]

RAY_TOLERANCE_MM = 1e-3  # tolerance of a distance along a ray, because a mesh file holds single precision
SHORTEST_MM = 5.0  # lower limit of the longest side of a part; a sensor exported in metres measures 0.07
LONGEST_MM = 1000.0  # upper limit of the longest side of a part; a sensor exported in micrometres measures 70000
AS_IT_STANDS = "as it stands"
# For each print pose, the direction in the file that points up.
POSES = {
    AS_IT_STANDS: (0.0, 0.0, 1.0), "upside down": (0.0, 0.0, -1.0), "+x up": (1.0, 0.0, 0.0),
    "-x up": (-1.0, 0.0, 0.0), "+y up": (0.0, 1.0, 0.0), "-y up": (0.0, -1.0, 0.0),
}  # fmt: skip
_TRIANGLES_PER_EDGE = 2  # number of triangles that meet at each edge of a closed surface
_SAMPLES = 2000  # number of random points from which rays are cast
_OPPOSITE = -0.75  # largest cosine between the normals of opposite faces; it excludes the faces of a 45 degree wedge
_FARTHEST_MM = 16.0  # longest distance that is measured, far more than any wall or gap that matters
_OFF_SURFACE_MM = 1e-5  # distance of the start of a ray from its own triangle, so that the ray does not hit it
_BED_MM = 0.05  # a face up to this height above the lowest point lies on the print bed
_FACET_ERROR_DEG = 0.5  # angular error of a triangle on a round face or a 45 degree face


def closed_verdicts(mesh: trimesh.Trimesh) -> tuple[Verdict, ...]:
    """Return geometry.watertight and geometry.manifold, two verdicts on the edges of a mesh.

    The value of geometry.watertight is the number of edges with only one triangle. The value of geometry.manifold is
    the number of edges with three or more. If the surface is closed, but all or some of its triangles face inward, the
    value of geometry.watertight is 1.
    """
    edges, counts = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
    open_edges = edges[counts < _TRIANGLES_PER_EDGE]
    crowded_edges = edges[counts > _TRIANGLES_PER_EDGE]
    if len(open_edges) == 0 and len(crowded_edges) == 0:
        faces_inward = not mesh.is_winding_consistent or enclosed_volume(mesh) < 0.0
        fault_count = int(faces_inward)
    else:
        fault_count = len(open_edges)
    first_open, first_crowded = _first_edge_text(mesh, open_edges), _first_edge_text(mesh, crowded_edges)
    watertight_text = f"edges with one triangle, or triangles that face inward, of {len(edges)} edges{first_open}"
    manifold_text = f"edges that join more than two triangles, of {len(edges)}{first_crowded}"
    return (
        judge("geometry.watertight", fault_count, watertight_text),
        judge("geometry.manifold", len(crowded_edges), manifold_text),
    )


def _first_edge_text(mesh: trimesh.Trimesh, edges: Indices) -> str:
    """Return the ends of the first edge as text, or an empty string if there are no edges."""
    if len(edges) == 0:
        return ""
    start, end = mesh.vertices[edges[0]]
    return f"; the first from {_point_text(start)} to {_point_text(end)} mm"


def _point_text(point: Floats) -> str:
    """Return a point (3,) as text with three decimals."""
    return "({:.3f}, {:.3f}, {:.3f})".format(*point)


def enclosed_volume(mesh: trimesh.Trimesh) -> float:
    """Return the volume [mm^3] enclosed by a mesh: negative if its triangles face inward, and 0 for a flat mesh."""
    # trimesh also computes the centre of mass, and divides by the volume even if it is 0.
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(mesh.volume)


def body_verdict(mesh: trimesh.Trimesh) -> Verdict:
    """Return geometry.one_solid for a mesh. Its value is the number of connected sets of triangles."""
    return judge("geometry.one_solid", mesh.body_count, "connected sets of triangles")


def drop_collapsed_triangles(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return a mesh without its collapsed triangles, which have two equal corners.

    CAD kernels write such triangles at the poles of spheres.
    """
    faces = np.asarray(mesh.faces)  # (n, 3), the vertex indices of each triangle
    # Each vertex is compared with the previous one of the same triangle.
    is_collapsed = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    if not is_collapsed.any():
        return mesh
    cleaned = mesh.copy()
    cleaned.update_faces(~is_collapsed)
    cleaned.remove_unreferenced_vertices()
    return cleaned


def size_verdicts(mesh: trimesh.Trimesh, process: Process) -> tuple[Verdict, ...]:
    """Return geometry.units (longest side [mm]), geometry.volume [mm^3] and geometry.mass [g].

    The mass is the volume times the density of the material of `process`.
    """
    x, y, z = mesh.extents
    longest = float(mesh.extents.max())
    size_text = f"bounding box {x:.4g} x {y:.4g} x {z:.4g} mm; outside the limits the file is not in millimetres"
    volume = enclosed_volume(mesh)
    density = process.density_g_per_cm3
    return (
        judge(
            "geometry.units",
            longest,
            size_text,
            limit=f"{SHORTEST_MM:g} to {LONGEST_MM:g}",
            passed=SHORTEST_MM <= longest <= LONGEST_MM,
        ),
        judge(
            "geometry.volume", volume, "enclosed by the triangles; negative if they face inward", passed=volume > 0.0
        ),
        judge(
            "geometry.mass",
            1e-3 * volume * density,  # 1e-3 converts mm^3 to cm^3
            f"solid {process.material}, {density:g} g/cm^3",
            passed=volume > 0.0,
        ),
    )


def printability_verdicts(mesh: trimesh.Trimesh, process: Process, poses: Iterable[str]) -> tuple[Verdict, ...]:
    """Return geometry.min_wall, geometry.min_gap and geometry.overhang [mm] for a print process.

    The limits come from `process`. `poses` are names of print poses in `POSES`. The overhang is measured in each pose,
    and the smallest overhang is judged, because the user can print the part in the best pose. A file that is already in
    its print pose is checked only in the pose "as it stands".
    """
    widths = {pose: widest_ledge(mesh, np.array(POSES[pose]), process.overhang_deg) for pose in poses}
    best_pose = min(widths, key=widths.__getitem__)
    overhang_text = f"widest face beyond {process.overhang_deg:g} deg from the vertical, {best_pose}; {process.name}"
    return (
        _distance_verdict(
            "geometry.min_wall", thinnest_wall(mesh), process.min_wall_mm, f"inward rays; {process.name}"
        ),
        _distance_verdict("geometry.min_gap", narrowest_gap(mesh), process.min_gap_mm, f"outward rays; {process.name}"),
        judge("geometry.overhang", widths[best_pose], overhang_text, tolerance=RAY_TOLERANCE_MM),
    )


@dataclass(frozen=True, kw_only=True)
class FacingDistance:
    """The shortest distance [mm] between two opposite faces, and the point [mm] from which it is measured."""

    length: float
    start: Floats


def thinnest_wall(mesh: trimesh.Trimesh) -> FacingDistance | None:
    """Return the thinnest wall of a mesh, or None if all walls are thicker than `_FARTHEST_MM`."""
    return _shortest_facing_distance(mesh, -1.0)


def narrowest_gap(mesh: trimesh.Trimesh) -> FacingDistance | None:
    """Return the narrowest gap between two faces of a mesh, or None if all gaps are wider than `_FARTHEST_MM`."""
    return _shortest_facing_distance(mesh, 1.0)


def _shortest_facing_distance(mesh: trimesh.Trimesh, direction: float) -> FacingDistance | None:
    """Return the shortest distance between two opposite faces, or None if all distances exceed `_FARTHEST_MM`.

    Distances are measured along rays. If `direction` is 1, the rays run outward, across gaps; if it is -1, they run
    inward, through walls. Faces are opposite if the cosine of the angle between their normals is below `_OPPOSITE`.
    """
    points, start_faces = _ray_starts(mesh)
    normals = np.asarray(mesh.face_normals)
    rays = direction * normals[start_faces]
    # Each hit is the first point at which a ray meets the mesh, with the index of its ray and of the triangle there.
    hits, ray_of_hit, face_of_hit = mesh.ray.intersects_location(
        points + _OFF_SURFACE_MM * rays, rays, multiple_hits=False
    )
    if len(hits) == 0:
        return None
    lengths = np.linalg.norm(hits - points[ray_of_hit], axis=1)
    cosines = np.einsum("ij,ij->i", normals[start_faces[ray_of_hit]], normals[face_of_hit])
    is_facing = cosines < _OPPOSITE
    lengths[~is_facing | (lengths > _FARTHEST_MM)] = np.inf
    shortest = int(np.argmin(lengths))
    if not np.isfinite(lengths[shortest]):
        return None
    return FacingDistance(length=float(lengths[shortest]), start=points[ray_of_hit[shortest]])


def _ray_starts(mesh: trimesh.Trimesh) -> tuple[Floats, Indices]:
    """Return the points (n, 3) [mm] of a mesh from which rays are cast, and the index of the triangle of each, (n,).

    Rays start at random points (with a fixed seed), and at the centre of the largest triangle of each plane face.
    """
    random_points, random_faces = trimesh.sample.sample_surface(mesh, _SAMPLES, seed=0)
    # trimesh calls a triangle a face, and a plane face a facet.
    largest_faces = np.array([facet[np.argmax(mesh.area_faces[facet])] for facet in mesh.facets], dtype=np.int64)
    faces = np.concatenate([random_faces, largest_faces])
    points = np.concatenate([random_points, mesh.triangles_center[largest_faces]])
    return points, faces


def _distance_verdict(name: str, distance: FacingDistance | None, limit: float, method: str) -> Verdict:
    """Return the verdict on the thickness of a wall or the width of a gap, which must be at least `limit` [mm].

    `distance` is None if no wall or gap was found, and the verdict then passes. `method` describes the measurement in
    the reference text.
    """
    if distance is None:
        return judge(name, None, f"{method}; none within {_FARTHEST_MM:g} mm", limit=limit, passed=True)
    reference = f"{method}; smallest at {_point_text(distance.start)} mm"
    return judge(name, distance.length, reference, limit=limit, tolerance=RAY_TOLERANCE_MM)


def widest_ledge(mesh: trimesh.Trimesh, up: Floats, limit_deg: float) -> float:
    """Return the width [mm] of the widest overhang: the widest connected patch of faces that need support when printed.

    A face overhangs if its angle from the vertical exceeds `limit_deg` and the face does not lie on the print bed. The
    width of a patch is the short side of the smallest rectangle around it in plan view. The unit vector `up` points
    upward in the print pose, and is parallel to one of the axes. The width is 0 if no face overhangs.
    """
    # `heights` (faces, 3) are the heights of the three corners of each face.
    heights = np.asarray(mesh.triangles) @ up
    # If a face points down, its normal has the vertical component -sin(angle of the face from the vertical).
    limit_rad = np.radians(min(limit_deg + _FACET_ERROR_DEG, 90.0))  # beyond 90 degrees, the sine would decrease
    is_steep = -(np.asarray(mesh.face_normals) @ up) > np.sin(limit_rad)
    is_above_bed = heights.max(axis=1) - heights.min() > _BED_MM
    is_overhang = is_steep & is_above_bed
    neighbours = np.asarray(mesh.face_adjacency)  # (pairs, 2), the indices of two faces with a common edge
    overhanging_pairs = neighbours[is_overhang[neighbours].all(axis=1)]
    patches = trimesh.graph.connected_components(overhanging_pairs, nodes=np.flatnonzero(is_overhang))
    plan_view = np.asarray(mesh.triangles)[:, :, up == 0.0]  # the two coordinates across `up`
    widest = 0.0
    for patch in patches:
        _, sides = trimesh.bounds.oriented_bounds_2D(plan_view[patch].reshape(-1, 2))  # type: ignore[no-untyped-call]
        widest = max(widest, float(sides.min()))
    return widest
