"""Readings over time on flesh that relaxes: forces, their ratio, and the apparent modulus.

The modulus of the fruit is its instantaneous modulus, before it relaxes. The apparent modulus at a given time is the
modulus that is read from the forces at this time as if the flesh were elastic.
"""

from dataclasses import dataclass

import numpy as np

from pipeline.reading.pressed_sensor import RISE_TRAVELS, PressedSensor
from pipeline.reading.reading_records import Moment
from pipeline.response.scene_press import scene_of
from sensor.arrays import Floats, rows_of
from sensor.design.parameters import Design
from sensor.quantity import Estimate, validation_error
from sensor.record import Record
from sensor.theory.contrast_law import ContrastLaw, ReadingError, read_modulus
from sensor.theory.contrast_rise import RiseLaw, read_rise, select_rise
from sensor.theory.relaxation import ASSUMED_RELAXATION, STATED_SPREAD, Relaxation
from solve.contact.linear_response import high_over_low
from solve.contact.pose_forces import Pose
from solve.contact.relaxing import elastic_forces, timed_forces

RAMP_STEPS = 12  # number of time steps from the first touch to the full travel
HOLD_STEPS = 12  # number of time steps of the hold, during which the travel is constant


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ReadingOverTime(Record):
    """A level press to full travel and its hold, on flesh with the instantaneous moduli E [MPa], at times t [s].

    The forces F [N] have the shape (moduli, times, tips). The force ratio P [1] and the `apparent` modulus [MPa] have
    the shape (moduli, times) and are nan if a tip is out of contact. `stop` is the index of the time at which the full
    travel is reached, and `at` the index of the time of the reading. `moves` [1] is the largest change of the apparent
    modulus during the hold, relative to the reading, over all moduli. `steadiest` is the moment at which this change is
    smallest.
    """

    E: Floats
    t: Floats
    F: Floats
    P: Floats
    apparent: Floats
    stop: int
    at: int
    moves: Estimate
    steadiest: Moment


def refuse_unsolvable_time(design: Design) -> None:
    """Raise InputError if a design has flesh that relaxes, in a scene that cannot be solved over time.

    A scene can be solved over time if the fruit has no skin, and if the press is level. The tips must be flat tips on a
    block, or a line or a square of domes.
    """
    if design.fruit.relaxation is None:
        return
    if design.fruit.skin_mm is not None:
        bound = "omitted if the fruit has a skin"
        hint = "omit one of them, because flesh that relaxes under a skin cannot be solved"
        raise validation_error("fruit.relaxation", design.fruit.relaxation, "", bound, hint)
    if not _is_solvable(design):
        bound = "omitted unless flat tips on a block, or a line or square of domes, press level"
        hint = "omit it, because presses of other tips and tilted presses cannot be solved over time"
        raise validation_error("fruit.relaxation", design.fruit.relaxation, "", bound, hint)


def _is_solvable(design: Design) -> bool:
    """Return whether presses of a design on fruit without a skin can be solved over time."""
    tips = design.tips
    is_level = design.press.tilt_deg == 0.0 and design.press.roll_deg == 0.0
    has_domes = tips.tip_shape.obeys_hertz and not tips.tip_layout.is_pair
    return scene_of(design).obeys_linear_law or (is_level and has_domes)


