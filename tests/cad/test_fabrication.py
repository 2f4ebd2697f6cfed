import hashlib
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

from cad.checks import check_file
from cad.coupon import coupon_of, modulus_factor
from cad.drawing import Title
from cad.export import write_sensor
from cad.fabrication import fabrication_sheet, write_fabrication
from cad.materials import PROCESSES

ROOT = Path(__file__).parents[2]
TITLE = Title(name="paper", process=PROCESSES["fdm-petg"])
FILES = ["housing.step", "assembly.step", "housing.stl", "housing.3mf"]
SHEETS = ["drawing.dxf", "drawing.svg", "coupon.step", "coupon.stl", "fabrication.md"]
AGAIN = """
import sys
from dataclasses import replace
from pathlib import Path
from cad.drawing import Title
from cad.export import write_sensor
from cad.fabrication import write_fabrication
from cad.flexure import Flexure
from cad.housing import Housing, housing_part
from cad.materials import PROCESSES
from cad.parameters import Fruit, Press, Tips
from cad.sensor import Sensor
sensor_housing = eval(sys.argv[2])
sensor = Sensor(
    housing=sensor_housing, part=housing_part(sensor_housing), fruit=Fruit(), tips=Tips(), press=Press(), name="paper"
)
write_sensor(sensor, Path(sys.argv[1]))
write_fabrication(sensor, Title(name="paper", process=PROCESSES["fdm-petg"]), Path(sys.argv[1]))
"""


def digests(folder):
    return {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in (*FILES, *SHEETS)}


def test_same_bytes_in_another_process_and_folder(sensor, tmp_path):
    here, there = tmp_path / "here", tmp_path / "over there"
    here.mkdir()
    there.mkdir()
    named = replace(sensor, name="paper")
    written = (*write_sensor(named, here), *write_fabrication(named, TITLE, here))
    assert [path.name for path in written] == [*FILES, *SHEETS]
    environment = {**os.environ, "PYTHONHASHSEED": "11", "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", AGAIN, str(there), repr(sensor.housing)]
    subprocess.run(command, env=environment, cwd=tmp_path, check=True)
    assert digests(here) == digests(there)


def test_coupon_and_3mf_pass_their_own_check(sensor, tmp_path, monkeypatch):
    monkeypatch.setattr("cad.slicer.NAME", "a-slicer-that-nobody-has")
    write_sensor(sensor, tmp_path)
    write_fabrication(sensor, TITLE, tmp_path)
    for name in ("housing.3mf", "coupon.stl", "coupon.step"):
        assert [finding.name for finding in check_file(tmp_path / name) if finding.passed is not True] == []


def test_sheet_says_how_to_print_and_what_to_measure(housing):
    coupon = coupon_of(housing)
    text = fabrication_sheet(coupon, TITLE, 1e4)
    for part in (
        "Nozzle 0.4 mm", "L leaves are 2 lines, H leaves 3", "Layer 0.2 mm", "assumes solid leaves", "Pose: flat",
        "10.00 cm3, 12.7 g", "E = C F / d", "Calibrate each unit", f"{modulus_factor(housing.low, 3.5):.5g}",
    ):  # fmt: skip
        assert part in text


def test_process_without_layers_is_not_told_a_nozzle(housing):
    text = fabrication_sheet(coupon_of(housing), Title(name="paper", process=PROCESSES["strip-steel"]), 1e4)
    assert "Nozzle" not in text
    assert "## Make" in text
