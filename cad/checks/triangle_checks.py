"""Verdicts on triangles of any origin: closed surface, size, walls, gaps and overhangs."""

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

RAY_TOLERANCE_MM = 1e-3  # a mesh file holds single precision
SHORTEST_MM = 5.0  # least longest side of a sensor or a coupon; one exported in metres measures 0.07
LONGEST_MM = 1000.0  # largest longest side; one exported in micrometres measures 70000
AS_IT_STANDS = "as it stands"
POSES = {
    AS_IT_STANDS: (0.0, 0.0, 1.0), "upside down": (0.0, 0.0, -1.0), "+x up": (1.0, 0.0, 0.0),
    "-x up": (-1.0, 0.0, 0.0), "+y up": (0.0, 1.0, 0.0), "-y up": (0.0, -1.0, 0.0),
}  # fmt: skip
_FACES_OF_AN_EDGE = 2
_SAMPLES = 2000
_OPPOSITE = -0.75  # largest cosine between the normals of a wall; the faces of a 45 degree wedge are not a wall
_FARTHEST_MM = 16.0  # far more than any wall or gap that matters
_OFF_SURFACE_MM = 1e-5  # start of a ray above its triangle, so that the ray does not meet it
_BED_MM = 0.05  # height above the lowest point up to which a face lies on the print bed
_SPREAD_DEG = 0.5  # angular error of a facet of a round or 45 degree face


def closed_verdicts(mesh: trimesh.Trimesh) -> tuple[Verdict, ...]:
    """Return geometry.watertight (number of open edges) and geometry.manifold (number of edges with 3 or more faces).

    The value of geometry.watertight is 1 for a closed surface whose triangles face inward.
    """
    edges, counts = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
    loose = edges[counts < _FACES_OF_AN_EDGE]
    shared = edges[counts > _FACES_OF_AN_EDGE]
    faults = len(loose)
    if len(loose) == 0 and len(shared) == 0:
        faces_inward = not mesh.is_winding_consistent or enclosed_volume(mesh) < 0.0
        faults = int(faces_inward)
    open_edges = f"edges with one triangle, or triangles that face inward, of {len(edges)} edges{_first(mesh, loose)}"
    joined = f"edges that join more than two triangles, of {len(edges)}{_first(mesh, shared)}"
    return (
        judge("geometry.watertight", faults, open_edges),
        judge("geometry.manifold", len(shared), joined),
    )


def _first(mesh: trimesh.Trimesh, edges: Indices) -> str:
    """Return the ends of the first edge as text; empty without edges."""
    if len(edges) == 0:
        return ""
    start, end = mesh.vertices[edges[0]]
    return f"; the first from {_point(start)} to {_point(end)} mm"


def _point(point: Floats) -> str:
    return "({:.3f}, {:.3f}, {:.3f})".format(*point)


def enclosed_volume(mesh: trimesh.Trimesh) -> float:
    """Return the enclosed volume [mm^3].

    For a flat mesh it is 0; then trimesh divides by 0 for a centre of mass, and its warnings are silenced.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(mesh.volume)


def body_verdict(mesh: trimesh.Trimesh) -> Verdict:
    """Return geometry.one_solid: the number of connected sets of triangles."""
    return judge("geometry.one_solid", mesh.body_count, "connected sets of triangles")


def without_collapsed(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return a mesh without triangles that have two equal corners, as CAD kernels write them at the poles of balls."""
    faces = np.asarray(mesh.faces)
    is_collapsed = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    if not is_collapsed.any():
        return mesh
    left = mesh.copy()
    left.update_faces(~is_collapsed)
    left.remove_unreferenced_vertices()
    return left


def size_verdicts(mesh: trimesh.Trimesh, process: Process) -> tuple[Verdict, ...]:
    """Return geometry.units (longest side [mm]), geometry.volume [mm^3] and geometry.mass [g]."""
    x, y, z = mesh.extents
    longest = float(mesh.extents.max())
    volume = enclosed_volume(mesh)
    density = process.density_g_per_cm3
    return (
        judge(
            "geometry.units",
            longest,
            f"bounding box {x:.4g} x {y:.4g} x {z:.4g} mm; outside the limits the file is not in millimetres",
            limit=f"{SHORTEST_MM:g} to {LONGEST_MM:g}",
            passed=SHORTEST_MM <= longest <= LONGEST_MM,
        ),
        judge(
            "geometry.volume", volume, "enclosed by the triangles; negative if they face inward", passed=volume > 0.0
        ),
        judge(
            "geometry.mass",
            1e-3 * volume * density,
            f"solid {process.material}, {density:g} g/cm^3",
            passed=volume > 0.0,
        ),
    )