def reading_over_time(sensor: PressedSensor) -> ReadingOverTime | None:
    """Compute forces and apparent moduli during a level press and its hold; None if the flesh does not relax.

    The press is solved for each modulus of the design. The change of the apparent modulus during the hold shows how
    much the time of the reading matters. Raises SolveError if a solution is not exact.
    """
    design = sensor.design
    if design.fruit.relaxation is None:
        return None
    law = _contrast_law(sensor)
    first_touch = _first_touch_depth(sensor, law)
    t, travel, read_at = _press_and_hold(design)
    E = np.array(design.fruit.E_MPa)
    shape = (len(E), len(t))  # (moduli, times); all moduli have the same press
    times = np.broadcast_to(t, shape)
    depths = np.broadcast_to(first_touch + travel, shape)  # depths of the tips [mm]
    solution = timed_forces(law, Relaxation(design.fruit.relaxation), E, times, depths)
    F = solution.F
    apparent = _apparent_moduli(law, F)
    changes = _largest_changes(apparent[:, RAMP_STEPS:])  # the hold begins at index `RAMP_STEPS`
    change = float(changes[read_at])
    step_error = float((solution.error[:, RAMP_STEPS:] / F[:, RAMP_STEPS:]).max())  # relative error due to time steps
    return ReadingOverTime(
        E=E,
        t=t,
        F=F,
        P=high_over_low(F, F, design.tips.spring_groups),
        apparent=apparent,
        stop=RAMP_STEPS,
        at=RAMP_STEPS + read_at,
        # The change is a difference between two times, so the error of the time steps enters twice.
        moves=Estimate(change, 2.0 * step_error + change * _elastic_error(sensor, law, first_touch)),
        steadiest=_steadiest_moment(design, t[RAMP_STEPS:], changes),
    )


def _steadiest_moment(design: Design, hold_times: Floats, changes: Floats) -> Moment:
    """Return the moment of the hold at which the largest change of the apparent modulus is smallest.

    `hold_times` (moments,) [s] are counted from the first touch. `changes` (moments,) [1] are infinite if a tip is out
    of contact; the moment then has no percentage.
    """
    steadiest = int(changes.argmin())
    smallest_change = float(changes[steadiest])
    return Moment(
        speed_mm_per_s=design.press.speed_mm_per_s or 0.0,
        at_s=float(hold_times[steadiest]),
        moves_percent=100.0 * smallest_change if np.isfinite(smallest_change) else None,
    )


def decrease_at_twice_the_time(sensor: PressedSensor) -> float | None:
    """Return the largest relative decrease of the modulus read [1], over all moduli, if a press takes twice as long.

    Flesh that relaxes presses back with smaller forces in a slower press, so it is read softer. A reading is corrected
    for the relaxation that the design states, so only the spread between fruits remains. If the design states no
    relaxation, a typical one is assumed, and nothing is corrected. The result is None if the presses cannot be solved
    or read.
    """
    design = sensor.design
    if not _is_solvable(design):
        return None
    flesh, uncorrected = _flesh_and_uncorrected_fraction(design)
    law = _contrast_law(sensor)
    first_touch = _first_touch_depth(sensor, law)
    ramp = np.arange(1 + RISE_TRAVELS) / RISE_TRAVELS  # fractions of the travel and of the duration
    # one press of the usual duration, and one of twice this duration
    times = np.outer([1.0, 2.0], design.press_s * ramp)
    depths = np.stack([first_touch + design.press.travel_mm * ramp] * len(times))
    decreases = []
    for E in design.fruit.E_MPa:
        # the first sample is omitted, because it is the first touch without a force
        forces = timed_forces(law, flesh, np.full(len(times), E), times, depths).F[:, 1:]
        try:
            E_once, E_twice = (_read_by_rise(sensor.law, press) for press in forces)
        except ReadingError:
            continue
        decreases.append(uncorrected * (1.0 - E_twice / E_once))
    return max(decreases, default=None)


def _flesh_and_uncorrected_fraction(design: Design) -> tuple[Relaxation, float]:
    """Return the relaxation of the flesh, and the fraction [1] of its effect for which readings are not corrected.

    Readings are corrected for a relaxation that the design states, up to its spread between fruits. If the design
    states none, a typical relaxation is assumed, and nothing is corrected.
    """
    stated = design.fruit.relaxation
    if stated is None:
        return ASSUMED_RELAXATION, 1.0
    return Relaxation(stated), STATED_SPREAD


def _first_touch_depth(sensor: PressedSensor, law: ContrastLaw) -> float:
    """Return the depth of the tips [mm] at first touch, from which the travel is counted.

    The first tip touches at the smallest gap. The gaps of the law contain the displacement of the tips by their weight,
    which is removed here.
    """
    return float(np.min(np.add(law.gaps, sensor.height_offsets or 0.0)))


