"""The error analysis of readings over the poses that occur: bias, uncertainty, touch, and the pressure on the skin."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pipeline.reading.measurement import (
    RiseModel,
    rise_model,
    seated_level_readings,
)
from pipeline.reading.poses import Placement, occurring, read_moduli
from pipeline.reading.press_time import fastest_press
from pipeline.reading.pressed_sensor import RISE_TRAVELS, PressedSensor, Presses
from pipeline.reading.read_out import LevelReading, ReadingConstants
from pipeline.reading.uncertainty import (
    Channels,
    UncertaintySources,
    least_forces,
    mean_sources,
    noise_to_reach,
    uncertainty_sources,
)
from pipeline.response.scene_press import ScenePress
from pipeline.storage.plain import first_largest
from sensor.arrays import Flags, Floats, rows_of
from sensor.design.reading import PRESS_S, PRESS_SAMPLES, Reading
from sensor.quantity import BOUNDED, Estimate
from sensor.record import Record
from sensor.theory.contrast_law import ReadingError
from sensor.theory.contrast_rise import RiseReading
from solve.contact.poses import Pose
from solve.halfspace.layered import base_compliance

TILTS = 5
_SMALL = 0.5
_LARGEST_POISSON = 0.499
NOISE_LIMIT = 0.1  # of the modulus: the uncertainty for which the noise is stated


@dataclass(frozen=True, kw_only=True)
class ModulusReading:
    """What is read at one modulus [MPa]: the largest error over all poses [1] and where it is, and its uncertainty.

    `reach` is the error [1] of the pose that with its bar reaches farthest, which may be another pose. `sources` are
    those of a fruit and a pose that are drawn from all that occur; `uncertainty_limit` [1] is the limit of all
    together.
    """

    E: float
    bias: Estimate
    worst: Placement
    reach: Estimate
    sources: UncertaintySources
    uncertainty_limit: float

    @property
    def over_limit(self) -> float:
        """Return the standard uncertainty over its limit [1]."""
        return self.sources.total / self.uncertainty_limit


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


@dataclass(frozen=True, kw_only=True, repr=False)
class Readings(Record):
    """How good readings of whole presses are: at each modulus, the worst bias and standard uncertainty [1].

    `touch` is the travel at which all tips touch over the whole one [1], the largest over all poses. `refused` says in
    how many poses there is no reading, and why, None where there always is. Bias and uncertainty are those of the
    others, None where a level press has no reading. `level` are the readings of level presses, by which all are
    corrected. `noise_percent` is the noise of the forces at which the uncertainty reaches 10 %, None where it does
    without noise. `full_scale` is the largest force of each channel over all poses [N], (tips,). `pressures` are those
    on the skin at each modulus. `heights` is by how much E moves per height contrast of the tips, which counts as a
    saddle of the skin [1/mm]. `flesh` is by how much E moves to either side where the flesh under domes obeys the law
    of Hencky or of Storakers [1]. `face_mm` is how wide the face of a dome must be to hold the contact in every pose, 0
    for other tips.
    """

    method: str
    touch: Estimate
    level: tuple[LevelReading, ...] = ()
    moduli: tuple[ModulusReading, ...] = ()
    uncertainty: Estimate | None = None
    uncertainty_limit: float = math.inf
    noise_percent: float | None = None
    refused: str | None = None
    full_scale: tuple[float, ...] | None = None
    pressures: tuple[SkinPressure, ...] = ()
    heights: float = 0.0
    flesh: float = 0.0
    face_mm: float = 0.0

    @property
    def worst_bias(self) -> ModulusReading:
        """Return the reading at the modulus of the largest bias."""
        return self.moduli[_largest([row.bias.value for row in self.moduli])]

    @property
    def bias(self) -> Estimate | None:
        """Return the largest bias of all moduli without its sign, with its own bar [1]."""
        return _unsigned(self.worst_bias.bias) if self.moduli else None

    @property
    def reach(self) -> Estimate | None:
        """Return the bias without its sign that with its bar reaches farthest [1]."""
        reaches = [_unsigned(row.reach) for row in self.moduli]
        return max(reaches, key=lambda reach: reach.value + reach.error, default=None)

    @property
    def worst_uncertainty(self) -> ModulusReading:
        """Return the reading at the modulus whose uncertainty is largest over its limit."""
        return self.moduli[first_largest(row.over_limit for row in self.moduli)]

    @property
    def noise_at_limit_percent(self) -> float | None:
        """Return the noise [% of full scale] at which the uncertainty reaches its limit; None where it is without.

        Raises ValueError where nothing is read.
        """
        worst = self.worst_uncertainty
        return noise_to_reach(worst.uncertainty_limit, worst.sources)


def analyse_readings(sensor: PressedSensor) -> Readings | None:
    """Return the quality of a sensor's readings, None where its design does not ask; presses at tilts are left out.

    Raises InputError where a pose is outside the domain of contact, SolveError when a solve is not exact.
    """
    reading = sensor.design.reading
    if reading is None:
        return None
    presses = occurring_presses(sensor, reading)
    return replace(error_analysis(sensor, reading, presses), pressures=skin_pressures(sensor, presses))


def occurring_presses(sensor: PressedSensor, reading: Reading) -> Presses:
    """Return the presses at the moduli of a reading in all placements that occur; raises as `pose_forces`."""
    return sensor.presses(read_moduli(sensor.design.fruit), tuple(occurring(sensor.design, reading)))


def error_analysis(sensor: PressedSensor, reading: Reading, presses: Presses) -> Readings:
    """Return how good the readings of a sensor are, of whole presses by the rise of their contrast.

    `presses` are those of `occurring_presses`. Raises InputError where the poses are outside the domain of contact,
    SolveError when a solve is not exact.
    """
    design = sensor.design
    model = rise_model(sensor)
    press_s = max(PRESS_S, fastest_press(sensor) or 0.0)  # no faster than its read-out allows
    channels = Channels(
        reading=reading,
        full_scale=presses.full_scale,
        signal=sensor.signal,
        press_s=press_s,
        creep=sensor.springs.creep,
    )
    read, refused = _read(model, presses, channels, design.tips.side_mm)
    analysis = Readings(
        method=model.method,
        touch=touch_fraction(presses),
        level=model.level,
        refused=refused,
        face_mm=float(presses.face_mm.max()),
    )
    rows = []
    for at_modulus in read:
        if at_modulus.level is None:
            return analysis
        limit = reading.uncertainty_limit_at(at_modulus.E, design.fruit.E_MPa)
        by_poisson = _by_poisson(sensor, model, at_modulus.F[0])
        rows.append(at_modulus.judged(model, channels, by_poisson, limit))
    widest = rows[first_largest(row.over_limit for row in rows)]
    flesh = 0.0
    if presses.flesh.any():
        for forces, more in zip(presses.F[:, 0], presses.flesh[:, 0], strict=True):
            flesh = max(flesh, abs(model.modulus(forces + more) / model.modulus(forces) - 1.0))
    return replace(
        analysis,
        moduli=tuple(rows),
        uncertainty=Estimate(widest.sources.total, widest.reach.error * widest.sources.total),
        uncertainty_limit=widest.uncertainty_limit,
        noise_percent=noise_to_reach(NOISE_LIMIT, widest.sources),
        full_scale=tuple(presses.full_scale.tolist()),
        heights=max(at_modulus.per_height for at_modulus in read),
        flesh=flesh,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _ReadAtModulus:
    """Presses on fruit of one modulus E [MPa], level first, and what they tell, None where that is nothing.

    Forces F [N] and their `error` [N] have shape (placements, samples, tips).
    """

    E: float
    placements: tuple[Placement, ...]
    F: Floats
    error: Floats
    found: tuple[RiseReading | None, ...]

    @property
    def level(self) -> RiseReading | None:
        """Return the reading of a level press in the middle of the design's own fruit."""
        return self.found[0]

    @cached_property
    def biases(self) -> Floats:
        """Return E read / E - 1 in each placement, nan where there is none."""
        return np.array([math.nan if reading is None else reading.E / self.E - 1.0 for reading in self.found])

    @property
    def per_height(self) -> float:
        """Return by how much E moves per height contrast of the tips [1/mm], at most."""
        return max(abs(reading.slopes.offset) for reading in self.found if reading is not None)

    def judged(self, model: RiseModel, channels: Channels, by_poisson: float, limit: float) -> ModulusReading:
        """Return the worst bias with its bar, and the standard uncertainty of what is drawn from all that occurs."""
        errors = self._errors(model)
        biases = np.abs(np.nan_to_num(self.biases))
        worst = _largest(biases.tolist())
        farthest = _largest((biases + errors).tolist())
        others = {"pose": self._by_pose, "thickness": self._by_thickness, "poisson": by_poisson}
        drawn = []
        for reading, placement in zip(self.found, self.placements, strict=True):
            if reading is not None and (placement.is_drawn or placement == self.placements[0]):
                drawn.append(uncertainty_sources(reading, channels, RISE_TRAVELS, others))
        return ModulusReading(
            E=self.E,
            bias=Estimate(float(self.biases[worst]), float(errors[worst])),
            worst=self.placements[worst],
            reach=Estimate(float(self.biases[farthest]), float(errors[farthest])),
            sources=mean_sources(drawn),
            uncertainty_limit=limit,
        )

    def _errors(self, model: RiseModel) -> Floats:
        """Return how far what is left open of the forces moves E [1], (placements,); 0 where the bias is small.

        Small is less than half of the largest. All that a bound leaves open of forces has one sign under all tips, as
        the fruit is one.
        """
        biases = np.abs(np.nan_to_num(self.biases))
        errors = np.zeros(len(biases))
        for place, bias in enumerate(biases.tolist()):
            if place and (self.found[place] is None or bias < _SMALL * biases.max()):
                continue
            moved = model.modulus(self.F[place] + self.error[place])
            errors[place] = abs(moved / model.modulus(self.F[place]) - 1.0)
        return errors

    @property
    def _by_pose(self) -> float:
        """Return the standard uncertainty of a reading [1] by the shape of the fruit and by the pose."""
        pairs = zip(self.biases.tolist(), self.placements, strict=True)
        drawn = [bias for bias, placement in pairs if placement.is_drawn and math.isfinite(bias)]
        return math.hypot(*drawn) / math.sqrt(max(len(drawn), 1))

    @property
    def _by_thickness(self) -> float:
        """Return the standard uncertainty [1] by a thickness anywhere within its range (JCGM 100:2008, 4.3.7)."""
        place_of = {placement: place for place, placement in enumerate(self.placements)}
        most = 0.0
        for placement, place in place_of.items():
            if placement.thickness_mm is not None:
                change = self.biases[place] - self.biases[place_of[replace(placement, thickness_mm=None)]]
                most = max(most, abs(float(np.nan_to_num(change))))
        return BOUNDED * most


