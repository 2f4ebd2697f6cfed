"""Estimate the change of the modulus that an uneven pace causes in a press on flesh that relaxes.

The pace is uneven if the speed of a press is not constant. A pause late in a press lowers its last forces, as if the
flesh were softer. If the law of relaxation is known, the forces and times of a log determine the forces of elastic
flesh, and so the displacement of each tip. The forces are then computed for the same displacement at a constant speed.
The intended speed is unknown. So two speeds are tried: the upper and the lower quartile of the speeds in equal parts of
the travel. The larger change of E is returned.
"""

import numpy as np

from instrument.press.measuring import MeasuringUnit
from instrument.press.touches import PressSamples
from sensor.arrays import Floats
from sensor.theory.contrast_rise import RiseError, RiseLaw, read_rise, select_rise
from sensor.theory.flesh_memory import Memory
from sensor.theory.relaxation import ASSUMED_RELAXATION, STATED_SPREAD, Relaxation
from solve.contact.relaxing import forces_over_time
from solve.solve_error import SolveError

LARGEST_BY_PACE = 0.02  # largest relative change of E that is ignored; it raises an uncertainty of 5 % to 5.4 %
MAX_SAMPLES = 64  # maximum number of samples that are used, spread evenly over a press; several lie in a pause
PARTS = 8  # number of equal parts of the travel, each with its mean speed; a pause lies in one or two of them


def pace_shift(sensor: MeasuringUnit, press: PressSamples) -> float:
    """Return the absolute relative change of E due to the uneven pace of a press [1].

    If the design states a relaxation, the reading already corrects it. Only its spread between fruits remains, so the
    change is multiplied by `STATED_SPREAD`. Otherwise the flesh is assumed to relax like `ASSUMED_RELAXATION`, to 42 %
    of its force. The result is 0 if the log has no increasing times or the press cannot be solved.
    """
    count = press.deepest + 1  # samples after the deepest one are not used in the reading
    indices = np.unique(np.linspace(0, count - 1, min(count, MAX_SAMPLES)).round().astype(int))
    t, forces = press.t[indices], press.forces[indices]
    # The last condition excludes a single sample, which has no time differences.
    has_increasing_times = np.isfinite(t).all() and (np.diff(t) > 0.0).all() and t[-1] > t[0]
    if not has_increasing_times or press.duration_s is None:
        return 0.0
    stated_relaxation = sensor.report.design.fruit.relaxation  # None if the flesh is elastic
    flesh = ASSUMED_RELAXATION if stated_relaxation is None else Relaxation(stated_relaxation)
    try:
        uncorrected_shift = _largest_shift(sensor, flesh, t, forces, touch_interval=max(t[0] - press.touched_s, 0.0))
        uncorrected_modulus = _modulus(sensor, sensor.rise_law, forces)
        steepness = sensor.steepness(sensor.correct_modulus(uncorrected_modulus, press.duration_s))
    except (RiseError, SolveError):
        return 0.0
    spread = 1.0 if stated_relaxation is None else STATED_SPREAD
    return spread * steepness * uncorrected_shift


def _largest_shift(
    sensor: MeasuringUnit, flesh: Relaxation, t: Floats, forces: Floats, *, touch_interval: float
) -> float:
    """Return the larger relative change of uncorrected E [1] if a press is repeated at two constant speeds.

    In the repeated presses, each tip has the same displacement as in the real press. The intended speed is unknown, so
    the larger change is an estimate of the error due to the uneven pace. `forces` (samples, tips) [N] were measured at
    the times `t` (samples,) [s]. `touch_interval` [s] is the time from the touch to the first sample. The result is 0
    if the tips do not travel. Raises RiseError if a press does not determine a modulus, and SolveError if it has no
    solution.
    """
    law = sensor.rise_law
    elastic_forces = _elastic_forces(flesh, forces, np.diff(t, prepend=t[0] - touch_interval))
    channels = np.concatenate([forces, elastic_forces], axis=1)
    E = _modulus(sensor, law.relaxing_law, channels)  # instantaneous modulus
    displacements = _displacements(law, E, forces, elastic_forces)
    # The running maximum keeps noise from decreasing the travel, because `progress` must increase below.
    travel = np.maximum.accumulate(displacements.mean(axis=1))
    if not travel[-1] > travel[0]:
        return 0.0
    progress = (travel - travel[0]) / (travel[-1] - travel[0])  # fraction of the travel, from 0 to 1
    # times since the first sample at the two speeds (speeds, samples) [s]
    times = _durations_at_two_speeds(progress, t)[:, None] * progress
    forces_at_speeds = _forces_at_speeds(law, flesh, E, times, displacements, touch_interval)
    measured_modulus = _modulus(sensor, law, forces)
    return max(
        abs(_modulus(sensor, law, forces_at_speed) / measured_modulus - 1.0) for forces_at_speed in forces_at_speeds
    )


