import math
import xml.etree.ElementTree as ET
from dataclasses import replace

import ezdxf
import pytest
from cad.files.drafting import Arc, Line, Words, horizontal_dimension, write_dxf, write_svg
from cad.files.drawing import Title, gauge_marks, housing_drawing, section
from squares import square_sensor

from cad.design.processes import PROCESSES
from cad.parts.housing import fillet_corners
from cad.quantity import InputError

TITLE = Title(name="paper", process=PROCESSES["fdm-petg"])
SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def drawing(sensor):
    return housing_drawing(sensor.part, sensor.housing, TITLE)


def test_section_has_the_fillets_and_holes_of_the_housing(sensor):
    items = list(section(sensor.part.shape))
    fillets = [item for item in items if isinstance(item, Arc) and not item.closed]
    holes = [item for item in items if isinstance(item, Arc) and item.closed]
    assert len(fillets) == len(fillet_corners(sensor.housing))
    assert [item.radius for item in fillets] == pytest.approx([0.5] * len(fillets))
    assert all(item.end - item.start == pytest.approx(90.0) for item in fillets)
    assert sorted(item.centre for item in holes) == [pytest.approx(hole) for hole in sorted(sensor.housing.holes)]
    assert [item.radius for item in holes] == pytest.approx([0.5 * sensor.housing.hole_diameter] * 4)


def test_arcs_end_where_lines_start(sensor):
    items = list(section(sensor.part.shape))
    ends = [end for item in items if isinstance(item, Line) for end in (item.start, item.end)]
    for arc in (item for item in items if isinstance(item, Arc) and not item.closed):
        for turn in (arc.start, arc.end):
            x = arc.centre[0] + arc.radius * math.cos(math.radians(turn))
            z = arc.centre[1] + arc.radius * math.sin(math.radians(turn))
            assert min(math.dist((x, z), end) for end in ends) < 1e-6


def test_controlling_dimensions_and_tolerances_are_told(sensor, drawing):
    words = {item.text for item in drawing if isinstance(item, Words)}
    housing = sensor.housing
    assert words >= {
        f"L {housing.low.length:.3f} ±0.05", f"L {housing.high.length:.3f} ±0.05", "t 0.80±0.05 2x", "t 1.20±0.05 2x",
        "R 0.5 18x", "tips 8.000", "tip 1", "depth 6", "14", "stop low 0.75", "stop high 0.30", "dia 3.4 4x",
        f"{housing.right - housing.left:.3f}",
    }  # fmt: skip
    assert any("PETG" in text for text in words)


def test_another_leaf_is_another_dimension(sensor):
    housing = replace(sensor.housing, low=replace(sensor.housing.low, thickness=0.9))
    words = {item.text for item in housing_drawing(sensor.part, housing, TITLE) if isinstance(item, Words)}
    assert "t 0.90±0.05 2x" in words


def test_dxf_is_sound_in_millimetres_and_holds_every_item(drawing, tmp_path):
    write_dxf(drawing, tmp_path / "a.dxf")
    document = ezdxf.readfile(tmp_path / "a.dxf")
    assert document.audit().errors == []
    assert document.units == 4  # millimetres, DXF reference, $INSUNITS
    kinds = [entity.dxftype() for entity in document.modelspace()]
    assert len(kinds) == len(drawing)
    assert kinds.count("TEXT") == sum(isinstance(item, Words) for item in drawing)


def test_svg_holds_every_item_inside_its_frame(drawing, tmp_path):
    write_svg(drawing, tmp_path / "a.svg", "a <b>")
    root = ET.parse(tmp_path / "a.svg").getroot()
    left, top, width, height = (float(value) for value in root.get("viewBox").split())
    assert root.get("width") == f"{2.0 * width:.3f}mm"
    assert root.find(f"{SVG}title").text == "a <b>"
    group = root.find(f"{SVG}g")
    assert len(group) == len(drawing)
    for text in group.findall(f"{SVG}text"):
        assert left < float(text.get("x")) < left + width
        assert top < float(text.get("y")) < top + height


def test_same_bytes_again(drawing, tmp_path):
    for name in ("a", "b"):
        write_dxf(drawing, tmp_path / f"{name}.dxf")
        write_svg(drawing, tmp_path / f"{name}.svg", "paper")
    assert (tmp_path / "a.dxf").read_bytes() == (tmp_path / "b.dxf").read_bytes()
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


