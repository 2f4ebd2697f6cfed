"""A printed unit that measures fruit: the read-out of its design with the springs, tips and channels of the unit."""

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
from pipeline.reading.uncertainty import DRIFT_SOURCE, FRUIT_SOURCES, Channels, SlopesOnBall, designed_channels
from pipeline.report.report import Report
from sensor.arrays import Flags, Floats
from sensor.design.reading import ReadingRequirements
from sensor.quantity import UNIFORM_DEVIATION, Estimate, check_type, validation_error
from sensor.theory.contrast_law import Matrix, ratio_modulus, stiffened_compliance
from sensor.theory.contrast_rise import BendSlopes, RiseLaw, RollingDomes
from sensor.theory.creep import EFFECTIVE, CreepLaw
from solve.contact.domes.large_strain import large_strain

PAIR_TILT_DEG = 2.0  # largest tilt of a press without a flag [deg], if the design states none
LEAST_CURVATURE_SPREAD = 0.25
"""Smallest relative standard deviation of the skin's mean curvature [1], if the radii of the fruit are not given.

The cheek of a mango has principal radii of about 47 and 110 mm, so its mean curvature is 1/66 per mm. This is 47 % less
than for a design with a radius of 35 mm: two standard deviations.
"""
_NOISE_FACTOR = 2.0  # noise does not exceed this multiple of the smallest force of a tip in contact
_MAX_FULL_SCALES = 20.0  # a force above this multiple of full scale comes from another sensor, or is in another unit


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
        """Return the measuring unit of a report's design.

        `unit` is a calibrated unit or the path of its unit.toml. By default, the unit has the springs of its design.
        `classes` states ripeness classes, for example `ripe:0.8,unripe`. By default, the classes of the unit are used.
        Raises InputError for a unit of another design, for invalid classes, and for an argument of another type.
        """
        if isinstance(unit, str | Path):
            printed_unit = read_unit(Path(unit), report)  # also refuses a unit of another design
        elif unit is None:
            printed_unit = nominal_unit(report)
        else:
            hint = "a result of twintip.calibrate has it as .unit"
            check_type("unit", unit, PrintedUnit, "a PrintedUnit, or the path of a unit.toml", hint)
            printed_unit = unit
            refuse_other_design(printed_unit, report)
        # An error in the classes is reported under the name of the place where they are stated.
        text, place = (classes, "--classes") if classes else (printed_unit.classes, "unit.classes")
        parsed_classes = ripeness_classes(text, place) if text else None
        return cls(report=report, unit=printed_unit, classes=parsed_classes)

    @cached_property
    def C(self) -> Matrix:
        """Return the compliance matrix of the unit's springs [mm/N], including their coupling through the frame."""
        nominal = self.report.read_out.springs_mm_per_N
        factors = np.multiply(self.unit.stiffnesses, np.diag(nominal))  # stiffnesses relative to the design
        return stiffened_compliance(nominal, factors.tolist())

    @property
    def reads_moments(self) -> bool:
        """Return whether the forces at one moment determine a modulus, as they do for a level pair of flat tips."""
        return self.report.read_out.is_pair and self.report.design.tips.tip_shape.has_flat_face

    @cached_property
    def rise_law(self) -> RiseLaw:
        """Return the law by which the modulus follows from a press; for a pair it holds for any heights of the tips."""
        designed = self.report.read_out.contrast_on(self.C)
        return rise_law(self.report.design, designed, self._given_curvatures)

    @property
    def _given_curvatures(self) -> Curvatures | None:
        """Return the principal curvatures of the fruit [1/mm], or None if its radii are not given."""
        return None if self.radii_mm is None else (1.0 / self.radii_mm[0], 1.0 / self.radii_mm[1])

    @cached_property
    def domes(self) -> RollingDomes | None:
        """Return the domes of a line or a square that roll on the fruit, or None for other tips.

        The fruit has the given radii, or else the radii of the design.
        """
        weights = self.report.read_out.weights
        return None if weights is None else rolling_domes(self.report.design, weights, self._given_curvatures)

    @property
    def curvature_deviation(self) -> float:
        """Return the standard deviation of the mean curvature of the skin [1/mm].

        The curvature is exact, with a deviation of 0, if the radii are given. The result is also 0 if the design has
        reading.radius_mm and its report has an error analysis, because the source `pose` of the analysis then includes
        this error.
        """
        requirements = self.report.design.reading
        is_in_pose = bool(self.report.moduli) and requirements is not None and requirements.radius_mm is not None
        if self.radii_mm is not None or is_in_pose:
            return 0.0
        # Radii are distributed uniformly within the stated spread, which is relative to the radius of the design.
        stated_spread = 0.0 if requirements is None else UNIFORM_DEVIATION * requirements.radius_spread
        mean_curvature = 0.5 * math.fsum(design_curvatures(self.report.design))
        return mean_curvature * max(stated_spread, LEAST_CURVATURE_SPREAD)

    @property
    def height_deviation(self) -> float:
        """Return the standard deviation of each tip's protrusion [mm], from the accuracy of the print process."""
        # The stated accuracy of a print process is two standard deviations.
        return 0.5 * tip_accuracy_mm(self.report.design.tips, self.report.design.process)

    @property
    def model_error(self) -> float:
        """Return the relative error of the contact model [1]."""
        return 0.01 * self.report.read_out.model_error_percent

    @cached_property
    def channels(self) -> Channels:
        """Return the errors of the channels and springs, in a press that lasts as long as the design states.

        The unit states the errors of its springs, gains and creep. The design states all other errors.
        """
        read_out = self.report.read_out
        full_scale = np.array(read_out.full_scale_N)
        designed = designed_channels(self.report.design.reading or ReadingRequirements(), full_scale, read_out.signal)
        on_ball = None
        if self.unit.ball is not None:
            on_ball = SlopesOnBall(np.array(self.unit.ball.spring_slopes), np.array(self.unit.ball.gain_slopes))
        return replace(
            designed,
            gains=self._gain_deviations,
            springs=0.01 * np.array(self.unit.K_percent),
            time_s=0.0,  # `channels_in` sets it, because it depends on the log of a press
            on_plate=self.unit.calibrated_by == "plate",
            creep=self._creep_deviation(self.report.design.press_s),
            on_ball=on_ball,
        )

    @property
    def _gain_deviations(self) -> dict[str, Floats]:
        """Return the relative standard deviations (channels,) of the gains [1], by their cause.

        Gains drift between the presses on a reference ball and on fruit. So for a unit with a ball correction, the
        drift is separated from `gain_percent`.
        """
        gain_error = 0.01 * np.array(self.unit.gain_percent)
        if self.unit.ball is None:
            return {"gain": gain_error}
        drift_percent = np.array(self.report.read_out.channels.gain_drift_percent)
        # A drift is uniform within its bound, so UNIFORM_DEVIATION turns the bound into a standard deviation.
        drift = np.minimum(0.01 * UNIFORM_DEVIATION * drift_percent, gain_error)
        return {"gain": np.sqrt(gain_error**2 - drift**2), DRIFT_SOURCE: drift}

    def channels_in(self, time_s: float, press_s: float | None) -> Channels:
        """Return the errors of the channels and springs in a press that lasts `press_s` [s].

        If `press_s` is None, the press lasts as long as the design states. `time_s` [s] is the standard deviation of
        each channel's sampling time.
        """
        creep = self._creep_deviation(press_s or self.report.design.press_s)
        return replace(self.channels, time_s=time_s, creep=creep)

    def _creep_deviation(self, press_s: float) -> float:
        """Return the relative standard deviation of all stiffnesses [1] due to creep in a press of `press_s` seconds.

        The springs were measured either with weights or, if the unit has a ball correction, by presses on the ball.
        """
        ball = self.unit.ball
        measured_after = self.unit.weighed_after_s if ball is None else EFFECTIVE * ball.press_s
        return self.creep.deviation(measured_after, press_s)

    def for_ball(self, radius_mm: float) -> "MeasuringUnit":
        """Return a copy of the unit for an elastic ball of radius `radius_mm` [mm], without its ball correction."""
        report = replace(self.report, design=self.report.design.without_relaxation)
        return replace(self, report=report, unit=replace(self.unit, ball=None), radii_mm=(radius_mm, radius_mm))

    @cached_property
    def noises(self) -> Floats:
        """Return the standard deviation of the noise of each channel [N]."""
        return self.channels.noises

    @cached_property
    def creep(self) -> CreepLaw:
        """Return the measured creep of the unit's springs, or the creep of the print process."""
        return self.unit.measured_creep_or(self.report.creep)

    def press_stiffness_ratio(self, press_s: float | None = None) -> float:
        """Return the stiffness of the springs in a press, divided by their stiffness under calibration weights [1].

        `press_s` [s] is the time from the first touch to the deepest point. If it is None, the press lasts as long as
        the design states.
        """
        return self.creep.press_stiffness_ratio(self.unit.weighed_after_s, press_s or self.report.design.press_s)

    def softening_in_hold(self, held_s: float, press_s: float | None = None) -> float:
        """Return the stiffness of the springs after a hold of `held_s` [s], divided by the stiffness at its start [1].

        `press_s` [s] is the duration of the press before the hold, as in `press_stiffness_ratio`.
        """
        return 1.0 / self.creep.growth_in_hold(held_s, press_s or self.report.design.press_s)

    def bend_error(self, channels: BendSlopes, springs: BendSlopes) -> float:
        """Return the absolute error of ln E [1] that nonlinear channels and springs cause.

        `channels` and `springs` are the slopes of ln E against relative errors of the gains and of the spring
        compliances. Each relative error has a value at zero force and a part that is proportional to the force. An
        error that the unit does not state is taken as 0.
        """
        unit = self.unit
        stated_bends = (
            (channels, unit.force_bend, unit.force_bend_per_N),
            (springs, unit.deflection_bend, unit.deflection_bend_per_N),
        )
        error = 0.0
        for slopes, error_at_zero, error_per_N in stated_bends:
            if error_at_zero is not None and error_per_N is not None:
                error += float(np.dot(slopes.at_zero, error_at_zero) + np.dot(slopes.per_N, error_per_N))
        return abs(error)

    @cached_property
    def least_forces(self) -> Floats:
        """Return for each channel the smallest force of a tip in contact [N]."""
        return self.channels.least_forces

    @cached_property
    def lowest_forces(self) -> Floats:
        """Return for each channel the lowest plausible force [N], which is further below zero than noise reaches."""
        return -_NOISE_FACTOR * self.least_forces

    @cached_property
    def largest_forces(self) -> Floats:
        """Return for each channel the largest plausible force [N]."""
        return _MAX_FULL_SCALES * np.array(self.report.read_out.full_scale_N)

    @property
    def range_MPa(self) -> tuple[float, float]:
        """Return the smallest and the largest modulus of the design's range [MPa]."""
        return min(self.report.design.fruit.E_MPa), self.report.design.fruit.largest_E_MPa

    @property
    def steepest_deg(self) -> float:
        """Return the largest tilt from the normal of the skin that the design allows [deg]."""
        requirements = self.report.design.reading
        return PAIR_TILT_DEG if requirements is None else requirements.tilt_deg + requirements.tilt_change_deg

    @property
    def tilt_deviation_deg(self) -> float:
        """Return the standard deviation of the apparent tilt due to errors of the tip heights [deg]; 0 for a pair.

        The tilt is the slope of a plane fitted through the tips. Its standard deviation is the standard deviation of
        one height, divided by the root sum of squares of the tips' distances from the centre.
        """
        if self.report.read_out.is_pair:
            return 0.0
        positions = np.array(self.report.design.tips.places_mm)  # (tips, 2) [mm]
        spreads = np.sqrt(np.square(positions - positions.mean(axis=0)).sum(axis=0))  # along x and along y [mm]
        spread = float(spreads.max())  # tips in a line have no spread across the line
        # A dome rolls on a round fruit, so a tilt changes the height of its contact less than the height of its axis.
        rolling = 1.0 if self.domes is None else self.domes.rolling_factor
        return math.degrees(math.atan(rolling * self.height_deviation / spread))

    @property
    def lead_deviation(self) -> float:
        """Return the standard deviation [mm] of the travel from the first touch of a pair to the second, due to tilt.

        The tilt is distributed uniformly up to the largest tilt of the design.
        """
        return UNIFORM_DEVIATION * math.tan(math.radians(self.steepest_deg)) * self.report.design.tips.spacing_mm

    @property
    def ball_factor(self) -> float:
        """Return the factor by which a reference ball corrects all readings [1]; 1 without a ball."""
        return 1.0 if self.unit.ball is None else self.unit.ball.factor

    def correct_modulus(self, uncorrected: float, press_s: float | None = None) -> float:
        """Return the modulus [MPa] of a fruit from the `uncorrected` modulus [MPa] that a level press yields.

        Creep is corrected first, because a press is shorter than the time for which calibration weights hang. Then the
        level readings of the report correct the result, and last the factor of a reference ball. `press_s` [s] is the
        duration of the press. If it is None, the press lasts as long as the design states.
        """
        without_creep = self.press_stiffness_ratio(press_s) * uncorrected
        return self.ball_factor * correct_reading(without_creep, self.report.read_out.level_readings)

    def uncorrected_modulus(self, E: float) -> float:
        """Return the uncorrected modulus [MPa] that a level press reads on a fruit of modulus E [MPa].

        This is the inverse of `correct_modulus` for a press that lasts as long as the design states.
        """
        before_ball = E / self.ball_factor  # modulus before the correction by the ball [MPa]
        level = self.report.read_out.level_readings
        if not level:  # then only the creep and the ball correct a reading
            return before_ball / self.press_stiffness_ratio()
        true_logs, read_logs = np.log([(row.E_MPa, row.read_MPa) for row in level]).T
        shift = np.interp(math.log(before_ball), true_logs, read_logs - true_logs)  # ln(read / true)
        return before_ball * math.exp(shift) / self.press_stiffness_ratio()

    def steepness(self, E: float) -> float:
        """Return the derivative of ln E with respect to ln(reading) at E [MPa].

        Relative errors of the reading are multiplied by this derivative. A fruit without a skin has the steepness 1,
        because its reading is proportional to E.
        """
        if self.report.design.fruit.skin_mm is None:
            return 1.0
        level = self.report.read_out.level_readings
        logs = np.log([row.E_MPa for row in level])
        slopes = np.gradient(logs, np.log([row.read_MPa for row in level]))
        return float(np.interp(math.log(E), logs, slopes))

    def refuse_without_rise_level(self) -> None:
        """Raise InputError if the report of a line or a square has no level readings of whole presses.

        Reports from versions before 0.2 lack these readings. Reports of designs whose travel is too short for a reading
        lack them too.
        """
        if not self.report.read_out.is_pair and not self.report.read_out.level_readings:
            hint = "run the design again; if that does not help, increase press.travel_mm, which is too short to read"
            raise validation_error("read_out.rise_level", None, "", "readings of whole presses in report.json", hint)

    def fruit_deviations(self, E: float) -> dict[str, float]:
        """Return the relative standard deviation [1] of E [MPa] due to each property of the fruit and the pose.

        The keys are the sources of error. The deviations come from the error analysis of the design, whose other
        sources depend on the unit. Without an error analysis, the sensor is assumed to be level at the centre of the
        fruit, so that only Poisson's ratio contributes. Raises InputError if the error analysis lacks a source.
        """
        rows = self.report.moduli  # one row per modulus of the error analysis
        if not rows:
            fruit = self.report.design.fruit
            # E is proportional to 1 - nu^2, so d ln E / d nu = -2 nu / (1 - nu^2). The standard deviation of nu is half
            # of its spread, which cancels the factor 2.
            return {"poisson": fruit.poisson * fruit.poisson_spread / (1.0 - fruit.poisson**2)}
        keys = {name: f"{name}_percent" for name in FRUIT_SOURCES}
        if not all(row.sources.keys() >= set(keys.values()) for row in rows):
            bound = f"a table with the keys {', '.join(keys.values())}"
            raise validation_error("reading.moduli.sources", None, "", bound, "run the design again")
        return {name: self.interpolate_percent(E, [row.sources[key] for row in rows]) for name, key in keys.items()}

    def unevenness_deviations(self, E: float) -> list[float]:
        """Return the relative standard deviations of E [MPa] due to uneven skin and due to uneven flesh [1].

        Both deviations vary from press to press on the same fruit. The list is empty for reports of older versions.
        """
        uneven_rows = [row.fruit for row in self.report.moduli if row.fruit is not None]
        if not uneven_rows:
            return []
        skin = [row.skin_percent for row in uneven_rows]
        flesh = [row.flesh_percent for row in uneven_rows]
        return [self.interpolate_percent(E, skin), self.interpolate_percent(E, flesh)]

    def interpolate_percent(self, E: float, percent: Sequence[float]) -> float:
        """Return the value at E [MPa] of an error that the error analysis states in percent, as a fraction [1].

        `percent` holds one percentage per modulus of the error analysis. It is interpolated linearly in ln E.
        """
        logs = np.log([row.E_MPa for row in self.report.moduli])
        return 0.01 * float(np.interp(math.log(E), logs, percent))

    def form_deviations(self, E: float) -> list[float]:
        """Return the relative standard deviations of E [MPa] due to form errors of the tips [1].

        Form errors are the same in all presses of the unit. Reports of older versions state none. The correction by a
        reference ball removes a part of these errors and adds its own error, which is the last item.
        """
        rows = [row.form_percent for row in self.report.moduli if row.form_percent]  # one row per modulus
        errors = [self.interpolate_percent(E, percent) for percent in zip(*rows, strict=True)]  # one per form error
        ball = self.unit.ball
        if ball is None:
            return errors
        ball_error = 0.01 * ball.percent
        if not errors:  # the report of an older version, although the ball may state form errors
            return [ball_error]
        corrections = zip(errors, ball.form_percent, strict=True)
        remaining_errors = [error - 0.01 * corrected_percent for error, corrected_percent in corrections]
        return [*remaining_errors, ball_error]

    @property
    def lacks_form(self) -> bool:
        """Return whether the error analysis of the report lacks the form errors of domes, as in older versions."""
        rows = self.report.moduli
        return self.domes is not None and bool(rows) and not any(row.form_percent for row in rows)

    def ripeness_of(self, E: float) -> str | None:
        """Return the ripeness class of a fruit of modulus E [MPa], or None if no classes are stated."""
        return None if self.classes is None else self.classes.class_of(E)

    def firmness_of(self, E: float) -> Estimate | None:
        """Return the firmness that another instrument measures on a fruit of modulus E [MPa].

        The result is None if the unit has no scale for it, or if the scale does not cover E.
        """
        return None if self.unit.scale is None else self.unit.scale.firmness_of(E)

    def reduced(self, E: float) -> float:
        """Return E / (1 - nu^2) [MPa] from E [MPa], at the Poisson's ratio of the design."""
        return E / (1.0 - self.report.design.fruit.poisson**2)

    def bruises(self, forces: Floats, E: float) -> bool:
        """Return whether a contact pressure exceeds the bruise limit of a fruit of modulus E [MPa].

        The result is False if the fruit has no bruise limit. The limit is interpolated at E from the table of the
        design. `forces` (tips,) [N] are corrected for creep.
        """
        fruit = self.report.design.fruit
        if not fruit.bruise_limits_MPa:
            return False
        areas = self._contact_areas(forces, E)
        limit = float(np.interp(E, fruit.E_MPa, fruit.bruise_limits_MPa))  # largest pressure [MPa]
        return bool(np.any(forces > limit * areas))

    def _contact_areas(self, forces: Floats, E: float) -> Floats:
        """Return the contact areas (tips,) [mm^2] under the `forces` (tips,) [N] on a fruit of modulus E [MPa].

        The contact area of a dome is corrected for large strain, as in the verdict `bruise`.
        """
        tips = self.report.design.tips
        # radius of a sphere with the mean curvature of the fruit [mm]
        radius = 2.0 / math.fsum(self._given_curvatures or design_curvatures(self.report.design))
        contact_area = tips.tip_shape.contact_area_mm2
        areas = np.array([contact_area(force, self.reduced(E), radius) for force in forces.tolist()])
        if tips.dome_radius_mm is None:
            return areas
        poisson = self.report.design.fruit.poisson
        strain = large_strain(np.sqrt(areas / np.pi), tips.dome_radius_mm, np.array(1.0 / radius), poisson)
        # `edge` corrects the contact radius, and `factor` corrects the force of Hertz's law. By that law, the contact
        # area is proportional to force^(2/3).
        return np.asarray(areas * (strain.edge**2 / strain.factor ** (2.0 / 3.0)))

    def forces_of_channels(self, channels: Sequence[float]) -> Floats:
        """Return the forces of the tips [N] from the readings of the channels [N]."""
        return np.multiply(self.unit.gain, channels)

    def are_plausible(self, forces: Sequence[float] | Floats) -> Flags:
        """Return whether each force [N] is plausible: neither far below zero nor far above full scale."""
        return (self.lowest_forces <= forces) & (forces <= self.largest_forces)

    def ratio_modulus(self, forces: Floats) -> float:
        """Return the modulus [MPa] from the force ratio of a level pair with these forces [N], before any correction.

        Raises ReadingError if no modulus yields this ratio.
        """
        return ratio_modulus(self.C, self.report.read_out.own_less_other_per_mm or 0.0, forces.tolist())

    def with_stiffness(self, tip: int, factor: float) -> "MeasuringUnit":
        """Return a copy of the unit in which the stiffness of spring number `tip` is multiplied by `factor` [1]."""
        K = list(self.unit.K_N_per_m)
        K[tip] *= factor
        return replace(self, unit=replace(self.unit, K_N_per_m=tuple(K)))
