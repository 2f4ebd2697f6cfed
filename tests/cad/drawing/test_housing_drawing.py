"""Drawings of housing, coupon and cover: each dimension once, no text on another, true in DXF and in SVG."""

import itertools
import math
import re
import xml.etree.ElementTree as ET
from collections import Counter
from dataclasses import replace

import ezdxf
import pytest
from squares import square_sensor

from cad.design.processes import PROCESSES
from cad.drawing.coupon_drawing import coupon_drawing
from cad.drawing.cover_drawing import cover_drawing
from cad.drawing.dxf import write_dxf
from cad.drawing.gauge_views import gauge_views
from cad.drawing.housing_drawing import housing_drawing
from cad.drawing.items import Arc, Dimension, Line, Words, overlap
from cad.drawing.section import section
from cad.drawing.sheet import SIZES, Title
from cad.drawing.svg import write_svg
from cad.parts.coupon import coupon_of
from cad.parts.coupon_solid import coupon_part
from cad.parts.cover_solid import cover_of, cover_part
from cad.parts.housing import fillet_corners
from cad.parts.housing_solid import housing_part
from cad.quantity import InputError

TITLE = Title(name="paper", process=PROCESSES["fdm-petg"])
SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def drawing(sensor):
    return housing_drawing(sensor.part, sensor.housing, TITLE)


@pytest.fixture(scope="module")
def sheets(sensor, drawing):
    """Return drawings of every kind: pair, plate of a square, gauges, pins, coupon, cover."""
    square = square_sensor()
    long = replace(sensor.housing, gauges="foil", high=replace(sensor.housing.high, length=14.0))
    coupon, cover = coupon_of(sensor.housing), cover_of(sensor)
    pinned = replace(sensor.housing, tip_side=3.8, pin_side=1.0, pin_out=1.0, pocket_side=1.1, pocket_depth=3.0)
    return {
        "pair": drawing,
        "square": housing_drawing(square.part, square.housing, TITLE),
        "gauges": housing_drawing(housing_part(long), long, TITLE),
        "pins": housing_drawing(sensor.part, pinned, TITLE),
        "coupon": coupon_drawing(coupon_part(coupon), coupon, replace(TITLE, part="coupon")),
        "cover": cover_drawing(cover_part(cover), cover, replace(TITLE, part="cover")),
    }


def texts(sheet):
    return [
        item.words if isinstance(item, Dimension) else item
        for item in sheet.items
        if isinstance(item, Dimension | Words)
    ]


def dimensions(sheet):
    return [item for item in sheet.items if isinstance(item, Dimension)]


def overlapping(sheet):
    return [(a.text, b.text) for a, b in itertools.combinations(texts(sheet), 2) if overlap(a.box, b.box)]


def test_section_has_the_fillets_and_holes_of_the_housing(sensor):
    items = list(section(sensor.part.shape))
    fillets = [item for item in items if isinstance(item, Arc) and not item.closed]
    holes = [item for item in items if isinstance(item, Arc) and item.closed]
    assert len(fillets) == len(fillet_corners(sensor.housing))
    assert [item.radius for item in fillets] == pytest.approx([0.5] * len(fillets))
    assert all(item.end - item.start == pytest.approx(90.0) for item in fillets)
    assert sorted(item.centre for item in holes) == [pytest.approx(hole) for hole in sorted(sensor.housing.holes)]
    ends = [end for item in items if isinstance(item, Line) for end in (item.start, item.end)]
    assert all(min(math.dist(point, end) for end in ends) < 1e-6 for arc in fillets for point in arc.ends)


def test_every_dimension_of_the_housing_stands_once(sensor, drawing):
    """By kind and value: leaves, separation, fillet, tips, holes and their places, outer sizes, stops."""
    housing = sensor.housing
    (x0, z0), (x1, z1) = housing.holes[0], housing.holes[-1]
    low, high = housing.arms
    wanted = Counter(
        (kind, round(value, 6))
        for kind, value in (
            ("x", housing.low.length), ("x", housing.high.length), ("z", housing.low.thickness),
            ("z", housing.high.thickness), ("z", housing.low.separation), ("x", housing.depth),
            ("radius", housing.low.fillet), ("diameter", housing.hole_diameter), ("x", housing.spacing),
            ("x", housing.tip_side), ("z", housing.tip_height), ("z", housing.neck_level),
            ("z", housing.lower_leaf_level), ("x", housing.shuttle_width), ("x", housing.wall_width),
            ("x", housing.right - housing.left), ("z", housing.top_level - housing.protrusion),
            ("z", housing.protrusion), ("z", housing.top_level - housing.cavity_level),
            ("x", x1 - x0), ("z", z1 - z0), ("x", x0 - housing.left), ("z", z0 - housing.protrusion),
            ("z", housing.cavity_level - low.top_level), ("z", housing.cavity_level - high.top_level),
        )
    )  # fmt: skip
    assert Counter((item.kind, round(item.measured, 6)) for item in dimensions(drawing)) == wanted


@pytest.mark.parametrize("name", ["pair", "square", "gauges", "pins", "coupon", "cover"])
def test_no_text_lies_on_another_and_all_lie_in_the_frame(name, sheets):
    sheet = sheets[name]
    assert overlapping(sheet) == []
    left, bottom, right, top = sheet.window
    assert all(
        left < box[0] and bottom < box[1] and box[2] < right and box[3] < top
        for box in (words.box for words in texts(sheet))
    )
    size = [sheet.factor * (right - left), sheet.factor * (top - bottom)]
    assert size == pytest.approx(SIZES[sheet.size])


