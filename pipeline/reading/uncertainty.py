"""What the standard uncertainty of a reading is made of: each source is a deviation times a slope of the reading."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from pipeline.reading.records import CalibrationLeft
from sensor.arrays import Floats
from sensor.design.reading import (
    LEAST_OF_SCALE,
    LEAST_OVER_NOISE,
    PRESS_S,
    PRESS_SAMPLES,
    WEIGHED_AFTER_S,
    Reading,
)
from sensor.design.signal_path import SignalPath
from sensor.quantity import BOUNDED
from sensor.theory.contrast_law import ReadingSlopes
from sensor.theory.contrast_rise import RiseReading, RiseSlopes
from sensor.theory.creep import EFFECTIVE, NO_CREEP, CreepLaw

OF_NOISE = ("noise_percent", "noise_N", "readout_noise", "quantisation")
"""Sources that are independent from sample to sample."""
OF_DRIFT = "gain_drift"
"""The source of gains that move with the temperature."""
OF_FRUIT = ("pose", "thickness", "poisson")
"""Sources that are the same whatever the unit: shape of the fruit and pose, flesh over the stone, Poisson's ratio."""

Sources = dict[str, tuple[Floats | float, Floats]]
"""By its name each deviation of the channels, (tips,), and the slopes of ln E over it, (tips,) or (readings, tips)."""


def sizes(sources: Sources) -> dict[str, float]:
    """Return the standard uncertainty of a modulus by each source [1], of readings that are equally likely."""
    return {name: _size(deviation * slopes) for name, (deviation, slopes) in sources.items()}


def _size(moved: Floats) -> float:
    return float(np.sqrt(np.square(moved).sum(axis=-1).mean()))


@dataclass(frozen=True, kw_only=True)
class UncertaintySources:
    """The relative standard uncertainty of the modulus by each source [1].

    `stiffness_slope` is the uncertainty per relative error of each spring, independent of the others [1]. `noise_slope`
    is the uncertainty per cent of noise in forces [1/%].
    """

    contributions: Mapping[str, float]
    stiffness_slope: float
    noise_slope: float

    @property
    def total(self) -> float:
        """Return the standard uncertainty of all sources together [1]: they are independent, so their squares add."""
        return math.hypot(*self.contributions.values())

    def noise_to_reach(self, limit: float) -> float | None:
        """Return the noise [% of full scale] at which a standard uncertainty [1] is reached.

        It is None if the other sources alone reach it.
        """
        others = math.hypot(*(size for name, size in self.contributions.items() if name not in OF_NOISE))
        return None if others >= limit else math.sqrt(limit**2 - others**2) / self.noise_slope


