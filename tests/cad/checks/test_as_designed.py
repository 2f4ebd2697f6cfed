"""The distance of a file from its design: right on bodies of known distance, and no planted fault passes."""

import re
from dataclasses import replace

import cadquery as cq
import numpy as np
import pytest
import trimesh
from random_housings import housed_designs
from squares import hall_square

from cad.checks.as_designed import NAME, as_designed_verdict, largest_distance
from cad.fabrication.file_shapes import HOUSING_FILES, file_shapes, files_as_designed, part_as_designed
from cad.fabrication.mount import bracket_solid
from cad.files.sensor_files import print_shape, write_sensor
from cad.files.step import write_step
from cad.files.stl import CHORD_MM, triangles, write_stl
from cad.files.threemf import write_3mf
from cad.parts.assembly import assemble_sensor, draw_sensor, finished_part
from cad.parts.cover_solid import cover_part
from sensor.design.parameters import Design

OWN_MM = {".step": 0.02, ".stl": 0.02 + CHORD_MM, ".3mf": 0.02 + CHORD_MM}
NEAR_MM = 2e-4  # twice the distance below which none is measured closer


@pytest.fixture(scope="module")
def named(sensor):
    """Return the small sensor with a name, so that its prints have marks on one side."""
    return replace(sensor, name="planted")


def write(shape, path):
    """Write a shape [mm] as it lies into a STEP, STL or 3MF file."""
    if path.suffix == ".step":
        write_step(cq.Assembly(shape, name="part"), path)
    elif path.suffix == ".stl":
        write_stl(shape, path)
    else:
        write_3mf({"part": triangles(shape)}, path)
    return path


def pose_of(sensor, kind):
    """Return the housing in the pose in which a file of a kind holds it."""
    return sensor.part.shape if kind == ".step" else print_shape(sensor)


def judged(sensor, shape, kind, folder):
    """Return the verdict on a file of a shape, as the housing of a sensor."""
    path = write(shape, folder / f"housing{kind}")
    return files_as_designed(sensor, folder, [path.name])


def with_shape(sensor, change):
    """Return a sensor whose solid is changed."""
    return replace(sensor, part=replace(sensor.part, shape=change(sensor.part.shape)))


def box(x, y, z):
    return cq.Solid.makeBox(x[1] - x[0], y[1] - y[0], z[1] - z[0], cq.Vector(x[0], y[0], z[0]))


def leaf_cut_through(sensor):
    """Cut the lower leaf of the low spring through, 0.1 mm wide: the cut's walls are half a leaf from any surface."""
    arm = sensor.housing.arms[0]
    middle, level = 0.5 * sum(arm.roots), arm.levels[0]
    return with_shape(
        sensor, lambda shape: shape.cut(box((middle, middle + 0.1), (-50, 50), (level - 1.0, level + 1.0)))
    )


def leaf_thinner(sensor):
    """Take 0.1 mm off the upper side of a leaf."""
    arm = sensor.housing.arms[0]
    top = arm.levels[0] + 0.5 * arm.flexure.thickness
    return with_shape(sensor, lambda shape: shape.cut(box(arm.roots, (-50, 50), (top - 0.1, top))))


def hole_left_out(sensor):
    """Fill a hole for a screw: the middle of the plug is half the depth or the radius from any surface."""
    housing = sensor.housing
    x, z = housing.holes[0]
    start = cq.Vector(x, -0.5 * housing.depth, z)
    plug = cq.Solid.makeCylinder(0.5 * housing.hole_diameter, housing.depth, start, cq.Vector(0, 1, 0))
    return with_shape(sensor, lambda shape: shape.fuse(plug).clean())


