import cadquery as cq
import numpy as np
import pytest
import trimesh

from cad.checks.part_checks import check_file
from cad.checks.triangle_checks import (
    closed_verdicts,
    narrowest_gap,
    thinnest_wall,
    widest_ledge,
)
from cad.files import stl
from cad.files.stl import write_stl
from sensor.design.processes import PROCESSES
from sensor.quantity import InputError

PETG = PROCESSES["fdm-petg"]
SINGLE = 1e-5  # [mm] single precision of an STL at 20 mm


def box(at=(0.0, 0.0, 0.0)):
    return trimesh.creation.box((20.0, 10.0, 5.0)).apply_translation(at)


def boxes(at):
    """Return the box and the same one beside it as one mesh."""
    return trimesh.util.concatenate([box(), box(at)])


def solid(x=20.0, y=10.0, z=5.0, at=(0.0, 0.0, 0.0)):
    return cq.Solid.makeBox(x, y, z, cq.Vector(*at))


def mesh_of(shape):
    return stl.triangles(shape)


def verdicts_of(path):
    return {verdict.name.removeprefix("geometry."): verdict for verdict in check_file(path)}


def checked(mesh, tmp_path):
    """Return the verdicts by name on a mesh written as STL and read back."""
    mesh.export(tmp_path / "part.stl")
    return verdicts_of(tmp_path / "part.stl")


def failures(verdicts):
    return {name for name, verdict in verdicts.items() if verdict.passed is not True}


def test_good_box_passes_with_its_numbers(tmp_path):
    verdicts = checked(box(), tmp_path)
    assert failures(verdicts) == set()
    assert verdicts["volume"].value == pytest.approx(20.0 * 10.0 * 5.0, rel=1e-6)
    assert verdicts["mass"].value == pytest.approx(1.0 * PETG.density_g_per_cm3, rel=1e-6)
    assert verdicts["min_wall"].value == pytest.approx(5.0, abs=SINGLE)
    assert verdicts["min_gap"].value is None
    assert verdicts["units"].value == pytest.approx(20.0, abs=SINGLE)


def opened():
    mesh = box()
    mesh.update_faces(np.arange(12) > 0)
    return mesh


def inside_out():
    mesh = box()
    mesh.invert()
    return mesh


@pytest.mark.parametrize(
    ("mesh", "failing", "values"),
    [
        (opened(), {"watertight"}, {"watertight": 3.0}),
        (boxes((20.0, 10.0, 0.0)), {"manifold"}, {"manifold": 1.0}),  # joined by one edge
        (boxes((40.0, 0.0, 0.0)), {"one_solid"}, {"one_solid": 2.0}),
        (boxes((13.0, 3.0, 2.0)), {"one_solid"}, {}),  # they cut through each other
        (box().apply_scale(1e-3), {"units", "min_wall"}, {"units": 0.02}),
        (box().apply_scale(1e3), {"units"}, {"units": 2e4}),
        (inside_out(), {"watertight", "volume", "mass"}, {"volume": -1000.0, "watertight": 1.0}),
        (
            trimesh.Trimesh([[0, 0, 0], [10, 0, 0], [0, 10, 0]], [[0, 1, 2]], process=False),
            {"watertight", "volume", "mass"},
            {"watertight": 3.0},
        ),
    ],
)
def test_planted_fault_fails(mesh, failing, values, tmp_path):
    verdicts = checked(mesh, tmp_path)
    assert failing <= failures(verdicts)
    assert {name: verdicts[name].value for name in values} == pytest.approx(values, rel=1e-6)


def test_turned_triangle_fails():
    mesh = box()
    mesh.faces[0] = mesh.faces[0][::-1]
    watertight, manifold = closed_verdicts(mesh)
    assert (watertight.passed, manifold.passed) == (False, True)


def plate_with_wall(thickness):
    """Return a block with a rib of the given thickness on it."""
    return mesh_of(solid().fuse(solid(thickness, 10.0, 6.0, (9.0, 0.0, 4.0))).clean())


def slotted(width):
    return mesh_of(solid().cut(solid(width, 20.0, 4.0, (8.0, -5.0, 2.0))))


