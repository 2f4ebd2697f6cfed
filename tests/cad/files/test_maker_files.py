import hashlib
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from cad.checks.assembly_checks import cover_verdicts
from cad.checks.part_checks import check_file
from cad.design.fruit import Fruit
from cad.design.processes import PROCESSES
from cad.files.drawing import Title
from cad.files.maker_files import fabrication_sheet, write_fabrication
from cad.files.sensor_files import write_sensor
from cad.parts.coupon import coupon_of, modulus_factor
from cad.parts.cover import cover_of

ROOT = Path(__file__).parents[3]
TITLE = Title(name="paper", process=PROCESSES["fdm-petg"])
FILES = ["housing.step", "assembly.step", "housing.stl", "housing.3mf"]
SHEETS = [
    "drawing.dxf", "drawing.svg", "coupon.step", "coupon.stl", "cover.step", "cover.stl", "fabrication.md",
]  # fmt: skip
AGAIN = """
import sys
from dataclasses import replace

import pytest
from pathlib import Path
from cad.design.fruit import Fruit
from cad.design.tips import Press, Tips
from cad.design.processes import PROCESSES
from cad.files.drawing import Title
from cad.files.maker_files import write_fabrication
from cad.files.sensor_files import write_sensor
from cad.parts.housing import Housing
from cad.parts.housing_solid import housing_part
from cad.parts.sensor import Sensor
from cad.theory.leaf_spring import Flexure
sensor_housing = eval(sys.argv[2])
fruit, part = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=20.0), housing_part(sensor_housing)
sensor = Sensor(housing=sensor_housing, part=part, fruit=fruit, tips=Tips(), press=Press(), name="paper")
write_sensor(sensor, Path(sys.argv[1]))
write_fabrication(sensor, Title(name="paper", process=PROCESSES["fdm-petg"]), Path(sys.argv[1]))
"""


def digests(folder):
    return {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in (*FILES, *SHEETS)}


def test_same_bytes_in_another_process_and_folder(sensor, tmp_path):
    here, there = tmp_path / "here", tmp_path / "over there"
    here.mkdir()
    there.mkdir()
    named = replace(sensor, name="paper", fruit=Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=20.0))
    written = (*write_sensor(named, here), *write_fabrication(named, TITLE, here)[0])
    assert [path.name for path in written] == [*FILES, *SHEETS]
    environment = {**os.environ, "PYTHONHASHSEED": "11", "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", AGAIN, str(there), repr(sensor.housing)]
    subprocess.run(command, env=environment, cwd=tmp_path, check=True)
    assert digests(here) == digests(there)


def test_coupon_cover_and_3mf_pass_their_own_check(sensor, tmp_path, monkeypatch):
    monkeypatch.setattr("cad.checks.slicer.NAME", "a-slicer-that-nobody-has")
    write_sensor(sensor, tmp_path)
    _, cover = write_fabrication(sensor, TITLE, tmp_path)
    findings = cover_verdicts(sensor, cover, TITLE.process)
    assert [finding.name for finding in findings if finding.passed is not True] == []
    for name in ("housing.3mf", "coupon.stl", "coupon.step", "cover.stl", "cover.step"):
        assert [finding.name for finding in check_file(tmp_path / name) if finding.passed is not True] == []


def test_sheet_says_how_to_print_and_what_to_measure(sensor):
    housing = sensor.housing
    coupon = coupon_of(housing)
    text = fabrication_sheet(coupon, cover_of(sensor), TITLE, 1e4)
    for part in (
        "Nozzle 0.4 mm", "L leaves are 2 lines, H leaves 3", "Layer 0.2 mm", "assumes solid leaves", "Pose: flat",
        "10.00 cm3, 12.7 g", "E = C F / d", "Calibrate each unit", f"{modulus_factor(housing.low, 3.5):.5g}",
    ):  # fmt: skip
        assert part in text


@pytest.mark.parametrize(
    ("mount", "words", "absent"),
    [
        ("covers", ("12 mm to grip\n(plate 6 + two covers of 3)", "M3 x 16", "to 0.5 N m"), "ISO 7089"),
        ("washers", ("M3, 7 mm wide (ISO 7089)", "6 mm between them", "to 0.5 N m"), "to grip"),
    ],
)
def test_sheet_tells_the_mount_that_was_solved_and_no_other(sensor, mount, words, absent):
    cover = replace(cover_of(sensor), housing=replace(sensor.housing, mount=mount))
    text = fabrication_sheet(coupon_of(sensor.housing), cover, TITLE, 1e4)
    assert text.count("## Mount") == 1
    for part in words:
        assert part in text
    assert absent not in text


def test_sheet_tells_of_gauges_where_they_are_fitted(sensor):
    coupon, cover = coupon_of(sensor.housing), cover_of(sensor)
    assert "Strain gauges" not in fabrication_sheet(coupon, cover, TITLE, 1e4)
    fitted = replace(cover, housing=replace(sensor.housing, gauges="foil"))
    text = fabrication_sheet(coupon, fitted, TITLE, 1e4)
    for part in ("Eight foil gauges, grid 3 x 3 mm, gauge factor 2.1", "6 x 4 mm", "0.5 mm from wall or shuttle"):
        assert part in text


def test_process_without_layers_is_not_told_a_nozzle(sensor):
    title = Title(name="paper", process=PROCESSES["strip-steel"])
    text = fabrication_sheet(coupon_of(sensor.housing), cover_of(sensor), title, 1e4)
    assert "Nozzle" not in text
    assert "## Make" in text
