"""Strips in a printed frame pass as they are made; each planted fault fails the verdict that is there for it."""

from dataclasses import replace

import cadquery as cq
import pytest
from steel_strips import DEFLECTIONS, PAIR, SQUARE, steel_sensor

from cad.checks.line_probe import solid_lines
from cad.checks.sensor_checks import check_sensor, volume_verdict
from cad.checks.strip_checks import spacer_verdicts, stop_strain_verdicts, strip_verdicts
from cad.files.sensor_files import export_step, write_sensor
from cad.parts.housing_solid import housing_part
from cad.parts.part import one_shape
from cad.parts.spacer import spacer_parts
from cad.parts.strips import printed_bodies, strip_shapes
from sensor.verdict import at_least

OF_STRIPS = {
    "strip_slots", "strip_ends", "free_length_low", "free_length_high", "strip_clearance", "strip_stock",
    "stop_strain_low", "stop_strain_high",
}  # fmt: skip


@pytest.fixture(scope="module")
def sensor():
    return steel_sensor()


@pytest.fixture(scope="module")
def folder(sensor, tmp_path_factory):
    folder = tmp_path_factory.mktemp("steel")
    write_sensor(sensor, folder)
    return folder


def failed(verdicts):
    return {verdict.name.removeprefix("geometry."): verdict for verdict in verdicts if verdict.passed is not True}


def judged(sensor, printed=None, strips=None):
    """Return the failed verdicts on a sensor whose printed bodies or strips are other ones than it has."""
    printed = printed or sensor.printed_shape()
    strips = strips or one_shape(strip_shapes(sensor.housing).values())
    return failed(strip_verdicts(sensor, strips, {"solid": solid_lines(printed)}, DEFLECTIONS))


def box(x, z, width, height):
    """Return a box through the depth about a point (x, z) [mm]."""
    return cq.Solid.makeBox(width, 10.0, height, cq.Vector(x - 0.5 * width, -5.0, z - 0.5 * height))


def with_clamp(sensor, **changes):
    """Return the printed bodies and the strips of the housing whose clamps differ."""
    housing = replace(sensor.housing, clamp=replace(sensor.housing.clamp, **changes))
    printed = one_shape(printed_bodies(housing_part(housing).shape, housing).values())
    return printed, one_shape(strip_shapes(housing).values())


def test_sensor_with_its_files_passes_every_check(sensor, folder):
    verdicts = check_sensor(sensor, DEFLECTIONS, folder)
    assert failed([*verdicts, volume_verdict(sensor, folder)]) == {}
    assert {verdict.name.removeprefix("geometry.") for verdict in verdicts} == OF_STRIPS | {
        "valid", "one_solid", "watertight", "step_round_trip", "leaf_thickness_low", "leaf_thickness_high",
        "frame_clearance", "neck_clearance", "stops_low", "stops_high", "deflected_gap_low", "deflected_gap_high",
        "manifold", "fillets", "tips",
    }  # fmt: skip


def test_square_and_its_tool_pass():
    square = steel_sensor(SQUARE)
    assert judged(square) == {}
    tool = one_shape(spacer_parts(square.housing).values())
    assert failed(spacer_verdicts(square, tool, SQUARE.process)) == {}


def test_slot_that_is_too_narrow_fails(sensor):
    printed, _ = with_clamp(sensor, gap=0.06)
    verdict = judged(sensor, printed)["strip_slots"]
    assert (verdict.limit, verdict.value) == (0.1, pytest.approx(0.06, abs=1e-6))


def test_slot_that_is_filled_fails(sensor):
    (start, end), (foot, top) = sensor.housing.strips[0].slots[0]
    plug = box(0.5 * (start + end), 0.5 * (foot + top), end - start, top - foot)
    verdict = judged(sensor, sensor.printed_shape().fuse(plug))["strip_slots"]
    assert verdict.value is None
    assert "low lower strip" in verdict.reference


def test_strip_that_is_too_long_fails_as_read_from_its_file(sensor, tmp_path):
    """By 0.3 mm at each end: 0.2 mm of the room of 0.5 mm are left."""
    _, longer = with_clamp(sensor, length=4.8)
    bodies = [replace(body, shape=shape) for body, shape in zip(sensor.strip_bodies(), longer.Solids(), strict=True)]
    found = judged(sensor, strips=export_step(bodies, tmp_path / "strips.step"))
    assert {name: verdict.value for name, verdict in found.items()} == {"strip_ends": pytest.approx(0.2, abs=1e-6)}


