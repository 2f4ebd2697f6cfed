"""A printed unit as a measuring sensor: the read-out of its design with its own springs, tips and channels."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from cad.parts.pin import tip_accuracy_mm
from instrument.press.printed_unit import PrintedUnit, nominal_unit, read_unit, refuse_other_design
from instrument.press.ripeness import RipenessClasses, ripeness_classes
from pipeline.reading.read_out import correct_reading
from pipeline.reading.rise import Curvatures, design_curvatures, rise_law, rolling_domes
from pipeline.reading.uncertainty import OF_DRIFT, OF_FRUIT, Channels, SlopesOnBall, designed_channels
from pipeline.report.report import Report
from sensor.arrays import Flags, Floats
from sensor.design.reading import ReadingRequirements
from sensor.quantity import BOUNDED, validation_error
from sensor.theory.contrast_law import Matrix, ratio_modulus, stiffened_compliance
from sensor.theory.contrast_rise import BendSlopes, RiseLaw, RollingDomes
from sensor.theory.creep import EFFECTIVE, CreepLaw
from solve.contact.domes.large_strain import large_strain

PAIR_TILT_DEG = 2.0  # largest tilt of a pair before a press is flagged as crooked, if the design sets no tilt
LEAST_CURVATURE_SPREAD = 0.25
"""Standard deviation of an unknown mean curvature of the skin, over the mean curvature of the design.

