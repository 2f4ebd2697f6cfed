"""The solids of a sensor: files for fabrication, and the verdicts on their geometry."""

import base64
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

from cad.checks.sensor_checks import check_sensor
from cad.design.design_file import design_as_mapping
from cad.design.parameters import Design
from cad.files.sensor_files import write_sensor
from cad.parts.housing import Housing, housing_part
from cad.parts.pin_socket import socketed
from cad.parts.sensor import Sensor
from cad.verdict import Verdict
from pipeline.stages.springs import PrintedSprings
from pipeline.storage.cache import remembered

_SHAPES = ("name", "fruit", "tips", "press")  # tables that solids and their checks depend on


def sensor_of(design: Design, housing: Housing) -> Sensor:
    """Return the sensor of a design with this housing."""
    part = socketed(housing_part(housing), housing)
    return Sensor(
        housing=housing, part=part, fruit=design.fruit, tips=design.tips, press=design.press, name=design.name
    )


def write_solids(design: Design, springs: PrintedSprings, folder: Path) -> tuple[Verdict, ...]:
    """Write STEP, STL and 3MF into the folder and return the geometry findings; none where no housing can be made.

    Files are the same bytes every time, so those of an earlier run are written again. Raises OSError or ExportError.
    """
    housing = springs.housing
    if housing is None:
        return ()

    def made() -> dict[str, Any]:
        sensor = sensor_of(design, housing)
        written = write_sensor(sensor, folder)
        findings = check_sensor(sensor, springs.deflections, folder)
        return {
            "files": {path.name: base64.b85encode(path.read_bytes()).decode() for path in written},
            "findings": [asdict(finding) for finding in findings],
        }

    inputs = {
        "design": {key: value for key, value in design_as_mapping(design).items() if key in _SHAPES},
        "housing": asdict(housing),
        "deflections": springs.deflections,
        "date": os.environ.get("SOURCE_DATE_EPOCH"),
    }
    found = remembered("solids", inputs, made)
    for name, text in found["files"].items():
        (folder / name).write_bytes(base64.b85decode(text))
    return tuple(Verdict(**finding) for finding in found["findings"])
