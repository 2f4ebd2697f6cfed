"""The error analysis of readings over the poses that occur: bias, uncertainty, lift, and the pressure on the skin."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from cad.arrays import Floats
from cad.design.parameters import Design
from cad.design.reading import LEAST_OVER_NOISE, Reading
from cad.fabrication.bridges import SignalPath, signal_path
from cad.quantity import Estimate
from cad.theory.contrast_law import ReadingError
from pipeline.reading.measurement import (
    LineModel,
    MeasurementModel,
    PressedSensor,
    Presses,
    level_readings,
    pressed_sensor,
    rise_level_readings,
    rows_of,
)
from pipeline.reading.poses import Placement, Vector, directed, occurring, read_moduli
from pipeline.reading.read_out import ReadOut
from pipeline.reading.uncertainty import UncertaintySources, force_errors, noise_to_reach, uncertainty_sources
from pipeline.response.scene_press import ScenePress, scene_of
from pipeline.springs.fitted_springs import FittedSprings, springs_to_read, tip_height_offsets
from pipeline.storage.plain import first_largest
from solve.contact.poses import Pose
from solve.contact.scene import STEEPEST_DEG
from solve.fruit.compliance import FruitCompliance

NOISE_LIMIT = 0.1  # of the modulus: the uncertainty for which the noise is stated
LARGEST_TILT_DEG = 15.0  # up to which a lift is looked for
_STEP = 1e-3  # of the modulus, by which forces are moved to weigh their errors
_WITHIN_DEG = 0.1  # of the steepest scene that contact is solved for
_RESOLVED_DEG = 0.05
Stand = tuple[float, Vector]
"""A modulus [MPa] and the direction of a tilt [1]."""


@dataclass(frozen=True, kw_only=True)
class ModulusReading:
    """What is read at one modulus [MPa]: the largest error over all poses [1], where it is, and its spread."""

    E: float
    bias: float
    worst: Placement
    sources: UncertaintySources


@dataclass(frozen=True, kw_only=True)
class SkinPressure:
    """The largest mean pressure under a tip at one modulus, with its error, and the limit of the fruit [MPa]."""

    E: float
    placement: Placement
    pressure: Estimate
    limit: float

    @property
    def over_limit(self) -> float:
        """Return the pressure over its limit [1]."""
        return self.pressure.value / self.limit


@dataclass(frozen=True, kw_only=True)
class Readings:
    """How good readings are: at each modulus, the worst bias and uncertainty [1], the tilt of first lift [deg].

    `refused` says in how many poses there is no reading, and why, None where there always is: bias and uncertainty are
    those of the others, None where a level press has no reading.
    `noise_percent` is the noise of the forces at which the uncertainty reaches 10 %, None where it does without noise.
    `full_scale` is the largest force of each channel over all poses [N], (tips,). `pressures` are those on the skin at
    each modulus. `flesh` is by how much E moves to either side where the flesh under domes obeys the law of Hencky or
    of Storakers [1]. `face_mm` is how wide the face of a dome must be to hold the contact in every pose, 0 for other
    tips. `presses` are those of all poses.
    """

    method: str
    lift: Estimate
    moduli: tuple[ModulusReading, ...] = ()
    bias: Estimate | None = None
    uncertainty: Estimate | None = None
    noise_percent: float | None = None
    refused: str | None = None
    full_scale: tuple[float, ...] | None = None
    pressures: tuple[SkinPressure, ...] = ()
    flesh: float = 0.0
    face_mm: float = 0.0
    presses: Presses | None = field(default=None, repr=False, compare=False)

    @property
    def worst_bias(self) -> ModulusReading:
        """Return the reading at the modulus of the largest bias."""
        return self.moduli[_largest_bias([row.bias for row in self.moduli])]

    @property
    def worst_uncertainty(self) -> ModulusReading:
        """Return the reading at the modulus of the largest uncertainty."""
        return self.moduli[first_largest(row.sources.total for row in self.moduli)]


def analyse_readings(design: Design, contact: FruitCompliance, springs: FittedSprings) -> Readings | None:
    """Return how good the readings of a design are, None where it does not ask.

    Raises InputError where a pose is outside the domain of contact, SolveError when a solve is not exact.
    """
    if design.reading is None:
        return None
    offsets = tip_height_offsets(springs, design.press.attitude)
    sensor = pressed_sensor(design, contact, springs.C, offsets, springs.sideways)
    sensor = replace(sensor, signal=design_signal(design, springs))
    analysis = error_analysis(sensor, design.reading)
    return replace(analysis, pressures=skin_pressures(sensor))


def design_signal(design: Design, springs: FittedSprings) -> SignalPath | None:
    """Return the signal path of a design on its springs; None where it names no read-out."""
    if design.readout is None:
        return None
    return signal_path(design.readout, springs_to_read(design, springs), springs.process, design.tips.springs)


def error_analysis(sensor: PressedSensor, reading: Reading) -> Readings:
    """Return how good the readings of a sensor are.

    Raises InputError where the poses are outside the domain of contact, SolveError when a solve is not exact.
    """
    model = sensor.model
    lift = lift_tilt(sensor, reading)
    presses = sensor.presses(read_moduli(sensor.design.fruit), tuple(occurring(sensor.design, reading)))
    least_forces = LEAST_OVER_NOISE * force_errors(reading, presses.full_scale, sensor.signal)
    biases, refused = _biases(model, presses, least_forces, sensor.design.tips.side_mm)
    face_mm = float(presses.face_mm.max())
    level_has_no_reading = np.isnan(biases[:, 0]).any()
    if level_has_no_reading or np.isnan(biases).all(axis=1).any():
        return Readings(method=model.method, lift=lift, refused=refused, face_mm=face_mm, presses=presses)

    level = presses.F[:, 0]
    errors = _modulus_errors(sensor, presses.moduli, level, presses.error[:, 0])
    poses = _pose_contributions(biases, presses.placements)
    rows = []
    try:
        for i, E in enumerate(presses.moduli):
            worst = _largest_bias(biases[i].tolist())
            sources = uncertainty_sources(model, reading, level[i], presses.full_scale, poses[i], sensor.signal)
            placement = presses.placements[worst]
            rows.append(ModulusReading(E=E, bias=float(biases[i, worst]), worst=placement, sources=sources))
    except ReadingError as error:  # tips or springs that the fruit hardly moves
        refused = f"forces of a level press that are off by a ten-thousandth have no reading: {error}"
        return Readings(method=model.method, lift=lift, refused=refused, face_mm=face_mm, presses=presses)
    widest = first_largest(row.sources.total for row in rows)
    largest = _largest_bias([row.bias for row in rows])
    uncertainty = rows[widest].sources.total
    flesh = 0.0
    if presses.flesh.any():
        for forces, more in zip(level, presses.flesh[:, 0], strict=True):
            flesh = max(flesh, abs(model.modulus(forces + more) / model.modulus(forces) - 1.0))
    return Readings(
        method=model.method,
        lift=lift,
        moduli=tuple(rows),
        bias=Estimate(max(abs(row.bias) for row in rows), float(errors[largest])),
        uncertainty=Estimate(uncertainty, float(errors[widest]) * uncertainty),
        noise_percent=noise_to_reach(NOISE_LIMIT, rows[widest].sources),
        refused=refused,
        full_scale=tuple(presses.full_scale.tolist()),
        flesh=flesh,
        face_mm=face_mm,
        presses=presses,
    )


def _biases(model: MeasurementModel, presses: Presses, least: Floats, side_mm: float) -> tuple[Floats, str | None]:
    """Return E read / E - 1 (moduli, placements), nan where there is no reading, and in words where there is none.

    A force that is not over the `least` (tips,) [N] counts as none; a contact that needs more of a dome's face than
    `side_mm` has no force.
    """
    biases = np.full(presses.F.shape[:2], np.nan)
    forces = np.where(least < presses.F, presses.F, 0.0)
    reasons = []
    for i, E in enumerate(presses.moduli):
        for j, placement in enumerate(presses.placements):
            face = presses.face_mm[i, j]
            if face > side_mm:
                off_face = f"tips.side_mm = {side_mm:g} mm is less than the {face:.3g} mm that the contact needs"
                reasons.append(f"as at {E:.3g} MPa, {placement}: {off_face}")
                continue
            try:
                biases[i, j] = model.modulus(forces[i, j]) / E - 1.0
            except ReadingError as refused:
                reasons.append(f"as at {E:.3g} MPa, {placement}: {refused}")
    if not reasons:
        return biases, None
    return biases, f"{len(reasons)} of {biases.size} poses have no reading, {reasons[0]}"


def _largest_bias(biases: Sequence[float]) -> int:
    """Return the index of the first of the largest biases [1]: less one, they keep the round-off of E read / E."""
    return first_largest(map(abs, biases), least=1.0)


def _modulus_errors(sensor: PressedSensor, moduli: Sequence[float], forces: Floats, errors: Floats) -> Floats:
    """Return by how much a modulus must move to move the forces at full travel as their errors may [1], (moduli,)."""
    moved = sensor.presses([E * (1.0 + _STEP) for E in moduli], [Placement()]).F
    change = np.abs(moved[:, 0, -1] / forces[:, -1] - 1.0).max(axis=1)
    return np.asarray(_STEP * errors[:, -1] / change)


def _pose_contributions(biases: Floats, placements: Sequence[Placement]) -> list[dict[str, float]]:
    """Return the root mean square of the bias [1] over tilts, over positions and over radii, for each modulus."""
    contributions: list[dict[str, float]] = [{} for _ in biases]
    for source in ("tilt", "off_centre", "radius"):
        alone = [placement.off_by == (source,) for placement in placements]
        for row, of_modulus in zip(biases, contributions, strict=True):
            read = row[alone][np.isfinite(row[alone])]  # nan has no reading
            of_modulus[source] = float(np.sqrt(np.mean(read**2))) if read.size else 0.0
    return contributions


def lift_tilt(sensor: PressedSensor, reading: Reading) -> Estimate:
    """Return the least tilt, of all directions and moduli, at which a tip is off the fruit at full travel [deg].

    The sensor stands in the middle of the design's fruit. Where no tip lifts before, 15 deg or the steepest press that
    contact is solved for. Raises as `pose_forces`.
    """
    design = sensor.design
    steepest = min(LARGEST_TILT_DEG, STEEPEST_DEG - scene_of(design).steepest_deg - _WITHIN_DEG)

    def lifting(tilts: Sequence[float], stands: Sequence[Stand]) -> list[list[Stand]]:
        """Return for each tilt [deg] in which stands a tip is off."""
        poses = []
        for tilt in tilts:
            for E, (x, y) in stands:
                poses.append(Placement(tilt_deg=(tilt * x, tilt * y)).pressed(E, design.press.travel_mm))
        off = ~sensor.in_poses(poses).touching.all(axis=1).reshape(len(tilts), -1)
        return [list(itertools.compress(stands, row)) for row in off]

    stands = list(itertools.product(read_moduli(design.fruit), directed(1.0)))
    is_alone = design.tips.tip_shape.obeys_hertz  # no pose of domes feels the others; those of cells share a grid
    at_once = 2 if is_alone else 1
    # The tilt that the design allows for is tried itself, so that a lift beyond it is never found below.
    touching = 0.0
    lifted = steepest
    for tilt in (min(reading.tilt_deg, steepest), steepest):
        if lifting([tilt], stands)[0]:
            lifted = tilt
            break
        touching = tilt
    while lifted - touching > _RESOLVED_DEG:
        halvings = min(at_once, math.ceil(math.log2((lifted - touching) / _RESOLVED_DEG)))
        tilts = np.linspace(touching, lifted, 2**halvings + 1)[1:-1].tolist()
        for tilt, off in zip(tilts, lifting(tilts, stands), strict=True):
            if off:
                lifted = tilt
                if is_alone:
                    stands = off  # what touches at this tilt does so at a smaller one
                break
            touching = tilt
    return Estimate(touching, lifted - touching, "deg")


def skin_pressures(sensor: PressedSensor) -> tuple[SkinPressure, ...]:
    """Return the largest pressure at each modulus shown, at full travel; none where the fruit has no limit.

    Where a reading allows for tilt, the sensor also stands tilted as far as it may be. Raises as `pose_forces`.
    """
    design = sensor.design
    limits = design.fruit.bruise_limits_MPa
    if not limits:
        return ()
    placements = [Placement(tilt_deg=(design.press.tilt_deg, design.press.roll_deg))]
    if design.reading is not None:
        placements += [Placement(tilt_deg=tilt) for tilt in directed(design.reading.tilt_deg)]
    poses: list[Pose] = []
    for E in design.fruit.E_MPa:
        poses += [placement.pressed(E, design.press.travel_mm) for placement in placements]
    forces = sensor.in_poses(poses)
    of_poses = (len(limits), -1)  # of all tips in all placements at a modulus; 0 off the fruit
    pressures = np.nan_to_num(forces.mean_pressure).reshape(of_poses)
    errors = np.nan_to_num(forces.pressure_error).reshape(of_poses)
    worst_at_each = []
    for i, E in enumerate(design.fruit.E_MPa):
        worst = first_largest(pressures[i].tolist())
        pressure = Estimate(float(pressures[i, worst]), float(errors[i, worst]), "MPa")
        placement = placements[worst // forces.F.shape[1]]
        skin = SkinPressure(E=E, placement=placement, pressure=pressure, limit=limits[i])
        worst_at_each.append(skin)
    return tuple(worst_at_each)


def reading_constants(
    design: Design, contact: FruitCompliance, springs: FittedSprings, press: ScenePress, readings: Readings | None
) -> ReadOut:
    """Return what a finished sensor is read by; raises SolveError when a solve is not exact."""
    sensor = pressed_sensor(design, contact, springs.C, press.height_offsets, springs.sideways)
    model = sensor.model
    error = max(contact.error_own, contact.error_pair)
    full_scale = press.at_largest_E.F[-1, -1]
    if readings is not None:
        if readings.full_scale is not None:
            full_scale = np.array(readings.full_scale)
        if readings.bias is not None:
            error = max(error, readings.bias.error)
    constants = ReadOut(
        method=model.method,
        springs_mm_per_N=rows_of(springs.C),
        full_scale_N=tuple(np.maximum(full_scale, 0.0).tolist()),
        model_error_percent=100.0 * error,
        level=model.level,
        signal=design_signal(design, springs),
    )
    if isinstance(model, LineModel):
        return replace(constants, own_less_other_per_mm=model.own_less_other)
    law = model.law
    lean = np.subtract(law.C, springs.C)
    return replace(
        constants,
        level=model.level or level_readings(sensor),
        rise_level=rise_level_readings(sensor, law),
        lean_mm_per_N=rows_of(lean) if lean.any() else None,
        weights=tuple(law.weights),
        gaps_mm=tuple(law.gaps),
        fruit_per_mm=rows_of(law.S),
        hertz=law.hertz,
    )
