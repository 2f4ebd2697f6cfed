"""A fruit of several presses: its middle, its bar, when its presses disagree, and which presses are one fruit."""

import math
from copy import copy
from dataclasses import replace
from itertools import combinations_with_replacement
from statistics import median, stdev

import numpy as np
import pytest
from measured_units import read_press
from scipy import stats

from instrument.press.fruit_of_presses import FALSE_ALARMS, fruit_answer, fruit_answers, press_deviation_constants
from instrument.press.fruit_reading import FruitReading
from instrument.press.half_width import HalfWidth
from instrument.press.measuring import MeasuringUnit
from instrument.simulate.drawn_fruit import add_bruise, usual_fruit
from instrument.simulate.simulated_press import HandPress, press_curve
from instrument.simulate.unit import designed_unit

OWN, ALIKE = 0.12, 0.05  # half widths; by its design a press of `ball` may differ by less


@pytest.fixture
def ball(ball):
    """Return a sensor whose report knows of no uneven fruit, by which presses would differ more."""
    even = copy(ball)
    even.report = replace(ball.report, moduli=tuple(replace(row, fruit=None) for row in ball.report.moduli))
    return even


def press(E, own=OWN, alike=ALIKE, **more):
    parts = HalfWidth(independent=own, undetermined=0.0, shared=alike)
    return FruitReading(**{"E": E, "u": parts.total, "parts": parts, **more})


def answer(sensor, moduli, **more):
    return fruit_answer(sensor, [press(E, **more) for E in moduli], "1")


def by_definition(moduli):
    """Return the middle of moduli by its definition in logarithms."""
    pairs = combinations_with_replacement(map(math.log, moduli), 2)
    return math.exp(median(0.5 * (one + other) for one, other in pairs))


@pytest.mark.parametrize(
    "moduli", [(1.3,), (1.0, 1.2), (1.0, 1.1, 1.2), (1.0, 0.97, 1.1, 1.01), (1.0, 1.05, 1.02, 0.7, 1.01, 1.03)]
)
def test_modulus_is_the_middle_of_hodges_and_lehmann(moduli, ball):
    found = answer(ball.measuring(), moduli)
    assert pytest.approx(by_definition(moduli), rel=1e-12) == found.E
    assert found.reduced == pytest.approx(ball.measuring().reduced(found.E))


@pytest.mark.parametrize("presses", range(2, 9))
@pytest.mark.parametrize(("step", "disagree"), [(0.01, False), (0.3, True)])
def test_bar_is_that_of_scatter_and_of_what_presses_say(step, disagree, presses, ball):
    """Of the two deviations together with Student's factor, or of the scatter alone; what is alike stays."""
    logs = [step * (index % 3) for index in range(presses)]
    found = answer(ball.measuring(), np.exp(logs))
    scatter, free = stdev(logs), presses - 1
    both = math.sqrt((2.0 * (0.5 * OWN) ** 2 + free * scatter**2) / (free + 2))
    factor, deviation = (stats.t.ppf(0.975, free), scatter) if disagree else (stats.t.ppf(0.975, free + 2), both)
    assert found.u == pytest.approx(math.hypot(factor * deviation / math.sqrt(presses), ALIKE))
    assert (found.scatter, found.shared) == (pytest.approx(scatter), pytest.approx(ALIKE))
    assert ("presses_disagree" in found.flags, found.hint is not None) == (disagree, disagree)
    assert [each.E for each in found.presses] == np.exp(logs).tolist()


@pytest.mark.parametrize("part", ["shared", "undetermined"])
def test_no_number_of_presses_lowers_what_may_be_the_same_in_all(part, ball):
    parts = replace(HalfWidth(independent=0.001, undetermined=0.0, shared=0.0, bend=0.01), **{part: 0.1})
    presses = [press(1.0, u=parts.total, parts=parts)] * 8
    found = fruit_answer(ball.measuring(), presses, "1")
    assert 0.11 < found.u == pytest.approx(0.11, rel=1e-3)


@pytest.mark.parametrize("wider", [0.0, 0.3])
def test_one_press_has_its_own_bar(wider, ball):
    alone = press(1.0, flags=("one_sample",) if wider else ())
    alone = replace(alone, u=alone.u + wider)
    found = fruit_answer(ball.measuring(), [alone], "1")
    assert (found.E, found.u) == (pytest.approx(1.0), pytest.approx(alone.u))
    assert (found.scatter, found.flags) == (None, ("few_presses", *alone.flags))


