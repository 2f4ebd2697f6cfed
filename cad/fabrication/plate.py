"""All printed parts of a sensor on one print bed, plate.3mf."""

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path

import trimesh

from cad.fabrication.bill import BillLine
from cad.files.sensor_files import compare_volume
from cad.files.threemf import read_3mf, write_3mf
from sensor.quantity import Estimate

GAP_MM = 6.0  # between parts, and from the corner of the bed, which is the origin
_ROUND_OFF_MM = 1e-6


def write_plate(
    meshes: Mapping[str, trimesh.Trimesh],
    volumes: Mapping[str, Estimate],
    bill: Sequence[BillLine],
    settings: Mapping[str, str],
    path: Path,
) -> None:
    """Write the printed parts of a bill as often as it counts them, from their meshes in print pose [mm].

    Each copy is an object of its own: PrusaSlicer gives the settings to the first copy of an object only. `volumes`
    [mm^3] are those of the parts. Raises OSError where the file cannot be written, ExportError where it has another
    volume when it is read back.
    """
    counts = {row.part: row.count for row in bill if row.part in meshes}
    write_3mf(on_plate(meshes, counts), path, settings)
    wanted = [(count, volumes[name]) for name, count in counts.items()]
    whole = sum(count * volume.value for count, volume in wanted)
    error = sum(count * volume.error for count, volume in wanted)
    compare_volume(path, read_3mf(path).mesh.volume, Estimate(whole, error, "mm^3"))


def on_plate(meshes: Mapping[str, trimesh.Trimesh], counts: Mapping[str, int]) -> dict[str, trimesh.Trimesh]:
    """Return each copy of parts [mm] in its place: upright in rows, the longest first, on the smallest square bed."""
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
    """Return parts by their names in rows of a width with the gaps [mm], or of one part that is wider."""
    placed: dict[str, trimesh.Trimesh] = {}
    along = across = GAP_MM
    depth = 0.0  # of the row
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
    """Return the side of the smallest square bed from the origin on that holds parts [mm]."""
    return max(float(mesh.bounds[1, :2].max()) for mesh in placed.values())


def on_flange(bracket: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return the triangles of a bracket [mm] from the pose of mount.stl turned on its flange, so that nothing hangs."""
    turned = bracket.copy()
    turned.vertices = bracket.vertices[:, [0, 2, 1]] * (1.0, 1.0, -1.0)
    turned.apply_translation((0.0, 0.0, -float(turned.bounds[0, 2])))
    return turned


def _upright(part: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return a part on the bed [mm] with its longer side along y: more of them stand in a row."""
    width, height, _ = part.extents.tolist()
    if height >= width:
        return part
    turned = part.copy()
    turned.vertices = part.vertices[:, [1, 0, 2]] * (-1.0, 1.0, 1.0)
    return turned
