"""The modulus of a fruit from one compression test: by a fitted force law, and as plate stress over strain."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from instrument.compress.force_law import POISSON, ForceLaw, TestGeometry, geometry_data, hertz_law, solved_law
from instrument.compress.holds import HeldRelaxation, held_relaxation
from instrument.compress.law_fit import LawFit, fit_law
from instrument.compress.phases import Loading, phases, without_frame
from instrument.compress.range_choice import RangeFit, choose_range
from instrument.compress.specimens import Specimen, read_specimens
from pipeline.storage.stopwatch import Count, silent
from sensor.attributes import with_attributes
from sensor.design.fruit import USUAL_MODULI
from sensor.quantity import Bounds, report_field, validation_error
from sensor.turns import in_turn

COVERAGE = 1.96
"""Number of standard errors to each side that contain 95 %."""
PLAUSIBLE = Bounds(at_least=0.01, at_most=100.0)
"""Plausible moduli of whole fruit and tubers [MPa]; beyond them a unit is wrong."""
ALLOWED_PERCENT = Bounds(below=100.0)
"""Allowed half width of a modulus [%]; a larger error bar contains 0."""
_ASIDE = 0.2  # half width of the range of points for secant and tangent, as a fraction of the travel to their strain
_LEAST_POINTS = 6  # minimum number of these points
_RISEN = 0.1  # fraction of the largest force at which the plate certainly touches the fruit
_LAST = 0.95  # fraction of the curve up to which a strain may be evaluated


@dataclass(frozen=True, kw_only=True)
class PlateModulus:
    """Stress over strain at one strain: the secant from the first touch and the tangent, with errors at 95 %."""

    strain_percent: float
    E_secant_MPa: float
    u_secant_percent: float
    E_tangent_MPa: float
    u_tangent_percent: float


@with_attributes
@dataclass(frozen=True, kw_only=True)
class CompressionResult:
    """The moduli of one specimen of a compression test, with their errors at 95 %.

    The errors from scatter, force curve and Poisson's ratio add as the root of their squares. The other shares are
    bounds that a test may reach together, so they add linearly. `pipeline modulus` prints the same numbers.

    Examples
    --------
    >>> fruit = twintip.Ellipsoid(height_mm=70.0, radius_mm=35.0, radius_across_mm=35.0)
    >>> [test] = twintip.modulus("fruit-1.csv", twintip.TestGeometry(body=fruit))
    >>> 0.0 < test.u_percent < 100.0  # half width of E_MPa at 95 %
    True
    """

    file: str = report_field("", "file, with the name of its sheet")
    specimen: str = report_field("", "name of the specimen in the file")
    read_as: str = report_field("", "what was read: headers, units, lines and columns that were passed over")
    E_MPa: float = report_field("MPa", "modulus of the flesh")
    E_hertz_MPa: float | None = report_field(
        "MPa", "apparent modulus of ASAE S368; null if Hertz's law cannot be fitted"
    )
    E_over_1_minus_nu2_MPa: float = report_field("MPa", "the modulus that the forces of a sensor depend on")
    E_plate_MPa: float = report_field("MPa", "the paper's modulus: force over plate area, over travel over height")
    u_percent: float = report_field("%", "half width of the error bar of E")
    shares_percent: dict[str, float] = report_field(
        "%", "the parts of this error by their cause", key="u_shares_percent"
    )
    u_plate_percent: float = report_field("%", "half width of the error bar of `E_plate_MPa`")
    reads_low: float = report_field("1", "`E_MPa` divided by `E_plate_MPa`", key="plate_reads_low_by")
    first_touch_mm: float = report_field("mm", "travel at the first touch")
    force_rises_from_mm: float = report_field("mm", "travel from which the fitted force rises")
    range_end_mm: float = report_field("mm", "travel at the end of the range that is fitted")
    failure_mm: float | None = report_field("mm", "travel at which the force fell; null if it did not")
    zero_N: float = report_field("N", "fitted force before the touch")
    drift_N_per_mm: float = report_field("N/mm", "fitted drift of this zero over the travel")
    noise_N: float = report_field("N", "standard deviation of the noise of the force")
    follows_law: bool = report_field("", "whether the curve follows the force of such a body within its noise")
    follows_hertz: bool = report_field("", "whether it follows Hertz's law")
    secants: tuple[PlateModulus, ...] = report_field(
        "", "secant and tangent of force over plate area, over travel over height, at each strain", key="at_strain"
    )
    geometry: TestGeometry = report_field(
        "", "body and tools of the test", inline=lambda it: {"geometry": geometry_data(it.geometry)}
    )
    notes: tuple[str, ...] = report_field("", "what was assumed, and what to look at")
    relaxation: HeldRelaxation | None = report_field(
        "", "what [a hold](#how-flesh-relaxes) shows; left out for a curve without a hold", left_out=True, default=None
    )
    curve: Loading = report_field("", "travel [mm] and force [N] of the loading, up to failure", told=False)
    fit: LawFit = report_field("", "the force law that was fitted, with its parameters", told=False)

    @property
    def name(self) -> str:
        """Return the name of the modulus in an answer."""
        return f"{Path(self.file).name} {self.specimen}"


@in_turn()
def modulus(file: str | Path, geometry: TestGeometry, *, progress: Count | None = None) -> list[CompressionResult]:
    """Return the moduli of all specimens in the file of a compression test, as `pipeline modulus` does.

    Parameters
    ----------
    file : str or Path
        A table of force over travel, a CSV file or a workbook.
    geometry : TestGeometry
        The body that was pressed, and the tools.
    progress : callable, optional
        Function that is called with the numbers of finished parts and of all parts of the work on a specimen.

    Returns
    -------
    list of CompressionResult
        The moduli of each specimen, in the order of the file.

    Raises
    ------
    InputError
        If the file has no force over travel, or a curve is no compression of such a body.
    SolveError
        If the force of such a body cannot be solved. It is a RuntimeError.

    Examples
    --------
    >>> fruit = twintip.Ellipsoid(height_mm=70.0, radius_mm=35.0, radius_across_mm=35.0)
    >>> [test] = twintip.modulus("fruit-1.csv", twintip.TestGeometry(body=fruit))
    >>> round(test.E_MPa, 1)
    0.7
    """
    return [measured_modulus(specimen, geometry, count=progress or silent) for specimen in read_specimens(Path(file))]


def measured_modulus(
    specimen: Specimen, geometry: TestGeometry, *, compression_negative: bool = False, count: Count = silent
) -> CompressionResult:
    """Return the moduli of one specimen, from the fit of a solved force law and from stress over strain.

    `compression_negative` allows travel and force that are negative in compression. `count` is called with the number
    of finished parts of the work and their total. Raises InputError for a curve that is no compression of such a body,
    for an implausible modulus, and for an error bar that contains 0. Raises SolveError if the law cannot be solved.
    """
    test = phases(specimen, compression_negative=compression_negative)
    specimen = test.specimen
    curve = without_frame(specimen, test.loading, geometry.compliance_um_per_N)
    _refuse_long_travel(specimen, curve, geometry)
    law = solved_law(geometry, count)
    chosen = choose_range(curve, law)
    if chosen is None:
        hint = "check that it is a whole loading, from before the touch on"
        raise validation_error(str(specimen), "curve", "", "a loading that follows the force law of a fruit", hint)
    E = chosen.modulus.value
    if not PLAUSIBLE.hold(E):
        hint = "check the units of force and travel, and the radius"
        name = f"{specimen}: modulus"
        raise validation_error(name, float(f"{E:.3g}"), "MPa", f"{PLAUSIBLE} for a fruit", hint)
    # Random errors add as squares. Those due to the law of flesh, friction and shape are bounds, which may all have the
    # same sign, so they add linearly.
    bounds = {}
    for name, others in law.others.items():
        bounds[name] = max(_modulus_change(other, curve, chosen) for other in others)
    random_errors = {
        "scatter of the points": COVERAGE * chosen.modulus.relative,
        "force curve": law.error,
        POISSON: bounds.pop(POISSON),
    }
    if geometry.compliance_error_um_per_N:
        points = int(np.searchsorted(curve.travel, chosen.last, side="right"))
        random_errors["machine compliance"] = _change_by_frame(specimen, test.loading, chosen, points, geometry)
    shares = random_errors | bounds
    u_percent = 100.0 * (math.hypot(*random_errors.values()) + sum(bounds.values()))
    _refuse_wide_bar(specimen, u_percent, max(shares, key=lambda name: shares[name]))
    apparent_law = hertz_law(geometry)
    hertz = apparent_law and choose_range(curve, apparent_law)
    zero = float(chosen.fit.zero_line(curve.travel[-1:])[0])
    secants = [_plate_modulus(curve, chosen, geometry, strain) for strain in _strains(curve, chosen, geometry)]
    relaxation = None
    if test.hold:
        frame_deflections = 1e-3 * geometry.compliance_um_per_N * (specimen.force - curve.zero)  # [mm]
        corrected = replace(specimen, travel=specimen.travel - frame_deflections)
        relaxation = held_relaxation(corrected, test.hold, chosen.touch.value, zero)
    E_plate = secants[0].E_secant_MPa
    return CompressionResult(
        file=specimen.file,
        specimen=specimen.name,
        read_as=specimen.understood,
        E_MPa=E,
        E_hertz_MPa=hertz.modulus.value if hertz else None,
        E_over_1_minus_nu2_MPa=E / (1.0 - geometry.poisson**2),
        E_plate_MPa=E_plate,
        u_percent=u_percent,
        shares_percent={name: 100.0 * share for name, share in shares.items()},
        u_plate_percent=secants[0].u_secant_percent,
        reads_low=E / E_plate,
        first_touch_mm=chosen.touch.value,
        force_rises_from_mm=chosen.fit.onset,
        range_end_mm=chosen.last,
        failure_mm=curve.failure,
        zero_N=chosen.fit.parameters.offset,
        drift_N_per_mm=chosen.fit.parameters.drift,
        noise_N=curve.noise,
        follows_law=chosen.follows,
        follows_hertz=bool(hertz and hertz.follows),
        secants=tuple(secants),
        geometry=geometry,
        notes=(*specimen.notes, *_notes(E, chosen, geometry.strains_percent[0], secants[0].strain_percent)),
        relaxation=relaxation,
        curve=curve,
        fit=chosen.fit,
    )


def _modulus_change(other: ForceLaw, curve: Loading, chosen: RangeFit) -> float:
    """Return the relative error of the modulus [1] if another law were the true one.

    The other law is fitted to the chosen range. If that fails, the stiffnesses of the two laws are compared.
    """
    count = int(np.searchsorted(curve.travel, chosen.last, side="right"))
    has_drift = chosen.fit.parameters.drift != 0.0
    fit = fit_law(other, curve.travel[:count], curve.force[:count], curve.zero, with_drift=has_drift)
    if fit is None:
        return abs(other.stiffness / chosen.fit.law.stiffness - 1.0)
    return abs(chosen.fit.modulus.value / fit.modulus.value - 1.0)


def _change_by_frame(
    specimen: Specimen, measured: Loading, chosen: RangeFit, count: int, geometry: TestGeometry
) -> float:
    """Return the largest relative change of the modulus [1] due to the error of the machine's compliance.

    The error is added and subtracted. `measured` is the loading without correction, and its first `count` points are
    the chosen range.
    """
    changes = []
    for error in (geometry.compliance_error_um_per_N, -geometry.compliance_error_um_per_N):
        curve = without_frame(specimen, measured, geometry.compliance_um_per_N + error)
        has_drift = chosen.fit.parameters.drift != 0.0
        fit = fit_law(chosen.fit.law, curve.travel[:count], curve.force[:count], curve.zero, with_drift=has_drift)
        changes.append(1.0 if fit is None else abs(fit.modulus.value / chosen.fit.modulus.value - 1.0))
    return max(changes)


def _refuse_long_travel(specimen: Specimen, curve: Loading, geometry: TestGeometry) -> None:
    """Raise InputError if the travel from the first force to the end exceeds the height of the body."""
    is_loaded = curve.force > curve.zero + _RISEN * (float(curve.force.max()) - curve.zero)
    depth = float(curve.travel[-1] - curve.travel[int(np.argmax(is_loaded))])
    if depth > geometry.height_mm:
        name = f"{specimen}: travel under load"
        bound = f"less than the height of the body, {geometry.height_mm:g} mm"
        raise validation_error(name, float(f"{depth:.3g}"), "mm", bound, "check the unit of travel, and --height")


def _refuse_wide_bar(specimen: Specimen, u_percent: float, largest_share: str) -> None:
    """Raise InputError if the error bar contains 0.

    The hint names the largest part of the error, and the row with the largest jump of the force.
    """
    if not ALLOWED_PERCENT.hold(u_percent):
        jumps = np.abs(np.diff(specimen.force, n=2))
        outlier = specimen.cell(int(np.argmax(jumps)) + 1, "force")
        name = f"{specimen}: error of the modulus"
        hint = (
            f"its largest part is {largest_share}; correct {outlier} if its force is an outlier, or measure more points"
        )
        raise validation_error(name, float(f"{u_percent:.3g}"), "%", f"{ALLOWED_PERCENT}", hint)


def _notes(E: float, chosen: RangeFit, requested_strain: float, first_strain: float) -> list[str]:
    """Return notes on what is unusual in a test: its strain, its modulus E [MPa], its fit and its zero line.

    `requested_strain` is the first strain of the geometry, and `first_strain` the strain of the first secant [%].
    """
    notes = []
    if first_strain != requested_strain:
        notes.append(f"the curve ends before {requested_strain:g} % strain: its secant is at {first_strain:g} %")
    if not USUAL_MODULI.hold(E):
        notes.append(f"a modulus of {E:.3g} MPa is unusual for a fruit: check the units of force and travel")
    if not chosen.follows:
        cause = "the shape of the fruit or its flesh differs"
        notes.append(f"the curve does not follow the force of such a fruit within its noise: {cause}")
    if chosen.idle == 0:
        notes.append("no rows before the touch: the zero of the force is fitted together with the modulus")
    drift = chosen.fit.parameters.drift
    if drift:
        notes.append(f"the zero line drifts by {drift:.3g} N/mm: the drift is subtracted")
    return notes


def _strains(curve: Loading, chosen: RangeFit, geometry: TestGeometry) -> list[float]:
    """Return the strains of the geometry [%] that the curve reaches.

    The first one is replaced by the largest possible strain if it lies beyond the end. Raises InputError for a strain
    that is smaller than the error of the first touch.
    """
    percent_per_mm = 100.0 / geometry.height_mm
    last = percent_per_mm * _LAST * (float(curve.travel[-1]) - chosen.touch.value)
    touch_error = percent_per_mm * COVERAGE * chosen.touch.error
    first, *others = geometry.strains_percent
    smallest = min(geometry.strains_percent)
    if smallest < touch_error:
        bound = f"at least {touch_error:.2g} %, within which the first touch is known"
        raise validation_error("--strain", smallest, "%", bound, "take a larger strain, or a finer curve")
    if first > last:
        first = min(float(f"{last:.2g}"), last)
    return [first, *(strain for strain in others if strain <= last)]


def _plate_modulus(curve: Loading, chosen: RangeFit, geometry: TestGeometry, strain: float) -> PlateModulus:
    """Return the secant and tangent moduli of stress over strain at a strain [%], with their errors at 95 %.

    They come from a parabola that is fitted to the nearby points, at least the nearest `_LEAST_POINTS`.
    """
    depth = 0.01 * strain * geometry.height_mm
    offsets = curve.travel - chosen.touch.value - depth  # travel relative to the travel at the strain [mm]
    distances = np.abs(offsets)
    is_near = distances <= max(_ASIDE * depth, np.sort(distances)[_LEAST_POINTS - 1])
    force = (curve.force - chosen.fit.zero_line(curve.travel))[is_near]
    coefficients, covariance = np.polyfit(offsets[is_near], force, 2, cov=True)
    half_curvature, slope, force_at_strain = coefficients.tolist()
    _, slope_error, force_error = np.sqrt(np.diag(covariance)).tolist()
    # An error of the touch shifts the curve along the travel.
    force_error = math.hypot(force_error, slope * chosen.touch.error)
    slope_error = math.hypot(slope_error, 2.0 * half_curvature * chosen.touch.error)
    modulus_per_stiffness = geometry.height_mm / geometry.plate_area_mm2  # [1/mm]
    return PlateModulus(
        strain_percent=strain,
        E_secant_MPa=force_at_strain / depth * modulus_per_stiffness,
        u_secant_percent=100.0 * COVERAGE * force_error / abs(force_at_strain),
        E_tangent_MPa=slope * modulus_per_stiffness,
        u_tangent_percent=100.0 * COVERAGE * slope_error / abs(slope),
    )
