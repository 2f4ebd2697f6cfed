"""Geometry verdicts on a sensor together with the files written from it."""

from pathlib import Path

import cadquery as cq

from cad.checks.assembly_checks import plate_verdicts
from cad.checks.clearance import clearance_verdicts, stop_verdicts
from cad.checks.leaf_section import fillet_verdict, leaf_thickness_verdicts
from cad.checks.line_probe import Lines, mesh_lines, solid_lines
from cad.checks.part_checks import check_solid, existing_file
from cad.checks.seat_checks import pocket_verdicts
from cad.checks.tip_checks import socket_verdicts, tip_verdict
from cad.checks.triangle_checks import closed_verdicts
from cad.files.sensor_files import FormsRead, read_forms, step_volume, triangles_volume, volume_of
from cad.files.step import read_step
from cad.files.threemf import read_3mf
from cad.parts.assembly import assembly_bodies
from cad.parts.pose import sensor_pose
from cad.parts.sensor import SensorSolids
from sensor.verdict import Verdict, equal, unreadable

ROUND_TRIP_TOLERANCE = 1e-9  # Part 21 carries 15 digits


def check_sensor(sensor: SensorSolids, deflections: tuple[float, ...], folder: Path) -> tuple[Verdict, ...]:
    """Return every geometry verdict on a sensor and on housing.step and housing.stl in a folder.

    The deflections [mm] of low and high spring are those at full
    travel. Raises FileNotFoundError; a file that cannot be read fails geometry.readable.
    """
    for name in ("housing.step", "housing.stl"):
        existing_file(folder / name)
    try:
        forms = read_forms(folder)
    except ValueError as error:
        return (*_solid_verdicts(sensor), unreadable(str(error)))
    return sensor_verdicts(sensor, deflections, forms)


def sensor_verdicts(sensor: SensorSolids, deflections: tuple[float, ...], read: FormsRead) -> tuple[Verdict, ...]:
    """Return every geometry verdict on a sensor and on what was read of its files, as `check_sensor`."""
    shape = sensor.part.shape
    step = read.step
    stl = sensor_pose(read.stl, sensor.housing.depth, back_up=sensor.housing.back_to_back)
    forms: dict[str, Lines] = {"solid": solid_lines(shape), "STEP": solid_lines(step), "STL": mesh_lines(stl)}
    return (
        *_solid_verdicts(sensor),
        *closed_verdicts(stl),
        _round_trip(shape, step),
        *leaf_thickness_verdicts(sensor.housing, forms),
        fillet_verdict(sensor.housing, forms),
        tip_verdict(sensor.part, sensor.housing),
        *socket_verdicts(sensor.part, sensor.housing, sensor.tips),
        *pocket_verdicts(sensor),
        *clearance_verdicts(sensor),
        *stop_verdicts(sensor, deflections),
        *plate_verdicts(sensor),
    )


def _solid_verdicts(sensor: SensorSolids) -> tuple[Verdict, ...]:
    return check_solid(sensor.part.shape)


def _round_trip(shape: cq.Shape, step: cq.Shape) -> Verdict:
    """Return geometry.step_round_trip: relative change of the volume from the solid to the file read back."""
    volume = volume_of(shape)
    change = volume_of(step) / volume - 1.0
    reference = f"volume of housing.step against the solid, {volume:.6f} mm^3"
    return equal("geometry.step_round_trip", change, 0.0, ROUND_TRIP_TOLERANCE, unit="1", reference=reference)


def volume_verdict(sensor: SensorSolids, folder: Path) -> Verdict:
    """Return geometry.same_volume: how far housing.3mf and assembly.step are off the volume of a sensor's solids.

    In tolerances of the file [1], the larger one. Raises ValueError for a file that cannot be read.
    """
    printed = triangles_volume(sensor.printed_part().shape)
    assembly = step_volume(cq.Compound.makeCompound([body.shape for body in assembly_bodies(sensor)]))
    off_3mf = read_3mf(folder / "housing.3mf").mesh.volume - printed.value
    off_step = volume_of(read_step(folder / "assembly.step")) - assembly.value
    value = max(abs(off_3mf) / printed.error, abs(off_step) / assembly.error)
    reference = (
        f"against the solids of report.json: housing.3mf {off_3mf:+.3g} mm^3, assembly.step {off_step:+.3g} mm^3; the "
        "larger in tolerances of its file"
    )
    return equal("geometry.same_volume", value, 0.0, 1.0, unit="1", reference=reference)
