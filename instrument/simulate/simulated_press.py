"""One press of a simulated unit: the deflections of its springs over time, solved at a few samples."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from instrument.simulate.drawn_fruit import PressedFruit
from instrument.simulate.unit import SimulatedUnit
from sensor.arrays import Floats
from sensor.quantity import InputError
from solve.presses.over_time import Way, creep_of, pressed_over_time
from solve.presses.pressing import Pressing

CELLS = 20  # grid cells per direction; 32 change the forces by less than a thousandth
SOLVED = 18  # samples of the press; twice as many change E by less than 0.7 %
HELD = 8  # samples of a hold


@dataclass(frozen=True, kw_only=True)
class Hand:
    """A press by hand: a travel [mm] from the first touch in `press_s` [s], then a hold [s], then the return.

    `relaxation` are shares and times [s] of flesh that relaxes.
    """

    travel: float
    press_s: float
    hold_s: float = 0.0
    relaxation: Sequence[tuple[float, float]] = ()

    @property
    def back_s(self) -> float:
        """Return the duration of the return [s]."""
        return 0.5 * self.press_s


@dataclass(frozen=True, kw_only=True, eq=False)
class PressCurve:
    """Deflections of springs [mm] at the samples of a press, (samples, tips), at times from the first touch [s]."""

    hand: Hand
    times: Floats
    deflections: Floats

    @property
    def lasts_s(self) -> float:
        """Return the time from the first touch to the lift [s]."""
        return self.hand.press_s + self.hand.hold_s + self.hand.back_s

    def at(self, t: Floats) -> Floats:
        """Return the deflections at times from the first touch [s], one for each tip, (samples, tips).

        The samples end with the hold, so the last one is the begin of the return. The return is the reversed press,
        scaled from its deepest sample, SOLVED - 1, to the deflection after the hold.
        """
        hand = self.hand
        down = np.clip(t, 0.0, hand.press_s + hand.hold_s)
        back = np.clip((t - hand.press_s - hand.hold_s) / hand.back_s, 0.0, 1.0)
        found = np.zeros(t.shape)
        for tip, deflections in enumerate(self.deflections.T):
            shown = self._of_tip(
                deflections, np.where(back[:, tip] > 0.0, hand.press_s * (1.0 - back[:, tip]), down[:, tip])
            )
            left = deflections[-1] / max(float(deflections[SOLVED - 1]), 1e-300)
            found[:, tip] = np.where(back[:, tip] > 0.0, left, 1.0) * shown
        return found

    def _of_tip(self, deflections: Floats, t: Floats) -> Floats:
        """Return the deflection of one tip at times [s], 0 before its touch."""
        first = int(np.argmax(deflections > 0.0))
        if not deflections[first] > 0.0:
            return np.zeros(t.shape)
        # By Hertz's law the power 2/3 of a force is nearly linear.
        power = deflections[first:] ** (2.0 / 3.0)
        between = CubicSpline(self.times[first:], power)
        begin = float(self.times[first])
        before = float(self.times[first - 1]) if first else 0.0
        touched = min(max(begin - power[0] / max(float(between(begin, 1)), 1e-300), before), begin)
        early = power[0] * (t - touched) / max(begin - touched, 1e-300)
        return np.maximum(np.where(t < begin, early, between(t)), 0.0) ** 1.5


def press_curve(unit: SimulatedUnit, fruit: PressedFruit, hand: Hand) -> PressCurve:
    """Return a press of a unit on a fruit; raises InputError if it has no solution."""
    parts = np.arange(1, SOLVED + 1) / SOLVED
    times, travels = hand.press_s * parts, hand.travel * parts
    if hand.hold_s:  # dense at the start of the hold, where the force falls fastest
        times = np.append(times, hand.press_s + hand.hold_s * (np.arange(1, HELD + 1) / HELD) ** 2)
        travels = np.append(travels, np.full(HELD, hand.travel))
    drift = np.multiply(fruit.drift, 1.0)
    try:
        with np.errstate(invalid="raise", divide="raise"):
            pressing = Pressing(unit.domes, fruit.under(unit.heights), CELLS)
            way = Way(travels=travels, times=times, drift=drift)
            creep = creep_of(unit.creep, unit.weighed_s)
            _, deflections = pressed_over_time(pressing, way, hand.relaxation, creep)
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        msg = "this press has no solution. Take less tilt, larger radii or a smoother skin."
        raise InputError(msg) from error
    return PressCurve(hand=hand, times=times, deflections=deflections)
