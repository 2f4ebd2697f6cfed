"""Drawings of every part and of the assembly: each dimension once, no text on anything, true in DXF and in SVG."""

import itertools
import math
import re
import tomllib
import xml.etree.ElementTree as ET
from collections import Counter
from dataclasses import replace
from pathlib import Path

import ezdxf
import pytest
import shapely
from ezdxf import bbox
from ezdxf.disassemble import make_primitive, recursive_decompose
from ezdxf.math import BoundingBox
from squares import square_sensor

from cad.design.design_file import design_from_mapping
from cad.design.parameters import Design
from cad.design.processes import PROCESSES
from cad.design.tips import Tips
from cad.drawing.canvas import Canvas, text_width
from cad.drawing.coupon_drawing import coupon_drawing
from cad.drawing.cover_drawing import cover_drawing
from cad.drawing.housing_drawing import draw_gauges, housing_drawing
from cad.drawing.pin_drawing import pin_drawing
from cad.drawing.section import draw_section, section
from cad.drawing.sheet import SIZES, Title
from cad.fabrication.assembly_drawing import assembly_drawing
from cad.fabrication.bill import bill_of_materials
from cad.fabrication.mount import mount_solid
from cad.fabrication.mount_drawing import mount_drawing
from cad.parts.assembly import sensor_of
from cad.parts.coupon_solid import coupon_part
from cad.parts.cover_solid import cover_part
from cad.parts.housing import fillet_corners
from cad.parts.housing_solid import housing_part
from cad.parts.layout import housing_for
from cad.parts.pin_socket import tip_solid
from cad.quantity import InputError
from cad.theory.strain_gauge import FOIL
from cad.tips.cone import Cone
from cad.tips.flat import Cube

TITLE = Title(name="paper", process=PROCESSES["fdm-petg"])
ROOT = Path(__file__).parents[3]
LENGTHS = {"paper": (28.926, 14.731), "mango": (42.825, 28.759)}  # [mm] of the leaves as they are fitted
STEEL = PROCESSES["dmls-17-4ph"]


def sensor_of_preset(name):
    """Return the sensor of a preset with its leaves as fitted, and its title."""
    design = design_from_mapping(tomllib.loads((ROOT / f"designs/{name}.toml").read_text(encoding="utf-8")))
    housing = housing_for(design, design.process, LENGTHS[name], (0.5, 0.2))
    return sensor_of(design, housing), Title(name=name, process=design.process)


def of_assembly(sensor, title):
    bill = bill_of_materials(sensor, title.process, (), dict.fromkeys(("housing", "cover", "coupon", "mount"), 1.0))
    return assembly_drawing(sensor, mount_solid(sensor), bill, {"housing": "01"}, title)


def sensor_with_pins():
    design = Design(tips=Tips(socket="pin"))
    return sensor_of(design, housing_for(design, design.process, LENGTHS["paper"], (0.5, 0.2)))


def of_pin(shape):
    return pin_drawing(tip_solid(shape, 4.5), shape, 4.5, 2, replace(TITLE, part="pin", tolerance="ISO 2768-1 f"))


class Sheets(dict):
    """Sheets by their kind, drawn when they are first asked for."""

    def __missing__(self, kind):
        self[kind] = self[f"draw {kind}"]()
        return self[kind]


@pytest.fixture(scope="module")
def sheets(sensor):
    square = square_sensor()
    gauged = replace(sensor.housing, gauges="foil", high=replace(sensor.housing.high, length=14.0))
    pinned = replace(sensor.housing, tip_side=3.8, pin_side=1.0, pin_out=1.0, pocket_side=1.1, pocket_depth=3.0)
    paper, of_paper = sensor_of_preset("paper")
    mango, of_mango = sensor_of_preset("mango")
    draw = {
        "pair": lambda: housing_drawing(sensor.part, sensor.housing, TITLE),
        "square": lambda: housing_drawing(square.part, square.housing, TITLE),
        "gauges": lambda: housing_drawing(housing_part(gauged), gauged, TITLE),
        "pins": lambda: housing_drawing(sensor.part, pinned, TITLE),
        "coupon": lambda: coupon_drawing(coupon_part(sensor.housing), sensor.housing, replace(TITLE, part="coupon")),
        "cover": lambda: cover_drawing(cover_part(sensor.housing), sensor.housing, replace(TITLE, part="cover")),
        "mango": lambda: housing_drawing(mango.part, mango.housing, of_mango),
        "steel": lambda: housing_drawing(paper.part, paper.housing, replace(of_paper, process=STEEL)),
        "mango cover": lambda: cover_drawing(cover_part(mango.housing), mango.housing, of_mango),
        "paper mount": lambda: mount_drawing(paper, mount_solid(paper), of_paper),
        "mango mount": lambda: mount_drawing(mango, mount_solid(mango), of_mango),
        "paper assembly": lambda: of_assembly(paper, of_paper),
        "mango assembly": lambda: of_assembly(mango, of_mango),
        "pins assembly": lambda: of_assembly(sensor_with_pins(), of_paper),
        "square pin": lambda: of_pin(Cube(side_mm=1.0, fillet_mm=0.0)),
        "cone pin": lambda: of_pin(Cone(side_mm=1.2, half_angle_deg=30.0, blunt_mm=0.2)),
    }
    return Sheets({f"draw {kind}": drawing for kind, drawing in draw.items()})


