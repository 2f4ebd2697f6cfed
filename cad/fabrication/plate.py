"""All printed parts of a sensor on one print bed, plate.3mf."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import trimesh

from cad.fabrication.bill import BillLine
from cad.files.sensor_files import compare_volume
from cad.files.threemf import Places, read_3mf, write_3mf
from sensor.quantity import Estimate

GAP_MM = 10.0  # between parts: threads between near leaves would stiffen them
ROW_MM = 160.0  # of a row: a bed of 180 mm, one of the smallest, has a margin of 10 mm on either side
MARGIN_MM = 10.0  # from the corner of the bed, which is the origin


def on_flange(bracket: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return the triangles of a bracket [mm] from the pose of mount.stl turned on its flange, so that nothing hangs."""
    turned = bracket.copy()
    turned.vertices = bracket.vertices[:, [0, 2, 1]] * (1.0, 1.0, -1.0)
    turned.apply_translation((0.0, 0.0, -float(turned.bounds[0, 2])))
    return turned


def write_plate(
    meshes: Mapping[str, trimesh.Trimesh],
    volumes: Mapping[str, Estimate],
    bill: Sequence[BillLine],
    settings: Mapping[str, str],
    path: Path,
) -> None:
    """Write the printed parts of a bill as often as it counts them, from their meshes in print pose [mm].

    `volumes` [mm^3] are those of the parts. Raises OSError where the file cannot be written, ExportError where it has
    another volume when it is read back.
    """
    counts = {row.part: row.count for row in bill if row.part in meshes}
    lying = {name: on_flange(meshes[name]) if name == "mount" else meshes[name] for name in counts}
    write_3mf(lying, path, settings, places_of(lying, counts))
    wanted = [(count, volumes[name]) for name, count in counts.items()]
    whole = sum(count * volume.value for count, volume in wanted)
    error = sum(count * volume.error for count, volume in wanted)
    compare_volume(path, read_3mf(path).mesh.volume, Estimate(whole, error, "mm^3"))


def places_of(meshes: Mapping[str, trimesh.Trimesh], counts: Mapping[str, int]) -> dict[str, Places]:
    """Return the moves of each copy [mm] that set them in rows, the deepest parts first; none lies on another."""
    places: dict[str, list[tuple[float, float]]] = {name: [] for name in counts}
    along = across = MARGIN_MM
    depth = 0.0  # of the row
    for name in sorted(counts, key=lambda name: -float(meshes[name].extents[1])):
        (left, front, _), (width, height, _) = meshes[name].bounds[0].tolist(), meshes[name].extents.tolist()
        for _ in range(counts[name]):
            if along > MARGIN_MM and along + width > MARGIN_MM + ROW_MM:
                along, across, depth = MARGIN_MM, across + depth + GAP_MM, 0.0
            places[name].append((along - left, across - front))
            along += width + GAP_MM
            depth = max(depth, height)
    return {name: tuple(moves) for name, moves in places.items()}