def _read_by_rise(law: RiseLaw, F: Floats) -> float:
    """Return the modulus [MPa] read from a whole press without noise, given F (samples, tips) [N]; raises RiseError."""
    no_noise = np.zeros(F.shape[1])
    return read_rise(law, select_rise(F, F.shape[1], no_noise), no_noise).E


def _contrast_law(sensor: PressedSensor) -> ContrastLaw:
    """Return the contrast law of the tips in a level press.

    The contrast is a weighted sum over the tips in which the travel cancels. For a pair, it is the value at the high
    tip minus the value at the low tip.
    """
    if not sensor.design.tips.tip_layout.is_pair:
        return sensor.contrast
    gaps = tuple(-offset for offset in sensor.height_offsets) if sensor.height_offsets else (0.0, 0.0)
    return ContrastLaw(weights=(-1.0, 1.0), gaps=gaps, C=rows_of(sensor.C), S=rows_of(sensor.contact.S))


def _press_and_hold(design: Design) -> tuple[Floats, Floats, int]:
    """Return times since first touch [s], the travels at these times [mm], and the index of the reading in the hold.

    The travel increases linearly with time until the hold. The forces change fastest at first touch and at the
    beginning of the hold, so the time steps are shortest there. The index of the reading counts the time steps of the
    hold, from 0 at its beginning.
    """
    ramp = (np.arange(1 + RAMP_STEPS) / RAMP_STEPS) ** 2  # fractions of the time until the stop, and of the travel
    hold_s = design.press.hold_s or 0.0
    # times [s] in the hold, counted from its beginning: the time of the reading, and the time steps
    reading_time = design.read_s - design.stop_s
    hold_times = hold_s * (np.arange(1 + HOLD_STEPS) / HOLD_STEPS) ** 3
    # The nearest time step is moved to the time of the reading. The two ends of the hold keep their times, so an inner
    # step is moved unless the reading is at an end.
    read_at = int(np.abs(hold_times - reading_time).argmin())
    if reading_time not in (0.0, hold_s):
        read_at = min(max(read_at, 1), HOLD_STEPS - 1)
        hold_times[read_at] = reading_time
    times = np.concatenate([design.stop_s * ramp, design.stop_s + hold_times[1:]])  # the stop occurs only once
    return times, design.press.travel_mm * np.concatenate([ramp, np.ones(HOLD_STEPS)]), read_at


def _apparent_moduli(law: ContrastLaw, F: Floats) -> Floats:
    """Return the moduli [MPa], shape (...), read from forces F (..., tips) [N] as if the flesh were elastic.

    A modulus is nan if no modulus fits the forces, for example because a tip is out of contact.
    """
    moduli = np.full(F.shape[:-1], np.nan)
    for index in np.ndindex(moduli.shape):
        try:
            moduli[index] = read_modulus(law, F[index].tolist())
        except ReadingError:
            continue
    return moduli


def _largest_changes(held: Floats) -> Floats:
    """Return the largest relative change [1] of the apparent modulus from each moment to any other, shape (moments,).

    `held` (moduli, moments) [MPa] holds the apparent moduli during the hold. The change is the largest one over all
    moduli. If a tip is out of contact, the change is infinite.
    """
    # the axes of the ratio are the modulus, the moment of the reading, and the other moment
    change = np.abs(held[:, None, :] / held[:, :, None] - 1.0).max(axis=(0, 2))
    return np.where(np.isfinite(change), change, np.inf)


def _elastic_error(sensor: PressedSensor, law: ContrastLaw, first_touch: float) -> float:
    """Return the relative error [1] of elastic forces by the contrast law at full travel, compared with solved forces.

    The result is the largest error over all moduli of the design and all tips. The error is 0 for flat tips, for which
    the law is exact. `first_touch` [mm] is the depth at which the first tip touches.
    """
    design = sensor.design
    if law.hertz == 0.0:
        return 0.0
    travel = design.press.travel_mm
    solved_forces = sensor.forces_in_poses([Pose(E=modulus, travel=travel) for modulus in design.fruit.E_MPa]).F
    law_forces = elastic_forces(law, np.array(design.fruit.E_MPa), np.full(len(solved_forces), first_touch + travel))
    return float(np.abs(law_forces / solved_forces - 1.0).max())
