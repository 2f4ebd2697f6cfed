"""A part that the user made: what is refused before it is solved, its faces by points, its section and its sweep."""

import cadquery as cq
import numpy as np
import pytest

from cad.checks.own_part import faces_at, find_extrusion, own_part, read_own_solid, require_one_solid
from sensor.quantity import InputError

PLATE = cq.Workplane("XZ").rect(40.0, 20.0).extrude(6.0)


def shell():
    """Return five of the six faces of a box."""
    faces = cq.Workplane().box(20.0, 20.0, 20.0).faces().vals()
    return cq.Shell.makeShell(faces[:5])


BAD = {
    "two bodies": (PLATE.union(PLATE.translate((100.0, 0.0, 0.0))).val(), "one body"),
    "open": (shell(), "one closed solid"),
    "no solid": (PLATE.faces("<Z").val(), "one closed solid"),
    "in inches": (PLATE.val().scale(1.0 / 25.4), "in millimetres"),
    "too large": (PLATE.val().scale(50.0), "5 to 1000 mm long"),
    "too small": (PLATE.val().scale(0.1), "5 to 1000 mm long"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_not_one_part_in_millimetres_is_refused(case, small_housing):
    shape, bound = BAD[case]
    with pytest.raises(InputError) as refused:
        require_one_solid(shape, "part.step", small_housing if case == "in inches" else None)
    assert refused.value.bound.startswith(bound)


@pytest.fixture
def small_housing():
    """Stand for a housing that is as long as the plate."""

    class _Housing:
        left, right = -20.0, 20.0

    return _Housing()


def test_a_file_without_a_shape_is_refused(tmp_path):
    path = tmp_path / "empty.step"
    path.write_text("ISO-10303-21;\nEND-ISO-10303-21;\n", encoding="ascii")
    with pytest.raises(InputError, match=r"empty\.step"):
        read_own_solid(path)


def test_a_point_names_the_face_it_lies_on_and_a_round_wall_is_whole():
    solid = PLATE.faces("<Y").workplane().hole(4.0).val()
    (bottom,) = faces_at(solid, "--pressed", [(5.0, -3.0, -10.0)])
    assert solid.Faces()[bottom].Center().z == pytest.approx(-10.0)
    (hole,) = faces_at(solid, "--held", [(2.0, -3.0, 0.0)])
    assert solid.Faces()[hole].geomType() == "CYLINDER"


def test_a_point_on_no_face_is_refused_with_its_distance():
    with pytest.raises(InputError) as refused:
        faces_at(PLATE.val(), "--pressed", [(0.0, -3.0, -12.0)])
    assert (refused.value.field, refused.value.value) == ("--pressed", "0,-3,-12")
    assert "2 mm away" in refused.value.bound


@pytest.mark.parametrize("axis", ["XY", "XZ", "YZ"])
def test_a_plate_is_swept_along_its_depth(axis):
    solid = cq.Workplane(axis).rect(40.0, 20.0).circle(5.0).extrude(6.0).val()
    swept = find_extrusion(own_part(solid, {}))
    assert swept is not None
    assert swept.high - swept.low == pytest.approx(6.0)
    assert swept.section.Area() == pytest.approx(800.0 - np.pi * 25.0)


def test_a_ball_on_a_stick_is_not_swept():
    solid = cq.Workplane().sphere(10.0).union(cq.Workplane().circle(2.0).extrude(30.0)).val()
    assert find_extrusion(own_part(solid, {})) is None


BRIDGES = {
    "on the front": cq.Workplane("XZ", origin=(0.0, -6.0, 0.0)).rect(4.0, 16.0).extrude(1.0),
    "slanted": cq.Workplane("YZ").polyline([(-5.8, -7.0), (-5.2, -7.0), (-3.4, 7.0), (-4.0, 7.0)]).close().extrude(2.0),
}


@pytest.mark.parametrize("bridge", BRIDGES.values(), ids=BRIDGES)
def test_a_bridge_beside_the_section_is_not_swept(bridge):
    """It crosses the window of a frame, in which the section through the middle has nothing."""
    frame = PLATE.cut(cq.Workplane("XZ").rect(30.0, 10.0).extrude(6.0))
    assert find_extrusion(own_part(frame.val(), {})) is not None
    assert find_extrusion(own_part(frame.union(bridge).val(), {})) is None


def test_lines_along_the_sweep_know_pockets():
    solid = PLATE.faces("<Y").workplane().hole(4.0, 2.0).val()
    swept = find_extrusion(own_part(solid, {}))
    low, high, inside = swept.material_spans(np.array([0.0, 10.0, 90.0]), np.array([0.0, 5.0, 0.0]))
    assert inside == pytest.approx([4.0, 6.0, 0.0])
    assert (high - low)[1] == pytest.approx(6.0)