def test_arc_of_the_svg_bends_the_right_way(tmp_path):
    """A quarter from +x to +y, drawn with y down: from right to top, counter-clockwise on the screen."""
    write_svg([Arc(centre=(0.0, 0.0), radius=1.0, start=0.0, end=90.0)], tmp_path / "a.svg", "")
    (path,) = ET.parse(tmp_path / "a.svg").getroot().iter(f"{SVG}path")
    assert path.get("d") == "M1.0000 -0.0000A1.0000 1.0000 0 0 0 0.0000 -1.0000"


def test_dimension_spans_what_it_measures():
    lines = [item for item in horizontal_dimension((1.0, 4.0), 2.0, "3") if isinstance(item, Line)]
    line = max(lines, key=lambda item: item.end[0] - item.start[0])
    assert (line.start, line.end) == ((1.0, 2.0), (4.0, 2.0))


def test_marks_are_drawn_only_where_gauges_are_fitted(housing):
    assert list(gauge_marks(housing)) == []


def test_marks_stand_where_the_gauges_lie(housing):
    """Each gauge as a box 6 long on the faces of the upper leaf, 0.5 from a root, and 6 x 4 seen from above."""
    long = replace(housing, gauges="foil", high=replace(housing.high, length=14.0))
    items = list(gauge_marks(long))
    level = long.lower_leaf_level + 14.0
    wall, shuttle = long.arms[0].roots
    lines = [item for item in items if isinstance(item, Line) and item.layer == "NOTES"]
    drawn = [(*line.start, *line.end) for line in lines]
    for x0, x1 in ((wall + 0.5, wall + 6.5), (shuttle - 0.5, shuttle - 6.5)):
        for face in (level - 0.4, level + 0.4):
            assert any(found == pytest.approx((x0, face, x1, face)) for found in drawn)
    above = [line for line in lines if line.start[1] > long.top_level]
    wide = {round(abs(line.end[1] - line.start[1]), 6) for line in above} - {0.0}
    assert wide == {4.0, 3.0}
    words = [item.text for item in items if isinstance(item, Words)]
    assert "6 x 4" in words
    assert "grid 3 x 3" in words
    assert sum("GAUGE AT EACH ROOT" in text for text in words) == 2
    # In the middle of the depth of 6: from 1 to 5 of it.
    levels = {round(line.start[1] - long.top_level - 20.0, 6) for line in above}
    assert levels == {1.0, 1.5, 4.5, 5.0}


def test_marks_on_a_leaf_without_room_are_refused(housing):
    with pytest.raises(InputError, match=r"flexure\.length = 12\.5 mm: must be at least 13 mm"):
        list(gauge_marks(replace(housing, gauges="foil", high=replace(housing.high, length=12.5))))


def test_plate_of_a_square_tells_its_domes_its_dowels_and_that_two_are_made(drawing):
    square = square_sensor()
    words = [item.text for item in housing_drawing(square.part, square.housing, TITLE) if isinstance(item, Words)]
    assert {"dome R 10 2x", "dia 2.95 2x, dowels", "pads 0.2 high"} <= set(words)
    assert any("MAKE TWO" in text for text in words)
    pair = [item.text for item in drawing if isinstance(item, Words)]
    assert not any("dome" in text or "dowel" in text or "MAKE TWO" in text for text in pair)


def test_section_of_a_plate_of_a_square_has_its_dowels_and_its_domes():
    square = square_sensor()
    arcs = [item for item in section(square.part.shape) if isinstance(item, Arc)]
    dowels = [item for item in arcs if item.closed and item.radius == pytest.approx(0.5 * 2.95)]
    assert sorted(item.centre for item in dowels) == [pytest.approx(place) for place in sorted(square.housing.dowels)]
    domes = [item for item in arcs if item.radius == pytest.approx(10.0)]
    half = math.degrees(math.asin(0.5 * square.housing.tip_side / 10.0))
    for x in (-3.0, 3.0):
        own = [item for item in domes if item.centre == pytest.approx((x, 10.0))]
        assert sum(item.end - item.start for item in own) == pytest.approx(2.0 * half)
        assert min(item.start for item in own) == pytest.approx(270.0 - half)
