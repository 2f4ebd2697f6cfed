"""The change of E due to an uneven pace of a press on flesh that relaxes, compared with an even pace.

A pause late in a press lowers its last forces, which looks like softer flesh. The forces and times of a log and a
relaxation determine the forces of elastic flesh, and so the displacement of each tip. The same displacement at an even
pace causes other forces. Two even paces are tried, because the intended pace is unknown: the upper and the lower
quartile of the paces in the parts of the press. The larger change of E counts.
"""

import numpy as np

from instrument.press.measuring import MeasuringUnit
from instrument.press.touches import PressSamples
from sensor.arrays import Floats
from sensor.theory.contrast_rise import RiseError, RiseLaw, read_rise, rise_of
from sensor.theory.flesh_memory import Memory
from sensor.theory.relaxation import MAY_RELAX, STATED_SPREAD, Relaxation
from solve.contact.relaxing import forces_over_time
from solve.solve_error import SolveError

LARGEST_BY_PACE = 0.02  # relative change of E: it raises a standard uncertainty of 5 % to 5.4 %
MOST_SAMPLES = 64  # maximum number of samples, chosen evenly from a press; a pause lasts several of them
PARTS = 8  # equal parts of the travel, each with its own pace; a pause falls into one or two


def pace_shift(sensor: MeasuringUnit, press: PressSamples) -> float:
    """Return the size of the relative change of E due to the pace of a press [1].

    The reading corrects a relaxation that the design states, so only its spread between fruits remains. Without one,
    the relaxation is assumed. The result is 0 if the log has no rising times, or if the press cannot be solved.
    """
    count = press.deepest + 1
    indices = np.unique(np.linspace(0, count - 1, min(count, MOST_SAMPLES)).round().astype(int))
    t, forces = press.t[indices], press.forces[indices]
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

    `forces` (samples, tips) [N] were measured at times `t` [s]; the first sample is `before` [s] after the touch.
    Raises RiseError or SolveError if a press determines no modulus or has no solution.
    """
    law = sensor.rise_law
    elastic = _elastic_forces(flesh, forces, np.diff(t, prepend=t[0] - before))
    E = _modulus(sensor, law.over_time, np.concatenate([forces, elastic], axis=1))  # modulus at the first instant
    displacements = _displacements(law, E, forces, elastic)
    travel = np.maximum.accumulate(displacements.mean(axis=1))
    if not travel[-1] > travel[0]:
        return 0.0
    # Time is proportional to the travel at an even pace. Its duration follows from the quartiles of the parts.
    progress = (travel - travel[0]) / (travel[-1] - travel[0])  # from 0 to 1
    part_ends = np.interp(np.linspace(0.0, 1.0, PARTS + 1), progress, t)
    durations = PARTS * np.sort(np.diff(part_ends))[[PARTS // 4, -1 - PARTS // 4]]
    times = np.insert(durations[:, None] * progress, 0, -before, axis=1)
    ways = np.stack([np.insert(displacements, 0, 0.0, axis=0)] * len(times))
    even_forces, _ = forces_over_time(law.contrast, flesh, np.full(len(times), E), times, ways)
    measured = _modulus(sensor, law, forces)
    return max(abs(_modulus(sensor, law, each[1:]) / measured - 1.0) for each in even_forces)


def _modulus(sensor: MeasuringUnit, law: RiseLaw, channels: Floats) -> float:
    """Return the modulus [MPa] that `law` reads from channels (samples, channels) [N].

    Raises RiseError if they determine no modulus.
    """
    tips = len(sensor.least_forces)
    least = np.concatenate([sensor.least_forces, np.zeros(channels.shape[1] - tips)])
    return read_rise(law, rise_of(channels, tips, least), sensor.noises).E


def _displacements(law: RiseLaw, E: float, forces: Floats, elastic: Floats) -> Floats:
    """Return the displacement of each tip since its touch [mm], (samples, tips).

    The measured `forces` [N] bend the springs, and the forces of `elastic` flesh [N] indent flesh of E [MPa].
    """
    _, C, S = law.contrast.arrays
    return np.asarray(forces @ C.T + elastic @ S.T / E + law.contrast.hertz * np.cbrt(elastic / E) ** 2)


def _elastic_forces(flesh: Relaxation, forces: Floats, steps: Floats) -> Floats:
    """Return the forces (samples, tips) [N] that elastic flesh has at the same indentation.

    `forces` [N] are measured on flesh that relaxes, each after a time step in `steps` [s].
    """
    memory = Memory(flesh)
    elastic = np.empty_like(forces)
    for row, (measured, step) in enumerate(zip(forces, steps, strict=True)):
        fresh, lost = memory.step(np.array([step]))  # measured = fresh elastic - lost
        elastic[row] = (measured + lost) / fresh
        memory.keep(elastic[row])
    return elastic
