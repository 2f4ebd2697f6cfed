"""The modulus of a fruit from one compression test, by a fitted force law and as plate stress divided by strain."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from instrument.compress.force_law import (
    POISSON,
    ForceLaw,
    TestGeometry,
    geometry_data,
    hertz_force_law,
    solve_force_law,
)
from instrument.compress.holds import HeldRelaxation, fit_relaxation
from instrument.compress.law_fit import LawFit, fit_law
from instrument.compress.phases import Loading, Phases, split_phases, subtract_frame
from instrument.compress.range_choice import RangeFit, choose_range
from instrument.compress.specimens import Specimen, read_specimens
from pipeline.storage.stopwatch import Count, ignore_progress
from sensor.attributes import with_attributes
from sensor.design.fruit import USUAL_MODULI
from sensor.input_file import path_of
from sensor.quantity import Bounds, check_type, report_field, validation_error
from sensor.turns import in_turn

COVERAGE = 1.96
"""Half width of a 95 % interval of a normal distribution, in standard errors."""
PLAUSIBLE = Bounds(at_least=0.01, at_most=100.0)
"""Plausible moduli of whole fruit and tubers [MPa]; a value outside is probably due to a wrong unit."""
ALLOWED_PERCENT = Bounds(below=100.0)
"""Allowed half width of the error bar of a modulus [%]; a larger error bar contains 0."""
# Half width of the range of points from which secant and tangent are computed, as a fraction of the depth at their
# strain.
_WINDOW = 0.2
_LEAST_POINTS = 6  # minimum number of points in this range
_USUAL_STRAIN = 0.3  # a judgement: travel under load, relative to the height, before which a whole fruit breaks
_CERTAIN_CONTACT = 0.1  # fraction of the largest force above which the plate certainly touches the fruit
_LAST_STRAIN = 0.95  # largest strain of a secant, as a fraction of the strain at the end of the curve


@dataclass(frozen=True, kw_only=True)
class PlateModulus:
    """Secant and tangent moduli of plate stress against strain at one strain, with errors at 95 %.

    Plate stress is the force divided by the area of the plate. The secant begins at first contact.
    """

    strain_percent: float
    E_secant_MPa: float
    u_secant_percent: float
    E_tangent_MPa: float
    u_tangent_percent: float


@with_attributes
@dataclass(frozen=True, kw_only=True)
class CompressionResult:
    """The moduli of one specimen of a compression test, with their errors at 95 %.

    The errors due to scatter, force curve, Poisson's ratio and machine compliance add in quadrature. The other shares
    are bounds that a test may reach at the same time, so they add linearly. `pipeline modulus` prints the same numbers.

    Examples
    --------
    >>> fruit = twintip.Ellipsoid(height_mm=70.0, radius_mm=35.0, radius_across_mm=35.0)
    >>> [test] = twintip.modulus("fruit-1.csv", twintip.TestGeometry(body=fruit))
    >>> 0.0 < test.u_percent < 100.0  # half width of E_MPa at 95 %
    True
    """

    file: str = report_field("", "name of the file and of its sheet")
    specimen: str = report_field("", "name of the specimen in the file")
    read_as: str = report_field("", "what was read: headers, units and lines, and the columns that were ignored")
    E_MPa: float = report_field("MPa", "modulus of the flesh")
    E_hertz_MPa: float | None = report_field(
        "MPa", "apparent modulus of ASAE S368; null if Hertz's law cannot be fitted"
    )
    E_over_1_minus_nu2_MPa: float = report_field("MPa", "the modulus on which the forces of a sensor depend")
    E_plate_MPa: float = report_field(
        "MPa", "the paper's modulus: force per plate area, divided by the ratio of travel to height"
    )
    u_percent: float = report_field("%", "half width of the error bar of E")
    shares_percent: dict[str, float] = report_field("%", "share of each cause in this error", key="u_shares_percent")
    u_plate_percent: float = report_field("%", "half width of the error bar of `E_plate_MPa`")
    reads_low: float = report_field("1", "`E_MPa` divided by `E_plate_MPa`", key="plate_reads_low_by")
    first_touch_mm: float = report_field("mm", "travel at the first touch")
    force_rises_from_mm: float = report_field("mm", "travel at which the fitted force begins to rise")
    range_end_mm: float = report_field("mm", "travel at the end of the fitted range")
    failure_mm: float | None = report_field("mm", "travel at failure, where the force falls; null without a failure")
    zero_N: float = report_field("N", "fitted force before the first touch")
    drift_N_per_mm: float = report_field("N/mm", "fitted drift of this zero with the travel")
    noise_N: float = report_field("N", "standard deviation of the force noise")
    follows_law: bool = report_field("", "whether the curve follows the force law of such a body within its noise")
    follows_hertz: bool = report_field("", "whether the curve follows Hertz's law within its noise")
    secants: tuple[PlateModulus, ...] = report_field(
        "", "secant and tangent moduli of plate stress against strain, at each strain", key="at_strain"
    )
    geometry: TestGeometry = report_field(
        "", "body and tools of the test", inline=lambda it: {"geometry": geometry_data(it.geometry)}
    )
    notes: tuple[str, ...] = report_field("", "assumptions that were made, and what should be checked")
    relaxation: HeldRelaxation | None = report_field(
        "",
        "relaxation measured in [a hold](#how-flesh-relaxes); left out for a curve without a hold",
        left_out=True,
        default=None,
    )
    curve: Loading = report_field("", "travel [mm] and force [N] of the loading, up to failure", has_key=False)
    fit: LawFit = report_field("", "the fitted force law with its parameters", has_key=False)

    @property
    def name(self) -> str:
        """Return the name of the test as it is printed: the names of its file and of its specimen."""
        return f"{Path(self.file).name} {self.specimen}"


@in_turn()
def modulus(file: str | Path, geometry: TestGeometry, *, progress: Count | None = None) -> list[CompressionResult]:
    """Return the moduli of all specimens in the file of a compression test, as `pipeline modulus` does.

    Parameters
    ----------
    file : str or Path
        A CSV file or a workbook with force against travel.
    geometry : TestGeometry
        The body that was pressed, and the tools.
    progress : callable, optional
        Function that is called with the number of finished parts and the number of all parts of the work on a specimen.

    Returns
    -------
    list of CompressionResult
        The moduli of each specimen, in the order of the file.

    Raises
    ------
    InputError
        If the file has no force and travel, or if a curve does not show the compression of such a body.
    SolveError
        If there is no solution for the force on such a body. It is a subclass of RuntimeError.

    Examples
    --------
    >>> fruit = twintip.Ellipsoid(height_mm=70.0, radius_mm=35.0, radius_across_mm=35.0)
    >>> [test] = twintip.modulus("fruit-1.csv", twintip.TestGeometry(body=fruit))
    >>> round(test.E_MPa, 1)
    0.7
    """
    hint = "make one of the body, as in twintip.TestGeometry(body=fruit)"
    check_type("geometry", geometry, TestGeometry, "a TestGeometry", hint)
    return [
        measure_modulus(specimen, geometry, count=progress or ignore_progress)
        for specimen in read_specimens(path_of(file, "file"))
    ]


def measure_modulus(
    specimen: Specimen, geometry: TestGeometry, *, compression_negative: bool = False, count: Count = ignore_progress
) -> CompressionResult:
    """Determine the moduli of one specimen: by fitting a solved force law, and as plate stress divided by strain.

    `geometry` describes the body and the tools. With `compression_negative`, travel and force may be negative in
    compression. `count` is called with the number of finished parts of the work and with the number of all parts.

    Raises InputError for a curve that does not show the compression of such a body. InputError is also raised for an
    implausible modulus, and for an error bar that contains 0. Raises SolveError if the force law has no solution.
    """
    test = split_phases(specimen, compression_negative=compression_negative)
    measured = test.specimen  # without the rows after the first return of the plate or probe
    curve = subtract_frame(measured, test.loading, geometry.compliance_um_per_N)
    travel = _travel_under_load(curve)
    _check_travel(measured, travel, geometry)
    law = solve_force_law(geometry, count)
    range_fit = _fit_longest_range(measured, curve, law)
    E = range_fit.modulus.value
    random_errors, bounds = _estimate_errors(test, curve, law, range_fit, geometry)
    shares = random_errors | bounds
    u_percent = 100.0 * (math.hypot(*random_errors.values()) + sum(bounds.values()))  # bounds add linearly
    _check_error_bar(measured, u_percent, largest_share=max(shares, key=lambda cause: shares[cause]))
    apparent_law = hertz_force_law(geometry)  # None if no tool touches the body at a point
    hertz_fit = None if apparent_law is None else choose_range(curve, apparent_law)
    strains = _secant_strains(curve, range_fit, geometry)
    secants = [_fit_plate_modulus(curve, range_fit, geometry, strain) for strain in strains]
    E_plate = secants[0].E_secant_MPa  # the paper's modulus is the secant at the first strain
    return CompressionResult(
        file=measured.file,
        specimen=measured.name,
        read_as=measured.summary,
        E_MPa=E,
        E_hertz_MPa=hertz_fit.modulus.value if hertz_fit else None,
        E_over_1_minus_nu2_MPa=E / (1.0 - geometry.poisson**2),
        E_plate_MPa=E_plate,
        u_percent=u_percent,
        shares_percent={name: 100.0 * share for name, share in shares.items()},
        u_plate_percent=secants[0].u_secant_percent,
        reads_low=E / E_plate,
        first_touch_mm=range_fit.touch.value,
        force_rises_from_mm=range_fit.fit.onset,
        range_end_mm=range_fit.range_end,
        failure_mm=curve.failure,
        zero_N=range_fit.fit.parameters.offset,
        drift_N_per_mm=range_fit.fit.parameters.drift,
        noise_N=curve.noise,
        follows_law=range_fit.follows_law,
        follows_hertz=hertz_fit is not None and hertz_fit.follows_law,
        secants=tuple(secants),
        geometry=geometry,
        notes=(
            *measured.notes,
            *_travel_notes(travel, geometry),
            *_notes(E, range_fit, geometry.strains_percent[0], secants[0].strain_percent),
        ),
        relaxation=_fit_hold(test, curve, range_fit, geometry),
        curve=curve,
        fit=range_fit.fit,
    )


def _fit_longest_range(specimen: Specimen, curve: Loading, law: ForceLaw) -> RangeFit:
    """Fit the force law to the longest range of a loading that follows it, and check that the modulus is plausible.

    `specimen` is named in messages. Raises InputError if no range can be fitted, and for an implausible modulus.
    """
    range_fit = choose_range(curve, law)
    if range_fit is None:
        hint = "check that the table contains the whole loading, from before the first contact on"
        raise validation_error(str(specimen), "curve", "", "a loading that follows the force law of a fruit", hint)
    E = range_fit.modulus.value
    if not PLAUSIBLE.hold(E):
        hint = "check the units of force and travel, and the radius"
        name = f"{specimen}: modulus"
        raise validation_error(name, float(f"{E:.3g}"), "MPa", f"{PLAUSIBLE} for a fruit", hint)
    return range_fit


def _estimate_errors(
    test: Phases, curve: Loading, law: ForceLaw, range_fit: RangeFit, geometry: TestGeometry
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the relative errors of the modulus [1] at 95 %, keyed by their cause: the random errors, and the bounds.

    Random errors add in quadrature. The errors due to the constitutive law, the friction and the shape are bounds that
    may all have the same sign, so they add linearly. `curve` is the loading of the `test` after correction for the
    compliance of the machine. `law` is its force law, and `range_fit` is the fit of this law. `geometry` describes the
    body and the tools, and states the compliance of the machine with its error.
    """
    bounds = {}
    for assumption, variants in law.variants.items():
        bounds[assumption] = max(_modulus_change(variant, curve, range_fit) for variant in variants)
    poisson_error = bounds.pop(POISSON)  # a random error, unlike the other assumptions
    random_errors = {
        "scatter of the points": COVERAGE * range_fit.modulus.relative,
        "force curve": law.error,
        POISSON: poisson_error,
    }
    if geometry.compliance_error_um_per_N:
        random_errors["machine compliance"] = _frame_error(test, curve, range_fit, geometry)
    return random_errors, bounds


