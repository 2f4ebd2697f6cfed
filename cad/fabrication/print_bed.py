"""All printed parts of a sensor on one print bed, in the file plate.3mf."""

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path

import trimesh

from cad.fabrication.bill import BillLine
from cad.files.sensor_files import compare_volume
from cad.files.threemf import read_3mf, write_3mf
from sensor.quantity import Estimate

GAP_MM = 6.0  # gap between parts, and between parts and the edges of the bed at x = 0 and y = 0
_ROUND_OFF_MM = 1e-6


def write_plate(
    meshes: Mapping[str, trimesh.Trimesh],
    volumes: Mapping[str, Estimate],
    bill: Sequence[BillLine],
    settings: Mapping[str, str],
    path: Path,
) -> None:
    """Write the printed parts of a bill, each as often as the bill counts it, from their meshes in print pose [mm].

    Every copy is a separate object, because PrusaSlicer applies settings only to the first copy of an object. `volumes`
    [mm^3] are the volumes of the parts. Raises OSError if the file cannot be written, and ExportError if the volume
    read back from it is wrong.
    """
    counts = {row.part: row.count for row in bill if row.part in meshes}
    write_3mf(on_plate(meshes, counts), path, settings)
    wanted = [(count, volumes[name]) for name, count in counts.items()]
    whole = sum(count * volume.value for count, volume in wanted)
    error = sum(count * volume.error for count, volume in wanted)
    compare_volume(path, read_3mf(path).mesh.volume, Estimate(whole, error, "mm^3"))


def on_plate(meshes: Mapping[str, trimesh.Trimesh], counts: Mapping[str, int]) -> dict[str, trimesh.Trimesh]:
    """Return each copy of the parts in its place on the smallest square bed [mm].

    The parts are in rows with their longer sides along y, the longest first. The width of a row is tried for every
    number of parts in the first row.
    """
    standing = {name: _upright(on_flange(meshes[name]) if name == "mount" else meshes[name]) for name in counts}
    names = sorted(counts, key=lambda name: -float(standing[name].extents[1]))
    copies = [
        (f"{name} {copy}" if counts[name] > 1 else name, standing[name])
        for name in names
        for copy in range(1, counts[name] + 1)
    ]
    widths = itertools.accumulate(float(mesh.extents[0]) + GAP_MM for _, mesh in copies)
    return min((_in_rows(copies, width) for width in widths), key=_bed_side)


def _in_rows(copies: Sequence[tuple[str, trimesh.Trimesh]], width: float) -> dict[str, trimesh.Trimesh]:
    """Return parts by name, placed in rows whose width with gaps is limited [mm]; a wider part gets its own row."""
    placed: dict[str, trimesh.Trimesh] = {}
    along = across = GAP_MM
    depth = 0.0  # depth of the row
    for name, mesh in copies:
        beside, behind, _ = mesh.extents.tolist()
        if along > GAP_MM and along + beside > width + _ROUND_OFF_MM:
            along, across, depth = GAP_MM, across + depth + GAP_MM, 0.0
        left, front, _ = mesh.bounds[0].tolist()
        placed[name] = mesh.copy()
        placed[name].apply_translation((along - left, across - front, 0.0))
        along += beside + GAP_MM
        depth = max(depth, behind)
    return placed


def _bed_side(placed: Mapping[str, trimesh.Trimesh]) -> float:
    """Return the side of the smallest square bed, with a corner at the origin, that holds the parts [mm]."""
    return max(float(mesh.bounds[1, :2].max()) for mesh in placed.values())


def on_flange(bracket: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return the triangles of a bracket [mm], turned from the pose of mount.stl onto its flange.

    In this pose the bracket has no overhangs.
    """
    turned = bracket.copy()
    turned.vertices = bracket.vertices[:, [0, 2, 1]] * (1.0, 1.0, -1.0)
    turned.apply_translation((0.0, 0.0, -float(turned.bounds[0, 2])))
    return turned


def _upright(part: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return a part on the bed with its longer side along y [mm], so that more parts fit in a row."""
    width, height, _ = part.extents.tolist()
    if height >= width:
        return part
    turned = part.copy()
    turned.vertices = part.vertices[:, [1, 0, 2]] * (-1.0, 1.0, 1.0)
    return turned
