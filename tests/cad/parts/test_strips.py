"""Strips of sheet and the bodies that are printed around them, by the volumes of boxes."""

from dataclasses import replace

import cadquery as cq
import pytest
from steel_strips import PAIR, SQUARE, steel_housing, steel_sensor

from cad.parts.assembly import assembly_bodies, outwards
from cad.parts.sensor import HOUSING_COLOUR, STRIP_COLOUR
from cad.parts.strips import cut_strips, glue_volume, length_of_stock, pieces_of_stock, printed_bodies, strip_shapes


def test_frame_and_shuttles_are_the_whole_less_leaves_and_slots():
    sensor = steel_sensor()
    housing = sensor.housing
    bodies = printed_bodies(sensor.part.shape, housing)
    assert list(bodies) == ["frame", "low shuttle", "high shuttle"]
    assert all(body.isValid() for body in bodies.values())
    cut = 0.0
    for arm in housing.arms:
        t, L = arm.flexure.thickness, arm.flexure.length
        cut += 2.0 * 10.0 * (t * L + 2.0 * 5.0 * (t + 0.2))  # two leaves, each with two slots of 4.5 + 0.5 mm
    volume = sum(body.Volume() for body in bodies.values())
    assert volume == pytest.approx(sensor.part.shape.Volume() - cut, rel=1e-9)
    low, high = (bodies[f"{name} shuttle"].BoundingBox() for name in ("low", "high"))
    assert (low.xmin, low.xmax, low.zmin) == pytest.approx((-7.0, -1.0, 0.0), abs=1e-6)
    assert (high.xmin, high.xmax, high.zmin) == pytest.approx((1.0, 7.0, 0.0), abs=1e-6)


def test_shuttle_that_hangs_on_the_frame_is_refused():
    sensor = steel_sensor()
    low = sensor.housing.arms[0]
    bridge = cq.Solid.makeBox(low.flexure.length, 10.0, 1.0, cq.Vector(low.wall, -5.0, low.levels[0] + 3.0))
    with pytest.raises(ValueError, match="2 printed bodies"):
        printed_bodies(sensor.part.shape.fuse(bridge), sensor.housing)


def test_printed_leaves_are_one_body(sensor):
    assert printed_bodies(sensor.part.shape, sensor.housing) == {"housing": sensor.part.shape}
    assert (strip_shapes(sensor.housing), cut_strips(sensor.housing)) == ({}, ())


@pytest.mark.parametrize(("design", "plates"), [(PAIR, 1), (SQUARE, 2)])
def test_strips_are_cut_for_all_plates_and_glue_fills_what_they_leave(design, plates):
    housing = steel_housing(design)
    low, high = cut_strips(housing)
    held = 4.5 if plates == 1 else 4.4  # what a shuttle of the square holds
    assert (low.count, high.count) == (2 * plates, 2 * plates)
    assert (low.length, high.length) == pytest.approx((15.5 + 2.0 * held, 16.0 + 2.0 * held))
    assert (low.width, low.thickness) == (housing.depth, 0.1)
    gap = housing.clamp.gap
    slots = [4 * plates * housing.depth * ((held + 0.5) * (t + 2.0 * gap) - held * t) for t in (0.1, high.thickness)]
    assert glue_volume(housing) == pytest.approx(sum(slots))


def test_sheet_yields_what_lies_side_by_side_on_it():
    (strips, _) = cut_strips(steel_housing())
    assert pieces_of_stock(strips, (12.7, 5000.0)) == int(5000.0 / (24.5 + 1.0))  # each with a cut
    assert pieces_of_stock(strips, (20.0, 51.0)) == 4  # no round-off makes fewer of them
    for count in (1, 2, 3, 5, 204):  # what is bought yields as many as are needed, and no row more
        length = length_of_stock(replace(strips, count=count), 20.0)
        assert count <= pieces_of_stock(strips, (20.0, length)) < count + 2
    assert pieces_of_stock(strips, (9.9, 5000.0)) == 0
    assert length_of_stock(strips, 20.0) == pytest.approx(24.5 + 1.0)  # both strips side by side, and a cut
    assert length_of_stock(strips, 9.9) == float("inf")
    assert length_of_stock(replace(strips, count=3), 20.0) == pytest.approx(2 * 25.5)


def test_bodies_of_a_square_are_named_coloured_and_instances_of_one_shape():
    bodies = {body.name: body for body in assembly_bodies(steel_sensor(SQUARE))}
    assert {"frame 1", "frame 2", "low shuttle 1", "high shuttle 2", "front cover", "dowel 2"} <= set(bodies)
    strips = {name: body for name, body in bodies.items() if "strip" in name.split()}
    assert len(strips) == 8
    assert {body.colour for body in strips.values()} == {STRIP_COLOUR}
    assert bodies["high shuttle 2"].colour == HOUSING_COLOUR
    first = strips["low lower strip 1"].shape.wrapped
    assert sum(first.IsPartner(body.shape.wrapped) for body in strips.values()) == 4
    box = strips["low upper strip 2"].shape.BoundingBox()  # turned half round the press axis: behind, to the right
    assert box.center.x > 0.0
    assert box.center.y > 0.0
    assert abs(outwards(strips["low upper strip 2"])) > abs(outwards(bodies["frame 2"]))
