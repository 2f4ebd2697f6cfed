"""The solids of a sensor: files for fabrication, and the verdicts on their geometry."""

from pathlib import Path

from cad.checks import check_sensor
from cad.export import write_sensor
from cad.finding import Finding
from cad.housing import housing_part
from cad.parameters import Design
from cad.sensor import Sensor
from pipeline.springs import PrintedSprings


def write_solids(design: Design, springs: PrintedSprings, folder: Path) -> tuple[Finding, ...]:
    """Write STEP and STL into the folder and return the geometry findings; none where no housing could be made."""
    housing = springs.housing
    if housing is None:
        return ()
    sensor = Sensor(
        housing=housing, part=housing_part(housing), fruit=design.fruit, tips=design.tips, press=design.press
    )
    write_sensor(sensor, folder)
    return check_sensor(sensor, springs.deflections, folder)
