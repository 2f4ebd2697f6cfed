"""The sources of the standard uncertainty of a reading.

Each contribution is the standard deviation of a cause times the slope of ln E with respect to this cause.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from pipeline.reading.reading_records import CalibrationErrors
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
from sensor.quantity import UNIFORM_DEVIATION
from sensor.theory.contrast_law import ReadingSlopes
from sensor.theory.contrast_rise import RiseReading, RiseSlopes
from sensor.theory.creep import EFFECTIVE, NO_CREEP, CreepLaw

NOISE_SOURCES = ("noise_percent", "noise_N", "readout_noise", "quantisation")
"""Sources whose errors are independent from sample to sample."""
DRIFT_SOURCE = "gain_drift"
"""The name of the source for the drift of the gains with temperature."""
FRUIT_SOURCES = ("pose", "thickness", "poisson")
"""Sources that depend on the fruit and not on the unit: shape and pose, thickness of the flesh, Poisson's ratio."""

Sources = dict[str, tuple[Floats | float, Floats]]
"""The sources by name: the standard deviation of each in each channel, (tips,), and the slopes of ln E with respect to
it, (tips,) or (readings, tips)."""


def standard_uncertainties(sources: Sources) -> dict[str, float]:
    """Return the relative standard uncertainty of E due to each source [1], by the name of the source.

    Each uncertainty is a root mean square over equally likely readings.
    """
    return {name: _root_mean_square(deviation * slopes) for name, (deviation, slopes) in sources.items()}


def _root_mean_square(changes: Floats) -> float:
    """Return the root mean square over readings of `changes` (readings, tips) [1] that are independent between tips."""
    return float(np.sqrt(np.square(changes).sum(axis=-1).mean()))


@dataclass(frozen=True, kw_only=True)
class UncertaintySources:
    """The relative standard uncertainty of the modulus due to each source [1].

    `stiffness_slope` [1] is the uncertainty divided by the relative error of the spring stiffnesses, if the springs
    have independent errors of the same size. `noise_slope` [1/%] is the uncertainty caused by noise of 1 % of full
    scale in each force.
    """

    contributions: Mapping[str, float]
    stiffness_slope: float
    noise_slope: float

    @property
    def total(self) -> float:
        """Return the root sum of squares of all contributions [1], which are independent of each other."""
        return math.hypot(*self.contributions.values())

    def noise_to_reach(self, limit: float) -> float | None:
        """Return the noise of the forces [% of full scale] at which the standard uncertainty reaches a `limit` [1].

        The uncertainties due to noise and to the other sources add in quadrature. The result is None if the other
        sources reach the limit without any noise.
        """
        other_contributions = [value for name, value in self.contributions.items() if name not in NOISE_SOURCES]
        without_noise = math.hypot(*other_contributions)
        return None if without_noise >= limit else math.sqrt(limit**2 - without_noise**2) / self.noise_slope


