"""What a maker of a sensor with strips of steel is given: files, bill, and a sheet in numbered steps."""

import re
import shutil
import subprocess
from dataclasses import replace

import pytest
import trimesh
from deadline import DEADLINE_S
from steel_strips import PAIR, SQUARE, steel_sensor

from cad.checks.part_checks import check_file
from cad.drawing.sheet import Title
from cad.fabrication.bill import bill_of_materials, glue_ml, sheets_to_buy
from cad.fabrication.bridges import Spring, SpringReadOut
from cad.fabrication.fabrication_files import write_fabrication
from cad.fabrication.fabrication_sheet import fabrication_sheet
from cad.files.sensor_files import write_sensor
from cad.files.step import read_step
from cad.files.threemf import read_3mf
from cad.parts.strips import glue_volume

MASSES = {"housing": 1.0, "cover": 2.0, "spacer": 3.0, "mount": 4.0}
NOT_OF_STEEL = ("coupon", "lines wide", "solid leaves", "foil gauges would give")


def read_out(sensor):
    springs = [
        Spring(name=arm.name, flexure=arm.flexure, K=K, deflection=0.1)
        for arm, K in zip(sensor.housing.arms, (0.97, 19.0), strict=True)
    ]
    return SpringReadOut(springs=tuple(springs))


def sheet_of(design):
    sensor = steel_sensor(design)
    bill = bill_of_materials(sensor, design.process, read_out(sensor).springs, MASSES)
    return fabrication_sheet(sensor, Title(name=design.name, process=design.process), bill, read_out(sensor))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("steel")
    sensor = steel_sensor()
    write_sensor(sensor, folder)
    write_fabrication(sensor, Title(name="steel", process=PAIR.process), read_out(sensor), folder)
    return folder


def test_strips_and_tool_are_written_and_no_coupon(folder):
    names = {path.name for path in folder.iterdir()}
    assert {"strips.step", "strips.dxf", "spacer.step", "spacer.stl", "cover.stl", "mount.stl"} <= names
    assert not any(name.startswith("coupon") for name in names)
    assert len(read_step(folder / "strips.step").Solids()) == 4
    assert len(read_step(folder / "spacer.step").Solids()) == 3
    assert len(read_step(folder / "housing.step").Solids()) == 3


def test_printed_bodies_have_their_names_in_every_file(folder):
    names = ("frame", "low shuttle", "high shuttle")
    assert read_3mf(folder / "housing.3mf").names == names
    for file, also in (("housing.step", ()), ("assembly.step", ("high upper strip", "low strip"))):
        text = (folder / file).read_text(encoding="ascii")
        assert [name for name in (*names, *also) if f"'{name}'" not in text] == []
    assert {*names, "low upper strip"} <= set(trimesh.load(folder / "assembly.glb").geometry)


@pytest.mark.parametrize(("name", "expected"), [("housing.3mf", {}), ("spacer.stl", {"geometry.one_solid": 3.0})])
def test_what_is_printed_needs_no_support_and_is_thick_enough(folder, name, expected):
    """The objects of a 3MF say that they are frame and shuttles; an STL holds no names of its three bodies."""
    failed = {verdict.name: verdict.value for verdict in check_file(folder / name) if verdict.passed is not True}
    assert failed == expected


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("prusa-slicer") is None, reason="prusa-slicer is not installed")
@pytest.mark.parametrize("name", ["housing.stl", "spacer.stl"])
def test_slicer_finds_three_closed_bodies(folder, name):
    command = ["prusa-slicer", "--info", str(folder / name)]
    info = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=DEADLINE_S, check=True).stdout
    assert re.findall(r"^manifold\s*=\s*(\w+)", info, flags=re.MULTILINE) == ["yes"]
    assert re.findall(r"^number_of_parts\s*=\s*(\d+)", info, flags=re.MULTILINE) == ["3"]


def test_bill_has_strips_sheet_glue_and_tool():
    sensor = steel_sensor(SQUARE)
    rows = bill_of_materials(sensor, SQUARE.process, read_out(sensor).springs, MASSES)
    found = {row.part: row for row in rows}
    assert "coupon" not in found
    assert [row.count for row in rows if row.part == "strip"] == [4, 4]
    low, high = (row for row in rows if row.part == "sheet")
    assert "0.1 mm thick, 12.7 mm wide" in low.size
    assert "0.15 mm thick" in high.size
    assert found["glue"].size == f"{glue_ml(sensor.housing):g} ml"
    assert 2e-3 * glue_volume(sensor.housing) <= glue_ml(sensor.housing) < 2e-3 * glue_volume(sensor.housing) + 0.1
    assert (found["spacer"].count, found["housing"].count) == (1, 2)


def test_sheet_to_buy_is_long_enough_for_both_springs_of_one_thickness():
    """Two pairs of strips of 24.5 and 25 mm, 10 mm wide: one beside another has no room on 12.7 mm."""
    sensor = steel_sensor()
    one, other = sheets_to_buy(sensor)
    assert (one.springs, other.springs) == (("low",), ("high",))
    assert (one.length, other.length) == (60.0, 60.0)  # 2 x 25.5 and 2 x 26 mm, up to the next 10
    weighed = replace(sensor.housing.high, thickness=0.098)  # sold as 0.1 mm
    (both,) = sheets_to_buy(replace(sensor, housing=sensor.housing.with_flexures({"high": weighed})))
    assert (both.springs, both.thickness, both.length) == (("low", "high"), 0.1, 120.0)


def test_strips_wider_than_any_sheet_that_is_sold_are_told_in_bill_and_sheet():
    sensor = steel_sensor()
    narrow = replace(sensor.sheet, stock_widths_mm=(6.0, 9.9), stock_lengths_mm=(5000.0, 500.0))
    sensor = replace(sensor, sheet=narrow)
    assert [(piece.width, piece.length) for piece in sheets_to_buy(sensor)] == [(9.9, None), (9.9, None)]
    bill = bill_of_materials(sensor, PAIR.process, read_out(sensor).springs, MASSES)
    sizes = [row.size for row in bill if row.part == "sheet"]
    assert ["none is sold" in size and "9.9 mm" in size for size in sizes] == [True, True]
    text = fabrication_sheet(sensor, Title(name="steel", process=PAIR.process), bill, read_out(sensor))
    assert [size for size in sizes if size not in text] == []


@pytest.mark.parametrize("design", [PAIR, SQUARE])
def test_sheet_has_steps_in_order_and_nothing_of_printed_leaves(design):
    text = sheet_of(design)
    section = text[text.index("\n## Strips") :]
    section = section[: section.index("\n## ", 5)]
    steps = [int(number) for number in re.findall(r"^(\d+)\. ", section, flags=re.MULTILINE)]
    assert steps == list(range(1, len(steps) + 1))
    assert len(steps) == (21 if design is SQUARE else 20)
    order = ["Weigh", "Print", "Cut", "Deburr", "Put the blocks", "Slide in", "Mix", "Take out", "Check the travel"]
    places = [section.index(f"**{word}") for word in order]
    assert places == sorted(places)
    assert [word for word in NOT_OF_STEEL if word in text] == []
    assert "print.leaf_measured_low_mm" in section
    assert "{{" not in text
