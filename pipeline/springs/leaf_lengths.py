"""Fit the leaf lengths so that the springs have their target stiffnesses, by finite elements.

The secant method varies the lengths until the stiffnesses computed on a mesh meet the targets. The method runs on a
coarse mesh first and then on a fine mesh. A rough answer uses a single coarse mesh.
"""

import dataclasses
import functools
import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cad.kernel import draw_part_size
from cad.parts.housing import Housing, PartSize
from cad.parts.pin import pin_compliance
from mesh.housing.sweep import FlexureMesh, check_flexure_mesh, flexure_mesh, stretch_leaves
from pipeline.options import ROUGH_TOLERANCE
from pipeline.springs.mounts import coarse_half, mount_layers
from sensor.arrays import Floats
from sensor.quantity import Estimate, validation_error
from sensor.record import Record
from sensor.theory.leaf_spring import Flexure
from solve.housing.stiffness import (
    ERROR_SHARE,
    SPRINGS,
    HousingStiffness,
    TipCompliance,
    compliance_of,
    housing_stiffness,
    tip_compliance,
    tip_stiffnesses,
)
from solve.linear import SolveError

# default relative tolerance, both for the error bars of the stiffnesses and for their distance from the targets
TOLERANCE = 1e-3
# largest relative deviation from the targets that is accepted; on a fine mesh the limit may be smaller
MAX_DEVIATION = 5e-3
MAX_SOLVES = 10  # maximum number of solutions on a coarse or rough mesh
MAX_FINE_SOLVES = 4  # maximum number of solutions on a fine mesh, where the fit starts from the coarse fit
COARSE = 2.0  # scale of the mesh on which the lengths are fitted first; its elements are twice as large as normal
_DIGITS = 3  # decimal places of a drawn length [mm]
_LONGEST_STEP = 1.6  # largest factor by which one step lengthens or shortens a leaf
# smallest relative step in length that updates the slope; over a shorter step, scatter between meshes would dominate
_SHORTEST_STEP = 2e-3

# Ratio of the stiffness on the rough mesh to the stiffness on the normal mesh. The ratio was 1.0035 to 1.0146 for 93
# random designs. In 300 designs the ratio differed from this constant by at most 0.0056, which the error bar covers.
# See tests/reference/fits/test_rough_springs.py.
ROUGH_LIFT = 1.009
ROUGH_ERROR = 0.0088  # relative error bar of a stiffness on the rough mesh, after division by `ROUGH_LIFT`


@dataclass(frozen=True, kw_only=True)
class MeshPair:
    """Scales of a fine mesh and of a coarser mesh used to estimate its error, with the constants of the estimate.

    A larger scale means larger elements. The relative error bar is `fraction` [1] times the relative difference between
    the two meshes, plus `floor` [1]. The pair is used only if the tolerance is at least `least_tolerance` [1].
    """

    fine: float
    coarse: float
    fraction: float
    floor: float
    least_tolerance: float

    def stiffness_with_errors(self, housing: Housing, fine: TipCompliance, coarse: TipCompliance) -> HousingStiffness:
        """Return the stiffness of a housing [N/mm], with error bars from its solutions on the two meshes.

        The error bars are wider for leaves of unusual shape. The status of the result names the two meshes.
        """
        stiffness = housing_stiffness(fine, coarse)
        errors = []
        for arm, error in zip(housing.arms, stiffness.error, strict=True):
            # `housing_stiffness` multiplies the relative difference between the two meshes by ERROR_SHARE
            difference = error / ERROR_SHARE
            errors.append(odd_shape_factor(arm.flexure) * self.fraction * difference + self.floor)
        status = f"mesh of scale {self.fine:g} judged by scale {self.coarse:g} ({stiffness.info.status})"
        info = dataclasses.replace(stiffness.info, status=status)
        return dataclasses.replace(stiffness, error=tuple(errors), info=info)


