"""Scenes show the whole of a half model, the true shape of a fruit, and colours from the very numbers of the files."""

import dataclasses

import cadquery as cq
import numpy as np
import pytest
import pyvista as pv
from squares import BALL
from view_stand_ins import DEPTH, LENGTH

from pipeline.options import load_design
from pipeline.report.report import read_report
from pipeline.view.field_picture import deformed_surface, draw_scene, frame_picture
from pipeline.view.scenes import (
    _EXPLODED_DIRECTION,
    STRAIN_OVER_LIMIT,
    TOTAL_DISPLACEMENT,
    VERTICAL_PRESSURE,
    VON_MISES,
    _beside_fruit,
    _draw_parts_apart,
    _label_positions,
    _picture_axes,
    bend_to_true_shape,
    complete_half_model,
    field_scenes,
)

DIGITS = 2.0**-19  # of a value in a VTU file, relative to the largest


@pytest.fixture(scope="module")
def half(stand_in_folder):
    return pv.read(stand_in_folder / "flexure.vtu")


@pytest.fixture(scope="module")
def scenes(stand_in_folder):
    return field_scenes(read_report(stand_in_folder), stand_in_folder)


def node_at(mesh, point):
    """Return the number of the node at a point [mm]."""
    node = mesh.find_closest_point(point)
    np.testing.assert_allclose(mesh.points[node], point, atol=1e-9)
    return node


def test_mirrored_half_is_the_whole_body(half):
    whole = complete_half_model(half)
    assert whole.volume == pytest.approx(2.0 * LENGTH * DEPTH, rel=DIGITS)
    assert whole.bounds[2:4] == pytest.approx((-DEPTH, DEPTH))
    # its surface has no wall in the plane of symmetry, and no cell is inside out
    assert whole.extract_surface(algorithm="dataset_surface").area == pytest.approx(2 * (2 * 1 + 2 * 10 + 1 * 10))
    assert whole.compute_cell_sizes()["Volume"].min() > 0.0


def test_vectors_and_tensors_are_mirrored(half):
    """Y and what has one y among its indices change their sign: xx, yy, zz, xy, yz, xz."""
    whole = complete_half_model(half)
    at = node_at(whole, (LENGTH / 2, DEPTH, 1.0))
    image = node_at(whole, (LENGTH / 2, -DEPTH, 1.0))
    for name, signs in (("displacement_mm", (1, -1, 1)), ("stress_MPa", (1, 1, 1, -1, -1, 1)), ("von_mises_MPa", 1)):
        values = whole.point_data[name]
        assert np.all(values[at] != 0.0) or name != "stress_MPa" or values[at][4] != 0.0
        np.testing.assert_array_equal(values[image], values[at] * np.array(signs))


def test_each_spring_has_its_side_and_its_range(scenes, stand_in_folder):
    """The stand-in's numbers are 1 and 2 times the distance from the middle."""
    limit = read_report(stand_in_folder).design.process.strain_limit
    for scene, highest, sides in zip(scenes, (5.0, 10.0), ((-5.0, 0.0), (0.0, 5.0)), strict=False):
        assert scene.mesh.bounds[:2] == pytest.approx(sides)
        ends = [
            VON_MISES.range_on(scene.mesh)[1],
            STRAIN_OVER_LIMIT.range_on(scene.mesh)[1],
            scene.largest_displacement_mm,
        ]
        assert ends == pytest.approx([highest, 1e-4 * highest / limit, np.hypot(1e-2, 1e-3) * highest], rel=DIGITS)


def test_bars_of_two_scenes_have_their_ranges(scenes):
    """VTK takes bars of one title for one bar: that emptied all parts of the window but one."""
    plotter = pv.Plotter(off_screen=True, shape=(1, 2))
    try:
        for column, scene in enumerate(scenes[:2]):
            plotter.subplot(0, column)
            draw_scene(plotter, scene)
        highest = [bar.GetLookupTable().GetTableRange()[1] for bar in plotter.scalar_bars.values()]
        assert highest == pytest.approx([5.0, 10.0], rel=DIGITS)
    finally:
        plotter.close()


