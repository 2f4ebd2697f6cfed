from dataclasses import replace

import cadquery as cq
import pytest
from OCP.BRep import BRep_Builder
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeSolid
from OCP.TopoDS import TopoDS_Shell

from cad.checks.part_checks import check_solid
from cad.checks.sensor_checks import check_sensor
from cad.files.sensor_files import write_sensor
from cad.files.step import write_step
from cad.files.stl import read_stl, write_stl
from cad.parts.housing_solid import housing_part
from cad.parts.pose import print_pose

DEFLECTIONS = (0.55, 0.2)


@pytest.fixture(scope="module")
def folder(sensor, tmp_path_factory):
    place = tmp_path_factory.mktemp("sensor")
    write_sensor(sensor, place)
    return place


def failures(findings):
    return {finding.name for finding in findings if finding.passed is not True}


def test_good_sensor_passes_every_check(sensor, folder):
    findings = check_sensor(sensor, DEFLECTIONS, folder)
    assert {finding.name.removeprefix("geometry.") for finding in findings} >= {
        "valid", "one_solid", "watertight", "step_round_trip", "leaf_thickness_low", "leaf_thickness_high",
        "frame_clearance", "neck_clearance", "stops_low", "stops_high", "deflected_gap_low", "deflected_gap_high",
        "manifold", "fillets", "tips",
    }  # fmt: skip
    assert failures(findings) == set()


def test_two_solids_fail():
    pair = cq.Compound.makeCompound([cq.Solid.makeBox(1, 1, 1), cq.Solid.makeBox(1, 1, 1, cq.Vector(5, 0, 0))])
    assert failures(check_solid(pair)) == {"geometry.one_solid"}


def test_shell_is_no_solid():
    assert failures(check_solid(cq.Solid.makeBox(1, 1, 1).Shells()[0])) == {"geometry.one_solid"}


def test_solid_with_an_open_shell_fails():
    builder, shell = BRep_Builder(), TopoDS_Shell()
    builder.MakeShell(shell)
    for face in cq.Solid.makeBox(1, 1, 1).Faces()[:5]:
        builder.Add(shell, face.wrapped)
    solid = cq.Shape.cast(BRepBuilderAPI_MakeSolid(shell).Solid())
    findings = check_solid(solid)
    assert failures(findings) == {"geometry.valid"}
    assert findings[0].value >= 1.0


def test_swapped_leaf_thickness_fails(sensor, folder):
    housing = sensor.housing
    swapped = replace(housing, low=replace(housing.low, thickness=1.2), high=replace(housing.high, thickness=0.8))
    findings = {f.name: f for f in check_sensor(replace(sensor, housing=swapped), DEFLECTIONS, folder)}
    for side, declared, measured in (("low", 1.2, 0.8), ("high", 0.8, 1.2)):
        finding = findings[f"geometry.leaf_thickness_{side}"]
        assert (finding.passed, finding.limit) == (False, declared)
        assert finding.value == pytest.approx(measured, abs=1e-5)


def thicker(sensor):
    housing = sensor.housing
    return housing_part(replace(housing, low=replace(housing.low, thickness=0.85)))


def test_step_file_of_another_housing_fails(sensor, folder, tmp_path):
    (tmp_path / "housing.stl").write_bytes((folder / "housing.stl").read_bytes())
    write_step((replace(sensor.bodies()[0], shape=thicker(sensor).shape),), tmp_path / "housing.step", "housing")
    findings = check_sensor(sensor, DEFLECTIONS, tmp_path)
    assert failures(findings) == {"geometry.step_round_trip", "geometry.leaf_thickness_low"}
    (leaf,) = (finding for finding in findings if finding.name == "geometry.leaf_thickness_low")
    assert "farthest in the STEP" in leaf.reference


def test_stl_file_of_another_housing_fails(sensor, folder, tmp_path):
    (tmp_path / "housing.step").write_bytes((folder / "housing.step").read_bytes())
    write_stl(print_pose(thicker(sensor).shape), tmp_path / "housing.stl")
    findings = check_sensor(sensor, DEFLECTIONS, tmp_path)
    assert failures(findings) == {"geometry.leaf_thickness_low"}
    (leaf,) = (finding for finding in findings if finding.name == "geometry.leaf_thickness_low")
    assert leaf.value == pytest.approx(0.85, abs=1e-5)


def test_missing_leaf_fails_with_its_place(sensor, folder):
    shift = replace(sensor.housing, lower_leaf_level=4.6, neck_level=2.4)
    findings = check_sensor(replace(sensor, housing=shift), DEFLECTIONS, folder)
    (leaf,) = (finding for finding in findings if finding.name == "geometry.leaf_thickness_low")
    assert (leaf.passed, leaf.value) == (False, None)
    assert leaf.reference.startswith("no leaf at x = ")


def test_missing_fillet_fails_with_its_place(sensor, folder):
    housing = sensor.housing
    x, z = housing.arms[0].wall, housing.lower_leaf_level + 0.4
    filled = sensor.part.shape.cut(cq.Solid.makeBox(1.0, 8.0, 1.0, cq.Vector(x, -4.0, z)))
    findings = check_sensor(replace(sensor, part=replace(sensor.part, shape=filled)), DEFLECTIONS, folder)
    (fillet,) = (finding for finding in findings if finding.name == "geometry.fillets")
    assert (fillet.passed, fillet.limit) == (False, 0.5)
    assert fillet.value == pytest.approx(0.0, abs=1e-6)
    assert f"x = {x:.3f}, z = {z:.3f}" in fillet.reference


def test_smaller_fillet_fails(sensor, folder):
    low, high = (replace(flexure, fillet=0.4) for flexure in (sensor.housing.low, sensor.housing.high))
    part = housing_part(replace(sensor.housing, low=low, high=high))
    findings = check_sensor(replace(sensor, part=part), DEFLECTIONS, folder)
    (fillet,) = (finding for finding in findings if finding.name == "geometry.fillets")
    assert (fillet.passed, fillet.value) == (False, pytest.approx(0.4, abs=1e-6))


def test_tips_at_another_spacing_fail(sensor, folder):
    part = housing_part(replace(sensor.housing, spacing=8.1))
    findings = check_sensor(replace(sensor, part=part), DEFLECTIONS, folder)
    (tips,) = (finding for finding in findings if finding.name == "geometry.tips")
    assert (tips.passed, tips.value) == (False, pytest.approx(0.05, abs=1e-6))


@pytest.mark.parametrize("name", ["housing.step", "housing.stl"])
def test_file_that_cannot_be_read_fails_and_a_missing_one_is_named(sensor, folder, tmp_path, name):
    for each in ("housing.step", "housing.stl"):
        (tmp_path / each).write_bytes((folder / each).read_bytes())
    (tmp_path / name).write_bytes(b"hello")
    assert failures(check_sensor(sensor, DEFLECTIONS, tmp_path)) == {"geometry.readable"}
    (tmp_path / name).unlink()
    with pytest.raises(FileNotFoundError, match=name):
        check_sensor(sensor, DEFLECTIONS, tmp_path)


def test_open_stl_in_the_folder_fails(sensor, folder, tmp_path):
    (tmp_path / "housing.step").write_bytes((folder / "housing.step").read_bytes())
    mesh = read_stl(folder / "housing.stl")
    mesh.update_faces(mesh.face_normals[:, 2] < 0.999)
    mesh.export(tmp_path / "housing.stl")
    assert "geometry.watertight" in failures(check_sensor(sensor, DEFLECTIONS, tmp_path))
