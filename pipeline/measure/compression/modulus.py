"""The modulus of a fruit from one compression test: by Hertz's law, and as force over plate area over strain."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cad.quantity import LENGTH, Bounds, check_fields, quantity, validation_error
from cad.theory.hertz import equivalent_radius, plate_stiffness
from pipeline.measure.compression.curve import checked_curve, refuse_concave
from pipeline.measure.compression.loading import Loading, loading
from pipeline.measure.compression.range_choice import RangeFit, choose_range
from pipeline.measure.compression.specimens import Specimen

Floats = NDArray[np.float64]

COVERAGE = 1.96  # standard errors on each side: 95 %
PLAUSIBLE = Bounds(at_least=0.01, at_most=100.0)
"""Moduli of whole fruit and tubers [MPa]: beyond, a unit is wrong."""
USUAL = Bounds(at_least=0.1, at_most=12.0)
"""Moduli that fruit mostly have [MPa]: beyond, the answer asks to look at the units again."""
_ASIDE = 0.2  # of the travel to a strain, on each side: what its secant and tangent are read from
_LEAST_POINTS = 6
_RISEN = 0.1  # of the largest force: the plate is on the fruit
_LAST = 0.95  # of the curve, where a stated strain lies beyond it
_MEASURE = "measure it on the fruit"
_STRAINS = Bounds(above=0.0, at_most=50.0)


@dataclass(frozen=True, kw_only=True)
class TestGeometry:
    """The fruit and the plates of a test.

    `radius_mm` and `radius_across_mm` are the radii of curvature of the fruit where a plate touches it. `plates` is 2
    for a fruit between two plates, alike at both; 1 where its underside lies in a seat that gives nothing.
    `strains_percent`, of `height_mm`, are those of secant and tangent, the first that of the paper's modulus.
    """

    __test__ = False  # no class of tests, though its name begins so

    height_mm: float = quantity("mm", LENGTH, remedy=_MEASURE)
    radius_mm: float = quantity("mm", LENGTH, remedy=_MEASURE)
    radius_across_mm: float = quantity("mm", LENGTH, remedy=_MEASURE)
    poisson: float = quantity("", Bounds(above=-1.0, below=0.5), remedy="0.3 to 0.49 is flesh", default=0.3)
    plate_area_mm2: float = quantity("mm^2", Bounds(above=0.0, at_most=1e6), remedy="measure the plate", default=900.0)
    plates: int = 2
    strains_percent: tuple[float, ...] = quantity("%", _STRAINS, remedy="for instance 5", default=(5.0, 2.0, 10.0))

    def __post_init__(self) -> None:
        """Refuse numbers that no fruit has."""
        check_fields(self, "modulus")

    @property
    def stiffness(self) -> float:
        """Return c [mm^(1/2)] of F = c E / (1 - nu^2) D^(3/2)."""
        return plate_stiffness(equivalent_radius(self.radius_mm, self.radius_across_mm), self.plates)


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
    """What one specimen says.

    `E_hertz_MPa` with `u_percent` at 95 %; `E_plate_MPa` is the first secant. `failure_mm` is None where the force did
    not fall. `follows` says whether the curve is Hertz's within its noise.
    """

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
    travel, force = checked_curve(specimen, compression_negative=compression_negative)
    curve = loading(travel, force)
    refuse_concave(specimen, curve)
    _refuse_long_travel(specimen, curve, geometry)
    radius = equivalent_radius(geometry.radius_mm, geometry.radius_across_mm)
    chosen = choose_range(curve, radius, geometry.plates)
    if chosen is None:
        remedy = "check that it is a whole loading, from before the touch on"
        raise validation_error(_place(specimen), "curve", "", "one that Hertz's law can be fitted to", remedy)
    E = (1.0 - geometry.poisson**2) / geometry.stiffness * chosen.factor
    if not PLAUSIBLE.hold(E):
        remedy = "check the units of force and travel, and the radius"
        name = f"{_place(specimen)}: modulus"
        raise validation_error(name, float(f"{E:.3g}"), "MPa", f"{PLAUSIBLE} for a fruit", remedy)
    secants, notes = _secants(curve, chosen, geometry)
    return CompressionResult(
        specimen=specimen,
        geometry=geometry,
        curve=curve,
        chosen=chosen,
        E_hertz_MPa=E,
        u_percent=100.0 * COVERAGE * chosen.factor_error / chosen.factor,
        secants=secants,
        notes=(*specimen.notes, *notes, *_notes(E, chosen)),
    )


def _place(specimen: Specimen) -> str:
    return f"{specimen.file}, specimen {specimen.name!r}"


def _refuse_long_travel(specimen: Specimen, curve: Loading, geometry: TestGeometry) -> None:
    """Raise InputError where the plate goes through the fruit: from the first force to the end is more than it is."""
    rising = curve.force > curve.zero + _RISEN * (float(curve.force.max()) - curve.zero)
    depth = float(curve.travel[-1] - curve.travel[int(np.argmax(rising))])
    if depth > geometry.height_mm:
        name = f"{_place(specimen)}: travel under load"
        bound = f"less than the height of the fruit, {geometry.height_mm:g} mm"
        raise validation_error(name, float(f"{depth:.3g}"), "mm", bound, "check the unit of travel, and --height")


def _notes(E: float, chosen: RangeFit) -> list[str]:
    found = []
    if not USUAL.hold(E):
        found.append(f"a modulus of {E:.3g} MPa is unusual for a fruit: check the units of force and travel")
    if not chosen.follows:
        found.append(
            "the curve does not follow Hertz's law within its noise: the shape of the fruit or its flesh differs"
        )
    if chosen.idle == 0:
        found.append("no rows before the touch: the zero of the force is fitted with the rest")
    if chosen.fit.drift:
        found.append(f"the zero line drifts by {chosen.fit.drift:.3g} N/mm: taken out")
    return found


def _secants(curve: Loading, chosen: RangeFit, geometry: TestGeometry) -> tuple[tuple[PlateModulus, ...], list[str]]:
    reach = float(curve.travel[-1]) - chosen.touch
    last = 100.0 * _LAST * reach / geometry.height_mm
    within = [strain for strain in geometry.strains_percent if strain <= last]
    unsure = 100.0 * COVERAGE * chosen.touch_error / geometry.height_mm
    if min(geometry.strains_percent) < unsure:
        bound = f"at least {unsure:.2g} %, within which the first touch is known"
        raise validation_error(
            "--strain", min(geometry.strains_percent), "%", bound, "take a larger strain, or a finer curve"
        )
    notes = []
    if geometry.strains_percent[0] not in within:
        strain = float(f"{last:.2g}") if float(f"{last:.2g}") <= last else last
        notes.append(f"the curve ends before {geometry.strains_percent[0]:g} % strain: its secant is at {strain:g} %")
        within = [strain, *within]
    return tuple(_secant(curve, chosen, geometry, strain) for strain in within), notes


def _secant(curve: Loading, chosen: RangeFit, geometry: TestGeometry, strain: float) -> PlateModulus:
    """Return secant and tangent at a strain [%] from the parabola through the points about it."""
    depth = 0.01 * strain * geometry.height_mm
    force = curve.force - chosen.fit.offset - chosen.fit.drift * curve.travel
    (level, slope, bend), errors = _parabola(curve.travel - chosen.touch - depth, force, _ASIDE * depth)
    level_error = math.hypot(errors[0], slope * chosen.touch_error)
    slope_error = math.hypot(errors[1], bend * chosen.touch_error)
    stress = geometry.height_mm / geometry.plate_area_mm2
    return PlateModulus(
        strain_percent=strain,
        E_secant_MPa=level / depth * stress,
        u_secant_percent=100.0 * COVERAGE * level_error / abs(level),
        E_tangent_MPa=slope * stress,
        u_tangent_percent=100.0 * COVERAGE * slope_error / abs(slope),
    )


def _parabola(place: Floats, force: Floats, aside: float) -> tuple[list[float], list[float]]:
    """Return force [N], slope [N/mm] and change of slope [N/mm^2] at place 0 [mm], and their standard errors.

    Taken from the points not farther than `aside` [mm], or from the nearest few.
    """
    nearest = np.partition(np.abs(place), min(_LEAST_POINTS, len(place)) - 1)
    aside = max(aside, float(nearest[min(_LEAST_POINTS, len(place)) - 1]))
    near = np.abs(place) <= aside
    table = np.vander(place[near] / aside, 3, increasing=True)
    found, *_ = np.linalg.lstsq(table, force[near], rcond=None)
    residual = force[near] - table @ found
    variance = float(residual @ residual) / max(1, len(residual) - 3)
    error = np.sqrt(np.diag(np.linalg.pinv(table.T @ table)) * variance)
    scale = np.array([1.0, 1.0 / aside, 2.0 / aside**2])
    return (found * scale).tolist(), (error * scale).tolist()