def printability_verdicts(mesh: trimesh.Trimesh, process: Process, poses: Iterable[str]) -> tuple[Verdict, ...]:
    """Return geometry.min_wall, geometry.min_gap and geometry.overhang [mm] for a process.

    The overhang is measured in each pose, and the least is judged. A file in print pose has one pose, "as it stands".
    """
    widths = {pose: widest_ledge(mesh, np.array(POSES[pose]), process.overhang_deg) for pose in poses}
    best_pose = min(widths, key=widths.__getitem__)
    hangs = f"widest face beyond {process.overhang_deg:g} deg from the vertical, {best_pose}; {process.name}"
    return (
        _distance_verdict("geometry.min_wall", least_wall(mesh), process.min_wall_mm, f"inward rays; {process.name}"),
        _distance_verdict("geometry.min_gap", least_gap(mesh), process.min_gap_mm, f"outward rays; {process.name}"),
        judge("geometry.overhang", widths[best_pose], hangs, tolerance=RAY_TOLERANCE_MM),
    )


@dataclass(frozen=True, kw_only=True)
class FacingDistance:
    """The shortest distance [mm] between two opposite faces, and the point where it starts [mm]."""

    length: float
    start: Floats


def least_wall(mesh: trimesh.Trimesh) -> FacingDistance | None:
    """Return the thinnest wall, or None if no two faces within 16 mm are opposite."""
    return _least_distance(mesh, -1.0)


def least_gap(mesh: trimesh.Trimesh) -> FacingDistance | None:
    """Return the narrowest gap between two faces of the mesh, or None if there is none within 16 mm."""
    return _least_distance(mesh, 1.0)


def _least_distance(mesh: trimesh.Trimesh, sense: float) -> FacingDistance | None:
    """Return the shortest ray from the surface to a face whose normal is opposite.

    A `sense` of 1 sends rays outward and -1 inward. Rays start at random points, with a fixed seed, and at the centre
    of the largest triangle of each plane face.
    """
    random_points, random_faces = trimesh.sample.sample_surface(mesh, _SAMPLES, seed=0)
    of_planes = [facet[np.argmax(mesh.area_faces[facet])] for facet in mesh.facets]
    faces = np.concatenate([random_faces, np.array(of_planes, dtype=np.int64)])
    points = np.concatenate([random_points, mesh.triangles_center[faces[_SAMPLES:]]])
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


def _distance_verdict(name: str, distance: FacingDistance | None, limit: float, method: str) -> Verdict:
    if distance is None:
        return judge(name, None, f"{method}; none within {_FARTHEST_MM:g} mm", limit=limit, passed=True)
    reference = f"{method}; least at {_point(distance.start)} mm"
    return judge(name, distance.length, reference, limit=limit, tolerance=RAY_TOLERANCE_MM)


def widest_ledge(mesh: trimesh.Trimesh, up: Floats, limit_deg: float) -> float:
    """Return the width [mm] of the widest connected patch of faces that overhang.

    A face overhangs if it leans more than `limit_deg` from the vertical and does not lie on the print bed. The width of
    a patch is the short side of the smallest rectangle around it in plan view. `up` is one of the six axes.
    """
    level = np.asarray(mesh.triangles) @ up
    is_steep = -(np.asarray(mesh.face_normals) @ up) > np.sin(np.radians(min(limit_deg + _SPREAD_DEG, 90.0)))
    hangs_over = is_steep & (level.max(axis=1) - level.min() > _BED_MM)
    neighbours = np.asarray(mesh.face_adjacency)
    joined = neighbours[hangs_over[neighbours].all(axis=1)]
    patches = trimesh.graph.connected_components(joined, nodes=np.flatnonzero(hangs_over))
    plan = np.asarray(mesh.triangles)[:, :, up == 0.0]
    widest = 0.0
    for patch in patches:
        _, sides = trimesh.bounds.oriented_bounds_2D(plan[patch].reshape(-1, 2))  # type: ignore[no-untyped-call]
        widest = max(widest, float(sides.min()))
    return widest
