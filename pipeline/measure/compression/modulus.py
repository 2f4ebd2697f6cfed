"""The modulus of a fruit from one compression test: by its force law, and as force over plate area over strain."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cad.quantity import Bounds, Estimate, validation_error
from pipeline.measure.compression.force_law import TestGeometry, force_law
from pipeline.measure.compression.loading import Loading, loading, name_of
from pipeline.measure.compression.range_choice import RangeFit, choose_range
from pipeline.measure.compression.specimens import Specimen

Floats = NDArray[np.float64]

COVERAGE = 1.96
"""Standard errors on each side: 95 %."""
PLAUSIBLE = Bounds(at_least=0.01, at_most=100.0)
"""Moduli of whole fruit and tubers [MPa]: beyond, a unit is wrong."""
USUAL = Bounds(at_least=0.1, at_most=12.0)
"""Moduli that fruit mostly have [MPa]: beyond, the result asks to look at the units again."""
_ASIDE = 0.2  # of the travel to a strain, on each side: what its secant and tangent are read from
_LEAST_POINTS = 6
_RISEN = 0.1  # of the largest force: the plate is on the fruit
_LAST = 0.95  # of the curve, where a stated strain lies beyond it


@dataclass(frozen=True, kw_only=True)
class PlateModulus:
    """Stress over strain at one strain: the secant from the first touch and the tangent, with errors at 95 %."""

    strain_percent: float
    E_secant_MPa: float
    u_secant_percent: float
    E_tangent_MPa: float
    u_tangent_percent: float


@dataclass(frozen=True, kw_only=True)
class CompressionResult:
    """What one specimen says: `E_hertz_MPa` with `u_percent` at 95 %, and the moduli of a plate at several strains."""

    specimen: Specimen
    geometry: TestGeometry
    curve: Loading
    chosen: RangeFit
    E_hertz_MPa: float
    u_percent: float
    secants: tuple[PlateModulus, ...]
    notes: tuple[str, ...]

    @property
    def E_plate_MPa(self) -> float:
        """Return the paper's modulus: force over plate area, over travel over height [MPa]."""
        return self.secants[0].E_secant_MPa

    @property
    def reads_low(self) -> float:
        """Return by which factor the paper's modulus lies below Hertz's [1]."""
        return self.E_hertz_MPa / self.E_plate_MPa


def measured_modulus(
    specimen: Specimen, geometry: TestGeometry, *, compression_negative: bool = False
) -> CompressionResult:
    """Return the moduli of one specimen; raises InputError for a curve that is no compression of a fruit."""
    curve = loading(specimen, compression_negative=compression_negative)
    _refuse_long_travel(specimen, curve, geometry)
    law = force_law(geometry)
    chosen = choose_range(curve, law)
    if chosen is None:
        hint = "check that it is a whole loading, from before the touch on"
        raise validation_error(name_of(specimen), "curve", "", "one that Hertz's law can be fitted to", hint)
    E = (1.0 - geometry.poisson**2) / law.stiffness * chosen.factor.value
    if not PLAUSIBLE.hold(E):
        hint = "check the units of force and travel, and the radius"
        name = f"{name_of(specimen)}: modulus"
        raise validation_error(name, float(f"{E:.3g}"), "MPa", f"{PLAUSIBLE} for a fruit", hint)
    strains = _strains(curve, chosen, geometry)
    return CompressionResult(
        specimen=specimen,
        geometry=geometry,
        curve=curve,
        chosen=chosen,
        E_hertz_MPa=E,
        u_percent=COVERAGE * chosen.factor.percent,
        secants=tuple(_plate_modulus(curve, chosen, geometry, strain) for strain in strains),
        notes=(*specimen.notes, *_notes(E, chosen, geometry, strains[0])),
    )


def _refuse_long_travel(specimen: Specimen, curve: Loading, geometry: TestGeometry) -> None:
    """Raise InputError where the plate goes through the fruit: from the first force to the end is more than it is."""
    rising = curve.force > curve.zero + _RISEN * (float(curve.force.max()) - curve.zero)
    depth = float(curve.travel[-1] - curve.travel[int(np.argmax(rising))])
    if depth > geometry.height_mm:
        name = f"{name_of(specimen)}: travel under load"
        bound = f"less than the height of the fruit, {geometry.height_mm:g} mm"
        raise validation_error(name, float(f"{depth:.3g}"), "mm", bound, "check the unit of travel, and --height")


