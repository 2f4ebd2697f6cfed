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

PAIR_TILT_DEG = 2.0  # largest tilt [deg] before a press is flagged as crooked, if the design sets no tilt
LEAST_CURVATURE_SPREAD = 0.25
"""Standard deviation of an unknown mean curvature of the skin, over the mean curvature of the design.

The cheek of a mango has principal radii of about 47 and 110 mm, a mean curvature of 1/66 per mm. For a design with a
radius of 35 mm, this is 47 % less: two standard deviations.
"""
_BELOW_OVER_LEAST = 2.0  # a force below zero by twice the smallest force of a touch is no noise
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
        """Return a measuring unit of the design of a report.

        `unit` is a calibrated unit or the path of its unit.toml; without it, the unit equals its design. `classes` is a
        text like `ripe:0.8,unripe`; without it, the classes of the unit apply. Raises InputError for a unit of another
        design and for invalid classes.
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
        factors = np.multiply(self.unit.stiffnesses, np.diag(nominal))  # stiffnesses relative to the design
        return stiffened_compliance(nominal, factors.tolist())

    @property
    def reads_moments(self) -> bool:
        """Return whether the forces of one moment determine a modulus: for a level pair of flat tips."""
        return self.report.read_out.is_pair and self.report.design.tips.tip_shape.has_flat_face

    @cached_property
    def rise_law(self) -> RiseLaw:
        """Return the law that reads a press; the law of a pair holds for any heights of its tips."""
        designed = self.report.read_out.contrast_on(self.C)
        return rise_law(self.report.design, designed, self._given_curvatures)

    @property
    def _given_curvatures(self) -> Curvatures | None:
        """Return the principal curvatures of the fruit [1/mm], or None if its radii are not given."""
        return None if self.radii_mm is None else (1.0 / self.radii_mm[0], 1.0 / self.radii_mm[1])

    @cached_property
    def domes(self) -> RollingDomes | None:
        """Return the rolling domes of a line or a square, on a fruit of the given radii or of the design."""
        weights = self.report.read_out.weights
        return None if weights is None else rolling_domes(self.report.design, weights, self._given_curvatures)

    @property
    def curvature_deviation(self) -> float:
        """Return the standard deviation of the mean curvature of the skin [1/mm].

        It is 0 if the radii are given. It is also 0 if the design lists radii and its report has an error analysis,
        which then includes this error in its source `pose`.
        """
        requirements = self.report.design.reading
        is_in_pose = bool(self.report.moduli) and requirements is not None and requirements.radius_mm is not None
        if self.radii_mm is not None or is_in_pose:
            return 0.0
        stated_spread = 0.0 if requirements is None else BOUNDED * requirements.radius_spread
        mean_curvature = 0.5 * math.fsum(design_curvatures(self.report.design))
        return mean_curvature * max(stated_spread, LEAST_CURVATURE_SPREAD)

    @property
    def height_deviation(self) -> float:
        """Return the standard deviation of each tip's protrusion [mm], from the accuracy of its print process."""
        # The accuracy is stated as two standard deviations.
        return 0.5 * tip_accuracy_mm(self.report.design.tips, self.report.design.process)

    @property
    def model_error(self) -> float:
        """Return the relative error of the contact model [1]."""
        return 0.01 * self.report.read_out.model_error_percent

    @cached_property
    def channels(self) -> Channels:
        """Return the errors of the channels and springs in a press with the duration of the design.

        They are the errors of the design, with the springs, gains and creep of the unit in place of its own.
        """
        read_out = self.report.read_out
        full_scale = np.array(read_out.full_scale_N)
        designed = designed_channels(self.report.design.reading or ReadingRequirements(), full_scale, read_out.signal)
        gains = {"gain": 0.01 * np.array(self.unit.gain_percent)}
        on_ball = None
        if self.unit.ball is not None:
            slopes = (self.unit.ball.spring_slopes, self.unit.ball.gain_slopes)
            on_ball = SlopesOnBall(*map(np.array, slopes))
            # `gain_percent` includes the drift, which has another value at the presses on the ball. So it is separated.
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
        """Return the errors of the channels and springs in a press that lasts `press_s` [s].

        None means the duration of the design. `time_s` [s] is the standard deviation of each channel's sampling time.
        """
        press_s = press_s or self.report.design.press_s
        return replace(self.channels, time_s=time_s, creep=self._creep_deviation(press_s))

    def _creep_deviation(self, press_s: float) -> float:
        """Return the relative standard deviation of all stiffnesses [1] due to creep in a press of `press_s` seconds.

        A reference ball measures the springs at the duration of its presses, and so replaces the weights.
        """
        ball = self.unit.ball
        measured_after = self.unit.weighed_after_s if ball is None else EFFECTIVE * ball.press_s
        return self.creep.deviation(measured_after, press_s)

    def on_ball(self, radius_mm: float) -> "MeasuringUnit":
        """Return the unit for a ball of radius `radius_mm`, as elastic flesh, and without a correction by a ball."""
        report = replace(self.report, design=self.report.design.elastic)
        return replace(self, report=report, unit=replace(self.unit, ball=None), radii_mm=(radius_mm, radius_mm))

    @cached_property
    def noises(self) -> Floats:
        """Return the standard deviation of the noise of each channel [N]."""
        return self.channels.noises

    @cached_property
    def creep(self) -> CreepLaw:
        """Return the creep of the unit's springs."""
        return self.unit.creep_or(self.report.creep)

    def press_over_weighed(self, press_s: float | None = None) -> float:
        """Return the stiffness of the springs in a press divided by their stiffness at the weighing [1].

        `press_s` [s] is the time from the first touch to the deepest point; None means the duration of the design.
        """
        return self.creep.press_over_weighed(self.unit.weighed_after_s, press_s or self.report.design.press_s)

    def softening_in_hold(self, held_s: float, press_s: float | None = None) -> float:
        """Return the stiffness of the springs after a hold of `held_s` [s] divided by their stiffness at its start [1].

        `press_s` [s] is the duration of the press before the hold, as in `press_over_weighed`.
        """
        return 1.0 / self.creep.growth_in_hold(held_s, press_s or self.report.design.press_s)

    def bend_error(self, channels: BendSlopes, springs: BendSlopes) -> float:
        """Return the size of the error of ln E [1] due to curved calibration lines of channels and springs.

        `channels` and `springs` are the slopes of ln E against errors of the gains and of the spring compliances.
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
        """Return for each channel the force [N] below which its tip counts as out of contact."""
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
        """Return the smallest and the largest modulus of the design's range [MPa]."""
        return min(self.report.design.fruit.E_MPa), self.report.design.fruit.largest_E_MPa

    @property
    def steepest_deg(self) -> float:
        """Return the largest tilt of the sensor from the normal of the skin that the design allows [deg]."""
        requirements = self.report.design.reading
        return PAIR_TILT_DEG if requirements is None else requirements.tilt_deg + requirements.tilt_change_deg

    @property
    def tilt_deviation_deg(self) -> float:
        """Return the standard deviation of the apparent tilt due to errors of the tip heights [deg]; 0 for a pair.

        The tilt is the slope of a plane fitted through the tips. Its standard deviation is that of one height, divided
        by the root sum of squares of the distances from the centre.
        """
        if self.report.read_out.is_pair:
            return 0.0
        positions = np.array(self.report.design.tips.places_mm)
        spread = float(np.sqrt(np.square(positions - positions.mean(axis=0)).sum(axis=0)).max())
        # On a round fruit a dome rolls: its contact is lowered less than its axis.
        rolling = 1.0 if self.domes is None else self.domes.rolling_factor
        return math.degrees(math.atan(rolling * self.height_deviation / spread))

    @property
    def lead_deviation(self) -> float:
        """Return the standard deviation [mm] of the distance by which one tip of a pair touches first, due to tilt.

        The tilt lies anywhere within the tilt of the design.
        """
        return BOUNDED * math.tan(math.radians(self.steepest_deg)) * self.report.design.tips.spacing_mm

    @property
    def ball_factor(self) -> float:
        """Return the correction factor of all readings from a reference ball [1]; 1 without a ball."""
        return 1.0 if self.unit.ball is None else self.unit.ball.factor

    def corrected(self, read: float, press_s: float | None = None) -> float:
        """Return the true modulus [MPa] of a fruit that a level press reads as `read` [MPa].

        Creep is corrected first, because the weights calibrated the springs at another duration than the press. The
        level readings of the report and the factor of a reference ball follow. `press_s` [s] is the duration of the
        press; None means the duration of the design.
        """
        return self.ball_factor * correct_reading(
            self.press_over_weighed(press_s) * read, self.report.read_out.level_readings
        )

    def read_as(self, E: float) -> float:
        """Return the modulus [MPa] as which a level press reads a fruit of E [MPa]: the inverse of `corrected`."""
        E /= self.ball_factor
        level = self.report.read_out.level_readings
        if not level:
            return E / self.press_over_weighed()
        logs = np.log([(row.E_MPa, row.read_MPa) for row in level])
        shift = np.interp(math.log(E), logs[:, 0], logs[:, 1] - logs[:, 0])
        return E * math.exp(shift) / self.press_over_weighed()

    def steepness(self, E: float) -> float:
        """Return the steepness at E [MPa], d ln E / d ln(reading), which multiplies errors of the reading."""
        if self.report.design.fruit.skin_mm is None:
            return 1.0  # the reading is proportional to E
        level = self.report.read_out.level_readings
        logs = np.log([row.E_MPa for row in level])
        slopes = np.gradient(logs, np.log([row.read_MPa for row in level]))
        return float(np.interp(math.log(E), logs, slopes))

    def refuse_without_rise_level(self) -> None:
        """Raise InputError if the report of a line or a square has no level readings of whole presses.

        Reports before 0.2 have none, and neither have designs whose travel is too short to read.
        """
        if not self.report.read_out.is_pair and not self.report.read_out.level_readings:
            hint = "run the design again; if that does not help, press.travel_mm is too short for a rise"
            raise validation_error("read_out.rise_level", None, "", "readings of whole presses in report.json", hint)

    def fruit_deviations(self, E: float) -> dict[str, float]:
        """Return the relative standard deviations of E [MPa] due to fruit and poses, by source [1].

        They come from the design's error analysis, whose other sources belong to the individual unit. Without an error
        analysis only Poisson's ratio contributes, because the sensor is taken as level at the centre of the fruit.
        Raises InputError if an error analysis lacks one of the sources.
        """
        rows = self.report.moduli
        if not rows:
            fruit = self.report.design.fruit
            # the change of ln(1 - nu^2) with a standard deviation of nu, which is half its spread
            return {"poisson": fruit.poisson * fruit.poisson_spread / (1.0 - fruit.poisson**2)}
        keys = {name: f"{name}_percent" for name in OF_FRUIT}
        if not all(row.sources.keys() >= set(keys.values()) for row in rows):
            bound = f"with {', '.join(keys.values())}"
            raise validation_error("reading.moduli.sources", None, "", bound, "run the design again")
        return {name: self.interpolate_percent(E, [row.sources[key] for row in rows]) for name, key in keys.items()}

    def unevenness_deviations(self, E: float) -> list[float]:
        """Return the relative standard deviations of E [MPa] due to uneven skin and due to uneven flesh [1].

        They vary from press to press on a fruit. Reports of older versions have none.
        """
        uneven = [row.fruit for row in self.report.moduli if row.fruit is not None]
        if not uneven:
            return []
        skin, flesh = [fruit.skin_percent for fruit in uneven], [fruit.flesh_percent for fruit in uneven]
        return [self.interpolate_percent(E, skin), self.interpolate_percent(E, flesh)]

    def interpolate_percent(self, E: float, percent: Sequence[float]) -> float:
        """Return a percentage at E [MPa] as a fraction [1].

        `percent` has one value for each modulus of the error analysis, between which ln E is interpolated linearly.
        """
        logs = np.log([row.E_MPa for row in self.report.moduli])
        return 0.01 * float(np.interp(math.log(E), logs, percent))

    def form_deviations(self, E: float) -> list[float]:
        """Return the relative standard deviations of E [MPa] due to form errors of the tips [1].

        They are the same in all presses of the unit. Reports of older versions have none. A reference ball removes the
        part that it shows and adds its own error.
        """
        percentages = [row.form_percent for row in self.report.moduli if row.form_percent]
        errors = [self.interpolate_percent(E, percent) for percent in zip(*percentages, strict=True)]
        ball = self.unit.ball
        if ball is None:
            return errors
        remaining = [error - 0.01 * shown for error, shown in zip(errors, ball.form_percent, strict=bool(errors))]
        return [*remaining, 0.01 * ball.percent]

    @property
    def lacks_form(self) -> bool:
        """Return whether the report lacks the form errors of the sensor's domes, because an older version wrote it."""
        rows = self.report.moduli
        return self.domes is not None and bool(rows) and not any(row.form_percent for row in rows)

    def reduced(self, E: float) -> float:
        """Return E / (1 - nu^2) [MPa] from E [MPa], at the Poisson's ratio of the design."""
        return E / (1.0 - self.report.design.fruit.poisson**2)

    def bruises(self, forces: Floats, E: float) -> bool:
        """Return whether forces [N] press a fruit of modulus E [MPa] beyond its bruise limit; False without a limit.

        `forces` (tips,) are corrected for creep. The contact of a dome follows the pressed flesh at large strain, as in
        the verdict on bruises.
        """
        fruit = self.report.design.fruit
        if not fruit.bruise_limits_MPa:
            return False
        tips = self.report.design.tips
        radius = 2.0 / math.fsum(self._given_curvatures or design_curvatures(self.report.design))
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

    def are_plausible(self, forces: Sequence[float] | Floats) -> Flags:
        """Return for each force [N] whether it is plausible: not far below zero and not far beyond full scale."""
        return (self.lowest_forces <= forces) & (forces <= self.largest_forces)

    def ratio_modulus(self, forces: Floats) -> float:
        """Return the modulus [MPa] of a level pair from the ratio of its forces [N], before any correction.

        Raises ReadingError if no modulus has this ratio.
        """
        return ratio_modulus(self.C, self.report.read_out.own_less_other_per_mm or 0.0, forces.tolist())

    def with_stiffness(self, tip: int, factor: float) -> "MeasuringUnit":
        """Return the unit with the spring of tip number `tip` stiffened by `factor` [1]."""
        K = list(self.unit.K_N_per_m)
        K[tip] *= factor
        return replace(self, unit=replace(self.unit, K_N_per_m=tuple(K)))
