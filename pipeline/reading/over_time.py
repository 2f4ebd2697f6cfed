"""Readings over time on flesh that relaxes: forces, their ratio, the modulus they give, and its steadiest moment.

The modulus of the fruit is its modulus at the first instant. The apparent modulus is read from forces at a time as if
the flesh were elastic.
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
from sensor.theory.contrast_rise import RiseLaw, read_rise, rise_of
from sensor.theory.relaxation import MAY_RELAX, STATED_SPREAD, Relaxation
from solve.contact.linear_response import high_over_low
from solve.contact.pose_forces import Pose
from solve.contact.relaxing import elastic_forces, timed_forces

RAMP_STEPS = 12
HOLD_STEPS = 12


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ReadingOverTime(Record):
    """A level press to full travel and its hold on flesh of moduli E [MPa] at the first instant, at times t [s].

    Forces F [N] have the shape (moduli, times, tips). The force ratio P [1] and the `apparent` modulus [MPa], (moduli,
    times), are nan if a tip is out of contact. `stop` is the index of the end of the press, and `at` the index of the
    reading in the hold. `moves` [1] is the largest change of the apparent modulus over the hold, relative to the
    reading, over all moduli. `steadiest` is the moment with the least change.
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
    """Raise InputError for flesh that relaxes in a scene that is not solved over time, before anything is solved."""
    if design.fruit.relaxation is None:
        return
    if design.fruit.skin_mm is not None:
        bound = "left out under a skin"
        hint = "drop one of them: skin on flesh that relaxes is not solved"
        raise validation_error("fruit.relaxation", design.fruit.relaxation, "", bound, hint)
    if not _is_solvable(design):
        bound = "left out except for a level press of flat tips on a block, or of a line or square of domes"
        hint = "drop it: other tips and tilt are not solved over time"
        raise validation_error("fruit.relaxation", design.fruit.relaxation, "", bound, hint)


def _is_solvable(design: Design) -> bool:
    """Return whether presses of a design can be solved over time, on flesh without a skin."""
    tips = design.tips
    level = design.press.tilt_deg == 0.0 and design.press.roll_deg == 0.0
    domes = tips.tip_shape.obeys_hertz and not tips.tip_layout.is_pair
    return scene_of(design).linear or (level and domes)


def reading_over_time(sensor: PressedSensor) -> ReadingOverTime | None:
    """Return the readings of a sensor over time; None for flesh that does not relax. Raises SolveError."""
    design = sensor.design
    if design.fruit.relaxation is None:
        return None
    law = _contrast(sensor)
    first_touch = float(np.min(np.add(law.gaps, sensor.height_offsets or 0.0)))
    t, travel, at = _press_and_hold(design)
    E = np.array(design.fruit.E_MPa)
    times, depths = (np.broadcast_to(each, (len(E), len(t))) for each in (t, first_touch + travel))
    solved = timed_forces(law, Relaxation(design.fruit.relaxation), E, times, depths)
    F = solved.F
    apparent = _apparent(law, F)
    moves = _moves(apparent[:, RAMP_STEPS:])
    best = int(moves.argmin())
    value = float(moves[at])
    by_steps = float((solved.error[:, RAMP_STEPS:] / F[:, RAMP_STEPS:]).max())
    return ReadingOverTime(
        E=E,
        t=t,
        F=F,
        P=high_over_low(F, F, design.tips.spring_groups),
        apparent=apparent,
        stop=RAMP_STEPS,
        at=RAMP_STEPS + at,
        moves=Estimate(value, 2.0 * by_steps + value * _off_elastic(sensor, law, first_touch)),
        steadiest=Moment(
            speed_mm_per_s=design.press.speed_mm_per_s or 0.0,
            at_s=float(t[RAMP_STEPS + best]),
            moves_percent=100.0 * float(moves[best]) if np.isfinite(moves[best]) else None,
        ),
    )