def _count_points(curve: Loading, range_fit: RangeFit) -> int:
    """Return the number of points of a loading that lie in the fitted range, which begins at the first point."""
    return int(np.searchsorted(curve.travel, range_fit.range_end, side="right"))


def _fit_hold(test: Phases, curve: Loading, range_fit: RangeFit, geometry: TestGeometry) -> HeldRelaxation | None:
    """Return the relaxation of the flesh from the hold of a test; None for a test without a hold.

    `curve` is the loading of the `test` after correction for the compliance in `geometry`, and `range_fit` is its fit.
    """
    if not test.hold:
        return None
    specimen = test.specimen
    zero = float(range_fit.fit.zero_line(curve.travel[-1:])[0])
    frame_deflections = 1e-3 * geometry.compliance_um_per_N * (specimen.force - curve.zero)  # [mm]
    corrected = replace(specimen, travel=specimen.travel - frame_deflections)
    return fit_relaxation(corrected, test.hold, range_fit.touch.value, zero)


def _modulus_change(variant: ForceLaw, curve: Loading, range_fit: RangeFit) -> float:
    """Return the relative error of the modulus [1] that results if `variant` is the true force law.

    `range_fit` is the fit of the nominal law, and `variant` is fitted to the same range of the `curve`. If this second
    fit fails, the ratio of the stiffnesses of both laws replaces the ratio of the moduli.
    """
    count = _count_points(curve, range_fit)
    has_drift = range_fit.fit.parameters.drift != 0.0
    fit = fit_law(variant, curve.travel[:count], curve.force[:count], curve.zero, with_drift=has_drift)
    if fit is None:
        return abs(variant.stiffness / range_fit.fit.law.stiffness - 1.0)
    return abs(range_fit.fit.modulus.value / fit.modulus.value - 1.0)


