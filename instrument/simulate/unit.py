"""A real unit with its springs, domes and channels: as designed, from a unit.toml, or drawn from its process.

Errors are drawn as in the error analysis of a design: half of a tolerance is one standard deviation, and a drift is
uniform within its bound.
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

_SENSITIVITY = 0.03  # standard deviation of the sensitivity of Hall sensors and magnets [1]; calibration removes it
_ZERO = 0.02  # largest zero of a channel before calibration, as a fraction of the converter's range
_FULL_COUNTS = 0.25  # counts at full scale of a design without a read-out, as a fraction of the converter's range
_SOFTEST = 0.5  # least stiffness over its design; prints are not softer, and not stiffer than the inverse


@dataclass(frozen=True, kw_only=True, eq=False)
class SimulatedUnit:
    """The springs, domes and channels of a unit, in the order of its tips.

    The stiffnesses of its `domes` hold for weights that hang for `weighed_s` [s]. The compliance grows with a power
    `creep` of time [1]. Domes protrude by `heights` [mm]. A channel shows `zeros` plus `per_mm` (channels, tips) times
    the deflections [mm], with a `noise` in each sample. It shows counts below `saturation`, or newtons if that is None.
    Zeros have drifted by `zero_drift` since the tare.
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
        """Return whether its channels show counts."""
        return self.saturation is not None

    def shown(self, deflections: Floats) -> Floats:
        """Return the signals of the channels for deflections [mm], (samples, tips), without noise and drift."""
        return np.asarray(self.zeros + deflections @ self.per_mm.T)

    def in_other_air(self, report: Report, rng: np.random.Generator) -> "SimulatedUnit":
        """Return the unit at another temperature, with drifts of zeros, gains and the modulus of its leaves."""
        channels = report.read_out.channels
        tips = len(self.heights)
        gains = 1.0 + 0.01 * np.array(channels.gain_drift_percent) * rng.uniform(-1.0, 1.0, tips)
        signal = report.read_out.signal
        softer = 0.01 * (0.0 if signal is None else signal.modulus_drift_percent) * rng.uniform(-1.0, 1.0)
        per_N = np.diag(self.per_mm) / self.domes.K
        zero = per_N * np.array(channels.zero_drift_N) * rng.uniform(-1.0, 1.0, tips)
        domes = replace(self.domes, K=self.domes.K * (1.0 + softer))
        return replace(self, domes=domes, per_mm=gains[:, None] * self.per_mm, zero_drift=self.zero_drift + zero)


def refuse_unpressed(report: Report) -> None:
    """Raise InputError for a design that is not simulated: without domes, or under a skin."""
    design = report.design
    if design.tips.dome_radius_mm is None:
        bound = "dome: presses of other tips are not simulated"
        raise validation_error("tips.shape", design.tips.shape, "", bound, "simulate a design with domes")
    if design.fruit.skin_mm is not None:
        bound = "left out: presses on a skin are not simulated"
        raise validation_error(
            "fruit.skin_mm", design.fruit.skin_mm, "mm", bound, "simulate the fruit without its skin"
        )


def designed_unit(report: Report) -> SimulatedUnit:
    """Return the unit exactly as designed, with channels in newtons and springs without creep."""
    K = 1.0 / np.diag(report.read_out.springs_mm_per_N)
    tips = len(K)
    return SimulatedUnit(
        domes=domes_of(report.design, K),
        heights=np.zeros(tips),
        creep=0.0,
        weighed_s=WEIGHED_AFTER_S,
        per_mm=np.diag(K),
        zeros=np.zeros(tips),
        noise=_noise_N(report),
        zero_drift=np.zeros(tips),
        saturation=None,
    )


