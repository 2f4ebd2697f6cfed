import cadquery as cq
import numpy as np
import pytest
import trimesh

from cad.checks.overhang import widest_ledge
from cad.checks.part_checks import check_file, check_mesh
from cad.checks.self_intersection import crossing_pairs
from cad.checks.triangle_checks import closed_verdicts, library_mesh
from cad.checks.wall_thickness import least_gap, least_wall
from cad.design.processes import PROCESSES
from cad.files import stl
from cad.files.stl import write_stl
from cad.files.threemf import write_3mf
from cad.quantity import InputError
from cad.triangles import Triangles

PETG = PROCESSES["fdm-petg"]
SINGLE = 1e-5  # [mm] single precision of an STL at 20 mm


@pytest.fixture(autouse=True)
def _no_slicer(monkeypatch):
    monkeypatch.setattr("cad.checks.slicer.NAME", "a-slicer-that-nobody-has")


def box(x=20.0, y=10.0, z=5.0):
    return trimesh.creation.box((x, y, z))


def solid(x=20.0, y=10.0, z=5.0, at=(0.0, 0.0, 0.0)):
    return cq.Solid.makeBox(x, y, z, cq.Vector(*at))


def judged(mesh, tmp_path):
    """Return the findings by name on a mesh written as STL and read back."""
    path = tmp_path / "part.stl"
    mesh.export(path)
    return {finding.name: finding for finding in check_file(path)}


def triangles(shape):
    return library_mesh(stl.triangles(shape))


def triangles_of(mesh):
    return Triangles(vertices=np.asarray(mesh.vertices), faces=np.asarray(mesh.faces))


def failures(findings):
    return {name.removeprefix("geometry.") for name, finding in findings.items() if finding.passed is not True}


def test_good_box_passes_with_its_numbers(tmp_path):
    found = judged(box(), tmp_path)
    assert failures(found) == set()
    assert found["geometry.volume"].value == pytest.approx(20.0 * 10.0 * 5.0, rel=1e-6)
    assert found["geometry.mass"].value == pytest.approx(1.0 * PETG.density_g_per_cm3, rel=1e-6)
    assert found["geometry.min_wall"].value == pytest.approx(5.0, abs=SINGLE)
    assert found["geometry.min_gap"].value is None
    assert found["geometry.units"].value == pytest.approx(20.0, abs=SINGLE)


def test_open_mesh_fails_and_names_its_edge(tmp_path):
    mesh = box()
    mesh.update_faces(np.arange(12) > 0)
    found = judged(mesh, tmp_path)
    assert failures(found) == {"watertight"}
    assert found["geometry.watertight"].value == 3.0
    assert "the first from (-10.000, " in found["geometry.watertight"].reference


def test_turned_triangle_fails():
    mesh = box()
    mesh.faces[0] = mesh.faces[0][::-1]
    watertight, manifold = closed_verdicts(triangles_of(mesh))
    assert (watertight.passed, manifold.passed) == (False, True)


def test_edge_that_joins_two_boxes_is_not_manifold(tmp_path):
    touching = trimesh.util.concatenate([box(), box().apply_translation((20.0, 10.0, 0.0))])
    found = judged(touching, tmp_path)
    assert "manifold" in failures(found)
    assert found["geometry.manifold"].value == 1.0
    assert "from (10.000, 5.000, " in found["geometry.manifold"].reference


def test_two_bodies_fail(tmp_path):
    found = judged(trimesh.util.concatenate([box(), box().apply_translation((40.0, 0.0, 0.0))]), tmp_path)
    assert failures(found) == {"one_solid"}
    assert found["geometry.one_solid"].value == 2.0


def test_bodies_that_run_into_each_other_fail(tmp_path):
    found = judged(trimesh.util.concatenate([box(), box().apply_translation((13.0, 3.0, 2.0))]), tmp_path)
    assert {"one_solid", "self_intersection"} <= failures(found)


def test_boxes_that_only_touch_do_not_cross():
    assert len(crossing_pairs(trimesh.util.concatenate([box(), box().apply_translation((20.0, 3.0, 2.0))]))) == 0


def test_part_in_metres_fails(tmp_path):
    assert "units" in failures(judged(box().apply_scale(1e-3), tmp_path))


def test_part_in_micrometres_fails(tmp_path):
    assert failures(judged(box().apply_scale(1e3), tmp_path)) == {"units"}


def plate_with_wall(thickness):
    """Return a block with a rib of the given thickness on it."""
    rib = solid(thickness, 10.0, 6.0, (9.0, 0.0, 4.0))
    return triangles(solid().fuse(rib).clean())


@pytest.mark.parametrize(("thickness", "passes"), [(0.3, False), (0.79, False), (0.8, True)])
def test_wall_is_measured_and_judged(thickness, passes, tmp_path):
    found = judged(plate_with_wall(thickness), tmp_path)
    assert found["geometry.min_wall"].value == pytest.approx(thickness, abs=SINGLE)
    assert failures(found) == (set() if passes else {"min_wall"})


def test_thin_wall_of_a_small_face_is_found():
    small = solid(0.3, 0.9, 0.9, (9.0, 4.0, 5.0))
    assert least_wall(triangles(solid().fuse(small).clean())).length == pytest.approx(0.3, abs=SINGLE)


def test_wedge_is_no_wall():
    """A bar of triangular section, 45 degrees: its edge is thin, none of its walls is."""
    wedge = cq.Workplane("XY").polyline([(0, 0), (20, 0), (0, 20)]).close().extrude(5).val()
    assert least_wall(triangles(wedge)).length == pytest.approx(5.0, abs=SINGLE)


