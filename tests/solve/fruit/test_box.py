import dataclasses

import numpy as np

from sensor.design.fruit import Fruit
from solve.fruit.box import Grading, block_lines, box_mesh, graded_line

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


def test_faces_of_the_box_are_named():
    mesh = box_mesh((np.array([0.0, 1.0, 3.0]), np.array([-1.0, 1.0]), np.array([0.0, 2.0])))
    assert set(mesh.boundaries) == {"x_low", "x_high", "y_low", "y_high", "top", "base"}
    for name, axis, place in (("x_high", 0, 3.0), ("y_low", 1, -1.0), ("top", 2, 0.0), ("base", 2, 2.0)):
        corners = mesh.p[:, mesh.facets[:, mesh.boundaries[name]]]
        np.testing.assert_array_equal(corners[axis], place)
    assert len(mesh.boundaries["top"]) == 2
