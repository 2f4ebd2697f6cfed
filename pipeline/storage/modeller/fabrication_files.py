"""What a maker needs beside the part, as files, and the verdicts on cover and bracket."""

from collections.abc import Sequence
from pathlib import Path

from cad.checks.assembly_checks import cover_verdicts
from cad.design.parameters import Design
from cad.design.processes import Process
from cad.drawing.sheet import Title
from cad.fabrication.bridges import Spring
from cad.fabrication.fabrication_files import write_fabrication
from cad.fabrication.mount_checks import mount_verdicts
from cad.parts.assembly import sensor_of
from cad.parts.housing import Housing
from pipeline.storage.modeller.kept_files import Inputs, Verdicts, Written, written_once


def maker_files_once(
    inputs: Inputs, design: Design, process: Process, housing: Housing, springs: Sequence[Spring], folder: Path
) -> Verdicts:
    """Write the files for fabrication beside housing.stl [mm], return the verdicts on cover and bracket.

    Both are kept by the inputs. Raises OSError or ExportError.
    """

    def write() -> Written:
        sensor = sensor_of(design, housing)
        title = Title(name=design.name, process=process)
        made = write_fabrication(sensor, title, springs, folder)
        return made.paths, (*cover_verdicts(sensor, made.cover, process), *mount_verdicts(sensor, made.mount, process))

    return written_once("maker files", inputs, write, folder)
