import dataclasses

import numpy as np

from sensor.design.fruit import Fruit
from solve.fruit.box import DEPTH, SLENDER, UP, Grading, _distance_to_image, block_lines, box_mesh, graded_line

GRADING = Grading(0.7, (0.7, 0.21, 0.09))
BLOCK = Fruit(length_mm=20.0, width_mm=14.0, height_mm=9.0)
POINTS = np.array([[-4.0, 0.3], [1.5, -0.3]])


def test_graded_line_keeps_its_ends_and_follows_the_size():
    line = graded_line(-1.0, 3.0, lambda s: 0.1 + 0.2 * np.abs(s))
    assert (line[0], line[-1]) == (-1.0, 3.0)
    steps, middle = np.diff(line), 0.5 * (line[1:] + line[:-1])
    assert np.all(steps <= 1.1 * (0.1 + 0.2 * np.abs(middle)))
    assert len(graded_line(-1.0, 3.0, lambda s: 0.1 + 0.2 * np.abs(s), 0.75)) < len(line)


def test_far_sides_of_a_low_block_have_no_layer():
    near, far = (dataclasses.replace(BLOCK, length_mm=length, width_mm=60.0, height_mm=3.0) for length in (16.0, 60.0))
    near, far = (block_lines(block, POINTS, (False, True), GRADING)[0] for block in (near, far))
    assert np.diff(near)[-1] < 0.5 < 5.0 < np.diff(far)[-1]


def test_foot_of_a_column():
    """A slender one is clamped over its width: from its foot the distance grows by each mm; a low one has its image."""
    centre = np.zeros((1, 2))
    up = np.array([0.0, 0.5, 1.5])
    found = _distance_to_image(40.0 - up, UP, (2.0, 3.0, 40.0), centre)
    np.testing.assert_allclose(found, 2.0 * SLENDER + up)
    low = _distance_to_image(np.array([3.0]), UP, (60.0, 60.0, 3.0), centre)
    np.testing.assert_allclose(low, min(DEPTH * 3.0, 60.0 * SLENDER))
    beside = _distance_to_image(np.array([4.0, -4.0]), 0, (20.0, 60.0, 50.0), np.array([[1.0, 0.0]]))
    np.testing.assert_allclose(beside, [2.0 * 9.0 - 3.0, 2.0 * 11.0 - 5.0])  # behind the nearer face each time


def test_faces_of_the_box_are_named():
    mesh = box_mesh((np.array([0.0, 1.0, 3.0]), np.array([-1.0, 1.0]), np.array([0.0, 2.0])))
    assert set(mesh.boundaries) == {"x_low", "x_high", "y_low", "y_high", "top", "base"}
    for name, axis, place in (("x_high", 0, 3.0), ("y_low", 1, -1.0), ("top", 2, 0.0), ("base", 2, 2.0)):
        corners = mesh.p[:, mesh.facets[:, mesh.boundaries[name]]]
        np.testing.assert_array_equal(corners[axis], place)
    assert len(mesh.boundaries["top"]) == 2
