"""The solids of a sensor as files, and the verdicts on their geometry."""

from pathlib import Path

from cad.checks.sensor_checks import check_sensor
from cad.design.parameters import Design
from cad.files.sensor_files import write_sensor
from cad.parts.assembly import sensor_of
from cad.parts.housing import Housing
from pipeline.storage.modeller.kept_files import Inputs, Verdicts, Written, written_once


def solids_once(
    inputs: Inputs, design: Design, housing: Housing, deflections: tuple[float, ...], folder: Path
) -> Verdicts:
    """Write STEP, STL and 3MF of a sensor whose springs give by the deflections [mm]; return the geometry verdicts.

    Both are kept by the inputs. Raises OSError or ExportError.
    """

    def write() -> Written:
        sensor = sensor_of(design, housing)
        return write_sensor(sensor, folder), check_sensor(sensor, deflections, folder)

    return written_once("solids", inputs, write, folder)
