"""Presses that pause or change their pace on flesh that relaxes, by boundary elements that share nothing with the law.

Their flesh relaxes as that of a design which states none is taken to. The fruit of 1 MPa is pressed in 3 s.
"""

from dataclasses import replace

import numpy as np
import pytest
from measured_units import MeasuredDesign

from instrument.press.contrast_press import press_reading
from instrument.press.pace import LARGEST_BY_PACE, MAY_RELAX, STATED_SPREAD, pace_shift
from instrument.press.seating import seated_reading
from instrument.press.touches import PressSamples
from solve.presses.bodies import EllipsoidFruit, SprungDomes
from solve.presses.over_time import press_over_time

FLESH = EllipsoidFruit(E=1.0, R1=47.0, R2=110.0)
WAY = np.linspace(0.1, 1.0, 16)
EVEN = 3.0 * WAY
PAUSED = np.insert(WAY, 12, [WAY[11]] * 2), np.insert(EVEN, 12, EVEN[11] + np.array([1.0, 2.0]))
PAUSED[1][14:] += 2.0
SLOWED = 3.0 * (np.minimum(WAY, 0.6) + 3.0 * np.maximum(WAY - 0.6, 0.0))


@pytest.fixture(scope="module")
def unit():
    return MeasuredDesign("mango", assessed=False).measuring()


def pressed(unit, way, t, known=True):
    """Return the samples of a press at parts of the travel and times [s]."""
    design = unit.report.design
    positions = np.array([(place.x, place.y) for place in design.tips.places_mm])
    sensor = SprungDomes(dome_radius=design.tips.dome_radius_mm, positions=positions, K=1.0 / np.diag(unit.C))
    forces = press_over_time(sensor, FLESH, design.press.travel_mm * way, t, MAY_RELAX.arms, 24)
    rows = (forces > unit.least_forces).all(axis=1)
    times = t[rows] if known else np.full(rows.sum(), np.nan)
    return PressSamples(channels=forces[rows], tips=4, t=times, touched_s=0.0)


def reading(unit, *press, **known):
    return press_reading(unit, pressed(unit, *press, **known))


@pytest.fixture(scope="module")
def even(unit):
    return reading(unit, WAY, EVEN)


@pytest.mark.parametrize(("way", "t"), [PAUSED, (WAY, SLOWED)], ids=["pause", "slower"])
def test_an_uneven_pace_has_a_flag_and_its_size_in_the_bar(unit, even, way, t):
    """The size is somewhat less than the change, for springs are taken to have bent as they did at the uneven pace."""
    found = reading(unit, way, t)
    moved = even.E / found.E - 1.0
    assert found.E < even.E
    assert "uneven_pace" in found.flags
    assert "one_sample" not in found.flags
    assert 0.6 * moved < found.u - even.u < 1.1 * moved
    assert moved < found.u


@pytest.mark.parametrize("t", [EVEN, pytest.param(3.0 * EVEN, marks=pytest.mark.slow)], ids=["3 s", "9 s"])
def test_an_even_pace_has_none_whatever_it_is(unit, t):
    assert "uneven_pace" not in reading(unit, WAY, t).flags


def test_without_times_nothing_is_known_of_a_pace(unit):
    assert "uneven_pace" not in reading(unit, *PAUSED, known=False).flags


def test_a_stated_relaxation_leaves_what_fruit_differs_by(unit):
    """A pace is undone for flesh that relaxes as stated; of its size 0.3 is left, which 2 % may exceed or not."""
    design = unit.report.design
    over_time = replace(design.press, speed_mm_per_s=0.4, hold_s=3.0)
    stated = replace(design, press=over_time, fruit=replace(design.fruit, relaxation=MAY_RELAX.arms))
    sensor = replace(unit, report=replace(unit.report, design=stated))
    samples = pressed(unit, *PAUSED)
    seated = seated_reading(unit, unit.rise_law, samples, 1)
    whole, left = (pace_shift(each, samples, seated) for each in (unit, sensor))
    assert whole > LARGEST_BY_PACE
    # their ways differ slightly, for the flesh of one of them is taken to be softer
    assert left == pytest.approx(STATED_SPREAD * whole, rel=0.1)
