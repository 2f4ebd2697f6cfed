"""The files of a sensor: STEP of the housing and of the assembly, STL in print pose; each read back and compared.

Print pose: the plate lies flat on z = 0 with the face y = -depth / 2 up, x stays, what was z points along y.
"""

from pathlib import Path

import cadquery as cq
import numpy as np
import trimesh

from cad.sensor import Sensor
from cad.step import read_step, write_step
from cad.stl import CHORD_MM, read_stl, write_stl

_STEP_TOLERANCE = 1e-9  # Part 21 carries 15 digits
_QUARTER_TURN = -90.0


class ExportError(ValueError):
    """A file that does not hold what was written; the message is one line."""


def print_pose(shape: cq.Shape) -> cq.Shape:
    """Return a shape of the sensor frame [mm] as it lies on the print bed."""
    turned = shape.rotate(cq.Vector(0.0, 0.0, 0.0), cq.Vector(1.0, 0.0, 0.0), _QUARTER_TURN)
    return turned.translate(cq.Vector(0.0, 0.0, -turned.BoundingBox().zmin))


def sensor_pose(mesh: trimesh.Trimesh, depth: float) -> trimesh.Trimesh:
    """Return triangles on the print bed [mm] as they stand in the sensor frame, for a plate of the given depth [mm]."""
    back = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.5 * depth], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    return mesh.copy().apply_transform(back)


def write_sensor(sensor: Sensor, folder: Path) -> tuple[Path, ...]:
    """Write housing.step, housing.stl and assembly.step and return their paths.

    Raises OSError when a file cannot be written, ExportError when one read back has another volume.
    """
    housing_step, housing_stl, assembly_step = (
        folder / name for name in ("housing.step", "housing.stl", "assembly.step")
    )
    bodies = sensor.bodies()
    volume = sensor.part.shape.Volume()
    write_step(bodies[:1], housing_step, "housing")
    _compare(housing_step, read_step(housing_step).Volume(), volume, _STEP_TOLERANCE * volume)
    write_step(bodies, assembly_step, "assembly")
    whole = sum(body.shape.Volume() for body in bodies)
    _compare(assembly_step, read_step(assembly_step).Volume(), whole, _STEP_TOLERANCE * whole)
    write_stl(print_pose(sensor.part.shape), housing_stl)
    _compare(housing_stl, float(read_stl(housing_stl).volume), volume, CHORD_MM * _curved_area(sensor.part.shape))
    return housing_step, housing_stl, assembly_step


def _curved_area(shape: cq.Shape) -> float:
    """Return the area [mm^2] of the faces that triangles cannot follow."""
    return sum(face.Area() for face in shape.Faces() if face.geomType() != "PLANE") + 1e-3


def _compare(path: Path, found: float, expected: float, tolerance: float) -> None:
    if not abs(found - expected) <= tolerance:
        msg = (
            f"{path.name}: volume read back = {found:.9g} mm^3: must be {expected:.9g} within {tolerance:.2g} mm^3; "
            "export again, the disk may be full"
        )
        raise ExportError(msg)
