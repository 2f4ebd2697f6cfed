"""What is drawn of strips: the outlines to cut, and on the drawing the slots, a layer of their own, and the table."""

import io

import ezdxf
import pytest
from steel_strips import PAIR, SQUARE, steel_housing, steel_sensor

from cad.drawing.housing_drawing import housing_drawing
from cad.drawing.measuring_table import measuring_table
from cad.drawing.sheet import Title
from cad.drawing.strip_cutting import strip_cutting
from cad.parts.strips import cut_strips
from sensor.design.processes import PROCESSES
from sensor.design.sheets import SHEETS


def test_outlines_to_cut_are_closed_and_as_large_as_the_strips():
    strips = cut_strips(steel_housing(SQUARE))
    document = ezdxf.read(io.StringIO(strip_cutting(strips, SHEETS["spring-steel"])))
    assert document.units == ezdxf.units.MM
    outlines = document.modelspace().query("LWPOLYLINE")
    assert {outline.dxf.layer for outline in outlines} == {"PART"}
    assert all(outline.closed for outline in outlines)
    sizes = []
    for outline in outlines:
        x, y = zip(*[(point[0], point[1]) for point in outline.get_points()], strict=True)
        sizes.append((max(x) - min(x), max(y) - min(y)))
    expected = [(strip.length, strip.width) for strip in strips]
    assert sizes == [pytest.approx(size, abs=1e-3) for size in expected]
    words = [text.dxf.text for text in document.modelspace().query("TEXT[layer=='NOTES']")]
    assert [word for word in words if "4 pieces, 0.1 thick" in word or "4 pieces, 0.15 thick" in word] == words[:2]
    tops = [max(point[1] for point in outline.get_points()) for outline in outlines]
    feet = [min(point[1] for point in outline.get_points()) for outline in outlines]
    assert tops[0] < feet[1]


def test_drawing_has_the_slots_and_the_strips_on_a_layer_of_their_own(sensor):
    sheet = housing_drawing(steel_sensor(), Title(name="steel", process=PAIR.process))
    measured = [round(float(length.get_measurement()), 3) for length in sheet.canvas.dimensions()]
    assert {0.3, 0.5, 5.0, 15.5, 16.0} <= set(measured)  # widths of the slots, their depth, free lengths
    steel = sheet.canvas.document.layers.get("STEEL")
    assert steel.dxf.color not in {layer.dxf.color for layer in sheet.canvas.document.layers if layer is not steel}
    lines = sheet.canvas.document.modelspace().query("LINE[layer=='STEEL']")
    assert len(lines) == 4 * 4  # four strips, each a rectangle in the section
    printed = housing_drawing(sensor, Title(name="printed", process=PROCESSES["fdm-petg"]))
    assert "STEEL" not in printed.canvas.document.layers


def test_table_has_tolerances_of_the_sheet_and_of_the_tool_not_those_of_the_print():
    rows = measuring_table(steel_sensor(), PAIR.process)
    assert [rows[name].nominal for name in ("low thickness", "high thickness")] == [0.1, 0.3]
    assert rows["low thickness"].tolerance == "±0.004"
    assert rows["high length"].tolerance == "±0.1"
    assert (rows["low slot"].nominal, rows["high slot"].nominal) == pytest.approx((0.3, 0.5))
    assert rows["low slot"].tolerance == f"±{PAIR.process.accuracy_mm:g}"
    assert len({row.letter for row in rows.values()}) == len(rows)
