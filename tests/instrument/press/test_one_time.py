"""Channels that are converted one after the other: brought to one time, or told as a cause that may be too fast.

Forces are those of boundary elements over the travel; a hand presses x = X (1 - (1 - t / T)^2), slowing to a stop.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from measured_units import read_by_module, read_in_c, readings_at, text_of, with_path, with_read_out
from refusal import refusal
from scipy.interpolate import PchipInterpolator
from stored_presses import STORED

from instrument.press.one_time import simultaneous_samples
from instrument.press.presses import readings_of
from instrument.press.signals import Signal
from pipeline.options import load_design
from pipeline.tables.rows import Rows
from sensor.design.processes import PROCESSES
from sensor.design.readout import Readout
from sensor.design.signal_path import SpringToRead, balanced_order, signal_path

PRESSES = STORED["presses"]
HIGH_LATER = np.array([0.0, 1.0, 0.0, 1.0])
SKEWS_MS = (1.0, 5.0, 12.5)
LINE = 0.02
"""Time between two lines [s]."""
DURATIONS = (0.6, 3.0)
"""Of presses [s]."""
SPRINGS = [SpringToRead(name=name, K=K, deflection=0.5) for name, K in (("low", 0.9), ("high", 20.0))]
CASES = pytest.mark.parametrize("case", PRESSES, ids=lambda case: f"{case['E']}-{case['R1']}-{case['R2']}")
QUICKNESS = pytest.mark.parametrize("duration", DURATIONS)


def by_hand(case, duration, skew_ms, interval=LINE, order=HIGH_LATER):
    """Return times (lines, 4) [s] of the channels in a press by hand and their forces [N], some air before it."""
    travel = np.array([0.0, *case["travel"]])
    of_travel = PchipInterpolator(travel, np.array([[0.0] * 4, *case["forces"]]))
    first = np.arange(-0.1, duration + 0.2, interval)
    times = first[:, None] + 1e-3 * skew_ms * order
    x = travel[-1] * (1.0 - (1.0 - np.clip(times / duration, 0.0, 1.0)) ** 2)
    return times, np.column_stack([of_travel(x[:, tip])[:, tip] for tip in range(4)])


def lines_of(times, forces, *, timed):
    """Return a log, with the times of the channels or with that of the first one."""
    heads = [f"t_{tip}_s" for tip in range(1, 5)] if timed else ["t_s"]
    rows = np.column_stack([times[:, : len(heads)], forces])
    return text_of(",".join([*heads, "F_1_N,F_2_N,F_3_N,F_4_N"]), rows.round(12).tolist()).splitlines()


def read(sensor, lines):
    (reading,) = readings_of(sensor, Signal(Rows(lines, "press.csv"), 4))
    return reading


def with_signal(sensor, signal):
    """Return a sensor whose forces are read by another signal path."""
    other = replace(sensor)
    vars(other)["signal"] = signal
    return other


def told(sensor, skew_ms):
    """Return a unit whose read-out says that its high channels are later."""
    delays = tuple((skew_ms * HIGH_LATER).tolist())
    return with_path(sensor, delay_ms=delays, rate_Hz=1.0 / LINE, time_error_ms=0.0)


@pytest.fixture(scope="module")
def sensor(ball):
    return ball.measuring(percent=1.0, gain_percent=0.5)


@CASES
@QUICKNESS
def test_a_skew_is_taken_off_by_times_or_by_the_read_out(sensor, case, duration):
    """The straight line between two conversions leaves little of E: its error falls as the square of their distance.

    A tilted press of 0.6 s has twelve samples after its last touch, and two fewer move it by 1 %.
    """
    plain = read(told(sensor, 0.0), lines_of(*by_hand(case, duration, 0.0), timed=False))
    for skew in SKEWS_MS:
        times, forces = by_hand(case, duration, skew)
        by_times = read(sensor, lines_of(times, forces, timed=True))
        by_delays = read(told(sensor, skew), lines_of(times, forces, timed=False))
        assert pytest.approx(by_delays.E, rel=1e-6) == by_times.E
        assert pytest.approx(plain.E, rel=0.02) == by_times.E
        assert abs(by_times.E / case["E"] - 1.0) < min(0.06, by_times.u)
        assert "too_fast" not in by_times.flags


@CASES
@QUICKNESS
@pytest.mark.parametrize("skew", SKEWS_MS)
def test_a_skew_that_is_not_told_lies_in_the_bar_or_is_flagged(sensor, case, duration, skew):
    """The log of another read-out than the unit's, whose lines come every 24 ms; at worst E is half of the truth."""
    found = read(sensor, lines_of(*by_hand(case, duration, skew), timed=False))
    assert abs(found.E / case["E"] - 1.0) < found.u or "too_fast" in found.flags