def ledge(reach):
    """Return a block with a ledge that reaches out at half its height."""
    return mesh_of(solid().fuse(solid(reach, 10.0, 1.0, (20.0, 0.0, 2.0))).clean())


@pytest.mark.parametrize(
    ("name", "make", "value", "passes"),
    [
        ("min_wall", plate_with_wall, 0.3, False), ("min_wall", plate_with_wall, 0.79, False),
        ("min_wall", plate_with_wall, 0.8, True), ("min_gap", slotted, 0.2, False), ("min_gap", slotted, 0.3, True),
        ("overhang", ledge, 0.99, True), ("overhang", ledge, 1.01, False), ("overhang", ledge, 3.0, False),
    ],
)  # fmt: skip
def test_wall_gap_and_ledge_are_measured(name, make, value, passes, tmp_path):
    verdicts = checked(make(value), tmp_path)
    assert verdicts[name].value == pytest.approx(value, abs=SINGLE)
    assert failures(verdicts) == (set() if passes else {name})


def test_least_wall_and_gap_of_known_solids():
    small_face = solid().fuse(solid(0.3, 0.9, 0.9, (9.0, 4.0, 5.0))).clean()
    assert thinnest_wall(mesh_of(small_face)).length == pytest.approx(0.3, abs=SINGLE)
    wedge = cq.Workplane("XY").polyline([(0, 0), (20, 0), (0, 20)]).close().extrude(5).val()
    assert thinnest_wall(mesh_of(wedge)).length == pytest.approx(
        5.0, abs=SINGLE
    )  # its edge is thin, none of its walls is
    drilled = cq.Workplane("XY").box(20, 10, 5).faces(">Z").hole(3.0).val()
    assert narrowest_gap(mesh_of(drilled)).length == pytest.approx(3.0, abs=0.02)
    assert thinnest_wall(trimesh.creation.box((40.0, 40.0, 40.0))) is None
    assert narrowest_gap(box()) is None


@pytest.mark.parametrize(("slope", "limit", "width"), [(45.0, 45.0, 0.0), (60.0, 45.0, 8.660254), (60.0, 90.0, 0.0)])
def test_slope_beyond_the_limit_needs_support(slope, limit, width):
    reach = 5.0 * np.tan(np.radians(slope))
    outline = [(0, 0), (20, 0), (20 + reach, 5), (0, 5)]
    leaning = mesh_of(cq.Workplane("XZ").polyline(outline).close().extrude(10).val())
    assert widest_ledge(leaning, np.array([0.0, 0.0, 1.0]), limit) == pytest.approx(width, abs=SINGLE)


def test_step_is_checked_in_its_best_pose(tmp_path):
    mushroom = solid().fuse(solid(40.0, 10.0, 3.0, (-10.0, 0.0, 5.0))).clean()
    cq.exporters.export(cq.Workplane(obj=mushroom), str(tmp_path / "part.step"))
    assert failures(verdicts_of(tmp_path / "part.step")) == set()
    write_stl(mushroom, tmp_path / "part.stl")
    assert failures(verdicts_of(tmp_path / "part.stl")) == {"overhang"}


EMPTY_STEP = """ISO-10303-21;
HEADER;
FILE_DESCRIPTION((''),'2;1');
FILE_NAME('','',(''),(''),'','','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));
ENDSEC;
DATA;
ENDSEC;
END-ISO-10303-21;
"""


@pytest.mark.parametrize(
    ("kind", "text"), [("stl", "hello"), ("step", "hello"), ("3mf", "hello"), ("step", EMPTY_STEP)]
)
def test_file_that_cannot_be_read_fails(tmp_path, kind, text):
    (tmp_path / f"part.{kind}").write_text(text)
    assert failures(verdicts_of(tmp_path / f"part.{kind}")) == {"readable"}


def test_other_kinds_and_missing_files_are_refused(tmp_path):
    with pytest.raises(InputError) as refused:
        check_file(tmp_path / "part.obj")
    assert (refused.value.field, refused.value.value) == ("PATH", "part.obj")
    with pytest.raises(FileNotFoundError):
        check_file(tmp_path / "part.stl")