def _notes(E: float, chosen: RangeFit, geometry: TestGeometry, first_strain: float) -> list[str]:
    notes = []
    asked = geometry.strains_percent[0]
    if first_strain != asked:
        notes.append(f"the curve ends before {asked:g} % strain: its secant is at {first_strain:g} %")
    if not USUAL.hold(E):
        notes.append(f"a modulus of {E:.3g} MPa is unusual for a fruit: check the units of force and travel")
    if not chosen.follows:
        cause = "the shape of the fruit or its flesh differs"
        notes.append(f"the curve does not follow Hertz's law within its noise: {cause}")
    if chosen.idle == 0:
        notes.append("no rows before the touch: the zero of the force is fitted with the rest")
    if chosen.fit.drift.value:
        notes.append(f"the zero line drifts by {chosen.fit.drift.value:.3g} N/mm: taken out")
    return notes


def _strains(curve: Loading, chosen: RangeFit, geometry: TestGeometry) -> list[float]:
    """Return the strains [%] that the curve reaches, the first one replaced where it lies beyond the end."""
    last = 100.0 * _LAST * (float(curve.travel[-1]) - chosen.touch.value) / geometry.height_mm
    unsure = 100.0 * COVERAGE * chosen.touch.error / geometry.height_mm
    smallest = min(geometry.strains_percent)
    if smallest < unsure:
        bound = f"at least {unsure:.2g} %, within which the first touch is known"
        raise validation_error("--strain", smallest, "%", bound, "take a larger strain, or a finer curve")
    within = [strain for strain in geometry.strains_percent if strain <= last]
    if geometry.strains_percent[0] in within:
        return within
    rounded = float(f"{last:.2g}")
    return [rounded if rounded <= last else last, *within]


def _plate_modulus(curve: Loading, chosen: RangeFit, geometry: TestGeometry, strain: float) -> PlateModulus:
    """Return secant and tangent at a strain [%] from the parabola through the points about it."""
    depth = 0.01 * strain * geometry.height_mm
    force = curve.force - chosen.fit.offset - chosen.fit.drift.value * curve.travel
    level, slope, curvature = _parabola(curve.travel - chosen.touch.value - depth, force, _ASIDE * depth)
    level_error = math.hypot(level.error, slope.value * chosen.touch.error)
    slope_error = math.hypot(slope.error, curvature.value * chosen.touch.error)
    per_strain = geometry.height_mm / geometry.plate_area_mm2
    return PlateModulus(
        strain_percent=strain,
        E_secant_MPa=level.value / depth * per_strain,
        u_secant_percent=100.0 * COVERAGE * level_error / abs(level.value),
        E_tangent_MPa=slope.value * per_strain,
        u_tangent_percent=100.0 * COVERAGE * slope_error / abs(slope.value),
    )


def _parabola(x: Floats, force: Floats, aside: float) -> list[Estimate]:
    """Return force [N], slope [N/mm] and change of slope [N/mm^2] at x = 0 [mm], with standard errors.

    Taken from the points not farther than `aside` [mm], or from the nearest few.
    """
    count = min(_LEAST_POINTS, len(x)) - 1
    aside = max(aside, float(np.partition(np.abs(x), count)[count]))
    near = np.abs(x) <= aside
    powers = np.vander(x[near] / aside, 3, increasing=True)
    solution, *_ = np.linalg.lstsq(powers, force[near], rcond=None)
    residual = force[near] - powers @ solution
    variance = float(residual @ residual) / max(1, len(residual) - 3)
    error = np.sqrt(np.diag(np.linalg.pinv(powers.T @ powers)) * variance)
    scale = np.array([1.0, 1.0 / aside, 2.0 / aside**2])
    return [Estimate(float(value), float(width)) for value, width in zip(solution * scale, error * scale, strict=True)]