@CASES
def test_times_widen_the_bar_by_what_they_move(sensor, case):
    """Slopes over the time of one channel, by moving it by 1 ms; F^(-1/3) is taken at its mean: within a quarter."""
    duration = 3.0
    plain = with_path(sensor, delay_ms=(), time_error_ms=0.0)
    loose = with_path(sensor, delay_ms=(), time_error_ms=math.sqrt(3.0))
    times, forces = by_hand(case, duration, 0.0)
    first = read(plain, lines_of(times, forces, timed=False))
    wider = read(loose, lines_of(times, forces, timed=False))
    _, later = by_hand(case, duration, 1.0, order=np.ones(4))
    moved = []
    for tip in range(4):
        shifted = np.where(np.arange(4) == tip, later, forces)
        moved.append(read(plain, lines_of(times, shifted, timed=False)).E / first.E - 1.0)
    assert math.sqrt(wider.u**2 - first.u**2) == pytest.approx(2.0 * math.hypot(*moved), rel=0.25)


@pytest.fixture
def at_once(paper):
    """Return the pair with a read-out that converts all channels at once, at times known to 50 ms."""
    readout = Readout(rate_Hz=10.0, delay_ms=(0.0, 0.0), time_error_ms=50.0)
    signal = signal_path(readout, SPRINGS, PROCESSES["fdm-petg"], ("low", "high"))
    signal = replace(signal, noise_N=(1e-5, 1e-4), zero_drift_N=(1e-5, 1e-4))
    return with_read_out(paper.measuring(), signal=signal)


def pair_by_hand(paper, duration, E=3.5):
    """Return the forces [N] of a pair each 0.1 s; flat tips rise evenly."""
    (full,) = paper.press(E, [1.0])
    times = np.arange(0.0, duration, 0.1)[:, None]
    return full * (1.0 - (1.0 - np.clip(times / duration, 0.0, 1.0)) ** 2)


def read_pair(sensor, forces):
    return readings_at(sensor, 0.1 * np.arange(len(forces)), forces)[-1]


def test_fastest_press_of_a_pair_is_the_one_that_is_flagged_also_by_firmware(paper, at_once, tmp_path):
    signal = at_once.report.read_out.signal
    assert (signal.delays, signal.time_error_ms) == ((), 50.0)
    slow = replace(signal, rate_Hz=5.0, time_error_ms=0.0)  # five samples and the first after half of the travel
    assert with_signal(paper.sensor, slow).fastest_press_s == pytest.approx(6.0 / 5.0 * math.sqrt(2.0))
    fastest = with_signal(paper.sensor, signal).fastest_press_s
    for duration, too_fast in ((0.9 * fastest, True), (1.1 * fastest, False)):
        forces = pair_by_hand(paper, duration).astype(np.float32)
        found = read_pair(at_once, forces)
        assert pytest.approx(3.5, rel=0.01) == found.E
        assert ("too_fast" in found.flags) == too_fast
        expected = [found.E, found.reduced, 128 * too_fast, 0]
        assert read_by_module(at_once, forces) == pytest.approx(expected, rel=1e-9)
        assert read_in_c(tmp_path, at_once, forces) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize(
    "draws", [pytest.param(50, marks=pytest.mark.slow), pytest.param(200, marks=pytest.mark.study)]
)
def test_noise_leaves_no_bias_where_neighbours_share_it(draws, sensor, rng):
    """Of draws with both signs what is odd in the noise drops out; by the sample before, E would be off by 1 %.

    The root of a force with noise leaves 0.2 % of E, whatever the number of samples.
    """
    case = PRESSES[2]
    unit = with_path(sensor, delay_ms=tuple((25.0 * HIGH_LATER).tolist()), rate_Hz=20.0, time_error_ms=0.0)
    times, forces = by_hand(case, 3.0, 25.0, interval=0.05)
    noise = 0.005 * forces.max(axis=0)
    unit = with_path(unit, noise_N=tuple(noise.tolist()), zero_drift_N=(0.0,) * 4)
    plain = read(unit, lines_of(times, forces, timed=False)).E
    noises = noise * rng.normal(size=(draws, *forces.shape)).clip(-3.0, 3.0)  # zeros within their noise
    found = [[read(unit, lines_of(times, forces + sign * one, timed=False)) for sign in (1, -1)] for one in noises]
    moduli = np.array([[reading.E for reading in both] for both in found]) / plain
    even = moduli.mean(axis=1)
    assert abs(even.mean() - 1.0) < 4.0 * even.std() / math.sqrt(draws) + moduli.std() ** 2
    told = [reading.noise for both in found for reading in both]
    # Of 2 draws values the deviation scatters by 1 / (2 sqrt(draws)), three of which are allowed.
    assert np.mean(told) == pytest.approx(2.0 * moduli.std(), rel=1.5 / math.sqrt(draws) + 0.1)


