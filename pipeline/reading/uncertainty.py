"""What the standard uncertainty of a reading is made of, each source by itself."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cad.fabrication.signal_path import SignalPath
from sensor.arrays import Floats
from sensor.design.reading import (
    LEAST_OF_SCALE,
    LEAST_OVER_NOISE,
    PRESS_S,
    PRESS_SAMPLES,
    WEIGHED_AFTER_S,
    Reading,
)
from sensor.quantity import BOUNDED
from sensor.theory.contrast_law import ReadingSlopes
from sensor.theory.contrast_rise import RiseReading, RiseSlopes
from sensor.theory.creep import NO_CREEP, CreepLaw

OF_FRUIT = ("pose", "thickness", "poisson")
"""Sources that are the same whatever the unit: shape of the fruit and pose, flesh over the stone, Poisson's ratio."""


@dataclass(frozen=True, kw_only=True)
class UncertaintySources:
    """The relative standard uncertainty of the modulus by each source [1].

    `stiffness_slope` is that per relative error of each spring, apart from the others [1]. `noise_slope` is that per
    cent of noise in forces [1/%], `by_noise` what noise in forces makes in all [1].
    """

    contributions: Mapping[str, float]
    stiffness_slope: float
    noise_slope: float
    by_noise: float

    @property
    def total(self) -> float:
        """Return the standard uncertainty of all sources together [1]: they are independent, so their squares add."""
        return math.hypot(*self.contributions.values())


@dataclass(frozen=True, kw_only=True)
class Channels:
    """What the channels of a sensor add to its forces, each (tips,): by their read-out, or as a reading asks.

    `full_scale` [N] is the largest force of each, of which the noise that is asked for is a share. A press by hand
    takes `press_s` [s]. Springs that creep are weighed after `WEIGHED_AFTER_S`.
    """

    reading: Reading
    full_scale: Floats
    signal: SignalPath | None
    press_s: float = PRESS_S
    creep: CreepLaw = NO_CREEP

    @property
    def noises(self) -> Floats:
        """Return the standard deviation of the noise of each force [N], independent from sample to sample."""
        if self.signal is None:
            return np.array([self.reading.force_noise(force) for force in self.full_scale.tolist()])
        return np.array(self.signal.noises_N)

    @property
    def errors(self) -> Floats:
        """Return the standard uncertainty of each force without a touch [N]."""
        return self.noises if self.signal is None else np.array(self.signal.errors_N)

    @property
    def left_open(self) -> "LeftOpen":
        """Return what calibration leaves open, and what drifts after it, anywhere within its bound.

        A press is solved as one of `PRESS_S`; what times do to it is in inverse proportion to its duration.
        """
        tips = np.ones(len(self.full_scale))
        gains = {"gain": 0.01 * self.reading.gain_percent * tips}
        zeros = 0.0 * tips
        time_s = 0.0
        if self.signal is not None:
            gains["gain_drift"] = BOUNDED * 0.01 * np.array(self.signal.gain_drift_percent)
            zeros = BOUNDED * np.array(self.signal.zero_drift_N)
            time_s = BOUNDED * 1e-3 * self.signal.time_error_ms * PRESS_S / self.press_s
        return LeftOpen(
            zeros=zeros,
            gains=gains,
            springs=0.01 * self.reading.stiffness_percent * tips,
            time_s=time_s,
            on_plate=self.reading.calibrated_by == "plate",
            creep=self.creep.deviation(WEIGHED_AFTER_S, self.press_s),
        )


def by_heat(signal: SignalPath | None) -> dict[str, float]:
    """Return what the temperature of the leaves leaves open of any modulus [1].

    Leaves of another modulus have the same deflection under a force of another size. Deflections are read right, all
    forces are off by that fraction, and so is the modulus, which is proportional to forces.
    """
    if signal is None:
        return {}
    return {"modulus_drift": BOUNDED * 0.01 * signal.modulus_drift_percent}


def mean_sources(sources: Sequence[UncertaintySources]) -> UncertaintySources:
    """Return the root mean square of each source over readings that are equally likely."""

    def root_mean_square(values: Iterable[float]) -> float:
        return math.sqrt(math.fsum(value**2 for value in values) / len(sources))

    return UncertaintySources(
        contributions={
            name: root_mean_square(each.contributions[name] for each in sources) for name in sources[0].contributions
        },
        stiffness_slope=root_mean_square(each.stiffness_slope for each in sources),
        noise_slope=root_mean_square(each.noise_slope for each in sources),
        by_noise=root_mean_square(each.by_noise for each in sources),
    )


