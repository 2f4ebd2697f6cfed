"""A simulated unit with its springs, domes and channels: as designed, from a unit.toml, or with random print errors.

Random errors have the same distributions as in the error analysis of a design: half of a tolerance is one standard
deviation, and a drift is uniform within its bound.
"""

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cad.parts.dome_form import CAPS, form_deviations
from pipeline.report.report import Report
from sensor.arrays import Floats
from sensor.design.parameters import Design
from sensor.design.reading import WEIGHED_AFTER_S, ReadingRequirements
from sensor.quantity import validation_error
from solve.presses.pressed_bodies import SprungDomes

if TYPE_CHECKING:
    from instrument.press.printed_unit import PrintedUnit

_SENSITIVITY_DEVIATION = 0.03  # relative standard deviation of the sensitivity of a Hall sensor and its magnet [1]
_LARGEST_ZERO = 0.02  # largest count of a free channel, as a fraction of the converter's range [1]
_FULL_SCALE_FRACTION = 0.25
"""Counts at full scale for a design without a read-out, as a fraction of the converter's range [1]."""
_SMALLEST_STIFFNESS_RATIO = 0.5
"""Smallest stiffness divided by the designed stiffness [1]; the inverse is the largest ratio."""
_SMALLEST_FULL_SCALE = 1e-9  # [N]; prevents a division by zero


@dataclass(frozen=True, kw_only=True, eq=False)
class SimulatedUnit:
    """The springs, domes and channels of a unit, in the order of its tips.

    `domes` are the domes on their springs, with the stiffnesses under weights that have hung for `weighed_s` [s]. The
    compliance of the springs is proportional to (time under load)^`creep`, with `creep` in [1]. The domes protrude by
    `heights` (tips,) [mm]. The signals of the channels are `zeros` plus `per_mm` (channels, tips) times the deflections
    [mm]. `noise` is the standard deviation of each channel. The signals are counts up to `saturation`, or newtons if
    `saturation` is None. After the tare, the zeros are shifted by `zero_drift`.
    """

    domes: SprungDomes
    heights: Floats
    creep: float
    weighed_s: float
    per_mm: Floats
    zeros: Floats
    noise: Floats
    zero_drift: Floats
    saturation: int | None

    @property
    def counted(self) -> bool:
        """Return whether the channels show counts instead of newtons."""
        return self.saturation is not None

    def signals(self, deflections: Floats) -> Floats:
        """Return the signals of the channels without noise and drift, for deflections (samples, tips) [mm]."""
        return np.asarray(self.zeros + deflections @ self.per_mm.T)

    def at_other_temperature(self, report: Report, rng: np.random.Generator) -> "SimulatedUnit":
        """Return a copy of the unit in which zeros, gains and the modulus of the leaves have drifted at random.

        The drifts are due to a change of temperature. Each is uniform within the bound that the report states. All
        leaves have the same modulus, so they share its drift.
        """
        channels = report.read_out.channels
        tips = len(self.heights)
        gain_factors = 1.0 + 0.01 * np.array(channels.gain_drift_percent) * rng.uniform(-1.0, 1.0, tips)
        signal = report.read_out.signal
        modulus_drift_percent = 0.0 if signal is None else signal.modulus_drift_percent
        modulus_drift = 0.01 * modulus_drift_percent * rng.uniform(-1.0, 1.0)
        signal_per_N = np.diag(self.per_mm) / self.domes.K  # signal of each channel per force on its tip
        zero_drift = signal_per_N * np.array(channels.zero_drift_N) * rng.uniform(-1.0, 1.0, tips)
        domes = replace(self.domes, K=self.domes.K * (1.0 + modulus_drift))
        return replace(
            self, domes=domes, per_mm=gain_factors[:, None] * self.per_mm, zero_drift=self.zero_drift + zero_drift
        )


def refuse_unsimulated(report: Report) -> None:
    """Raise InputError if a design has no domes or its fruit has a skin, because such presses cannot be simulated."""
    design = report.design
    if design.tips.dome_radius_mm is None:
        bound = "dome, because presses of other tips cannot be simulated"
        raise validation_error("tips.shape", design.tips.shape, "", bound, "simulate a design with domes")
    if design.fruit.skin_mm is not None:
        bound = "left out, because presses on a skin cannot be simulated"
        raise validation_error(
            "fruit.skin_mm", design.fruit.skin_mm, "mm", bound, "simulate the fruit without its skin"
        )


def designed_unit(report: Report) -> SimulatedUnit:
    """Return a unit that equals its design, with channels that show newtons and springs that do not creep.

    The channels have the noise of the design, but no zero error and no drift.
    """
    K = 1.0 / np.diag(report.read_out.springs_mm_per_N)
    tips = len(K)
    return SimulatedUnit(
        domes=domes_of(report.design, K),
        heights=np.zeros(tips),
        creep=0.0,
        weighed_s=WEIGHED_AFTER_S,
        per_mm=np.diag(K),  # a channel shows the force of its spring, which is K times the deflection
        zeros=np.zeros(tips),
        noise=_noise_N(report),
        zero_drift=np.zeros(tips),
        saturation=None,
    )


