"""The shape that each file of a sensor must hold according to its design, in the pose of the file."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import cadquery as cq
import trimesh

from cad.checks.as_designed import FOREIGN_MM, STEP_KINDS, UNITS, as_designed_verdict, part_triangles, shape_triangles
from cad.checks.triangle_checks import enclosed_volume
from cad.fabrication.mount import mount_solid
from cad.files.sensor_files import print_shape
from cad.parts.assembly import COVER_COLOUR, STEEL_COLOUR, assembly_of
from cad.parts.coupon_solid import coupon_part
from cad.parts.cover_solid import cover_part
from cad.parts.pin_socket import pin_solid
from cad.parts.pose import print_pose
from cad.parts.sensor import SensorSolids
from sensor.verdict import Verdict

_TOOL_COLOUR = cq.Color(0.45, 0.62, 0.35)  # colour of the coupon, which is not a part of a sensor
_TINY = 1e-12  # replaces a volume or an area of 0 in a ratio
HOUSING_FILES = ("housing.step", "housing.stl", "housing.3mf")
RUN_FILES = (*HOUSING_FILES, "assembly.step")
"""Files of solids that every run writes, except a quick run on coarse meshes."""


def maker_parts(sensor: SensorSolids) -> Mapping[str, Callable[[], cq.Assembly]]:
    """Return the functions that draw the parts added by `pipeline design`; each part is written as STEP and as STL."""
    return {
        "coupon": lambda: cq.Assembly(coupon_part(sensor.housing).shape, name="coupon", color=_TOOL_COLOUR),
        "cover": lambda: cq.Assembly(cover_part(sensor.housing, sensor.seats).shape, name="cover", color=COVER_COLOUR),
        "mount": lambda: cq.Assembly(mount_solid(sensor), name="mount", color=STEEL_COLOUR),
    }


def file_shapes(sensor: SensorSolids) -> Mapping[str, Callable[[], cq.Shape]]:
    """Return, by the name of the file, the functions that draw the shapes of a sensor in the poses of the files [mm].

    A shape is drawn only when its function is called.
    """
    draw_printed = functools.partial(print_shape, sensor)
    shapes: dict[str, Callable[[], cq.Shape]] = {
        "housing.step": lambda: sensor.part.shape,
        "housing.stl": draw_printed,
        "housing.3mf": draw_printed,
        "assembly.step": lambda: assembly_of(sensor).toCompound(),
    }
    for name, draw in maker_parts(sensor).items():
        shapes[f"{name}.step"] = functools.partial(_as_drawn, draw)
        shapes[f"{name}.stl"] = functools.partial(_in_print_pose, draw)
    if pin := sensor.housing.pin:
        shapes["pin.step"] = lambda: pin_solid(pin, sensor.tips)
    return shapes


def _as_drawn(draw: Callable[[], cq.Assembly]) -> cq.Shape:
    """Return the shape of a part in the pose in which it is drawn."""
    return draw().shapes[0]


def _in_print_pose(draw: Callable[[], cq.Assembly]) -> cq.Shape:
    """Return the shape of a part in its print pose."""
    return print_pose(_as_drawn(draw))


def files_as_designed(sensor: SensorSolids, folder: Path, names: Iterable[str]) -> Verdict:
    """Return geometry.as_designed on the named files of a folder; raises ValueError if a file cannot be read."""
    shapes = file_shapes(sensor)

    @functools.cache  # files of one shape and kind share its triangles
    def design_triangles(draw: Callable[[], cq.Shape], kind: str) -> trimesh.Trimesh:
        return shape_triangles(draw(), kind)

    return as_designed_verdict(
        {name: (part_triangles(folder / name), design_triangles(shapes[name], _compared_kind(name))) for name in names}
    )


def part_as_designed(sensor: SensorSolids, path: Path) -> Verdict:
    """Return geometry.as_designed on a file of any origin, compared with the most similar part of the sensor.

    A STEP file is compared with the parts as STEP files hold them, and an STL or 3MF file with parts in print pose. The
    most similar part is the one whose volume and surface are closest, in any unit. Raises ValueError if the file cannot
    be read.
    """
    mesh = part_triangles(path)
    kind = _compared_kind(path.name)
    designs = {name: shape_triangles(draw(), kind) for name, draw in file_shapes(sensor).items() if name.endswith(kind)}
    most_similar = min(designs, key=lambda name: _dissimilarity(mesh, designs[name]))
    return as_designed_verdict({path.name: (mesh, designs[most_similar])}, FOREIGN_MM, Path(most_similar).stem)


def _compared_kind(name: str) -> str:
    """Return the suffix that represents the kind of a file: .step for STEP files, .stl for STL and 3MF files."""
    return ".step" if name.lower().endswith(STEP_KINDS) else ".stl"


def _dissimilarity(mesh: trimesh.Trimesh, design: trimesh.Trimesh) -> float:
    """Return the relative difference of two bodies in volume and surface [1]; 0 if they are equal.

    The measure is the sum of the absolute logarithms of both ratios, in the unit of length that makes it smallest.
    """
    volume = enclosed_volume(design) / max(enclosed_volume(mesh), _TINY)
    area = float(design.area) / max(float(mesh.area), _TINY)
    return min(abs(math.log(volume / scale**3)) + abs(math.log(area / scale**2)) for scale in (1.0, *UNITS.values()))
