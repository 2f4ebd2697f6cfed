"""Comparison of a file with its design: the largest distance between their surfaces, its place and its likely cause."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import cadquery as cq
import numpy as np
import numpy.typing as npt
import trimesh
from scipy.spatial import cKDTree

from cad.checks.triangle_checks import enclosed_volume
from cad.files.step import read_step
from cad.files.stl import CHORD_MM, read_stl, triangles
from cad.files.threemf import read_3mf
from sensor.arrays import Floats
from sensor.verdict import Verdict, judge

NAME = "geometry.as_designed"
OWN_MM = 0.02  # largest distance allowed for a file of this program, in addition to the chord of its triangles
FOREIGN_MM = 0.05  # largest distance allowed for a file of another program, whose chord is unknown
STEP_KINDS = (".step", ".stp")
_STEP_ANGLE_RAD = 0.5  # largest angle between neighbouring triangles of a face in a STEP file
_SAME_MM = 1e-4  # corners are equal if they round to the same multiple; an STL file resolves 4e-6 mm at 60 mm
_RELATIVE_ACCURACY = 1e-3  # relative accuracy of a distance, in addition to `_SAME_MM`
_DECIMALS = 4  # number of decimals of a distance [mm], in line with its accuracy `_SAME_MM`
_SPACING_MM = 0.4  # distance between rows of points on a triangle, and between points in a row
_COVER_MM = math.sqrt(1.25) * _SPACING_MM  # largest distance from a point of a triangle to the nearest sample point
# Number of nearest sample points whose triangles are searched: one at first, and eight if the distance found is large.
_NEAREST = (1, 8)
_BATCH = 20_000  # number of points measured at a time, so that the arrays fit in the memory of a small machine
# Approximate number of vertices that are compared first, before the whole surface of a moved part.
_TESTED_CORNERS = 300
UNITS = {"inches": 25.4, "centimetres": 10.0, "metres": 1000.0}  # length of each unit in mm
_SCALE_TOLERANCE = 0.01  # relative tolerance of a scale factor
_MIN_ROTATION_DEG = 0.05  # smallest rotation that is reported; angles are written with one decimal


class Farthest(NamedTuple):
    """The largest distance [mm] between the surfaces of a file and of its design.

    `point` [mm] is the point from which it is measured. `owner` is the surface that contains the point: "file" or
    "design".
    """

    distance: float
    point: Floats
    owner: str


def as_designed_verdict(
    pairs: Mapping[str, tuple[trimesh.Trimesh, trimesh.Trimesh]], limit: float | None = None, against: str = ""
) -> Verdict:
    """Return geometry.as_designed, the verdict on the largest distance [mm] between files and their designs.

    `pairs` holds the triangles [mm] of each file and of its design, keyed by file name. If `limit` [mm] is None, each
    file gets the limit for files of this program. The verdict is given for the file that exceeds its limit most or
    comes closest to it. If its distance exceeds the limit, the reference text begins with the likely causes. `against`
    names the part of the design with which the file was compared; if it is empty, no part is named.
    """
    farthest_points = {name: largest_distance(mesh, design) for name, (mesh, design) in pairs.items()}
    limits = {name: _own_file_limit(name) if limit is None else limit for name in pairs}
    worst = max(pairs, key=lambda name: farthest_points[name].distance - limits[name])
    farthest, worst_limit = farthest_points[worst], limits[worst]
    mesh, design = pairs[worst]
    remarks: list[str] = []
    if farthest.distance > worst_limit:
        remarks += _likely_causes(mesh, design, worst_limit)
    remarks += [_distance_text(farthest, against), _volume_text(mesh, design)]
    return judge(NAME, farthest.distance, f"{worst}: {'; '.join(remarks)}", limit=worst_limit)


def _own_file_limit(name: str) -> float:
    """Return the largest distance [mm] allowed between a file of this program and its design, by the file name.

    The triangles of an STL or 3MF file may also deviate from curved faces by their chord height.
    """
    return OWN_MM if Path(name).suffix.lower() in STEP_KINDS else OWN_MM + CHORD_MM


def _distance_text(farthest: Farthest, against: str) -> str:
    """Return a text on the largest distance: how it was measured, and its place unless the distance is 0.

    `against` names the part of the design with which the file was compared, or is empty.
    """
    x, y, z = farthest.point
    place = f", farthest at ({x:.3f}, {y:.3f}, {z:.3f}) mm of the {farthest.owner}" if farthest.distance else ""
    part = f", compared with the {against} of the design" if against else ""
    return f"distance between both surfaces, measured from each{part}{place}"


def _volume_text(mesh: trimesh.Trimesh, design: trimesh.Trimesh) -> str:
    """Return the volume of a file minus the volume of its design, and the volume of the design [mm^3], as text."""
    # Adding 0.0 replaces -0.0 by 0.0.
    volume_change = round(enclosed_volume(mesh) - enclosed_volume(design), _DECIMALS) + 0.0
    return f"volume {volume_change:+g} mm^3 compared with {enclosed_volume(design):.1f} mm^3 in the design"


def part_triangles(path: Path) -> trimesh.Trimesh:
    """Return the triangles [mm] of a STEP, STL or 3MF file. Raises ValueError if the file cannot be read."""
    kind = path.suffix.lower()
    if kind in STEP_KINDS:
        return shape_triangles(read_step(path), kind)
    return read_3mf(path).mesh if kind == ".3mf" else read_stl(path)


def shape_triangles(shape: cq.Shape, kind: str) -> trimesh.Trimesh:
    """Return the triangles [mm] of a shape, to be compared with a file whose suffix is `kind`, such as ".step".

    The triangles deviate from the shape by at most 0.005 mm.
    """
    return triangles(shape, _STEP_ANGLE_RAD) if kind in STEP_KINDS else triangles(shape)


def largest_distance(mesh: trimesh.Trimesh, design: trimesh.Trimesh) -> Farthest:
    """Return the largest distance [mm] between the surfaces of a file and of its design.

    The distance is measured from each surface to the other, at points 0.4 mm apart and at every corner. Triangles that
    both surfaces share are skipped, because they are equal within 1e-4 mm.
    """
    return _largest_distance(_surface_of(mesh), _surface_of(design))


def _largest_distance(file: _Surface, design: _Surface) -> Farthest:
    """Return the largest distance [mm] between the surfaces of a file and of its design.

    The distance is measured from each surface to the other. Only triangles that the other surface lacks are measured.
    """
    # If the two surfaces are equal, the result is the distance 0. The point of this result is arbitrary: the first
    # corner of the file.
    candidates = [Farthest(0.0, file.corners[0, 0], "file")]
    file_only, design_only = file.unshared_triangles(design), design.unshared_triangles(file)
    for owner, own_triangles, other_triangles, other_surface in (
        ("file", file_only, design_only, design),
        ("design", design_only, file_only, file),
    ):
        points, _ = _sample_points(own_triangles.corners)
        if not len(points):
            continue
        # Usually the two surfaces divide the same face into different triangles. The points then lie on the unshared
        # triangles of the other surface, at the distance 0. These triangles are few, so they are tried first.
        if 0 < len(other_triangles.corners) < len(other_surface.corners):
            distance_to_unshared, _ = _farthest_point(points, other_triangles)
            if distance_to_unshared == 0.0:
                continue
        distance, point = _farthest_point(points, other_surface)
        candidates.append(Farthest(distance, point, owner))
    return max(candidates, key=lambda candidate: candidate.distance)


def _surface_of(mesh: trimesh.Trimesh) -> _Surface:
    """Return the surface of a trimesh mesh, without its table of shared vertices."""
    return _Surface(np.asarray(mesh.triangles))


@dataclass(frozen=True, eq=False)
class _Surface:
    """A surface made of triangles, given by their corners (n, 3, 3) [mm]."""

    corners: Floats

    def unshared_triangles(self, other: _Surface) -> _Surface:
        """Return the surface without the triangles that it shares with the other surface."""
        is_shared = np.array([key in other.keys for key in self.triangle_keys])
        return _Surface(self.corners[~is_shared])

    @functools.cached_property
    def triangle_keys(self) -> list[bytes]:
        """Return one key per triangle; triangles with the same corners have the same key.

        Two corners are the same if they round to the same multiple of 1e-4 mm. The order of the corners of a triangle
        does not matter.
        """
        rounded = np.round(self.corners / _SAME_MM).astype(np.int64)
        # Each corner is viewed as one record of three integers, so that whole corners are sorted, not coordinates.
        sorted_corners = np.sort(rounded.view([("", np.int64)] * 3).reshape(-1, 3), axis=1)
        return [row.tobytes() for row in sorted_corners]

    @functools.cached_property
    def keys(self) -> frozenset[bytes]:
        """Return the set of all triangle keys."""
        return frozenset(self.triangle_keys)

    @functools.cached_property
    def samples(self) -> tuple[cKDTree, npt.NDArray[np.int64]]:
        """Return a search tree of sample points on the triangles, and the triangle index of each point, (n,)."""
        points, triangle_index = _sample_points(self.corners)
        return cKDTree(points), triangle_index


def _sample_points(corners: Floats) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Return sample points (m, 3) [mm] on triangles, and the index of the triangle of each point, shape (m,).

    `corners` (n, 3, 3) [mm] are the corners of the triangles. The points are in rows along the longest side of each
    triangle. Rows are at most d = `_SPACING_MM` apart, and so are the points in a row. The angles at the longest side
    are acute, so every point between two rows lies directly above the longer row. Such a point is at most d above this
    row, and its foot is at most d / 2 from the nearest point of the row. So the distance from any point of a triangle
    to the nearest sample point is at most sqrt(1.25) d.
    """
    # The longest side runs from a to b, and c is the corner opposite to it; each has the shape (n, 3).
    a, b, c, longest = _order_by_longest_side(corners)
    doubled_areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    # A triangle whose corners coincide has the longest side 0, and gets the height 0.
    heights = np.divide(doubled_areas, longest, out=np.zeros_like(longest), where=longest > 0.0)
    # Each row is at a fraction of the height, from 0 at the longest side to 1 at c.
    row_counts = 1 + np.ceil(heights / _SPACING_MM).astype(np.int64)  # for each triangle
    triangle_of_row, row_fractions = _spread_evenly(row_counts)
    row_starts = a[triangle_of_row] + row_fractions[:, None] * (c - a)[triangle_of_row]
    row_ends = b[triangle_of_row] + row_fractions[:, None] * (c - b)[triangle_of_row]
    row_lengths = longest[triangle_of_row] * (1.0 - row_fractions)
    # Each point is at a fraction of the length of its row.
    point_counts = 1 + np.ceil(row_lengths / _SPACING_MM).astype(np.int64)  # for each row
    row_of_point, point_fractions = _spread_evenly(point_counts)
    points = row_starts[row_of_point] + point_fractions[:, None] * (row_ends - row_starts)[row_of_point]
    return points, triangle_of_row[row_of_point]


