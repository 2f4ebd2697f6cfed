"""How good the readings of a design are over the poses that occur: bias, uncertainty with its sources, lift."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cad.design.reading import LEAST_OVER_NOISE, Reading
from cad.quantity import Estimate
from cad.theory.contrast_law import ReadingError
from pipeline.reading.lift import lift_tilt
from pipeline.reading.placed import Placed, occurring, read_moduli
from pipeline.reading.pressed_sensor import PressedSensor, Presses
from pipeline.reading.read_out import ReadOut
from pipeline.reading.sources import UncertaintySources, force_noises, noise_to_reach, uncertainty_sources
from pipeline.storage.plain import first_largest

Floats = NDArray[np.float64]

NOISE_LIMIT = 0.1  # of the modulus: the uncertainty for which the noise is stated
_STEP = 1e-3  # of the modulus, by which forces are moved to weigh their errors


@dataclass(frozen=True, kw_only=True)
class ModulusReading:
    """What is read at one modulus [MPa]: the largest error over all poses [1], where it is, and its spread."""

    E: float
    bias: float
    worst: Placed
    sources: UncertaintySources


@dataclass(frozen=True, kw_only=True)
class ReadingAssessment:
    """How good readings are: at each modulus, the worst bias and uncertainty [1], the tilt of first lift [deg].

    `refused` says in how many poses there is no reading, and why, None where there always is: bias and uncertainty are
    those of the others, None where a level press has no reading.
    `noise_percent` is the noise of the forces at which the uncertainty reaches 10 %, None where it does without noise.
    `full_scale` is the largest force of each channel over all poses [N], (tips,).
    """

    method: str
    lift: Estimate
    moduli: tuple[ModulusReading, ...] = ()
    bias: Estimate | None = None
    uncertainty: Estimate | None = None
    noise_percent: float | None = None
    refused: str | None = None
    full_scale: tuple[float, ...] | None = None

    @property
    def worst_bias(self) -> ModulusReading:
        """Return the reading at the modulus of the largest bias."""
        return self.moduli[_largest_bias([one.bias for one in self.moduli])]

    @property
    def worst_uncertainty(self) -> ModulusReading:
        """Return the reading at the modulus of the largest uncertainty."""
        return self.moduli[first_largest(one.sources.total for one in self.moduli)]


def reading_assessment(sensor: PressedSensor, reading: Reading) -> ReadingAssessment:
    """Return how good the readings of a sensor are.

    Raises InputError where the poses are outside the domain of contact or a contact runs off the face of a dome,
    SolveError when a solve is not exact.
    """
    lift = lift_tilt(sensor, reading)
    fruit, places = sensor.design.fruit, tuple(occurring(sensor.design, reading))
    presses = sensor.presses(read_moduli(fruit), places)
    biases, refused = _biases(sensor.read_out, presses, LEAST_OVER_NOISE * force_noises(reading, presses.full_scale))
    if np.isnan(biases).all(axis=1).any() or np.isnan(biases[:, 0]).any():
        return ReadingAssessment(method=sensor.read_out.method, lift=lift, refused=refused)
    found = _assessed(sensor, reading, presses, biases, lift)
    return replace(found, refused=refused, full_scale=tuple(presses.full_scale.tolist()))


def _assessed(
    sensor: PressedSensor, reading: Reading, presses: Presses, biases: Floats, lift: Estimate
) -> ReadingAssessment:
    """Return the assessment of biases (moduli, places) [1], those of `presses`, the first of which are level."""
    moduli, level = presses.moduli, presses.F[:, 0]
    known = _modulus_errors(sensor, moduli, level, presses.error[:, 0])
    poses = _pose_shares(biases, presses.places)
    spread = uncertainty_sources(sensor.read_out, reading, level, presses.full_scale, poses)
    rows = tuple(_at_modulus(E, biases[i], presses.places, spread[i]) for i, E in enumerate(moduli))
    widest = first_largest(one.total for one in spread)
    largest = _largest_bias([row.bias for row in rows])
    return ReadingAssessment(
        method=sensor.read_out.method,
        lift=lift,
        moduli=rows,
        bias=Estimate(max(abs(row.bias) for row in rows), float(known[largest])),
        uncertainty=Estimate(spread[widest].total, float(known[widest]) * spread[widest].total),
        noise_percent=noise_to_reach(NOISE_LIMIT, spread[widest], reading),
    )


def _biases(read_out: ReadOut, presses: Presses, least: Floats) -> tuple[Floats, str | None]:
    """Return E read / E - 1 (moduli, places), nan where there is no reading, and in words where and why there is none.

    A force that is not over the `least` (tips,) [N] counts as none.
    """
    biases, why = np.full(presses.F.shape[:2], np.nan), ""
    told = np.where(least < presses.F, presses.F, 0.0)
    for i, E in enumerate(presses.moduli):
        for j, place in enumerate(presses.places):
            try:
                biases[i, j] = read_out.modulus(told[i, j]) / E - 1.0
            except ReadingError as refused:
                why = why or f"as at {E:.3g} MPa, {place}: {refused}"
    count = int(np.isnan(biases).sum())
    return biases, f"{count} of {biases.size} poses have no reading, {why}" if count else None


def _at_modulus(E: float, biases: Floats, places: Sequence[Placed], sources: UncertaintySources) -> ModulusReading:
    worst = _largest_bias(biases.tolist())
    return ModulusReading(E=E, bias=float(biases[worst]), worst=places[worst], sources=sources)


def _largest_bias(biases: Sequence[float]) -> int:
    """Return the place of the first of the largest biases [1]: less one, they keep the round-off of E read / E."""
    return first_largest(map(abs, biases), least=1.0)


def _modulus_errors(sensor: PressedSensor, moduli: Sequence[float], forces: Floats, errors: Floats) -> Floats:
    """Return by how much a modulus must move to move the forces at full travel as their errors may [1], (moduli,)."""
    moved = sensor.presses([E * (1.0 + _STEP) for E in moduli], [Placed()]).F
    change = np.abs(moved[:, 0, -1] / forces[:, -1] - 1.0).max(axis=1)
    return np.asarray(_STEP * errors[:, -1] / change)


def _pose_shares(biases: Floats, places: Sequence[Placed]) -> list[dict[str, float]]:
    """Return the root mean square of the bias [1] over tilts, over places and over radii, for each modulus."""
    kinds = {
        "tilt": [place.tilted for place in places],
        "off_centre": [place.off_centre for place in places],
        "radius": [place.other_fruit for place in places],
    }
    return [{name: _root_mean_square(row[chosen]) for name, chosen in kinds.items()} for row in biases]


def _root_mean_square(values: Floats) -> float:
    """Return the root mean square of numbers, those that are nan left out; 0 for none."""
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else 0.0