@pytest.mark.parametrize(("width", "passes"), [(0.2, False), (0.3, True)])
def test_gap_is_measured_and_judged(width, passes, tmp_path):
    slotted = solid().cut(solid(width, 20.0, 4.0, (8.0, -5.0, 2.0)))
    found = judged(triangles(slotted), tmp_path)
    assert found["geometry.min_gap"].value == pytest.approx(width, abs=SINGLE)
    assert failures(found) == (set() if passes else {"min_gap"})


def test_gap_of_a_hole_is_its_diameter():
    drilled = cq.Workplane("XY").box(20, 10, 5).faces(">Z").hole(3.0).val()
    assert least_gap(triangles(drilled)).length == pytest.approx(3.0, abs=0.02)


def table(reach):
    """Return a block with a ledge that reaches out at half its height."""
    return triangles(solid().fuse(solid(reach, 10.0, 1.0, (20.0, 0.0, 2.0))).clean())


@pytest.mark.parametrize(("reach", "passes"), [(0.9, True), (3.0, False)])
def test_ledge_is_measured_and_judged(reach, passes, tmp_path):
    found = judged(table(reach), tmp_path)
    assert found["geometry.overhang"].value == pytest.approx(reach, abs=SINGLE)
    assert failures(found) == (set() if passes else {"overhang"})


def test_slope_of_45_degrees_needs_no_support_and_one_of_60_does():
    def leaning(deg):
        reach = 5.0 * np.tan(np.radians(deg))
        outline = [(0, 0), (20, 0), (20 + reach, 5), (0, 5)]
        return triangles(cq.Workplane("XZ").polyline(outline).close().extrude(10).val())

    up = (0.0, 0.0, 1.0)
    assert widest_ledge(leaning(45.0), up, 45.0) == 0.0
    assert widest_ledge(leaning(60.0), up, 45.0) == pytest.approx(5.0 * np.sqrt(3.0), abs=SINGLE)
    assert widest_ledge(leaning(60.0), up, 90.0) == 0.0  # a powder bed carries it


def test_step_is_judged_in_its_best_pose(tmp_path):
    mushroom = solid().fuse(solid(40.0, 10.0, 3.0, (-10.0, 0.0, 5.0))).clean()
    from_cad(mushroom, tmp_path / "part.step")
    found = {finding.name: finding for finding in check_file(tmp_path / "part.step")}
    assert failures(found) == set()
    assert "upside down" in found["geometry.overhang"].reference
    write_stl(mushroom, tmp_path / "part.stl")
    assert failures({finding.name: finding for finding in check_file(tmp_path / "part.stl")}) == {"overhang"}


def from_cad(shape, path):
    cq.exporters.export(cq.Workplane(obj=shape), str(path))


def test_two_solids_in_a_step_fail(tmp_path):
    from_cad(cq.Compound.makeCompound([solid(), solid(at=(40.0, 0.0, 0.0))]), tmp_path / "two.step")
    found = {finding.name: finding for finding in check_file(tmp_path / "two.step")}
    assert failures(found) == {"one_solid"}
    assert found["geometry.one_solid"].value == 2.0


def test_3mf_is_judged_like_its_triangles(tmp_path):
    write_3mf({"plate": plate_with_wall(0.3)}, tmp_path / "part.3mf")
    found = {finding.name: finding for finding in check_file(tmp_path / "part.3mf")}
    assert failures(found) == {"min_wall"}
    assert "'plate'" in found["geometry.3mf_strict"].reference


def test_another_process_has_other_limits():
    plate = triangles_of(plate_with_wall(0.6))
    findings = {finding.name: finding for finding in check_mesh(plate, PROCESSES["sla-resin"], POSE)}
    assert failures(findings) == set()
    findings = {finding.name: finding for finding in check_mesh(plate, PETG, POSE)}
    assert failures(findings) == {"min_wall"}


POSE = ("as it stands",)


@pytest.mark.parametrize("kind", ["stl", "step", "3mf"])
def test_file_that_cannot_be_read_fails(tmp_path, kind):
    (tmp_path / f"part.{kind}").write_bytes(b"hello")
    (finding,) = check_file(tmp_path / f"part.{kind}")
    assert (finding.name, finding.passed) == ("geometry.readable", False)
    assert f"part.{kind}" in finding.reference


def test_other_kinds_and_missing_files_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"PATH = 'part.obj': must be a file of kind .step, .stp, .stl, .3mf"):
        check_file(tmp_path / "part.obj")
    with pytest.raises(FileNotFoundError, match=r"part.stl: there is no such file"):
        check_file(tmp_path / "part.stl")


def test_empty_step_fails(tmp_path):
    head = "FILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\nFILE_SCHEMA(('AUTOMOTIVE_DESIGN'));"
    text = f"ISO-10303-21;\nHEADER;\n{head}\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n"
    (tmp_path / "empty.step").write_text(text)
    (finding,) = check_file(tmp_path / "empty.step")
    assert (finding.name, finding.passed) == ("geometry.readable", False)


def test_solid_turned_inside_out_fails(tmp_path):
    mesh = box()
    mesh.invert()
    found = judged(mesh, tmp_path)
    assert {"volume", "mass"} <= failures(found)
    assert found["geometry.volume"].value == pytest.approx(-1000.0, rel=1e-6)


def test_triangle_alone_fails_without_a_warning(tmp_path):
    found = judged(trimesh.Trimesh([[0, 0, 0], [10, 0, 0], [0, 10, 0]], [[0, 1, 2]], process=False), tmp_path)
    assert failures(found) == {"watertight", "volume", "mass"}


def test_solid_without_a_thin_place_has_no_least_wall():
    assert least_wall(box(40.0, 40.0, 40.0)) is None
    assert least_gap(box()) is None
