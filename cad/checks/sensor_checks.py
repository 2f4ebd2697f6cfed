"""All geometry verdicts on a sensor and on the files written from it."""

from pathlib import Path

from cad.checks.assembly_checks import plate_verdicts
from cad.checks.clearance import clearance_verdicts, stop_verdicts
from cad.checks.leaf_section import leaf_thickness_verdicts
from cad.checks.line_probe import LineProbe, mesh_probe, solid_probe
from cad.checks.part_checks import check_solid, require_file
from cad.checks.seat_checks import pocket_verdicts
from cad.checks.triangle_checks import closed_verdicts
from cad.files.sensor_files import FormsRead, read_forms
from cad.parts.pose import sensor_pose
from cad.parts.sensor import SensorSolids
from sensor.verdict import READABLE, Verdict, judge


def check_sensor(sensor: SensorSolids, deflections: tuple[float, ...], folder: Path) -> tuple[Verdict, ...]:
    """Return every geometry verdict on a sensor, and on the files housing.step and housing.stl in a folder.

    `deflections` [mm] are the deflections of the low and the high spring at full travel. If a file cannot be read, only
    the verdicts on the solid and the failed verdict geometry.readable are returned. Raises FileNotFoundError if one of
    the files is missing.
    """
    for name in ("housing.step", "housing.stl"):
        require_file(folder / name)
    try:
        forms = read_forms(folder)
    except ValueError as error:
        return (*_solid_verdicts(sensor), judge(READABLE, None, str(error)))
    return sensor_verdicts(sensor, deflections, forms)


def sensor_verdicts(sensor: SensorSolids, deflections: tuple[float, ...], files: FormsRead) -> tuple[Verdict, ...]:
    """Return every geometry verdict on a sensor; `files` holds the shapes that were read from its files.

    `deflections` [mm] are the deflections of the low and the high spring at full travel.
    """
    shape = sensor.part.shape
    step = files.step
    # The STL file is in print pose. A plate that is mounted back to back with another is printed with its back up.
    stl = sensor_pose(files.stl, sensor.housing.depth, back_up=sensor.housing.back_to_back is not None)
    forms: dict[str, LineProbe] = {"solid": solid_probe(shape), "STEP": solid_probe(step), "STL": mesh_probe(stl)}
    return (
        *_solid_verdicts(sensor),
        *closed_verdicts(stl),
        *leaf_thickness_verdicts(sensor.housing, forms),
        *pocket_verdicts(sensor),
        *clearance_verdicts(sensor),
        *stop_verdicts(sensor, deflections),
        *plate_verdicts(sensor),
    )


def _solid_verdicts(sensor: SensorSolids) -> tuple[Verdict, ...]:
    """Return the verdicts on the solid of a sensor, which do not depend on its files."""
    return check_solid(sensor.part.shape)
