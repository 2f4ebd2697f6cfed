import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from squares import square_housing, square_sensor

from cad.checks.triangle_checks import printability_verdicts
from cad.files.stl import triangles
from cad.parts.engraving import (
    PEN_MM,
    engrave_name,
    outlines,
    strokes,
)
from cad.parts.housing import ENGRAVED_MM, SETBACK_MM
from cad.parts.housing_solid import housing_part
from cad.parts.pose import print_pose
from sensor.design.processes import PROCESSES

NAME_LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_"


def test_every_sign_of_a_name_has_strokes_of_its_own_on_the_grid_at_multiples_of_45_degrees():
    drawn = {letter: strokes(letter, 6.0) for letter in NAME_LETTERS}
    assert len({frozenset(each) for each in drawn.values()}) == len(NAME_LETTERS)
    for stroke in itertools.chain.from_iterable(drawn.values()):
        steps = np.abs(np.diff(stroke, axis=0))
        assert all(x == 0.0 or z == 0.0 or x == z for x, z in steps)
        assert (np.abs(stroke) <= (2.0, 3.0)).all()


def test_marks_take_away_what_the_pen_covers_on_the_frame_and_keep_the_names(sensor):
    """What is cut away lies beside or above the cavity, where nothing bends, and clear of the holes."""
    part, housing = sensor.part, sensor.housing
    cut = engrave_name(part, housing, "paper")
    areas = [area for text, high in (("paper", 6.0 - PEN_MM - 2.0), ("L", 4.0), ("H", 4.0))
             for area in outlines(text, high, PEN_MM)]  # fmt: skip
    covered = sum(area.area for area in areas)
    assert cut.shape.isValid()
    kept = {name: part.face_area(name) for name in part.faces}
    kept["side_faces"] -= covered
    assert {name: cut.face_area(name) for name in cut.faces} == pytest.approx(kept)
    gone = part.shape.cut(cut.shape)
    assert gone.Volume() == pytest.approx(ENGRAVED_MM * covered, rel=1e-6)
    wall, shuttle = (arm.wall for arm in housing.arms)
    for solid in gone.Solids():
        box = solid.BoundingBox()
        assert box.xmax < wall or box.xmin > shuttle or box.zmin > housing.cavity_level
        assert box.ymin == pytest.approx(-0.5 * housing.depth, abs=1e-6)
        for x, z in housing.holes:
            near = (min(max(x, box.xmin), box.xmax), min(max(z, box.zmin), box.zmax))
            assert math.dist((x, z), near) > 0.5 * housing.hole_diameter + 0.8


@pytest.mark.parametrize(
    "name",
    [NAME_LETTERS[:1], *(pytest.param(NAME_LETTERS[a:b], marks=pytest.mark.slow) for a, b in ((1, 20), (20, 38)))],
)
def test_marked_housing_can_be_printed(sensor, name):
    part = engrave_name(sensor.part, sensor.housing, name)
    mesh = triangles(print_pose(part.shape))
    findings = printability_verdicts(mesh, PROCESSES["sls-pa12"], ("as it stands",))
    wall, gap, overhang = findings
    assert (wall.passed, overhang.passed) == (True, True)
    assert gap.value == pytest.approx(0.3, abs=1e-4)  # the stop of this housing, not a letter


def test_bar_that_is_too_low_stays_blank(sensor):
    low = replace(sensor.housing, top_level=sensor.housing.cavity_level + 5.0)
    part = housing_part(low)
    assert engrave_name(part, low, "paper").shape.Volume() == pytest.approx(
        engrave_name(part, low, "").shape.Volume(), rel=1e-12
    )


def test_marks_of_a_plate_of_a_square_lie_on_its_pads_and_are_read_from_its_back():
    """They end 0.3 mm under the pads, a printable wall of 0.8 mm from the edges of the pad on the bar."""
    housing = square_housing()
    plain, marks = square_sensor(housing).part, square_sensor(housing).printed_part()
    taken = plain.shape.cut(marks.shape)
    box = taken.BoundingBox()
    top = 0.5 * housing.depth + housing.back_to_back.pad_height
    assert (box.ymin, box.ymax) == (pytest.approx(top - ENGRAVED_MM), pytest.approx(top))
    letters = [solid.BoundingBox() for solid in taken.Solids()]
    on_bar = [one for one in letters if one.zmin > housing.cavity_level]
    assert len(on_bar) >= len("GENTLE")  # a longer name is cut short
    assert min(one.zmin for one in on_bar) >= housing.cavity_level + SETBACK_MM + 0.8 - 1e-6
    assert max(one.zmax for one in on_bar) <= housing.top_level - 0.8 + 1e-6
    # An L has its stem on the left as it is read: on the right of its box, towards +x, when seen from the front.
    low = next(solid for solid in taken.Solids() if solid.BoundingBox().xmax < housing.arms[0].wall)
    assert low.Center().x > low.BoundingBox().center.x