def _forces_at_speeds(
    law: RiseLaw, flesh: Relaxation, E: float, times: Floats, displacements: Floats, touch_interval: float
) -> Floats:
    """Return the forces (speeds, samples, tips) [N] of presses with the same `displacements` (samples, tips) [mm].

    `E` [MPa] is the instantaneous modulus of the flesh. `times` (speeds, samples) [s] are counted from the first
    sample, and `touch_interval` [s] is the time from the touch to this sample. Raises SolveError if a press has no
    solution.
    """
    # Each press begins at the touch, where all displacements are 0.
    times_from_touch = np.insert(times, 0, -touch_interval, axis=1)
    paths = np.stack([np.insert(displacements, 0, 0.0, axis=0)] * len(times))
    forces, _ = forces_over_time(law.contrast, flesh, np.full(len(times), E), times_from_touch, paths)
    return np.asarray(forces[:, 1:])  # without the touch, which is not a sample


def _durations_at_two_speeds(progress: Floats, t: Floats) -> Floats:
    """Return the durations [s] that a whole press has at a fast and at a slow speed, in this order, shape (2,).

    `progress` (samples,) is the fraction of the travel at the times `t` (samples,) [s]. The travel is divided into
    `PARTS` equal parts, each with its mean speed. The quartiles of these speeds are the fast and the slow speed. A
    press at one of these speeds lasts `PARTS` times as long as a part at this speed.
    """
    part_ends = np.interp(np.linspace(0.0, 1.0, PARTS + 1), progress, t)
    quartiles = [PARTS // 4, -1 - PARTS // 4]  # indices in the sorted durations: a short one and a long one
    return np.asarray(PARTS * np.sort(np.diff(part_ends))[quartiles])


def _modulus(sensor: MeasuringUnit, law: RiseLaw, channels: Floats) -> float:
    """Return the modulus [MPa] that `law` reads from `channels` (samples, channels) [N], before any correction.

    Raises RiseError if the channels do not determine a modulus.
    """
    tips = len(sensor.least_forces)
    # The channels after the tip forces are forces of elastic flesh, which only have to be positive.
    least_forces = np.concatenate([sensor.least_forces, np.zeros(channels.shape[1] - tips)])
    return read_rise(law, select_rise(channels, tips, least_forces), sensor.noises).E


def _displacements(law: RiseLaw, E: float, forces: Floats, elastic_forces: Floats) -> Floats:
    """Return the displacement of each tip since its touch [mm], shape (samples, tips).

    It is the deflection of the spring under the measured `forces` (samples, tips) [N], plus the indentation of elastic
    flesh of modulus E [MPa] under the `elastic_forces` (samples, tips) [N].
    """
    _, C, S = law.contrast.arrays  # compliance of the springs [mm/N], and of the flesh times E [1/mm]
    return np.asarray(forces @ C.T + elastic_forces @ S.T / E + law.contrast.hertz * np.cbrt(elastic_forces / E) ** 2)


def _elastic_forces(flesh: Relaxation, forces: Floats, steps: Floats) -> Floats:
    """Return the forces (samples, tips) [N] that elastic flesh would have at the same indentation.

    `forces` (samples, tips) [N] were measured on flesh that relaxes. `steps` (samples,) [s] are the times since the
    previous sample, or since the touch for the first sample.
    """
    memory = Memory(flesh)
    elastic_forces = np.empty_like(forces)
    for sample, (measured, step) in enumerate(zip(forces, steps, strict=True)):
        # The measured force is fresh * elastic - lost. Here `fresh` depends on the time step, and `lost` also on the
        # elastic forces of earlier samples.
        fresh, lost = memory.step(np.array([step]))
        elastic_forces[sample] = (measured + lost) / fresh
        memory.keep(elastic_forces[sample])
    return elastic_forces
