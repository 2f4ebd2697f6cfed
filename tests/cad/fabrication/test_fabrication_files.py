import math
from dataclasses import replace
from pathlib import Path

import pytest
from squares import RESIN, square_sensor

from cad.checks.assembly_checks import cover_verdicts
from cad.checks.part_checks import check_file
from cad.design.fruit import Fruit
from cad.design.processes import PROCESSES
from cad.drawing.sheet import Title
from cad.fabrication.bill import bill_of_materials
from cad.fabrication.bridges import Spring, bridges
from cad.fabrication.fabrication_files import write_fabrication
from cad.fabrication.fabrication_sheet import fabrication_sheet
from cad.fabrication.mount_checks import mount_verdicts
from cad.files.sensor_files import write_sensor
from cad.parts.coupon import modulus_factor

ROOT = Path(__file__).parents[3]
TITLE = Title(name="paper", process=PROCESSES["fdm-petg"])
FILES = ["housing.step", "assembly.step", "housing.stl", "housing.3mf", "assembly.glb"]
SHEETS = [
    "drawing.dxf", "drawing.svg", "drawing-coupon.dxf", "drawing-coupon.svg", "drawing-cover.dxf", "drawing-cover.svg",
    "coupon.step", "coupon.stl", "cover.step", "cover.stl", "mount.step", "mount.stl", "bom.csv", "fabrication.md",
]  # fmt: skip


def springs_of(sensor):
    """Return springs of 900 and 20000 N/m that move by 0.5 and 0.1 mm."""
    rows = zip(sensor.housing.arms, (0.9, 20.0), (0.5, 0.1), strict=True)
    return tuple(Spring(name=arm.name, flexure=arm.flexure, K=K, deflection=d) for arm, K, d in rows)


def sheet_of(sensor, title=TITLE):
    wired = bridges(springs_of(sensor), sensor.housing, title.process)
    masses = dict.fromkeys(("housing", "cover", "coupon", "mount"), 1.0)
    bill = bill_of_materials(sensor, title.process, wired, masses)
    return fabrication_sheet(sensor, title, bill, wired)


@pytest.fixture(scope="module")
def curved(sensor):
    """Return the sensor over a curved fruit, with its name engraved."""
    fruit = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=20.0)
    return replace(sensor, name="paper", fruit=fruit)


def write_all(sensor, folder):
    """Return the paths of every file in their order, and cover and bracket as they were read back."""
    paths = write_sensor(sensor, folder)
    made = write_fabrication(sensor, TITLE, springs_of(sensor), folder)
    return [*paths, *made.paths], made


@pytest.fixture(scope="module")
def written(curved, tmp_path_factory):
    return write_all(curved, tmp_path_factory.mktemp("fabrication"))


def test_every_file_is_written_and_the_same_bytes_again_but_for_step_and_3mf(curved, written, tmp_path):
    """OCCT counts in its text and lib3mf draws numbers: their files hold equal solids, not equal bytes."""
    first, _ = written
    again, _ = write_all(curved, tmp_path)
    assert [path.name for path in first] == [path.name for path in again] == [*FILES, *SHEETS]
    for path, other in zip(first, again, strict=True):
        assert path.suffix in (".step", ".3mf") or path.read_bytes() == other.read_bytes()


@pytest.mark.slow
def test_coupon_cover_and_3mf_pass_their_own_check(curved, written):
    paths, made = written
    findings = [
        *cover_verdicts(curved, made.cover, TITLE.process),
        *mount_verdicts(curved, made.mount, TITLE.process),
    ]
    for name in ("housing.3mf", "coupon.stl", "coupon.step", "cover.stl", "cover.step"):
        findings += check_file(paths[0].with_name(name))
    assert [finding.name for finding in findings if finding.passed is not True] == []


def test_sheet_says_how_to_print_and_what_to_measure(sensor):
    housing = sensor.housing
    text = sheet_of(sensor)
    volume = 1e-3 * sensor.part.shape.Volume()
    for part in (
        "Nozzle 0.4 mm", "L leaves are 2 lines, H leaves 3", "Layer 0.2 mm", "assumes solid leaves", "Pose: flat",
        f"{volume:.2f} cm3, {1.27 * volume:.1f} g",
        "E = C F / d", "Calibrate each unit", f"{modulus_factor(housing.low, 3.5):.5g}",
    ):  # fmt: skip
        assert part in text