@pytest.mark.parametrize("arm", [0, 1], ids=["low", "high"])
def test_clamp_that_misses_the_shoulder_fails(sensor, arm):
    """A step of 0.4 mm beside one slot of the wall: there the strip is held later than at the shoulder."""
    arm = sensor.housing.arms[arm]
    step = box(arm.wall + arm.sign * 0.2, arm.levels[1] + 0.8, 0.4, 1.6)
    found = judged(sensor, sensor.printed_shape().cut(step))
    length = arm.flexure.length + 0.4
    assert found[f"free_length_{arm.name}"].value == pytest.approx(length, abs=1e-6)


def test_rib_beside_a_strip_fails(sensor):
    low = sensor.housing.arms[0]
    x = 0.5 * sum(low.roots)
    for gap, is_free in ((0.08, False), (0.12, True)):
        rib = box(x, low.levels[0] - 0.05 - gap - 0.5, 1.0, 1.0)
        found = judged(sensor, one_shape([*sensor.printed_shape().Solids(), rib]))
        assert ("strip_clearance" not in found) == is_free
    touching = box(x, low.levels[0], 1.0, 1.0)
    verdict = judged(sensor, one_shape([*sensor.printed_shape().Solids(), touching]))["strip_clearance"]
    assert verdict.value is None


def test_deflected_strip_needs_its_way_too(sensor):
    """A rib over the upper low strip near the shuttle: free at rest, in the way at full travel."""
    low = sensor.housing.arms[0]
    rib = box(low.shuttle - 0.02 * low.flexure.length, low.levels[1] + 0.05 + 0.4 + 0.25, 1.0, 0.5)
    found = judged(sensor, one_shape([*sensor.printed_shape().Solids(), rib]))
    assert found["strip_clearance"].value == pytest.approx(0.4 - 0.5, abs=0.02)


def test_stop_that_lets_the_steel_tire_fails(sensor):
    """E = 1.1 x 3 t d / L^2: with 0.3 mm of steel, 16 mm and 0.0019 the way is at most 0.491 mm."""
    for way, passed in ((0.49, True), (0.495, False)):
        stops = [
            at_least(f"geometry.stops_{name}", way, 0.1, 0.0, unit="mm", reference="planted")
            for name in ("low", "high")
        ]
        low, high = stop_strain_verdicts(sensor, stops)
        assert (low.passed, high.passed) == (True, passed)
        assert high.value == pytest.approx(1.1 * 3.0 * 0.3 * way / 16.0**2)
    low, _ = stop_strain_verdicts(sensor, [replace(stop, value=None) for stop in stops])
    assert (low.passed, low.value) == (False, None)


def test_strips_that_no_sheet_is_wide_enough_for_fail(sensor):
    narrow = replace(sensor.sheet, stock_widths_mm=(9.9,), stock_lengths_mm=(5000.0,))
    found = judged(replace(sensor, sheet=narrow))
    assert {name: verdict.value for name, verdict in found.items()} == {"strip_stock": 0.0}


def lipped(block):
    """Return a block with a lip in front of a wall, on the side of the bed: its handle cannot pull it out."""
    end = block.BoundingBox()
    return block.fuse(cq.Solid.makeBox(end.xlen + 2.0, 1.0, 4.0, cq.Vector(end.xmin - 1.0, end.ymax, end.center.z)))


def bitten(block):
    """Return a block that is 0.1 mm too short at its foot alone."""
    return block.cut(block.translate(cq.Vector(15.4, 0.0, -0.7 * block.BoundingBox().zlen)))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lipped, "cannot be taken out"),
        (lambda block: block.fuse(block.translate(cq.Vector(0.3, 0.0, 0.0))), "cuts into"),
        (lambda block: block.fuse(block.translate(cq.Vector(0.0, 0.0, 1.8))), "from a strip"),
        (lambda block: block.cut(block.translate(cq.Vector(15.4, 0.0, 0.0))), "farthest low block"),
        (bitten, "farthest low block"),
    ],
    ids=["lip", "too long", "on a strip", "too short", "too short at its foot"],
)
def test_tool_that_is_wrong_fails(sensor, change, reason):
    parts = spacer_parts(sensor.housing)
    wrong = one_shape([change(parts["low block"]), parts["high block"], parts["rail"]])
    (verdict,) = spacer_verdicts(sensor, wrong, PAIR.process)
    assert verdict.passed is False
    assert reason in verdict.reference


def test_tool_whose_rail_is_low_or_missing_fails(sensor):
    parts = spacer_parts(sensor.housing)
    low = replace_rail(parts, parts["rail"].translate(cq.Vector(0.0, 0.0, -0.2)))
    (verdict,) = spacer_verdicts(sensor, low, PAIR.process)
    assert (verdict.passed, verdict.value) == (False, pytest.approx(-0.2, abs=1e-6))
    (verdict,) = spacer_verdicts(sensor, one_shape([parts["low block"], parts["high block"]]), PAIR.process)
    assert (verdict.passed, verdict.value) == (False, None)


def replace_rail(parts, rail):
    return one_shape([parts["low block"], parts["high block"], rail])
