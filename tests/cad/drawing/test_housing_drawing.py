"""Drawings of housing, coupon and cover: each dimension once, no text on another, true in DXF and in SVG."""

import itertools
import math
import re
import xml.etree.ElementTree as ET
from collections import Counter
from dataclasses import replace

import ezdxf
import pytest
from ezdxf import bbox
from ezdxf.math import BoundingBox, Vec3
from squares import square_sensor

from cad.design.processes import PROCESSES
from cad.drawing.canvas import Canvas, text_width
from cad.drawing.coupon_drawing import coupon_drawing
from cad.drawing.cover_drawing import cover_drawing
from cad.drawing.housing_drawing import draw_gauges, housing_drawing
from cad.drawing.section import draw_section, section
from cad.drawing.sheet import SIZES, Title
from cad.parts.coupon import coupon_of
from cad.parts.coupon_solid import coupon_part
from cad.parts.cover_solid import cover_of, cover_part
from cad.parts.housing import fillet_corners
from cad.parts.housing_solid import housing_part
from cad.quantity import InputError
from cad.theory.strain_gauge import FOIL

TITLE = Title(name="paper", process=PROCESSES["fdm-petg"])
KINDS = ["pair", "square", "gauges", "pins", "coupon", "cover"]


@pytest.fixture(scope="module")
def sheets(sensor):
    square = square_sensor()
    gauged = replace(sensor.housing, gauges="foil", high=replace(sensor.housing.high, length=14.0))
    coupon, cover = coupon_of(sensor.housing), cover_of(sensor)
    pinned = replace(sensor.housing, tip_side=3.8, pin_side=1.0, pin_out=1.0, pocket_side=1.1, pocket_depth=3.0)
    return {
        "pair": housing_drawing(sensor.part, sensor.housing, TITLE),
        "square": housing_drawing(square.part, square.housing, TITLE),
        "gauges": housing_drawing(housing_part(gauged), gauged, TITLE),
        "pins": housing_drawing(sensor.part, pinned, TITLE),
        "coupon": coupon_drawing(coupon_part(coupon), coupon, replace(TITLE, part="coupon")),
        "cover": cover_drawing(cover_part(cover), cover, replace(TITLE, part="cover")),
    }


def measured(canvas):
    """Return how often each length [mm] is measured."""
    return Counter(round(float(entity.get_measurement()), 6) for entity in canvas.space.query("DIMENSION"))


def texts(canvas):
    """Return every text with the box around it [mm], those of dimensions, which are level or upright, as drawn."""
    of_title = (entity for sheet in canvas.space.query("INSERT") for entity in sheet.virtual_entities())
    lines = [
        text for text in (*canvas.space.query("TEXT"), *of_title) if text.dxftype() == "TEXT" and text.plain_text()
    ]
    boxes = [(text.plain_text(), bbox.extents([text])) for text in lines]
    for dimension in canvas.space.query("DIMENSION"):
        (text,) = (entity for entity in dimension.virtual_entities() if entity.dxftype() == "MTEXT")
        along, across = 0.5 * text_width(text.plain_text(), text.dxf.char_height), 0.5 * text.dxf.char_height
        half = Vec3(across, along) if abs(text.get_rotation()) > 45.0 else Vec3(along, across)
        boxes.append((text.plain_text(), BoundingBox([text.dxf.insert - half, text.dxf.insert + half])))
    return boxes


def words(sheet):
    return {text for text, _ in texts(sheet.canvas)}


def test_section_has_the_fillets_and_holes_of_the_housing(sensor):
    canvas = Canvas(1.0)
    draw_section(canvas, section(sensor.part.shape))
    fillets = list(canvas.space.query("ARC"))
    holes = list(canvas.space.query("CIRCLE"))
    assert [arc.dxf.radius for arc in fillets] == pytest.approx([0.5] * len(fillet_corners(sensor.housing)))
    spans = [(arc.dxf.end_angle - arc.dxf.start_angle) % 360.0 for arc in fillets]
    assert spans == pytest.approx([90.0] * len(fillets))
    centres = sorted((hole.dxf.center.x, hole.dxf.center.y) for hole in holes)
    assert centres == [pytest.approx(hole) for hole in sorted(sensor.housing.holes)]
    ends = [end for line in canvas.space.query("LINE") for end in (line.dxf.start, line.dxf.end)]
    for arc in fillets:  # they continue the lines: none is the other three quarters of its circle
        assert all(min(math.dist(point, end) for end in ends) < 1e-6 for point in (arc.start_point, arc.end_point))


