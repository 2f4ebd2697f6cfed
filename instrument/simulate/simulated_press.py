"""One press of a simulated unit: the deflections of its springs as functions of time, solved at a few moments."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from instrument.simulate.drawn_fruit import PressedFruit
from instrument.simulate.unit import SimulatedUnit
from sensor.arrays import Floats
from sensor.quantity import InputError
from solve.presses.press_over_time import PressMotionOverTime, fit_kelvin_elements, press_with_creep
from solve.presses.pressing import Pressing

CELLS_PER_SIDE = 20  # grid cells per side of a contact; with 32 cells, the forces change by less than 0.1 %
PRESS_MOMENTS = 18  # number of moments of the press that are solved; with twice as many, E changes by less than 0.7 %
HOLD_MOMENTS = 8  # number of moments of a hold that are solved
_TINY = 1e-300  # replaces 0 as a divisor


@dataclass(frozen=True, kw_only=True)
class HandPress:
    """A press by hand: a `travel` [mm] from the first touch in `press_s` [s], a hold of `hold_s` [s], and a retraction.

    `relaxation` is the Prony series of the flesh: the fraction [1] and the time constant [s] of each Maxwell arm.
    """

    travel: float
    press_s: float
    hold_s: float = 0.0
    relaxation: Sequence[tuple[float, float]] = ()

    @property
    def retraction_s(self) -> float:
        """Return the duration of the retraction [s]."""
        return 0.5 * self.press_s


@dataclass(frozen=True, kw_only=True, eq=False)
class PressCurve:
    """The deflections of the springs (moments, tips) [mm] at the solved moments of a press.

    `times` (moments,) [s] are counted from the first touch. The last moment is the end of the hold, if there is one.
    """

    hand_press: HandPress
    times: Floats
    deflections: Floats

    @property
    def duration_s(self) -> float:
        """Return the time from the first touch to the lift [s]."""
        return self.hand_press.press_s + self.hand_press.hold_s + self.hand_press.retraction_s

    def at(self, t: Floats) -> Floats:
        """Return the deflections (samples, tips) [mm] at the times `t` (samples, tips) [s] since the first touch.

        Each tip has its own times, because the channels are converted in turn. The retraction is not solved. It is
        taken as the press in reverse, scaled so that it begins with the deflection at the end of the hold. The
        deflections are 0 before the touch and after the lift.
        """
        hand_press = self.hand_press
        forward_times = np.clip(t, 0.0, hand_press.press_s + hand_press.hold_s)
        # fraction of the retraction, from 0 at the end of the hold to 1 at the lift
        retraction_progress = np.clip((t - hand_press.press_s - hand_press.hold_s) / hand_press.retraction_s, 0.0, 1.0)
        is_retraction = retraction_progress > 0.0
        times = np.where(is_retraction, hand_press.press_s * (1.0 - retraction_progress), forward_times)
        deflections_at_t = np.zeros(t.shape)
        for tip, deflections in enumerate(self.deflections.T):
            before_hold = float(deflections[PRESS_MOMENTS - 1])  # 0 for a tip that never touches
            # deflection at the end of the hold, relative to its start
            hold_ratio = deflections[-1] / max(before_hold, _TINY)
            scale = np.where(is_retraction[:, tip], hold_ratio, 1.0)
            deflections_at_t[:, tip] = scale * self._interpolate(deflections, times[:, tip])
        return deflections_at_t

    def _interpolate(self, deflections: Floats, t: Floats) -> Floats:
        """Return the deflection of one tip [mm] at the times `t` [s], from its solved `deflections` (moments,) [mm].

        By Hertz's law, deflection^(2/3) increases nearly linearly with time. So this power is interpolated by a spline,
        and extrapolated linearly from the first moment in contact back to the touch. Before the touch it is 0.
        """
        first = int(np.argmax(deflections > 0.0))  # index of the first moment in contact, or 0 without any
        if not deflections[first] > 0.0:  # the tip never touches
            return np.zeros(t.shape)
        powers = deflections[first:] ** (2.0 / 3.0)
        spline = CubicSpline(self.times[first:], powers)
        contact_time = float(self.times[first])
        previous_time = float(self.times[first - 1]) if first else 0.0
        # The tangent of the spline reaches 0 at the touch, which must lie between the two moments.
        slope = max(float(spline(contact_time, 1)), _TINY)  # first derivative
        touch_time = min(max(contact_time - powers[0] / slope, previous_time), contact_time)
        extrapolated = powers[0] * (t - touch_time) / max(contact_time - touch_time, _TINY)
        powers_at_t = np.maximum(np.where(t < contact_time, extrapolated, spline(t)), 0.0)
        return powers_at_t**1.5


def press_curve(unit: SimulatedUnit, fruit: PressedFruit, hand_press: HandPress) -> PressCurve:
    """Solve a press of a unit on a fruit by boundary elements, at equal steps of its travel and during its hold.

    The tilt of the sensor changes during the press as the fruit states. Raises InputError if the press has no solution.
    """
    progress = np.arange(1, PRESS_MOMENTS + 1) / PRESS_MOMENTS  # fraction of the press
    times, travels = hand_press.press_s * progress, hand_press.travel * progress
    if hand_press.hold_s:
        # The square puts the moments closest together at the start of the hold, where the force decreases fastest.
        hold_progress = (np.arange(1, HOLD_MOMENTS + 1) / HOLD_MOMENTS) ** 2  # fraction of the hold
        times = np.append(times, hand_press.press_s + hand_press.hold_s * hold_progress)
        travels = np.append(travels, np.full(HOLD_MOMENTS, hand_press.travel))
    try:
        with np.errstate(invalid="raise", divide="raise"):  # otherwise a failed solution would contain NaN
            pressing = Pressing(unit.domes, fruit.in_sensor_frame(unit.heights), CELLS_PER_SIDE)
            motion = PressMotionOverTime(travels=travels, times=times, drift=fruit.drift)
            creep = fit_kelvin_elements(unit.creep, unit.weighed_s)
            _, deflections = press_with_creep(pressing, motion, hand_press.relaxation, creep)
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        msg = "The simulation of this press has no solution. Choose a smaller tilt, larger radii or a smoother skin."
        raise InputError(msg) from error
    return PressCurve(hand_press=hand_press, times=times, deflections=deflections)
