"""The drawing of the housing: each dimension once, no text on anything, true in DXF, SVG and PDF; what is measured."""

import itertools
import math
import re
import tomllib
import xml.etree.ElementTree as ET
import zlib
from collections import Counter
from dataclasses import replace
from pathlib import Path

import ezdxf
import pytest
import shapely
from ezdxf.disassemble import make_primitive, recursive_decompose
from squares import hall_square, square_housing, square_sensor

from cad.drawing.canvas import Canvas
from cad.drawing.housing_drawing import draw_housing_sheet
from cad.drawing.section import draw_section, section
from cad.drawing.sheet import SIZES, Title
from cad.parts.assembly import draw_sensor, finished_part
from cad.parts.housing import fillet_corners
from cad.parts.layout import housing_for
from sensor.design.design_file import design_from_mapping
from sensor.design.processes import PROCESSES

TITLE = Title(name="paper", process=PROCESSES["fdm-petg"])
ROOT = Path(__file__).parents[3]
POINTS = 72.0 / 25.4  # of a millimetre, PDF Reference 1.7, 4.2.1
DEFLECTIONS = (0.5, 0.1)  # [mm] of the springs at full travel
LENGTHS = (60.405, 39.939)  # [mm] of the leaves of the mango as they are fitted


def mango():
    """Return the sensor of a preset with its leaves as fitted, and its title."""
    design = design_from_mapping(tomllib.loads((ROOT / "designs/mango.toml").read_text(encoding="utf-8")))
    housing = housing_for(design, design.process, LENGTHS, (0.5, 0.2))
    return draw_sensor(design, housing), Title(name="mango", process=design.process)


class Sheets(dict):
    """Sheets by their kind, drawn when they are first asked for; `shown` gives the sensor of a kind and its title."""

    def __init__(self, shown):
        super().__init__()
        self.shown = shown

    def __missing__(self, kind):
        self[kind] = draw_housing_sheet(*self.shown[kind](), DEFLECTIONS)
        return self[kind]


@pytest.fixture(scope="module")
def sheets(sensor, pinned):
    return Sheets({
        "pair": lambda: (sensor, TITLE),
        "square": lambda: (hall_square(), TITLE),
        "long": lambda: (hall_square(square_housing(lengths=(50.0, 36.0))), TITLE),
        "pins": lambda: (pinned, TITLE),
        "mango": mango,
    })  # fmt: skip


KINDS = ["pair", "square", "pins", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("long", "mango"))]
FLAT_MM = 0.05  # by which a chord may leave its curve


def drawn_lines(canvas, *, sheet=True):
    """Return every line, arc, circle and arrow as shapely lines [mm], with the hatching and the block of the sheet."""
    lines = []
    for entity in recursive_decompose(entity for entity in canvas.space if sheet or entity.dxftype() != "INSERT"):
        if entity.dxftype() in ("TEXT", "MTEXT", "POINT"):
            continue
        path = make_primitive(entity, FLAT_MM).path
        points = [entity.dxf.start, entity.dxf.end] if path is None else list(path.flattening(FLAT_MM))
        lines.append(shapely.LineString([(point.x, point.y) for point in points]))
    return lines


def texts_on_something(sheet):
    """Return the texts that lie on another text or on a line; boxes are let in by a twentieth of their height."""
    boxes = []
    for text, box in sheet.canvas.find_texts():
        let_in = 0.05 * min(box.right - box.left, box.top - box.bottom)
        boxes.append((text, shapely.box(*box).buffer(-let_in)))
    tree = shapely.STRtree(drawn_lines(sheet.canvas))
    on_line = [text for text, box in boxes if len(tree.query(box, predicate="intersects"))]
    return on_line + [a for (a, one), (b, two) in itertools.combinations(boxes, 2) if one.intersects(two)]


def measured(canvas):
    """Return how often each length [mm] is measured."""
    return Counter(round(float(entity.get_measurement()), 6) for entity in canvas.space.query("DIMENSION"))


def words(sheet):
    return {text for text, _ in sheet.canvas.find_texts()}


def test_section_has_the_fillets_and_holes_of_the_housing(sensor):
    canvas = Canvas(1.0)
    draw_section(canvas, section(sensor.part.shape))
    fillets = list(canvas.space.query("ARC"))
    assert [arc.dxf.radius for arc in fillets] == pytest.approx([0.5] * len(fillet_corners(sensor.housing)))
    centres = sorted((hole.dxf.center.x, hole.dxf.center.y) for hole in canvas.space.query("CIRCLE"))
    assert centres == [pytest.approx(hole) for hole in sorted(sensor.housing.holes)]
    ends = [end for line in canvas.space.query("LINE") for end in (line.dxf.start, line.dxf.end)]
    for arc in fillets:  # they continue the lines: none is the other three quarters of its circle
        assert (arc.dxf.end_angle - arc.dxf.start_angle) % 360.0 == pytest.approx(90.0)
        assert all(min(math.dist(point, end) for end in ends) < 1e-6 for point in (arc.start_point, arc.end_point))


