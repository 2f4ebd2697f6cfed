"""The files of a sensor: STEP of housing and assembly, STL and 3MF in print pose; each read back and compared."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cadquery as cq

from cad.files.export_error import ExportError
from cad.files.step import read_step, write_step
from cad.files.stl import CHORD_MM, read_stl, write_stl
from cad.files.threemf import read_3mf, write_3mf
from cad.parts.assembly import assembly_bodies
from cad.parts.pose import print_pose
from cad.parts.sensor import Body, Sensor
from cad.triangles import Triangles

_STEP_TOLERANCE = 1e-9  # Part 21 carries 15 digits
_TURNED = ("SPHERE", "REVOLUTION")
_INTEGRAL_TOLERANCE = 1e-8  # relative, of a volume within a ball or a surface of revolution
_SINGLE_PRECISION = 1e-6  # of a coordinate in an STL, over the smallest side of a part


def write_sensor(sensor: Sensor, folder: Path) -> tuple[Path, ...]:
    """Write housing.step, assembly.step and, marked, housing.stl and housing.3mf; pin.step where pins are the tips.

    Raises OSError when a file cannot be written, ExportError when one read back has another volume.
    """
    names = ("housing.step", "assembly.step", "housing.stl", "housing.3mf")
    housing_step, assembly_step, housing_stl, model = (folder / name for name in names)
    export_step((sensor.housing_body(),), housing_step)
    export_step(assembly_bodies(sensor), assembly_step)
    printed = print_pose(sensor.printed_part().shape, back_up=sensor.housing.back_to_back)
    mesh = export_stl(printed, housing_stl)
    write_3mf({sensor.part.name: mesh}, model)
    compare_volume(model, read_3mf(model).mesh.volume, printed.Volume(), solid_tolerance(printed))
    return housing_step, assembly_step, housing_stl, model, *_write_pin(sensor, folder)


def _write_pin(sensor: Sensor, folder: Path) -> tuple[Path, ...]:
    """Write one of the two equal pins, standing on its touching face."""
    path, found = folder / "pin.step", sensor.pin_bodies()
    if not found:
        return ()
    shape = found[0].shape
    box = shape.BoundingBox()
    upright = shape.translate(cq.Vector(-box.center.x, 0.0, -box.zmin))
    export_step((replace(found[0], name="pin", shape=upright),), path)
    return (path,)


def export_step(bodies: Sequence[Body], path: Path) -> cq.Shape:
    """Write bodies [mm] as STEP, named for the file, and return what is read back.

    Raises OSError when it cannot be written, ExportError when it has another volume.
    """
    write_step(bodies, path, path.stem)
    found, written = read_step(path), cq.Compound.makeCompound([body.shape for body in bodies])
    volume = volume_of(written)
    share = 2.0 * _INTEGRAL_TOLERANCE if _is_turned(written) else _STEP_TOLERANCE
    compare_volume(path, volume_of(found), volume, share * volume)
    return found


def volume_of(shape: cq.Shape) -> float:
    """Return the volume of a shape [mm^3].

    The kernel integrates balls and surfaces of revolution numerically, and to 1e-4 only where it is not asked for more.
    """
    return float(shape.Volume(tol=_INTEGRAL_TOLERANCE) if _is_turned(shape) else shape.Volume())


def _is_turned(shape: cq.Shape) -> bool:
    return any(face.geomType() in _TURNED for face in shape.Faces())


def export_stl(shape: cq.Shape, path: Path) -> Triangles:
    """Write a shape [mm] as STL and return what is read back.

    Raises OSError when it cannot be written, ExportError when it has another volume.
    """
    write_stl(shape, path)
    found = read_stl(path)
    compare_volume(path, found.volume, shape.Volume(), solid_tolerance(shape))
    return found


def solid_tolerance(shape: cq.Shape) -> float:
    """Return what the volume of triangles may be off [mm^3]: a chord's height over the area of the round faces."""
    curved = sum(face.Area() for face in shape.Faces() if face.geomType() != "PLANE")
    return CHORD_MM * float(curved) + _SINGLE_PRECISION * float(shape.Volume())


def compare_volume(path: Path, found: float, expected: float, tolerance: float) -> None:
    """Raise ExportError when the volume [mm^3] read back from a file is not the expected one."""
    if not abs(found - expected) <= tolerance:
        msg = (
            f"{path.name}: volume read back = {found:.9g} mm^3: must be {expected:.9g} within {tolerance:.2g} mm^3; "
            "export again, the disk may be full"
        )
        raise ExportError(msg)
