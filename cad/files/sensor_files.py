"""The files of a sensor: STEP for housing and assembly, STL and 3MF in print pose, and GLB for browsers.

All files except the GLB file are read back, and their volumes are compared with the design.
"""

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import cadquery as cq
import numpy as np
import trimesh
from numpy.typing import NDArray

from cad.files.export_error import ExportError
from cad.files.glb import GlbBody, encode_glb
from cad.files.step import read_step, write_step
from cad.files.stl import CHORD_MM, read_stl, write_stl
from cad.files.threemf import read_3mf, write_3mf
from cad.parts.assembly import PRINTED_COLOUR, STEEL_COLOUR, assemble_sensor, exploded_shift, part_colour
from cad.parts.pin_socket import pin_solid
from cad.parts.pose import location_matrix, print_pose
from cad.parts.sensor import SensorSolids
from sensor.arrays import Floats
from sensor.quantity import Estimate

_STEP_TOLERANCE = 1e-9  # relative error of a volume read from a STEP file, whose numbers have 15 digits
_REVOLVED = ("SPHERE", "REVOLUTION")  # types of faces for which OCCT integrates the volume numerically
_INTEGRAL_TOLERANCE = 1e-8  # relative tolerance of a volume that OCCT integrates numerically
_VIEW_CHORD_MM = 0.1  # chord height of triangles that serve only for a picture
_VIEW_ANGLE_RAD = 0.5  # largest angle between such triangles
_SINGLE_PRECISION = 1e-6  # rounding error of a coordinate in an STL file, divided by the smallest side of a part


@dataclass(frozen=True, kw_only=True)
class FormsRead:
    """The shapes read from the files of a sensor [mm]: the solid in housing.step, and the mesh in housing.stl.

    The mesh is in print pose.
    """

    step: cq.Shape
    stl: trimesh.Trimesh


@dataclass(frozen=True, kw_only=True)
class SensorFiles:
    """The paths of the written files, and the shapes read back from those files that are checked later."""

    paths: tuple[Path, ...]
    forms: FormsRead


def write_sensor(sensor: SensorSolids, folder: Path, settings: Mapping[str, str] | None = None) -> SensorFiles:
    """Write the files of a sensor: housing (STEP, STL, 3MF), assembly (STEP, GLB), and pin (STEP) if it has pins.

    The files housing.stl and housing.3mf are in print pose, with the engraved name. The 3MF file also holds `settings`
    for a slicer. The file assembly.glb has coloured bodies, and an animation that moves them to an exploded view.

    Raises OSError if a file cannot be written, and ExportError if the volume read back from a file is wrong. The volume
    in the GLB file is not checked, because it serves only for a picture.
    """
    housing_step = folder / "housing.step"
    housing_read = export_step(cq.Assembly(sensor.part.shape, name="housing", color=PRINTED_COLOUR), housing_step)

    assembly_step = folder / "assembly.step"
    assembly = assemble_sensor(sensor)
    export_step(assembly, assembly_step)

    stl_path, package_path = folder / "housing.stl", folder / "housing.3mf"
    mesh = _export_printed_shape(print_shape(sensor), stl_path, package_path, settings)

    assembly_glb = folder / "assembly.glb"
    assembly_glb.write_bytes(encode_glb(view_bodies(assembly)))

    paths = [housing_step, assembly_step, stl_path, package_path, assembly_glb]
    if sensor.housing.pin:
        pin_step = folder / "pin.step"
        pin = pin_solid(sensor.housing.pin, sensor.tips)
        export_step(cq.Assembly(pin, name="pin", color=STEEL_COLOUR), pin_step)
        paths.append(pin_step)
    return SensorFiles(paths=tuple(paths), forms=FormsRead(step=housing_read, stl=mesh))


def _export_printed_shape(
    shape: cq.Shape, stl_path: Path, package_path: Path, settings: Mapping[str, str] | None
) -> trimesh.Trimesh:
    """Write a housing in print pose [mm] as STL and as 3MF with slicer settings, and return the mesh in the STL file.

    Raises OSError if a file cannot be written, and ExportError if the volume read back is wrong.
    """
    # Both files hold the same triangles, so their volumes have the same expected value.
    expected_volume = triangles_volume(shape)
    mesh = _export_stl(shape, stl_path, expected_volume)
    write_3mf({"housing": mesh}, package_path, settings)
    compare_volume(package_path, read_3mf(package_path).mesh.volume, expected_volume)
    return mesh


def print_shape(sensor: SensorSolids) -> cq.Shape:
    """Return the housing of a sensor, or one of its two plates, in print pose with its engraving [mm]."""
    return print_pose(sensor.printed_part().shape, back_up=sensor.housing.back_to_back is not None)


def read_forms(folder: Path) -> FormsRead:
    """Read the shapes in housing.step and housing.stl. Raises ValueError if a file cannot be read."""
    return FormsRead(step=read_step(folder / "housing.step"), stl=read_stl(folder / "housing.stl"))