def _read(
    model: RiseModel, presses: Presses, channels: Channels, side_mm: float
) -> tuple[list[_ReadAtModulus], str | None]:
    """Return what presses tell at each modulus, and in words where and why some tell nothing.

    A contact that needs more of a dome's face than `side_mm` has no force.
    """
    least = least_forces(channels.errors, channels.full_scale)
    # A press is solved in few samples; noise refuses one of as many as it has.
    noises = channels.noises * math.sqrt(RISE_TRAVELS / PRESS_SAMPLES)
    reasons = []
    read = []
    for i, E in enumerate(presses.moduli):
        found: list[RiseReading | None] = []
        for j, placement in enumerate(presses.placements):
            face = presses.face_mm[i, j]
            reading = None
            try:
                if face > side_mm:
                    msg = f"tips.side_mm = {side_mm:g} mm is less than the {face:.3g} mm that the contact needs"
                    raise ReadingError(msg)
                reading = model.reading(presses.F[i, j], noises, least)
            except ReadingError as refused:
                reasons.append(f"as at {E:.3g} MPa, {placement}: {refused}")
            found.append(reading)
        at_modulus = _ReadAtModulus(
            E=E, placements=presses.placements, F=presses.F[i], error=presses.error[i], found=tuple(found)
        )
        read.append(at_modulus)
    if not reasons:
        return read, None
    count = len(read) * len(presses.placements)
    return read, f"{len(reasons)} of {count} poses have no reading, {reasons[0]}"


