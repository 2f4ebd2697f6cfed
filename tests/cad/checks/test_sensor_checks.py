"""A sensor passes on its own solid and files, and each planted mistake fails the verdict that is there for it."""

import shutil
from dataclasses import replace

import cadquery as cq
import pytest
from OCP.BRep import BRep_Builder
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeSolid
from OCP.TopoDS import TopoDS_Shell

from cad.checks.leaf_section import leaf_thickness_verdicts
from cad.checks.line_probe import solid_probe
from cad.checks.part_checks import check_solid
from cad.checks.sensor_checks import check_sensor
from cad.files.sensor_files import write_sensor
from cad.files.step import write_step
from cad.files.stl import read_stl, write_stl
from cad.parts.housing_solid import housing_part
from cad.parts.pose import print_pose

DEFLECTIONS = (0.55, 0.2)


@pytest.fixture(scope="module")
def written(sensor, tmp_path_factory):
    folder = tmp_path_factory.mktemp("sensor")
    write_sensor(sensor, folder)
    return folder


@pytest.fixture
def folder(written, tmp_path):
    """Return a copy of the files of the sensor that a test may spoil."""
    for name in ("housing.step", "housing.stl"):
        shutil.copy(written / name, tmp_path)
    return tmp_path


def checked(sensor, folder):
    """Return the verdicts by name."""
    return {verdict.name.removeprefix("geometry."): verdict for verdict in check_sensor(sensor, DEFLECTIONS, folder)}


def failures(verdicts):
    return {name: verdict.value for name, verdict in verdicts.items() if verdict.passed is not True}


def solid_failures(shape):
    return failures({verdict.name: verdict for verdict in check_solid(shape)})


def test_good_sensor_passes_every_check(sensor, written):
    verdicts = checked(sensor, written)
    assert failures(verdicts) == {}
    assert set(verdicts) == {
        "valid", "one_solid", "watertight", "leaf_thickness_low", "leaf_thickness_high",
        "frame_clearance", "neck_clearance", "stops_low", "stops_high", "deflected_gap_low", "deflected_gap_high",
        "manifold",
    }  # fmt: skip


def test_solids_that_are_none_fail():
    box = cq.Solid.makeBox(1, 1, 1)
    pair = cq.Compound.makeCompound([box, cq.Solid.makeBox(1, 1, 1, cq.Vector(5, 0, 0))])
    assert solid_failures(pair) == {"geometry.one_solid": 2.0}
    assert solid_failures(box.Shells()[0]) == {"geometry.one_solid": 0.0}
    builder, shell = BRep_Builder(), TopoDS_Shell()
    builder.MakeShell(shell)
    for face in box.Faces()[:5]:
        builder.Add(shell, face.wrapped)
    solid = cq.Shape.cast(BRepBuilderAPI_MakeSolid(shell).Solid())
    assert solid_failures(solid)["geometry.valid"] >= 1.0


def with_leaves(sensor, **changes):
    """Return the housing whose leaves, by spring, have other dimensions."""
    leaves = {spring: replace(getattr(sensor.housing, spring), **sizes) for spring, sizes in changes.items()}
    return replace(sensor.housing, **leaves)


def forms_of(shape):
    return {"solid": solid_probe(shape)}


def test_swapped_and_missing_leaves_fail(sensor):
    swapped = with_leaves(sensor, low={"thickness": 1.2}, high={"thickness": 0.8})
    low, high = leaf_thickness_verdicts(swapped, forms_of(sensor.part.shape))
    assert (low.passed, low.limit, low.value) == (False, 1.2, pytest.approx(0.8, abs=1e-5))
    assert (high.passed, high.limit, high.value) == (False, 0.8, pytest.approx(1.2, abs=1e-5))
    shifted = replace(sensor.housing, lower_leaf_level=4.6, neck_level=2.4)
    low, _ = leaf_thickness_verdicts(shifted, forms_of(sensor.part.shape))
    assert (low.passed, low.value) == (False, None)
    assert "z = 4.600 mm" in low.reference


def test_files_of_another_housing_fail(sensor, folder):
    thicker = housing_part(with_leaves(sensor, low={"thickness": 0.85})).shape
    write_stl(print_pose(thicker), folder / "housing.stl")
    write_step(cq.Assembly(thicker, name="housing"), folder / "housing.step")
    assert set(failures(checked(sensor, folder))) == {"leaf_thickness_low"}


@pytest.mark.parametrize("name", ["housing.step", "housing.stl"])
def test_file_that_cannot_be_read_fails_and_a_missing_one_is_named(sensor, folder, name):
    (folder / name).write_bytes(b"hello")
    assert failures(checked(sensor, folder)) == {"readable": None}
    (folder / name).unlink()
    with pytest.raises(FileNotFoundError, match=name):
        checked(sensor, folder)


def test_open_stl_in_the_folder_fails(sensor, folder):
    mesh = read_stl(folder / "housing.stl")
    mesh.update_faces(mesh.face_normals[:, 2] < 0.999)
    mesh.export(folder / "housing.stl")
    assert "watertight" in failures(checked(sensor, folder))
