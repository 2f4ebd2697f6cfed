"""The sensor: a design on its fruit with its springs, which is pressed, read and judged."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pipeline.reading.poses import Placement
from pipeline.reading.rise import fall_under_domes, rise_law
from pipeline.response.scene_press import scene_of
from pipeline.springs.fitted_springs import FittedSprings, springs_to_read, tip_height_offsets
from pipeline.springs.sizing import SpringSizing
from sensor.arrays import Floats, rows_of
from sensor.design.parameters import Design
from sensor.design.reading import LARGEST_TOUCH_FRACTION, LEAST_OVER_NOISE
from sensor.design.signal_path import SignalPath, signal_path
from sensor.record import Record
from sensor.theory.contrast_law import ContrastLaw, ReadingError, contrast_weights, pair_law
from sensor.theory.contrast_rise import FEWEST, LARGEST_BY_TIME, RiseLaw, read_rise, rise_of
from solve.contact.domes.law import dome_contrast
from solve.contact.linear_response import travels
from solve.contact.pose_forces import Pose, PoseForces, pose_forces
from solve.contact.scene import Scene
from solve.fruit.compliance import FruitCompliance

RISE_TRAVELS = 16  # samples of a solved press from which the rise is read
_SAMPLES_BY_HAND = 60  # samples of a press by hand, interpolated in these


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SampledPresses(Record):
    """Presses at moduli [MPa] in placements: forces F [N], shape (moduli, placements, samples, tips).

    F is nan if a contact leaves the face of a dome. `flesh` [N] is the change of the forces by Hencky's law of flesh
    under domes. `mean_pressure` [MPa] is the mean pressure of each contact, and `pressure_error` [MPa] its error.
    `error` [N] is the error of all forces with the same sign under all tips. These arrays have the shape of F.
    `face_mm` (moduli, placements) is the width of a dome's face that contains every contact of a press, 0 for other
    tips.
    """

    moduli: tuple[float, ...]
    placements: tuple[Placement, ...]
    F: Floats
    flesh: Floats
    mean_pressure: Floats
    pressure_error: Floats
    error: Floats
    face_mm: Floats

    @property
    def full_scale(self) -> Floats:
        """Return the largest force of each channel [N], (tips,)."""
        return np.asarray(np.nanmax(self.F, axis=(0, 1, 2)))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class PressedSensor(Record):
    """A design, the compliance of its fruit under the tips, its springs as sized, and its springs as made."""

    design: Design
    contact: FruitCompliance
    sizing: SpringSizing
    springs: FittedSprings

    @property
    def pair(self) -> "PressedSensor":
        """Return the pair that represents the sensor: all tips on springs of one kind become one tip."""
        contact = self.contact.per_spring(*self.design.tips.spring_groups)
        return replace(self, design=self.design.per_spring, contact=contact, springs=self.springs.per_spring)

    @cached_property
    def C(self) -> Floats:
        """Return the compliance of the springs [mm/N], (tips, tips)."""
        return self.springs.C

    @cached_property
    def height_offsets(self) -> tuple[float, ...]:
        """Return the height of each tip behind the foremost one by its weight [mm]; empty if all tips are level."""
        return tip_height_offsets(self.springs, self.design.press.attitude)

    @cached_property
    def scene(self) -> Scene:
        """Return the scene of contact."""
        return scene_of(self.design, self.height_offsets, self.springs.sideways)

    @cached_property
    def signal(self) -> SignalPath | None:
        """Return the signal path from forces to counts; None if the design has no read-out."""
        readout = self.design.readout
        if readout is None:
            return None
        to_read = springs_to_read(self.springs)
        return signal_path(readout, to_read, self.springs.process, self.design.tips.springs)

    @cached_property
    def contrast(self) -> ContrastLaw:
        """Return the contrast of the tips.

        A pair needs no heights, because its reading of a press does not use them.
        """
        tips = self.design.tips
        if tips.tip_layout.is_pair:
            return pair_law(rows_of(self.C), 1.0 / self.contact.K_m_over_E())
        weights = contrast_weights(tips.places_mm, tips.springs)
        if tips.dome_radius_mm is None:
            fall = [self.design.fruit.fall_mm(x, y) for x, y in tips.places_mm]
            gaps = tuple(np.subtract(fall, tips.height_offset_mm).tolist())
            law = ContrastLaw(weights=weights, gaps=gaps, C=rows_of(self.C), S=rows_of(self.contact.S))
        else:
            law = self._dome_law(weights)
        if self.height_offsets:
            law = replace(law, gaps=tuple(np.subtract(law.gaps, self.height_offsets).tolist()))
        return law

    def _dome_law(self, weights: tuple[float, ...]) -> ContrastLaw:
        """Return the contrast of domes that press level at the centre of the fruit, in the middle of the range of E."""
        scene = scene_of(self.design, (), self.springs.sideways)
        middle = math.sqrt(min(scene.fruit.E_MPa) * scene.fruit.E_max_MPa)
        contrast = dome_contrast(scene, self.contact, self.C, middle)
        fall = fall_under_domes(scene.fruit, scene.tips)
        return ContrastLaw(
            weights=weights,
            gaps=tuple((fall - scene.tips.height_offset_mm).tolist()),
            C=rows_of(self.C + contrast.lean),
            S=rows_of(contrast.S),
            hertz=contrast.hertz,
        )

    @cached_property
    def law(self) -> RiseLaw:
        """Return the law that reads whole presses."""
        return rise_law(self.design, self.contrast)

    @cached_property
    def fastest_press_s(self) -> float | None:
        """Return the shortest press by hand [s] from the first touch to the deepest point that gives an accurate E.

        In such a press the time errors of the channels change E by 2 % on level fruit, one standard deviation. Enough
        samples follow the last touch. None without a read-out, and for a press without a rise. Raises like
        `pose_forces`.
        """
        signal = self.signal
        if signal is None:
            return None
        travel = self.design.press.travel_mm
        forces = self.presses([self.design.fruit.largest_E_MPa], [Placement()]).F[0, 0]
        x = np.concatenate([[0.0], travels(travel, RISE_TRAVELS)])
        forces = np.concatenate([np.zeros((1, forces.shape[1])), np.nan_to_num(forces)])
        shares = np.arange(_SAMPLES_BY_HAND + 1) / _SAMPLES_BY_HAND
        at = travel * (1.0 - (1.0 - shares) ** 2)  # a hand slows to a stop
        least = LEAST_OVER_NOISE * np.array(signal.errors_N)
        press = np.column_stack([np.interp(at, x, row) for row in forces.T])
        try:
            found = read_rise(self.law, rise_of(press, len(least), least, t=shares), np.zeros(len(least)))
        except ReadingError:
            return None
        by_clocks = float(np.linalg.norm(found.slopes.times)) * signal.time_deviation / signal.rate_Hz / LARGEST_BY_TIME
        samples = FEWEST + (2 if signal.delays else 1)
        return max(by_clocks, samples / signal.rate_Hz / math.sqrt(1.0 - LARGEST_TOUCH_FRACTION))

    @property
    def is_exact_seated(self) -> bool:
        """Return whether the law is exact for fully seated tips: a flat pair at the centre of a fruit without skin."""
        tips = self.design.tips
        in_the_middle = self.contact.stiffness_ratio() == 1.0
        is_bare = self.contact.skin is None
        return tips.tip_layout.is_pair and tips.tip_shape.has_flat_face and in_the_middle and is_bare

    def presses(self, moduli: Sequence[float], placements: Sequence[Placement]) -> SampledPresses:
        """Return the presses at moduli [MPa] in placements; raises like `pose_forces`."""
        travel = self.design.press.travel_mm
        x = travels(travel, RISE_TRAVELS).tolist()
        stands = [(each, placement.after(each / travel)) for placement in placements for each in x]
        poses = [Pose(E=E, travel=each, stand=stand) for E in moduli for each, stand in stands]
        forces = self.in_poses(poses)
        shape = (len(moduli), len(placements), RISE_TRAVELS)
        return SampledPresses(
            moduli=tuple(moduli),
            placements=tuple(placements),
            F=forces.F.reshape(*shape, -1),
            flesh=forces.F_flesh.reshape(*shape, -1),
            mean_pressure=forces.mean_pressure.reshape(*shape, -1),
            pressure_error=forces.pressure_error.reshape(*shape, -1),
            error=forces.error_alike.reshape(*shape, -1),
            face_mm=forces.face_mm.reshape(shape).max(axis=2),
        )

    def in_poses(self, poses: Sequence[Pose]) -> PoseForces:
        """Return the forces of the tips in poses; raises like `pose_forces`."""
        return pose_forces(self.scene, self.contact, self.C, poses)