DEFAULT = MeshPair(fine=1.0, coarse=2.0, fraction=ERROR_SHARE, floor=1e-4, least_tolerance=1e-3)
# Observed ratio of the error to the difference between the two meshes. The first pair has 0.27, compared with meshes of
# 112,000 dofs for 30 random designs. The last pair has 0.024, compared with meshes of 2.7 times the dofs for one arm of
# five designs, and 0.026, compared with four times the dofs. Source: tests/reference/fits/test_housing.py
MESH_PAIRS = (
    MeshPair(fine=2.0, coarse=4.0, fraction=0.3, floor=2e-4, least_tolerance=1e-2),
    DEFAULT,
    MeshPair(fine=0.5, coarse=2.0, fraction=0.03, floor=1e-5, least_tolerance=0.0),
)


def odd_shape_factor(flexure: Flexure) -> float:
    """Return the factor by which the error bar from two meshes is enlarged for a leaf of unusual shape [1].

    For such leaves, the difference between two meshes underestimates the error, for two reasons. All meshes have the
    same fans of elements at the roots, whose error matters if a leaf is barely deeper than it is thick. The meshes also
    have few layers through the depth, which are not enough if a leaf is deeper than it is long. The factor is 2.5 for a
    long leaf as thick as it is deep, for which the observed factor was 2. The factor approaches 1 for a
    long leaf that is much deeper than thick.
    """
    shallowness = min(1.0, flexure.thickness / flexure.depth)  # 0 if much deeper than thick, at most 1
    shortness = max(0.0, 1.0 - flexure.length / (0.8 * flexure.depth))  # 0 if longer than 0.8 of its depth, at most 1
    return 1.0 + 1.5 * shallowness + 2.0 * shortness


@dataclass(frozen=True, kw_only=True, repr=False)
class FittedHousing(Record):
    """A housing and its stiffness by finite elements."""

    housing: Housing
    stiffness: HousingStiffness


class HousingSolver:
    """Solver for the compliance of housings of one material, on meshes of several scales.

    The last mesh of each scale is cached. The cached mesh can be stretched for the next housing, and compared with the
    solid.
    """

    def __init__(
        self, E: float, poisson: float, begin_solid: Callable[[Housing], Future[PartSize]] | None = None
    ) -> None:
        """Store the material: E [MPa] and Poisson's ratio [1].

        `begin_solid` starts making the solid of a housing, and returns a future of the size of this solid.
        """
        self.E = E
        self.poisson = poisson
        # cached, so that two calls for the same housing in succession make its solid only once
        self._begin_solid = None if begin_solid is None else functools.lru_cache(maxsize=1)(begin_solid)
        self._last: dict[float, tuple[Housing, FlexureMesh]] = {}  # housing and mesh by the scale of the mesh

    def solve(self, housing: Housing, scale: float) -> TipCompliance:
        """Compute the compliance of the tips of a housing [mm/N] on a mesh of the given scale.

        A `scale` above 1 means larger elements. At the scale `COARSE`, the mesh of the previous housing is stretched to
        fit this housing if possible, which is faster than a new mesh. At a finer scale, the solid is started too,
        because this housing may be the final one. The mesh is stored for `check` and for the next housing.
        """
        if self._begin_solid is not None and scale < COARSE:
            self._begin_solid(housing)
        mesh = None
        if scale == COARSE and scale in self._last:
            last_housing, last_mesh = self._last[scale]
            mesh = stretch_leaves(last_mesh, last_housing, housing)  # None if the change is too large
        if mesh is None:
            mesh = flexure_mesh(housing, scale)
        self._last[scale] = (housing, mesh)
        return tip_compliance(mesh, self.E, self.poisson, mount_layers(housing))

    def check(self, scale: float) -> None:
        """Raise MeshError if the last mesh of the given scale differs from the solid of its housing."""
        housing, mesh = self._last[scale]
        size = draw_part_size(housing) if self._begin_solid is None else self._begin_solid(housing).result()
        check_flexure_mesh(mesh, size)


