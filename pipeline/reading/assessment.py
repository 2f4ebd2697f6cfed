"""How good the readings of a design are over the poses that occur: bias, uncertainty with its sources, lift."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cad.design.parameters import Design
from cad.design.reading import Reading
from cad.quantity import Estimate, fault
from cad.theory.contrast_law import ReadingError
from pipeline.reading.lift import lift_tilt
from pipeline.reading.placed import Placed, occurring, press_of, read_moduli
from pipeline.reading.read_out import ReadOut, read_out_of
from pipeline.reading.sources import UncertaintySources, noise_to_reach, uncertainty_sources
from pipeline.stages.response import scene_of
from solve.contact.poses import Pose, pose_forces
from solve.fruit.compliance import FruitCompliance

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
    """

    method: str
    lift: Estimate
    moduli: tuple[ModulusReading, ...] = ()
    bias: Estimate | None = None
    uncertainty: Estimate | None = None
    noise_percent: float | None = None
    refused: str | None = None

    @property
    def worst_bias(self) -> ModulusReading:
        """Return the reading at the modulus of the largest bias."""
        return max(self.moduli, key=lambda one: abs(one.bias))

    @property
    def worst_uncertainty(self) -> ModulusReading:
        """Return the reading at the modulus of the largest uncertainty."""
        return max(self.moduli, key=lambda one: one.sources.total)


@dataclass(frozen=True, kw_only=True)
class Fruits:
    """A design on its fruit with its springs, C (tips, tips) [mm/N]: what every press of an assessment needs."""

    design: Design
    contact: FruitCompliance
    C: Floats
    read_out: ReadOut

    def presses(self, moduli: Sequence[float], places: Sequence[Placed]) -> tuple[Floats, Floats]:
        """Return forces [N], shape (moduli, places, samples, tips), and their relative errors [1] without the tips.

        Raises InputError where a contact runs off the face of a dome.
        """
        samples = self.read_out.samples
        poses = [pose for E in moduli for place in places for pose in press_of(place, E, self.design, samples)]
        solved = pose_forces(scene_of(self.design), self.contact, self.C, poses)
        self._check_faces(solved.face_mm, poses)
        shape = len(moduli), len(places), samples
        return solved.F.reshape(*shape, -1), solved.error.reshape(shape)

    def _check_faces(self, widths: Floats, poses: Sequence[Pose]) -> None:
        side, widest = self.design.tips.side_mm, int(widths.argmax())
        if widths[widest] > side:
            placed = Placed.of(poses[widest])
            bound = f"at least {widths[widest]:.3g} mm, which the contact needs at {poses[widest].E:.3g} MPa, {placed}"
            remedy = "take wider or rounder domes, or press less far"
            raise fault("tips.side_mm", side, "mm", bound, remedy)


def reading_assessment(design: Design, reading: Reading, contact: FruitCompliance, C: Floats) -> ReadingAssessment:
    """Return how good the readings of a design are; C (tips, tips) [mm/N] is the compliance of the springs.

    Raises InputError where the poses are outside the domain of contact or a contact runs off the face of a dome,
    SolveError when a solve is not exact.
    """
    fruits = Fruits(design=design, contact=contact, C=C, read_out=read_out_of(design, contact, C))
    moduli, places = read_moduli(design.fruit), list(occurring(design, reading))
    lift = lift_tilt(design, reading, contact, C)
    forces, errors = fruits.presses(moduli, places)
    biases, refused = _biases(fruits.read_out, moduli, places, forces)
    if np.isnan(biases).all(axis=1).any() or np.isnan(biases[:, 0]).any():
        return ReadingAssessment(method=fruits.read_out.method, lift=lift, refused=refused)
    found = _assessed(fruits, reading, places, biases, (forces[:, 0], errors[:, 0]), lift)
    return replace(found, refused=refused)


def _assessed(
    fruits: Fruits,
    reading: Reading,
    places: Sequence[Placed],
    biases: Floats,
    level: tuple[Floats, Floats],
    lift: Estimate,
) -> ReadingAssessment:
    """Return the assessment of biases (moduli, places) [1]; `level` are forces and errors of a level press."""
    moduli = read_moduli(fruits.design.fruit)
    known = _modulus_errors(fruits, moduli, *level)
    spread = uncertainty_sources(fruits.read_out, reading, level[0], _pose_shares(biases, places))
    rows = tuple(_at_modulus(E, biases[i], places, spread[i]) for i, E in enumerate(moduli))
    widest = int(np.argmax([one.total for one in spread]))
    largest = int(np.nanmax(np.abs(biases), axis=1).argmax())
    return ReadingAssessment(
        method=fruits.read_out.method,
        lift=lift,
        moduli=rows,
        bias=Estimate(abs(rows[largest].bias), float(known[largest])),
        uncertainty=Estimate(spread[widest].total, float(known[widest]) * spread[widest].total),
        noise_percent=noise_to_reach(NOISE_LIMIT, spread[widest], reading),
    )


def _biases(
    read_out: ReadOut, moduli: Sequence[float], places: Sequence[Placed], forces: Floats
) -> tuple[Floats, str | None]:
    """Return E read / E - 1 (moduli, places), nan where there is no reading, and in words where and why there is none.

    `forces` (moduli, places, samples, tips) [N].
    """
    biases, why = np.full((len(moduli), len(places)), np.nan), ""
    for i, E in enumerate(moduli):
        for j, place in enumerate(places):
            try:
                biases[i, j] = read_out.modulus(forces[i, j]) / E - 1.0
            except ReadingError as refused:
                why = why or f"as at {E:.3g} MPa, {place}: {refused}"
    count = int(np.isnan(biases).sum())
    return biases, f"{count} of {biases.size} poses have no reading, {why}" if count else None


def _at_modulus(E: float, biases: Floats, places: Sequence[Placed], sources: UncertaintySources) -> ModulusReading:
    worst = int(np.nanargmax(np.abs(biases)))
    return ModulusReading(E=E, bias=float(biases[worst]), worst=places[worst], sources=sources)


def _modulus_errors(fruits: Fruits, moduli: Sequence[float], forces: Floats, errors: Floats) -> Floats:
    """Return by how much a modulus must move to move the forces at full travel as their errors may [1], (moduli,)."""
    moved, _ = fruits.presses([E * (1.0 + _STEP) for E in moduli], [Placed()])
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