@pytest.mark.parametrize(
    ("fault", "least", "kind"),
    [
        pytest.param(leaf_cut_through, 0.3, ".stl", marks=pytest.mark.study),
        (leaf_thinner, 0.1, ".3mf"),
        (hole_left_out, 1.7, ".step"),
    ],
)
def test_a_changed_part_fails(named, fault, least, kind, tmp_path):
    verdict = judged(named, pose_of(fault(named), kind), kind, tmp_path)
    assert (verdict.name, verdict.passed, verdict.limit) == (NAME, False, pytest.approx(OWN_MM[kind]))
    assert verdict.value >= least - NEAR_MM


def moved_bracket(_):
    return bracket_solid(hall_square()).translate(cq.Vector(0.1, 0, 0))


def bracket_with_other_holes(step):
    """Return a bracket with wider or narrower holes for the screws [mm]."""
    square = hall_square()
    diameter = square.housing.hole_diameter + step
    return bracket_solid(replace(square, housing=replace(square.housing, hole_diameter=diameter)))


def cover_with(seats):
    """Return the cover of the square with other windows."""
    square = hall_square()
    return cover_part(square.housing, None if seats is None else replace(square.seats, **seats)).shape


def plate_with(seats):
    """Return the plate of the square with other pockets for magnets."""
    square = hall_square()
    return finished_part(square.housing, None if seats is None else replace(square.seats, **seats)).shape


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "draw", "change", "least"),
    [
        ("mount.step", moved_bracket, None, 0.1),
        ("mount.step", bracket_with_other_holes, -0.4, 0.2),
        ("cover.step", cover_with, None, 0.7),  # the middle of a window is half of its slot from any surface
        pytest.param("cover.step", cover_with, {"face_distance": 2.7}, 0.2, marks=pytest.mark.study),
        ("cover.step", cover_with, {"sensor_level": 8.0}, 0.2),
        pytest.param("cover.step", cover_with, {"window_width": 4.0}, 0.05, marks=pytest.mark.study),
        ("housing.step", plate_with, None, 1.0),
        ("housing.step", plate_with, {"pocket_depth": 0.9}, 0.1),
        ("housing.step", plate_with, {"upper_disc": 9.0}, 0.1),
    ],
)
def test_holes_and_seats_of_another_place_or_size_fail(name, draw, change, least, tmp_path):
    """What a screw, a magnet or a Hall sensor needs is as far from its place as it was moved, or its walls are."""
    write(draw(change), tmp_path / name)
    verdict = files_as_designed(hall_square(), tmp_path, [name])
    assert (verdict.passed, verdict.value >= least - NEAR_MM) == (False, True)


def test_part_as_written_passes(named, tmp_path):
    verdict = judged(named, pose_of(named, ".stl"), ".stl", tmp_path)
    assert (verdict.passed, verdict.value) == (True, 0.0)


def test_change_of_volume_is_from_the_design_to_the_file():
    file, design = (trimesh.creation.box((10.0, 10.0, height)) for height in (9.9, 10.0))
    verdict = as_designed_verdict({"part.stl": (file, design)})
    change = float(re.search(r"volume (\S+) mm", verdict.reference)[1])
    assert change == pytest.approx(10.0 * 10.0 * (9.9 - 10.0), abs=NEAR_MM)
    assert verdict.value == pytest.approx(0.5 * (10.0 - 9.9), abs=NEAR_MM)


QUARTER = cq.Location(cq.Vector(0, 0, 0), cq.Vector(0, 0, 1), 90.0)
TURNED = cq.Location(cq.Vector(3, -2, 1), cq.Vector(1, 2, 3), 40.0)


def mirrored(shape):
    return shape.mirror("YZ")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "words", "kind"),
    [
        (lambda shape: shape.translate(cq.Vector(0.3, 0, 0)), "moved by (0.3, 0, 0) mm", ".stl"),
        pytest.param(lambda shape: shape.moved(QUARTER), "rotated by 90.0 deg", ".3mf", marks=pytest.mark.study),
        (lambda shape: shape.moved(TURNED), "rotated by 40.0 deg", ".step"),
        (lambda shape: shape.scale(1.0 / 25.4), "inches", ".step"),
        (mirrored, "mirrored", ".3mf"),
        # Without marks the front is the mirror of the back: mirrored left to right is turned half round.
        (mirrored, "rotated by 180.0 deg", ".step"),
    ],
)
def test_a_part_in_another_place_or_unit_fails_and_says_so(named, change, words, kind, tmp_path):
    verdict = judged(named, change(pose_of(named, kind)), kind, tmp_path)
    assert verdict.passed is False
    assert words in verdict.reference