def _by_poisson(sensor: PressedSensor, model: RiseModel, press: Floats) -> float:
    """Return the standard uncertainty of a reading [1] by Poisson's ratio nu.

    The spread of nu is two standard deviations, so nu' = nu + spread / 2 is one away. A press feels E / (1 - nu^2).
    Flesh of E and nu' is felt as flesh of r E and nu, where the felt ratio is r = (1 - nu^2) / (1 - nu'^2). Flat tips
    then read r E. Domes feel the base under the flesh too, S' = S + r base(nu') - base(nu), and read r E / b. The base
    ratio b is the modulus that a press has by S' over the one it has by S.
    """
    fruit = sensor.design.fruit
    poisson = fruit.poisson
    other = poisson + 0.5 * fruit.poisson_spread
    if other > _LARGEST_POISSON:
        other = poisson - 0.5 * fruit.poisson_spread
    felt_ratio = (1.0 - poisson**2) / (1.0 - other**2)
    if sensor.design.tips.dome_radius_mm is None:
        return abs(felt_ratio - 1.0)
    axes = np.array(sensor.design.tips.places_mm)
    apart = np.linalg.norm(axes[:, None] - axes, axis=-1)
    base = base_compliance(fruit.depth_mm, poisson, apart)
    change = felt_ratio * base_compliance(fruit.depth_mm, other, apart) - base
    contrast = model.law.contrast
    law = replace(model.law, contrast=replace(contrast, S=rows_of(np.array(contrast.S) + change)))
    base_ratio = replace(model, law=law).modulus(press) / model.modulus(press)
    return abs(felt_ratio / base_ratio - 1.0)