def test_ruler_is_level_and_as_long_as_it_says():
    """A quarter of a body of 30 mm is 7.5 mm, of which the largest round length is 5 mm."""
    body = pv.Box((0.0, 30.0, -5.0, 5.0, 0.0, 20.0))
    plotter = pv.Plotter(off_screen=True)
    try:
        frame_picture(plotter, body, "a body", (1.0, -1.0, 1.0))
        (ruler,) = (actor for actor in plotter.actors.values() if isinstance(actor, pv.Actor))
        left, right, front, back, bottom, top = ruler.bounds
        assert (left, right, front, back) == pytest.approx((0.0, 5.0, -5.0, -5.0))
        assert bottom == top < body.bounds[4]
    finally:
        plotter.close()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_labels_are_further_from_the_assembly_one_after_another_in_the_picture(sign):
    """In the picture, upwards is z less its part along the view; each step is the same, from the outermost corner."""
    whole = pv.Box((-10.0, 20.0, -5.0, 8.0, 0.0, 40.0))
    starts = {"a": np.array([-3.0, 2.0, 30.0]), "b": np.array([12.0, -4.0, 10.0]), "c": np.array([0.0, 7.0, 5.0])}
    ends = _label_positions(whole, starts, side=sign)
    view = np.array(_EXPLODED_DIRECTION) / np.linalg.norm(_EXPLODED_DIRECTION)
    upwards = np.array([0.0, 0.0, 1.0]) - view[2] * view
    levels = [sign * end @ upwards for end in ends.values()]
    outermost = (sign * whole.points @ upwards).max()
    assert np.diff([outermost, *levels]) == pytest.approx(3 * [levels[0] - outermost])
    assert levels[0] > outermost
    for name, start in starts.items():
        assert ends[name][:2] == pytest.approx(start[:2])


def test_leader_of_the_tip_passes_left_of_the_fruit_in_the_picture():
    fruit = pv.Box((-10.0, 10.0, -10.0, 10.0, -30.0, -18.0))
    start, end = np.array([3.0, 0.0, 0.0]), np.array([3.0, 0.0, -60.0])
    moved = _beside_fruit(start, end, fruit)
    right, upwards = _picture_axes()
    assert (moved - end) @ upwards == pytest.approx(0.0, abs=1e-9)
    slope = (start - moved) @ right / ((start - moved) @ upwards)
    for point in fruit.points:
        assert (start - point) @ right < slope * ((start - point) @ upwards)


def test_leader_line_ends_at_the_right_one_of_equal_parts():
    """It is not behind the front cover; of two above one another it is the upper one."""
    places = [(-10.0, 0.0, 0.0), (10.0, 0.0, 5.0), (10.0, 0.0, -5.0)]
    nuts = [
        cq.Assembly(cq.Workplane().box(1.0, 1.0, 1.0).translate(place), name=f"nut_{i}", color=cq.Color("gray"))
        for i, place in enumerate(places)
    ]
    plotter = pv.Plotter(off_screen=True)
    try:
        _, starts, _ = _draw_parts_apart(plotter, nuts)
    finally:
        plotter.close()
    assert starts["nut"] == pytest.approx((10.0, 0.0, 5.5))


def test_pressure_is_the_stress_along_the_press(scenes):
    fruit = scenes[-1]
    data = fruit.mesh.point_data
    assert fruit.fields[0] == VERTICAL_PRESSURE
    np.testing.assert_allclose(data[VERTICAL_PRESSURE.array], -data["stress_MPa"][:, 2])
    np.testing.assert_allclose(data[TOTAL_DISPLACEMENT.array], np.linalg.norm(data["displacement_mm"], axis=1))


def test_cut_takes_away_what_lies_before_it(scenes):
    fruit = scenes[-1]
    before, _ = deformed_surface(fruit)
    assert before.bounds[2:4] == pytest.approx((0.0, 10.0))  # through the row of tips, y = 0
    whole, _ = deformed_surface(dataclasses.replace(fruit, cut_y=None))
    assert whole.bounds[2] == pytest.approx(-10.0)


def test_sphere_is_drawn_as_a_sphere():
    """A piece of radius R falls by R - sqrt(R^2 - r^2) at a distance r from its apex; its base stays flat."""
    design = load_design(BALL, {})
    radius = design.fruit.radius_mm
    across = np.linspace(-12.0, 12.0, 9)
    block = pv.RectilinearGrid(across, across, np.array([-12.0, 0.0])).cast_to_unstructured_grid()
    x, y, z = block.points.T
    fallen = np.where(z == 0.0, np.sqrt(radius**2 - x**2 - y**2) - radius, z)
    np.testing.assert_allclose(bend_to_true_shape(design, block).points[:, 2], fallen, atol=1e-9)
    np.testing.assert_array_equal(bend_to_true_shape(load_design("paper"), block).points, block.points)
