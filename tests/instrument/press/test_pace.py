"""Presses that pause or change their pace on flesh that relaxes, by boundary elements that share nothing with the law.

Their flesh relaxes as that of a design which states none is taken to. The fruit of 1 MPa is pressed in 3 s.
"""

import functools
from dataclasses import replace

import numpy as np
import pytest
from measured_units import MeasuredDesign

from instrument.press.contrast_press import press_reading
from instrument.press.pace import LARGEST_BY_PACE, pace_shift
from instrument.press.touches import PressSamples
from pipeline.reading.reading_over_time import decrease_at_twice_the_time
from sensor.design.reading import PRESS_S
from sensor.theory.relaxation import ASSUMED_RELAXATION, STATED_SPREAD
from solve.contact.relaxing import timed_forces
from solve.presses.press_over_time import press_over_time
from solve.presses.pressed_bodies import EllipsoidFruit, SprungDomes

FLESH = EllipsoidFruit(E=1.0, R1=47.0, R2=110.0)
WAY = np.linspace(0.1, 1.0, 16)
EVEN = 3.0 * WAY
PAUSED = np.insert(WAY, 12, [WAY[11]] * 2), np.insert(EVEN, 12, EVEN[11] + np.array([1.0, 2.0]))
PAUSED[1][14:] += 2.0
SLOWED = 3.0 * (np.minimum(WAY, 0.6) + 3.0 * np.maximum(WAY - 0.6, 0.0))


@pytest.fixture(scope="module")
def mango():
    return MeasuredDesign("mango", assessed=False)


@pytest.fixture(scope="module")
def unit(mango):
    return mango.measuring()


@pytest.fixture(scope="module")
def forces_over(unit):
    """Return a function that gives the forces of a press, each press solved once."""
    design = unit.report.design
    positions = np.array([(place.x, place.y) for place in design.tips.places_mm])
    sensor = SprungDomes(dome_radius=design.tips.dome_radius_mm, positions=positions, K=1.0 / np.diag(unit.C))

    @functools.cache
    def forces(way, t):
        way, t = np.array(way), np.array(t)
        return press_over_time(sensor, FLESH, design.press.travel_mm * way, t, ASSUMED_RELAXATION.arms, 24)

    return lambda way, t: forces(tuple(way.tolist()), tuple(t.tolist()))


def pressed(unit, forces_over, way, t, known=True):
    """Return the samples of a press at parts of the travel and times [s]."""
    forces = forces_over(way, t)
    rows = (forces > unit.least_forces).all(axis=1)
    times = t[rows] if known else np.full(rows.sum(), np.nan)
    return PressSamples(channels=forces[rows], tips=4, t=times, touched_s=0.0)


@pytest.fixture(scope="module")
def reading(unit, forces_over):
    """Return a function that reads a press."""
    return lambda *press, **known: press_reading(unit, pressed(unit, forces_over, *press, **known))


@pytest.fixture(scope="module")
def even(reading):
    return reading(WAY, EVEN)


@pytest.mark.parametrize(("way", "t"), [PAUSED, (WAY, SLOWED)], ids=["pause", "slower"])
def test_an_uneven_pace_has_a_flag_and_its_size_in_the_bar(unit, forces_over, even, way, t):
    """The size is the change of the whole press, springs and contacts included: within 3 % by two laws of contact."""
    samples = pressed(unit, forces_over, way, t)
    found = press_reading(unit, samples)
    moved = even.E / found.E - 1.0
    assert found.E < even.E
    assert "uneven_pace" in found.flags
    assert "one_sample" not in found.flags
    assert pace_shift(unit, samples) == pytest.approx(moved, rel=0.03)
    assert moved < found.u


def test_a_pair_of_flat_tips_has_the_size_by_its_springs():
    """As deep in the flesh, both of its forces would fall alike; springs that bend less let one in farther."""
    pair = MeasuredDesign("paper", assessed=False)
    law = replace(pair.measuring().rise_law.contrast, gaps=(0.0, 0.0))
    even, paused = (np.insert(np.stack(each), 0, 0.0, axis=1)[:, None] for each in ((WAY, EVEN), PAUSED))
    found = []
    for way, t in (even, paused):
        forces = timed_forces(law, ASSUMED_RELAXATION, np.array([1.0]), t, pair.design.press.travel_mm * way).F[0, 1:]
        samples = PressSamples(channels=forces, tips=2, t=t[0, 1:], touched_s=0.0)
        found.append((press_reading(pair.measuring(), samples), pace_shift(pair.measuring(), samples)))
    (evenly, none), (late, size) = found
    assert none < 0.01
    assert size == pytest.approx(evenly.E / late.E - 1.0, rel=0.03)
    assert size > LARGEST_BY_PACE


@pytest.mark.parametrize("t", [EVEN, pytest.param(3.0 * EVEN, marks=pytest.mark.slow)], ids=["3 s", "9 s"])
def test_an_even_pace_has_none_whatever_it_is(reading, t):
    assert "uneven_pace" not in reading(WAY, t).flags


def test_a_press_of_twice_the_time_falls_as_the_note_says(mango, reading, even):
    """The note is of level presses at the least and the largest modulus, on the fruit of the design: within 6 %."""
    fall = 1.0 - reading(WAY, 2.0 * EVEN).E / even.E
    assert decrease_at_twice_the_time(mango.sensor) == pytest.approx(fall, rel=0.06)
    press = replace(mango.design.press, speed_mm_per_s=mango.design.press.travel_mm / PRESS_S, hold_s=3.0)
    stated = replace(mango.design, press=press, fruit=replace(mango.design.fruit, relaxation=ASSUMED_RELAXATION.arms))
    left = decrease_at_twice_the_time(replace(mango.sensor, design=stated))
    assert left == pytest.approx(STATED_SPREAD * decrease_at_twice_the_time(mango.sensor))


def test_without_times_nothing_is_known_of_a_pace(reading):
    assert "uneven_pace" not in reading(*PAUSED, known=False).flags


def test_a_stated_relaxation_leaves_what_fruit_differs_by(unit, forces_over):
    """A pace is undone for flesh that relaxes as stated; of its size 0.3 is left, which 2 % may exceed or not."""
    design = unit.report.design
    over_time = replace(design.press, speed_mm_per_s=0.4, hold_s=3.0)
    stated = replace(design, press=over_time, fruit=replace(design.fruit, relaxation=ASSUMED_RELAXATION.arms))
    sensor = replace(unit, report=replace(unit.report, design=stated))
    samples = pressed(unit, forces_over, *PAUSED)
    whole, left = (pace_shift(each, samples) for each in (unit, sensor))
    assert whole > LARGEST_BY_PACE
    assert left == pytest.approx(STATED_SPREAD * whole)
