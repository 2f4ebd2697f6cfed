"""Presses whose pace is uneven: how far E moves on flesh that relaxes, against a press at an even pace.

A pause late in a press lowers its last forces, which looks like softer flesh. The forces of a log, its times and a
relaxation give the forces of elastic flesh, and both give the way of each tip. The same way at an even pace has other
forces. That is either of two paces at which a quarter of the way was faster or slower, whichever moves E more: which
one was meant is not known.
"""

import numpy as np

from instrument.press.measuring import MeasuringUnit
from instrument.press.touches import PressSamples
from sensor.arrays import Floats
from sensor.theory.contrast_rise import RiseError, RiseLaw, read_rise, rise_of
from sensor.theory.flesh_memory import Memory
from sensor.theory.relaxation import MAY_RELAX, STATED_SPREAD, Relaxation
from solve.contact.relaxing import forces_on_way
from solve.solve_error import SolveError

LARGEST_BY_PACE = 0.02  # of E: a standard uncertainty of 5 % becomes 5.4 % by it
MOST_SAMPLES = 64  # of a press, evenly chosen: a pause lasts several
PARTS = 8  # of the way, with a pace each; a pause lies in one or two of them


def pace_shift(sensor: MeasuringUnit, press: PressSamples) -> float:
    """Return the size of the change of E by the pace of a press [1]; 0 if times do not show it.

    A stated relaxation is undone by the reading itself, so only what fruit may differ by is left.
    """
    last = press.deepest + 1
    chosen = np.unique(np.linspace(0, last - 1, min(last, MOST_SAMPLES)).round().astype(int))
    t, forces = press.t[chosen], press.forces[chosen]
    if not np.isfinite(t).all() or not (np.diff(t) > 0.0).all() or not t[-1] > t[0] or press.duration_s is None:
        return 0.0
    stated = sensor.report.design.fruit.relaxation
    flesh = MAY_RELAX if stated is None else Relaxation(stated)
    try:
        shift = _largest_shift(sensor, flesh, max(t[0] - press.touched_s, 0.0), t, forces)
        steepness = sensor.steepness(sensor.corrected(_modulus(sensor, sensor.rise_law, forces), press.duration_s))
    except (RiseError, SolveError):
        return 0.0
    return (1.0 if stated is None else STATED_SPREAD) * steepness * shift


def _largest_shift(sensor: MeasuringUnit, flesh: Relaxation, before: float, t: Floats, forces: Floats) -> float:
    """Return the larger change of E [1] from forces (samples, tips) [N] at times [s] to those of two even paces.

    The first sample is `before` [s] after the touch.
    """
    law = sensor.rise_law
    elastic = _elastic(flesh, forces, np.diff(t, prepend=t[0] - before))
    E = _modulus(sensor, law.over_time, np.concatenate([forces, elastic], axis=1))  # at the first instant
    lowered = _lowered(law, E, forces, elastic)
    travel = np.maximum.accumulate(lowered.mean(axis=1))
    if not travel[-1] > travel[0]:
        return 0.0
    way = (travel - travel[0]) / (travel[-1] - travel[0])
    until = np.interp(np.linspace(0.0, 1.0, PARTS + 1), way, t)
    durations = PARTS * np.sort(np.diff(until))[[PARTS // 4, -1 - PARTS // 4]]
    times = np.insert(durations[:, None] * way, 0, -before, axis=1)
    ways = np.stack([np.insert(lowered, 0, 0.0, axis=0)] * len(times))
    evenly, _ = forces_on_way(law.contrast, flesh, np.full(len(times), E), times, ways)
    found = _modulus(sensor, law, forces)
    return max(abs(_modulus(sensor, law, each[1:]) / found - 1.0) for each in evenly)


def _modulus(sensor: MeasuringUnit, law: RiseLaw, channels: Floats) -> float:
    """Return the modulus [MPa] that the channels of a law show, (samples, channels) [N]; raises RiseError."""
    tips = len(sensor.least_forces)
    least = np.concatenate([sensor.least_forces, np.zeros(channels.shape[1] - tips)])
    return read_rise(law, rise_of(channels, tips, least), sensor.noises).E


def _lowered(law: RiseLaw, E: float, forces: Floats, elastic: Floats) -> Floats:
    """Return how far each tip has moved since it touched [mm], by its forces and those of elastic flesh [N]."""
    _, C, S = law.contrast.arrays
    return np.asarray(forces @ C.T + elastic @ S.T / E + law.contrast.hertz * np.cbrt(elastic / E) ** 2)


def _elastic(flesh: Relaxation, forces: Floats, steps: Floats) -> Floats:
    """Return the forces of elastic flesh [N] that answers as far, of forces after steps of time [s]."""
    memory = Memory(flesh)
    found = np.empty_like(forces)
    for row, (felt, step) in enumerate(zip(forces, steps, strict=True)):
        fresh, lost = memory.step(np.array([step]))
        found[row] = (felt + lost) / fresh
        memory.keep(found[row])
    return found
