"""The file plate.3mf, which holds all printed parts of a sensor, arranged on one print bed."""

import itertools
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
import trimesh

from cad.fabrication.bill import BillLine
from cad.files.sensor_files import compare_volume
from cad.files.threemf import read_3mf, write_3mf
from sensor.quantity import Estimate

GAP_MM = 6.0  # gap between parts, and between parts and the edges of the bed at x = 0 and y = 0
_ROUND_OFF_MM = 1e-6  # tolerance for the round-off error of a width


def write_plate(
    meshes: Mapping[str, trimesh.Trimesh],
    volumes: Mapping[str, Estimate],
    bill: Sequence[BillLine],
    settings: Mapping[str, str],
    path: Path,
) -> tuple[float, float]:
    """Write the printed parts of a bill to a 3MF file, with as many copies of each part as the bill lists.

    Returns the sizes of the plate along x and y [mm], without gaps at its edges.

    `meshes` are the parts in print pose [mm], and `volumes` are their volumes [mm^3] with error bars, both keyed by
    part name. `settings` are settings of the slicer. Every copy is a separate object, because PrusaSlicer applies
    settings only to the first copy of an object. Raises OSError if the file cannot be written, and ExportError if the
    volume read back from it is wrong.
    """
    counts = {row.part: row.count for row in bill if row.part in meshes}  # bought parts have no mesh
    placed_meshes = arrange_on_bed(meshes, counts)
    write_3mf(placed_meshes, path, settings)
    expected_volumes = [(count, volumes[name]) for name, count in counts.items()]
    total_volume = sum(count * volume.value for count, volume in expected_volumes)
    volume_error = sum(count * volume.error for count, volume in expected_volumes)
    compare_volume(path, read_3mf(path).mesh.volume, Estimate(total_volume, volume_error, "mm^3"))
    return plate_size(placed_meshes.values())


def arrange_on_bed(meshes: Mapping[str, trimesh.Trimesh], counts: Mapping[str, int]) -> dict[str, trimesh.Trimesh]:
    """Arrange all copies of the parts in rows on a square bed [mm], and return the copies by name.

    `meshes` are the parts in print pose [mm] and `counts` the numbers of their copies, both keyed by name. The longer
    side of each part is along y, and the longest part comes first. Several row widths are tried: the total width of the
    first n copies, for every n. The arrangement that needs the smallest bed is returned.
    """
    rotated = {}
    for name in counts:
        # The bracket has no overhangs if it rests on its flange.
        mesh = rest_on_flange(meshes[name]) if name == "mount" else meshes[name]
        rotated[name] = _rotate_lengthwise(mesh)
    # The array `extents` of a mesh holds its sizes along x, y and z.
    names_by_length = sorted(counts, key=lambda name: float(rotated[name].extents[1]), reverse=True)
    copies = []
    for name in names_by_length:
        for number in range(1, counts[name] + 1):
            copy_name = f"{name} {number}" if counts[name] > 1 else name
            copies.append((copy_name, rotated[name]))
    row_widths = itertools.accumulate(float(mesh.extents[0]) + GAP_MM for _, mesh in copies)
    return min((_place_in_rows(copies, width) for width in row_widths), key=_bed_side)


def _place_in_rows(copies: Sequence[tuple[str, trimesh.Trimesh]], width: float) -> dict[str, trimesh.Trimesh]:
    """Place parts in rows of limited `width` [mm], gaps included, and return them by name.

    A part that is wider than this limit gets a row of its own.
    """
    placed_meshes: dict[str, trimesh.Trimesh] = {}
    x = y = GAP_MM  # left front corner of the next part
    row_depth = 0.0  # size along y of the deepest part in the current row
    for name, mesh in copies:
        part_width, part_depth, _ = mesh.extents.tolist()
        # If a part does not fit beside the parts already in the row, it begins a new row.
        if x > GAP_MM and x + part_width > width + _ROUND_OFF_MM:
            x, y, row_depth = GAP_MM, y + row_depth + GAP_MM, 0.0
        left, front, _ = mesh.bounds[0].tolist()
        placed_meshes[name] = mesh.copy()
        placed_meshes[name].apply_translation((x - left, y - front, 0.0))
        x += part_width + GAP_MM
        row_depth = max(row_depth, part_depth)
    return placed_meshes


def _bed_side(placed_meshes: Mapping[str, trimesh.Trimesh]) -> float:
    """Return the side length [mm] of the smallest square bed, with one corner at the origin, that holds all parts."""
    return max(float(mesh.bounds[1, :2].max()) for mesh in placed_meshes.values())


def plate_size(placed_meshes: Iterable[trimesh.Trimesh]) -> tuple[float, float]:
    """Return the sizes along x and y [mm] of the smallest rectangle that holds all parts on the bed."""
    bounds = np.array([mesh.bounds[:, :2] for mesh in placed_meshes])  # (parts, lowest and highest corner, x and y)
    width, depth = bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)
    return float(width), float(depth)


def rest_on_flange(bracket: trimesh.Trimesh) -> trimesh.Trimesh:
    """Rotate the triangles of a bracket [mm] from the pose of mount.stl, so that it rests on its flange.

    In this pose, the bracket has no overhangs.
    """
    rotated = bracket.copy()
    rotated.vertices = bracket.vertices[:, [0, 2, 1]] * (1.0, 1.0, -1.0)
    rotated.apply_translation((0.0, 0.0, -float(rotated.bounds[0, 2])))
    return rotated


def _rotate_lengthwise(part: trimesh.Trimesh) -> trimesh.Trimesh:
    """Rotate a part on the bed so that its longer side is along y. More parts then fit in a row."""
    width, height, _ = part.extents.tolist()
    if height >= width:
        return part
    rotated = part.copy()
    rotated.vertices = part.vertices[:, [1, 0, 2]] * (-1.0, 1.0, 1.0)
    return rotated
