"""What is bought: counts by the parts that are there."""

import math
from dataclasses import replace
from html import escape

import numpy as np
from markdown_it import MarkdownIt
from squares import RESIN, square_sensor

from cad.drawing.sheet import Title
from cad.fabrication import bill as bill_module
from cad.fabrication.bill import bill_of_materials
from cad.fabrication.fabrication_sheet import coarsest_resolution, fabrication_sheet
from cad.parts.assembly import assemble_sensor
from sensor.design.processes import PROCESSES
from sensor.design.signal_path import SpringReadOut, SpringToRead

MASSES = {"housing": 1.0, "cover": 2.0, "coupon": 3.0, "mount": 4.0}
PETG = PROCESSES["fdm-petg"]


def bill(sensor, process):
    return bill_of_materials(sensor, assemble_sensor(sensor), process, MASSES)


def counts(rows):
    return {(row.part, row.size.split(",")[0]): row.count for row in rows}


def test_pair_and_square_have_the_screws_of_their_holes_and_the_covers_of_their_mount(sensor):
    covered = replace(sensor, housing=replace(sensor.housing, mount="covers"))
    found = counts(bill(covered, PETG))
    assert found["housing", "1.0 g each"] == 1
    assert found["cover", "2.0 g each"] == 2
    assert found["screw", "M3 x 25"] == found["nut", "M3"] == 4  # 6 + 2 x 3 + 5 + 2.4 + 2 x 0.5 mm are 20.4
    assert found["washer", "M3"] == 8
    assert not any(part in ("dowel", "pin", "Hall sensor") for part, _ in found)
    square = counts(bill(square_sensor(), RESIN))
    assert square["housing", "1.0 g each"] == 2
    assert square["dowel", "3 x 10"] == 2
    washers = counts(bill(replace(sensor, housing=replace(sensor.housing, mount="washers")), PETG))
    assert not any(part == "cover" for part, _ in washers)
    assert washers["washer", "M3"] == 12  # head, between frame and bracket, nut
    assert washers["screw", "M3 x 16"] == 4  # 6 + 5 + 2.4 + 3 x 0.5 mm are 14.9


def test_grip_that_no_screw_is_long_enough_for_is_a_rod(sensor, monkeypatch):
    monkeypatch.setattr(bill_module, "screw_length", lambda _: None)
    assert counts(bill(sensor, PETG))["screw", "M3 threaded rod"] == 4


def test_readings_with_the_last_digit_of_the_sheet_give_a_stiffness_to_a_per_cent():
    """Six readings, one of both rounded, make half the variance of 1 % (95 %); ten times as coarse, more."""
    full = 10.9
    steps = np.linspace(0.0, 1.0, 6)

    def error(digit):
        """Return twice the standard deviation of a slope whose readings are off evenly by half a digit at most."""
        return 2.0 * digit / math.sqrt(12.0) / np.linalg.norm(steps - steps.mean()) / full

    assert error(coarsest_resolution(full)) <= 0.01 / math.sqrt(2.0) < error(10.0 * coarsest_resolution(full))


def test_text_of_a_printer_is_no_markup_in_the_bill_and_the_sheet(sensor):
    """A cell stays a cell, and what looks like HTML, a link or bold print is shown as it was written."""
    hostile = "<script>x</script> | [a](javascript:x) *b* `c` \\"
    process = replace(PETG, material=hostile)
    rows = bill(sensor, process)
    springs = [SpringToRead(name=name, K=K, deflection=0.1) for name, K in (("low", 0.9), ("high", 20.0))]
    read_out = SpringReadOut(springs=springs)
    sheet = fabrication_sheet(sensor, Title(name="own", process=process), rows, read_out, (200.0, 150.0))
    page = MarkdownIt("commonmark").enable("table").render(sheet)
    assert f"<td>housing.stl, {escape(hostile)}</td>" in page
    assert f"Process fdm-petg, {escape(hostile)};" in page
    assert "<script" not in page
    assert 'href="javascript' not in page
