"""What the standard deviation of a reading is made of, each source by itself."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cad.design.reading import Reading
from pipeline.reading.read_out import ReadOut

Floats = NDArray[np.float64]

_PLATE_READINGS = 100  # on a hard plate nothing moves: the mean of as many readings is taken
_STEP = 1e-4  # of a force, a stiffness or a tip's height of 1 mm, for slopes of the modulus


@dataclass(frozen=True, kw_only=True)
class UncertaintySources:
    """The standard deviation of the modulus by each source, as a share of it [1].

    `stiffness_slope` is the share per share by which each spring is off, apart from the others [1]; `noise_slope` that
    per cent of noise in forces, and in the heights that they tell [1/%]; `contrast_slope` that per mm by which high
    tips stand out before low ones, 0 where no height matters [1/mm].
    """

    shares: Mapping[str, float]
    stiffness_slope: float
    noise_slope: float
    contrast_slope: float

    @property
    def total(self) -> float:
        """Return the standard deviation of all sources together [1]: they scatter apart, so their squares add."""
        return math.hypot(*self.shares.values())


def uncertainty_sources(
    read_out: ReadOut, reading: Reading, forces: Floats, full_scale: Floats, poses: Sequence[Mapping[str, float]]
) -> list[UncertaintySources]:
    """Return the sources at each modulus of a level sensor in the middle of its fruit.

    `forces` (moduli, samples, tips) [N] are those of its presses; `poses` are the shares of tilt, place and radius [1].
    `full_scale` (tips,) [N] is the largest force of each channel. The heights of the tips are those that the mean of a
    hundred readings on a flat hard plate tells: its noise is what is left. Raises ReadingError.
    """
    return [_sources(read_out, reading, press, full_scale, pose) for press, pose in zip(forces, poses, strict=True)]


def force_noises(reading: Reading, full_scale: Floats) -> Floats:
    """Return the standard deviation of the noise of each channel [N] from its full scale [N], (tips,)."""
    return np.array([reading.force_noise(force) for force in full_scale.tolist()])


def noise_to_reach(limit: float, sources: UncertaintySources, reading: Reading) -> float | None:
    """Return the noise [% of full scale] at which a standard deviation [1] is reached; None where it is without."""
    rest = sources.total**2 - (sources.noise_slope * reading.noise_percent) ** 2
    if rest >= limit**2:
        return None
    return math.sqrt(limit**2 - rest) / sources.noise_slope


@dataclass(frozen=True)
class _Slopes:
    """The share by which E moves, for each tip: per force [1/N], per share of its spring and gain [1], per mm."""

    noise: Floats
    springs: Floats
    gains: Floats
    heights: Floats


def _sources(
    read_out: ReadOut, reading: Reading, press: Floats, full_scale: Floats, poses: Mapping[str, float]
) -> UncertaintySources:
    """Return the sources at one modulus: noise, springs, gains and heights beside those of the poses."""
    slopes = _Slopes(
        noise=np.linalg.norm(_noise_slopes(read_out, press), axis=0),
        springs=_slopes(read_out, press, _with_springs),
        gains=_slopes(read_out, press, _with_gains),
        heights=np.abs(_slopes(read_out, press, _with_heights)),
    )
    zeroed = slopes.heights * read_out.gives / math.sqrt(_PLATE_READINGS)
    shares = {**_shares(slopes, zeroed, reading, full_scale), **poses}
    return UncertaintySources(
        shares=shares,
        stiffness_slope=_size(slopes.springs),
        noise_slope=0.01 * math.hypot(_size(slopes.noise * full_scale), _size(zeroed * full_scale)),
        # The weights of the high tips add up to one, as those of the low ones do.
        contrast_slope=0.5 * float(slopes.heights.sum()),
    )


def _shares(slopes: _Slopes, zeroed: Floats, reading: Reading, full_scale: Floats) -> dict[str, float]:
    """Return the share of each channel's source; `zeroed` are those of the heights per noise [1/N]."""
    by_percent, by_force = ((0.01 * reading.noise_percent) * full_scale, np.full(len(full_scale), reading.noise_N))
    return {
        "noise_percent": _size(slopes.noise * by_percent),
        "noise_N": _size(slopes.noise * by_force),
        "stiffness": 0.01 * reading.stiffness_percent * _size(slopes.springs),
        "gain": 0.01 * reading.gain_percent * _size(slopes.gains),
        "tip_height": math.hypot(_size(zeroed * by_percent), _size(zeroed * by_force)),
    }


Moved = Callable[[ReadOut, Floats, Floats], float]


def _slopes(read_out: ReadOut, press: Floats, moved: Moved) -> Floats:
    """Return the share by which the modulus moves per unit of what is moved at each tip, (tips,)."""
    E = read_out.modulus(press)
    steps = _STEP * np.eye(press.shape[1])
    moves = [moved(read_out, press, step) - moved(read_out, press, -step) for step in steps]
    return np.array(moves) / (2.0 * _STEP * E)


def _with_springs(read_out: ReadOut, press: Floats, step: Floats) -> float:
    return read_out.with_springs(1.0 + step).modulus(press)


def _with_gains(read_out: ReadOut, press: Floats, step: Floats) -> float:
    return read_out.modulus(press * (1.0 + step))


def _with_heights(read_out: ReadOut, press: Floats, step: Floats) -> float:
    return read_out.with_heights(step).modulus(press)


def _noise_slopes(read_out: ReadOut, press: Floats) -> Floats:
    """Return the share by which the modulus moves per force on each tip in each sample [1/N], (samples, tips)."""
    slopes = []
    for sample in np.eye(len(press))[:, :, None]:

        def moved(read_out: ReadOut, press: Floats, step: Floats, sample: Floats = sample) -> float:
            return read_out.modulus(press + sample * step * press[-1])

        slopes.append(_slopes(read_out, press, moved) / press[-1])
    return np.array(slopes)


def _size(shares: Floats) -> float:
    return float(np.linalg.norm(shares))
