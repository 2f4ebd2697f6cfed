"""The tool for glueing stands where it is used: blocks between wall and shuttle, the rail under walls and tips."""

import pytest
from steel_strips import PAIR, SQUARE, steel_sensor

from cad.parts.part import one_shape
from cad.parts.pose import print_pose
from cad.parts.spacer import BEVEL_MM, HANDLE_MM, spacer_parts


@pytest.mark.parametrize("design", [PAIR, SQUARE])
def test_blocks_touch_wall_and_shuttle_and_the_rail_walls_and_tips(design):
    sensor = steel_sensor(design)
    bodies = {body.name: body.shape for body in sensor.printed_bodies()}
    parts = spacer_parts(sensor.housing)
    assert list(parts) == ["low block", "high block", "rail"]
    for arm in sensor.housing.arms:
        block = parts[f"{arm.name} block"]
        box = block.BoundingBox()
        assert box.xlen == pytest.approx(arm.flexure.length, abs=1e-6)
        assert box.ylen == pytest.approx(sensor.housing.depth + HANDLE_MM, abs=1e-6)
        touched = ("frame", f"{arm.name} shuttle")
        assert [float(block.distance(bodies[name])) for name in touched] == pytest.approx([0.0, 0.0], abs=1e-6)
    touches = [float(parts["rail"].distance(body)) for body in bodies.values()]
    assert touches == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)


@pytest.mark.parametrize("design", [PAIR, SQUARE])
def test_tool_lies_on_the_bed_beside_the_printed_bodies_on_bevelled_edges(design):
    """A first layer that is printed too wide touches nothing: at the bed each part is smaller all round."""
    sensor = steel_sensor(design)
    shape = print_pose(one_shape(spacer_parts(sensor.housing).values()), back_up=sensor.housing.back_to_back)
    for solid in shape.Solids():
        box = solid.BoundingBox()
        assert box.zmin == pytest.approx(0.0, abs=1e-6)
        foot = min(solid.Faces(), key=lambda face: face.Center().z).BoundingBox()
        assert box.xlen - foot.xlen == pytest.approx(2.0 * BEVEL_MM, abs=1e-6)
        assert box.ylen - foot.ylen == pytest.approx(2.0 * BEVEL_MM, abs=1e-6)
