import math

import cadquery as cq
import pytest
import trimesh

import cad.files.sensor_files
from cad.checks.part_checks import check_file
from cad.files.export_error import ExportError
from cad.files.sensor_files import export_step, volume_of, write_sensor
from cad.files.step import read_step, write_step
from cad.files.stl import CHORD_MM, read_stl, write_stl
from cad.files.threemf import read_3mf, write_3mf
from cad.parts.assembly import assemble_sensor
from cad.parts.fruit import whole_fruit
from cad.parts.pose import print_pose, sensor_pose
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips

ROUND_MM2 = 300.0  # more than the area of fillets and holes, whose chords cost the volume of triangles


def test_files_hold_the_solids_and_the_pins_and_print_files_the_marks(pinned, tmp_path):
    step, assembly, stl, model, shown, pin = write_sensor(pinned, tmp_path).paths
    assert [path.name for path in (step, assembly, stl, model, shown, pin)] == [
        "housing.step", "assembly.step", "housing.stl", "housing.3mf", "assembly.glb", "pin.step",
    ]  # fmt: skip
    volume = pinned.part.shape.Volume()
    parts = assemble_sensor(pinned).children
    assert read_step(step).Volume() == pytest.approx(volume, rel=1e-9)
    assert read_step(assembly).Volume() == pytest.approx(sum(part.shapes[0].Volume() for part in parts), rel=1e-9)
    assert read_step(pin).Volume() == pytest.approx(4.0)
    engraved = pinned.printed_part().shape.Volume()
    assert volume - engraved > 1.0
    assert read_stl(stl).volume == pytest.approx(engraved, abs=CHORD_MM * ROUND_MM2)
    assert read_3mf(model).mesh.volume == pytest.approx(engraved, abs=CHORD_MM * ROUND_MM2)
    assert set(trimesh.load(shown).geometry) == {part.name for part in parts}
    assert {"housing", "low_pin", "high_pin", "fruit", "screw_1"} <= {part.name for part in parts}
    assert all(verdict.passed for verdict in check_file(model))


@pytest.mark.parametrize(("across", "thickness"), [(30.0, 20.0), pytest.param(60.0, 50.0, marks=pytest.mark.slow)])
def test_whole_ellipsoid_is_read_back_as_it_was(across, thickness, tmp_path):
    """Beyond its equator it was once read back as its lower part alone; volume by the integral of its sections."""
    radius = 35.0
    fruit = Fruit(shape="ellipsoid", radius_mm=radius, radius_across_mm=across, thickness_mm=thickness)
    part = cq.Assembly(whole_fruit(fruit, Tips()), name="fruit")
    base = 1.0 - thickness / radius  # height of the base over the middle, in radii
    expected = math.pi * radius**2 * math.sqrt(radius * across) * (2.0 / 3.0 - base + base**3 / 3.0)
    assert export_step(part, tmp_path / "fruit.step").Volume() == pytest.approx(expected, rel=1e-3)


def shrunk_step(part, path):
    write_step(cq.Assembly(part.obj.scale(0.999), name=part.name), path)


def shrunk_3mf(bodies, path, *_):
    write_3mf({part: mesh.copy().apply_scale(0.999) for part, mesh in bodies.items()}, path)


@pytest.mark.parametrize(
    ("name", "writer"),
    [
        ("housing.step", shrunk_step),
        ("housing.stl", lambda shape, path: write_stl(shape.scale(0.999), path)),
        ("housing.3mf", shrunk_3mf),
    ],
)
def test_file_with_another_volume_is_refused(sensor, tmp_path, monkeypatch, name, writer):
    """What is written is a thousandth too small."""
    kind = name.partition(".")[2]
    monkeypatch.setattr(cad.files.sensor_files, f"write_{kind}", writer)
    if kind != "step":
        monkeypatch.setattr(cad.files.sensor_files, "export_step", lambda *_: None)
    with pytest.raises(ExportError, match=name):
        write_sensor(sensor, tmp_path)


def test_stl_is_the_same_bytes_after_the_solid_was_meshed_finer(sensor, tmp_path):
    write_stl(sensor.part.shape, tmp_path / "first.stl")
    sensor.part.shape.tessellate(3e-4, 0.05)  # the file has 6e-4 on a fillet
    write_stl(sensor.part.shape, tmp_path / "second.stl")
    assert (tmp_path / "first.stl").read_bytes() == (tmp_path / "second.stl").read_bytes()


def test_print_pose_lies_flat_with_the_profile_seen_from_above(sensor, tmp_path):
    write_stl(print_pose(sensor.part.shape), tmp_path / "housing.stl")
    printed, housing = read_stl(tmp_path / "housing.stl"), sensor.housing
    assert printed.bounds[0] == pytest.approx((housing.left, 0.0, 0.0), abs=1e-5)
    assert printed.bounds[1] == pytest.approx((housing.right, housing.top_level, housing.depth), abs=1e-5)
    back = sensor_pose(printed, housing.depth)
    assert back.bounds[0] == pytest.approx((housing.left, -0.5 * housing.depth, 0.0), abs=1e-5)
    assert back.volume == pytest.approx(printed.volume, rel=1e-9)  # turned, not mirrored


def test_volume_counts_every_instance_of_a_solid():
    box = cq.Solid.makeBox(1.0, 2.0, 3.0)
    beside = box.moved(cq.Location(cq.Vector(5.0, 0.0, 0.0)))
    larger = cq.Solid.makeBox(2.0, 2.0, 3.0, cq.Vector(10.0, 0.0, 0.0))
    assert volume_of(cq.Compound.makeCompound([box, beside, larger])) == pytest.approx(6.0 + 6.0 + 12.0, rel=1e-12)
