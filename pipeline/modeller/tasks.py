"""What the process that models can do: measure the solid of a housing, write and check files, draw pictures."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from cad.checks.assembly_checks import cover_verdicts
from cad.checks.sensor_checks import check_sensor
from cad.checks.slicer import print_estimate
from cad.design.parameters import Design
from cad.design.processes import Process
from cad.drawing.sheet import Title
from cad.files.sensor_files import write_sensor
from cad.kernel import load_kernel
from cad.parts.assembly import sensor_of
from cad.parts.housing import Housing
from cad.parts.housing_solid import housing_part
from cad.parts.part import PartSize
from cad.workshop.bridges import Spring
from cad.workshop.maker_files import write_fabrication
from cad.workshop.mount_checks import mount_verdicts
from pipeline.modeller.kept_files import Inputs, Verdicts, Written, written_once
from pipeline.page.bodies import solid_pictures
from pipeline.page.solid_pictures import SolidPictures
from pipeline.storage.cache import cached

load_kernel()


def part_size(housing: Housing) -> PartSize:
    """Return volume, surface and areas of named faces of the solid of a housing [mm]."""
    return housing_part(housing).size


def solids(inputs: Inputs, design: Design, housing: Housing, deflections: tuple[float, ...], folder: Path) -> Verdicts:
    """Write STEP, STL and 3MF of a sensor into a folder, return the geometry verdicts; both kept by the inputs.

    The springs give by the deflections [mm]. Raises OSError or ExportError.
    """

    def write() -> Written:
        sensor = sensor_of(design, housing)
        return write_sensor(sensor, folder), check_sensor(sensor, deflections, folder)

    return written_once("solids", inputs, write, folder)


def maker_files(
    inputs: Inputs, design: Design, process: Process, housing: Housing, springs: Sequence[Spring], folder: Path
) -> Verdicts:
    """Write the files for fabrication beside housing.stl, return the verdicts on cover and bracket; kept by the inputs.

    Raises OSError or ExportError.
    """

    def write() -> Written:
        sensor = sensor_of(design, housing)
        estimate = print_estimate(folder / "housing.stl", process)
        title = Title(name=design.name, process=process)
        made = write_fabrication(sensor, title, springs, estimate, folder)
        return made.paths, (*cover_verdicts(sensor, made.cover, process), *mount_verdicts(sensor, made.mount, process))

    return written_once("maker files", inputs, write, folder)


def pictures(inputs: Inputs, design: Design, housing: Housing, folder: Path) -> SolidPictures:
    """Return the pictures of the part whose STL file the folder has, kept by the inputs."""
    return cached("pictures", inputs, lambda: solid_pictures(design, housing, folder), SolidPictures)


TASKS: dict[str, Callable[..., Any]] = {
    "part_size": part_size,
    "solids": solids,
    "maker_files": maker_files,
    "pictures": pictures,
}
"""By name, as they are asked for: whoever asks does not import them."""
