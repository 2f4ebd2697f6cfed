"""The sources of the standard uncertainty of a reading: each is a deviation times a slope of the reading."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from pipeline.reading.reading_records import CalibrationLeft
from sensor.arrays import Floats
from sensor.design.reading import (
    LEAST_OF_SCALE,
    LEAST_OVER_NOISE,
    PRESS_S,
    PRESS_SAMPLES,
    WEIGHED_AFTER_S,
    ReadingRequirements,
)
from sensor.design.signal_path import SignalPath
from sensor.quantity import BOUNDED
from sensor.theory.contrast_law import ReadingSlopes
from sensor.theory.contrast_rise import RiseReading, RiseSlopes
from sensor.theory.creep import EFFECTIVE, NO_CREEP, CreepLaw

OF_NOISE = ("noise_percent", "noise_N", "readout_noise", "quantisation")
"""Sources that are independent from sample to sample."""
OF_DRIFT = "gain_drift"
"""The source for gains that change with temperature."""
OF_FRUIT = ("pose", "thickness", "poisson")
"""Sources that do not depend on the unit: shape and pose of the fruit, flesh over the stone, Poisson's ratio."""

Sources = dict[str, tuple[Floats | float, Floats]]
"""Deviations of the channels by name, (tips,), and slopes of ln E over them, (tips,) or (readings, tips)."""


def sizes(sources: Sources) -> dict[str, float]:
    """Return the standard uncertainty of a modulus by each source [1], averaged over equally likely readings."""
    return {name: _size(deviation * slopes) for name, (deviation, slopes) in sources.items()}


def _size(moved: Floats) -> float:
    return float(np.sqrt(np.square(moved).sum(axis=-1).mean()))


@dataclass(frozen=True, kw_only=True)
class UncertaintySources:
    """The relative standard uncertainty of the modulus by each source [1].

    `stiffness_slope` is the uncertainty per relative error of each spring, with independent errors [1]. `noise_slope`
    is the uncertainty per cent of noise in the forces [1/%].
    """

    contributions: Mapping[str, float]
    stiffness_slope: float
    noise_slope: float

    @property
    def total(self) -> float:
        """Return the standard uncertainty by all sources [1]; they are independent, so their squares add."""
        return math.hypot(*self.contributions.values())

    def noise_to_reach(self, limit: float) -> float | None:
        """Return the noise [% of full scale] at which the standard uncertainty reaches a limit [1].

        None if the other sources reach it without noise.
        """
        others = math.hypot(*(size for name, size in self.contributions.items() if name not in OF_NOISE))
        return None if others >= limit else math.sqrt(limit**2 - others**2) / self.noise_slope


class SlopesOnBall(NamedTuple):
    """The slopes of ln E over springs and gains, (tips,), in presses on a reference ball.

    The ball corrects all readings. So an error of the unit counts only by its slope less the slope on the ball.
    """

    springs: Floats
    gains: Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class Channels:
    """The errors of the channels and springs of a design or a unit, one standard deviation each, (tips,).

    `full_scale` [N] is the largest force. `noise` [N], by its causes, is independent from sample to sample. A zero
    drifts within `zero_drift` [N], a bound. `gains` [1] are by their causes, `springs` [1] are errors of the
    stiffnesses, and `time_s` is the error of each channel's time. Channels that were calibrated `on_plate` measure
    deflections. `creep` [1] is the common error of all stiffnesses in a press by creep of the leaves. It leaves
    deflections right and changes all forces by the same factor. `on_ball` is None without a reference ball.
    """

    full_scale: Floats
    noise: Mapping[str, Floats]
    zero_drift: Floats
    gains: Mapping[str, Floats]
    springs: Floats
    time_s: float
    on_plate: bool
    creep: float
    on_ball: SlopesOnBall | None = None

    @property
    def noises(self) -> Floats:
        """Return the noise of each force by all causes [N]."""
        return np.asarray(np.hypot(*self.noise.values()))

    @property
    def errors(self) -> Floats:
        """Return the error of each force without a touch [N], by noise and drift of zero."""
        return np.hypot(self.noises, self.zero_drift)

    @property
    def least_forces(self) -> Floats:
        """Return the forces below which tips are counted as out of contact [N]."""
        return np.maximum(LEAST_OVER_NOISE * self.errors, LEAST_OF_SCALE * self.full_scale)

    def calibrated(self, left: CalibrationLeft) -> "Channels":
        """Return the channels with the errors that a calibration leaves in springs and gains."""
        gains = {**self.gains, "gain": 0.01 * np.array(left.gain_percent)}
        return replace(self, gains=gains, springs=0.01 * np.array(left.stiffness_percent))

    def of_press(self, slopes: Sequence[RiseSlopes]) -> dict[str, float]:
        """Return the uncertainty of moduli [1] by each cause except noise, averaged over equally likely presses.

        A zero may be wrong from the first sample on, or drift by the same amount during the press.
        """

        def each(name: str) -> Floats:
            return np.array([getattr(one, name) for one in slopes])

        zeros = np.hypot(each("zeros"), each("drifts"))
        by_time = sizes({"zero_drift": (BOUNDED * self.zero_drift, zeros), "times": (self.time_s, each("times"))})
        return {**by_time, **self.of_springs_and_gains(each("springs"), each("gains"))}

    def of_moment(self, slopes: ReadingSlopes, forces: Floats) -> dict[str, float]:
        """Return the uncertainty of a modulus by the forces of one moment [N], as `of_press` does."""
        by_force = np.array(slopes.forces)
        by_zeros = sizes({"zero_drift": (BOUNDED * self.zero_drift, by_force)})
        return {**by_zeros, **self.of_springs_and_gains(np.array(slopes.springs), by_force * forces)}

    def of_springs_and_gains(self, springs: Floats, gains: Floats) -> dict[str, float]:
        """Return the uncertainty of a modulus [1] by springs and channels, from its slopes over both [1]."""
        left_springs, left_gains = springs, gains
        if self.on_ball is not None:
            left_springs, left_gains = springs - self.on_ball.springs, gains - self.on_ball.gains
        # A channel that shows a deflection overestimates the force of a spring that is softer than known, and vice
        # versa.
        sources: Sources = {"stiffness": (self.springs, left_springs + left_gains if self.on_plate else left_springs)}
        if self.creep:
            sources["creep"] = (self.creep, np.ones(1))
        # The drift by temperature differs between the ball and the fruit, so the ball does not remove it.
        by_gain = {cause: (each, gains if cause == OF_DRIFT else left_gains) for cause, each in self.gains.items()}
        return sizes(sources | by_gain)


