"""A sensor that is pressed: a design with its springs and its fruit, and the presses that are solved for it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pipeline.reading.poses import Placement
from pipeline.reading.rise import gaps_under_domes, rise_law
from pipeline.response.scene_press import scene_of
from pipeline.springs.fitted_springs import FittedSprings, springs_to_read, tip_height_offsets
from pipeline.springs.sizing import SpringSizing
from sensor.arrays import Floats, rows_of
from sensor.design.parameters import Design
from sensor.design.reading import LARGEST_TOUCH_FRACTION, LEAST_OVER_NOISE
from sensor.design.signal_path import SignalPath, signal_path
from sensor.record import Record
from sensor.theory.contrast_law import ContrastLaw, ReadingError, contrast_weights, pair_law
from sensor.theory.contrast_rise import FEWEST, LARGEST_BY_TIME, RiseLaw, read_rise, select_rise
from solve.contact.domes.law import dome_contrast
from solve.contact.linear_response import travels
from solve.contact.pose_forces import Pose, PoseForces, pose_forces
from solve.contact.scene import Scene
from solve.fruit.compliance import FruitCompliance

RISE_TRAVELS = 16  # number of samples of a solved press, from which the rise is read
_SAMPLES_BY_HAND = 60  # number of samples of a press by hand, interpolated between the solved samples


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SampledPresses(Record):
    """Presses at several moduli [MPa] and placements; the forces F [N] are (moduli, placements, samples, tips).

    F is nan if a contact extends beyond the face of a dome. `flesh` [N] is the change in the forces if the flesh under
    domes obeys Hencky's law. `mean_pressure` [MPa] is the mean pressure in each contact, and `pressure_error` [MPa] its
    error. `error` [N] is the part of the error of the forces that has the same sign under all tips. All these arrays
    have the shape of F. `face_mm` (moduli, placements) is the smallest width of a dome's face that contains every
    contact of a press; it is 0 for other tips.
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
        """Return the largest force of each channel [N] over all presses, shape (tips,)."""
        return np.asarray(np.nanmax(self.F, axis=(0, 1, 2)))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class PressedSensor(Record):
    """A design, the compliance of its fruit under the tips, its springs as sized, and its springs as printed."""

    design: Design
    contact: FruitCompliance
    sizing: SpringSizing
    springs: FittedSprings

    @property
    def pair(self) -> "PressedSensor":
        """Return the pair that represents the sensor: one tip replaces all tips on springs of the same kind."""
        contact = self.contact.as_pair(*self.design.tips.spring_groups)
        return replace(self, design=self.design.as_pair, contact=contact, springs=self.springs.as_pair)

    @cached_property
    def C(self) -> Floats:
        """Return the compliance matrix of the springs [mm/N], shape (tips, tips)."""
        return self.springs.C

    @cached_property
    def height_offsets(self) -> tuple[float, ...]:
        """Return the height [mm] of each tip relative to the foremost tip, due to weight; empty if all are level."""
        return tip_height_offsets(self.springs, self.design.press.attitude)

    @cached_property
    def scene(self) -> Scene:
        """Return the scene for the contact solvers, with the tip heights and the springs' lateral compliance."""
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
        """Return the contrast law from which a modulus is read.

        The contrast is a weighted sum over the tips in which travel and tilt cancel. The law relates the contrast to
        the forces. The law depends on the compliances of springs and fruit, and on the gaps under the tips of a level
        sensor. The gaps include the heights of the tips due to the weight of the parts. A pair needs no gaps, because
        its reading of a whole press does not depend on them.
        """
        tips = self.design.tips
        if tips.tip_layout.is_pair:
            s11_minus_s12 = 1.0 / self.contact.K_m_over_E()
            return pair_law(rows_of(self.C), s11_minus_s12)
        weights = contrast_weights(tips.places_mm, tips.springs)
        if tips.dome_radius_mm is None:
            # depth of the skin below the apex under each tip [mm]; a protruding tip has a smaller gap
            skin_depths = [self.design.fruit.fall_mm(x, y) for x, y in tips.places_mm]
            gaps = tuple(np.subtract(skin_depths, tips.height_offset_mm).tolist())
            law = ContrastLaw(weights=weights, gaps=gaps, C=rows_of(self.C), S=rows_of(self.contact.S))
        else:
            law = self._dome_law(weights)
        if self.height_offsets:  # empty if the weight of the parts does not displace the tips
            law = replace(law, gaps=tuple(np.subtract(law.gaps, self.height_offsets).tolist()))
        return law

    def _dome_law(self, weights: tuple[float, ...]) -> ContrastLaw:
        """Return the contrast law of domes, linearized for a level press at the apex.

        `weights` (tips,) [1] are the weights of the tips in the contrast. The compliances are evaluated at the
        geometric mean of the smallest and the largest modulus.
        """
        # `contrast` adds the height offsets due to weight, so this scene has none
        scene = scene_of(self.design, (), self.springs.sideways)
        middle_E = math.sqrt(min(scene.fruit.E_MPa) * scene.fruit.E_max_MPa)
        contrast = dome_contrast(scene, self.contact, self.C, middle_E)
        gaps = gaps_under_domes(scene.fruit, scene.tips)
        return ContrastLaw(
            weights=weights,
            gaps=tuple((gaps - scene.tips.height_offset_mm).tolist()),
            C=rows_of(self.C + contrast.inclination_compliance),
            S=rows_of(contrast.S),
            hertz=contrast.hertz,
        )

    @cached_property
    def law(self) -> RiseLaw:
        """Return the law by which a modulus is read from whole presses."""
        return rise_law(self.design, self.contrast)

    @cached_property
    def fastest_press_s(self) -> float | None:
        """Return the shortest duration of a press by hand [s], from the first touch, that gives an accurate modulus.

        The duration must meet two conditions in a level press on the firmest fruit. The relative standard deviation of
        E due to the conversion times of the channels is at most 2 %. At least `FEWEST` samples follow the touch of the
        last tip. The result is None without a read-out, or if the press has too little rise for a reading. Raises the
        same errors as `pose_forces`.
        """
        signal = self.signal
        if signal is None:
            return None
        shortest_for_times = self._shortest_for_times(signal)
        if shortest_for_times is None:
            return None
        # The instrumental variable of a sample is the total force one sample earlier. If the channels are interpolated
        # to a common time, it is the force two samples earlier. So the first one or two samples cannot be used.
        samples = FEWEST + (2 if signal.delays else 1)
        # If the last tip touches at the largest allowed fraction of the travel, this fraction of the duration remains.
        # The fraction follows from the travel of a hand, x = X (1 - (1 - t / T)^2).
        fraction_after_touch = math.sqrt(1.0 - LARGEST_TOUCH_FRACTION)
        return max(shortest_for_times, samples / signal.rate_Hz / fraction_after_touch)

    def _shortest_for_times(self, signal: SignalPath) -> float | None:
        """Return the shortest duration of a press by hand [s] for which the conversion times matter little enough.

        The relative standard deviation of E due to the conversion times is then at most `LARGEST_BY_TIME`, in a level
        press on the firmest fruit. The result is None if the press has too little rise for a reading. Raises the same
        errors as `pose_forces`.
        """
        # The times are fractions of the duration, so the slopes with respect to time errors are for a press of 1 s.
        times = np.arange(_SAMPLES_BY_HAND + 1) / _SAMPLES_BY_HAND
        press = self._press_by_hand(times)
        least_forces = LEAST_OVER_NOISE * np.array(signal.errors_N)  # a smaller force may be only noise [N]
        try:
            rise = select_rise(press, len(least_forces), least_forces, t=times)
            reading = read_rise(self.law, rise, np.zeros(len(least_forces)))  # simulated forces have no noise
        except ReadingError:
            return None
        # The standard deviation of E is inversely proportional to the duration T. So for T = 1 s, its ratio to the
        # limit is the smallest T in seconds.
        change_per_s = float(np.linalg.norm(reading.slopes.times))  # change in ln E per time error, for T = 1 s
        return change_per_s * signal.time_deviation / signal.rate_Hz / LARGEST_BY_TIME

    def _press_by_hand(self, times: Floats) -> Floats:
        """Return the forces (times, tips) [N] of a level press by hand on the firmest fruit.

        `times` [1] are fractions t / T of the duration, from 0 to 1. A hand slows to a stop at the full travel X: x = X
        (1 - (1 - t / T)^2). The forces are interpolated between the samples of a solved press. Raises the same errors
        as `pose_forces`.
        """
        travel = self.design.press.travel_mm
        forces = self.presses([self.design.fruit.largest_E_MPa], [Placement()]).F[0, 0]  # (samples, tips)
        # The solved press begins one step after the first touch, so the first touch without a force is added.
        x = np.concatenate([[0.0], travels(travel, RISE_TRAVELS)])
        forces = np.concatenate([np.zeros((1, forces.shape[1])), np.nan_to_num(forces)])
        travel_by_hand = travel * (1.0 - (1.0 - times) ** 2)
        return np.column_stack([np.interp(travel_by_hand, x, tip_forces) for tip_forces in forces.T])

    @property
    def is_exact_seated(self) -> bool:
        """Return whether the law is exact once all faces touch: a flat pair at the centre of a fruit without skin."""
        tips = self.design.tips
        is_central = self.contact.stiffness_ratio() == 1.0
        has_no_skin = self.contact.skin is None
        return tips.tip_layout.is_pair and tips.tip_shape.has_flat_face and is_central and has_no_skin

    def presses(self, moduli: Sequence[float], placements: Sequence[Placement]) -> SampledPresses:
        """Solve whole presses on fruit of each of the `moduli` [MPa] in each placement, at `RISE_TRAVELS` equal steps.

        The first sample of a press is one step after the first touch, and the last sample is at full travel. Raises the
        same errors as `pose_forces`.
        """
        travel = self.design.press.travel_mm
        steps = travels(travel, RISE_TRAVELS).tolist()
        # a placement may change its tilt in proportion to the travel x
        stands = [(x, placement.after(x / travel)) for placement in placements for x in steps]
        poses = [Pose(E=E, travel=x, stand=stand) for E in moduli for x, stand in stands]
        forces = self.forces_in_poses(poses)  # all poses are solved at once, in the order of `shape`
        shape = (len(moduli), len(placements), RISE_TRAVELS)
        return SampledPresses(
            moduli=tuple(moduli),
            placements=tuple(placements),
            F=forces.F.reshape(*shape, -1),
            flesh=forces.F_flesh.reshape(*shape, -1),
            mean_pressure=forces.mean_pressure.reshape(*shape, -1),
            pressure_error=forces.pressure_error.reshape(*shape, -1),
            error=forces.common_error.reshape(*shape, -1),
            face_mm=forces.face_mm.reshape(shape).max(axis=2),  # the largest over the samples of a press
        )

    def forces_in_poses(self, poses: Sequence[Pose]) -> PoseForces:
        """Return the forces of the tips in the given poses; raises the same errors as `pose_forces`."""
        return pose_forces(self.scene, self.contact, self.C, poses)
