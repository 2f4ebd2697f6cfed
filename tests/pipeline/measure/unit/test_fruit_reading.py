"""One reading: exact where nothing is off, each flag where its cause is planted, refused without every tip."""

import math
from dataclasses import replace

import numpy as np
import pytest

from pipeline.measure.unit.presses import reading_of
from pipeline.measure.unit.ripeness import ripeness_classes
from solve.contact.poses import Pose

FULL = 0.5  # [mm] travel of the square


def pressed(mango, E, **pose):
    return mango.forces([Pose(E=E, travel=FULL, **pose)])[0].tolist()


def test_level_square_reads_what_it_presses(mango):
    sensor = mango.measuring(classes=ripeness_classes("ripe:0.8,unripe"))
    for E in np.geomspace(0.5, 3.5, 23).tolist():
        reading = reading_of(sensor, pressed(mango, E))
        assert pytest.approx(E, rel=1e-3) == reading.E
        assert reading.reduced == pytest.approx(E / 0.91, rel=1e-3)
        assert reading.flags == ()
        assert reading.ripeness == ("ripe" if E <= 0.8 else "unripe")
        assert reading.tilt == pytest.approx(0.0, abs=0.05)


def test_tilt_and_its_direction_are_read(mango):
    for direction in (0.0, 90.0, -135.0):
        tilt = tuple(3.0 * np.array([math.cos(math.radians(direction)), math.sin(math.radians(direction))]))
        reading = reading_of(mango.measuring(), pressed(mango, 1.0, tilt_deg=tilt))
        assert reading.tilt == pytest.approx(3.0, rel=0.05)
        assert reading.direction == pytest.approx(direction, abs=2.0)
        assert reading.flags == ()


def test_planted_causes_raise_their_flags(mango):
    sensor = mango.measuring()
    upright = replace(mango.design, reading=replace(mango.design.reading, tilt_deg=1.0))
    narrow = replace(sensor, report=replace(sensor.report, design=upright))
    forces = pressed(mango, 1.0, tilt_deg=(3.5, 0.0))
    assert reading_of(narrow, forces).flags == ("tilt_beyond_design",)
    assert reading_of(sensor, forces).flags == ()
    soft = reading_of(sensor, pressed(mango, 0.3))
    assert soft.flags == ("out_of_range",)
    assert pytest.approx(0.3, rel=0.01) == soft.E
    tender = replace(mango.design, fruit=replace(mango.design.fruit, bruise_limit_MPa=0.04))
    bruised = replace(sensor, report=replace(sensor.report, design=tender))
    assert reading_of(bruised, pressed(mango, 0.6)).flags == ("press_over_bruise_limit",)
    for forces, flags in (
        ([0.0, 0.4, 0.06, 0.4], ("lift_off",)),
        ([-1.0, 0.4, 0.06, 0.4], ("bad_force", "lift_off")),
        ([math.nan, 0.4, 0.06, 0.4], ("bad_force", "lift_off")),
        ([0.06, 1e6, 0.06, 0.4], ("bad_force",)),
        ([0.4, 0.06, 0.4, 0.06], ("out_of_range",)),
    ):
        refused = reading_of(sensor, forces)
        assert (refused.E, refused.u, refused.flags) == (None, None, flags)


def test_every_source_widens_the_uncertainty(mango):
    sensor = mango.measuring()
    forces = pressed(mango, 1.0)
    bare = reading_of(sensor, forces).u
    unit = sensor.unit
    for key, value in (("K_percent", 3.0), ("gain_percent", 2.0), ("height_error_mm", 0.01)):
        assert reading_of(replace(sensor, unit=replace(unit, **{key: (value,) * 4})), forces).u > 1.2 * bare
    doubled = tuple(replace(row, E_bias_percent=5.0 * row.E_bias_percent) for row in sensor.report.moduli)
    assert reading_of(replace(sensor, report=replace(sensor.report, moduli=doubled)), forces).u > bare


def test_spread_of_poisson_s_ratio_is_in_the_uncertainty_of_E(mango):
    """By the derivative of 1 - nu^2, in squares beside what is there without it."""
    sensor, forces = mango.measuring(), pressed(mango, 1.0)

    def u(spread):
        design = replace(mango.design, fruit=replace(mango.design.fruit, poisson=0.4, poisson_spread=spread))
        return reading_of(replace(sensor, report=replace(sensor.report, design=design)), forces).u

    assert u(0.05) == pytest.approx(math.hypot(u(0.0), 2.0 * 2.0 * 0.4 * 0.05 / (1.0 - 0.4**2)))


def test_reading_that_is_hardly_known_says_so(mango):
    forces = pressed(mango, 1.0)
    for percent, flags in ((1.0, ()), (40.0, ("uncertain",))):
        reading = reading_of(mango.measuring(percent=percent), forces)
        assert reading.flags == flags
        assert (reading.u > 0.5) == bool(flags)


def test_mango_is_within_its_bias_limit_in_every_pose_of_its_reading(mango):
    from pipeline.reading.poses import occurring, read_moduli

    design, sensor = mango.design, mango.measuring()
    for E in read_moduli(design.fruit):
        places = list(occurring(design, design.reading))
        forces = mango.forces([place.pressed(E, FULL) for place in places])
        found = np.array([reading_of(sensor, row).E for row in forces.tolist()])
        assert np.abs(found / E - 1.0).max() < design.reading.bias_limit