def fall_by_twice_the_time(sensor: PressedSensor) -> float | None:
    """Return the largest fall of E [1] over all moduli if a press takes twice the time; None if it cannot be solved.

    The reading of a log corrects the relaxation that the design states. Only the spread between fruits remains.
    """
    design = sensor.design
    if not _is_solvable(design):
        return None
    stated = design.fruit.relaxation
    # Of a stated relaxation only the part counts by which fruits differ from it.
    flesh, part = (MAY_RELAX, 1.0) if stated is None else (Relaxation(stated), STATED_SPREAD)
    law = _contrast(sensor)
    first_touch = float(np.min(np.add(law.gaps, sensor.height_offsets or 0.0)))
    ramp = np.arange(1 + RISE_TRAVELS) / RISE_TRAVELS
    falls = []
    for E in design.fruit.E_MPa:
        times = np.outer([1.0, 2.0], design.press_s * ramp)
        travel = np.stack([first_touch + design.press.travel_mm * ramp] * len(times))
        forces = timed_forces(law, flesh, np.full(len(times), E), times, travel).F[:, 1:]
        try:
            once, twice = (_risen(sensor.law, each) for each in forces)
        except ReadingError:
            continue
        falls.append(part * (1.0 - twice / once))
    return max(falls, default=None)


def _risen(law: RiseLaw, F: Floats) -> float:
    """Return the modulus [MPa] of forces (samples, tips) [N] by their rise; raises RiseError."""
    none = np.zeros(F.shape[1])
    return read_rise(law, rise_of(F, F.shape[1], none), none).E


def _contrast(sensor: PressedSensor) -> ContrastLaw:
    """Return the contrast of the tips; for a pair it holds for a level press."""
    if not sensor.design.tips.tip_layout.is_pair:
        return sensor.contrast
    gaps = tuple(-offset for offset in sensor.height_offsets) or (0.0, 0.0)
    return ContrastLaw(weights=(-1.0, 1.0), gaps=gaps, C=rows_of(sensor.C), S=rows_of(sensor.contact.S))


def _press_and_hold(design: Design) -> tuple[Floats, Floats, int]:
    """Return times from the first touch [s] and travels [mm], (times,), and the index of the reading in the hold.

    The travel is linear in time. Steps are dense at the first touch and at the begin of the hold. One moment of the
    hold is the time of the reading.
    """
    ramp = (np.arange(1 + RAMP_STEPS) / RAMP_STEPS) ** 2
    hold = design.press.hold_s or 0.0
    wait = design.read_s - design.stop_s
    waits = hold * (np.arange(1 + HOLD_STEPS) / HOLD_STEPS) ** 3
    at = int(np.abs(waits - wait).argmin())
    if wait not in (0.0, hold):
        at = min(max(at, 1), HOLD_STEPS - 1)
        waits[at] = wait
    times = np.concatenate([design.stop_s * ramp, design.stop_s + waits[1:]])
    return times, design.press.travel_mm * np.concatenate([ramp, np.ones(HOLD_STEPS)]), at


def _apparent(law: ContrastLaw, F: Floats) -> Floats:
    """Return the moduli [MPa] of forces (..., tips) [N], shape (...), nan for forces without a modulus."""
    moduli = np.full(F.shape[:-1], np.nan)
    for index in np.ndindex(moduli.shape):
        try:
            moduli[index] = read_modulus(law, F[index].tolist())
        except ReadingError:
            continue
    return moduli


def _moves(held: Floats) -> Floats:
    """Return the largest relative change of apparent moduli from each moment of a hold [1], (moments,).

    `held` has the shape (moduli, moments). The change is infinite if a tip is out of contact.
    """
    change = np.abs(held[:, None, :] / held[:, :, None] - 1.0).max(axis=(0, 2))
    return np.where(np.isfinite(change), change, np.inf)


def _off_elastic(sensor: PressedSensor, law: ContrastLaw, first_touch: float) -> float:
    """Return the relative error of the contrast's law against the forces solved at full travel [1]."""
    design = sensor.design
    if law.hertz == 0.0:
        return 0.0
    travel = design.press.travel_mm
    solved = sensor.in_poses([Pose(E=modulus, travel=travel) for modulus in design.fruit.E_MPa]).F
    by_law = elastic_forces(law, np.array(design.fruit.E_MPa), np.full(len(solved), first_touch + travel))
    return float(np.abs(by_law / solved - 1.0).max())
