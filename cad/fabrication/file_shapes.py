"""The shape that each file of a sensor must contain according to the design, in the pose of the file."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import cadquery as cq
import trimesh

from cad.checks.as_designed import FOREIGN_MM, STEP_KINDS, UNITS, as_designed_verdict, part_triangles, shape_triangles
from cad.checks.triangle_checks import enclosed_volume
from cad.fabrication.mount import bracket_solid
from cad.files.sensor_files import print_shape
from cad.parts.assembly import COVER_COLOUR, STEEL_COLOUR, assemble_sensor
from cad.parts.coupon_solid import coupon_part
from cad.parts.cover_solid import cover_part
from cad.parts.pin_socket import pin_solid
from cad.parts.pose import print_pose
from cad.parts.sensor import SensorSolids
from sensor.verdict import Verdict

_TOOL_COLOUR = cq.Color(0.45, 0.62, 0.35)  # colour of the coupon, which is not a part of the sensor
_TINY = 1e-12  # lower limit on a volume or an area, so that no ratio is divided by 0
HOUSING_FILES = ("housing.step", "housing.stl", "housing.3mf")
RUN_FILES = (*HOUSING_FILES, "assembly.step")
"""The files of solids that every run writes, except a quick run on coarse meshes."""


def maker_parts(sensor: SensorSolids) -> Mapping[str, Callable[[], cq.Assembly]]:
    """Return the functions that draw the parts added by `pipeline design`, keyed by part name.

    Each part is written to a STEP file and an STL file. The part with the name `mount` is the bracket.
    """
    return {
        "coupon": lambda: cq.Assembly(coupon_part(sensor.housing).shape, name="coupon", color=_TOOL_COLOUR),
        "cover": lambda: cq.Assembly(cover_part(sensor.housing, sensor.seats).shape, name="cover", color=COVER_COLOUR),
        "mount": lambda: cq.Assembly(bracket_solid(sensor), name="mount", color=STEEL_COLOUR),
    }


def file_shapes(sensor: SensorSolids) -> Mapping[str, Callable[[], cq.Shape]]:
    """Return the functions that draw the shapes in the files of a sensor [mm], keyed by file name.

    A part has the pose in which it is drawn in a STEP file, and the print pose in an STL or 3MF file. A shape is drawn
    only when its function is called. The two print files of the housing share one function, so that a caller can cache
    its result.
    """
    draw_printed = functools.partial(print_shape, sensor)
    shapes: dict[str, Callable[[], cq.Shape]] = {
        "housing.step": lambda: sensor.part.shape,
        "housing.stl": draw_printed,
        "housing.3mf": draw_printed,
        "assembly.step": lambda: assemble_sensor(sensor).toCompound(),
    }
    for name, draw in maker_parts(sensor).items():
        shapes[f"{name}.step"] = functools.partial(_as_drawn, draw)
        shapes[f"{name}.stl"] = functools.partial(_in_print_pose, draw)
    if pin := sensor.housing.pin:
        shapes["pin.step"] = lambda: pin_solid(pin, sensor.tips)
    return shapes


def _as_drawn(draw: Callable[[], cq.Assembly]) -> cq.Shape:
    return draw().shapes[0]


def _in_print_pose(draw: Callable[[], cq.Assembly]) -> cq.Shape:
    return print_pose(_as_drawn(draw))


def files_as_designed(sensor: SensorSolids, folder: Path, names: Iterable[str]) -> Verdict:
    """Return the verdict geometry.as_designed: whether the named files of a folder have the designed geometry.

    Raises ValueError if a file cannot be read.
    """
    draw_functions = file_shapes(sensor)

    @functools.cache  # files with the same shape and kind share their triangles
    def design_triangles(draw: Callable[[], cq.Shape], kind: str) -> trimesh.Trimesh:
        """Draw the designed shape of a file, and return its triangles for a comparison with this kind of file."""
        return shape_triangles(draw(), kind)

    pairs = {}  # the triangles of each file and of its design
    for name in names:
        mesh = part_triangles(folder / name)
        pairs[name] = (mesh, design_triangles(draw_functions[name], _compared_kind(name)))
    return as_designed_verdict(pairs)


def part_as_designed(sensor: SensorSolids, path: Path) -> Verdict:
    """Return the verdict geometry.as_designed on a file of any origin, compared with the most similar part of a sensor.

    A STEP file is compared with the parts in the poses of the STEP files. An STL or 3MF file is compared with the parts
    in print pose. The most similar part is the part whose volume and surface area are closest to the file, in any unit.
    Raises ValueError if the file cannot be read.
    """
    mesh = part_triangles(path)
    kind = _compared_kind(path.name)
    designs = {name: shape_triangles(draw(), kind) for name, draw in file_shapes(sensor).items() if name.endswith(kind)}
    most_similar = min(designs, key=lambda name: _dissimilarity(mesh, designs[name]))
    part_name = Path(most_similar).stem
    return as_designed_verdict({path.name: (mesh, designs[most_similar])}, limit=FOREIGN_MM, against=part_name)


def _compared_kind(name: str) -> str:
    """Return ".step" for a STEP file, or ".stl" for an STL or 3MF file, because STL and 3MF use the same pose."""
    return ".step" if name.lower().endswith(STEP_KINDS) else ".stl"


def _dissimilarity(mesh: trimesh.Trimesh, design: trimesh.Trimesh) -> float:
    """Return a measure [1] of the difference between two bodies in volume and surface area.

    The measure is |ln(volume ratio)| + |ln(area ratio)|, which is 0 for equal bodies. The unit of the mesh is unknown,
    so the measure is computed for every unit of length, and the smallest value is returned.
    """
    volume_ratio = enclosed_volume(design) / max(enclosed_volume(mesh), _TINY)
    area_ratio = float(design.area) / max(float(mesh.area), _TINY)
    unit_lengths = (1.0, *UNITS.values())  # [mm]
    return min(abs(math.log(volume_ratio / unit**3)) + abs(math.log(area_ratio / unit**2)) for unit in unit_lengths)