The cheek of a mango has principal radii of about 47 and 110 mm, a mean curvature of 1/66 per mm. For a design with a
radius of 35 mm, this is 47 % less: two standard deviations.
"""
_BELOW_OVER_LEAST = 2.0  # a force below zero by twice the least force of a touch is no noise
_ALLOWED_OVER_SCALE = 20.0  # a force beyond this many full scales comes from another sensor or has another unit


@dataclass(frozen=True, kw_only=True)
class MeasuringUnit:
    """A printed unit that reads fruit: the read-out of a report with the springs, tips and channels of the unit.

    `classes` are ripeness classes for its readings. `radii_mm` are the principal radii of the fruit, if they are known.
    """

    report: Report
    unit: PrintedUnit
    classes: RipenessClasses | None = None
    radii_mm: tuple[float, float] | None = None

    @classmethod
    def from_report(
        cls, report: Report, unit: PrintedUnit | str | Path | None = None, classes: str | None = None
    ) -> "MeasuringUnit":
        """Return a unit of a report, from a record or a unit.toml; without either, the nominal unit.

        `classes` is a text like `ripe:0.8,unripe`; by default the classes of the unit apply. Raises InputError for a
        unit of another design and for invalid classes.
        """
        if isinstance(unit, str | Path):
            printed = read_unit(Path(unit), report)
        elif unit is None:
            printed = nominal_unit(report)
        else:
            printed = unit
            refuse_other_design(printed, report)
        text, flag = (classes, "--classes") if classes else (printed.classes, "unit.classes")
        return cls(report=report, unit=printed, classes=ripeness_classes(text, flag) if text else None)

    @cached_property
    def C(self) -> Matrix:
        """Return the compliance matrix of the unit's springs [mm/N], coupled through the frame of the design."""
        nominal = self.report.read_out.springs_mm_per_N
        return stiffened_compliance(nominal, np.multiply(self.unit.stiffnesses, np.diag(nominal)).tolist())

    @property
    def reads_moments(self) -> bool:
        """Return whether one moment determines a modulus, by the force ratio of a level pair of flat tips."""
        return self.report.read_out.is_pair and self.report.design.tips.tip_shape.has_flat_face

    @cached_property
    def rise_law(self) -> RiseLaw:
        """Return the law that reads a press; the law of a pair holds for any heights of its tips."""
        designed = self.report.read_out.contrast_on(self.C)
        return rise_law(self.report.design, designed, self._told_curvatures)

    @property
    def _told_curvatures(self) -> Curvatures | None:
        return None if self.radii_mm is None else (1.0 / self.radii_mm[0], 1.0 / self.radii_mm[1])

    @cached_property
    def domes(self) -> RollingDomes | None:
        """Return the rolling domes of a line or a square, on a fruit of the given radii or of the design."""
        weights = self.report.read_out.weights
        return None if weights is None else rolling_domes(self.report.design, weights, self._told_curvatures)

    @property
    def curvature_deviation(self) -> float:
        """Return the standard deviation of the mean curvature of the skin [1/mm].

        It is 0 if the radii are given. It is also 0 if the design lists radii: the error analysis then has this error
        in its source `pose`.
        """
        asked = self.report.design.reading
        in_pose = bool(self.report.moduli) and asked is not None and asked.radius_mm is not None
        if self.radii_mm is not None or in_pose:
            return 0.0
        named = 0.0 if asked is None else BOUNDED * asked.radius_spread
        mean_curvature = 0.5 * math.fsum(design_curvatures(self.report.design))
        return mean_curvature * max(named, LEAST_CURVATURE_SPREAD)

    @property
    def height_deviation(self) -> float:
        """Return the standard deviation of each tip's protrusion [mm], from the accuracy of its print process."""
        return 0.5 * tip_accuracy_mm(self.report.design.tips, self.report.design.process)

    @property
    def model_error(self) -> float:
        """Return the relative error of the contact model [1]."""
        return 0.01 * self.report.read_out.model_error_percent

    @cached_property
    def channels(self) -> Channels:
        """Return the errors of the channels and springs in a press of the duration of the design."""
        read_out = self.report.read_out
        full_scale = np.array(read_out.full_scale_N)
        designed = designed_channels(self.report.design.reading or ReadingRequirements(), full_scale, read_out.signal)
        gains = {"gain": 0.01 * np.array(self.unit.gain_percent)}
        on_ball = None
        if self.unit.ball is not None:
            slopes = (self.unit.ball.spring_slopes, self.unit.ball.gain_slopes)
            on_ball = SlopesOnBall(*map(np.array, slopes))
            # `gain_percent` holds the drift, which is another one on the ball.
            drift = np.minimum(0.01 * BOUNDED * np.array(read_out.channels.gain_drift_percent), gains["gain"])
            gains = {"gain": np.sqrt(gains["gain"] ** 2 - drift**2), OF_DRIFT: drift}
        return replace(
            designed,
            gains=gains,
            springs=0.01 * np.array(self.unit.K_percent),
            time_s=0.0,
            on_plate=self.unit.calibrated_by == "plate",
            creep=self._creep_deviation(self.report.design.press_s),
            on_ball=on_ball,
        )

    def channels_in(self, time_s: float, press_s: float | None) -> Channels:
        """Return the errors of the channels and springs in a press of a duration [s].

        None is the duration of the design. `time_s` [s] is the standard deviation of the time of each channel.
        """
        press_s = press_s or self.report.design.press_s
        return replace(self.channels, time_s=time_s, creep=self._creep_deviation(press_s))

    def _creep_deviation(self, press_s: float) -> float:
        """Return the relative standard deviation of all stiffnesses [1] by creep in a press of a duration [s].

        A reference ball measures the springs at the duration of its presses, and so replaces the weights.
        """
        ball = self.unit.ball
        known_after = self.unit.weighed_after_s if ball is None else EFFECTIVE * ball.press_s
        return self.creep.deviation(known_after, press_s)

    def on_ball(self, radius_mm: float) -> "MeasuringUnit":
        """Return the unit as it reads a ball of a radius [mm], without the correction by a ball."""
        report = replace(self.report, design=self.report.design.elastic)
        return replace(self, report=report, unit=replace(self.unit, ball=None), radii_mm=(radius_mm, radius_mm))

    @cached_property
    def noises(self) -> Floats:
        """Return the standard deviation of the noise of each channel [N]."""
        return self.channels.noises

    @cached_property
    def creep(self) -> CreepLaw:
        """Return the creep of its springs."""
        return self.unit.creep_or(self.report.creep)

    def press_over_weighed(self, press_s: float | None = None) -> float:
        """Return the stiffness of the springs in a press over their stiffness at the weighing [1].

        `press_s` [s] is the time from the first touch to the deepest point; None is the duration of the design.
        """
        return self.creep.press_over_weighed(self.unit.weighed_after_s, press_s or self.report.design.press_s)

    def softening_in_hold(self, held_s: float, press_s: float | None = None) -> float:
        """Return the stiffness of the springs after a hold [s] over their stiffness at its begin [1].

        `press_s` [s] is the duration of the press before, as in `press_over_weighed`.
        """
        return 1.0 / self.creep.growth_in_hold(held_s, press_s or self.report.design.press_s)

    def by_bends(self, channels: BendSlopes, springs: BendSlopes) -> float:
        """Return the size of the error of a modulus [1] by curved calibration lines of channels and springs.

        The arguments are the slopes of ln E for the errors of channels and of springs.
        """
        unit = self.unit
        error = 0.0
        for slopes, at_zero, per_N in (
            (channels, unit.force_bend, unit.force_bend_per_N),
            (springs, unit.deflection_bend, unit.deflection_bend_per_N),
        ):
            if at_zero is not None and per_N is not None:
                error += float(np.dot(slopes.at_zero, at_zero) + np.dot(slopes.per_N, per_N))
        return abs(error)

    @cached_property
    def least_forces(self) -> Floats:
        """Return for each channel the force below which its tip is taken as out of contact [N]."""
        return self.channels.least_forces

    @cached_property
    def lowest_forces(self) -> Floats:
        """Return for each channel the lowest plausible force [N]; noise does not reach so far below zero."""
        return -_BELOW_OVER_LEAST * self.least_forces

    @cached_property
    def largest_forces(self) -> Floats:
        """Return for each channel the largest plausible force [N]."""
        return _ALLOWED_OVER_SCALE * np.array(self.report.read_out.full_scale_N)

    @property
    def range_MPa(self) -> tuple[float, float]:
        """Return the least and the largest modulus of the design's range [MPa]."""
        return min(self.report.design.fruit.E_MPa), self.report.design.fruit.largest_E_MPa

    @property
    def steepest_deg(self) -> float:
        """Return the largest tilt against the normal of the skin that the design allows [deg]."""
        asked = self.report.design.reading
        return PAIR_TILT_DEG if asked is None else asked.tilt_deg + asked.tilt_change_deg

    @property
    def tilt_deviation_deg(self) -> float:
        """Return the standard deviation of the tilt that errors of the tip heights simulate [deg]; 0 for a pair.

        The heights have the accuracy of the process. A straight line fitted through them has a slope whose deviation is
        theirs over the root of the sum of squared places.
        """
        if self.report.read_out.is_pair:
            return 0.0
        places = np.array(self.report.design.tips.places_mm)
        spread = float(np.sqrt(np.square(places - places.mean(axis=0)).sum(axis=0)).max())
        rolling = 1.0 if self.domes is None else self.domes.rolling_factor
        return math.degrees(math.atan(rolling * self.height_deviation / spread))

    @property
    def lead_deviation(self) -> float:
        """Return the standard deviation of the lead of one tip of a pair at the tilts of the design [mm]."""
        return BOUNDED * math.tan(math.radians(self.steepest_deg)) * self.report.design.tips.spacing_mm

    @property
    def ball_factor(self) -> float:
        """Return the correction factor of all readings from a reference ball [1]; 1 without a ball."""
        return 1.0 if self.unit.ball is None else self.unit.ball.factor

    def corrected(self, read: float, press_s: float | None = None) -> float:
        """Return the true modulus [MPa] of a press that a level sensor reads as `read` [MPa].

        The weights calibrated the springs at another duration than the press, so creep is corrected first. A correction
        by a reference ball follows. `press_s` [s] is the duration; None is the duration of the design.
        """
        return self.ball_factor * correct_reading(
            self.press_over_weighed(press_s) * read, self.report.read_out.level_readings
        )

    def read_as(self, E: float) -> float:
        """Return the modulus [MPa] that a level press on a fruit of E [MPa] reads; the inverse of `corrected`."""
        E /= self.ball_factor
        level = self.report.read_out.level_readings
        if not level:
            return E / self.press_over_weighed()
        logs = np.log([(row.E_MPa, row.read_MPa) for row in level])
        shift = np.interp(math.log(E), logs[:, 0], logs[:, 1] - logs[:, 0])
        return E * math.exp(shift) / self.press_over_weighed()

    def steepness(self, E: float) -> float:
        """Return d ln E / d ln(reading) at E [MPa]: 1 without a skin."""
        if self.report.design.fruit.skin_mm is None:
            return 1.0
        level = self.report.read_out.level_readings
        logs = np.log([row.E_MPa for row in level])
        slopes = np.gradient(logs, np.log([row.read_MPa for row in level]))
        return float(np.interp(math.log(E), logs, slopes))

    def refuse_without_rise_level(self) -> None:
        """Raise InputError if the report has no level readings of whole presses.

        Reports before 0.2 have none, and neither have designs whose travel is too short for a rise.
        """
        if not self.report.read_out.is_pair and not self.report.read_out.level_readings:
            hint = "run the design again; if that does not help, press.travel_mm is too short for a rise"
            raise validation_error("read_out.rise_level", None, "", "readings of whole presses in report.json", hint)

    def by_fruit(self, E: float) -> dict[str, float]:
        """Return the standard deviations of a modulus [MPa] from fruit and poses, by source, as fractions [1].

        They come from the error analysis of the design; its other sources belong to the unit. Without an error analysis
        the sensor is taken as level at the centre of the fruit, and only Poisson's ratio contributes.
        """
        rows = self.report.moduli
        if not rows:
            fruit = self.report.design.fruit  # a spread is two deviations
            return {"poisson": fruit.poisson * fruit.poisson_spread / (1.0 - fruit.poisson**2)}
        keys = {name: f"{name}_percent" for name in OF_FRUIT}
        if not all(row.sources.keys() >= set(keys.values()) for row in rows):
            bound = f"with {', '.join(keys.values())}"
            raise validation_error("reading.moduli.sources", None, "", bound, "run the design again")
        return {name: self.between_moduli(E, [row.sources[key] for row in rows]) for name, key in keys.items()}

    def by_uneven(self, E: float) -> list[float]:
        """Return the standard deviations of a modulus [MPa] from uneven skin and uneven flesh, as fractions [1].

        They vary from press to press on a fruit. Reports of older versions have none.
        """
        uneven = [row.fruit for row in self.report.moduli if row.fruit is not None]
        if not uneven:
            return []
        skin, flesh = [fruit.skin_percent for fruit in uneven], [fruit.flesh_percent for fruit in uneven]
        return [self.between_moduli(E, skin), self.between_moduli(E, flesh)]

    def between_moduli(self, E: float, percent: Sequence[float]) -> float:
        """Interpolate percentages, one for each modulus of the error analysis, at E [MPa]; return a fraction [1]."""
        logs = np.log([row.E_MPa for row in self.report.moduli])
        return 0.01 * float(np.interp(math.log(E), logs, percent))

    def by_form(self, E: float) -> list[float]:
        """Return the standard deviations of a modulus [MPa] from form errors of the tips, as fractions [1].

        They are the same in all presses of the unit. Reports of older versions have none. A reference ball removes the
        part that it shows and adds its own error.
        """
        of_moduli = [row.form_percent for row in self.report.moduli if row.form_percent]
        of_form = [self.between_moduli(E, percent) for percent in zip(*of_moduli, strict=True)]
        ball = self.unit.ball
        if ball is None:
            return of_form
        left = [each - 0.01 * shown for each, shown in zip(of_form, ball.form_percent, strict=bool(of_form))]
        return [*left, 0.01 * ball.percent]

    @property
    def lacks_form(self) -> bool:
        """Return whether the sensor has domes but its report, of an older version, has no form errors of them."""
        rows = self.report.moduli
        return self.domes is not None and bool(rows) and not any(row.form_percent for row in rows)

    def reduced(self, E: float) -> float:
        """Return E / (1 - nu^2) [MPa] from E [MPa], at the Poisson's ratio of the design."""
        return E / (1.0 - self.report.design.fruit.poisson**2)

    def bruises(self, forces: Floats, E: float) -> bool:
        """Return whether forces [N] press a fruit of modulus E [MPa] beyond its bruise limit; False without a limit.

        The contact of a dome follows the pressed flesh at large strain, as in the verdict on bruises.
        """
        fruit = self.report.design.fruit
        if not fruit.bruise_limits_MPa:
            return False
        tips = self.report.design.tips
        radius = 2.0 / math.fsum(self._told_curvatures or design_curvatures(self.report.design))
        area_of = tips.tip_shape.contact_area_mm2
        areas = np.array([area_of(force, self.reduced(E), radius) for force in forces.tolist()])
        if tips.dome_radius_mm is not None:
            strain = large_strain(np.sqrt(areas / np.pi), tips.dome_radius_mm, np.array(1.0 / radius), fruit.poisson)
            areas *= strain.edge**2 / strain.factor ** (2.0 / 3.0)  # Hertz: area ~ force^(2/3)
        limit = float(np.interp(E, fruit.E_MPa, fruit.bruise_limits_MPa))
        return bool(np.any(forces > limit * areas))

    def forces_of_channels(self, channels: Sequence[float]) -> Floats:
        """Return the forces [N] of the tips from the readings of the channels [N]."""
        return np.multiply(self.unit.gain, channels)

    def in_scale(self, forces: Sequence[float] | Floats) -> Flags:
        """Return which forces [N], (tips,), are plausible: not far below zero and not far beyond full scale."""
        return (self.lowest_forces <= forces) & (forces <= self.largest_forces)

    def ratio_modulus(self, forces: Floats) -> float:
        """Return the modulus [MPa] of a level pair from the ratio of its forces [N]; raises ReadingError."""
        return ratio_modulus(self.C, self.report.read_out.own_less_other_per_mm or 0.0, forces.tolist())

    def with_stiffness(self, tip: int, factor: float) -> "MeasuringUnit":
        """Return the unit with the spring of one tip stiffened by a factor [1]."""
        K = list(self.unit.K_N_per_m)
        K[tip] *= factor
        return replace(self, unit=replace(self.unit, K_N_per_m=tuple(K)))
