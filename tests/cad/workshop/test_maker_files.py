import hashlib
import math
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from cad.files.drawing import Title
from cad.files.maker_files import fabrication_sheet, write_fabrication
from squares import RESIN, square_sensor

from cad.checks.assembly_checks import cover_verdicts
from cad.checks.part_checks import check_file
from cad.design.fruit import Fruit
from cad.design.processes import PROCESSES
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


@pytest.fixture(scope="module")
def square_sheet():
    square = square_sensor()
    title = Title(name="gentle-square", process=RESIN)
    return fabrication_sheet(coupon_of(square.housing), cover_of(square), title, square.part.shape.Volume())


def test_sheet_of_a_square_says_how_two_plates_are_put_together_and_zeroed(square_sheet):
    """Grip: two plates 6 mm apart, 5.6 mm deep, and two covers of 3 mm; a screw passes a nut and two washers too."""
    assert "Make housing.stl twice" in square_sheet
    assert "two steel dowels, 3 x 10 mm (ISO 8734), into the holes of 2.95 mm" in square_sheet
    assert "17.6 mm to grip (two plates 11.6 + two covers of 3)" in square_sheet
    assert "M3 x 25" in square_sheet
    assert "flat hard plate" in square_sheet
    assert "g = (F_H1 + F_H2) / (2 K_h) - (F_L1 + F_L2) / (2 K_l)" in square_sheet
    assert "Do not round or sand the tip faces" not in square_sheet
    assert "domes of radius 10 mm" in square_sheet
    assert "The front one hides the marks" not in square_sheet


def test_sheet_of_a_square_has_the_numbers_of_its_mounting_error(square_sheet):
    """Holes 0.05 mm off: 0.1 mm of height over 6 mm is a roll; 0.2 mm over the distance of the dowels is a turn."""
    (left, _), (right, _) = sorted(square_sensor().housing.dowels)
    turn = 0.2 / (right - left)
    assert "up to 0.1 mm higher" in square_sheet
    assert f"{math.degrees(0.1 / 6.0):.2g} degrees" in square_sheet
    assert f"{math.degrees(turn):.2g} degrees" in square_sheet
    assert f"is {3.0 * turn:.2g} mm in the reading" in square_sheet


def test_sheet_of_a_pair_knows_no_second_plate(sensor):
    covered = replace(sensor, housing=replace(sensor.housing, mount="covers"))
    sheet = fabrication_sheet(coupon_of(sensor.housing), cover_of(covered), TITLE, sensor.part.shape.Volume())
    assert "Two plates" not in sheet
    assert "dowel" not in sheet
    assert "The front one hides the marks" in sheet


def test_square_between_washers_is_told_so():
    square = square_sensor(replace(square_sensor().housing, mount="washers"))
    title = Title(name="gentle-square", process=RESIN)
    sheet = fabrication_sheet(coupon_of(square.housing), cover_of(square), title, 1.0)
    assert "11.6 mm between their washers" in sheet
    assert "cover.stl" not in sheet