@dataclass(frozen=True, kw_only=True)
class Secant:
    """A secant of the leaf length as a function of K^(-1/3), which is a straight line for a beam.

    `slope` is d length / d K^(-1/3), with K in N/mm and lengths in mm. `length` [mm] and `root` = K^(-1/3) come from
    the last solution. Length and root are nan before the first solution.
    """

    slope: float
    length: float = math.nan
    root: float = math.nan

    def through(self, length: float, K: float) -> "Secant":
        """Return the secant through the previous point and a new point with `length` [mm] and K [N/mm].

        The slope is unchanged if the points are too close together, or if the length does not increase with K^(-1/3).
        The slope is also unchanged at the first point, because the previous point is nan then.
        """
        root = K ** (-1.0 / 3.0)
        step = length - self.length
        is_reliable = abs(step) > _SHORTEST_STEP * length and (root - self.root) * step > 0.0  # False for nan
        return Secant(slope=step / (root - self.root) if is_reliable else self.slope, length=length, root=root)

    def stiffness(self, length: float) -> float:
        """Return the stiffness [N/mm] that the secant predicts for a length [mm]."""
        return 1.0 / (self.root + (length - self.length) / self.slope) ** 3

    def length_for(self, K: float) -> float:
        """Return the length [mm] that the secant predicts for K [N/mm], rounded to 0.001 mm.

        The length changes by at most a factor of 1.6, because the secant is not reliable farther away.
        """
        root: float = K ** (-1.0 / 3.0)
        extrapolated = self.length + self.slope * (root - self.root)
        return round(min(max(extrapolated, self.length / _LONGEST_STEP), self.length * _LONGEST_STEP), _DIGITS)


class MeshFit(NamedTuple):
    """A housing solved on one mesh, and for each spring the secant through its last two solutions on this mesh."""

    housing: Housing
    compliance: TipCompliance
    secants: tuple[Secant, ...]

    def housing_for_targets(self, targets: Floats) -> Housing:
        """Return the housing whose leaves have the target stiffnesses [N/mm] on this mesh, as predicted by the secants.

        `targets` has an entry for each arm, the low spring first. Raises InputError if a leaf would be shorter than its
        two fillets.
        """
        flexures = {}
        for arm, secant, K in zip(self.housing.arms, self.secants, targets.tolist(), strict=True):
            length = secant.length_for(K)
            key = f"flexures.{arm.name}.length"
            if not length > 2.0 * arm.flexure.fillet:
                bound = f"greater than 2 fillets = {2.0 * arm.flexure.fillet:g} mm to reach {1e3 * K:.6g} N/m"
                hint = "choose another process or other targets"
                raise validation_error(key, length, "mm", bound, hint)
            flexures[arm.name] = dataclasses.replace(arm.flexure, length=length)
        return self.housing.with_flexures(flexures)

    def scaled_compliance(self, housing: Housing) -> TipCompliance:
        """Estimate the compliance of a housing with nearly the same leaf lengths on this mesh, without solving it.

        The solved compliance is scaled to the stiffnesses predicted by the secants. The lengths are so close that a
        solution would not be more accurate.
        """
        compliance = self.compliance
        pairs = zip(self.secants, housing.arms, strict=True)
        K = np.array([secant.stiffness(arm.flexure.length) for secant, arm in pairs])
        # Each row and each column of C is multiplied by this factor, so the compliance of each tip has its square.
        factors = np.sqrt(compliance.K / K)
        weight_sag = tuple((factors**2 * compliance.weight_sag).tolist())
        return dataclasses.replace(compliance, C=compliance.C * np.outer(factors, factors), weight_sag=weight_sag)


