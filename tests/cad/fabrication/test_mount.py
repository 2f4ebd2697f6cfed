"""The bracket: its holes, what it stays away from, and planted wrong ones that fail their verdict."""

from dataclasses import replace

import cadquery as cq
import pytest
from squares import RESIN

from cad.checks.clearance import moving_part
from cad.fabrication.mount import PLATE_MM, bracket_seat_y, bracket_solid, mounted_grip
from cad.fabrication.mount_checks import mount_verdicts
from cad.parts.assembly import grip, plate_locations, screw_length


@pytest.fixture(scope="module")
def bracket(square):
    return bracket_solid(square)


def outcome(sensor, shape):
    return {one.name.removeprefix("geometry.mount_"): one.passed for one in mount_verdicts(sensor, shape, RESIN)}


ALL = {"clearance": True, "over_fruit": True}


def test_bracket_passes_behind_a_pair_and_behind_a_square(sensor, square, bracket):
    assert outcome(square, bracket) == ALL
    assert outcome(sensor, bracket_solid(sensor)) == ALL
    covered = replace(sensor, housing=replace(sensor.housing, mount="covers", cover_level=sensor.housing.protrusion))
    assert outcome(covered, bracket_solid(covered)) == ALL


def test_screws_reach_through_the_bracket_too(square):
    assert mounted_grip(square) == grip(square) + PLATE_MM
    assert screw_length(mounted_grip(square)) >= mounted_grip(square) + 2.4 + 2.0 * 0.5  # a nut and two washers
    assert bracket_seat_y(square) == 0.5 * grip(square)


def test_rear_washer_between_frame_and_bracket_is_in_the_grip(sensor):
    """Head, washer, frame, washer, bracket, washer, nut: the nut's end is where the bracket's back, 0.5 and 2.4 end."""
    bare = replace(sensor, housing=replace(sensor.housing, mount="washers"))
    bracket = bracket_solid(bare).BoundingBox()
    upright_back = bracket_seat_y(bare) + PLATE_MM
    assert bracket.ymin <= bracket_seat_y(bare) <= bracket.ymax
    assert mounted_grip(bare) == pytest.approx(upright_back + 0.5 * bare.housing.depth)
    assert bracket_seat_y(bare) - 0.5 * bare.housing.depth == 0.5


@pytest.mark.parametrize(
    ("move", "failing"),
    [
        ((0.0, 0.0, -10.0), {"clearance", "over_fruit"}),
        ((0.0, -8.0, 0.0), {"clearance"}),
    ],
)
def test_planted_wrong_place_fails(move, failing, square, bracket):
    found = outcome(square, bracket.translate(cq.Vector(*move)))
    assert {name for name, passed in found.items() if passed is not True} >= failing


@pytest.mark.parametrize("plate", [0, 1])
def test_planted_wall_near_either_plate_fails(plate, square, bracket):
    """A wall 0.1 mm beside a shuttle, on the side of the bracket's plate that faces away from the other plate."""
    shuttle = moving_part(square, square.housing.arms[0]).moved(plate_locations(square.housing)[plate]).BoundingBox()
    near = shuttle.ymin - 1.1 if shuttle.center.y < 0.0 else shuttle.ymax + 0.1
    wall = cq.Solid.makeBox(shuttle.xlen, 1.0, 2.0, cq.Vector(shuttle.xmin, near, shuttle.zmax - 2.0))
    assert outcome(square, cq.Compound.makeCompound([bracket, wall])) == {"clearance": False, "over_fruit": True}