@pytest.mark.parametrize("presses", [2, 3, 4, 8])
@pytest.mark.parametrize("over", [0.5, 1.0, 1.5])
def test_bars_hold_the_modulus_and_false_alarms_are_as_many_as_told(over, presses, ball, rng):
    """Presses with normal errors, `over` times as large as they say; only as large are alarms counted."""
    sensor, fruits = ball.measuring(), 800
    found = [answer(sensor, np.exp(0.5 * over * OWN * rng.normal(size=presses)), alike=1e-9) for _ in range(fruits)]
    inside = sum(abs(math.log(each.E)) <= each.u for each in found)
    alarms = sum("presses_disagree" in each.flags for each in found)
    least = 0.95 if over <= 1.0 else 0.93
    assert inside >= stats.binom.ppf(0.001, fruits, least)
    if over == 1.0:
        assert stats.binom.ppf(0.001, fruits, FALSE_ALARMS) <= alarms <= stats.binom.ppf(0.999, fruits, FALSE_ALARMS)


@pytest.mark.parametrize(("noise", "counted"), [(0.02, 3), (0.5, 2)])
def test_a_press_that_is_much_less_certain_does_not_count(noise, counted, ball):
    sensor = ball.measuring()
    own = max(press_deviation_constants(sensor)["own_deviations"])
    presses = [press(E, noise=2.0 * own) for E in (1.0, 1.01)]
    found = fruit_answer(sensor, [*presses, press(1.3, own=noise, noise=noise)], "1", 3)
    assert found.counted == counted
    assert ("few_presses" in found.flags) is (counted < 3)


def test_presses_without_a_modulus_are_told_and_do_not_count(ball):
    none = FruitReading(flags=("no_rise",))
    found = fruit_answer(ball.measuring(), [none, press(1.0), press(1.01)], "1", 3)
    assert (found.counted, set(found.flags)) == (2, {"few_presses", "no_rise"})
    nothing = fruit_answer(ball.measuring(), [none, none], "1")
    assert (nothing.E, nothing.u, set(nothing.flags)) == (None, None, {"few_presses", "no_rise"})


@pytest.mark.parametrize(
    ("names", "presses", "named", "fruits"),
    [
        ("-----", 2, False, [("1", 2), ("2", 2), ("3", 1)]),
        ("----", 2, False, [("1", 2), ("2", 2)]),
        ("---", 0, False, [("1", 3)]),
        ("--", 1, False, [("1", 1), ("2", 1)]),
        ("aabbb", 0, True, [("a", 2), ("b", 3)]),
        ("aba", 0, True, [("a", 1), ("b", 1), ("a", 1)]),
    ],
)
def test_presses_are_taken_as_those_of_one_fruit(names, presses, named, fruits, ball):
    answers = fruit_answers(ball.measuring(), [press(1.0, fruit=name) for name in names], presses, named=named)
    assert [(each.fruit, len(each.presses)) for each in answers] == fruits


def test_an_answer_waits_for_no_press_of_the_next_fruit(ball):
    """Of a stream: after as many presses as asked for."""

    def stream():
        yield press(1.0)
        yield press(1.0)
        raise AssertionError

    assert next(fruit_answers(ball.measuring(), stream(), 2)).counted == 2


@pytest.mark.parametrize("turns", [(0.0, 90.0), pytest.param((0.0, 90.0, 180.0), marks=pytest.mark.slow)])
def test_turned_presses_find_a_bruise(turns, mango, monkeypatch):
    """By boundary elements: its press and one turned by 90 degrees differ by more than an uneven skin of 8 % makes."""
    monkeypatch.setattr(MeasuringUnit, "unevenness_deviations", lambda *_: [0.08])
    sensor, fruit, unit = mango.measuring(), usual_fruit(mango.report), designed_unit(mango.report)
    hand = HandPress(travel=mango.design.press.travel_mm, press_s=3.0)
    times = np.repeat(np.linspace(0.1, 3.0, 40)[:, None], 4, axis=1)

    def pressed(fruit):
        return read_press(sensor, press_curve(unit, fruit, hand).at(times) * unit.domes.K)

    sound = pressed(fruit)
    found = fruit_answer(sensor, [pressed(add_bruise(fruit, mango.report, 6.0, turn)) for turn in turns], "1")
    assert "presses_disagree" in found.flags
    assert abs(sound.E / found.E - 1.0) < found.u
    assert "presses_disagree" not in fruit_answer(sensor, [sound] * len(turns), "1").flags