def fit_on_mesh(
    housing: Housing,
    slopes: Sequence[float],
    targets: Floats,
    solve: Callable[[Housing], TipCompliance],
    max_deviation: float = MAX_DEVIATION,
    max_solves: int = MAX_SOLVES,
) -> MeshFit:
    """Fit the leaf lengths of a housing by the secant method, until its springs meet their targets on one mesh.

    `housing` is the initial guess. `targets` are the target stiffnesses [N/mm], low spring first. `max_deviation` [1]
    is the largest accepted relative deviation from them. `solve` computes the compliance of a housing on the mesh, and
    is called at most `max_solves` times. `slopes` holds the initial slope d length / d K^(-1/3) of each spring, for
    example by the beam law.

    Raises InputError if a leaf would be shorter than its two fillets, and SolveError if the targets are not met after
    `max_solves` solutions.
    """
    secants = tuple(Secant(slope=slope) for slope in slopes)
    for _ in range(max_solves):
        compliance = solve(housing)
        springs = zip(secants, housing.arms, compliance.K, strict=True)
        secants = tuple(secant.through(arm.flexure.length, K) for secant, arm, K in springs)
        fit = MeshFit(housing, compliance, secants)
        if largest_deviation(compliance.K, targets) <= max_deviation:
            return fit
        housing = fit.housing_for_targets(targets)
    raise _targets_not_met(compliance.K, targets, max_deviation, max_solves)


def _targets_not_met(
    stiffnesses: Sequence[float], targets: Floats, max_deviation: float, max_solves: int
) -> SolveError:
    """Return the error for stiffnesses [N/mm] that differ too much from their targets after `max_solves` solutions."""
    K_text = ", ".join(f"{stiffness:.6g}" for stiffness in stiffnesses)
    targets_text = ", ".join(f"{target:.6g}" for target in targets)
    msg = (
        f"flexures: K = {K_text} N/mm after {max_solves} solves: must be {targets_text} N/mm within {max_deviation:g}; "
        f"choose other targets or another --tol"
    )
    return SolveError(msg)


def largest_deviation(stiffnesses: Sequence[float], targets: Floats) -> float:
    """Return the largest relative deviation of the stiffnesses from their targets [1]."""
    return float(np.abs(stiffnesses / targets - 1.0).max())


def fit_lengths(
    housing: Housing, targets: Sequence[float], solver: HousingSolver, tolerance: float = TOLERANCE
) -> FittedHousing:
    """Fit the leaf lengths of a housing so that each spring has its target stiffness in `targets` [N/mm].

    `housing` is the initial guess. Finer meshes are used until the relative error bars of the stiffnesses are within
    `tolerance` [1], or until no finer mesh is left. The stiffnesses meet the targets within 0.1 %. A `tolerance` above
    0.1 % is also the limit for the targets, but this limit is at most 0.5 %. At `ROUGH_TOLERANCE` and above, one rough
    mesh is used, on which the targets are met within 0.5 %. Pins glued into the feet are in series with the springs,
    and the targets include them.

    Raises InputError if a leaf would be shorter than its two fillets, and SolveError if the targets are not met. Raises
    MeshError if a mesh differs from its solid.
    """
    start = time.perf_counter()
    pin = None
    foot_targets = np.array(targets)  # stiffnesses at the feet, into which pins may be glued [N/mm]
    if housing.pin is not None:
        # the mesh has no pins, so their compliance is subtracted from the targets and added to the result
        pin = pin_compliance(housing.pin, solver.E, solver.poisson)
        foot_targets = np.array(targets_without_pins(targets, pin))
    is_rough = tolerance >= ROUGH_TOLERANCE
    if is_rough:
        housing, stiffness = _fit_on_rough_mesh(housing, foot_targets, solver)
    else:
        housing, stiffness = _fit_on_pairs(housing, foot_targets, solver, tolerance)
    origin = "by random designs" if is_rough else _comparison_text(stiffness.error, tolerance)
    status = f"{stiffness.info.status}: error bars of {_percents(stiffness.error)} % {origin}"
    if pin is not None:
        stiffness = add_pin_compliance(stiffness, pin)
        status = f"{status}; with the compliance of pins in their feet {_percents(stiffness.error)} %"
    info = dataclasses.replace(stiffness.info, status=status, seconds=time.perf_counter() - start)
    return FittedHousing(housing=housing, stiffness=dataclasses.replace(stiffness, info=info))


