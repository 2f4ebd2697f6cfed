"""The files of a sensor: STEP of housing and assembly, STL and 3MF in print pose, each read back and compared; GLB."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cadquery as cq
import numpy as np
import trimesh

from cad.files.export_error import ExportError
from cad.files.glb import GlbBody, glb_of
from cad.files.step import read_step, write_step
from cad.files.stl import CHORD_MM, read_stl, triangles, write_stl
from cad.files.threemf import read_3mf, write_3mf
from cad.parts.assembly import assembly_bodies, outwards
from cad.parts.part import one_shape
from cad.parts.pose import print_pose
from cad.parts.sensor import NamedSolid, SensorSolids

_STEP_TOLERANCE = 1e-9  # relative: Part 21 carries 15 digits
_TURNED = ("SPHERE", "REVOLUTION")
_INTEGRAL_TOLERANCE = 1e-8  # relative, of a volume within a ball or a surface of revolution
_SHOWN_CHORD_MM = 0.1  # of what is only looked at
_SHOWN_ANGLE = 0.5  # rad
_SINGLE_PRECISION = 1e-6  # of a coordinate in an STL, over the smallest side of a part


def write_sensor(sensor: SensorSolids, folder: Path) -> tuple[Path, ...]:
    """Write housing.step, assembly.step and, marked, housing.stl and housing.3mf; pin.step where pins are the tips.

    With strips housing.* hold frame and shuttles, each by its name, and strips.step the strips of a plate in place.

    assembly.glb, to be looked at, has every body in its colour and an animation that takes them apart.

    Raises OSError when a file cannot be written, ExportError when one read back has another volume.
    """
    housing_step = folder / "housing.step"
    export_step(sensor.printed_bodies(), housing_step)

    assembly_step = folder / "assembly.step"
    bodies = assembly_bodies(sensor)
    export_step(bodies, assembly_step)

    marked = sensor.marked_shapes()
    printed = print_pose(one_shape(marked.values()), back_up=sensor.housing.back_to_back)
    stl = folder / "housing.stl"
    mesh = export_stl(printed, stl)

    package = folder / "housing.3mf"
    meshes = [mesh] if len(marked) == 1 else [triangles(solid) for solid in printed.Solids()]
    write_3mf(dict(zip(marked, meshes, strict=True)), package)
    compare_volume(package, read_3mf(package).mesh.volume, printed.Volume(), solid_tolerance(printed))

    assembly_glb = folder / "assembly.glb"
    assembly_glb.write_bytes(glb_of([shown_body(body) for body in bodies]))

    paths = [housing_step, assembly_step, stl, package, assembly_glb]
    if pins := sensor.pin_bodies():  # all are equal; one is written, standing on its touching face
        box = pins[0].shape.BoundingBox()
        upright = pins[0].shape.translate(cq.Vector(-box.center.x, 0.0, -box.zmin))
        paths.append(folder / "pin.step")
        export_step([replace(pins[0], name="pin", shape=upright)], paths[-1])
    if strips := sensor.strip_bodies():
        paths.append(folder / "strips.step")
        export_step(strips, paths[-1])
    return tuple(paths)


def shown_body(body: NamedSolid) -> GlbBody:
    """Return a body as triangles to be looked at, which the animation moves outwards."""
    vertices, triangles = body.shape.copy().tessellate(_SHOWN_CHORD_MM, _SHOWN_ANGLE)
    return GlbBody(
        name=body.name,
        vertices=np.array([vertex.toTuple() for vertex in vertices]),
        triangles=np.array(triangles),
        colour=np.array(body.colour),
        moved=np.array([0.0, outwards(body), 0.0]),
    )


def export_step(bodies: Sequence[NamedSolid], path: Path) -> cq.Shape:
    """Write bodies [mm] as STEP, named for the file, and return what is read back.

    Raises OSError when it cannot be written, ExportError when it has another volume.
    """
    write_step(bodies, path, path.stem)
    shape_read = read_step(path)
    shape = cq.Compound.makeCompound([body.shape for body in bodies])
    compare_volume(path, volume_of(shape_read), volume_of(shape), step_tolerance(shape))
    return shape_read


def volume_of(shape: cq.Shape) -> float:
    """Return the volume of a shape [mm^3].

    The kernel integrates balls and surfaces of revolution numerically, and to 1e-4 only where it is not asked for more.
    """
    return float(shape.Volume(tol=_INTEGRAL_TOLERANCE) if _is_turned(shape) else shape.Volume())


def step_tolerance(shape: cq.Shape) -> float:
    """Return the tolerance of the volume of a shape that is read back from STEP [mm^3]."""
    return volume_of(shape) * (2.0 * _INTEGRAL_TOLERANCE if _is_turned(shape) else _STEP_TOLERANCE)


def _is_turned(shape: cq.Shape) -> bool:
    return any(face.geomType() in _TURNED for face in shape.Faces())


def export_stl(shape: cq.Shape, path: Path) -> trimesh.Trimesh:
    """Write a shape [mm] as STL and return what is read back.

    Raises OSError when it cannot be written, ExportError when it has another volume.
    """
    write_stl(shape, path)
    mesh = read_stl(path)
    compare_volume(path, mesh.volume, shape.Volume(), solid_tolerance(shape))
    return mesh


def solid_tolerance(shape: cq.Shape) -> float:
    """Return the tolerance of the volume of triangles [mm^3]: a chord's height over the area of the round faces."""
    curved = sum(face.Area() for face in shape.Faces() if face.geomType() != "PLANE")
    return CHORD_MM * float(curved) + _SINGLE_PRECISION * float(shape.Volume())


def compare_volume(path: Path, volume_read: float, volume: float, tolerance: float) -> None:
    """Raise ExportError when the volume [mm^3] read back from a file is not that of the solid."""
    if not abs(volume_read - volume) <= tolerance:
        msg = (
            f"{path.name}: volume read back = {volume_read:.9g} mm^3: must be {volume:.9g} within {tolerance:.2g} "
            "mm^3; export again, the disk may be full"
        )
        raise ExportError(msg)
