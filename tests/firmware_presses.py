"""Stored presses for all readers of firmware, and the units that read them."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from measured_units import with_design, with_heights, with_path, with_read_out

from instrument.press.reference_ball import BallCorrection
from sensor.design.processes import PROCESSES
from sensor.design.readout import Readout
from sensor.design.signal_path import SpringToRead, signal_path

PRESSES = json.loads(Path(__file__).with_suffix(".json").read_text(encoding="utf-8"))
"""Presses of the contact engine, or of boundary elements over ellipsoids, with the modulus that was pressed.

Noise, tilts, places of bad samples and times of the channels are drawn. `flags` and `left_out` are what is right.
"""
FACTORS = {"mango": (1.19, 1.11, 1.15, 1.12), "paper": (1.19, 1.11), "paper-on-mango": (1.19, 1.11)}
HIGHER = (0.02, -0.03, 0.01, 0.03)  # [mm]
BALL = BallCorrection(
    factor=1.13,
    percent=2.0,
    E_MPa=1.3,
    radius_mm=40.0,
    press_s=3.0,
    spring_slopes=(0.0,) * 4,
    gain_slopes=(0.0,) * 4,
    form_percent=(0.0,) * 3,
)


def with_level_rows(sensor, count):
    return with_read_out(sensor, rise_level=sensor.report.read_out.rise_level[:count])


def with_ball_and_creep(sensor):
    return replace(sensor, unit=replace(sensor.unit, ball=BALL, creep_per_decade=0.025, creep_error=0.01))


def late(sensor, time_error_ms, rate_Hz):
    """Return a unit whose high channels are converted 12.5 ms after the low ones."""
    return with_path(sensor, delay_ms=(0.0, 12.5, 0.0, 12.5), rate_Hz=rate_Hz, time_error_ms=time_error_ms)


def loud(sensor):
    """Return a unit whose design has noise of 5 % of full scale."""
    reading = replace(sensor.report.design.reading, noise_percent=5.0)
    return with_read_out(with_design(sensor, reading=reading), signal=None)


def in_turn(sensor):
    springs = [SpringToRead(name=name, K=K, deflection=0.5) for name, K in (("low", 0.9), ("high", 20.0))]
    return with_read_out(sensor, signal=signal_path(Readout(), springs, PROCESSES["fdm-petg"], ("low", "high")))


UNITS = {
    "plain": lambda sensor: sensor,
    "stiffer": lambda sensor: sensor,
    "higher": lambda sensor: with_heights(sensor, HIGHER),
    "noisy": loud,
    "in turn": in_turn,
    "told radii": lambda sensor: replace(sensor, radii_mm=(35.0, 60.0)),
    "one level row": lambda sensor: with_level_rows(sensor, 1),
    "two level rows": lambda sensor: with_level_rows(sensor, 2),
    "ball and creep": with_ball_and_creep,
    "ball, creep and one level row": lambda sensor: with_ball_and_creep(with_level_rows(sensor, 1)),
    **{f"times to {ms} ms": lambda sensor, ms=ms: late(sensor, ms, 50.0) for ms in (0, 1, 20)},
    **{f"times to {ms} ms of slow lines": lambda sensor, ms=ms: late(sensor, ms, 25.0) for ms in (0, 1, 20)},
}
"""What a unit has other than its design; those that are stiffer or higher have springs of `FACTORS`."""


def forces_of(press):
    """Return the forces [N] of a stored press, (samples, tips), in single precision, with its hold."""
    forces = np.array(press["forces"] or np.empty((0, 4)), dtype=np.float32)
    return np.concatenate([forces, np.repeat(forces[-1:], press.get("held", 0), axis=0)])