def _comparison_text(errors: Sequence[float], tolerance: float) -> str:
    """Return the end of a sentence about error bars [1], which states whether they are within the tolerance [1]."""
    comparison = "meet" if max(errors) <= tolerance else "are the smallest of all meshes, but exceed"
    return f"{comparison} {100.0 * tolerance:g} %"


def _percents(errors: Sequence[float]) -> str:
    """Return relative errors [1] as text in per cent, joined by "and"."""
    return " and ".join(f"{100.0 * error:.2g}" for error in errors)


def _fit_on_pairs(
    housing: Housing, targets: Floats, solver: HousingSolver, tolerance: float
) -> tuple[Housing, HousingStiffness]:
    """Fit a housing to targets [N/mm] on the cheapest mesh pair that meets the tolerance; return it with its stiffness.

    The lengths are fitted on the mesh of scale `COARSE` first, so that one solution on a finer mesh is usually enough.
    If no pair has error bars within `tolerance` [1], the result on the finest pair is returned. Raises MeshError if the
    last mesh differs from the solid of its housing, and the same errors as `fit_on_mesh`.
    """
    beam_slopes = _beam_slopes(housing, solver.E)
    max_deviation = min(max(tolerance, TOLERANCE), MAX_DEVIATION)
    coarse_fit = None  # the fit on the mesh of scale `COARSE`, which all finer meshes reuse
    pairs = [pair for pair in MESH_PAIRS if pair.least_tolerance <= tolerance]  # the cheapest first
    for pair in pairs:
        solve = functools.partial(solver.solve, scale=pair.fine)
        if pair.fine == COARSE:
            fine_fit = fit_on_mesh(housing, beam_slopes, targets, solve, max_deviation)
            coarse_fit = fine_fit
            coarser_solution = solver.solve(fine_fit.housing, pair.coarse)
        else:
            # On the coarse mesh the springs are too stiff by a known factor, so the targets are multiplied by this
            # factor.
            coarse_targets = targets * [coarse_lift(arm.flexure) for arm in housing.arms]
            if coarse_fit is None:
                solve_coarse = functools.partial(solver.solve, scale=COARSE)
                coarse_fit = fit_on_mesh(housing, beam_slopes, coarse_targets, solve_coarse)
            fine_fit = _refine_fit(coarse_fit, coarse_targets, targets, solve, max_deviation)
            coarser_solution = coarse_fit.scaled_compliance(fine_fit.housing)
        housing = fine_fit.housing
        stiffness = pair.stiffness_with_errors(housing, fine_fit.compliance, coarser_solution)
        if max(stiffness.error) <= tolerance:
            break
    solver.check(pair.fine)  # the fine mesh of the last pair that was solved, whose result is returned
    return housing, stiffness


def _refine_fit(
    coarse_fit: MeshFit,
    coarse_targets: Floats,
    targets: Floats,
    solve: Callable[[Housing], TipCompliance],
    max_deviation: float,
) -> MeshFit:
    """Fit the leaf lengths to `targets` [N/mm] on a finer mesh, starting from the fit on the coarse mesh.

    `coarse_targets` [N/mm] are the stiffnesses that a housing with these targets has on the coarse mesh. `solve` and
    `max_deviation` are passed to `fit_on_mesh`, whose errors are raised.
    """
    guess = coarse_fit.housing_for_targets(coarse_targets)
    coarse_slopes = [secant.slope for secant in coarse_fit.secants]
    return fit_on_mesh(guess, coarse_slopes, targets, solve, max_deviation, MAX_FINE_SOLVES)


def coarse_lift(flexure: Flexure) -> float:
    """Estimate the ratio of the stiffness on the coarse mesh to the stiffness on a finer mesh [1].

    A coarse mesh is too stiff, and more so if a leaf is short compared with its depth. The ratio is usually accurate to
    5e-4. Its two constants are fitted to solutions on both meshes in tests/reference/fits/test_housing.py.
    """
    return 1.0 + 0.0035 / (1.0 + 0.55 * flexure.length / flexure.depth)


