"""PrusaSlicer and Slic3r take the part: manifold, one part each."""

import re
import shutil
import subprocess

import pytest
from deadline import DEADLINE_S

from cad.files.sensor_files import write_sensor


@pytest.fixture(scope="module")
def folder(sensor, tmp_path_factory):
    """Return a folder with the files of a sensor."""
    written = tmp_path_factory.mktemp("sensor")
    write_sensor(sensor, written)
    return written


@pytest.mark.slow
@pytest.mark.parametrize(
    ("slicer", "name"),
    [
        ("prusa-slicer", "housing.stl"),
        ("prusa-slicer", "housing.3mf"),
        ("prusa-slicer", "housing.step"),
        ("slic3r", "housing.stl"),
        ("slic3r", "housing.3mf"),  # Slic3r 1.3 refuses a 3MF with 64-bit sizes as empty
    ],
)
def test_slicer_finds_one_closed_part(folder, slicer, name):
    if shutil.which(slicer) is None:
        pytest.skip(f"{slicer} is not installed")
    command = [slicer, "--info", str(folder / name)]
    info = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=DEADLINE_S, check=True).stdout
    assert re.findall(r"^manifold\s*=\s*(\w+)", info, flags=re.MULTILINE) == ["yes"]
    assert re.findall(r"^number_of_parts\s*=\s*(\d+)", info, flags=re.MULTILINE) == ["1"]