class SlopesOnBall(NamedTuple):
    """Slopes [1] of ln E with respect to relative errors of springs and gains on a reference ball, shape (tips,).

    The reading of the ball corrects all later readings. An error of the unit therefore affects them only by the
    difference between its slope on the fruit and its slope on the ball.
    """

    springs: Floats
    gains: Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class Channels:
    """The standard deviations of the channels and springs of a design or a unit; arrays have the shape (tips,).

    `full_scale` [N] is the largest force. `noise` [N] holds the noise by cause, which is independent from sample to
    sample. A zero drifts by at most `zero_drift` [N], which is a bound and not a standard deviation. `gains` [1] holds
    the relative errors of the gains by cause, and `springs` [1] the relative errors of the stiffnesses. `time_s` [s] is
    the error of each channel's time. Channels that were calibrated `on_plate` measure deflections. `creep` [1] is the
    common relative error of all stiffnesses due to creep of the leaves. Creep does not affect deflections, and changes
    all forces by the same factor. `on_ball` is None without a reference ball.
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
        """Return the noise of each force due to all causes together [N]."""
        return np.asarray(np.hypot(*self.noise.values()))

    @property
    def errors(self) -> Floats:
        """Return the error of each force before first touch [N], due to noise and to drift of the zero."""
        return np.hypot(self.noises, self.zero_drift)

    @property
    def least_forces(self) -> Floats:
        """Return the forces [N] below which tips are considered to be out of contact, shape (tips,)."""
        return np.maximum(LEAST_OVER_NOISE * self.errors, LEAST_OF_SCALE * self.full_scale)

    def calibrated(self, errors: CalibrationErrors) -> "Channels":
        """Return a copy of the channels with the `errors` of springs and gains that remain after a calibration.

        The errors are given in per cent.
        """
        gains = {**self.gains, "gain": 0.01 * np.array(errors.gain_percent)}
        return replace(self, gains=gains, springs=0.01 * np.array(errors.stiffness_percent))

    def press_uncertainty(self, slopes: Sequence[RiseSlopes]) -> dict[str, float]:
        """Return the relative standard uncertainty of the modulus due to each cause except noise [1].

        `slopes` belong to whole presses that are equally likely. The result is a root mean square over them, by the
        name of the cause. A zero may have an error from the first sample on, and it may drift by the same amount during
        the press. These two errors are independent, so their slopes add in quadrature.
        """

        def slopes_of(cause: str) -> Floats:
            """Return the slopes of ln E with respect to one cause, shape (presses, tips)."""
            return np.array([getattr(press_slopes, cause) for press_slopes in slopes])

        zeros = np.hypot(slopes_of("zeros"), slopes_of("drifts"))
        sources: Sources = {
            "zero_drift": (UNIFORM_DEVIATION * self.zero_drift, zeros),
            "times": (self.time_s, slopes_of("times")),
        }
        springs_and_gains = self.spring_and_gain_uncertainty(slopes_of("springs"), slopes_of("gains"))
        return {**standard_uncertainties(sources), **springs_and_gains}

    def moment_uncertainty(self, slopes: ReadingSlopes, forces: Floats) -> dict[str, float]:
        """Return the uncertainties of `press_uncertainty` for a modulus that is read from the forces at one moment.

        `slopes` are the slopes of ln E with respect to errors of forces and springs, and `forces` (tips,) are in N. The
        times of the channels do not matter at one moment, so `times` is not among the causes.
        """
        force_slopes = np.array(slopes.forces)  # [1/N]; times the force, they are the slopes for the gains
        zero_sources = standard_uncertainties({"zero_drift": (UNIFORM_DEVIATION * self.zero_drift, force_slopes)})
        return {**zero_sources, **self.spring_and_gain_uncertainty(np.array(slopes.springs), force_slopes * forces)}

    def spring_and_gain_uncertainty(self, springs: Floats, gains: Floats) -> dict[str, float]:
        """Return the relative standard uncertainty of the modulus due to errors of stiffnesses, creep and gains [1].

        The uncertainties are keyed by the name of the cause. `springs` and `gains` are the slopes of ln E with respect
        to relative errors of stiffnesses and gains [1], with the shape (tips,) or (readings, tips). With a reference
        ball, the slopes on the ball are subtracted, because the ball corrects the readings.
        """
        corrected_springs, corrected_gains = springs, gains
        if self.on_ball is not None:
            corrected_springs, corrected_gains = springs - self.on_ball.springs, gains - self.on_ball.gains
        # A channel that measures a deflection overestimates the force of a spring that is softer than assumed. An error
        # of the stiffness therefore also acts like an error of the gain.
        stiffness_slopes = corrected_springs + corrected_gains if self.on_plate else corrected_springs
        sources: Sources = {"stiffness": (self.springs, stiffness_slopes)}
        if self.creep:
            # creep changes all forces by one factor, and the modulus is proportional to this factor
            sources["creep"] = (self.creep, np.ones(1))
        # The temperature may change between the presses on the ball and on the fruit. So the ball does not remove the
        # drift, whose slopes are not corrected.
        for cause, deviation in self.gains.items():
            gain_slopes = gains if cause == DRIFT_SOURCE else corrected_gains
            sources[cause] = (deviation, gain_slopes)
        return standard_uncertainties(sources)


def designed_channels(
    reading: ReadingRequirements,
    full_scale: Floats,
    signal: SignalPath | None,
    creep: CreepLaw = NO_CREEP,
    press_s: float = PRESS_S,
) -> Channels:
    """Return the errors of the channels that a design expects, from its read-out or from `[reading]`.

    `full_scale` (tips,) [N] are the largest forces, and `press_s` [s] is the duration of a press by hand. `signal` is
    the signal path of the read-out. If it is None, the noise comes from `[reading]`, and nothing drifts. If `[reading]`
    has no value for springs or gains, their errors are 0 until `calibrated` replaces them. `creep` is the creep law of
    the print material. Creep is counted from `WEIGHED_AFTER_S`, the time after which a weight hung on a spring is read.
    """
    ones = np.ones(len(full_scale))  # one entry for each tip
    # With a reference ball, the time of weighing is irrelevant, because presses on the ball last as long as on fruit. A
    # press measures the stiffness at `EFFECTIVE` times its duration.
    calibrated_after_s = EFFECTIVE * press_s if reading.calibrated_by == "ball" else WEIGHED_AFTER_S
    channels = Channels(
        full_scale=full_scale,
        noise={"noise_percent": 0.01 * reading.noise_percent * full_scale, "noise_N": reading.noise_N * ones},
        zero_drift=0.0 * ones,
        gains={"gain": 0.01 * (reading.gain_percent or 0.0) * ones},
        springs=0.01 * (reading.stiffness_percent or 0.0) * ones,
        time_s=0.0,
        on_plate=reading.on_plate,
        creep=creep.deviation(calibrated_after_s, press_s),
    )
    return channels if signal is None else _with_read_out(channels, signal, press_s)


def _with_read_out(channels: Channels, signal: SignalPath, press_s: float) -> Channels:
    """Return the channels with the noise, the drifts and the time errors of a read-out.

    `signal` is the signal path of the read-out, and `press_s` [s] is the duration of a press by hand.
    """
    return replace(
        channels,
        noise={"readout_noise": np.array(signal.noise_N), "quantisation": np.array(signal.rounding_N)},
        zero_drift=np.array(signal.zero_drift_N),
        gains={**channels.gains, DRIFT_SOURCE: UNIFORM_DEVIATION * 0.01 * np.array(signal.gain_drift_percent)},
        # The effect of a time error is inversely proportional to the duration of a press. The slopes hold for a press
        # of PRESS_S, so the error is scaled to this duration.
        time_s=UNIFORM_DEVIATION * 1e-3 * signal.time_error_ms * PRESS_S / press_s,
    )


def heat_uncertainty(signal: SignalPath | None) -> dict[str, float]:
    """Return the relative standard uncertainty of any modulus due to the temperature of the leaves [1].

    The temperature changes Young's modulus of the leaves, so the same deflection corresponds to a different force. All
    forces then have the same relative error, and the modulus read is proportional to them. The result is empty without
    a read-out.
    """
    return {} if signal is None else {"modulus_drift": UNIFORM_DEVIATION * 0.01 * signal.modulus_drift_percent}


def uncertainty_sources(
    readings: Sequence[RiseReading], channels: Channels, samples: int, other_sources: Mapping[str, float]
) -> UncertaintySources:
    """Return all sources of the uncertainty of a reading, computed from the slopes of equally likely `readings`.

    `channels` hold the errors. `samples` is the number of samples of the solved presses. A real press has
    `PRESS_SAMPLES`, and the effect of noise is inversely proportional to the square root of the number of samples.
    `other_sources` [1] are uncertainties by name that do not follow from these slopes.
    """
    slopes = [reading.slopes for reading in readings]
    noise_slopes = np.array([press_slopes.noise for press_slopes in slopes]) * math.sqrt(samples / PRESS_SAMPLES)
    noise_sources = standard_uncertainties(
        {cause: (deviation, noise_slopes) for cause, deviation in channels.noise.items()}
    )
    return UncertaintySources(
        contributions={**noise_sources, **channels.press_uncertainty(slopes), **other_sources},
        stiffness_slope=_root_mean_square(np.array([press_slopes.springs for press_slopes in slopes])),
        noise_slope=0.01 * _root_mean_square(noise_slopes * channels.full_scale),  # per 1 % of full scale
    )