def given_unit(report: Report, unit: "PrintedUnit") -> SimulatedUnit:
    """Return the unit of a calibration; its channels show counts if these were calibrated, else newtons.

    A reference ball gives one factor for all readings, whatever its cause. Here it multiplies all stiffnesses, because
    E is proportional to the forces.
    """
    K = np.array(unit.stiffnesses)
    factor = 1.0 if unit.ball is None else unit.ball.factor
    designed = designed_unit(report)
    if unit.newtons_per_count:
        per_N = np.linalg.inv(np.array(unit.newtons_per_count))
        zeros, saturation = np.array(unit.zero_counts), unit.saturation_counts
    else:
        per_N, zeros, saturation = np.diag(1.0 / np.array(unit.gain)), designed.zeros, None
    return replace(
        designed,
        domes=domes_of(report.design, factor * K),
        creep=math.log10(1.0 + unit.creep_or(report.creep).per_decade),
        weighed_s=unit.weighed_after_s,
        per_mm=per_N * K,
        zeros=zeros,
        noise=np.abs(np.diag(per_N)) * designed.noise,
        saturation=saturation,
    )


def drawn_unit(report: Report, rng: np.random.Generator) -> SimulatedUnit:
    """Return a unit with counts, drawn from the scatter of its process, leaves, domes and channels."""
    designed = designed_unit(report)
    design, signal = report.design, report.read_out.signal
    process, nominal = design.process, designed.domes.K
    tips = len(nominal)
    thickness = np.array(design.tips.each(*process.leaf_thicknesses_mm))
    # All leaves share their material; their thicknesses scatter independently.
    of_leaves = 3.0 * 0.5 * process.accuracy_mm / thickness * rng.normal(size=tips)
    factor = np.exp(np.clip(of_leaves + process.E_scatter * rng.normal(), math.log(_SOFTEST), -math.log(_SOFTEST)))
    saturation = report.read_out.channels.saturation_counts
    if signal is None:
        counts_per_N = _FULL_COUNTS * saturation / np.maximum(report.read_out.full_scale_N, 1e-9)
    else:
        counts_per_N = np.array(signal.counts_per_N)
    # A Hall sensor shows the deflection, whatever the stiffness of the spring.
    counts_per_mm = counts_per_N * nominal * (1.0 + _SENSITIVITY * rng.normal(size=tips))
    creep = max(rng.normal(report.creep.per_decade, report.creep.error), 0.0)
    accuracy, _ = form_deviations(design.tips, process)
    return replace(
        designed,
        domes=drawn_form(design, domes_of(design, factor * nominal), rng),
        heights=rng.normal(0.0, accuracy, tips),
        creep=math.log10(1.0 + creep),
        per_mm=np.diag(counts_per_mm),
        zeros=np.rint(_ZERO * saturation * rng.uniform(-1.0, 1.0, tips)),
        noise=counts_per_N * designed.noise,
        saturation=saturation,
    )


def domes_of(design: Design, K: Floats) -> SprungDomes:
    """Return the domes of a design on springs [N/mm]; their radius is 0 for other tips."""
    tips = design.tips
    radius = tips.dome_radius_mm or 0.0
    return SprungDomes(dome_radius=radius, positions=np.array(tips.places_mm), K=K, rim=min(0.5 * tips.side_mm, radius))


def drawn_form(design: Design, domes: SprungDomes, rng: np.random.Generator) -> SprungDomes:
    """Return domes with a wrong radius and a flat or pointed cap; all domes of a print have the same form."""
    outline, of_radius = form_deviations(design.tips, design.process)
    cap, height = float(rng.choice(CAPS)), float(rng.normal(0.0, outline))
    return replace(
        domes,
        dome_radius=domes.dome_radius * (1.0 + float(rng.normal(0.0, of_radius))),
        form=lambda r: height * np.maximum(1.0 - np.square(r / cap), 0.0) ** 2,
    )


def _noise_N(report: Report) -> Floats:
    """Return the standard deviation of the noise of each channel [N], without the rounding to counts."""
    if report.read_out.signal is not None:
        return np.array(report.read_out.signal.noise_N)
    reading = report.design.reading or ReadingRequirements()
    return np.hypot(0.01 * reading.noise_percent * np.array(report.read_out.full_scale_N), reading.noise_N)
