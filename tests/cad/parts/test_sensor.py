from dataclasses import replace

import cadquery as cq
import pytest

from cad.parts.assembly import assemble_sensor, placed_shape
from cad.parts.pose import pressed_pose
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips

KERNEL = 1e-6  # the kernel pads its boxes


def test_apex_of_a_curved_fruit_waits_below_the_tips(sensor):
    """Its top falls away from the apex, 1.25 mm beside the midpoint of the tips, as a sphere of its radius."""
    sphere = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=20.0)
    apart = replace(sensor, fruit=sphere, tips=Tips(gap_mm=0.7, offset_mm=1.25))
    fruit = placed_shape(assemble_sensor(apart).objects["fruit"])
    for x in (-9.0, 0.0, 5.0):
        line = cq.Edge.makeLine(cq.Vector(x - 1.25, 0.0, 10.0), cq.Vector(x - 1.25, 0.0, -20.0))
        assert line.intersect(fruit).BoundingBox().zmax == pytest.approx(-0.7 - sphere.fall_mm(x, 0.0), abs=KERNEL)


@pytest.mark.parametrize(("heading", "down"), [(0.0, (1.0, 0.0)), (90.0, (0.0, 1.0)), (180.0, (-1.0, 0.0))])
def test_the_heading_is_the_side_that_goes_down(heading, down):
    point = cq.Vertex.makeVertex(10.0 * down[0], 10.0 * down[1], 0.0)
    moved = point.moved(pressed_pose(0.6, 30.0, heading)).Center()
    assert moved.z == pytest.approx(-0.6 - 10.0 * 0.5, abs=KERNEL)