PARTS = ["pair", "square", "gauges", "cover", "steel"]
SLOW_PARTS = ["mango", "mango cover", "paper mount", "mango mount", "paper assembly", "mango assembly", "pins assembly"]
SMALL_PARTS = ["pins", "coupon", "square pin", "cone pin"]
KINDS = [*PARTS, *SMALL_PARTS, *(pytest.param(kind, marks=pytest.mark.slow) for kind in SLOW_PARTS)]
FLAT_MM = 0.05  # by which a chord may leave its curve


def drawn_lines(canvas):
    """Return every line, arc, circle and arrow of a sheet as shapely lines [mm], hatching and blocks among them."""
    lines = []
    for entity in recursive_decompose(canvas.space):
        if entity.dxftype() in ("TEXT", "MTEXT", "POINT"):
            continue
        path = make_primitive(entity, FLAT_MM).path
        points = [entity.dxf.start, entity.dxf.end] if path is None else list(path.flattening(FLAT_MM))
        lines.append(shapely.LineString([(point.x, point.y) for point in points]))
    return lines


def texts_on_something(sheet):
    """Return the texts that lie on another text or on a line; boxes are let in by a twentieth of their height."""
    boxes = []
    for text, box in sheet.canvas.texts():
        let_in = 0.05 * min(box.right - box.left, box.top - box.bottom)
        boxes.append((text, shapely.box(*box).buffer(-let_in)))
    tree = shapely.STRtree(drawn_lines(sheet.canvas))
    on_line = [text for text, box in boxes if len(tree.query(box, predicate="intersects"))]
    return on_line + [a for (a, one), (b, two) in itertools.combinations(boxes, 2) if one.intersects(two)]


def measured(canvas):
    """Return how often each length [mm] is measured."""
    return Counter(round(float(entity.get_measurement()), 6) for entity in canvas.space.query("DIMENSION"))


def words(sheet):
    return {text for text, _ in sheet.canvas.texts()}


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


@pytest.mark.slow
def test_tips_as_wide_as_their_shuttles_have_no_neck_to_measure(sheets):
    """The plate of a mango's sensor is 5.6 deep, its shuttles and tips are 5.6 wide: one depth, one width."""
    lengths = measured(sheets["mango"].canvas)
    assert lengths[5.6] == 2
    housing = sensor_of_preset("mango")[0].housing
    assert lengths[round(housing.neck_level, 6)] == lengths[round(housing.tip_height, 6)] == 0


@pytest.mark.parametrize("kind", KINDS)
def test_arrows_of_a_length_with_room_for_its_text_lie_within_it(kind, sheets):
    canvas = sheets[kind].canvas
    for dimension in canvas.dimensions():
        if dimension.dimtype != 0:  # DXF reference, group 70: a length
            continue
        along = 0 if dimension.dxf.angle == 0.0 else 1
        ends = sorted((dimension.dxf.defpoint2[along], dimension.dxf.defpoint3[along]))
        drawn = list(recursive_decompose([dimension]))
        (text,) = (entity.plain_text() for entity in drawn if entity.dxftype() == "MTEXT")
        if ends[1] - ends[0] < text_width(text, canvas.text_height) + 4.0 * canvas.text_height:
            continue
        for arrow in (entity for entity in drawn if entity.dxftype() == "SOLID"):
            corners = [arrow.dxf.vtx0[along], arrow.dxf.vtx1[along]]
            assert ends[0] - 1e-6 <= min(corners) <= max(corners) <= ends[1] + 1e-6, text


@pytest.mark.parametrize("kind", KINDS)
def test_no_text_lies_on_another_or_on_a_line_and_all_lie_on_the_sheet(kind, sheets):
    sheet = sheets[kind]
    window = sheet.window
    assert texts_on_something(sheet) == []
    assert all(shapely.box(*window).contains(shapely.box(*box)) for _, box in sheet.canvas.texts())
    scale = sheet.canvas.scale
    size = (scale * (window.right - window.left), scale * (window.top - window.bottom))
    assert size == pytest.approx(SIZES[sheet.size])


def test_a_text_on_a_line_or_on_a_text_is_found(sensor):
    sheet = cover_drawing(cover_part(sensor.housing), sensor.housing, TITLE)
    sheet.canvas.words("on the frame", (sensor.housing.left + 12.0, sensor.housing.top_level), 1.0)
    sheet.canvas.words("one", (0.0, 10.0), 2.0)
    sheet.canvas.words("two", (1.0, 10.0), 2.0)
    assert texts_on_something(sheet) == ["on the frame", "one"]


