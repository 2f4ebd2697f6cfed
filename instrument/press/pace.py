"""Presses whose pace is uneven: how far E moves on flesh that relaxes, against a press at an even pace.

A pause late in a press lowers its last forces, which looks like softer flesh. The forces of a log, its times and a
relaxation give the forces of elastic flesh. Those give the forces of the same way at an even pace. That is either of
two paces at which a quarter of the way was faster or slower, whichever moves E more: which one was meant is not known.

Springs are taken to have bent as they did at the uneven pace, and contacts too. So the size is two thirds to four
fifths of the change of presses by boundary elements (`tests/instrument/press/test_pace.py`).
"""

import numpy as np

from instrument.press.measuring import MeasuringUnit
from instrument.press.seating import Seated
from instrument.press.touches import PressSamples
from sensor.arrays import Floats
from sensor.theory.contrast_rise import RiseError, read_rise, rise_of
from sensor.theory.flesh_memory import Memory
from sensor.theory.relaxation import Relaxation

MAY_RELAX = Relaxation(((0.25, 5.0), (0.33, 120.0)))
"""Flesh of a design without `fruit.relaxation`. It keeps 42 %, as Tarocco oranges do: M. Moresi et al., Food Bioprocess
Technol. 5 (2012), doi:10.1007/s11947-011-0528-4. Both times and how the shares divide are a judgement."""
STATED_SPREAD = 0.3
"""Of a stated relaxation, how much of its size a fruit may differ by: a judgement."""
LARGEST_BY_PACE = 0.02  # of E: a standard uncertainty of 5 % becomes 5.4 % by it
MOST_SAMPLES = 64  # of a press, evenly chosen: a pause lasts several
PARTS = 8  # of the way, with a pace each; a pause lies in one or two of them


def pace_shift(sensor: MeasuringUnit, press: PressSamples, seated: Seated) -> float:
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
    before = max(t[0] - press.touched_s, 0.0)
    elastic = _elastic(flesh, forces, np.diff(t, prepend=t[0] - before))
    travel = _travel(sensor, seated, forces, forces if stated is None else elastic)
    if not travel[-1] > travel[0]:
        return 0.0
    way = (travel - travel[0]) / (travel[-1] - travel[0])
    until = np.interp(np.linspace(0.0, 1.0, PARTS + 1), way, t)
    durations = PARTS * np.sort(np.diff(until))
    try:
        found = _modulus(sensor, forces)
        shifts = []
        for duration in (durations[PARTS // 4], durations[-1 - PARTS // 4]):
            evenly = _felt(flesh, elastic, np.diff(duration * way, prepend=-before))
            shifts.append(abs(_modulus(sensor, evenly) / found - 1.0))
    except RiseError:
        return 0.0
    part = 1.0 if stated is None else STATED_SPREAD
    return part * sensor.steepness(sensor.corrected(found, press.duration_s)) * max(shifts)


def _modulus(sensor: MeasuringUnit, forces: Floats) -> float:
    """Return the modulus [MPa] that a press of forces reads as on elastic flesh; raises RiseError."""
    rise = rise_of(forces, forces.shape[1], sensor.least_forces)
    return read_rise(sensor.rise_law, rise, sensor.noises).E


def _elastic(flesh: Relaxation, forces: Floats, steps: Floats) -> Floats:
    """Return the forces of elastic flesh [N] that answers as far, of forces after steps of time [s]."""
    memory = Memory(flesh)
    found = np.empty_like(forces)
    for row, (felt, step) in enumerate(zip(forces, steps, strict=True)):
        fresh, lost = memory.step(np.array([step]))
        found[row] = (felt + lost) / fresh
        memory.keep(found[row])
    return found


def _felt(flesh: Relaxation, elastic: Floats, steps: Floats) -> Floats:
    """Return the forces [N] of flesh that relaxes, where elastic flesh would answer so after steps of time [s]."""
    memory = Memory(flesh)
    found = np.empty_like(elastic)
    for row, (force, step) in enumerate(zip(elastic, steps, strict=True)):
        fresh, lost = memory.step(np.array([step]))
        found[row] = fresh * force - lost
        memory.keep(force)
    return found


def _travel(sensor: MeasuringUnit, seated: Seated, forces: Floats, of_flesh: Floats) -> Floats:
    """Return how far all tips have moved on the average [mm], which never falls in a press."""
    law, E = sensor.rise_law.contrast, seated.found.E
    _, C, S = law.arrays
    lowered = forces @ C.T + of_flesh @ S.T / E + law.hertz * (of_flesh / E) ** (2.0 / 3.0)
    return np.maximum.accumulate(lowered.mean(axis=1))
