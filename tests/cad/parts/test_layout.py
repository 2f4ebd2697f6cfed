"""The layout rule: what it promises about levels, stops and the stance over the fruit, for any design."""

import dataclasses
import math

import pytest

from cad.parts.housing_solid import housing_part
from cad.parts.layout import housing_for
from sensor.design.design_file import design_from_mapping
from sensor.design.parameters import Design
from sensor.design.processes import PROCESSES

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
    "tilted press": {"press": {"tilt_deg": 8.0}},
    "offset tips": {"fruit": {"length_mm": 60.0}, "tips": {"offset_mm": 12.0}},
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
def test_every_design_has_room_to_move_and_tapers_as_it_prints(tables):
    """A point of the frame sinks by the travel, and by tan 3 degrees or that of the press for its distance from x = 0.

    A neck narrows at 45 degrees or steeper: a flatter taper would be an overhang in print.
    """
    design = design_from_mapping(tables)
    found = housing(design)
    reach = min(0.5 * design.fruit.length_mm + abs(design.tips.offset_mm), max(-found.left, found.right))
    tilt = math.radians(max(3.0, design.press.tilt_deg))
    assert found.protrusion > design.press.travel_mm + math.tan(tilt) * reach
    rise = found.neck_level - found.tip_height
    assert rise >= 0.5 * (max(found.depth, found.shuttle_width) - found.tip_side)
    half_leaf = 0.5 * max(found.low.thickness, found.high.thickness) + PETG.fillet_mm
    stop = found.cavity_level - found.low_top_level
    assert found.lower_leaf_level - half_leaf >= max(found.neck_level, found.protrusion)
    assert found.lower_leaf_level + found.low.separation + half_leaf + stop <= found.cavity_level
    # half as much again as at full travel, or the least gap
    assert stop == pytest.approx(1.5 * DEFLECTIONS[0])
    assert found.cavity_level - found.high_top_level == pytest.approx(PETG.min_gap_mm)


def test_frame_stays_clear_of_the_papers_fruit_by_half_a_millimetre_rounded_up():
    """The frame is longer than the fruit, so that it comes nearest 10 mm from the centre in a tilt of 3 degrees."""
    design = Design()
    spare = housing(design).protrusion - design.press.travel_mm - 10.0 * math.tan(math.radians(3.0))
    assert 0.5 <= spare < 0.6


def test_solved_lengths_change_nothing_but_the_leaves():
    """The solve may stretch a mesh along its leaves only because of this."""
    longer = housing(lengths=(30.0, 16.0))
    back = dataclasses.replace(longer, low=housing().low, high=housing().high)
    assert back == housing()