def _beam_slopes(housing: Housing, E: float) -> list[float]:
    """Return d L / d K^(-1/3) of each leaf from the beam law K = 2 E d (t / L)^3.

    Here L, t and d are the length, the thickness and the depth of a leaf [mm], and E is in MPa.
    """
    return [arm.flexure.thickness * math.cbrt(2.0 * E * arm.flexure.depth) for arm in housing.arms]


def _fit_on_rough_mesh(housing: Housing, targets: Floats, solver: HousingSolver) -> tuple[Housing, HousingStiffness]:
    """Fit the leaf lengths of a housing to targets [N/mm] on the rough mesh; return the housing and its stiffness.

    A rough answer makes no solid, so the mesh is not compared with a solid.
    """
    solve = functools.partial(rough_compliance, E=solver.E, poisson=solver.poisson)
    fit = fit_on_mesh(housing, _beam_slopes(housing, solver.E), targets, solve)
    return fit.housing, rough_stiffness(fit.housing, fit.compliance)


def rough_compliance(housing: Housing, E: float, poisson: float) -> TipCompliance:
    """Return the compliance of the tips [mm/N] on the rough mesh, corrected to the normal mesh.

    The rough mesh is too stiff by the factor `ROUGH_LIFT`, so its compliance is multiplied by this factor. `E` is in
    MPa. Raises SolveError if the mesh cannot be solved.
    """
    compliance = compliance_of(coarse_half(housing, E, poisson, rough=True))
    return dataclasses.replace(compliance, C=ROUGH_LIFT * compliance.C)


def rough_stiffness(housing: Housing, compliance: TipCompliance) -> HousingStiffness:
    """Return the stiffness of a housing [N/mm] on the rough mesh, with error bars derived from random designs."""
    errors = tuple(ROUGH_ERROR * odd_shape_factor(arm.flexure) for arm in housing.arms)
    # The same solution is passed as both meshes. The error bars are replaced below, except the error bar of the strain,
    # which does not need a second mesh.
    one_mesh = housing_stiffness(compliance, compliance)
    info = dataclasses.replace(one_mesh.info, status=f"20-node hexahedra, one rough mesh of {compliance.dofs} dofs")
    return dataclasses.replace(one_mesh, error=errors, weight_sag_error=errors, info=info)


def targets_without_pins(targets: Sequence[float], pin: Estimate) -> tuple[float, ...]:
    """Return the stiffnesses [N/mm] that the feet must have to meet the targets in series with their pins.

    `targets` are the stiffnesses at the ends of the pins, low spring first. `pin` is the compliance of a pin glued into
    its foot [mm/N]. Raises InputError if a pin is softer than its target, because no foot can then meet the target.
    """
    for name, K in zip(SPRINGS, targets, strict=True):
        if pin.value * K >= 1.0:
            bound = f"less than {1.0 / pin.value:.4g} N/mm, the stiffness of a pin in its foot"
            hint = "choose tips.socket = 'none' or other targets"
            key = f"flexures.{name}.stiffness"
            raise validation_error(key, K, "N/mm", bound, hint)
    return tuple(K / (1.0 - pin.value * K) for K in targets)


def add_pin_compliance(stiffness: HousingStiffness, pin: Estimate) -> HousingStiffness:
    """Return the stiffness [N/mm] at the ends of the pins, which are in series with their feet.

    `stiffness` is the stiffness at the feet, and `pin` is the compliance of a pin [mm/N]. The error of the pin's
    compliance is added to the error of the stiffness at the foot.
    """
    C = stiffness.C + pin.value * np.eye(len(stiffness.C))
    errors = []
    for K_with_pin, K_foot, foot_error in zip(tip_stiffnesses(C), stiffness.K, stiffness.error, strict=True):
        foot_fraction = K_with_pin / K_foot  # fraction of the compliance, and therefore of its error, due to the foot
        errors.append(foot_fraction * foot_error + pin.error * K_with_pin)
    return dataclasses.replace(stiffness, C=C, error=tuple(errors))
