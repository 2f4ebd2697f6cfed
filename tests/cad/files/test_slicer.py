"""PrusaSlicer and Slic3r take the part: manifold, one part each."""

import re
import shutil
import subprocess

import pytest
from deadline import DEADLINE_S

from cad.files.sensor_files import write_sensor


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("prusa-slicer") is None, reason="prusa-slicer is not installed")
@pytest.mark.parametrize("name", ["housing.stl", "housing.3mf", "housing.step"])
def test_slicer_finds_one_closed_part(sensor, tmp_path, name):
    write_sensor(sensor, tmp_path)
    check_one_closed_part("prusa-slicer", tmp_path / name)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("slic3r") is None, reason="slic3r is not installed")
@pytest.mark.parametrize("name", ["housing.stl", "housing.3mf"])
def test_old_slicer_finds_one_closed_part(sensor, tmp_path, name):
    """Slic3r 1.3 refuses a 3MF with 64-bit sizes as empty."""
    write_sensor(sensor, tmp_path)
    check_one_closed_part("slic3r", tmp_path / name)


def check_one_closed_part(slicer, path):
    command = [slicer, "--info", str(path)]
    info = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=DEADLINE_S, check=True).stdout
    assert re.findall(r"^manifold\s*=\s*(\w+)", info, flags=re.MULTILINE) == ["yes"]
    assert re.findall(r"^number_of_parts\s*=\s*(\d+)", info, flags=re.MULTILINE) == ["1"]
