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
from cad.theory.contrast_law import (
    ContrastLaw,
    Matrix,
    ReadingError,
    contrast_weights,
    pair_law,
    ratio_modulus,
    read_modulus,
)
from cad.theory.contrast_rise import RiseLaw, RiseReading, RisingPress, exact_modulus
from pipeline.reading.poses import Placement
from pipeline.reading.read_out import LevelReading, corrected
from pipeline.reading.rise import fall_under_domes, rise_law
from pipeline.response.scene_press import scene_of
from solve.contact.domes.law import dome_contrast
from solve.contact.linear_response import travels
from solve.contact.poses import Pose, PoseForces, pose_forces
from solve.contact.scene import Scene, SidewaysGive
from solve.fruit.compliance import FruitCompliance

PRESS_TRAVELS = 8  # samples of a press from which a line is read
LEVEL_MODULI = 9
RISE_TRAVELS = 16  # samples of a press from which a rise is read
SKIN_MODULI = 25  # straight lines between them miss a skin by less than 1e-4
BEYOND = 1.25  # of the range, under a skin


@dataclass(frozen=True, kw_only=True)
class ContrastModel:
    """Reads the last sample of a press by the contrast of its tips, corrected by level readings where there are any."""

    law: ContrastLaw
    level: tuple[LevelReading, ...] = ()
    method: str = "contrast of one reading"
    samples: int = 1

    def modulus(self, press: Floats) -> float:
        """Return the modulus [MPa] of forces [N], shape (samples, tips); raises ReadingError."""
        return corrected(read_modulus(self.law, press[-1].tolist()), self.level)


@dataclass(frozen=True, kw_only=True)
class LineModel:
    """Reads a whole press by the straight line through its samples; how the tips are off level drops out.

    C [mm/N] is the compliance of the springs, shape (tips, tips). Readings are corrected by level ones where there are
    any.
    """

    C: Matrix
    own_less_other: float
    level: tuple[LevelReading, ...] = ()
    method: str = "straight line through the samples of a press"
    samples: int = PRESS_TRAVELS

    def modulus(self, press: Floats) -> float:
        """Return the modulus [MPa] of forces [N], shape (samples, tips); raises ReadingError."""
        return corrected(exact_modulus(pair_law(self.C, self.own_less_other), press), self.level)


MeasurementModel = ContrastModel | LineModel


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


