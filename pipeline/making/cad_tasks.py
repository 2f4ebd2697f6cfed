"""What a worker does with the CAD kernel for a run: files of solids and fabrication.

Each task imports what it needs when it is called: the process that asks for it needs no kernel.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from cad.parts.housing import Housing
from pipeline.storage.kept_files import Inputs, Verdicts, Written, written_once
from sensor.design.parameters import Design
from sensor.design.processes import Process

if TYPE_CHECKING:
    from cad.fabrication.bridges import SpringReadOut


def write_solids(
    inputs: Inputs, design: Design, housing: Housing, deflections: tuple[float, ...], folder: Path
) -> Verdicts:
    """Write STEP, STL and 3MF of a sensor whose springs deflect by so much [mm]; return the geometry verdicts.

    Both are kept by the inputs. Raises OSError or ExportError.
    """
    from cad.checks.sensor_checks import check_sensor
    from cad.files.sensor_files import write_sensor
    from cad.parts.assembly import sensor_of

    def write() -> Written:
        sensor = sensor_of(design, housing)
        return write_sensor(sensor, folder), check_sensor(sensor, deflections, folder)

    return written_once("solids", inputs, write, folder)


def write_fabrication_files(
    inputs: Inputs, design: Design, housing: Housing, read_out: "SpringReadOut", folder: Path
) -> Verdicts:
    """Write the files for fabrication beside housing.stl [mm], return the verdicts on cover and bracket.

    Both are kept by the inputs. Raises OSError or ExportError.
    """
    from cad.checks.assembly_checks import cover_verdicts
    from cad.drawing.sheet import Title
    from cad.fabrication.fabrication_files import write_fabrication
    from cad.fabrication.mount_checks import mount_verdicts
    from cad.parts.assembly import sensor_of

    process: Process = design.process

    def write() -> Written:
        sensor = sensor_of(design, housing)
        title = Title(name=design.name, process=process)
        files = write_fabrication(sensor, title, read_out, folder, design.readout)
        cover = cover_verdicts(sensor, files.cover, process)
        return files.paths, (*cover, *mount_verdicts(sensor, files.mount, process))

    return written_once("maker files", inputs, write, folder)
