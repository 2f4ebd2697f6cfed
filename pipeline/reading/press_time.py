"""How fast a finished sensor may be pressed: its samples must suffice, and the times of its channels be known."""

import functools
import math

import numpy as np

from pipeline.reading.poses import Placement
from pipeline.reading.pressed_sensor import RISE_TRAVELS, PressedSensor
from sensor.design.reading import LARGEST_TOUCH_FRACTION, LEAST_OVER_NOISE
from sensor.theory.contrast_law import ReadingError
from sensor.theory.contrast_rise import FEWEST, LARGEST_BY_TIME, read_rise, rise_of
from solve.contact.linear_response import travels

SAMPLES = 60
"""Of a press by hand, which slows to a stop: x = X (1 - (1 - t / T)^2)."""


@functools.lru_cache(maxsize=1)  # readings, constants and files for fabrication ask for that of one sensor
def fastest_press(sensor: PressedSensor) -> float | None:
    """Return the shortest duration [s] of a press by hand, from the first touch to its deepest point, that tells E.

    The times of the channels then leave 2 % of E open on level fruit, one standard deviation, and enough samples follow
    the last touch. None without a read-out and for a press that has no rise. Raises as `pose_forces`.
    """
    signal = sensor.signal
    if signal is None:
        return None
    design = sensor.design
    forces = sensor.presses([design.fruit.largest_E_MPa], [Placement()]).F[0, 0]
    x = np.concatenate([[0.0], travels(design.press.travel_mm, RISE_TRAVELS)])
    forces = np.concatenate([np.zeros((1, forces.shape[1])), np.nan_to_num(forces)])
    at = design.press.travel_mm * (1.0 - np.linspace(1.0, 0.0, SAMPLES + 1) ** 2)
    least = LEAST_OVER_NOISE * np.array(signal.errors_N)
    press = np.column_stack([np.interp(at, x, row) for row in forces.T])
    rise = rise_of(press, len(least), least, t=np.arange(len(press)) / SAMPLES)
    try:
        slopes = read_rise(sensor.law, rise, np.zeros(len(least))).slopes
    except ReadingError:
        return None
    by_clocks = float(np.linalg.norm(slopes.times)) * signal.time_deviation / signal.rate_Hz / LARGEST_BY_TIME
    samples = FEWEST + (2 if signal.delays else 1)
    return max(by_clocks, samples / signal.rate_Hz / math.sqrt(1.0 - LARGEST_TOUCH_FRACTION))