@pytest.mark.parametrize(
    ("mount", "words", "absent"),
    [
        ("covers", ("12 mm to grip\n(plate 6 + two covers of 3)", "M3 x 25", "to 0.5 N m"), "wide (ISO 7089)"),
        ("washers", ("M3, 7 mm wide (ISO 7089)", "6 mm between them", "to 0.5 N m"), "to grip\n"),
    ],
)
def test_sheet_tells_the_mount_that_was_solved_and_no_other(sensor, mount, words, absent):
    text = sheet_of(replace(sensor, housing=replace(sensor.housing, mount=mount)))
    assert text.count("## Mount") == 1
    for part in words:
        assert part in text
    assert absent not in text


@pytest.mark.parametrize("mount", ["covers", "washers"])
def test_heading_has_an_empty_line_before_it_and_the_assembly_says_which_screws_it_has(mount, sensor):
    """Screws without the bracket: 12 or 6 mm of grip, a nut of 2.4 mm and two washers of 0.5 mm."""
    lines = sheet_of(replace(sensor, housing=replace(sensor.housing, mount=mount))).splitlines()
    headings = [number for number, line in enumerate(lines) if line.startswith("## ")]
    assert {lines[number] for number in headings} >= {"## Mount", "## Bracket"}
    assert all(lines[number - 1] == "" != lines[number - 2] for number in headings)
    shorter = {"covers": "M3 x 16", "washers": "M3 x 10"}[mount]
    assert f"assembly.step shows the sensor without the bracket, on shorter screws, {shorter}." in "\n".join(lines)


def test_sheet_tells_of_gauges_where_they_are_fitted(sensor):
    long = replace(sensor, housing=replace(sensor.housing, high=replace(sensor.housing.high, length=14.0)))
    bare = sheet_of(long)
    assert "## Strain gauges" not in bare
    assert "Foil gauges fit on both springs: run again with --set print.gauges=foil" in bare
    text = sheet_of(replace(long, housing=replace(long.housing, gauges="foil")))
    for part in (
        "8 foil gauges, grid 3 x 3 mm, gauge factor 2.1", "6 x 4 mm", "0.5 mm from wall or shuttle",
        "| red | E+ |", "| 8 | strain gauge | grid 3 x 3 mm, 1000 ohm", "| 2 | amplifier | 5 V | HX711 |",
    ):  # fmt: skip
        assert part in text


def test_spring_without_room_for_gauges_asks_for_another_read_out(sensor):
    short = replace(sensor, housing=replace(sensor.housing, high=replace(sensor.housing.high, length=12.5)))
    text = sheet_of(short)
    assert "Foil gauges do not fit the high spring" in text
    assert "one per cent of the least travel is 1 micrometres" in text


@pytest.mark.parametrize(
    ("process", "words", "absent"),
    [
        ("fdm-petg", ("Nozzle 0.4 mm", "No brim on leaves"), ("isopropanol", "argon", "H900", "powder out")),
        ("sla-resin", ("Wash 10 min in isopropanol", "30 min at 60 C"), ("Nozzle", "No support", "argon", "brim")),
        ("sls-pa12", ("powder out of every gap", "2 bar"), ("Nozzle", "isopropanol", "argon", "brim")),
        ("dmls-17-4ph", ("H900, 480 C for 1 h", "by wire AFTER the heat"), ("argon", "No support", "brim")),
        ("dmls-ti64", ("650 to 750", "argon"), ("H900", "No support", "brim")),
    ],
)
def test_sheet_is_true_to_its_process(process, words, absent, sensor):
    text = sheet_of(sensor, replace(TITLE, process=PROCESSES[process]))
    assert [part for part in words if part not in text] == []
    assert [part for part in absent if part in text] == []


def test_alloy_without_a_known_cycle_is_told_no_other_ones(sensor):
    process = replace(PROCESSES["dmls-ti64"], name="dmls-316l", material="316L")
    text = sheet_of(sensor, replace(TITLE, process=process))
    assert "by the cycle that the maker of the powder gives" in text
    assert "argon" not in text


def test_process_of_another_kind_is_made_not_printed(sensor):
    process = replace(PROCESSES["sla-resin"], name="milled", kind="other")
    text = sheet_of(sensor, replace(TITLE, process=process))
    assert "Nozzle" not in text
    assert "## Make" in text


@pytest.fixture(scope="module")
def square_sheet():
    square = square_sensor()
    title = Title(name="gentle-square", process=RESIN)
    return sheet_of(square, title)


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
    sheet = sheet_of(covered)
    assert "Two plates" not in sheet
    assert "dowel" not in sheet
    assert "The front one hides the marks" in sheet


def test_square_between_washers_is_told_so():
    square = square_sensor(replace(square_sensor().housing, mount="washers"))
    title = Title(name="gentle-square", process=RESIN)
    sheet = sheet_of(square, title)
    assert "11.6 mm between their washers" in sheet
    assert "cover.stl" not in sheet