def test_every_dimension_of_the_housing_stands_once(sensor, sheets):
    """Leaves, separation, fillet, tips, holes and their places, outer sizes, stops."""
    housing = sensor.housing
    (x0, z0), (x1, z1) = housing.holes[0], housing.holes[-1]
    low, high = housing.arms
    lengths = (
        housing.low.length, housing.high.length, housing.low.thickness, housing.high.thickness,
        housing.low.separation, housing.depth, housing.low.fillet, housing.hole_diameter, housing.spacing,
        housing.tip_side, housing.tip_height, housing.neck_level, housing.lower_leaf_level, housing.shuttle_width,
        housing.wall_width, housing.right - housing.left, housing.top_level - housing.protrusion, housing.protrusion,
        housing.top_level - housing.cavity_level, x1 - x0, z1 - z0, x0 - housing.left, z0 - housing.protrusion,
        housing.cavity_level - low.top_level, housing.cavity_level - high.top_level,
    )  # fmt: skip
    assert measured(sheets["pair"].canvas) == Counter(round(length, 6) for length in lengths)


@pytest.mark.parametrize("kind", KINDS)
def test_no_text_lies_on_another_and_all_lie_on_the_sheet(kind, sheets):
    sheet = sheets[kind]
    left, bottom, right, top = sheet.window
    boxes = texts(sheet.canvas)
    on_another = [(a, b) for (a, one), (b, two) in itertools.combinations(boxes, 2) if one.has_overlap(two)]
    assert on_another == []
    assert all(left < box.extmin.x and bottom < box.extmin.y for _, box in boxes)
    assert all(box.extmax.x < right and box.extmax.y < top for _, box in boxes)
    scale = sheet.canvas.scale
    assert (scale * (right - left), scale * (top - bottom)) == pytest.approx(SIZES[sheet.size])


@pytest.mark.parametrize("kind", KINDS)
def test_files_hold_the_dimensions_and_the_size_of_the_sheet_and_the_same_bytes_again(kind, sheets, tmp_path):
    sheet = sheets[kind]
    dxf, svg = sheet.write(tmp_path / "drawing")
    document = ezdxf.readfile(dxf)
    assert document.audit().errors == []
    assert document.units == 4  # millimetres, DXF reference, $INSUNITS
    dimensions = list(document.modelspace().query("DIMENSION"))
    assert Counter(round(float(entity.get_measurement()), 6) for entity in dimensions) == measured(sheet.canvas)
    assert all("<>" in entity.dxf.text for entity in dimensions)  # none has a text of its own for its value
    root = ET.parse(svg).getroot()
    assert (root.get("width"), root.get("height")) == tuple(f"{side:.0f}mm" for side in SIZES[sheet.size])
    before = (dxf.read_bytes(), svg.read_bytes())
    sheet.write(tmp_path / "drawing")
    assert (dxf.read_bytes(), svg.read_bytes()) == before


def test_title_block_says_what_a_workshop_asks(sheets, monkeypatch, sensor):
    title = words(sheets["pair"])
    assert title >= {
        "paper: housing",
        "PETG",
        "fdm-petg",
        "±0.2",
        "2:1",
        "A4 1/1",
        "date",
        "first angle",
        "paper-01",
        "A",
    }
    assert not any(re.fullmatch(r"\d{4}-\d\d-\d\d", text) for text in title)  # no day is made up
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    metal = replace(TITLE, process=PROCESSES["dmls-ti64"])
    title = words(housing_drawing(sensor.part, sensor.housing, metal))
    assert title >= {"1970-01-02", "Ti-6Al-4V", "ISO 2768-1 m"}


