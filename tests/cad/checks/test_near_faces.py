"""The least distance of two shapes against formulas, also where one lies in the other."""

import math

import cadquery as cq
import pytest

from cad.checks.near_faces import nearest_pair

BOX = cq.Solid.makeBox(1.0, 1.0, 1.0)


@pytest.mark.parametrize(
    ("other", "distance"),
    [
        (cq.Solid.makeSphere(1.0, cq.Vector(5.0, 0.5, 0.5)), 3.0),
        (cq.Solid.makeBox(1.0, 1.0, 1.0, cq.Vector(2.0, 2.0, 2.0)), math.sqrt(3.0)),
        (cq.Solid.makeBox(1.0, 1.0, 1.0, cq.Vector(0.5, 0.5, 0.5)), 0.0),
        (cq.Solid.makeBox(9.0, 9.0, 9.0, cq.Vector(-4.0, -4.0, -4.0)), 0.0),
        (cq.Compound.makeCompound([cq.Solid.makeCone(1.0, 0.0, 1.0, cq.Vector(0.5, 0.5, -3.0))]), 2.0),
    ],
    ids=["ball", "corner", "crossing", "around", "cone"],
)
def test_least_distance_is_that_of_a_formula(other: cq.Shape, distance: float) -> None:
    for shapes in ((BOX, other), (other, BOX)):
        assert nearest_pair({"": shapes})[1] == pytest.approx(distance, abs=1e-9)  # the kernel's own limit is 1e-7


def test_nearest_pair_is_the_nearest_of_all_that_stand_in_any_order() -> None:
    apart = {f"{x:g} mm": (BOX, BOX.translate(cq.Vector(1.0 + x, 0.2, 0.0))) for x in (3.0, 0.5, 2.0, 0.25, 1.0)}
    assert nearest_pair(apart) == ("0.25 mm", pytest.approx(0.25, abs=1e-9))
    crossing = {**apart, "crossing": (BOX, BOX.translate(cq.Vector(0.5, 0.5, 0.5)))}
    assert nearest_pair(crossing) == ("crossing", 0.0)