def _frame_error(test: Phases, curve: Loading, range_fit: RangeFit, geometry: TestGeometry) -> float:
    """Return the largest relative change of the modulus [1] that the error of the machine's compliance may cause.

    The compliance in `geometry` is increased and decreased by its error, and the force law is fitted again. The change
    is 1 if this fit fails. `curve` is the loading of the `test` after correction for the stated compliance, and
    `range_fit` is its fit.
    """
    count = _count_points(curve, range_fit)
    has_drift = range_fit.fit.parameters.drift != 0.0
    changes = []
    for error in (geometry.compliance_error_um_per_N, -geometry.compliance_error_um_per_N):
        changed = subtract_frame(test.specimen, test.loading, geometry.compliance_um_per_N + error)
        travel, force = changed.travel[:count], changed.force[:count]
        fit = fit_law(range_fit.fit.law, travel, force, changed.zero, with_drift=has_drift)
        changes.append(1.0 if fit is None else abs(fit.modulus.value / range_fit.fit.modulus.value - 1.0))
    return max(changes)


def _travel_under_load(curve: Loading) -> float:
    """Return the travel [mm] from the first row with a clear force to the end of the loading."""
    is_loaded = curve.force > curve.zero + _CERTAIN_CONTACT * (float(curve.force.max()) - curve.zero)
    first_loaded = int(np.argmax(is_loaded))
    return float(curve.travel[-1] - curve.travel[first_loaded])


