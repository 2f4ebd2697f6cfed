"""The measurement model: how forces of the tips become a modulus, and the sensor that is pressed to find its errors."""

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from cad.arrays import Floats, rows_of
from cad.design.parameters import Design
from cad.design.reading import PRESS_S
from cad.fabrication.bridges import SignalPath
from cad.theory.contrast_law import ContrastLaw, ReadingError, contrast_weights, pair_law
from cad.theory.contrast_rise import RiseLaw, RiseReading, RisingPress
from pipeline.reading.poses import Placement
from pipeline.reading.read_out import LevelReading, corrected
from pipeline.reading.rise import fall_under_domes, rise_law
from pipeline.response.scene_press import scene_of
from solve.contact.domes.law import dome_contrast
from solve.contact.linear_response import travels
from solve.contact.poses import Pose, PoseForces, pose_forces
from solve.contact.scene import Scene, SidewaysGive
from solve.fruit.compliance import FruitCompliance

LEVEL_MODULI = 9
RISE_TRAVELS = 16  # samples of a press from which a rise is read
SKIN_MODULI = 25  # straight lines between them miss a skin by less than 1e-4
BEYOND = 1.25  # of the range, under a skin


@dataclass(frozen=True, kw_only=True)
class RiseModel:
    """Reads a whole press by the rise of its contrast, corrected by level readings where there are any."""

    law: RiseLaw
    level: tuple[LevelReading, ...] = ()
    method: ClassVar[str] = "rise of the contrast over a press"

    def reading(self, press: Floats, noises: Floats, least_forces: Floats | float = 0.0) -> RiseReading:
        """Return what forces [N], shape (samples, tips), tell; `noises` and `least_forces` as `RisingPress` has them.

        Samples are at even steps of the travel; what times do is that of a press by hand of `PRESS_S`. E is corrected
        by the level readings. Raises RiseError.
        """
        rising = RisingPress(self.law, noises, least_forces)
        for sample, elapsed in zip(press, intervals_by_hand(len(press)).tolist(), strict=True):
            rising.add(sample, elapsed)
        found = rising.reading()
        return replace(found, E=corrected(found.E, self.level))

    def modulus(self, press: Floats) -> float:
        """Return the modulus [MPa] of forces [N], shape (samples, tips); raises RiseError."""
        return self.reading(press, np.zeros(press.shape[1])).E


def intervals_by_hand(samples: int) -> Floats:
    """Return the time before each of some samples at even steps of the travel X [s], of a press by hand of `PRESS_S`.

    A hand slows to a stop: x = X (1 - (1 - t / T)^2).
    """
    left = np.sqrt(1.0 - np.linspace(0.0, 1.0, samples + 1))
    return np.asarray(PRESS_S * -np.diff(left))


def contrast_of(
    design: Design,
    contact: FruitCompliance,
    C: Floats,
    height_offsets: Sequence[float] = (),
    sideways: SidewaysGive | None = None,
) -> ContrastLaw:
    """Return the contrast of the tips of a design on its fruit; arguments as for `pressed_sensor`.

    That of a pair is right whatever the heights of its tips, which a press leaves out.
    """
    tips = design.tips
    if tips.tip_layout.is_pair:
        return pair_law(rows_of(C), 1.0 / contact.K_m_over_E())
    weights = contrast_weights(tips.places_mm, tips.springs)
    if tips.dome_radius_mm is None:
        fall = [design.fruit.fall_mm(x, y) for x, y in tips.places_mm]
        gaps = tuple(np.subtract(fall, tips.height_offset_mm).tolist())
        law = ContrastLaw(weights=weights, gaps=gaps, C=rows_of(C), S=rows_of(contact.S))
    else:
        law = _dome_law(scene_of(design, (), sideways), contact, C, weights)
    if height_offsets:
        law = replace(law, gaps=tuple(np.subtract(law.gaps, height_offsets).tolist()))
    return law