def designed_channels(
    reading: ReadingRequirements,
    full_scale: Floats,
    signal: SignalPath | None,
    creep: CreepLaw = NO_CREEP,
    press_s: float = PRESS_S,
) -> Channels:
    """Return the channels of a design with full scales [N], (tips,), from its read-out or from its `[reading]`.

    Springs and gains without a value are exact until they are `calibrated`. A press by hand takes `press_s` [s], and
    springs that creep are weighed after `WEIGHED_AFTER_S`. The effect of time errors is inversely proportional to the
    duration of a press; slopes are computed for a press of `PRESS_S`.
    """
    tips = np.ones(len(full_scale))
    by_reading = Channels(
        full_scale=full_scale,
        noise={"noise_percent": 0.01 * reading.noise_percent * full_scale, "noise_N": reading.noise_N * tips},
        zero_drift=0.0 * tips,
        gains={"gain": 0.01 * (reading.gain_percent or 0.0) * tips},
        springs=0.01 * (reading.stiffness_percent or 0.0) * tips,
        time_s=0.0,
        on_plate=reading.on_plate,
        # Presses on a ball last as long as presses on fruit, so the creep since a weighing does not matter.
        creep=creep.deviation(EFFECTIVE * press_s if reading.calibrated_by == "ball" else WEIGHED_AFTER_S, press_s),
    )
    if signal is None:
        return by_reading
    return replace(
        by_reading,
        noise={"readout_noise": np.array(signal.noise_N), "quantisation": np.array(signal.rounding_N)},
        zero_drift=np.array(signal.zero_drift_N),
        gains={**by_reading.gains, OF_DRIFT: BOUNDED * 0.01 * np.array(signal.gain_drift_percent)},
        time_s=BOUNDED * 1e-3 * signal.time_error_ms * PRESS_S / press_s,
    )


def by_heat(signal: SignalPath | None) -> dict[str, float]:
    """Return the standard uncertainty of any modulus [1] by the temperature of the leaves.

    Leaves of another modulus have the same deflection under another force. Deflections are measured correctly, so all
    forces have the same relative error. The modulus is proportional to the forces.
    """
    return {} if signal is None else {"modulus_drift": BOUNDED * 0.01 * signal.modulus_drift_percent}


def uncertainty_sources(
    found: Sequence[RiseReading], channels: Channels, samples: int, others: Mapping[str, float]
) -> UncertaintySources:
    """Return the uncertainty sources of equally likely readings from presses with a number of samples.

    `others` are sources that are known already [1]. The noise is scaled to a press of `PRESS_SAMPLES`.
    """
    slopes = [each.slopes for each in found]
    per_force = np.array([each.noise for each in slopes]) * math.sqrt(samples / PRESS_SAMPLES)
    by_noise = sizes({cause: (deviation, per_force) for cause, deviation in channels.noise.items()})
    return UncertaintySources(
        contributions={**by_noise, **channels.of_press(slopes), **others},
        stiffness_slope=_size(np.array([each.springs for each in slopes])),
        noise_slope=0.01 * _size(per_force * channels.full_scale),
    )
