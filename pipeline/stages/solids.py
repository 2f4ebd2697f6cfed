"""The solids of a sensor: files of the part and of the part over its fruit, and the verdicts on their geometry."""

import base64
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from cad.checks.sensor_checks import check_sensor
from cad.design.design_file import design_as_mapping
from cad.design.parameters import Design
from cad.files.sensor_files import write_sensor
from cad.parts.assembly import finished_part
from cad.parts.housing import Housing
from cad.parts.sensor import Sensor
from cad.verdict import Verdict, failed
from pipeline.stages.springs import FittedSprings
from pipeline.storage.cache import cached

NO_LINE = failed(
    "geometry.layout",
    "pair or square",
    unit="1",
    reference="no housing is drawn for a line of three; its contact and response are those of the springs asked for",
)
Verdicts = tuple[Verdict, ...]
Written = tuple[tuple[Path, ...], Verdicts]
"""The files that were written, and the verdicts on them."""
_SHAPES = ("name", "fruit", "tips", "press")  # tables that solids and their checks depend on


@dataclass(frozen=True, kw_only=True)
class Solids:
    """Files by name, as text in base 64, and the verdicts on them."""

    files: dict[str, str]
    verdicts: tuple[Verdict, ...]


def sensor_of(design: Design, housing: Housing) -> Sensor:
    """Return the sensor of a design with this housing."""
    part = finished_part(housing)
    return Sensor(
        housing=housing, part=part, fruit=design.fruit, tips=design.tips, press=design.press, name=design.name
    )


def write_solids(design: Design, springs: FittedSprings, folder: Path) -> tuple[Verdict, ...]:
    """Write STEP, STL and 3MF into the folder and return the geometry verdicts; none where no housing can be made.

    A line of three has no housing, which fails geometry.layout.

    Files are the same bytes every time, so those of an earlier run are written again. Raises OSError or ExportError.
    """
    housing = springs.housing
    if design.tips.layout == "line":
        return (NO_LINE,)
    if housing is None:
        return ()
    inputs = {
        "design": {key: value for key, value in design_as_mapping(design).items() if key in _SHAPES},
        "housing": housing,
        "deflections": springs.deflections,
    }
    return written_once("solids", inputs, lambda: _written(design, housing, springs.deflections, folder), folder)


def written_once(stage: str, inputs: Mapping[str, object], write: Callable[[], Written], folder: Path) -> Verdicts:
    """Return the verdicts of a stage that writes files into a folder, both kept by its inputs and the date of files."""

    def solids() -> Solids:
        paths, verdicts = write()
        files = {path.name: base64.b64encode(path.read_bytes()).decode() for path in paths}
        return Solids(files=files, verdicts=verdicts)

    found = cached(stage, {**inputs, "date": os.environ.get("SOURCE_DATE_EPOCH")}, solids, Solids)
    for name, text in found.files.items():
        (folder / name).write_bytes(base64.b64decode(text))
    return found.verdicts


def _written(design: Design, housing: Housing, deflections: tuple[float, ...], folder: Path) -> Written:
    sensor = sensor_of(design, housing)
    return write_sensor(sensor, folder), check_sensor(sensor, deflections, folder)