def dimensions_of(sensor):
    """Return every length [mm] that makes the housing: the frame, springs, tips, and what only some of them have."""
    housing, seats = sensor.housing, sensor.seats
    (x0, z0), (x1, z1) = housing.holes[0], housing.holes[-1]
    low, high = housing.arms
    lengths = [
        housing.low.length, housing.high.length, housing.low.thickness, housing.high.thickness,
        housing.low.separation, housing.depth, housing.low.fillet, housing.hole_diameter, housing.spacing,
        housing.lower_leaf_level, housing.shuttle_width, low.wall - housing.left,
        housing.right - housing.left, housing.top_level - housing.protrusion, housing.protrusion + housing.beyond_face,
        housing.top_level - housing.cavity_level, x1 - x0, z1 - z0, x0 - housing.left, z0 - housing.protrusion,
        housing.cavity_level - low.top_level, housing.cavity_level - high.top_level,
    ]  # fmt: skip
    if max(housing.depth, housing.shuttle_width) > housing.tip_side:
        lengths += [housing.tip_side, housing.neck_level, housing.tip_height]
    if housing.pin:
        lengths += [housing.pin.side, housing.pin.protruding_length]
    if housing.dome:
        lengths.append(housing.dome.radius)
    if plates := housing.back_to_back:
        (left, level), (right, _) = sorted(housing.dowels)
        foot = housing.cover_level - housing.protrusion
        lengths += [plates.pad_height, housing.wall_width - 1.0, housing.top_level - housing.cavity_level - 1.0, foot]
        lengths += [plates.dowel_hole, right - left, housing.right - right, level - housing.protrusion]
    if seats is not None:
        lengths += [seats.upper_disc, seats.lower_disc, seats.sensor_level, 2.5]  # the sensor is 2.5 mm from the discs
    return Counter(round(length, 6) for length in lengths)


@pytest.mark.parametrize("kind", KINDS)
def test_every_dimension_of_the_housing_stands_once(kind, sheets):
    """A mango's tips are as wide as their shuttles and as the plate is deep: they have no neck to measure."""
    sensor, _ = sheets.shown[kind]()
    assert measured(sheets[kind].canvas) == dimensions_of(sensor)


@pytest.mark.parametrize("kind", KINDS)
def test_no_text_lies_on_another_or_on_a_line_and_all_lie_on_the_sheet(kind, sheets):
    sheet = sheets[kind]
    window = sheet.window
    assert texts_on_something(sheet) == []
    assert all(shapely.box(*window).contains(shapely.box(*box)) for _, box in sheet.canvas.find_texts())
    scale = sheet.canvas.scale
    size = (scale * (window.right - window.left), scale * (window.top - window.bottom))
    assert size == pytest.approx(SIZES[sheet.size])
    # the views are 4 mm off the frame, which is 20 mm off the left edge and 10 mm off the others (ISO 5457)
    views = shapely.total_bounds(drawn_lines(sheet.canvas, sheet=False))
    distances = [scale * abs(edge - end) for edge, end in zip(window, views, strict=True)]
    assert all(distance >= least for distance, least in zip(distances, (24.0, 14.0, 14.0, 14.0), strict=True))


@pytest.mark.slow
def test_revision_is_that_of_what_is_drawn(sensor):
    """The same drawing has the same revision; another size, another process or another name has another one."""

    def revision(sensor, title):
        told = words(draw_housing_sheet(sensor, title, DEFLECTIONS))
        (found,) = (text for text in told if re.fullmatch(r"[0-9a-f]{8}", text))
        return found

    other_housing = replace(sensor.housing, hole_diameter=3.5)
    other = replace(sensor, housing=other_housing, part=finished_part(other_housing))
    titles = (TITLE, TITLE, replace(TITLE, process=PROCESSES["fdm-pla"]), replace(TITLE, name="other"))
    found = [revision(sensor, title) for title in titles]
    assert found[0] == found[1]
    assert len({*found, revision(other, TITLE)}) == 4


