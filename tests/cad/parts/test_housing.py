import dataclasses
import functools
import math

import cadquery as cq
import pytest

from cad.parts.housing import Housing
from cad.parts.housing_solid import housing_part
from sensor.quantity import InputError
from sensor.theory.leaf_spring import Flexure

ROUND_OFF = 1e-9
LOW = Flexure(thickness=0.8, length=28.3, depth=10.0, separation=14.0, fillet=0.5)
HIGH = Flexure(thickness=1.2, length=14.9, depth=10.0, separation=14.0, fillet=0.5)
HOUSING = Housing(
    low=LOW, high=HIGH, tip_side=1.0, tip_height=1.0, spacing=8.0, shuttle_width=6.0, neck_level=5.5,
    lower_leaf_level=7.6, low_top_level=24.0, high_top_level=24.45, cavity_level=24.75, top_level=30.75, protrusion=1.7,
)  # fmt: skip


def _changed(low=None, high=None, **sizes):
    low_leaf = dataclasses.replace(LOW, **(low or {}))
    high_leaf = dataclasses.replace(HIGH, **(high or {}))
    return dataclasses.replace(HOUSING, low=low_leaf, high=high_leaf, **sizes)


DEEP = {"depth": 6.0}
VARIANTS = {
    "plastic": HOUSING,
    "small tip": _changed(tip_side=0.2, tip_height=0.9, neck_level=5.8),
    "tip as deep as the plate": _changed(DEEP, DEEP, tip_side=6.0, tip_height=3.0, neck_level=5.0),
    "steel": _changed(
        {"thickness": 0.5, "length": 68.4, "depth": 6.0}, {"thickness": 0.8, "length": 38.5, "depth": 6.0},
        neck_level=3.5,
    ),
}  # fmt: skip
each_housing = pytest.mark.parametrize("housing", VARIANTS.values(), ids=VARIANTS)


_part = functools.cache(housing_part)


@each_housing
def test_named_faces_of_one_valid_solid_have_the_areas_of_the_formulas(housing):
    part = _part(housing)
    assert part.shape.isValid()
    assert part.shape.ShapeType() == "Solid"
    # A neck reaches the sides of the plate where its tip is as deep as it.
    on_sides = [face.Area() for face in part.shape.Faces() if abs(abs(face.Center().y) - 0.5 * housing.depth) < 1e-9]
    expected = {
        "low_tip": housing.tip_side**2,
        "high_tip": housing.tip_side**2,
        "mounting_holes": 4.0 * math.pi * housing.hole_diameter * housing.depth,
        "side_faces": sum(on_sides),
    }
    assert {name: part.face_area(name) for name in part.faces} == pytest.approx(expected, rel=ROUND_OFF)
    centres = {name: part.shape.Faces()[part.faces[name][0]].Center().toTuple() for name in ("low_tip", "high_tip")}
    assert centres["low_tip"] == pytest.approx((-0.5 * housing.spacing, 0.0, 0.0), abs=1e-9)
    assert centres["high_tip"] == pytest.approx((0.5 * housing.spacing, 0.0, 0.0), abs=1e-9)


@each_housing
def test_depth_share_is_that_of_the_solid(housing):
    shape = _part(housing).shape
    x = 0.5 * housing.spacing
    levels = (0.5 * housing.tip_height, 0.5 * (housing.tip_height + housing.neck_level), housing.neck_level + 0.5)
    for z in levels:
        across = cq.Edge.makeLine(cq.Vector(x, -20.0, z), cq.Vector(x, 20.0, z))
        inside = sum(edge.Length() for edge in across.intersect(shape).Edges())
        assert inside == pytest.approx(housing.depth_share(z) * housing.depth, abs=1e-6)


@pytest.mark.parametrize(
    ("field", "value"),
    [("tip_side", 6.0001), ("tip_side", 0.0), ("tip_side", math.nan), ("shuttle_width", 8.0)],
)
def test_tips_and_shuttles_without_room_are_refused(field, value):
    with pytest.raises(InputError) as refused:
        dataclasses.replace(HOUSING, **{field: value})
    assert refused.value.field == f"housing.{field}"