def test_planted_overlap_is_seen(drawing):
    first = dimensions(drawing)[0]
    assert overlapping(replace(drawing, items=(*drawing.items, replace(first, label="<>")))) != []


@pytest.mark.parametrize("name", ["pair", "square", "coupon", "cover"])
def test_dxf_dimensions_measure_what_they_show(name, sheets, tmp_path):
    """DIMENSION entities of DXF, without a text of their own in the place of the value."""
    write_dxf(sheets[name].items, tmp_path / "a.dxf")
    document = ezdxf.readfile(tmp_path / "a.dxf")
    assert document.audit().errors == []
    assert document.units == 4  # millimetres, DXF reference, $INSUNITS
    found = sorted(round(entity.get_measurement(), 6) for entity in document.modelspace().query("DIMENSION"))
    assert found == sorted(round(item.measured, 6) for item in dimensions(sheets[name]))
    assert all("<>" in entity.dxf.text for entity in document.modelspace().query("DIMENSION"))


def test_another_leaf_is_another_dimension(sensor):
    housing = replace(sensor.housing, low=replace(sensor.housing.low, thickness=0.9))
    words = {item.text for item in texts(housing_drawing(sensor.part, housing, TITLE))}
    assert "0.9 ±0.05" in words
    assert "0.8 ±0.05" not in words


def test_title_block_says_what_a_workshop_asks(drawing, monkeypatch, sensor):
    words = {item.text for item in texts(drawing)}
    assert words >= {"paper: housing", "PETG", "fdm-petg", "±0.2", "2:1", "A4 1/1", "date", "first angle"}
    assert not any(re.fullmatch(r"\d{4}-\d\d-\d\d", word) for word in words)  # no day is made up
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    metal = replace(TITLE, process=PROCESSES["dmls-ti64"])
    words = {item.text for item in texts(housing_drawing(sensor.part, sensor.housing, metal))}
    assert words >= {"1970-01-02", "Ti-6Al-4V", "ISO 2768-1 m"}


def test_svg_shows_every_item_at_the_scale_of_its_sheet(drawing, tmp_path):
    write_svg(drawing.items, tmp_path / "a.svg", "a <b>", drawing.window, drawing.factor)
    root = ET.parse(tmp_path / "a.svg").getroot()
    assert (root.get("width"), root.get("height")) == ("297.000mm", "210.000mm")
    assert root.find(f"{SVG}title").text == "a <b>"
    assert len(root.find(f"{SVG}g")) == len(drawing.items)


def test_same_bytes_again(drawing, tmp_path):
    for name in ("a", "b"):
        write_dxf(drawing.items, tmp_path / f"{name}.dxf")
        write_svg(drawing.items, tmp_path / f"{name}.svg", "paper", drawing.window, drawing.factor)
    assert (tmp_path / "a.dxf").read_bytes() == (tmp_path / "b.dxf").read_bytes()
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


def test_arc_of_the_svg_bends_the_right_way(tmp_path):
    """A quarter from +x to +y, drawn with y down: from right to top, counter-clockwise on the screen."""
    arc = Arc(centre=(0.0, 0.0), radius=1.0, start=0.0, end=90.0)
    write_svg([arc], tmp_path / "a.svg", "", (-2.0, -2.0, 2.0, 2.0), 1.0)
    (path,) = ET.parse(tmp_path / "a.svg").getroot().iter(f"{SVG}path")
    assert path.get("d") == "M1.0000 -0.0000A1.0000 1.0000 0 0 0 0.0000 -1.0000"


def test_gauges_are_drawn_where_they_lie_and_only_where_they_are_fitted(housing):
    """Each as a box 6 long on both faces of the upper leaf, 0.5 from a root, and 6 x 4 seen from above."""
    assert list(gauge_views(housing, 40.0, 2.0)) == []
    long = replace(housing, gauges="foil", high=replace(housing.high, length=14.0))
    items = list(gauge_views(long, 40.0, 2.0))
    wall, shuttle = long.arms[0].roots
    level = long.lower_leaf_level + 14.0
    drawn = [(*line.start, *line.end) for line in items if isinstance(line, Line) and line.layer == "NOTES"]
    for x0, x1 in ((wall + 0.5, wall + 6.5), (shuttle - 6.5, shuttle - 0.5)):
        assert any(found == pytest.approx((x0, level + 0.4, x1, level + 0.4)) for found in drawn)
    measured = Counter(round(item.measured, 6) for item in items if isinstance(item, Dimension))
    assert measured == {0.5: 2, 6.0: 2, 3.0: 3, 4.0: 1}
    with pytest.raises(InputError, match=r"flexure\.length = 12\.5 mm: must be at least 13 mm"):
        list(gauge_views(replace(long, high=replace(housing.high, length=12.5)), 40.0, 2.0))


def test_plate_of_a_square_tells_its_domes_its_dowels_and_that_two_are_made(sheets):
    words = {item.text for item in texts(sheets["square"])}
    assert {"R10 2x, domes", "Ø2.95 2x, dowels"} <= words
    assert any("MAKE TWO" in text for text in words)
    assert not any("dome" in item.text or "MAKE TWO" in item.text for item in texts(sheets["pair"]))
    arcs = [item for item in section(square_sensor().part.shape) if isinstance(item, Arc)]
    dowels = [item for item in arcs if item.closed and item.radius == pytest.approx(0.5 * 2.95)]
    assert sorted(item.centre for item in dowels) == [
        pytest.approx(place) for place in sorted(square_sensor().housing.dowels)
    ]