def given_unit(report: Report, unit: "PrintedUnit") -> SimulatedUnit:
    """Return a simulated unit with the springs and channels of a calibrated `unit`.

    Its channels show counts if counts were calibrated, and newtons otherwise. If a reference ball corrects the readings
    by a factor, all stiffnesses are multiplied by that factor, because E is proportional to the forces.
    """
    K = np.array(unit.stiffnesses)  # (tips,) [N/mm]
    factor = 1.0 if unit.ball is None else unit.ball.factor
    designed = designed_unit(report)
    # signal_per_N (channels, tips) is the signal of each channel per force on each tip: [counts/N], or [1] for newtons.
    if unit.newtons_per_count:
        signal_per_N = np.linalg.inv(np.array(unit.newtons_per_count))
        zeros, saturation = np.array(unit.zero_counts), unit.saturation_counts
    else:
        signal_per_N = np.diag(1.0 / np.array(unit.gain))
        zeros, saturation = designed.zeros, None
    return replace(
        designed,
        domes=domes_of(report.design, factor * K),
        creep=_creep_exponent(unit.measured_creep_or(report.creep).per_decade),
        weighed_s=unit.weighed_after_s,
        per_mm=signal_per_N * K,  # K multiplies the columns, one per tip
        zeros=zeros,
        noise=np.abs(np.diag(signal_per_N)) * designed.noise,
        saturation=saturation,
    )


def draw_unit(report: Report, rng: np.random.Generator) -> SimulatedUnit:
    """Return a unit with random errors of leaves, domes and channels; its channels show counts.

    The process of the design states the scatter of its prints. The constants of this module state the scatter of the
    zeros and the sensitivities.
    """
    designed = designed_unit(report)
    design = report.design
    nominal_K = designed.domes.K
    tips = len(nominal_K)
    stiffness_factors = _draw_stiffness_factors(design, rng)
    saturation = report.read_out.channels.saturation_counts
    counts_per_N = _designed_counts_per_N(report)
    # A Hall sensor responds to the deflection, so the counts per mm do not depend on the true stiffness of the spring.
    counts_per_mm = counts_per_N * nominal_K * (1.0 + _SENSITIVITY_DEVIATION * rng.normal(size=tips))
    creep_per_decade = max(rng.normal(report.creep.per_decade, report.creep.error), 0.0)  # springs do not stiffen
    height_deviation, _ = form_deviations(design.tips, design.process)
    return replace(
        designed,
        domes=draw_form(design, domes_of(design, stiffness_factors * nominal_K), rng),
        heights=rng.normal(0.0, height_deviation, tips),
        creep=_creep_exponent(creep_per_decade),
        per_mm=np.diag(counts_per_mm),
        zeros=np.rint(_LARGEST_ZERO * saturation * rng.uniform(-1.0, 1.0, tips)),
        noise=counts_per_N * designed.noise,
        saturation=saturation,
    )


def _designed_counts_per_N(report: Report) -> Floats:
    """Return the counts of each channel per force on its tip [1/N], shape (tips,).

    For a design without a read-out, full scale is the fraction `_FULL_SCALE_FRACTION` of the converter's range.
    """
    if report.read_out.signal is not None:
        return np.array(report.read_out.signal.counts_per_N)
    full_scale_N = np.maximum(report.read_out.full_scale_N, _SMALLEST_FULL_SCALE)
    return np.asarray(_FULL_SCALE_FRACTION * report.read_out.channels.saturation_counts / full_scale_N)


def _creep_exponent(per_decade: float) -> float:
    """Return the exponent n for which the compliance is proportional to time^n.

    In each decade of time, the compliance grows by the factor 10^n = 1 + `per_decade`. The formula is written here
    again, because a simulated unit shares no law with what reads it.
    """
    return math.log10(1.0 + per_decade)


def _draw_stiffness_factors(design: Design, rng: np.random.Generator) -> Floats:
    """Return the random stiffness of each spring divided by its designed stiffness [1], shape (tips,).

    The factors stay between 1/2 and 2. K is proportional to the modulus of the material, which all leaves share, and to
    thickness^3. The thickness errors of the leaves are independent; their standard deviation is half of the accuracy.
    """
    process = design.process
    thickness = np.array(design.tips.each(*process.leaf_thicknesses_mm))
    # The factor 3 is the exponent of the thickness.
    log_errors_by_thickness = 3.0 * 0.5 * process.accuracy_mm / thickness * rng.normal(size=len(thickness))
    log_factors = log_errors_by_thickness + process.E_scatter * rng.normal()
    log_limit = math.log(_SMALLEST_STIFFNESS_RATIO)
    return np.asarray(np.exp(np.clip(log_factors, log_limit, -log_limit)))


def domes_of(design: Design, K: Floats) -> SprungDomes:
    """Return the domes of a design on springs of stiffness K (tips,) [N/mm]; tips without a dome have the radius 0."""
    tips = design.tips
    radius = tips.dome_radius_mm or 0.0
    rim = min(0.5 * tips.side_mm, radius)  # distance from the axis at which a dome ends [mm]
    return SprungDomes(dome_radius=radius, positions=np.array(tips.places_mm), K=K, rim=rim)


def draw_form(design: Design, domes: SprungDomes, rng: np.random.Generator) -> SprungDomes:
    """Return a copy of the domes with a random error of the radius, and with a cap that is randomly flat or pointed.

    All domes of one print have the same form error. `form` is the height of the error [mm] at the distance r [mm] from
    the axis.
    """
    height_deviation, radius_deviation = form_deviations(design.tips, design.process)
    cap_radius = float(rng.choice(CAPS))
    height = float(rng.normal(0.0, height_deviation))
    return replace(
        domes,
        dome_radius=domes.dome_radius * (1.0 + float(rng.normal(0.0, radius_deviation))),
        # The error of the height is largest on the axis, and decreases smoothly to 0 at the edge of the cap.
        form=lambda r: height * np.maximum(1.0 - np.square(r / cap_radius), 0.0) ** 2,
    )


def _noise_N(report: Report) -> Floats:
    """Return the standard deviation of the noise of each channel [N], without the error of rounding to counts."""
    if report.read_out.signal is not None:
        return np.array(report.read_out.signal.noise_N)
    reading = report.design.reading or ReadingRequirements()
    return np.hypot(0.01 * reading.noise_percent * np.array(report.read_out.full_scale_N), reading.noise_N)