def _check_travel(specimen: Specimen, travel: float, geometry: TestGeometry) -> None:
    """Raise InputError if the `travel` under load [mm] exceeds the height of the body, which no body can survive."""
    if travel > geometry.height_mm:
        name = f"{specimen}: travel under load"
        bound = f"less than the height of the body, {geometry.height_mm:g} mm"
        raise validation_error(name, float(f"{travel:.3g}"), "mm", bound, "check the unit of the travel, and --height")


def _travel_notes(travel: float, geometry: TestGeometry) -> list[str]:
    """Return a note if the `travel` under load [mm] is unusually large for the height of the body."""
    strain = travel / geometry.height_mm
    if strain <= _USUAL_STRAIN:
        return []
    return [
        f"the travel under load is {100.0 * strain:.2g} % of the height, {geometry.height_mm:g} mm: check the height, "
        "the radii and the unit of the travel"
    ]


def _check_error_bar(specimen: Specimen, u_percent: float, largest_share: str) -> None:
    """Raise InputError if the error bar of the modulus contains 0.

    `u_percent` is the half width of the error bar at 95 % [%]. The hint names `largest_share`, the cause with the
    largest share of the error. The hint also names the row with the sharpest bend in the force, because this row may be
    an outlier.
    """
    if not ALLOWED_PERCENT.hold(u_percent):
        bends = np.abs(np.diff(specimen.force, n=2))  # second differences; the first one is centred at the second row
        outlier = specimen.cell(int(np.argmax(bends)) + 1, "force")
        name = f"{specimen}: error of the modulus"
        hint = (
            f"its largest part is {largest_share}; correct {outlier} if its force is an outlier, or measure more points"
        )
        raise validation_error(name, float(f"{u_percent:.3g}"), "%", f"{ALLOWED_PERCENT}", hint)