@pytest.mark.parametrize("kind", ["pair", "square", "coupon", "cone pin"])
def test_arrow_of_a_radius_comes_from_its_text(kind, sheets):
    for dimension in sheets[kind].canvas.space.query("DIMENSION"):
        if dimension.dimtype != 4:  # DXF reference, group 70: a radius
            continue
        drawn = {entity.dxftype(): entity for entity in recursive_decompose([dimension])}
        arrow, text = drawn["SOLID"], drawn["MTEXT"]
        tip = dimension.dxf.defpoint4
        assert (arrow.dxf.vtx0 - tip).dot(text.dxf.insert - tip) > 0.0


def filled(sheet):
    """Return how much of the frame the boxes around views, title block and notes cover."""
    views = bbox.extents([entity for entity in sheet.canvas.space if entity.dxftype() != "INSERT"])
    left, bottom, right, _ = sheet.window
    low = bottom + 0.3 * (views.extmin.y - bottom)
    notes = [box for _, box in sheet.canvas.texts() if box.left < left + 0.4 * (right - left) and box.top < low]
    around = BoundingBox((x, y, 0.0) for box in notes for x, y in box.corners)
    width, height = SIZES[sheet.size]
    on_paper = sheet.canvas.scale**2
    block = 124.0 * 48.0 / on_paper
    boxes = views.size.x * views.size.y + around.size.x * around.size.y + block
    return on_paper * boxes / ((width - 30.0) * (height - 20.0))


@pytest.mark.parametrize("kind", KINDS)
def test_sheet_of_a_part_is_not_empty(kind, sheets):
    assert filled(sheets[kind]) > 0.3


@pytest.mark.slow
def test_revision_is_that_of_what_is_drawn(sensor):
    """The same drawing has the same revision; another size, another process or another part has another one."""

    def revision(housing, title):
        told = words(housing_drawing(sensor.part, housing, title))
        (found,) = (text for text in told if re.fullmatch(r"[0-9a-f]{8}", text))
        return found

    first = revision(sensor.housing, TITLE)
    assert revision(sensor.housing, TITLE) == first
    others = {
        revision(replace(sensor.housing, hole_diameter=3.5), TITLE),
        revision(sensor.housing, replace(TITLE, process=PROCESSES["fdm-pla"])),
        revision(sensor.housing, replace(TITLE, name="other")),
        first,
    }
    assert len(others) == 4


@pytest.mark.slow
def test_list_of_parts_has_every_part_of_the_assembly_with_a_balloon(sheets):
    told = Counter(text for text, _ in sheets["mango assembly"].canvas.texts())
    parts = {"housing", "cover", "mount", "screw", "nut", "washer", "dowel"}
    assert parts <= set(told)
    for number in range(1, len(parts) + 1):
        assert told[str(number)] >= 2  # in the list and in its balloon


@pytest.mark.parametrize("kind", ["square", "coupon", "cone pin"])
def test_files_hold_dimensions_and_size_and_a_part_drawn_again_the_same_bytes(kind, sheets, tmp_path):
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
    sheets[f"draw {kind}"]().write(tmp_path / "drawing")
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
        "legal owner",
        "paper-01",
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
    for _, box in canvas.texts():
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
        number = re.match(r"[\d.]+", re.sub(r"^\d+x \D?", "", text))
        if number and "±" not in text and "H7" not in text and float(number[0]) >= 0.5:
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
    assert {"2x R10", "2x Ø2.95, ream 3 H7"} <= square
    assert any("MAKE TWO" in text for text in square)
    assert not any("dome" in text or "MAKE TWO" in text for text in pair)
    circles = sheets["square"].canvas.space.query("CIRCLE")
    dowels = [hole.dxf.center for hole in circles if hole.dxf.radius == pytest.approx(0.5 * 2.95)]
    assert sorted((centre.x, centre.y) for centre in dowels) == [
        pytest.approx(dowel) for dowel in sorted(square_sensor().housing.dowels)
    ]


@pytest.mark.parametrize(
    ("kind", "beside"),
    [("cover", 2), ("coupon", 4), pytest.param("mango mount", 6, marks=pytest.mark.slow)],
)
def test_holes_have_centre_lines_in_every_view(kind, beside, sheets):
    """Beside two for each hole that is seen along its axis; the bracket has its two axes of the press too."""
    canvas = sheets[kind].canvas
    marks = len(canvas.space.query("CIRCLE"))
    assert len(canvas.space.query('LINE[layer=="AXES"]')) == 2 * marks + beside


def test_hidden_edges_of_a_cover_are_dashed(sheets, housing):
    """From its left: the bottom and the upper end of the recess, 1 mm deep, and both sides of holes at two levels."""
    dashes = sheets["cover"].canvas.space.query('LINE[layer=="HIDDEN"]')
    assert {dash.dxf.linetype for dash in dashes} == {"DASHED"}
    recess = housing.cavity_level + 1.0 - housing.cover_level
    hidden = sum(math.dist(dash.dxf.start, dash.dxf.end) for dash in dashes)
    assert hidden == pytest.approx(recess + 1.0 + 4.0 * 3.0, abs=0.02)
