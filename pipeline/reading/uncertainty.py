"""What the standard deviation of a reading is made of, each source by itself."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from cad.arrays import Floats
from cad.design.reading import Reading
from cad.fabrication.bridges import SignalPath
from pipeline.reading.measurement import MeasurementModel

_PLATE_READINGS = 100  # on a hard plate nothing moves: the mean of as many readings is taken
_STEP = 1e-4  # of a force, a stiffness or a tip's height of 1 mm, for slopes of the modulus


@dataclass(frozen=True, kw_only=True)
class UncertaintySources:
    """The relative standard deviation of the modulus by each source [1].

    `stiffness_slope` is that per relative error of each spring, apart from the others [1]; `noise_slope` that per cent
    of noise in forces, and in the heights that they give [1/%]; `by_noise` what noise in forces makes in all [1].
    """

    contributions: Mapping[str, float]
    stiffness_slope: float
    noise_slope: float
    by_noise: float

    @property
    def total(self) -> float:
        """Return the standard deviation of all sources together [1]: they scatter apart, so their squares add."""
        return math.hypot(*self.contributions.values())


def force_errors(reading: Reading, full_scale: Floats, signal: SignalPath | None) -> Floats:
    """Return what each force may be off by without a touch [N], (tips,), one sigma: by the read-out, or as is asked.

    The noise that a reading asks for is of the full scale [N] of each channel.
    """
    if signal is not None:
        return np.array(signal.errors_N)
    return np.array([reading.force_noise(force) for force in full_scale.tolist()])


def noise_to_reach(limit: float, sources: UncertaintySources) -> float | None:
    """Return the noise [% of full scale] at which a standard deviation [1] is reached; None where it is without."""
    rest = sources.total**2 - sources.by_noise**2
    if rest >= limit**2:
        return None
    return math.sqrt(limit**2 - rest) / sources.noise_slope


def uncertainty_sources(
    model: MeasurementModel,
    reading: Reading,
    press: Floats,
    full_scale: Floats,
    poses: Mapping[str, float],
    signal: SignalPath | None = None,
) -> UncertaintySources:
    """Return the sources at one modulus of a level sensor in the middle of its fruit.

    `press` (samples, tips) [N] are its forces; `poses` are the contributions of tilt, position and radius [1].
    `full_scale` (tips,) [N] is the largest force of each channel. The heights of the tips are those that the mean of a
    hundred readings on a flat hard plate gives: its noise is what is left. Raises ReadingError.
    """
    E = model.modulus(press)
    tips = press.shape[1]

    def slopes(modulus_at: Callable[[Floats], float]) -> Floats:
        """Return the relative change of the modulus per unit of what is moved at each tip, (tips,)."""
        moves = [modulus_at(step) - modulus_at(-step) for step in _STEP * np.eye(tips)]
        return np.array(moves) / (2.0 * _STEP * E)

    of_samples = []  # per force on each tip in each sample [1/N]
    for sample in np.eye(len(press))[:, :, None]:

        def with_noise(step: Floats, sample: Floats = sample) -> float:
            return model.modulus(press + sample * step * press[-1])

        of_samples.append(slopes(with_noise) / press[-1])
    noise = np.linalg.norm(np.array(of_samples), axis=0)
    springs = slopes(lambda step: model.with_springs(1.0 + step).modulus(press))
    gains = slopes(lambda step: model.modulus(press * (1.0 + step)))
    # Where a channel tells a deflection, the force of a spring that is stiffer than known is larger too.
    calibrated = springs + gains if reading.calibrated_by == "plate" else springs
    heights = np.abs(slopes(lambda step: model.with_heights(step).modulus(press)))
    # A hard plate gives heights by the deflection of each spring under its force.
    zeroed = heights * np.diag(model.C) / math.sqrt(_PLATE_READINGS)  # per noise in forces [1/N]

    noise_slope = 0.01 * math.hypot(_norm(noise * full_scale), _norm(zeroed * full_scale))
    if signal is None:
        by_percent = 0.01 * reading.noise_percent * full_scale
        by_force = np.full(tips, reading.noise_N)
        by_signal = {"noise_percent": _norm(noise * by_percent), "noise_N": _norm(noise * by_force)}
        by_noise = noise_slope * reading.noise_percent
    else:
        by_percent = np.array(signal.noise_N)
        by_force = np.array(signal.quanta_N) / math.sqrt(12.0)  # JCGM 100:2008, F.2.2.1
        by_signal = _signal_sources(signal, noise, np.sum(of_samples, axis=0), gains)
        by_noise = math.hypot(_norm(noise * by_percent), _norm(zeroed * by_percent))
    contributions = {
        **by_signal,
        "stiffness": 0.01 * reading.stiffness_percent * _norm(calibrated),
        "gain": 0.01 * reading.gain_percent * _norm(gains),
        "tip_height": math.hypot(_norm(zeroed * by_percent), _norm(zeroed * by_force)),
    }
    return UncertaintySources(
        contributions={**contributions, **poses},
        stiffness_slope=_norm(springs),
        noise_slope=noise_slope,
        by_noise=by_noise,
    )


def _signal_sources(signal: SignalPath, noise: Floats, offsets: Floats, gains: Floats) -> dict[str, float]:
    """Return what a read-out adds [1]: `noise` and `offsets` are slopes of the modulus [1/N], `gains` [1], (tips,).

    A drift lies anywhere within its bound: its standard deviation is that over the root of three (JCGM 100:2008,
    4.3.7). A zero is alike in all samples of a press. Leaves of another modulus give as before under a force of another
    size: deflections are read right, all forces are off by that share, and so is the modulus, which is one of forces.
    """
    bounded = 1.0 / math.sqrt(3.0)
    return {
        "readout_noise": _norm(noise * signal.noise_N),
        "quantisation": _norm(noise * signal.quanta_N) / math.sqrt(12.0),
        "zero_drift": bounded * _norm(offsets * signal.zero_drift_N),
        "gain_drift": bounded * 0.01 * _norm(gains * signal.gain_drift_percent),
        "modulus_drift": bounded * 0.01 * signal.modulus_drift_percent,
        "self_heating": bounded * 0.01 * signal.self_heating_percent,
    }


def _norm(values: Floats) -> float:
    return float(np.linalg.norm(values))
