"""What the standard deviation of a reading is made of, each source by itself."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cad.design.reading import Reading
from pipeline.reading.read_out import ReadOut

Floats = NDArray[np.float64]

_STEP = 1e-4  # of a force, a stiffness or a tip's height of 1 mm, for slopes of the modulus


@dataclass(frozen=True, kw_only=True)
class UncertaintySources:
    """The standard deviation of the modulus by each source, as a share of it [1].

    `stiffness_slope` is the share per share by which each spring is off, apart from the others [1]; `noise_slope` that
    per cent of noise in forces, and in the heights that they tell [1/%].
    """

    shares: Mapping[str, float]
    stiffness_slope: float
    noise_slope: float

    @property
    def total(self) -> float:
        """Return the standard deviation of all sources together [1]: they scatter apart, so their squares add."""
        return math.hypot(*self.shares.values())


def uncertainty_sources(
    read_out: ReadOut, reading: Reading, forces: Floats, poses: Sequence[Mapping[str, float]]
) -> list[UncertaintySources]:
    """Return the sources at each modulus of a level sensor in the middle of its fruit.

    `forces` (moduli, samples, tips) [N] are those of its presses; `poses` are the shares of tilt, place and radius [1].
    The full scale of each channel is its force at the largest modulus. The heights of the tips are those that one
    reading on a flat hard plate tells: its noise is what it leaves. Raises ReadingError.
    """
    full_scale = forces.max(axis=(0, 1))
    return [_sources(read_out, reading, press, full_scale, pose) for press, pose in zip(forces, poses, strict=True)]


def noise_to_reach(limit: float, sources: UncertaintySources, reading: Reading) -> float | None:
    """Return the noise [% of full scale] at which a standard deviation [1] is reached; None where it is without."""
    rest = sources.total**2 - (sources.noise_slope * reading.noise_percent) ** 2
    if rest >= limit**2:
        return None
    return math.sqrt(limit**2 - rest) / sources.noise_slope


def _sources(
    read_out: ReadOut, reading: Reading, press: Floats, full_scale: Floats, poses: Mapping[str, float]
) -> UncertaintySources:
    """Return the sources at one modulus: noise, springs, gains and heights beside those of the poses."""
    E = read_out.modulus(press)
    tips, samples = range(press.shape[1]), range(len(press))

    def slope(reads: Callable[[float], float]) -> float:
        return (reads(_STEP) - reads(-_STEP)) / (2.0 * _STEP * E)

    def noisy(sample: int, tip: int) -> Callable[[float], float]:
        moved = np.zeros_like(press)
        moved[sample, tip] = press[-1, tip]
        return lambda step: read_out.modulus(press + step * moved)

    def amplified(tip: int) -> Callable[[float], float]:
        return lambda step: read_out.modulus(press * (1.0 + step * _only(tip, len(tips))))

    def stiffened(tip: int) -> Callable[[float], float]:
        return lambda step: read_out.with_springs(1.0 + step * _only(tip, len(tips))).modulus(press)

    def lengthened(tip: int) -> Callable[[float], float]:
        return lambda step: read_out.with_heights(step * _only(tip, len(tips))).modulus(press)

    noise = np.array([[slope(noisy(sample, tip)) for tip in tips] for sample in samples]) / press[-1]
    gains, springs, heights = (
        np.array([slope(kind(tip)) for tip in tips]) for kind in (amplified, stiffened, lengthened)
    )
    of_springs = float(np.linalg.norm(springs))
    of_noise = float(np.linalg.norm(noise * full_scale))
    zeroed = [float(np.linalg.norm(heights * read_out.zeroed_heights(one))) for one in (full_scale, np.ones(len(tips)))]
    shares = {
        "noise_percent": 0.01 * reading.noise_percent * of_noise,
        "noise_N": reading.noise_N * float(np.linalg.norm(noise)),
        "stiffness": 0.01 * reading.stiffness_percent * of_springs,
        "gain": 0.01 * reading.gain_percent * float(np.linalg.norm(gains)),
        "tip_height": math.hypot(0.01 * reading.noise_percent * zeroed[0], reading.noise_N * zeroed[1]),
        **poses,
    }
    return UncertaintySources(
        shares=shares, stiffness_slope=of_springs, noise_slope=0.01 * math.hypot(of_noise, zeroed[0])
    )


def _only(tip: int, count: int) -> Floats:
    return np.asarray(np.eye(count)[tip])
