import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh

import cad.files.sensor_files
from cad.checks.triangle_checks import library_mesh
from cad.design.fruit import Fruit
from cad.design.tips import Tips
from cad.files.export_error import ExportError
from cad.files.sensor_files import export_step, write_sensor
from cad.files.step import read_step, write_step
from cad.files.stl import CHORD_MM, read_stl, write_stl
from cad.files.threemf import read_3mf, write_3mf
from cad.parts.assembly import fasteners
from cad.parts.fruit import curved_fruit
from cad.parts.pose import print_pose, sensor_pose
from cad.parts.sensor import Body

NAMES = ["housing.step", "assembly.step", "housing.stl", "housing.3mf"]


def test_files_hold_the_solids(sensor, tmp_path):
    step, assembly, stl, model = write_sensor(sensor, tmp_path)
    assert [path.name for path in (step, assembly, stl, model)] == NAMES
    volume, fruit = sensor.part.shape.Volume(), 20.0 * 20.0 * 12.0
    steel = sum(shape.Volume() for shape in fasteners(sensor).values())
    assert read_step(step).Volume() == pytest.approx(volume, rel=1e-9)
    assert read_step(assembly).Volume() == pytest.approx(volume + fruit + steel, rel=1e-9)
    # Fillets are the only round faces but the holes: chords of at most CHORD_MM inside 200 mm^2 of them.
    assert float(read_stl(stl).volume) == pytest.approx(volume, abs=CHORD_MM * 300.0)
    assert float(read_3mf(model).mesh.volume) == pytest.approx(volume, abs=CHORD_MM * 300.0)


def test_assembly_shows_a_curved_fruit_curved(sensor, tmp_path):
    fruit = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=20.0)
    _, assembly, *_ = write_sensor(replace(sensor, fruit=fruit), tmp_path)
    found, volume = read_step(assembly), sensor.part.shape.Volume() + curved_fruit(fruit).shape.Volume()
    volume += sum(shape.Volume() for shape in fasteners(sensor).values())
    assert found.Volume() == pytest.approx(volume, rel=1e-6)  # the top is one face here and three there
    assert "SPHERE" in {face.geomType() for face in found.Faces()}
    assert "SPHERE" not in {face.geomType() for face in sensor.part.shape.Faces()}


@pytest.mark.parametrize("radii", [(35.0, 30.0), (35.0, 60.0)])
@pytest.mark.parametrize("thickness", [20.0, 50.0, 69.0])
def test_whole_ellipsoid_is_read_back_as_it_was(radii, thickness, tmp_path):
    """Beyond its equator it was once read back as its lower part alone; volume by the integral of its sections."""
    radius, across = radii
    fruit = Fruit(shape="ellipsoid", radius_mm=radius, radius_across_mm=across, thickness_mm=thickness)
    body = Body(name="fruit", shape=curved_fruit(fruit, Tips()).shape, colour=(0.5, 0.5, 0.5))
    base = 1.0 - thickness / radius  # height of the base over the middle, in radii
    expected = math.pi * radius**2 * math.sqrt(radius * across) * (2.0 / 3.0 - base + base**3 / 3.0)
    assert export_step([body], tmp_path / "fruit.step").Volume() == pytest.approx(expected, rel=1e-3)


def test_print_files_of_a_named_sensor_carry_its_marks_and_step_does_not(sensor, tmp_path):
    named = replace(sensor, name="paper")
    step, _, stl, model = write_sensor(named, tmp_path)
    volume, engraved = sensor.part.shape.Volume(), named.printed_part().shape.Volume()
    assert volume - engraved > 1.0
    assert read_step(step).Volume() == pytest.approx(volume, rel=1e-9)
    for found in (read_stl(stl), read_3mf(model).mesh):
        assert float(found.volume) == pytest.approx(engraved, abs=CHORD_MM * 300.0)


def test_3mf_with_another_volume_is_refused(sensor, tmp_path, monkeypatch):
    def shrink(bodies, path):
        write_3mf({name: replace(mesh, vertices=0.999 * mesh.vertices) for name, mesh in bodies.items()}, path)

    monkeypatch.setattr(cad.files.sensor_files, "write_3mf", shrink)
    with pytest.raises(ExportError, match=r"housing.3mf: volume read back"):
        write_sensor(sensor, tmp_path)