@pytest.mark.study
def test_file_of_another_design_fails(named, tmp_path):
    """Its leaf is 0.4 mm longer, and so is all beyond it."""
    longer = replace(named.housing, low=replace(named.housing.low, length=25.4))
    other = draw_sensor(replace(Design(), name="planted"), longer)
    verdict = judged(named, print_shape(other), ".stl", tmp_path)
    assert (verdict.passed, verdict.value) == (False, pytest.approx(0.4, abs=NEAR_MM))


@pytest.mark.slow
def test_pin_beside_its_pocket_fails(pinned, tmp_path):
    """The pin of an assembly stands 0.3 mm beside its place: its end is as far from that of the design's."""
    assembly = assemble_sensor(pinned)
    assembly.objects["low_pin"].loc *= cq.Location(cq.Vector(0.0, 0.0, -0.3))
    write_step(assembly, tmp_path / "assembly.step")
    verdict = files_as_designed(pinned, tmp_path, ["assembly.step"])
    assert (verdict.passed, verdict.value) == (False, pytest.approx(0.3, abs=NEAR_MM))


def brute_force(points, mesh):
    """Return the distances of points from every triangle, by trimesh's own nearest points of pairs."""
    count = len(mesh.faces)
    distances = []
    for point in points:
        nearest = trimesh.triangles.closest_point(mesh.triangles, np.tile(point, (count, 1)))
        distances.append(np.linalg.norm(nearest - point, axis=1).min())
    return np.array(distances)


@pytest.mark.slow
def test_distance_is_that_of_all_pairs():
    """Two balls of few triangles, one of them shifted: the corners are among the points that are measured."""
    first = trimesh.creation.icosphere(subdivisions=2, radius=4.0)
    second = trimesh.creation.uv_sphere(radius=4.2)
    second.apply_translation([0.3, -0.2, 0.5])
    found = largest_distance(first, second)
    at_corners = max(brute_force(first.vertices, second).max(), brute_force(second.vertices, first).max())
    assert found.distance >= at_corners - NEAR_MM
    owner, other = (first, second) if found.owner == "file" else (second, first)
    assert found.distance == pytest.approx(brute_force([found.point], other)[0], abs=NEAR_MM)
    assert brute_force([found.point], owner)[0] < NEAR_MM


@pytest.mark.slow
def test_part_is_compared_with_the_part_that_it_is_most_like(named, tmp_path):
    """The name of a foreign file says nothing, and its chord is any program's."""
    for part in ("housing", "cover"):
        shape = file_shapes(named)[f"{part}.stl"]().copy()
        shape.exportStl(str(tmp_path / "part.stl"), 0.02, 0.5, relative=False)
        verdict = part_as_designed(named, tmp_path / "part.stl")
        assert (verdict.passed, verdict.limit) == (True, 0.05)
        assert f"the {part} of the design" in verdict.reference


@pytest.mark.parametrize("count", [pytest.param(2, marks=pytest.mark.slow), pytest.param(100, marks=pytest.mark.study)])
def test_files_as_written_pass(count, tmp_path):
    """The kernel divides a STEP file that it has read in other triangles: what is left is its chord, twice."""
    for design, sensor in housed_designs(seed=7, count=count):
        write_sensor(sensor, tmp_path)
        verdict = files_as_designed(sensor, tmp_path, HOUSING_FILES)
        assert verdict.passed, (design, verdict)
        assert verdict.value <= 2.0 * CHORD_MM