def section_area_of(sensor):
    """Return what the plane y = 0 cuts of the housing [mm^2]: its volume over its depth, but for the pad."""
    housing = sensor.housing
    return sensor.part.shape.Volume() / (housing.depth + 0.3 * housing.pad_height)


@pytest.mark.parametrize("kind", ["pair", "square"])
def test_section_is_hatched_with_texts_left_free_and_holes_have_centre_lines(kind, sheets, sensor):
    """Strokes lie on the plate alone, 2 mm apart on paper, and in no text and no window between leaves."""
    canvas = sheets[kind].canvas
    housing = square_sensor().housing if kind == "square" else sensor.housing
    strokes = [(line.dxf.start, line.dxf.end) for line in canvas.space.query('LINE[layer=="HATCH"]')]
    section_area = section_area_of(square_sensor() if kind == "square" else sensor)
    hatched = sum(math.dist(start, end) for start, end in strokes) * 2.0 / canvas.scale
    assert 0.8 * section_area < hatched < 1.02 * section_area
    for box in canvas.text_boxes():
        for start, end in strokes:
            middle = 0.5 * (start + end)
            assert not (box.left < middle.x < box.right and box.bottom < middle.y < box.top)
    holes = len(housing.holes) + len(housing.dowels)
    axes = canvas.space.query('LINE[layer=="AXES"]')
    assert len(axes) == 2 * holes
    assert {axis.dxf.linetype for axis in axes} == {"CENTER"}
    assert words(sheets[kind]) >= {"A", "A-A"}


def test_lengths_of_the_general_tolerance_are_rounded_and_small_ones_are_not(sheets):
    """±0.2 on the third decimal is no size that a shop can measure; under 0.5 mm ISO 2768-1 has no tolerance."""
    for dimension in sheets["square"].canvas.space.query("DIMENSION"):
        (text,) = (entity.plain_text() for entity in dimension.virtual_entities() if entity.dxftype() == "MTEXT")
        number = re.match(r"[\d.]+", text)
        if number and "±" not in text and float(number[0]) >= 0.5:
            assert len(number[0].partition(".")[2]) <= 1
    assert any("±0.05" in text and "0.5" in text for text in words(sheets["square"]))


def test_gauges_are_drawn_where_they_lie(housing):
    """Each as a box 6 long on both faces of the upper leaf, 0.5 from a root, and 6 x 4 seen from above."""
    gauged = replace(housing, gauges="foil", high=replace(housing.high, length=14.0))
    canvas = Canvas(2.0)
    draw_gauges(canvas, gauged, FOIL, 40.0)
    wall, shuttle = gauged.arms[0].roots
    upper_face = gauged.lower_leaf_level + 14.0 + 0.4
    lines = [line.dxf for line in canvas.space.query('LINE[layer=="NOTES"]')]
    on_leaf = [
        sorted((line.start.x, line.end.x)) for line in lines if line.start.y == line.end.y == pytest.approx(upper_face)
    ]
    for span in ((wall + 0.5, wall + 6.5), (shuttle - 6.5, shuttle - 0.5)):
        assert any(pair == pytest.approx(list(span)) for pair in on_leaf)
    assert measured(canvas) == {0.5: 2, 6.0: 2, 3.0: 3, 4.0: 1}
    with pytest.raises(InputError) as refused:
        draw_gauges(canvas, replace(gauged, high=replace(housing.high, length=12.5)), FOIL, 40.0)
    assert (refused.value.field, refused.value.value) == ("flexure.length", 12.5)


def test_plate_of_a_square_tells_its_domes_its_dowels_and_that_two_are_made(sheets):
    square, pair = words(sheets["square"]), words(sheets["pair"])
    assert {"R10 2x, domes", "Ø2.95 2x, ream 3 H7"} <= square
    assert any("MAKE TWO" in text for text in square)
    assert not any("dome" in text or "MAKE TWO" in text for text in pair)
    circles = sheets["square"].canvas.space.query("CIRCLE")
    dowels = [hole.dxf.center for hole in circles if hole.dxf.radius == pytest.approx(0.5 * 2.95)]
    assert sorted((centre.x, centre.y) for centre in dowels) == [
        pytest.approx(dowel) for dowel in sorted(square_sensor().housing.dowels)
    ]
