"""Verdicts on triangles of any origin: closed, simple, thick enough, open enough, carried, of a plausible size."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import trimesh

from cad.checks.overhang import POSES, REACH_MM, widest_ledge
from cad.checks.self_intersection import crossing_pairs
from cad.checks.wall_thickness import REACHES_MM, Span, least_gap, least_wall
from cad.design.processes import Process
from cad.triangles import Indices, Triangles, enclosed_volume
from cad.verdict import Verdict, at_least, equal, judged

RAY_TOLERANCE_MM = 1e-3  # a mesh file holds single precision
SHORTEST_MM, LONGEST_MM = 5.0, 1000.0  # a sensor or a coupon; a part in metres is 0.07 long, one in micrometres 70000
_FACES_OF_AN_EDGE = 2


def library_mesh(mesh: Triangles) -> trimesh.Trimesh:
    """Return triangles [mm] as the library's mesh, which knows their neighbours, facets and bodies."""
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)


def closed_verdicts(mesh: Triangles) -> tuple[Verdict, ...]:
    """Return geometry.watertight (count of open edges; 1 inside out) and geometry.manifold (edges of 3 faces)."""
    directed = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    edges, counts = np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)
    loose, shared = edges[counts < _FACES_OF_AN_EDGE], edges[counts > _FACES_OF_AN_EDGE]
    inward = int(not len(loose) and not len(shared) and _is_turned(mesh, directed))
    open_edges = f"edges with one triangle, or triangles that face inward, of {len(edges)} edges{_first(mesh, loose)}"
    joined = f"edges that join more than two triangles, of {len(edges)}{_first(mesh, shared)}"
    return (
        equal("geometry.watertight", float(len(loose) + inward), 0.0, 0.0, unit="1", reference=open_edges),
        equal("geometry.manifold", float(len(shared)), 0.0, 0.0, unit="1", reference=joined),
    )


def _is_turned(mesh: Triangles, directed: Indices) -> bool:
    """Say whether triangles of a closed mesh face inward: all, or some, which run an edge as their neighbours do."""
    return mesh.volume < 0.0 or len(np.unique(directed, axis=0)) < len(directed)


def _first(mesh: Triangles, edges: Indices) -> str:
    """Return where the first of some edges lies, in words; nothing where there is none."""
    if len(edges) == 0:
        return ""
    start, end = (", ".join(f"{value:.3f}" for value in mesh.vertices[corner]) for corner in edges[0])
    return f"; the first from ({start}) to ({end}) mm"


def body_verdict(mesh: trimesh.Trimesh) -> Verdict:
    """Return geometry.one_solid: the number of bodies, each a connected set of triangles."""
    count = float(mesh.body_count)
    return equal("geometry.one_solid", count, 1.0, 0.0, unit="1", reference="connected sets of triangles")


def size_verdicts(mesh: trimesh.Trimesh, process: Process) -> tuple[Verdict, ...]:
    """Return geometry.units (longest side [mm]), geometry.volume [mm^3] and geometry.mass [g]."""
    x, y, z = (float(side) for side in mesh.extents)
    longest, limit = max(x, y, z), f"{SHORTEST_MM:g} to {LONGEST_MM:g}"
    box = f"bounding box {x:.4g} x {y:.4g} x {z:.4g} mm; outside, the file is not in millimetres"
    plausible = SHORTEST_MM <= longest <= LONGEST_MM
    volume, density = enclosed_volume(np.asarray(mesh.triangles)), process.density_g_per_cm3
    enclosed, solid = "enclosed by the triangles, less where they face inward", f"solid {process.material}"
    return (
        judged("geometry.units", longest, passed=plausible, limit=limit, unit="mm", reference=box),
        _positive("geometry.volume", volume, "mm^3", enclosed),
        _positive("geometry.mass", 1e-3 * volume * density, "g", f"{solid}, {density:g} g/cm^3"),
    )


def _positive(name: str, value: float, unit: str, reference: str) -> Verdict:
    return judged(name, value, passed=value > 0.0, limit="above 0", unit=unit, reference=reference)


def self_intersection_verdict(mesh: trimesh.Trimesh) -> Verdict:
    """Return geometry.self_intersection: the number of pairs of triangles that pass through each other."""
    pairs = crossing_pairs(mesh)
    reference = "pairs of triangles that pass through each other"
    if len(pairs):
        x, y, z = np.asarray(mesh.triangles_center)[pairs[0, 0]]
        reference += f"; the first near ({x:.3f}, {y:.3f}, {z:.3f}) mm"
    return equal("geometry.self_intersection", float(len(pairs)), 0.0, 0.0, unit="1", reference=reference)


def printability_verdicts(mesh: trimesh.Trimesh, process: Process, poses: Iterable[str]) -> tuple[Verdict, ...]:
    """Return geometry.min_wall, geometry.min_gap and geometry.overhang [mm] for a process.

    The overhang is that of the best of the poses; a file in print pose has one, "as it stands".
    """
    return (
        _span_verdict("geometry.min_wall", least_wall(mesh), process.min_wall_mm, f"inward rays; {process.name}"),
        _span_verdict("geometry.min_gap", least_gap(mesh), process.min_gap_mm, f"outward rays; {process.name}"),
        _overhang_verdict(mesh, process, poses),
    )


def _span_verdict(name: str, span: Span | None, limit: float, method: str) -> Verdict:
    if span is None:
        none = f"{method}; none within {REACHES_MM[-1]:g} mm"
        return Verdict(name=name, value=None, unit="mm", limit=limit, tolerance=0.0, passed=True, reference=none)
    x, y, z = span.place
    reference = f"{method}; least at ({x:.3f}, {y:.3f}, {z:.3f}) mm"
    return at_least(name, span.length, limit, RAY_TOLERANCE_MM, unit="mm", reference=reference)


def _overhang_verdict(mesh: trimesh.Trimesh, process: Process, poses: Iterable[str]) -> Verdict:
    widths = {pose: widest_ledge(mesh, POSES[pose], process.overhang_deg) for pose in poses}
    pose = min(widths, key=widths.__getitem__)
    return Verdict(
        name="geometry.overhang",
        value=widths[pose],
        unit="mm",
        limit=REACH_MM,
        tolerance=RAY_TOLERANCE_MM,
        passed=widths[pose] <= REACH_MM + RAY_TOLERANCE_MM,
        reference=f"widest face beyond {process.overhang_deg:g} deg from the vertical, {pose}; {process.name}",
    )