def _order_by_longest_side(corners: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the corners a, b and c (n, 3) [mm] of triangles whose longest side is ab, and its length (n,) [mm].

    `corners` (n, 3, 3) [mm] holds the three corners of each triangle. The cyclic order of the corners is kept.
    """
    side_lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)  # side i begins at corner i
    # Corner a is the corner at which the longest side begins. The other two corners follow cyclically (modulo 3).
    corner_order = (np.argmax(side_lengths, axis=1)[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(corners, corner_order[:, :, None], axis=1).transpose(1, 0, 2)
    return a, b, c, side_lengths.max(axis=1)


def _spread_evenly(counts: npt.NDArray[np.int64]) -> tuple[npt.NDArray[np.int64], Floats]:
    """Return the group index and the relative position [1] of each member of consecutive groups.

    `counts` are the numbers of members of the groups, such as the rows of each triangle. The relative positions in a
    group are evenly spaced from 0 to 1; a single member has the position 0. The counts 3 and 1 give the group indices
    0, 0, 0, 1 and the positions 0, 0.5, 1, 0.
    """
    group_index = np.repeat(np.arange(len(counts)), counts)
    first_members = np.cumsum(counts) - counts  # for each group, the index of its first member among all members
    position_in_group = np.arange(len(group_index)) - np.repeat(first_members, counts)
    # A single member has no last position to divide by, so the divisor is at least 1.
    return group_index, position_in_group / np.maximum(counts[group_index] - 1, 1)


def _farthest_point(points: Floats, surface: _Surface) -> tuple[float, Floats]:
    """Return the largest distance [mm] from points (n, 3) [mm] to a surface, and the point with this distance.

    The distance is accurate to 0.1 % plus 1e-4 mm, and a distance of up to 1e-4 mm is returned as 0. The points are
    measured in descending order of their upper bounds. The search ends when no remaining bound exceeds the largest
    distance by more than this accuracy.
    """
    tree, triangle_index = surface.samples
    bounds = _distance_bounds(points, surface)  # each bound is replaced by the distance once its point is measured
    largest = 0.0
    for index in np.argsort(-bounds):
        if bounds[index] <= (1.0 + _RELATIVE_ACCURACY) * largest + _SAME_MM:
            break
        # The nearest triangle has a sample point within this radius, because every point of a triangle is at most
        # `_COVER_MM` away from a sample point.
        nearby = tree.query_ball_point(points[index], bounds[index] + _COVER_MM)
        bounds[index] = _triangle_distances(points[index], surface.corners[np.unique(triangle_index[nearby])]).min()
        largest = max(largest, bounds[index])
    # The farthest point may not have been measured: its bound exceeds the largest distance by at most the accuracy.
    worst = int(np.argmax(bounds))
    distance = round(float(bounds[worst]), _DECIMALS) if bounds[worst] > _SAME_MM else 0.0
    return distance, points[worst]


def _distance_bounds(points: Floats, surface: _Surface) -> Floats:
    """Return upper bounds on the distances from points (n, 3) [mm] to a surface, shape (n,) [mm].

    A bound is the distance to the triangles of the nearest sample points. The bound is computed again with more sample
    points if its point may be the farthest one. The true distance is at most `_COVER_MM` smaller than the distance to
    the nearest sample. So the largest distance to a nearest sample, minus `_COVER_MM`, is a lower bound on the largest
    true distance. A point with an upper bound below it cannot be the farthest.
    """
    tree, triangle_index = surface.samples
    bounds = np.full(len(points), np.inf)
    lower_bound = _SAME_MM  # smaller distances are treated as 0
    for neighbour_count in _NEAREST:
        candidates = np.flatnonzero(bounds > lower_bound)  # indices of the points that may be the farthest
        for start in range(0, len(candidates), _BATCH):
            batch = candidates[start : start + _BATCH]
            # A list of ranks, with 1 for the nearest sample, makes the results two-dimensional: (points, ranks).
            ranks = np.arange(1, 1 + min(neighbour_count, tree.n))
            to_samples, nearest = tree.query(points[batch], k=ranks)
            nearby_triangles = surface.corners[triangle_index[np.asarray(nearest)]]
            bounds[batch] = _triangle_distances(points[batch][:, None], nearby_triangles).min(axis=1)
            lower_bound = max(lower_bound, float(np.asarray(to_samples)[:, 0].max()) - _COVER_MM)
    return bounds


def _triangle_distances(points: Floats, corners: Floats) -> Floats:
    """Return the distances [mm] from points (..., 3) to the triangles with the `corners` (..., 3, 3), shape (...).

    If the projection of a point lies inside the triangle, the distance is the height of the point above it. Otherwise,
    the distance to the nearest edge is returned.
    """
    # Edge i runs from corner i to the next corner. `from_corners` are the vectors from each corner to the point.
    edges = np.roll(corners, -1, axis=-2) - corners
    from_corners = points[..., None, :] - corners
    to_edges = _nearest_edge_distances(edges, from_corners)
    normals = np.cross(edges[..., 0, :], edges[..., 1, :])
    # The divisor 1 replaces the area 0 of a collapsed triangle, whose height is not used.
    doubled_areas = np.linalg.norm(normals, axis=-1)
    area_divisors = np.where(doubled_areas > 0.0, doubled_areas, 1.0)
    heights = np.abs(np.einsum("...i,...i->...", from_corners[..., 0, :], normals)) / area_divisors
    # A point projects into the triangle if it lies on the inner side of all three edges.
    side_products = np.einsum("...ij,...j->...i", np.cross(edges, from_corners), normals)
    is_inside = (side_products >= 0.0).all(axis=-1) & (doubled_areas > 0.0)
    return np.asarray(np.where(is_inside, heights, to_edges))


def _nearest_edge_distances(edges: Floats, from_corners: Floats) -> Floats:
    """Return the distance [mm] from each point to the nearest edge of a triangle, shape (...).

    `edges` (..., 3, 3) [mm] holds the three edges of each triangle as vectors, and `from_corners` (..., 3, 3) [mm] the
    vector from the start of each edge to the point.
    """
    # The position of the nearest point of each edge is a fraction of the edge. The divisor 1 replaces the length 0 of a
    # collapsed edge, whose fraction does not matter.
    squared_lengths = np.einsum("...i,...i->...", edges, edges)
    length_divisors = np.where(squared_lengths > 0.0, squared_lengths, 1.0)
    fractions = np.einsum("...i,...i->...", from_corners, edges) / length_divisors
    nearest_on_edges = np.clip(fractions, 0.0, 1.0)[..., None] * edges  # relative to the start of each edge
    return np.asarray(np.linalg.norm(from_corners - nearest_on_edges, axis=-1).min(axis=-1))


def _likely_causes(mesh: trimesh.Trimesh, design: trimesh.Trimesh, limit: float) -> Iterator[str]:
    """Yield the likely causes of a large distance: a wrong unit, a wrong position or rotation, or a mirror image.

    A wrong position, rotation or mirror image is yielded only if correcting it brings the file within `limit` [mm] of
    its design.
    """
    # Neither a scale nor a centre of mass is defined unless both surfaces enclose a volume.
    if not (enclosed_volume(mesh) > 0.0 and enclosed_volume(design) > 0.0):
        return
    mesh_in_mm = mesh
    unit = _likely_unit(mesh, design)
    if unit is not None:
        factor = UNITS[unit]
        yield f"the file is in {unit}: its numbers are {factor:g} times smaller than in mm"
        mesh_in_mm = mesh.copy()
        mesh_in_mm.apply_transform(np.diag([factor, factor, factor, 1.0]))  # a transform without a translation
    transform = _correcting_transform(mesh_in_mm, design, limit)
    displacement = None if transform is None else _displacement_text(transform, mesh_in_mm)
    if displacement is not None:
        yield displacement


def _correcting_transform(mesh: trimesh.Trimesh, design: trimesh.Trimesh, limit: float) -> Floats | None:
    """Return the first transform (4, 4) that brings a mesh within `limit` [mm] of its design, or None if none does.

    The identity is tried before the transforms that align the mesh with the design.
    """
    design_surface = _surface_of(design)
    for transform in [np.eye(4), *_aligning_transforms(mesh, design)]:
        moved_mesh = mesh.copy()
        moved_mesh.apply_transform(transform)
        corners = np.asarray(moved_mesh.vertices)
        # A few corners are measured first, because most transforms are wrong and the whole surface takes longer.
        sampled_corners = corners[:: max(1, len(corners) // _TESTED_CORNERS)]
        if (
            _distance_bounds(sampled_corners, design_surface).max() <= limit
            and _largest_distance(_surface_of(moved_mesh), design_surface).distance <= limit
        ):
            return transform
    return None


def _likely_unit(mesh: trimesh.Trimesh, design: trimesh.Trimesh) -> str | None:
    """Return the unit in which a file was probably written in place of millimetres, or None if no unit matches.

    The scale is the cube root of the ratio of the volumes.
    """
    scale = (enclosed_volume(design) / enclosed_volume(mesh)) ** (1.0 / 3.0)
    for unit, factor in UNITS.items():
        if math.isclose(scale, factor, rel_tol=_SCALE_TOLERANCE):
            return unit
    return None


def _aligning_transforms(mesh: trimesh.Trimesh, design: trimesh.Trimesh) -> list[Floats]:
    """Return candidate transforms (4, 4) [translation in mm] that may move the mesh of a file onto its design.

    Each transform aligns the centres of mass. The first transform does not rotate; the others also align the principal
    axes of inertia. Because the axes have no sign, there are eight ways to align them. Rotations come first, in
    ascending order of their angles, and mirror images come last.
    """
    # The rows of these matrices are the principal axes, so `design_axes.T @ file_axes` maps the axes of the mesh onto
    # the axes of the design.
    file_axes, design_axes = (np.asarray(body.principal_inertia_vectors) for body in (mesh, design))
    rotations = [np.eye(3)]
    rotations += [design_axes.T @ np.diag(signs) @ file_axes for signs in itertools.product((1.0, -1.0), repeat=3)]
    transforms = []
    # A mirror image has the determinant -1. The trace of a rotation decreases as its angle grows.
    for rotation in sorted(rotations, key=lambda rotation: (np.linalg.det(rotation) < 0.0, -np.trace(rotation))):
        transform = np.eye(4)
        transform[:3, :3] = rotation
        transform[:3, 3] = design.center_mass - rotation @ mesh.center_mass
        transforms.append(transform)
    return transforms


def _displacement_text(transform: Floats, mesh: trimesh.Trimesh) -> str | None:
    """Return how the mesh of a file is displaced from its design as text, or None if it is not displaced.

    `transform` (4, 4) moves the mesh [mm] onto its design.
    """
    rotation = transform[:3, :3]
    if np.linalg.det(rotation) < 0.0:
        return "the part is mirrored, but otherwise as designed"
    # The displacement is the present centre of mass minus the centre at which the transform would place it.
    centre = np.asarray(mesh.center_mass)
    # Adding 0.0 replaces -0.0 by 0.0.
    x, y, z = np.round(centre - (rotation @ centre + transform[:3, 3]), _DECIMALS) + 0.0
    # The trace of a rotation by an angle is 1 + 2 cos(angle). Round-off may make the cosine slightly larger than 1.
    cosine = 0.5 * (float(np.trace(rotation)) - 1.0)
    angle = math.degrees(math.acos(min(1.0, max(-1.0, cosine))))
    rotation_text = f" and rotated by {angle:.1f} deg" if angle > _MIN_ROTATION_DEG else ""
    if not rotation_text and not any((x, y, z)):
        return None
    return f"moved by ({x:g}, {y:g}, {z:g}) mm at its centre of mass{rotation_text}, but otherwise as designed"
