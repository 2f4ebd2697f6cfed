"""What the process that models can do: measure the solid of a housing, write and check files, draw pictures.

The first task waits for the kernel alone: what each other one needs beside it is imported when it comes, or while
nothing is asked.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cad.design.parameters import Design
from cad.design.processes import Process
from cad.parts.housing import Housing, PartSize
from cad.parts.housing_solid import housing_part
from pipeline.storage.cache import cached
from pipeline.storage.modeller.kept_files import Inputs, Verdicts

if TYPE_CHECKING:
    from cad.fabrication.bridges import Spring
    from pipeline.report.page.solid_pictures import SolidPictures


def part_size(housing: Housing) -> PartSize:
    """Return volume, surface and areas of named faces of the solid of a housing [mm]."""
    return housing_part(housing).size


def solids(inputs: Inputs, design: Design, housing: Housing, deflections: tuple[float, ...], folder: Path) -> Verdicts:
    """Write STEP, STL and 3MF of a sensor into a folder, return the geometry verdicts; both kept by the inputs.

    The springs give by the deflections [mm]. Raises OSError or ExportError.
    """
    from pipeline.storage.modeller.sensor_files import solids_once

    return solids_once(inputs, design, housing, deflections, folder)


def fabrication_files(
    inputs: Inputs, design: Design, process: Process, housing: Housing, springs: "Sequence[Spring]", folder: Path
) -> Verdicts:
    """Write the files for fabrication beside housing.stl, return the verdicts on cover and bracket; kept by the inputs.

    Raises OSError or ExportError.
    """
    from pipeline.storage.modeller.fabrication_files import maker_files_once

    return maker_files_once(inputs, design, process, housing, springs, folder)


def pictures(inputs: Inputs, design: Design, housing: Housing, folder: Path) -> "SolidPictures":
    """Return the pictures of the part whose STL file the folder has, kept by the inputs."""
    from pipeline.report.page.bodies import solid_pictures
    from pipeline.report.page.solid_pictures import SolidPictures

    return cached("pictures", inputs, lambda: solid_pictures(design, housing, folder), SolidPictures)


def get_ready() -> None:
    """Import what every run needs beside the kernel."""
    from pipeline.report.page.bodies import solid_pictures  # noqa: F401
    from pipeline.storage.modeller.sensor_files import solids_once  # noqa: F401


TASKS: dict[str, Callable[..., Any]] = {
    "part_size": part_size,
    "solids": solids,
    "fabrication_files": fabrication_files,
    "pictures": pictures,
}
"""By name, as they are asked for: whoever asks does not import them."""
