"""Samples are cut into presses as they come: a press is read when it ends, and one without an end is refused."""

import itertools

import numpy as np
import pytest
from refusal import refusal

from instrument.press import press_core, touches
from instrument.press.presses import readings_of
from instrument.press.signals import Signal
from instrument.press.spikes import spike_constants
from pipeline.tables.rows import Rows

HEAD = "t_s,F_l_N,F_h_N"


@pytest.fixture(scope="module")
def forces(paper):
    return paper.press(1.0, np.linspace(1.0 / 6.0, 1.0, 40))


def lines_of(rows):
    """Return the lines of a log as they come, for ever after the last row in the air."""
    rows = itertools.chain(rows.tolist(), itertools.repeat([0.0, 0.0]))
    return itertools.chain([HEAD], (f"{0.01 * k:.4g},{low!r},{high!r}" for k, (low, high) in enumerate(rows)))


def test_a_press_of_a_log_without_an_end_is_read_when_it_ends(paper, forces):
    """A lift is certain at its second sample, and at the beginning some lines show the rate of a log."""
    taken = []
    lines = (taken.append(line) or line for line in lines_of(forces))
    reading = next(readings_of(paper.measuring(), Signal(Rows(lines, "-"), 2)))
    assert pytest.approx(1.0, rel=1e-3) == reading.E
    assert len(taken) == 1 + len(forces) + 2


def test_a_press_without_an_end_is_refused_at_its_last_line(paper, forces, monkeypatch):
    monkeypatch.setattr(touches, "MAX_SAMPLES", 30)
    readings = readings_of(paper.measuring(), Signal(Rows(lines_of(forces), "-"), 2), every_sample=True)
    assert len(list(itertools.islice(readings, 30))) == 30
    told = refusal(next, readings)
    assert (told.field, told.value) == ("-, line 32: samples of one press", 31)


@pytest.mark.parametrize(("lost", "presses"), [(1, 1), (2, 2), (3, 2)])
@pytest.mark.parametrize("at", [20, 30])
def test_one_sample_with_a_tip_in_the_air_is_a_bad_conversion_and_two_are_a_lift(paper, forces, lost, presses, at):
    rows = np.insert(forces, [at] * lost, 0.0, axis=0)
    log = itertools.islice(lines_of(rows), 1 + len(rows) + 3)
    readings = list(readings_of(paper.measuring(), Signal(Rows(log, "-"), 2)))
    assert len(readings) == presses
    assert readings[0].lines_left_out == ((at + 2,) if lost == 1 else ())


def test_a_lost_sample_between_touches_that_are_not_firm_ends_the_press(paper, forces):
    """Below twice the least force of a touch, a tip may as well have been lifted."""
    sensor = paper.measuring()
    weak = np.tile(1.9 * sensor.least_forces, (8, 1))
    rows = np.vstack([weak[:4], 0.0 * weak[:1], weak[4:], forces[5:]])
    log = itertools.islice(lines_of(rows), 1 + len(rows) + 3)
    (reading,) = readings_of(sensor, Signal(Rows(log, "-"), 2))
    assert reading.lines_left_out == ()
    assert reading.samples == 4 + len(forces[5:]) - 1


@pytest.mark.parametrize(("firm", "presses"), [(1, 1), (2, 2)])
def test_a_touch_that_one_bad_sample_may_make_is_no_press(paper, forces, firm, presses):
    """A touch is a press if more samples in a row than one bad conversion is part of have twice the least force."""
    sensor = paper.measuring()
    touch = np.outer([1.9, 1.9, *[2.1] * firm, 1.9, 1.9, 0.0, 0.0], sensor.least_forces)
    rows = np.vstack([touch, forces])
    log = itertools.islice(lines_of(rows), 1 + len(rows) + 3)
    assert len(list(readings_of(sensor, Signal(Rows(log, "-"), 2)))) == presses


def test_noise_beyond_what_is_stated_is_no_bad_sample(paper, forces, rng):
    """The scatter of a touch raises the limit of its residuals; that of normal noise is one in 1.7 million samples.

    Before twenty rows have shown the scatter to about a fifth, the stated noise has its say.
    """
    sensor = paper.measuring()
    unit = press_core.Unit({**spike_constants(sensor), "gains": [1.0, 1.0], "spike_length": 1})
    rising = np.linspace(0.3, 1.0, 400)[:, None] * forces[-1]
    dropped = []
    touch = press_core.Touch(unit, lambda *_: None, dropped.append)
    for sample in (rising + 4.0 * np.array(unit.errors) * rng.normal(size=rising.shape)).tolist():
        touch.add(sample)
    assert all(number <= 20 for number in dropped)
