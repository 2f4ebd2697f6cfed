"""Geometry verdicts on a sensor together with the files written from it."""

from pathlib import Path

import cadquery as cq

from cad.checks.assembly_checks import plate_verdicts
from cad.checks.clearance import clearance_verdicts, stop_verdicts
from cad.checks.leaf_section import fillet_verdict, leaf_thickness_verdicts
from cad.checks.line_probe import Lines, mesh_lines, solid_lines
from cad.checks.part_checks import check_solid, existing_file
from cad.checks.seat_checks import pocket_verdicts
from cad.checks.strip_checks import stop_strain_verdicts, strip_verdicts
from cad.checks.tip_checks import socket_verdicts, tip_verdict
from cad.checks.triangle_checks import closed_verdicts
from cad.files.sensor_files import solid_tolerance, step_tolerance, volume_of
from cad.files.step import read_step
from cad.files.stl import read_stl
from cad.files.threemf import read_3mf
from cad.parts.assembly import assembly_bodies
from cad.parts.part import one_shape
from cad.parts.pose import sensor_pose
from cad.parts.sensor import SensorSolids
from sensor.verdict import Verdict, equal, unreadable

ROUND_TRIP_TOLERANCE = 1e-9  # Part 21 carries 15 digits


def check_sensor(sensor: SensorSolids, deflections: tuple[float, ...], folder: Path) -> tuple[Verdict, ...]:
    """Return every geometry verdict on a sensor and on housing.step and housing.stl in a folder.

    With leaves of sheet strips.step is measured too. The deflections [mm] of low and high spring are those at full
    travel. Raises FileNotFoundError; a file that cannot be read fails geometry.readable.
    """
    bodies = sensor.printed_bodies()
    shape = one_shape(body.shape for body in bodies)
    solid = check_solid(shape, len(bodies))
    step_path, stl_path = (existing_file(folder / name) for name in ("housing.step", "housing.stl"))
    strips_path = None if sensor.sheet is None else existing_file(folder / "strips.step")
    try:
        step = read_step(step_path)
        printed = read_stl(stl_path)
        strips = None if strips_path is None else read_step(strips_path)
    except ValueError as error:
        return (*solid, unreadable(str(error)))
    stl = sensor_pose(printed, sensor.housing.depth, back_up=sensor.housing.back_to_back)
    forms: dict[str, Lines] = {"solid": solid_lines(shape), "STEP": solid_lines(step), "STL": mesh_lines(stl)}
    leaves = forms if strips is None else {"solid": solid_lines(sensor.part.shape), "STEP": solid_lines(strips)}
    stops = stop_verdicts(sensor, deflections)
    return (
        *solid,
        *closed_verdicts(stl),
        _round_trip(shape, step),
        *leaf_thickness_verdicts(sensor.housing, leaves),
        fillet_verdict(sensor.housing, forms),
        tip_verdict(sensor.part, sensor.housing),
        *socket_verdicts(sensor.part, sensor.housing, sensor.tips),
        *pocket_verdicts(sensor),
        *clearance_verdicts(sensor),
        *stops,
        *plate_verdicts(sensor),
        *(() if strips is None else strip_verdicts(sensor, strips, forms, deflections)),
        *stop_strain_verdicts(sensor, stops),
    )


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
    printed = one_shape(sensor.marked_shapes().values())
    assembly = cq.Compound.makeCompound([body.shape for body in assembly_bodies(sensor)])
    off_3mf = read_3mf(folder / "housing.3mf").mesh.volume - printed.Volume()
    off_step = volume_of(read_step(folder / "assembly.step")) - volume_of(assembly)
    value = max(abs(off_3mf) / solid_tolerance(printed), abs(off_step) / step_tolerance(assembly))
    reference = (
        f"against the solids of report.json: housing.3mf {off_3mf:+.3g} mm^3, assembly.step {off_step:+.3g} mm^3; the "
        "larger in tolerances of its file"
    )
    return equal("geometry.same_volume", value, 0.0, 1.0, unit="1", reference=reference)
