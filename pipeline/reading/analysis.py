"""The error analysis of readings over all poses: bias, uncertainty, touch of the last tip, and pressure on the skin."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.reading.bench_uncertainty import calibration_errors
from pipeline.reading.form import form_error_changes, interpolate_to_middle
from pipeline.reading.measurement import RiseModel, rise_model, seated_level_readings
from pipeline.reading.poses import Placement, occurring_placements, read_moduli
from pipeline.reading.pressed_sensor import RISE_TRAVELS, PressedSensor, SampledPresses
from pipeline.reading.read_out import LevelReading, ReadingConstants
from pipeline.reading.reading_records import CalibrationErrors, SkinPressure, UnevenFruit
from pipeline.reading.uncertainty import (
    Channels,
    SlopesOnBall,
    UncertaintySources,
    designed_channels,
    heat_uncertainty,
    uncertainty_sources,
)
from pipeline.reading.uneven import uneven_fruit
from pipeline.response.scene_press import ScenePress
from pipeline.storage.plain import first_largest
from sensor.arrays import Flags, Floats, rows_of
from sensor.design.parameters import Design
from sensor.design.reading import PRESS_S, PRESS_SAMPLES, ReadingRequirements
from sensor.quantity import UNIFORM_DEVIATION, Estimate
from sensor.record import Record
from sensor.theory.contrast_law import ReadingError
from sensor.theory.contrast_rise import RiseError, RiseReading
from solve.contact.pose_forces import Pose
from solve.fruit.compliance import FruitCompliance
from solve.halfspace.layered import base_compliance

TILTS = 5  # number of tilts at which presses are solved for the page
_LARGE_BIAS = 0.5  # only a bias of at least this fraction of the largest bias gets an error bar, to save time
_LARGEST_POISSON = 0.499  # largest Poisson's ratio that is evaluated; at 0.5 the flesh would be incompressible
NOISE_LIMIT = 0.1  # uncertainty of the modulus [1] at which the noise is reported
PressReadings = list[list[RiseReading | None]]
"""A reading for each modulus (rows) in each placement (columns); None for a press without a reading."""


@dataclass(frozen=True, kw_only=True)
class ModulusAccuracy:
    """The bias and the uncertainty of readings at one modulus E [MPa]; the bias is the largest error over all poses.

    `bias` [1] is the error of E read in the pose `worst`. `reach` [1] is the error in the pose whose error bar extends
    farthest from 0, which may be a different pose. `sources` are the uncertainties for a random fruit in a random pose.
    `uncertainty_limit` [1] is the limit of their total. `uneven` is the additional uncertainty on uneven fruit; it is
    None if it is unknown. `form` holds the relative change of E [1] due to one standard deviation of each form error of
    the domes. These changes do not include a correction by a reference ball.
    """

    E: float
    bias: Estimate
    worst: Placement
    reach: Estimate
    sources: UncertaintySources
    uncertainty_limit: float
    uneven: UnevenFruit | None = None
    form: tuple[float, ...] = ()

    @property
    def over_limit(self) -> float:
        """Return the standard uncertainty divided by its limit [1]."""
        return self.sources.total / self.uncertainty_limit


@dataclass(frozen=True, kw_only=True, repr=False)
class ReadingAccuracy(Record):
    """The accuracy of the moduli that are read from whole presses.

    `moduli` has a row for each modulus; it is empty if a level press has no reading. `touch` [1] is the travel at which
    the last tip touches, as a fraction of the full travel, in the worst pose. `refused` states how many poses have no
    reading, and why. `refused` is None if all poses have a reading. The bias and the uncertainty leave out the poses
    without a reading. `level` are the readings of level presses, by which all other readings are corrected.
    `full_scale` (tips,) [N] is the largest force of each channel over all poses. `pressures` are the pressures on the
    skin at each modulus. `flesh` [1] is the possible change of E, up or down, if the flesh under domes obeys Hencky's
    or Storakers' law. `face_mm` is the smallest width of a dome's face that contains the contact in every pose; it is 0
    for other tips. `calibration` are the errors that remain in the springs and gains after calibration.
    """

    method: str
    touch: Estimate
    level: tuple[LevelReading, ...] = ()
    moduli: tuple[ModulusAccuracy, ...] = ()
    refused: str | None = None
    full_scale: tuple[float, ...] | None = None
    pressures: tuple[SkinPressure, ...] = ()
    flesh: float = 0.0
    face_mm: float = 0.0
    calibration: CalibrationErrors | None = None

    @property
    def worst_bias(self) -> ModulusAccuracy:
        """Return the row of the modulus with the largest bias."""
        return self.moduli[_index_of_largest([row.bias.value for row in self.moduli])]

    @property
    def bias(self) -> Estimate | None:
        """Return the largest absolute bias over all moduli, with its error [1]."""
        return _absolute(self.worst_bias.bias) if self.moduli else None

    @property
    def reach(self) -> Estimate | None:
        """Return the absolute bias whose error bar extends farthest from 0 [1]."""
        reaches = [_absolute(row.reach) for row in self.moduli]
        return max(reaches, key=lambda reach: reach.value + reach.error, default=None)

    @property
    def worst_uncertainty(self) -> ModulusAccuracy:
        """Return the row of the modulus at which the uncertainty is largest relative to its limit."""
        return self.moduli[first_largest(row.over_limit for row in self.moduli)]

    @property
    def uncertainty(self) -> Estimate | None:
        """Return the standard uncertainty of the row `worst_uncertainty`, with its error [1]."""
        if not self.moduli:
            return None
        worst = self.worst_uncertainty
        return Estimate(worst.sources.total, worst.reach.error * worst.sources.total)

    @property
    def uneven(self) -> UnevenFruit | None:
        """Return the largest additional uncertainty due to uneven skin and flesh over all moduli; None if unknown."""
        known = [row.uneven for row in self.moduli if row.uneven is not None]
        return max(known, key=lambda uneven: uneven.one_press_percent, default=None)

    @property
    def noise_percent(self) -> float | None:
        """Return the noise [% of full scale] for an uncertainty of 10 %; None if it exceeds 10 % without noise."""
        return self.worst_uncertainty.sources.noise_to_reach(NOISE_LIMIT) if self.moduli else None


def analyse_readings(sensor: PressedSensor) -> ReadingAccuracy | None:
    """Compute the accuracy of the moduli that a sensor reads, over all fruits and poses that its design allows.

    Presses at several moduli are solved in all these poses. A modulus is read from each press by the rise of its
    contrast, and compared with the true modulus. The result is None if the design has no `[reading]`. The result has no
    moduli if a level press has no reading.

    Raises InputError for a pose that the contact solver cannot handle, and SolveError if a solution is not exact.
    """
    design = sensor.design
    reading = design.reading
    if reading is None:
        return None
    presses = sensor.presses(read_moduli(design.fruit), tuple(occurring_placements(design, reading)))
    model = rise_model(sensor)
    channels, calibration = _calibrated_channels(sensor, reading, presses.full_scale)
    press_readings, refused_text = _read_presses(model, presses, channels, design.tips.side_mm)
    analysis = ReadingAccuracy(
        method=model.method,
        touch=touch_fraction(presses),
        level=model.level,
        refused=refused_text,
        calibration=calibration,
        face_mm=float(presses.face_mm.max()),
        pressures=_skin_pressures(sensor, presses),
    )
    # The first placement is the level press. It is used to correct all other presses. Without its readings, no accuracy
    # can be given, so the analysis has no moduli.
    if any(level is None for level, *_ in press_readings):
        return analysis
    try:
        moduli = _accuracy_by_modulus(sensor, model, presses, channels, press_readings)
    except RiseError:  # a press with barely enough rise may lose its modulus if its forces change slightly
        return analysis
    flesh_change = _change_by_law_of_flesh(model, presses)
    return replace(analysis, moduli=moduli, full_scale=tuple(presses.full_scale.tolist()), flesh=flesh_change)


def _change_by_law_of_flesh(model: RiseModel, presses: SampledPresses) -> float:
    """Return the largest relative change of E [1] in a level press if the flesh obeys another constitutive law.

    The level press is placement 0 of `presses`. The change is 0 if the law does not change any force. Raises RiseError
    if a level press with the changed forces has no modulus.
    """
    if not presses.flesh.any():
        return 0.0
    return max(map(model.modulus_change, presses.F[:, 0], presses.flesh[:, 0]))


def _calibrated_channels(
    sensor: PressedSensor, reading: ReadingRequirements, full_scale: Floats
) -> tuple[Channels, CalibrationErrors]:
    """Return the errors of the channels after the calibration of a unit, and the errors that the calibration leaves.

    `reading` holds the requirements on readings, and `full_scale` (tips,) [N] the largest force of each channel.
    """
    press_s = max(PRESS_S, sensor.fastest_press_s or 0.0)  # a read-out may not allow presses as fast as `PRESS_S`
    channels = designed_channels(reading, full_scale, sensor.signal, sensor.springs.creep, press_s)
    stiffnesses = 1.0 / np.diag(sensor.C)  # stiffness of the spring under each tip [N/mm]
    calibration = calibration_errors(sensor.design, full_scale, stiffnesses, channels.noises)
    return channels.calibrated(calibration), calibration


def _accuracy_by_modulus(
    sensor: PressedSensor, model: RiseModel, presses: SampledPresses, channels: Channels, press_readings: PressReadings
) -> tuple[ModulusAccuracy, ...]:
    """Compute for each modulus the largest bias over all placements, and the uncertainty of a reading.

    The uncertainty is a root mean square over the random placements, because these represent how often each pose
    occurs. `press_readings` holds the readings of `presses` by `model`, and `channels` the errors of springs and gains.
    Raises RiseError if a press has no modulus after a small change of its forces.
    """
    design, placements = sensor.design, presses.placements
    # `design.reading` is never None here, because `analyse_readings` returns early without `[reading]`.
    reading = design.reading or ReadingRequirements()
    biases = _relative_errors(press_readings, presses.moduli)
    bias_errors = _bias_errors(model, presses, biases)
    fruit_sources = _fruit_uncertainties(design, model, presses, biases)
    random_presses, random_readings = _random_presses(presses, press_readings)
    # relative changes of E due to each form error of the domes: for each modulus an array (presses, form errors)
    form_changes = [np.array([form_error_changes(design, model, press) for press in row]) for row in random_presses]
    other_sources = _other_sources(sensor, reading, presses.moduli, form_changes, fruit_sources)
    if reading.calibrated_by == "ball":
        channels = replace(channels, on_ball=_slopes_on_ball(presses.moduli, random_readings))
    rows = []
    for i, (E, bias, error) in enumerate(zip(presses.moduli, np.nan_to_num(biases), bias_errors, strict=True)):
        worst = _index_of_largest(bias)
        farthest = _index_of_largest(np.abs(bias) + error)  # the error bar that extends farthest from 0
        row = ModulusAccuracy(
            E=E,
            bias=Estimate(float(bias[worst]), float(error[worst])),
            worst=placements[worst],
            reach=Estimate(float(bias[farthest]), float(error[farthest])),
            sources=uncertainty_sources(random_readings[i], channels, RISE_TRAVELS, other_sources[i]),
            uncertainty_limit=reading.uncertainty_limit_at(E, design.fruit.E_MPa),
            uneven=uneven_fruit(design, model, random_presses[i]),
            form=tuple(form_changes[i].mean(axis=0).tolist()),
        )
        rows.append(row)
    return tuple(rows)


def _relative_errors(press_readings: PressReadings, moduli: Sequence[float]) -> Floats:
    """Return the relative error of each modulus read [1], shape (moduli, placements); nan without a reading.

    `moduli` [MPa] are the true moduli.
    """
    E_read = np.array([[math.nan if reading is None else reading.E for reading in row] for row in press_readings])
    return np.asarray(E_read / np.array(moduli)[:, None] - 1.0)


def _fruit_uncertainties(
    design: Design, model: RiseModel, presses: SampledPresses, biases: Floats
) -> list[dict[str, float]]:
    """Return for each modulus the standard uncertainties [1] due to the fruit and the pose, by their names.

    The sources are the pose, the thickness of the flesh, and Poisson's ratio. `biases` [1] has the shape (moduli,
    placements). The first placement of `presses` is the level press, for which the effect of Poisson's ratio is
    computed.
    """
    by_pose = uncertainty_by_pose(biases, presses.placements).tolist()
    by_thickness = uncertainty_by_thickness(biases, presses.placements).tolist()
    level_presses = presses.F[:, 0]
    by_poisson = [uncertainty_by_poisson(design, model, press) for press in level_presses]
    rows = zip(by_pose, by_thickness, by_poisson, strict=True)
    return [{"pose": pose, "thickness": thickness, "poisson": poisson} for pose, thickness, poisson in rows]


def _other_sources(
    sensor: PressedSensor,
    reading: ReadingRequirements,
    moduli: Sequence[float],
    form_changes: Sequence[Floats],
    fruit_sources: Sequence[Mapping[str, float]],
) -> list[dict[str, float]]:
    """Return for each modulus the uncertainties [1] that are not due to noise, springs or gains, by their names.

    The sources are the temperature of the leaves, the form errors of the domes, the reference ball and the fruit.
    `form_changes` holds for each modulus an array (presses, form errors) of relative changes of E [1]. A calibration on
    a ball removes a part of these changes, but adds the uncertainty of the ball. `fruit_sources` holds for each modulus
    the uncertainties due to the fruit and the pose.
    """
    ball_uncertainty: dict[str, float] = {}
    if reading.calibrated_by == "ball":
        form_changes = _changes_beyond_ball(moduli, form_changes)
        ball_uncertainty = {"ball": 0.01 * reading.ball_percent}
    heat = heat_uncertainty(sensor.signal)
    return [
        {**heat, **_form_uncertainty(changes), **ball_uncertainty, **sources}
        for changes, sources in zip(form_changes, fruit_sources, strict=True)
    ]


def _random_presses(
    presses: SampledPresses, press_readings: PressReadings
) -> tuple[list[list[Floats]], list[list[RiseReading]]]:
    """Return the presses in random placements that have a reading, as two lists with a row for each modulus.

    The first list holds the forces (samples, tips) [N] of each press, and the second list the readings.
    `press_readings` holds the readings of all `presses`.
    """
    # The level press, placement 0, is added to the random placements, because all of them may lack a reading.
    random_indices = [0, *(index for index, placement in enumerate(presses.placements) if placement.is_random)]
    random_presses: list[list[Floats]] = []
    random_readings: list[list[RiseReading]] = []
    for forces, row in zip(presses.F, press_readings, strict=True):
        random_presses.append([forces[index] for index in random_indices if row[index] is not None])
        readings_or_none = [row[index] for index in random_indices]
        random_readings.append([reading for reading in readings_or_none if reading is not None])
    return random_presses, random_readings


def _form_uncertainty(changes: Floats) -> dict[str, float]:
    """Return the standard uncertainty of a reading due to the form errors of the domes [1], by its name.

    `changes` (presses, form errors) [1] are the relative changes of E due to one standard deviation of each form error.
    The form errors are independent, so their squares add. The result is empty if the tips are not domes.
    """
    if not changes.size:
        return {}
    return {"dome_form": float(np.sqrt(np.square(changes).sum(axis=1).mean()))}


def _changes_beyond_ball(moduli: Sequence[float], changes: Sequence[Floats]) -> list[Floats]:
    """Return the relative changes of E [1] that remain after calibration on a reference ball, shaped like `changes`.

    `changes` holds an array (presses, form errors) for each of the `moduli` [MPa]. The calibration removes the change
    that fruit and ball have in common. The ball is assumed to have the geometric mean of the smallest and the largest
    modulus.
    """
    mean_changes = np.array([changes_at_modulus.mean(axis=0) for changes_at_modulus in changes])
    changes_on_ball = interpolate_to_middle(moduli, mean_changes)
    return [changes_at_modulus - changes_on_ball for changes_at_modulus in changes]


def _slopes_on_ball(moduli: Sequence[float], readings: Sequence[Sequence[RiseReading]]) -> SlopesOnBall:
    """Return the slopes of ln E with respect to errors of springs and gains, in presses on a reference ball.

    The ball is assumed to have the geometric mean of the smallest and the largest of the `moduli` [MPa]. The slopes at
    each modulus are averaged over its `readings` in random poses, and then interpolated to the modulus of the ball.
    """
    springs = np.array([np.mean([reading.slopes.springs for reading in row], axis=0) for row in readings])
    gains = np.array([np.mean([reading.slopes.gains for reading in row], axis=0) for row in readings])
    # both have the shape (moduli, tips)
    return SlopesOnBall(springs=interpolate_to_middle(moduli, springs), gains=interpolate_to_middle(moduli, gains))


def _read_presses(
    model: RiseModel, presses: SampledPresses, channels: Channels, side_mm: float
) -> tuple[PressReadings, str | None]:
    """Read a modulus from each press, and return the readings and a text about the presses without a reading.

    The text has the number of these presses and the reason for the first one. The text is None if every press has a
    reading. `channels` determine the noise of the forces, and the force above which a tip is considered to touch. A
    press has no reading if its contact is wider than the face of a dome, `side_mm` [mm], or if `model` cannot determine
    a modulus.
    """
    # A solved press has fewer samples than a real press. The effect of noise on E decreases with the square root of the
    # number of samples. The noise of a sample is therefore reduced, so that its effect is the same as in a real press.
    noises = channels.noises * math.sqrt(RISE_TRAVELS / PRESS_SAMPLES)
    least_forces = channels.least_forces
    reasons = []
    press_readings: PressReadings = []
    for E, forces, widths in zip(presses.moduli, presses.F, presses.face_mm.tolist(), strict=True):
        row: list[RiseReading | None] = []
        for placement, press, width in zip(presses.placements, forces, widths, strict=True):
            try:
                _refuse_wide_contact(width, side_mm)
                row.append(model.read(press, noises, least_forces))
            except ReadingError as error:
                row.append(None)
                reasons.append(f"as at {E:.3g} MPa, {placement}: {error}")
        press_readings.append(row)
    if not reasons:
        return press_readings, None
    count = len(presses.moduli) * len(presses.placements)
    return press_readings, f"{len(reasons)} of {count} poses have no reading, {reasons[0]}"


def _refuse_wide_contact(width: float, side_mm: float) -> None:
    """Raise ReadingError if a contact of this `width` [mm] extends beyond the face of a dome, `side_mm` [mm]."""
    if width > side_mm:
        msg = f"tips.side_mm = {side_mm:g} mm is less than the {width:.3g} mm that the contact needs"
        raise ReadingError(msg)


def _bias_errors(model: RiseModel, presses: SampledPresses, biases: Floats) -> Floats:
    """Return the error of each bias [1] due to the error of the solved forces, shape (moduli, placements).

    To save time, the error is computed only if the bias is at least half of the largest bias at its modulus. Otherwise
    the error is 0. The errors of the forces have the same sign under all tips, because all tips press the same fruit.
    """
    magnitudes = np.abs(np.nan_to_num(biases))
    is_large = np.isfinite(biases) & (magnitudes >= _LARGE_BIAS * magnitudes.max(axis=1, keepdims=True))
    # The error of the level press, placement 0, is always computed.
    is_large[:, 0] = True
    errors = np.zeros_like(biases)
    for i, j in np.argwhere(is_large).tolist():
        errors[i, j] = model.modulus_change(presses.F[i, j], presses.error[i, j])
    return errors


def uncertainty_by_pose(biases: Floats, placements: Sequence[Placement]) -> Floats:
    """Return the standard uncertainty [1] due to the shape of the fruit and the pose at each modulus, shape (moduli,).

    The uncertainty is the root mean square of the biases in the random placements. `biases` [1] has the shape (moduli,
    placements). A bias is nan if its press has no reading. Such a bias is left out.
    """
    random_biases = biases[:, [placement.is_random for placement in placements]]
    count = np.isfinite(random_biases).sum(axis=1)
    # If no press has a reading, the sum is 0. It is then divided by 1, so that the result is 0.
    return np.asarray(np.sqrt(np.nansum(random_biases**2, axis=1) / np.maximum(count, 1)))


def uncertainty_by_thickness(biases: Floats, placements: Sequence[Placement]) -> Floats:
    """Return the standard uncertainty [1] due to the unknown flesh thickness at each modulus, shape (moduli,).

    The uncertainty follows from the largest change of the bias between flesh with the thickness of the design and flesh
    at either end of the range of thicknesses. The thickness is assumed to be uniformly distributed within this range
    (JCGM 100:2008, 4.3.7). `biases` [1] has the shape (moduli, placements).
    """
    changes = [np.zeros(len(biases))]  # no change at the thickness of the design
    for index, placement in enumerate(placements):
        if placement.thickness_mm is not None:
            # the same placement on flesh with the thickness of the design
            nominal_index = placements.index(replace(placement, thickness_mm=None))
            changes.append(biases[:, index] - biases[:, nominal_index])
    # A change is nan if one of its two presses has no reading. Such a change is replaced by 0, so that it is ignored.
    largest_changes = np.abs(np.nan_to_num(changes)).max(axis=0)
    return np.asarray(UNIFORM_DEVIATION * largest_changes)


def uncertainty_by_poisson(design: Design, model: RiseModel, press: Floats) -> float:
    """Return the standard uncertainty of a reading [1] due to Poisson's ratio nu, which differs between fruits.

    The spread of nu is two standard deviations, so nu' = nu + spread / 2 is one standard deviation away. A press on a
    half-space measures E / (1 - nu^2). Let r = (1 - nu^2) / (1 - nu'^2). Flesh with E and nu' then causes the same
    forces as flesh with r E and nu. Flat tips read r E.

    Domes read r E / b. The compliance of the rigid base of the flesh changes with Poisson's ratio, and b is the factor
    by which this changes the modulus that is read from the `press` (samples, tips) [N]. Raises RiseError if no modulus
    can be read from the press with the changed base.
    """
    fruit = design.fruit
    poisson = fruit.poisson
    other_poisson = poisson + 0.5 * fruit.poisson_spread
    if other_poisson > _LARGEST_POISSON:  # one standard deviation lower is equally likely
        other_poisson = poisson - 0.5 * fruit.poisson_spread
    modulus_ratio = (1.0 - poisson**2) / (1.0 - other_poisson**2)
    if design.tips.dome_radius_mm is None:
        return abs(modulus_ratio - 1.0)
    return abs(modulus_ratio / _base_ratio(design, model, press, other_poisson, modulus_ratio) - 1.0)


def _base_ratio(design: Design, model: RiseModel, press: Floats, other_poisson: float, modulus_ratio: float) -> float:
    """Return the factor [1] by which the base's change with Poisson's ratio changes the modulus read under domes.

    The compliance S depends on the rigid base of the flesh. If Poisson's ratio changes from nu to nu' =
    `other_poisson`, S becomes S' = S + r base(nu') - base(nu), with r = `modulus_ratio`. The factor is the ratio of the
    moduli that are read from the `press` (samples, tips) [N] with S' and with S. Raises RiseError if the press has no
    modulus with S'.
    """
    fruit = design.fruit
    tip_axes = np.array(design.tips.places_mm)
    distances = np.linalg.norm(tip_axes[:, None] - tip_axes, axis=-1)  # (tips, tips) [mm]
    base = base_compliance(fruit.depth_mm, fruit.poisson, distances)
    base_change = modulus_ratio * base_compliance(fruit.depth_mm, other_poisson, distances) - base
    contrast = model.law.contrast
    law = replace(model.law, contrast=replace(contrast, S=rows_of(np.array(contrast.S) + base_change)))
    return replace(model, law=law).read_modulus(press) / model.read_modulus(press)


def _index_of_largest(biases: Sequence[float] | Floats) -> int:
    """Return the index of the bias [1] with the largest magnitude.

    If several biases are equal up to round-off, the index of the first one is returned, so that all machines report the
    same pose.
    """
    return first_largest(np.abs(biases).tolist(), least=1.0)


def _absolute(bias: Estimate) -> Estimate:
    """Return the absolute value of a bias [1], with the same error."""
    return Estimate(abs(bias.value), bias.error)


def touch_fraction(presses: SampledPresses) -> Estimate:
    """Return the travel at which the last tip touches, divided by the full travel [1], for the worst press.

    The fraction is 1 if a tip never touches. The first touch of a tip is extrapolated back from two forces, in the
    first two samples in which all tips touch. If only the spring gave way, the travel since first touch would be
    proportional to F. If only flesh under a dome gave way, it would be proportional to F^(2/3). The true touch lies
    between the two extrapolations, so the estimate is their mean, and its error is half their difference.
    """
    forces = np.nan_to_num(presses.F)  # nan, for a contact beyond the face of a dome, becomes 0
    samples, tips = forces.shape[2:]
    latest = Estimate(0.0, 0.0)
    for press in forces.reshape(-1, samples, tips):
        all_touch: Flags = np.all(press > 0.0, axis=1)
        first = int(np.argmax(all_touch))  # index of the first sample in which all tips touch; 0 if there is none
        # A tip that loses contact again, or touches only in the last sample, is treated as one that never touches.
        if not all_touch[first:].all() or first + 1 >= samples:
            return Estimate(1.0, 0.0)
        first_forces = press[first : first + 2]
        # Number of samples until the last tip touches, if only flesh under a dome or only the spring gave way. The
        # touch lies between the sample before `first` and `first` itself.
        by_flesh = first + np.clip(_samples_to_touch(first_forces ** (2.0 / 3.0)), 0.0, 1.0).max()
        by_spring = first + np.clip(_samples_to_touch(first_forces), 0.0, 1.0).max()
        fraction = 0.5 * (by_flesh + by_spring) / samples
        if fraction > latest.value:
            latest = Estimate(float(fraction), float(0.5 * (by_spring - by_flesh) / samples))
    return latest


def _samples_to_touch(depths: Floats) -> Floats:
    """Return the number of samples, shape (tips,), from the sample before `depths[0]` to the first touch of each tip.

    `depths` (2, tips) holds quantities proportional to the indentations in two successive samples, in any unit. The
    quantities are extrapolated linearly back to zero. The result is minus infinity if an indentation does not grow.
    """
    growth = depths[1] - depths[0]
    samples_since_touch = np.divide(depths[0], growth, out=np.full_like(growth, math.inf), where=growth > 0.0)
    return np.asarray(1.0 - samples_since_touch)


def tilted_presses(sensor: PressedSensor) -> SampledPresses | None:
    """Solve presses at several tilts along the tips, with the full travel at the centre, for the plot on the page.

    The tilts range from -`tilt_deg` to `tilt_deg`, the largest tilt in the design's `[reading]`. The result is None if
    the design has no readings, or allows no tilt. Raises the same errors as `pose_forces`.
    """
    reading = sensor.design.reading
    if reading is None or reading.tilt_deg == 0.0:
        return None
    tilts = np.linspace(-reading.tilt_deg, reading.tilt_deg, TILTS).tolist()
    placements = [Placement(tilt_deg=(tilt, 0.0)) for tilt in tilts]
    return sensor.presses(read_moduli(sensor.design.fruit), placements)


def _skin_pressures(sensor: PressedSensor, presses: SampledPresses) -> tuple[SkinPressure, ...]:
    """Return the largest mean pressure under a tip at full travel, and its pose, for each modulus of the fruit.

    `presses` are reused if they were solved at the moduli of the fruit. Otherwise presses at these moduli are solved.
    The result is empty if the fruit has no bruise limit.
    """
    fruit = sensor.design.fruit
    placements = presses.placements
    limits = fruit.bruise_limits_MPa
    if not limits:
        return ()
    pressures, errors = _pressures_at_full_travel(sensor, presses)
    rows = []
    for E, limit, pressure, error in zip(fruit.E_MPa, limits, pressures, errors, strict=True):
        # `pressure` has the shape (placements, tips), so the first index of `worst` is the placement.
        worst = np.unravel_index(first_largest(pressure.ravel().tolist()), pressure.shape)
        row = SkinPressure(
            E_MPa=E,
            pressure_MPa=float(pressure[worst]),
            error_MPa=float(error[worst]),
            limit_MPa=limit,
            worst=str(placements[worst[0]]),
        )
        rows.append(row)
    return tuple(rows)


def _pressures_at_full_travel(sensor: PressedSensor, presses: SampledPresses) -> tuple[Floats, Floats]:
    """Return the mean pressures under the tips at full travel [MPa] and their errors, both (moduli, placements, tips).

    The moduli are the moduli of the fruit. If `presses` were not solved at all of them, presses are solved here, in the
    same placements. The pressure and its error are 0 under a tip that is out of contact.
    """
    fruit_moduli = sensor.design.fruit.E_MPa
    placements = presses.placements
    if set(fruit_moduli) <= set(presses.moduli):
        indices = [presses.moduli.index(E) for E in fruit_moduli]
        # the last sample is at full travel
        pressures, errors = presses.mean_pressure[indices, :, -1], presses.pressure_error[indices, :, -1]
    else:  # readings of a fruit with few moduli are evaluated at other moduli
        travel = sensor.design.press.travel_mm
        poses = [Pose(E=E, travel=travel, stand=placement) for E in fruit_moduli for placement in placements]
        forces = sensor.forces_in_poses(poses)
        pressures, errors = forces.mean_pressure, forces.pressure_error
    shape = (len(fruit_moduli), len(placements), -1)
    return np.nan_to_num(pressures).reshape(shape), np.nan_to_num(errors).reshape(shape)


def _full_scale_and_error(
    contact: FruitCompliance, press: ScenePress, readings: ReadingAccuracy | None
) -> tuple[Floats, float]:
    """Return the largest force of each channel (tips,) [N], and the relative error of E due to the model [1].

    Forces over all poses, and the error of the bias, are known only from `readings`. Without them, the forces are the
    forces of `press` on the firmest fruit at full travel, and the error is the error of the solved `contact`.
    """
    error = max(contact.s11_error, contact.difference_error)  # relative errors of s11 and of s11 - s12
    full_scale = press.at_largest_E.F[-1, -1]
    if readings is not None:
        if readings.full_scale is not None:
            full_scale = np.array(readings.full_scale)
        if readings.reach is not None:
            error = max(error, readings.reach.error)
    return full_scale, error


def reading_constants(sensor: PressedSensor, press: ScenePress, readings: ReadingAccuracy | None) -> ReadingConstants:
    """Return the constants from which a printed unit computes a modulus, given its forces.

    `press` is the press of the design's scene, whose forces are the full scale if the design has no `readings`. The
    model error is the error of the solved contact or the error of the bias, whichever is larger. The error of the bias
    is known only if the design has `readings`. The constants of a pair differ from the constants of other layouts.
    Raises SolveError if a solution is not exact.
    """
    contact = sensor.contact
    full_scale, error = _full_scale_and_error(contact, press, readings)
    full_scale_N = tuple(np.maximum(full_scale, 0.0).tolist())
    signal = sensor.signal
    constants = ReadingConstants(
        method=RiseModel.method,
        springs_mm_per_N=rows_of(sensor.C),
        full_scale_N=full_scale_N,
        model_error_percent=100.0 * error,
        level=(),  # replaced below for a pair
        signal=None if signal is None else signal.with_full_scale(full_scale_N),
        fastest_press_s=sensor.fastest_press_s,
    )
    if sensor.design.tips.tip_layout.is_pair:
        s11_minus_s12 = 1.0 / contact.K_m_over_E()
        return replace(constants, level=seated_level_readings(sensor), own_less_other_per_mm=s11_minus_s12)
    law = sensor.contrast
    lateral = np.subtract(law.C, sensor.C)  # compliance due to the lateral deflection of domes
    return replace(
        constants,
        rise_level=rise_model(sensor).level if readings is None else readings.level,
        lean_mm_per_N=rows_of(lateral) if lateral.any() else None,
        weights=tuple(law.weights),
        gaps_mm=tuple(law.gaps),
        fruit_per_mm=rows_of(law.S),
        hertz=law.hertz,
    )