def test_channels_with_their_times_are_taken_on_straight_lines(sensor):
    """Forces that rise evenly in time are exact, whichever channel is first; ends without a neighbour are left out."""
    t = 0.1 * np.arange(12)
    times = t[:, None] + [0.03, 0.0, 0.09, 0.01]
    forces = 0.02 + times * [0.1, 0.5, 0.1, 0.5]
    log = Signal(Rows(lines_of(times, forces, timed=True), "press.csv"), 4)
    found = list(simultaneous_samples(sensor, log, "press.csv")[1])
    assert [sample.t for sample in found] == pytest.approx(t[1:].tolist())
    expected = 0.02 + t[1:, None] * [0.1, 0.5, 0.1, 0.5]
    assert np.array([sample.forces for sample in found]) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("lines", "place"),
    [
        (["0,0,0,0,0,0,0,0", "0.1,0.1,0,0.1,0,0,0,0"], "3, column 't_3_s'"),
        (["0,0,0,0,0,0,0,0", "0.1,0.1,-0.1,0.1,0,0,0,0"], "3, column 't_3_s'"),
        (
            [f"{k},{k},{k + 100},{k},0,0,0,0" for k in range(99)],
            "66: from the first time of a channel to the last",
        ),
    ],
)
def test_times_that_are_out_of_order_far_apart_or_of_some_channels_are_refused(sensor, lines, place):
    head = "t_1_s,t_2_s,t_3_s,t_4_s,F_1_N,F_2_N,F_3_N,F_4_N"
    assert refusal(list, readings_of(sensor, Signal(Rows([head, *lines], "log"), 4))).field == f"log, line {place}"
    assert refusal(Signal, Rows([head.replace("t_4_s,", "")], "log"), 4).field == "log, line 1"


SQUARE = ("low", "high", "low", "high")


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (  # four inputs, 42 rounds a second
            {},
            {
                "delay_ms": pytest.approx(np.array([0.0, 0.25, 0.75, 0.5]) * 1e3 / 42.0),
                "delays": pytest.approx((0.0, 0.25, 0.75, 0.5)),
                "conversion_order": (0, 1, 3, 2),
            },
        ),
        ({"rate_Hz": 50.0}, {"delay_ms": pytest.approx((0.0, 5.0, 15.0, 10.0))}),
        ({"rate_Hz": 80.0, "delay_ms": (0.0,) * 4}, {"delays": (), "time_error_ms": pytest.approx(0.0125 * 12.5)}),
        ({"delay_ms": (0.0, 3.0, 0.0, 3.0), "time_error_ms": 0.1},) * 2,
    ],
)
def test_delays_follow_from_the_circuit(given, told):
    path = signal_path(Readout(**given), SPRINGS, PROCESSES["fdm-petg"], SQUARE)
    assert {key: getattr(path, key) for key in told} == told


@pytest.mark.parametrize(
    "kinds", [SQUARE, ("low", "low", "high", "high"), ("high", "low", "high"), ("low", "high", "low")]
)
def test_both_kinds_of_tips_are_converted_at_the_same_mean_time(kinds):
    place = {tip: number for number, tip in enumerate(balanced_order(kinds))}
    means = [np.mean([place[tip] for tip, kind in enumerate(kinds) if kind == name]) for name in ("low", "high")]
    assert means[0] == means[1]


@pytest.mark.parametrize("delay", [[0.0, 1.0], [0.0, 300.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0], []])
def test_delays_of_other_tips_and_longer_than_a_sample_are_refused(delay):
    assert refusal(load_design, "mango", {"readout.delay_ms": str(delay)}).field == "readout.delay_ms"
