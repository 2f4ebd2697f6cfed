"""Two equal plates back to back: where tips, holes and bodies stand, and what a mounting error does."""

import itertools
import math
from dataclasses import replace

import cadquery as cq
import numpy as np
import pytest
from squares import GENTLE, RESIN, square_housing, square_sensor

from cad.design.parameters import Print
from cad.parts.assembly import assembly_bodies, dowel_length, finished_part, screw_length, turned_twin
from cad.parts.housing import mounting_error
from cad.parts.housing_solid import housing_part
from cad.parts.pose import in_place

KERNEL = 1e-6  # [mm] and [mm^3] of the geometry kernel


@pytest.fixture(scope="module")
def square():
    return square_sensor()


@pytest.fixture(scope="module")
def bodies(square):
    return {body.name: body.shape for body in assembly_bodies(square)}


def test_frame_has_equal_halves_whichever_arm_is_longer():
    for lengths in ((20.0, 8.0), (8.0, 20.0), (12.0, 12.0)):
        housing = square_housing(lengths=lengths)
        assert housing.left == -housing.right
        for places in (housing.holes, housing.dowels):
            assert sorted(places) == sorted((-x, z) for x, z in places)
        for arm in housing.arms:
            assert abs(arm.post) >= abs(arm.wall)
            assert abs(arm.outer) - abs(arm.post) == pytest.approx(housing.wall_width)


def test_plate_is_one_valid_solid_in_every_process_with_its_named_faces():
    for name in ("fdm-petg", "sls-pa12", "dmls-ti64"):
        design = replace(GENTLE, print=Print(process=name))
        part = finished_part(square_housing(design))
        assert part.shape.isValid()
        assert part.shape.ShapeType() == "Solid"
        assert len(part.faces["mounting_holes"]) == 4


def test_pads_and_holes_change_the_volume_by_their_own(square):
    """Plate, pad of the posts and the bar, less its holes, less two holes for dowels, less what the domes take."""
    housing = square.housing
    flat = replace(housing, dome_radius=0.0)
    foot, top, wide = housing.cover_level, housing.top_level, housing.right - housing.left
    inner = wide - 2.0 * (housing.wall_width - 1.0)
    area = wide * (top - foot) - inner * (housing.cavity_level + 1.0 - foot)
    on_pad = 4.0 * math.pi * (0.5 * housing.hole_diameter) ** 2
    dowels = 2.0 * math.pi * (0.5 * housing.dowel_hole) ** 2
    assert housing.dowels[0][1] - 0.5 * housing.dowel_hole > housing.cavity_level + 1.0  # whole in the pad
    expected = housing_part(flat).shape.Volume() + (area - on_pad - dowels) * housing.pad_height
    expected -= dowels * housing.depth
    assert finished_part(flat).shape.Volume() == pytest.approx(expected, rel=1e-9)


def test_tips_stand_at_the_places_of_the_layout_with_springs_of_one_kind_on_each_diagonal(square):
    """The low tip is the one whose leaves are longer."""
    housing, found = square.housing, []
    every = square.part.shape.Faces()
    for twin in (False, True):
        for kind in ("low", "high"):
            cap = in_place(cq.Compound.makeCompound([every[i] for i in square.part.faces[f"{kind}_tip"]]), housing)
            box = (turned_twin(cap) if twin else cap).BoundingBox()
            assert box.zmin == pytest.approx(0.0, abs=KERNEL)
            found.append((kind, (box.center.x, box.center.y)))
    asked = zip(GENTLE.tips.springs, GENTLE.tips.places_mm, strict=True)
    for (kind, place), (spring, wanted) in zip(found, asked, strict=True):
        assert kind == spring
        assert place == pytest.approx(wanted, abs=KERNEL)


def test_every_body_is_named_once_and_valid(bodies):
    assert [name for name in bodies if not name.endswith(("1", "2", "3", "4"))] == [
        "front cover",
        "back cover",
        "fruit",
    ]
    counts = {"plate": 2, "screw": 4, "nut": 4, "front washer": 4, "back washer": 4, "dowel": 2}
    for name, count in counts.items():
        assert {f"{name} {number}" for number in range(1, count + 1)} <= set(bodies)
    assert len(bodies) == sum(counts.values()) + 3
    assert all(shape.isValid() for shape in bodies.values())