def test_files_hold_dimensions_and_size_and_a_part_drawn_again_the_same_bytes(sheets, sensor, tmp_path):
    sheet = sheets["pair"]
    dxf, svg, pdf = sheet.write(tmp_path / "drawing")
    document = ezdxf.readfile(dxf)
    assert document.audit().errors == []
    assert document.units == 4  # millimetres, DXF reference, $INSUNITS
    dimensions = list(document.modelspace().query("DIMENSION"))
    assert Counter(round(float(entity.get_measurement()), 6) for entity in dimensions) == measured(sheet.canvas)
    assert all("<>" in entity.dxf.text for entity in dimensions)  # none has a text of its own for its value
    root = ET.parse(svg).getroot()
    assert (root.get("width"), root.get("height")) == tuple(f"{side:.0f}mm" for side in SIZES[sheet.size])
    before = [path.read_bytes() for path in (dxf, svg, pdf)]
    draw_housing_sheet(sensor, TITLE, DEFLECTIONS).write(tmp_path / "drawing")
    assert [path.read_bytes() for path in (dxf, svg, pdf)] == before


def make_page(file):
    """Return the size [points] of the page of a PDF file, and its operators, found by its table of offsets."""
    table = int(re.search(rb"startxref\n(\d+)\n%%EOF", file)[1])
    objects = [file[int(line[:10]) :] for line in file[table:].splitlines()[3:7]]
    assert [int(each.split()[0]) for each in objects] == [1, 2, 3, 4]
    size = re.search(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", objects[2])
    length = int(re.search(rb"/Length (\d+)", objects[3])[1])
    operators = objects[3].partition(b"stream\n")[2][:length]
    return [float(side) for side in size.groups()], zlib.decompress(operators).decode()


def test_pdf_page_has_the_size_of_the_sheet_and_the_lines_of_the_part_in_their_places(sheets, sensor, tmp_path):
    """The upper edge of the frame is a line of 0.5 mm where the scale of the sheet puts it on the page."""
    sheet = sheets["pair"]
    size, operators = make_page(sheet.write(tmp_path / "drawing")[2].read_bytes())
    assert size == pytest.approx([side * POINTS for side in SIZES[sheet.size]], abs=0.01)
    unit = sheet.canvas.scale * POINTS
    housing = sensor.housing
    top = unit * (housing.top_level - sheet.window.bottom)
    ends = sorted(unit * (x - sheet.window.left) for x in (housing.left, housing.right))
    lines = re.findall(rf"^{0.5 * POINTS:.2f} w (\S+) (\S+) m (\S+) (\S+) l S$", operators, re.MULTILINE)
    level = [sorted((float(x), float(end))) for x, z, end, end_z in lines if float(z) == pytest.approx(top, abs=0.011)]
    assert any(line == pytest.approx(ends, abs=0.011) for line in level)


def test_title_block_says_what_a_workshop_asks(sheets, monkeypatch, sensor):
    title = words(sheets["pair"])
    assert title >= {
        "paper: housing",
        "PETG",
        "fdm-petg",
        "±0.2",
        "2:1",
        "A3 1/1",
        "date",
        "first angle",
        "legal owner",
        "paper-01",
    }
    assert not any(re.fullmatch(r"\d{4}-\d\d-\d\d", text) for text in title)  # no day is made up
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    metal = replace(TITLE, process=PROCESSES["dmls-ti64"])
    title = words(draw_housing_sheet(sensor, metal, DEFLECTIONS))
    assert title >= {"1970-01-02", "Ti-6Al-4V", "ISO 2768-1 m"}


@pytest.mark.parametrize("kind", ["pair", "square"])
def test_section_is_hatched_and_holes_have_centre_lines(kind, sheets, sensor):
    """Strokes lie on the plate alone, 2 mm apart on paper, and in no window between leaves."""
    canvas = sheets[kind].canvas
    shown = square_sensor() if kind == "square" else sensor
    housing = shown.housing
    strokes = [(line.dxf.start, line.dxf.end) for line in canvas.space.query('LINE[layer=="HATCH"]')]
    pad = housing.back_to_back.pad_height if housing.back_to_back else 0.0
    section_area = shown.part.shape.Volume() / (housing.depth + 0.3 * pad)
    hatched = sum(math.dist(start, end) for start, end in strokes) * 2.0 / canvas.scale
    assert 0.8 * section_area < hatched < 1.02 * section_area
    views = 2 if housing.back_to_back else 1  # along the axes of its holes
    holes = views * (len(housing.holes) + len(housing.dowels))
    axes = canvas.space.query('LINE[layer=="AXES"]')
    assert len(axes) == 2 * holes
    assert {axis.dxf.linetype for axis in axes} == {"CENTER"}
    assert words(sheets[kind]) >= {"A", "A-A"}


def test_lengths_of_the_general_tolerance_are_rounded_and_those_of_the_table_are_not(sheets):
    """±0.2 on the third decimal is no size that a shop can measure; under 0.5 mm ISO 2768-1 has no tolerance."""
    decimals = Counter()
    for dimension in sheets["square"].canvas.space.query("DIMENSION"):
        (text,) = (entity.plain_text() for entity in dimension.virtual_entities() if entity.dxftype() == "MTEXT")
        number = re.fullmatch(r"(\w\) )?(\d+x )?([\d.]+)", text)
        if number and float(number[3]) >= 0.5:
            decimals[bool(number[1]), len(number[3].partition(".")[2])] += 1
    assert {digits for in_table, digits in decimals if not in_table} == {0, 1}
    assert {digits for in_table, digits in decimals if in_table} == {0, 1, 2}


@pytest.mark.parametrize(
    ("kind", "told"),
    [("pair", set()), ("square", {"2x Ø2.95", ") 2x SR10", "MAKE TWO", "Magnets"}), ("pins", {"h8"})],
)
def test_sheet_tells_domes_dowels_magnets_pins_and_that_two_are_made_where_it_is_so(kind, told, sheets):
    every = ("2x Ø2.95", ") 2x SR10", "MAKE TWO", "Magnets", "h8")
    assert {part for part in every if any(part in text for text in words(sheets[kind]))} == told


def straight_edges(face):
    """Return the ends (x, z) of the straight edges of a face across y [mm]."""
    edges = [edge for edge in face.Edges() if edge.geomType() == "LINE"]
    return [[(point.x, point.z) for point in (edge.startPoint(), edge.endPoint())] for edge in edges]


def seen_from_behind(sheet, sensor):
    """Return the lines of the part below the other views [mm], put back into the frame of the plate."""
    lines = [line.dxf for line in sheet.canvas.space.query('LINE[layer=="PART"]')]
    box = sensor.part.shape.BoundingBox()
    below = [line for line in lines if max(line.start.y, line.end.y) < -2.0 and line.start.x < box.xmax + 2.0]
    ends = [point for line in below for point in (line.start, line.end)]
    right = max(point.x for point in ends) + box.xmin
    top = max(point.y for point in ends) - box.zmax
    return [[(right - point.x, point.y - top) for point in (line.start, line.end)] for line in below]


@pytest.mark.parametrize("kind", ["square", pytest.param("mango", marks=pytest.mark.slow)])
def test_view_from_behind_shows_the_pads(kind, sheets):
    """Every straight edge of the faces that stand out farthest behind is drawn, mirrored."""
    sensor, _ = sheets.shown[kind]()
    box = sensor.part.shape.BoundingBox()
    pads = [face for face in sensor.part.shape.Faces() if face.BoundingBox().ymin > box.ymax - 1e-6]
    assert sum(face.Area() for face in pads) > 0.2 * box.xlen * box.zlen
    seen = shapely.union_all([shapely.LineString(line) for line in seen_from_behind(sheets[kind], sensor)]).buffer(1e-3)
    edges = [edge for face in pads for edge in straight_edges(face)]
    assert len(edges) >= 8
    assert all(seen.contains(shapely.LineString(edge)) for edge in edges)
    assert {"PAD", "FROM BEHIND"} <= words(sheets[kind])
    assert "PAD" not in words(sheets["pair"])


def test_magnets_are_drawn_where_the_sheet_says(sheets):
    """Two pockets on the axis of each tip."""
    sensor = hall_square()
    discs = [circle.dxf for circle in sheets["square"].canvas.space.query('CIRCLE[layer=="NOTES"]')]
    in_section = sorted((disc.center.x, disc.center.y) for disc in discs if disc.radius == pytest.approx(1.05))
    levels = [sensor.housing.top_level - below for below in (sensor.seats.lower_disc, sensor.seats.upper_disc)]
    assert in_section == [pytest.approx((x, z)) for x in (-3.0, 3.0) for z in levels]
    edges = [(line.dxf.start, line.dxf.end) for line in sheets["square"].canvas.space.query('LINE[layer=="NOTES"]')]
    pockets = shapely.polygonize([shapely.LineString([(p.x, p.y) for p in edge]) for edge in edges]).geoms
    boxes = sorted((pocket.bounds for pocket in pockets), key=lambda box: box[1])
    assert [(box[1], box[3]) for box in boxes] == [pytest.approx((z - 1.05, z + 1.05)) for z in levels]
    assert [box[2] - box[0] for box in boxes] == pytest.approx([1.0, 1.0])  # from the left they are as deep as a magnet