def _notes(E: float, range_fit: RangeFit, requested_strain: float, first_strain: float) -> list[str]:
    """Return notes on unusual properties of a test: its strain, its modulus E [MPa], its fit and its zero line.

    `range_fit` is the fit of the force law. `requested_strain` [%] is the first strain in the geometry, and
    `first_strain` [%] is the strain of the first secant, which is smaller if the curve ends too early.
    """
    notes = []
    if first_strain != requested_strain:
        notes.append(f"the curve ends before {requested_strain:g} % strain: its secant is at {first_strain:g} %")
    if not USUAL_MODULI.hold(E):
        notes.append(f"a modulus of {E:.3g} MPa is unusual for a fruit: check the units of force and travel")
    if not range_fit.follows_law:
        cause = "the shape of the fruit or the behaviour of its flesh differs"
        notes.append(f"the curve does not follow the force law of such a fruit within its noise: {cause}")
    if range_fit.idle_points == 0:
        notes.append("no rows before the first touch: the zero of the force is fitted together with the modulus")
    drift = range_fit.fit.parameters.drift
    if drift:
        notes.append(f"the zero line drifts by {drift:.3g} N/mm: this drift is subtracted")
    return notes


def _secant_strains(curve: Loading, range_fit: RangeFit, geometry: TestGeometry) -> list[float]:
    """Return the strains [%] at which secants are computed: the requested strains that the curve reaches.

    The first strain is always present, because its secant is the paper's modulus. If the curve does not reach this
    strain, the largest possible strain replaces it. Raises InputError for a strain that is smaller than the error of
    the first touch.
    """
    percent_per_mm = 100.0 / geometry.height_mm
    largest = percent_per_mm * _LAST_STRAIN * (float(curve.travel[-1]) - range_fit.touch.value)
    touch_error = percent_per_mm * COVERAGE * range_fit.touch.error
    first, *others = geometry.strains_percent
    smallest = min(geometry.strains_percent)
    if smallest < touch_error:
        bound = f"at least {touch_error:.2g} %, the error of the first touch"
        raise validation_error("--strain", smallest, "%", bound, "choose a larger strain, or measure more points")
    if first > largest:
        first = min(float(f"{largest:.2g}"), largest)  # two significant digits, but not rounded up beyond the curve
    return [first, *(strain for strain in others if strain <= largest)]


def _fit_plate_modulus(curve: Loading, range_fit: RangeFit, geometry: TestGeometry, strain: float) -> PlateModulus:
    """Return the secant and tangent moduli of plate stress against strain at `strain` [%], with their errors at 95 %.

    With the force F(d) at the depth d from first contact, the height h and the plate area A, the moduli are

        E_secant = (F / A) / (d / h),    E_tangent = (dF/dd / A) h.

    F and dF/dd come from a parabola that is fitted to the points near d, at least to the nearest `_LEAST_POINTS`.
    `range_fit` is the fit of the force law, which determines first contact and the zero line.
    """
    depth = 0.01 * strain * geometry.height_mm
    offsets = curve.travel - range_fit.touch.value - depth  # depth of each point minus the depth at `strain` [mm]
    distances = np.abs(offsets)
    is_near = distances <= max(_WINDOW * depth, np.sort(distances)[_LEAST_POINTS - 1])
    force = (curve.force - range_fit.fit.zero_line(curve.travel))[is_near]
    # At the offset 0, the constant of the parabola is the force, and its linear coefficient is the slope.
    coefficients, covariance = np.polyfit(offsets[is_near], force, 2, cov=True)
    half_curvature, slope, force_at_strain = coefficients.tolist()
    _, slope_fit_error, force_fit_error = np.sqrt(np.diag(covariance)).tolist()
    # An error in the first contact shifts the curve along the travel, which changes the force and the slope at d.
    force_error = math.hypot(force_fit_error, slope * range_fit.touch.error)
    slope_error = math.hypot(slope_fit_error, 2.0 * half_curvature * range_fit.touch.error)
    modulus_per_stiffness = geometry.height_mm / geometry.plate_area_mm2  # [1/mm]
    return PlateModulus(
        strain_percent=strain,
        E_secant_MPa=force_at_strain / depth * modulus_per_stiffness,
        u_secant_percent=100.0 * COVERAGE * force_error / abs(force_at_strain),
        E_tangent_MPa=slope * modulus_per_stiffness,
        u_tangent_percent=100.0 * COVERAGE * slope_error / abs(slope),
    )