def test_pair_is_put_together_with_covers_and_screws(housing, sensor):
    covered = replace(sensor, housing=replace(housing, mount="covers", cover_level=housing.protrusion))
    found = {body.name: body.shape for body in assembly_bodies(covered)}
    assert {"housing", "front cover", "back cover", "fruit"} <= set(found)
    assert sum(name.startswith("screw") for name in found) == len(housing.holes)
    for a, b in itertools.combinations(found, 2):
        assert sum(solid.Volume() for solid in found[a].intersect(found[b]).Solids()) < KERNEL, (a, b)
    assert not any("cover" in body.name for body in assembly_bodies(sensor))


def test_no_two_bodies_share_a_place_but_a_dowel_that_is_pressed_in(bodies):
    for a, b in itertools.combinations(bodies, 2):
        if {a.split()[0], b.split()[0]} == {"plate", "dowel"}:
            continue
        common = bodies[a].intersect(bodies[b]).Solids()
        assert sum(solid.Volume() for solid in common) < KERNEL, (a, b)


def test_dowels_are_pressed_by_the_accuracy_of_the_process_and_end_inside(square, bodies):
    housing = square.housing
    assert housing.dowel_hole == 3.0 - RESIN.accuracy_mm
    for number in (1, 2):
        box = bodies[f"dowel {number}"].BoundingBox()
        assert box.xlen == pytest.approx(3.0, abs=KERNEL)
        assert -0.5 * housing.stack <= box.ymin < -0.3 * housing.stack
        assert box.ymax == pytest.approx(-box.ymin)
    thin = {kind: replace(getattr(housing, kind), depth=1.0) for kind in ("low", "high")}
    assert dowel_length(replace(housing, **thin, tip_side=1.0, spacing=2.0, shuttle_width=1.5)) is None


def test_screw_reaches_through_its_nut_and_two_washers(bodies):
    screw, nut = bodies["screw 1"].BoundingBox(), bodies["nut 1"].BoundingBox()
    assert screw.ymax >= nut.ymax
    assert nut.ymin == pytest.approx(0.5 * 17.6 + 0.5)
    assert screw_length(17.6) == 25
    assert screw_length(60.0) is None


def test_plates_between_washers_have_no_covers():
    sensor = square_sensor(square_housing(replace(GENTLE, print=Print(process="sla-resin", mount="washers"))))
    names = [body.name for body in assembly_bodies(sensor)]
    assert "front cover" not in names
    assert "plate 2" in names


def test_pins_stand_in_both_plates():
    design = replace(GENTLE, tips=replace(GENTLE.tips, side_mm=1.4, dome_radius_mm=2.0, spacing_mm=6.0, socket="pin"))
    sensor = square_sensor(design=design)
    names = [body.name for body in assembly_bodies(sensor)]
    assert {"low pin 1", "low pin 2", "high pin 1", "high pin 2"} <= set(names)


def test_mounting_error_is_that_of_a_plate_moved_as_a_rigid_body(square):
    """Two dowels off by twice the accuracy against each other lift a plate, or turn it about the middle between them.

    What is left of the heights of the four tips after the best plane is what the contrast of the kinds reads.
    """
    housing = square.housing
    error = mounting_error(housing, 0.05)
    (left, _), (right, _) = sorted(housing.dowels)
    places = np.array(GENTLE.tips.places_mm)
    weights = np.array([-0.5 if kind == "low" else 0.5 for kind in GENTLE.tips.springs])
    of_twin = places[:, 1] > 0.0
    lifted = np.where(of_twin, 0.1, 0.0)
    assert error.height_mm == pytest.approx(0.1)
    assert weights @ lifted == pytest.approx(0.0, abs=1e-15)
    assert error.roll == pytest.approx(np.polyfit(places[:, 1], lifted, 1)[0])
    turned = np.where(of_twin, np.interp(places[:, 0], [left, right], [-0.1, 0.1]), 0.0)
    assert abs(weights @ turned) == pytest.approx(error.contrast_mm, rel=1e-12)
    assert error.turn == pytest.approx(0.2 / (right - left), rel=1e-12)
