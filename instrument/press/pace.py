"""The change of E by an uneven pace of a press on flesh that relaxes, compared with an even pace.

A pause late in a press lowers its last forces, which looks like softer flesh. The forces and times of a log and a
relaxation give the forces of elastic flesh, and so the displacement of each tip. The same displacement at an even pace
gives other forces. Two even paces are tried, because the intended pace is unknown: a quarter of the travel was faster,
or a quarter was slower. The larger change of E counts.
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

LARGEST_BY_PACE = 0.02  # relative change of E: it raises a standard uncertainty of 5 % to 5.4 %
MOST_SAMPLES = 64  # evenly chosen samples of a press; a pause lasts several
PARTS = 8  # parts of the travel, each with its own pace; a pause falls into one or two


def pace_shift(sensor: MeasuringUnit, press: PressSamples) -> float:
    """Return the size of the relative change of E by the pace of a press [1]; 0 if the log has no times.

    The reading corrects a stated relaxation itself, so only the spread between fruits remains.
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
    """Return the larger relative change of E [1] between a press and the same displacement at two even paces.

    `forces` (samples, tips) [N] were measured at times [s]; the first sample is `before` [s] after the touch.
    """
    law = sensor.rise_law
    elastic = _elastic(flesh, forces, np.diff(t, prepend=t[0] - before))
    E = _modulus(sensor, law.over_time, np.concatenate([forces, elastic], axis=1))  # modulus at the first instant
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
    """Return the modulus [MPa] from channels (samples, channels) [N] by a law; raises RiseError."""
    tips = len(sensor.least_forces)
    least = np.concatenate([sensor.least_forces, np.zeros(channels.shape[1] - tips)])
    return read_rise(law, rise_of(channels, tips, least), sensor.noises).E


def _lowered(law: RiseLaw, E: float, forces: Floats, elastic: Floats) -> Floats:
    """Return the displacement of each tip since its touch [mm], from its forces and the forces of elastic flesh [N]."""
    _, C, S = law.contrast.arrays
    return np.asarray(forces @ C.T + elastic @ S.T / E + law.contrast.hertz * np.cbrt(elastic / E) ** 2)


def _elastic(flesh: Relaxation, forces: Floats, steps: Floats) -> Floats:
    """Return the forces [N] of elastic flesh at the same indentation, from measured forces after time steps [s]."""
    memory = Memory(flesh)
    found = np.empty_like(forces)
    for row, (felt, step) in enumerate(zip(forces, steps, strict=True)):
        fresh, lost = memory.step(np.array([step]))
        found[row] = (felt + lost) / fresh
        memory.keep(found[row])
    return found