def noise_to_reach(limit: float, sources: UncertaintySources) -> float | None:
    """Return the noise [% of full scale] at which a standard uncertainty [1] is reached; None where it is without."""
    rest = sources.total**2 - sources.by_noise**2
    if rest >= limit**2:
        return None
    return math.sqrt(limit**2 - rest) / sources.noise_slope


def least_forces(errors: Floats, full_scale: Sequence[float] | Floats) -> Floats:
    """Return the forces below which tips count as off the fruit [N], (tips,).

    `errors` [N] are what each force may be off by without a touch, one standard deviation.
    """
    return np.maximum(LEAST_OVER_NOISE * errors, LEAST_OF_SCALE * np.array(full_scale))


@dataclass(frozen=True, kw_only=True)
class LeftOpen:
    """What is left open of the channels and springs of a design or of a unit, each a standard deviation, (tips,).

    `zeros` [N] are those of each force, `gains` [1] those of each channel by their cause. `springs` [1] are those of
    each stiffness, `time_s` is that of the time of each channel. Channels that were calibrated `on_plate` tell
    deflections. `creep` [1] is that of all stiffnesses together in a press, of leaves that creep. Deflections are read
    right, forces are off alike, and so is the modulus.
    """

    zeros: Floats
    gains: Mapping[str, Floats]
    springs: Floats
    time_s: float
    on_plate: bool
    creep: float

    def of_press(self, slopes: RiseSlopes) -> dict[str, float]:
        """Return what each cause leaves open of the modulus of a press [1], as a standard uncertainty.

        A zero may be off from the first sample on, or drift by as much during the press.
        """
        return {
            "zero_drift": _norm(np.hypot(slopes.zeros, slopes.drifts) * self.zeros),
            "times": self.time_s * _norm(np.array(slopes.times)),
            **self.of_channels(np.array(slopes.springs), np.array(slopes.gains)),
        }

    def of_moment(self, slopes: ReadingSlopes, forces: Floats) -> dict[str, float]:
        """Return what each cause leaves open of the modulus by the forces of one moment [N], as `of_press` does."""
        by_force = np.array(slopes.forces)
        return {
            "zero_drift": _norm(by_force * self.zeros),
            **self.of_channels(np.array(slopes.springs), by_force * forces),
        }

    def of_channels(self, springs: Floats, gains: Floats) -> dict[str, float]:
        """Return what springs and channels leave open of a modulus [1], of its slopes over both [1], (tips,)."""
        # Where a channel tells a deflection, the force of a spring that is stiffer than known is larger too.
        both = springs + (gains if self.on_plate else 0.0)
        of_gains = {cause: _norm(gains * deviations) for cause, deviations in self.gains.items()}
        of_creep = {"creep": self.creep} if self.creep else {}
        return {"stiffness": _norm(both * self.springs), **of_creep, **of_gains}


def uncertainty_sources(
    found: RiseReading, channels: Channels, samples: int, others: Mapping[str, float]
) -> UncertaintySources:
    """Return the sources of the reading of one press of so many samples, with `others` that are known already [1].

    Noise is that of a press of `PRESS_SAMPLES`.
    """
    slopes = found.slopes
    reading = channels.reading
    signal = channels.signal
    per_force = np.array(slopes.noise) * math.sqrt(samples / PRESS_SAMPLES)
    if signal is None:
        by_noise = {
            "noise_percent": _norm(per_force * 0.01 * reading.noise_percent * channels.full_scale),
            "noise_N": _norm(per_force) * reading.noise_N,
        }
    else:
        by_noise = {
            "readout_noise": _norm(per_force * signal.noise_N),
            "quantisation": _norm(per_force * signal.quanta_N) / math.sqrt(12.0),
        }
    return UncertaintySources(
        contributions={**by_noise, **channels.left_open.of_press(slopes), **by_heat(signal), **others},
        stiffness_slope=_norm(np.array(slopes.springs)),
        noise_slope=0.01 * _norm(per_force * channels.full_scale),
        by_noise=math.hypot(*by_noise.values()),
    )


def _norm(values: Floats) -> float:
    return float(np.linalg.norm(values))
