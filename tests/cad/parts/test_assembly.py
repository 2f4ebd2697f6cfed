"""Two equal plates back to back: where tips, holes and bodies stand."""

import itertools
import math
from dataclasses import replace

import cadquery as cq
import pytest
from squares import GENTLE, RESIN, square_sensor

from cad.parts.assembly import (
    assemble_sensor,
    dowel_length,
    grip,
    placed_shape,
    plate_locations,
    screw_length,
)
from sensor.design.parameters import Print

KERNEL = 1e-6  # [mm] and [mm^3] of the geometry kernel


@pytest.fixture(scope="module")
def bodies(square):
    return {part.name: placed_shape(part) for part in assemble_sensor(square).children}


def test_tips_stand_at_the_places_of_the_layout_with_springs_of_one_kind_on_each_diagonal(square):
    every = square.part.shape.Faces()
    caps = [
        (kind, cq.Compound.makeCompound([every[index] for index in square.part.faces[f"{kind}_tip"]]).moved(place))
        for place in plate_locations(square.housing)
        for kind in ("low", "high")
    ]
    asked = zip(GENTLE.tips.springs, GENTLE.tips.places_mm, strict=True)
    for (kind, cap), (spring, place) in zip(caps, asked, strict=True):
        box = cap.BoundingBox()
        assert kind == spring
        assert (box.center.x, box.center.y, box.zmin) == pytest.approx((*place, 0.0), abs=KERNEL)


def test_every_body_is_named_once_and_valid(bodies):
    counts = {"plate": 2, "screw": 4, "nut": 4, "front_washer": 4, "back_washer": 4, "dowel": 2}
    numbered = {f"{name}_{number}" for name, count in counts.items() for number in range(1, count + 1)}
    assert set(bodies) == numbered | {"front_cover", "back_cover", "fruit"}
    assert all(shape.isValid() for shape in bodies.values())


def test_no_two_bodies_share_a_place_but_a_dowel_that_is_pressed_in(bodies):
    upper = [name for name in bodies if not name.endswith(("_2", "_3", "_4"))]
    for first, second in itertools.combinations(upper, 2):
        volume = sum(solid.Volume() for solid in bodies[first].intersect(bodies[second]).Solids())
        assert volume < KERNEL or (first, second) == ("plate_1", "dowel_1")


def test_pair_is_put_together_with_covers_and_screws(housing, sensor):
    covered = replace(sensor, housing=replace(housing, mount="covers", cover_level=housing.protrusion))
    found = assemble_sensor(covered).objects
    assert {"housing", "front_cover", "back_cover", "fruit"} <= set(found)
    assert sum(name.startswith("screw") for name in found) == len(housing.holes)
    assert not any("cover" in name for name in assemble_sensor(sensor).objects)


def test_dowels_are_pressed_by_the_accuracy_of_the_process_and_none_is_short_enough_for_a_thin_plate(square, bodies):
    housing = square.housing
    assert housing.back_to_back.dowel_hole == 3.0 - RESIN.accuracy_mm
    assert bodies["dowel_1"].Volume() == pytest.approx(0.25 * math.pi * 3.0**2 * dowel_length(housing))
    thin = {kind: replace(getattr(housing, kind), depth=1.0) for kind in ("low", "high")}
    assert dowel_length(replace(housing, **thin, tip_side=1.0, spacing=2.0, shuttle_width=1.5)) is None


@pytest.mark.parametrize(("grip_mm", "length"), [(6.6, 10), (6.61, 12), (17.6, 25), (46.6, 50), (46.61, None)])
def test_screw_reaches_through_its_nut_and_two_washers(grip_mm, length):
    """M3: a nut of 2.4 mm, ISO 4032, and washers of 0.5 mm, ISO 7089."""
    assert screw_length(grip_mm) == length


def test_screws_and_dowels_lie_in_their_holes_and_hold_what_lies_between_their_washers(square, bodies):
    half_grip, half_dowel = 0.5 * grip(square), 0.5 * dowel_length(square.housing)
    assert half_grip == pytest.approx(0.5 * 17.6)
    spans = {
        "front_washer_1": (-half_grip - 0.5, -half_grip),
        "back_washer_1": (half_grip, half_grip + 0.5),
        "nut_1": (half_grip + 0.5, half_grip + 2.9),
        "screw_1": (-half_grip - 3.5, -half_grip - 0.5 + 25.0),
        "dowel_1": (-half_dowel, half_dowel),
    }
    for name, span in spans.items():
        box = bodies[name].BoundingBox()
        hole = (square.housing.dowels if name == "dowel_1" else square.housing.holes)[0]
        assert (box.center.x, box.center.z, box.ymin, box.ymax) == pytest.approx((*hole, *span), abs=KERNEL)


def test_plates_between_washers_have_no_covers_and_pins_stand_in_both_plates():
    tips = replace(GENTLE.tips, side_mm=1.4, dome_radius_mm=2.0, spacing_mm=6.0, socket="pin")
    design = replace(GENTLE, tips=tips, print=Print(process="sla-resin", mount="washers"))
    names = set(assemble_sensor(square_sensor(design=design)).objects)
    assert {"plate_1", "plate_2", "low_pin_1", "low_pin_2", "high_pin_1", "high_pin_2"} <= names
    assert not {"front_cover", "back_cover"} & names