def test_same_bytes_again_after_the_solid_was_meshed_finer(sensor, tmp_path):
    first, second = tmp_path / "1", tmp_path / "2"
    for folder in (first, second):
        folder.mkdir()
    before = [path.read_bytes() for path in write_sensor(sensor, first)]
    sensor.part.shape.tessellate(1e-3, 0.05)
    assert [path.read_bytes() for path in write_sensor(sensor, second)] == before


def test_print_pose_lies_flat_with_the_profile_seen_from_above(sensor, tmp_path):
    write_stl(print_pose(sensor.part.shape), tmp_path / "housing.stl")
    mesh, housing = library_mesh(read_stl(tmp_path / "housing.stl")), sensor.housing
    low, high = mesh.bounds
    assert low == pytest.approx((housing.left, 0.0, 0.0), abs=1e-5)
    assert high == pytest.approx((housing.right, housing.top_level, housing.depth), abs=1e-5)
    assert mesh.is_watertight
    back = library_mesh(sensor_pose(read_stl(tmp_path / "housing.stl"), housing.depth))
    assert back.bounds[0] == pytest.approx((housing.left, -0.5 * housing.depth, 0.0), abs=1e-5)
    assert float(back.volume) == pytest.approx(float(mesh.volume), rel=1e-9)  # turned, not mirrored


def test_triangles_follow_the_fillets(sensor, tmp_path):
    write_stl(sensor.part.shape, tmp_path / "housing.stl")
    mesh, housing = library_mesh(read_stl(tmp_path / "housing.stl")), sensor.housing
    centre = np.array([housing.left + 4.0, housing.top_level - housing.hole_inset])
    radius = np.linalg.norm(mesh.triangles_center[:, [0, 2]] - centre, axis=1)
    wall = (np.abs(mesh.face_normals[:, 1]) < 0.5) & (radius < 2.0)
    assert radius[wall].min() >= 0.5 * housing.hole_diameter - CHORD_MM
    assert radius[wall].max() <= 0.5 * housing.hole_diameter + 1e-5


@pytest.mark.parametrize("name", ["housing", "assembly"])
def test_file_with_another_volume_is_refused(sensor, tmp_path, monkeypatch, name):
    def shrink(bodies, path, title):
        fewer = [replace(body, shape=body.shape.scale(0.999)) for body in bodies]
        write_step(fewer if title == name else bodies, path, title)

    monkeypatch.setattr(cad.files.sensor_files, "write_step", shrink)
    with pytest.raises(ExportError, match=rf"{name}.step: volume read back = .* must be .* within .*; export again"):
        write_sensor(sensor, tmp_path)


def test_stl_with_another_volume_is_refused(sensor, tmp_path, monkeypatch):
    monkeypatch.setattr(cad.files.sensor_files, "write_stl", lambda shape, path: write_stl(shape.scale(0.999), path))
    with pytest.raises(ExportError, match=r"housing.stl: volume read back"):
        write_sensor(sensor, tmp_path)


@pytest.mark.parametrize("content", [b"", b"hello", b"solid x\nendsolid x\n", bytes(84), b"\1" * 200])
def test_file_that_is_no_stl_is_refused(tmp_path, content):
    (tmp_path / "a.stl").write_bytes(content)
    with pytest.raises(ValueError, match=r"a.stl holds no triangles; export it again"):
        read_stl(tmp_path / "a.stl")


def test_stl_is_read_as_the_library_reads_it(sensor, tmp_path):
    """Binary and text; equal corners are one, in the order in which they first occur."""
    write_stl(sensor.part.shape, tmp_path / "binary.stl")
    expected = trimesh.load_mesh(tmp_path / "binary.stl")
    expected.export(tmp_path / "text.stl", file_type="stl_ascii")
    for found in (read_stl(tmp_path / "binary.stl"), read_stl(tmp_path / "text.stl")):
        assert np.array_equal(found.faces, expected.faces)
        assert found.vertices == pytest.approx(expected.vertices, abs=1e-6)
        assert found.volume == pytest.approx(float(expected.volume), rel=1e-6)
