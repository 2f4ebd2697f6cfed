"""Tasks that need the CAD kernel: they write the solids and the files for fabrication, and check them.

Each function imports the kernel when it is called, so that a process that only submits the task does not load it.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from cad.parts.housing import Housing
from pipeline.storage.kept_files import Written
from sensor.design.parameters import Design

if TYPE_CHECKING:
    from sensor.design.signal_path import SpringReadOut


def write_solids(design: Design, housing: Housing, deflections: tuple[float, ...], folder: Path) -> Written:
    """Write the STEP, STL, 3MF and GLB files of a sensor to `folder`; return their paths and the geometry verdicts.

    `deflections` [mm] are the deflections of the low and the high spring at full travel. The verdicts on the stops
    depend on them. Raises OSError if a file cannot be written, and ExportError if the volume read back from it is
    wrong.
    """
    from cad.checks.sensor_checks import sensor_verdicts
    from cad.fabrication.file_shapes import HOUSING_FILES, files_as_designed
    from cad.files.sensor_files import write_sensor
    from cad.files.slicer_settings import slicer_settings
    from cad.parts.assembly import draw_sensor

    sensor = draw_sensor(design, housing)
    files = write_sensor(sensor, folder, slicer_settings(design.process, housing))
    verdicts = sensor_verdicts(sensor, deflections, files.forms)
    return files.paths, (*verdicts, files_as_designed(sensor, folder, HOUSING_FILES))


def write_fabrication_files(design: Design, housing: Housing, read_out: "SpringReadOut", folder: Path) -> Written:
    """Write the files for fabrication to `folder`; return their paths and the verdicts on cover and bracket.

    The verdicts judge the shapes read back from cover.step and mount.step, so that the files themselves are checked.
    `read_out` describes how the springs are read and calibrated. Raises OSError if a file cannot be written, and
    ExportError if the volume read back from it is wrong.
    """
    from cad.checks.assembly_checks import cover_verdicts
    from cad.drawing.sheet import Title
    from cad.fabrication.fabrication_files import write_fabrication
    from cad.fabrication.mount_checks import mount_verdicts
    from cad.parts.assembly import draw_sensor

    process = design.process
    sensor = draw_sensor(design, housing)
    title = Title(name=design.name, process=process)
    files = write_fabrication(sensor, title, read_out, folder)
    verdicts_on_cover = cover_verdicts(sensor, files.cover, process)
    return files.paths, (*verdicts_on_cover, *mount_verdicts(sensor, files.mount, process))