def measurement_model(
    design: Design,
    contact: FruitCompliance,
    C: Floats,
    height_offsets: Sequence[float] = (),
    sideways: SidewaysGive | None = None,
) -> MeasurementModel:
    """Return the measurement model of a design on its fruit; C (tips, tips) [mm/N] is the compliance of the springs.

    `height_offsets` is how far each tip stands before the foremost one by its weight [mm].
    """
    tips = design.tips
    if tips.tip_layout.is_pair:
        return LineModel(C=rows_of(C), own_less_other=1.0 / contact.K_m_over_E())
    weights = contrast_weights(tips.places_mm, tips.springs)
    if tips.dome_radius_mm is None:
        fall = [design.fruit.fall_mm(x, y) for x, y in tips.places_mm]
        gaps = tuple(np.subtract(fall, tips.height_offset_mm).tolist())
        law = ContrastLaw(weights=weights, gaps=gaps, C=rows_of(C), S=rows_of(contact.S))
    else:
        law = _dome_law(scene_of(design, (), sideways), contact, C, weights)
    if height_offsets:
        law = replace(law, gaps=tuple(np.subtract(law.gaps, height_offsets).tolist()))
    return ContrastModel(law=law)


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

    C (tips, tips) [mm/N] is their compliance, `height_offsets` how far each tip stands before the foremost one [mm],
    none where all are level, `sideways` what forces that lean move domes, `signal` what reads the springs, if the
    design names it.
    """

    design: Design
    contact: FruitCompliance
    C: Floats
    model: MeasurementModel
    height_offsets: Sequence[float] = ()
    sideways: SidewaysGive | None = None
    signal: SignalPath | None = None

    def presses(self, moduli: Sequence[float], placements: Sequence[Placement], samples: int | None = None) -> Presses:
        """Return the presses at moduli [MPa] in placements, of as many samples as the model needs.

        Raises as `pose_forces`.
        """
        samples = samples or self.model.samples
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
    """Return the sensor of a design with its measurement model; C (tips, tips) [mm/N] is the compliance of the springs.

    `height_offsets` is how far each tip stands before the foremost one by its weight [mm], none where all are level.
    """
    model = measurement_model(design, contact, C, height_offsets, sideways)
    sensor = PressedSensor(
        design=design, contact=contact, C=C, model=model, height_offsets=height_offsets, sideways=sideways
    )
    off_centre_pair = isinstance(model, LineModel) and contact.stiffness_ratio() != 1.0
    if contact.skin is None and not off_centre_pair:
        return sensor
    return replace(sensor, model=replace(model, level=level_readings(sensor)))


def level_readings(sensor: PressedSensor) -> tuple[LevelReading, ...]:
    """Return the readings of a level sensor at moduli where all tips touch on their faces and tell a modulus.

    Under a skin and for a pair they reach beyond the range of the fruit; those of a flat pair are of its forces in
    closed form, as under a skin and off the middle of the fruit the flesh gives otherwise than its line takes it.
    """
    model = sensor.model
    contact = sensor.contact
    moduli = _moduli_under_skin(sensor.design)
    rows = []
    if isinstance(model, LineModel) and sensor.design.tips.tip_shape.has_flat_face:
        for E in moduli:
            F = np.linalg.solve(sensor.C + contact.at(E).S / E, [1.0, 1.0])
            read = ratio_modulus(model.C, model.own_less_other, F.tolist())
            rows.append(LevelReading(E_MPa=E, read_MPa=read))
        return tuple(rows)
    if contact.skin is None:
        moduli = _level_moduli(sensor.design)
    forces = sensor.presses(moduli, [Placement()]).F
    for E, press in zip(moduli, forces[:, 0], strict=True):
        if np.nanmin(press[-1]) > 0.0 and np.isfinite(press).all():
            with suppress(ReadingError):  # the springs take nearly all of the travel
                rows.append(LevelReading(E_MPa=E, read_MPa=model.modulus(press)))
    return tuple(rows)


def rise_model(sensor: PressedSensor) -> RiseModel:
    """Return the model that reads whole presses of a sensor, with what shape and skin of its fruit add taken off."""
    model = RiseModel(law=sensor_rise_law(sensor))
    return replace(model, level=rise_level_readings(sensor, model))


def sensor_rise_law(sensor: PressedSensor) -> RiseLaw:
    """Return the law by which whole presses of a sensor are read."""
    if isinstance(sensor.model, ContrastModel):
        return rise_law(sensor.design, sensor.model.law)
    return RiseLaw(contrast=pair_law(sensor.model.C, sensor.model.own_less_other))


def rise_level_readings(sensor: PressedSensor, model: RiseModel) -> tuple[LevelReading, ...]:
    """Return what the rise of whole presses of a level sensor tells at moduli, from the first touch to full travel.

    Under a skin they reach beyond the range of the fruit.
    """
    design = sensor.design
    moduli = _level_moduli(design) if sensor.contact.skin is None else _moduli_under_skin(design)
    forces = sensor.presses(moduli, [Placement()], RISE_TRAVELS).F
    rows = []
    for E, press in zip(moduli, forces[:, 0], strict=True):
        with suppress(ReadingError):  # a press too short for its rise
            rows.append(LevelReading(E_MPa=E, read_MPa=model.modulus(press)))
    return tuple(rows)


def _level_moduli(design: Design) -> list[float]:
    """Return moduli over the range of a fruit [MPa]."""
    return list(np.geomspace(min(design.fruit.E_MPa), design.largest_E_MPa, LEVEL_MODULI).tolist())


def _moduli_under_skin(design: Design) -> list[float]:
    """Return moduli over the range of a fruit and beyond [MPa]."""
    least, largest = min(design.fruit.E_MPa), design.largest_E_MPa
    return list(np.geomspace(least / BEYOND, largest * BEYOND, SKIN_MODULI).tolist())