def _largest(biases: Sequence[float]) -> int:
    """Return the index of the first of the largest biases [1]: less one, they keep the round-off of E read / E."""
    return first_largest(map(abs, biases), least=1.0)


def _unsigned(bias: Estimate) -> Estimate:
    """Return a bias without its sign [1]."""
    return Estimate(abs(bias.value), bias.error)


def touch_fraction(presses: Presses) -> Estimate:
    """Return the travel at which all tips touch over the whole one, the largest of all presses [1].

    It is 1 where a tip stays off. Each tip is followed back to where it has no force, on the travel left to it. That is
    proportional to the force where its spring gives way, to its power 2/3 where the flesh under a dome does.
    """
    forces = np.nan_to_num(presses.F)
    count = forces.shape[2]
    worst = Estimate(0.0, 0.0)
    for press in forces.reshape(-1, count, forces.shape[3]):
        touching: Flags = np.all(press > 0.0, axis=1)
        first = int(np.argmax(touching))
        if not touching[first:].all() or first + 1 >= count:
            return Estimate(1.0, 0.0)
        by_flesh, by_spring = (_touched(press[first : first + 2] ** power) for power in (2.0 / 3.0, 1.0))
        least, most = (first + np.clip(since, 0.0, 1.0).max() for since in (by_flesh, by_spring))
        at = 0.5 * (least + most) / count
        if at > worst.value:
            worst = Estimate(float(at), float(0.5 * (most - least) / count))
    return worst


def _touched(depths: Floats) -> Floats:
    """Return the samples since the one before the first at which tips touch, by depths in two samples, (2, tips)."""
    grown = depths[1] - depths[0]
    return np.asarray(1.0 - np.divide(depths[0], grown, out=np.full_like(grown, math.inf), where=grown > 0.0))


