"""The layout rule: what it promises about levels, stops and the stance over the fruit, for any design."""

import dataclasses
import math

import pytest

from cad.parts.housing_solid import housing_part
from cad.parts.layout import housing_for
from sensor.design.design_file import design_from_mapping
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.processes import PROCESSES
from sensor.design.tips import Press, Tips

PETG = PROCESSES["fdm-petg"]
LENGTHS = (28.3, 14.9)
DEFLECTIONS = (0.5, 0.11)
DESIGNS = {
    "paper": {},
    "wide tips": {"tips": {"side_mm": 3.0, "spacing_mm": 12.0}},
    "tip as deep as the plate": {"tips": {"side_mm": 10.0, "spacing_mm": 12.0}, "fruit": {"length_mm": 30.0}},
    "small tips": {"tips": {"side_mm": 0.2}},
    "near tips": {"tips": {"spacing_mm": 1.4}},
    "long fruit": {"fruit": {"length_mm": 200.0, "width_mm": 80.0, "height_mm": 60.0}},
    "deep press": {"press": {"travel_mm": 5.0}},
}


def housing(design=None, process=PETG, lengths=LENGTHS, deflections=DEFLECTIONS):
    return housing_for(design or Design(), process, lengths, deflections)


@pytest.mark.parametrize("tables", DESIGNS.values(), ids=DESIGNS)
def test_every_design_gives_one_valid_solid(tables):
    found = housing(design_from_mapping(tables), PROCESSES["dmls-ti64"])
    shape = housing_part(found).shape
    assert shape.isValid()
    assert shape.ShapeType() == "Solid"
    assert found.shuttle_width >= found.tip_side
    assert found.depth >= found.tip_side


@pytest.mark.parametrize("tables", DESIGNS.values(), ids=DESIGNS)
def test_frame_stays_above_the_fruit_at_full_travel_and_three_degrees(tables):
    """A point of the frame sinks by travel and by its distance from the tips' midpoint times tan 3 degrees."""
    design = design_from_mapping(tables)
    found = housing(design)
    reach = min(0.5 * design.fruit.length_mm, max(-found.left, found.right))
    drop = design.press.travel_mm + math.tan(math.radians(3.0)) * reach
    assert found.protrusion > drop


def test_tilted_press_asks_for_more_room():
    assert housing(Design(press=Press(tilt_deg=8.0))).protrusion > housing().protrusion + 0.5


@pytest.mark.parametrize("side", [0.2, 1.0, 3.0])
def test_neck_narrows_to_the_tip_at_45_degrees_or_steeper(side):
    """A flatter taper would be an overhang in print."""
    found = housing(Design(tips=Tips(side_mm=side)))
    rise = found.neck_level - found.tip_height
    assert rise >= 0.5 * (found.depth - side)
    assert rise >= 0.5 * (found.shuttle_width - side)


def test_leaf_clears_cavity_and_neck():
    found = housing()
    half = 0.5 * max(found.low.thickness, found.high.thickness) + PETG.fillet_mm
    stop = found.cavity_level - found.low_top_level
    assert found.lower_leaf_level - half >= max(found.neck_level, found.protrusion)
    assert found.lower_leaf_level + found.low.separation + half + stop <= found.cavity_level


def test_stops_leave_half_as_much_again_as_full_travel_or_the_least_gap():
    found = housing()
    assert found.cavity_level - found.low_top_level == pytest.approx(1.5 * DEFLECTIONS[0])
    assert found.cavity_level - found.high_top_level == pytest.approx(PETG.min_gap_mm)


def test_offset_tips_reach_farther_over_the_fruit():
    level = housing(Design(fruit=Fruit(length_mm=60.0)))
    offset = housing(Design(fruit=Fruit(length_mm=60.0), tips=Tips(offset_mm=10.0)))
    assert offset.protrusion > level.protrusion


def test_solved_lengths_change_nothing_but_the_leaves():
    """The solve may stretch a mesh along its leaves only because of this."""
    longer = housing(lengths=(30.0, 16.0))
    back = dataclasses.replace(longer, low=housing().low, high=housing().high)
    assert back == housing()
