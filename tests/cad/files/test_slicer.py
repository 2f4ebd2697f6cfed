"""PrusaSlicer takes the part: manifold, one part each."""

import re
import shutil
import subprocess

import pytest

from cad.files.sensor_files import write_sensor


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("prusa-slicer") is None, reason="prusa-slicer is not installed")
@pytest.mark.parametrize("name", ["housing.stl", "housing.3mf", "housing.step"])
def test_slicer_finds_one_closed_part(sensor, tmp_path, name):
    write_sensor(sensor, tmp_path)
    command = ["prusa-slicer", "--info", str(tmp_path / name)]
    info = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=120, check=True).stdout
    assert re.findall(r"^manifold\s*=\s*(\w+)", info, flags=re.MULTILINE) == ["yes"]
    assert re.findall(r"^number_of_parts\s*=\s*(\d+)", info, flags=re.MULTILINE) == ["1"]