def tilted_presses(sensor: PressedSensor, reading: Reading) -> Presses | None:
    """Return presses at tilts along the tips up to the largest, to full travel of the middle; None without a tilt."""
    if reading.tilt_deg == 0.0:
        return None
    tilts = np.linspace(-reading.tilt_deg, reading.tilt_deg, TILTS).tolist()
    placements = [Placement(tilt_deg=(tilt, 0.0)) for tilt in tilts]
    return sensor.presses(read_moduli(sensor.design.fruit), placements)


def skin_pressures(sensor: PressedSensor, presses: Presses) -> tuple[SkinPressure, ...]:
    """Return the largest pressure at each modulus shown, at full travel; none where the fruit has no limit.

    The sensor stands in all placements of `occurring_presses`, whose `presses` are not solved again where they hold
    these moduli. Raises as `pose_forces`.
    """
    design = sensor.design
    limits = design.fruit.bruise_limits_MPa
    if not limits:
        return ()
    placements = presses.placements
    if set(design.fruit.E_MPa) <= set(presses.moduli):
        at = [presses.moduli.index(E) for E in design.fruit.E_MPa]
        mean_pressure = presses.mean_pressure[at, :, -1]
        pressure_error = presses.pressure_error[at, :, -1]
    else:
        travel = design.press.travel_mm
        forces = sensor.in_poses(
            [Pose(E=E, travel=travel, stand=each) for E in design.fruit.E_MPa for each in placements]
        )
        mean_pressure = forces.mean_pressure
        pressure_error = forces.pressure_error
    tips = mean_pressure.shape[-1]
    of_poses = (len(limits), -1)  # of all tips in all placements at a modulus; 0 off the fruit
    pressures = np.nan_to_num(mean_pressure).reshape(of_poses)
    errors = np.nan_to_num(pressure_error).reshape(of_poses)
    worst_at_each = []
    for i, E in enumerate(design.fruit.E_MPa):
        worst = first_largest(pressures[i].tolist())
        pressure = Estimate(float(pressures[i, worst]), float(errors[i, worst]), "MPa")
        placement = placements[worst // tips]
        skin = SkinPressure(E=E, placement=placement, pressure=pressure, limit=limits[i])
        worst_at_each.append(skin)
    return tuple(worst_at_each)


def reading_constants(sensor: PressedSensor, press: ScenePress, readings: Readings | None) -> ReadingConstants:
    """Return the reading constants of a finished sensor; raises SolveError when a solve is not exact."""
    contact = sensor.contact
    error = max(contact.error_own, contact.error_pair)
    full_scale = press.at_largest_E.F[-1, -1]
    if readings is not None:
        if readings.full_scale is not None:
            full_scale = np.array(readings.full_scale)
        if readings.reach is not None:
            error = max(error, readings.reach.error)
    constants = ReadingConstants(
        method=RiseModel.method,
        springs_mm_per_N=rows_of(sensor.C),
        full_scale_N=tuple(np.maximum(full_scale, 0.0).tolist()),
        model_error_percent=100.0 * error,
        level=(),
        signal=sensor.signal,
        fastest_press_s=fastest_press(sensor),
    )
    if sensor.design.tips.tip_layout.is_pair:
        own_less_other = 1.0 / contact.K_m_over_E()
        return replace(constants, level=seated_level_readings(sensor), own_less_other_per_mm=own_less_other)
    law = sensor.contrast
    lean = np.subtract(law.C, sensor.C)
    return replace(
        constants,
        rise_level=rise_model(sensor).level if readings is None else readings.level,
        lean_mm_per_N=rows_of(lean) if lean.any() else None,
        weights=tuple(law.weights),
        gaps_mm=tuple(law.gaps),
        fruit_per_mm=rows_of(law.S),
        hertz=law.hertz,
    )