class SlopesOnBall(NamedTuple):
    """The slopes of ln E over springs and gains, (tips,), with which presses on a reference ball showed a unit.

    All readings are corrected by those presses. So of an error that stays in the unit the difference of slopes is left.
    """

    springs: Floats
    gains: Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class Channels:
    """The errors of the channels and springs of a design or of a unit, one standard deviation of each, all (tips,).

    `full_scale` [N] is the largest force. `noise` [N], by its causes, is independent from sample to sample. A zero
    drifts within `zero_drift` [N], a bound. `gains` [1] are by their causes, `springs` [1] are stiffnesses, `time_s` is
    the time of each channel. Channels that were calibrated `on_plate` show deflections. `creep` [1] is common to all
    stiffnesses in a press of leaves that creep. Deflections are read right, and all forces have the same error.
    `on_ball` is None without a reference ball.
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
        """Return the noise of each force by all causes together [N]."""
        return np.asarray(np.hypot(*self.noise.values()))

    @property
    def errors(self) -> Floats:
        """Return the error of each force without a touch [N]: noise and drift of zero together."""
        return np.hypot(self.noises, self.zero_drift)

    @property
    def least_forces(self) -> Floats:
        """Return the forces below which tips are counted as out of contact [N]."""
        return np.maximum(LEAST_OVER_NOISE * self.errors, LEAST_OF_SCALE * self.full_scale)

    def calibrated(self, left: CalibrationLeft) -> "Channels":
        """Return the channels with what a calibration leaves in springs and gains."""
        gains = {**self.gains, "gain": 0.01 * np.array(left.gain_percent)}
        return replace(self, gains=gains, springs=0.01 * np.array(left.stiffness_percent))

    def of_press(self, slopes: Sequence[RiseSlopes]) -> dict[str, float]:
        """Return the uncertainty of the moduli of presses [1] by each cause but noise, of presses equally likely.

        A zero may be off from the first sample on, or drift by as much during the press.
        """

        def each(name: str) -> Floats:
            return np.array([getattr(one, name) for one in slopes])

        zeros = np.hypot(each("zeros"), each("drifts"))
        by_time = sizes({"zero_drift": (BOUNDED * self.zero_drift, zeros), "times": (self.time_s, each("times"))})
        return {**by_time, **self.of_springs_and_gains(each("springs"), each("gains"))}

    def of_moment(self, slopes: ReadingSlopes, forces: Floats) -> dict[str, float]:
        """Return the uncertainty of the modulus by the forces of one moment [N], as `of_press` does."""
        by_force = np.array(slopes.forces)
        by_zeros = sizes({"zero_drift": (BOUNDED * self.zero_drift, by_force)})
        return {**by_zeros, **self.of_springs_and_gains(np.array(slopes.springs), by_force * forces)}

    def of_springs_and_gains(self, springs: Floats, gains: Floats) -> dict[str, float]:
        """Return the uncertainty of a modulus [1] by springs and channels, of its slopes over both [1]."""
        left_springs, left_gains = springs, gains
        if self.on_ball is not None:
            left_springs, left_gains = springs - self.on_ball.springs, gains - self.on_ball.gains
        # If a channel shows a deflection, the force of a spring that is stiffer than known is larger too.
        sources: Sources = {"stiffness": (self.springs, left_springs + left_gains if self.on_plate else left_springs)}
        if self.creep:
            sources["creep"] = (self.creep, np.ones(1))
        # What drifts with the temperature is another one on the ball.
        by_gain = {cause: (each, gains if cause == OF_DRIFT else left_gains) for cause, each in self.gains.items()}
        return sizes(sources | by_gain)


def designed_channels(
    reading: Reading,
    full_scale: Floats,
    signal: SignalPath | None,
    creep: CreepLaw = NO_CREEP,
    press_s: float = PRESS_S,
) -> Channels:
    """Return the channels of a design with full scales [N], (tips,): by its read-out, or as a reading says.

    Springs and gains that the reading does not give are exact until they are `calibrated`.
    A press by hand takes `press_s` [s], and springs that creep are weighed after `WEIGHED_AFTER_S`. The effect of times
    is in inverse proportion to the duration of a press; a press is solved as one of `PRESS_S`.
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
        # Presses on a ball last as long as those on fruit: what a weight tells of creep drops out.
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

    Leaves of another modulus have the same deflection under another force. Deflections are read right, all forces have
    that relative error, and so has the modulus, which is proportional to forces.
    """
    return {} if signal is None else {"modulus_drift": BOUNDED * 0.01 * signal.modulus_drift_percent}


def uncertainty_sources(
    found: Sequence[RiseReading], channels: Channels, samples: int, others: Mapping[str, float]
) -> UncertaintySources:
    """Return the sources of readings of presses of so many samples, which are equally likely.

    `others` are sources that are known already [1]. Noise is that of a press of `PRESS_SAMPLES`.
    """
    slopes = [each.slopes for each in found]
    per_force = np.array([each.noise for each in slopes]) * math.sqrt(samples / PRESS_SAMPLES)
    by_noise = sizes({cause: (deviation, per_force) for cause, deviation in channels.noise.items()})
    return UncertaintySources(
        contributions={**by_noise, **channels.of_press(slopes), **others},
        stiffness_slope=_size(np.array([each.springs for each in slopes])),
        noise_slope=0.01 * _size(per_force * channels.full_scale),
    )
