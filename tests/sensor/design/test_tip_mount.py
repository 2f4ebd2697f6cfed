"""The plate that the tips ask for: its depth and its pads, for a pair and for a square."""

import pytest
from squares import GENTLE, gentle

from sensor.design.parameters import Design
from sensor.design.processes import PROCESSES
from sensor.design.tip_mount import pad_height, plate_depth
from sensor.design.tips import Tips
from sensor.quantity import InputError

PRINTED = ("fdm-petg", "fdm-pla", "sls-pa12", "sla-resin", "dmls-ti64")


@pytest.mark.parametrize("name", PRINTED)
def test_two_plates_of_a_square_and_their_pads_fill_its_side(name):
    """Their middles stand one spacing apart, so depth and two pads are the spacing."""
    process = PROCESSES[name]
    pads = 2.0 * pad_height(process)
    assert plate_depth(GENTLE, process) + pads == pytest.approx(6.0, abs=1e-12)
    assert pads >= process.min_gap_mm
    assert 0.2 <= 0.5 * pads <= 0.3


@pytest.mark.parametrize(
    ("tips", "words"),
    [
        ({"side_mm": 5.8}, ["5.8 mm, and two pads of 0.2", "at least 6.2 mm"]),
        ({"side_mm": 1.0, "spacing_mm": 1.4, "dome_radius_mm": 2.0}, ["two leaf thicknesses of sla-resin, 2 mm"]),
        ({"side_mm": 2.0, "spacing_mm": 4.0, "dome_radius_mm": 1.0, "socket": "pin"}, ["feet of"]),
    ],
    ids=["face too wide for its plate", "side too small for a plate", "feet of pins that meet"],
)
def test_square_that_leaves_no_plate_is_refused_in_one_line(tips, words):
    with pytest.raises(InputError) as caught:
        plate_depth(gentle(**tips), PROCESSES["sla-resin"])
    message = str(caught.value)
    assert message.startswith("tips.spacing_mm = ")
    assert len(message.splitlines()) == 1
    assert all(word in message for word in words)


@pytest.mark.parametrize(
    "tips",
    [
        {"shape": "cylinder", "fillet_mm": 0.1},
        {"shape": "sphere"},
        {"shape": "cone", "half_angle_deg": 70.0},
        {"fillet_mm": 0.1},
    ],
    ids=str,
)
def test_shape_that_no_process_prints_is_taken_as_a_pin(tips):
    design = Design(tips=Tips(**tips, socket="pin"))
    assert plate_depth(design, design.process) >= design.process.depth_mm
