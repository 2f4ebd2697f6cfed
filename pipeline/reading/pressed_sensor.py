"""A sensor on its fruit, and what it shows in many poses."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cad.design.parameters import Design
from cad.quantity import validation_error
from pipeline.reading.placed import Placed, press_of
from pipeline.reading.read_out import ReadOut, read_out_of
from pipeline.response.scene_press import scene_of
from pipeline.storage.plain import first_largest
from solve.contact.poses import Pose, PoseForces, pose_forces
from solve.fruit.compliance import FruitCompliance

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Presses:
    """Presses at moduli [MPa] in places: forces F [N], shape (moduli, places, samples, tips).

    `error` [1], (moduli, places, samples), is the largest relative error of a force.
    """

    moduli: tuple[float, ...]
    places: tuple[Placed, ...]
    F: Floats
    error: Floats

    @property
    def full_scale(self) -> Floats:
        """Return the largest force of each channel [N], (tips,)."""
        return np.asarray(np.nanmax(self.F, axis=(0, 1, 2)))


@dataclass(frozen=True, kw_only=True)
class PressedSensor:
    """A design on its fruit with its springs: what every press of an assessment needs.

    C (tips, tips) [mm/N] is their compliance, `ahead` how far each tip stands before the foremost one [mm], if any.
    """

    design: Design
    contact: FruitCompliance
    C: Floats
    read_out: ReadOut
    ahead: Sequence[float] = ()

    def presses(self, moduli: Sequence[float], places: Sequence[Placed]) -> Presses:
        """Return the presses at moduli [MPa] in places.

        Raises InputError where a contact runs off the face of a dome.
        """
        samples = self.read_out.samples
        poses = [pose for E in moduli for place in places for pose in press_of(place, E, self.design, samples)]
        solved = self.in_poses(poses)
        self._check_faces(solved.face_mm, poses)
        shape = len(moduli), len(places), samples
        return Presses(
            moduli=tuple(moduli),
            places=tuple(places),
            F=solved.F.reshape(*shape, -1),
            error=solved.error.reshape(shape),
        )

    def in_poses(self, poses: Sequence[Pose]) -> PoseForces:
        """Return the forces of the tips in poses; raises as `pose_forces`."""
        return pose_forces(scene_of(self.design, self.ahead), self.contact, self.C, poses)

    def _check_faces(self, widths: Floats, poses: Sequence[Pose]) -> None:
        side, widest = self.design.tips.side_mm, first_largest(widths.tolist())
        if widths[widest] > side:
            placed = Placed.of(poses[widest])
            bound = f"at least {widths[widest]:.3g} mm, which the contact needs at {poses[widest].E:.3g} MPa, {placed}"
            remedy = "take wider or rounder domes, or press less far"
            raise validation_error("tips.side_mm", side, "mm", bound, remedy)


def pressed_sensor(design: Design, contact: FruitCompliance, C: Floats, ahead: Sequence[float] = ()) -> PressedSensor:
    """Return the sensor of a design with its read-out; C (tips, tips) [mm/N] is the compliance of the springs.

    `ahead` is how far each tip stands before the foremost one by its weight [mm], none where all are level.
    """
    read_out = read_out_of(design, contact, C, ahead)
    return PressedSensor(design=design, contact=contact, C=C, read_out=read_out, ahead=ahead)