def _dome_law(scene: Scene, contact: FruitCompliance, C: Floats, weights: tuple[float, ...]) -> ContrastLaw:
    """Return the contrast of domes that stand level in the middle of the fruit, in the middle of the range of E."""
    tips = scene.tips
    middle = math.sqrt(min(scene.fruit.E_MPa) * scene.fruit.E_max_MPa)
    contrast = dome_contrast(scene, contact, C, middle)
    fall = fall_under_domes(scene.fruit, tips)
    return ContrastLaw(
        weights=weights,
        gaps=tuple((fall - tips.height_offset_mm).tolist()),
        C=rows_of(C + contrast.lean),
        S=rows_of(contrast.S),
        hertz=contrast.hertz,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Presses:
    """Presses at moduli [MPa] in placements: forces F [N], shape (moduli, placements, samples, tips).

    F is nan where a contact runs off the face of a dome. `flesh` [N], as F, is what Hencky's law of flesh adds under
    domes; `mean_pressure` [MPa], as F, is that of each contact; `error` [N], as F, is how far all forces are off where
    what is left open has one sign under all tips; `face_mm` (moduli, placements) is how wide the face of a dome must be
    to hold every contact of a press, 0 for other tips.
    """

    moduli: tuple[float, ...]
    placements: tuple[Placement, ...]
    F: Floats
    flesh: Floats
    mean_pressure: Floats
    error: Floats
    face_mm: Floats

    @property
    def full_scale(self) -> Floats:
        """Return the largest force of each channel [N], (tips,)."""
        return np.asarray(np.nanmax(self.F, axis=(0, 1, 2)))


@dataclass(frozen=True, kw_only=True)
class PressedSensor:
    """A design on its fruit with its springs: what every press of an error analysis needs.

    C (tips, tips) [mm/N] is their compliance, `contrast` that of its tips, `height_offsets` how far each tip stands
    before the foremost one [mm], none where all are level, `sideways` what forces that lean move domes, `signal` what
    reads the springs, if the design names it.
    """

    design: Design
    contact: FruitCompliance
    C: Floats
    contrast: ContrastLaw
    height_offsets: Sequence[float] = ()
    sideways: SidewaysGive | None = None
    signal: SignalPath | None = None

    @property
    def law(self) -> RiseLaw:
        """Return the law by which whole presses are read."""
        is_pair = self.design.tips.tip_layout.is_pair
        return RiseLaw(contrast=self.contrast) if is_pair else rise_law(self.design, self.contrast)

    @property
    def is_exact(self) -> bool:
        """Say whether the law holds all that a level press does: a pair of flat tips in the middle of bare flesh."""
        tips = self.design.tips
        in_the_middle = self.contact.stiffness_ratio() == 1.0
        is_bare = self.contact.skin is None
        return tips.tip_layout.is_pair and tips.tip_shape.has_flat_face and in_the_middle and is_bare

    def presses(self, moduli: Sequence[float], placements: Sequence[Placement], samples: int = RISE_TRAVELS) -> Presses:
        """Return the presses at moduli [MPa] in placements; raises as `pose_forces`."""
        travel = self.design.press.travel_mm
        x = travels(travel, samples).tolist()
        poses = []
        for E in moduli:
            for placement in placements:
                poses += [placement.pressed(E, each, each / travel) for each in x]
        forces = self.in_poses(poses)
        shape = (len(moduli), len(placements), samples)
        return Presses(
            moduli=tuple(moduli),
            placements=tuple(placements),
            F=forces.F.reshape(*shape, -1),
            flesh=forces.F_flesh.reshape(*shape, -1),
            mean_pressure=forces.mean_pressure.reshape(*shape, -1),
            error=forces.error_alike.reshape(*shape, -1),
            face_mm=forces.face_mm.reshape(shape).max(axis=2),
        )

    def in_poses(self, poses: Sequence[Pose]) -> PoseForces:
        """Return the forces of the tips in poses; raises as `pose_forces`."""
        scene = scene_of(self.design, self.height_offsets, self.sideways)
        return pose_forces(scene, self.contact, self.C, poses)


def pressed_sensor(
    design: Design,
    contact: FruitCompliance,
    C: Floats,
    height_offsets: Sequence[float] = (),
    sideways: SidewaysGive | None = None,
) -> PressedSensor:
    """Return the sensor of a design; C (tips, tips) [mm/N] is the compliance of the springs.

    `height_offsets` is how far each tip stands before the foremost one by its weight [mm], none where all are level.
    """
    return PressedSensor(
        design=design,
        contact=contact,
        C=C,
        contrast=contrast_of(design, contact, C, height_offsets, sideways),
        height_offsets=height_offsets,
        sideways=sideways,
    )


def rise_model(sensor: PressedSensor) -> RiseModel:
    """Return the model that reads whole presses of a sensor, with what shape and skin of its fruit add taken off."""
    model = RiseModel(law=sensor.law)
    return replace(model, level=level_readings(sensor, model))


def level_readings(sensor: PressedSensor, model: RiseModel) -> tuple[LevelReading, ...]:
    """Return what a model tells of presses of a level sensor at moduli, from the first touch to full travel.

    Under a skin they reach beyond the range of the fruit. There are none where the law of the sensor is exact.
    """
    if sensor.is_exact:
        return ()
    design = sensor.design
    moduli = _level_moduli(design) if sensor.contact.skin is None else _moduli_under_skin(design)
    rows = []
    for E, press in zip(moduli, _level_presses(sensor, moduli), strict=True):
        with suppress(ReadingError):  # a press too short for its rise
            rows.append(LevelReading(E_MPa=E, read_MPa=model.modulus(press)))
    return tuple(rows)


def _level_presses(sensor: PressedSensor, moduli: Sequence[float]) -> Floats:
    """Return the forces of level presses at moduli [MPa] to full travel [N], (moduli, samples, tips).

    Those of a pair of flat tips are in closed form, where cells would leave some parts in a thousand.
    """
    tips = sensor.design.tips
    if not (tips.tip_layout.is_pair and tips.tip_shape.has_flat_face):
        return np.asarray(sensor.presses(moduli, [Placement()]).F[:, 0])
    x = travels(sensor.design.press.travel_mm, RISE_TRAVELS)
    of_unit = [np.linalg.solve(sensor.C + sensor.contact.at(E).S / E, np.ones(2)) for E in moduli]
    return np.asarray(x[None, :, None] * np.array(of_unit)[:, None])


def _level_moduli(design: Design) -> list[float]:
    """Return moduli over the range of a fruit [MPa]."""
    return list(np.geomspace(min(design.fruit.E_MPa), design.largest_E_MPa, LEVEL_MODULI).tolist())


def _moduli_under_skin(design: Design) -> list[float]:
    """Return moduli over the range of a fruit and beyond [MPa]."""
    least, largest = min(design.fruit.E_MPa), design.largest_E_MPa
    return list(np.geomspace(least / BEYOND, largest * BEYOND, SKIN_MODULI).tolist())