def view_bodies(assembly: cq.Assembly) -> list[GlbBody]:
    """Return the parts of an assembly as coarse triangles for a picture, and their displacements in the exploded view.

    Equal parts share one triangulation.
    """
    meshes: dict[cq.Shape, tuple[Floats, NDArray[np.int64]]] = {}
    bodies = []
    for part in assembly.children:
        shape = part.shapes[0]  # each part has one shape
        if shape not in meshes:
            # OCCT stores triangles in a shape, and would reuse finer ones of an earlier call. The copy has none.
            corners, triangle_corners = shape.copy().tessellate(_VIEW_CHORD_MM, _VIEW_ANGLE_RAD)
            meshes[shape] = np.array([corner.toTuple() for corner in corners]), np.array(triangle_corners)
        vertices, triangles = meshes[shape]
        # The first three columns of the matrix (3, 4) are the rotation, and the last column is the position.
        placement = location_matrix(part.loc)
        body = GlbBody(
            name=part.name,
            vertices=vertices @ placement[:, :3].T + placement[:, 3],
            triangles=triangles,
            colour=np.array(part_colour(part)),
            displacement=np.array([0.0, exploded_shift(part), 0.0]),  # the exploded view moves parts along y
        )
        bodies.append(body)
    return bodies


def export_step(assembly: cq.Assembly, path: Path) -> cq.Shape:
    """Write an assembly or a part [mm] as STEP, and return the shape read back.

    Raises OSError if the file cannot be written, and ExportError if the volume read back is wrong.
    """
    write_step(assembly, path)
    shape_read = read_step(path)
    compare_volume(path, volume_of(shape_read), step_volume(assembly.toCompound()))
    return shape_read


def volume_of(shape: cq.Shape) -> float:
    """Return the volume of a shape [mm^3]. Copies of the same solid in different positions are integrated only once."""
    return sum(_volume_at_origin(solid.located(cq.Location())) for solid in shape.Solids())


@functools.lru_cache(maxsize=64)
def _volume_at_origin(solid: cq.Shape) -> float:
    """Return the volume of a solid [mm^3].

    The CAD kernel OCCT integrates spheres and surfaces of revolution numerically. Without a tolerance, the relative
    error of the volume would be up to 1e-4.
    """
    if _has_revolved_face(solid):
        return float(solid.Volume(tol=_INTEGRAL_TOLERANCE))
    return float(solid.Volume())


def step_volume(shape: cq.Shape) -> Estimate:
    """Return the volume of a shape [mm^3] and its tolerance, for comparison with the volume in a STEP file."""
    volume = volume_of(shape)
    # Both volumes are integrated numerically if a face is revolved, so their errors add.
    relative = 2.0 * _INTEGRAL_TOLERANCE if _has_revolved_face(shape) else _STEP_TOLERANCE
    return Estimate(volume, volume * relative, unit="mm^3")


def _has_revolved_face(shape: cq.Shape) -> bool:
    """Return whether a face of a shape is a sphere or a surface of revolution."""
    return any(face.geomType() in _REVOLVED for face in shape.Faces())


def export_stl(shape: cq.Shape, path: Path) -> trimesh.Trimesh:
    """Write a shape [mm] as STL, and return the mesh read back.

    Raises OSError if the file cannot be written, and ExportError if the volume read back is wrong.
    """
    return _export_stl(shape, path, triangles_volume(shape))


def _export_stl(shape: cq.Shape, path: Path, expected: Estimate) -> trimesh.Trimesh:
    """Write a shape [mm] as STL, and return the mesh read back; `expected` is the result of `triangles_volume`."""
    write_stl(shape, path)
    mesh = read_stl(path)
    compare_volume(path, mesh.volume, expected)
    return mesh


def triangles_volume(shape: cq.Shape) -> Estimate:
    """Return the volume of a shape [mm^3] and its tolerance, for comparison with the volume in a mesh file.

    Triangles deviate from curved faces by at most the chord height, and vertices are rounded to single precision.
    """
    volume = float(shape.Volume())
    curved_area = sum(face.Area() for face in shape.Faces() if face.geomType() != "PLANE")
    return Estimate(volume, CHORD_MM * float(curved_area) + _SINGLE_PRECISION * volume, unit="mm^3")


def compare_volume(path: Path, volume_read: float, expected: Estimate) -> None:
    """Raise ExportError if the volume [mm^3] read back from a file differs from `expected` by more than its error."""
    if not abs(volume_read - expected.value) <= expected.error:  # also true if the volume read is NaN
        msg = (
            f"{path.name}: volume read back = {volume_read:.9g} mm^3: must be {expected.value:.9g} within "
            f"{expected.error:.2g} mm^3; export it again, because the disk may have been full"
        )
        raise ExportError(msg)
