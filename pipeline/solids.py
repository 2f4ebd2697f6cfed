"""The solids of a sensor: files for fabrication, and the verdicts on their geometry."""

from pathlib import Path

from cad.checks import check_sensor
from cad.export import write_sensor
from cad.finding import Finding
from cad.housing import Housing, housing_part
from cad.parameters import Design
from cad.sensor import Sensor
from pipeline.springs import PrintedSprings


def sensor_of(design: Design, housing: Housing) -> Sensor:
    """Return the sensor of a design with this housing."""
    part = housing_part(housing)
    return Sensor(
        housing=housing, part=part, fruit=design.fruit, tips=design.tips, press=design.press, name=design.name
    )


def write_solids(design: Design, springs: PrintedSprings, folder: Path) -> tuple[Finding, ...]:
    """Write STEP, STL and 3MF into the folder and return the geometry findings; none where no housing can be made.

    Raises OSError or ExportError.
    """
    if springs.housing is None:
        return ()
    sensor = sensor_of(design, springs.housing)
    write_sensor(sensor, folder)
    return check_sensor(sensor, springs.deflections, folder)
