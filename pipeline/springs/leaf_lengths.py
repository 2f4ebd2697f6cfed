"""Leaf lengths that give the springs their target stiffness, and the stiffness of a housing as it is, by FE."""

import dataclasses
import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cad.parts.housing import Housing, PartSize, solid_size
from cad.parts.pin import pin_compliance
from mesh.housing.sweep import FlexureMesh, check_flexure_mesh, flexure_mesh, stretch_leaves
from pipeline.springs.mounts import mount_layers
from sensor.arrays import Floats
from sensor.quantity import validation_error
from sensor.record import Record
from sensor.theory.leaf_spring import Flexure
from solve.housing.stiffness import (
    ERROR_SHARE,
    HousingStiffness,
    TipCompliance,
    housing_stiffness,
    tip_compliance,
    tip_stiffnesses,
)
from solve.linear import SolveError

TOLERANCE = 1e-3  # of the stiffnesses, and of their targets on the mesh that is solved
MOST_FINE_SOLVES = 4
_LOOSEST = 5e-3  # of the targets: where the coarse mesh has done its work
_MOST_COARSE_SOLVES = 10
_DIGITS = 3  # lengths are drawn to 0.001 mm
_LONGEST_STEP = 1.6  # of a length, either way
_SHORTEST_STEP = 2e-3  # of a length, to learn the slope from: a shorter one would measure the scatter of the meshes
COARSE = 2.0  # scale of the mesh that finds the lengths


@dataclass(frozen=True, kw_only=True)
class MeshPair:
    """Scales of the mesh that is solved and of the coarser one that judges it, and the error bar made of the two.

    The error bar is a fraction [1] of the difference between both meshes plus a floor [1]. The pair is tried for
    tolerances from `least_tolerance` [1] on.
    """

    fine: float
    coarse: float
    fraction: float
    floor: float
    least_tolerance: float

    def errors(self, housing: Housing, estimated: tuple[float, ...]) -> tuple[float, ...]:
        """Return the error bars of each spring's stiffness [1] by this pair, from those of `housing_stiffness`."""
        errors = []
        for arm, error in zip(housing.arms, estimated, strict=True):
            difference = error / ERROR_SHARE  # of the stiffness on the two meshes
            errors.append(odd_shape_factor(arm.flexure) * self.fraction * difference + self.floor)
        return tuple(errors)


DEFAULT = MeshPair(fine=1.0, coarse=2.0, fraction=ERROR_SHARE, floor=1e-4, least_tolerance=1e-3)
# Seen of the difference: 0.27 on the first, against 112 thousand dofs and 30 random designs; 0.024 on the last, against
# one arm of five designs with 2.7 times the dofs, which is 0.026 against four times.
# tests/reference/fits/test_housing.py
MESH_PAIRS = (
    MeshPair(fine=2.0, coarse=4.0, fraction=0.3, floor=2e-4, least_tolerance=1e-2),
    DEFAULT,
    MeshPair(fine=0.5, coarse=2.0, fraction=0.03, floor=1e-5, least_tolerance=0.0),
)


def mesh_pairs_for(tolerance: float) -> tuple[MeshPair, ...]:
    """Return the pairs to try for a relative tolerance [1], cheapest first."""
    return tuple(pair for pair in MESH_PAIRS if pair.least_tolerance <= tolerance)


def odd_shape_factor(flexure: Flexure) -> float:
    """Return the factor on the error bar from the difference of two meshes for a leaf of an odd shape [1].

    All meshes have like fans at the roots, whose error shows where a leaf is not much deeper than thick. They have few
    layers for the bending across a leaf that is deeper than long. The 2.5 for a leaf as thick as deep covers the 2 that
    was seen.
    """
    shallow = min(1.0, flexure.thickness / flexure.depth)
    short = max(0.0, 1.0 - flexure.length / (0.8 * flexure.depth))
    return 1.0 + 1.5 * shallow + 2.0 * short


@dataclass(frozen=True, kw_only=True, repr=False)
class FittedHousing(Record):
    """A housing [mm] with its stiffness."""

    housing: Housing
    stiffness: HousingStiffness


class _Solved(NamedTuple):
    housing: Housing
    mesh: FlexureMesh
    compliance: TipCompliance


class HousingSolver:
    """Solves housings of one material on meshes of several scales, the last one of each scale only once."""

    def __init__(
        self, E: float, poisson: float, begin_solid: Callable[[Housing], Future[PartSize]] | None = None
    ) -> None:
        """Take a material [MPa], and what begins the solid, with which a mesh is compared, beside the solves."""
        self.E = E
        self.poisson = poisson
        self._begin_solid = begin_solid
        self._start = time.perf_counter()
        self._last: dict[float, _Solved] = {}  # by the scale of the mesh
        self._solid: tuple[Housing, Future[PartSize]] | None = None

    def solve(self, housing: Housing, scale: float, *, stretch: bool = False) -> TipCompliance:
        """Return the compliance [mm/N] on a mesh of a scale; with `stretch` on the last one, if it stretches."""
        last = self._last.get(scale)
        if last is not None and last.housing == housing:
            return last.compliance
        mesh = None
        if stretch and last is not None:
            mesh = stretch_leaves(last.mesh, last.housing, housing)
        if mesh is None:
            mesh = flexure_mesh(housing, scale)
        compliance = tip_compliance(mesh, self.E, self.poisson, mount_layers(housing))
        self._last[scale] = _Solved(housing, mesh, compliance)
        return compliance

    def stiffness(self, housing: Housing, pair: MeshPair) -> HousingStiffness:
        """Return the stiffness of a housing as it is [N/mm], with its error bars, on a pair of meshes."""
        return stiffness_on(pair, housing, self.solve(housing, pair.fine), self.solve(housing, pair.coarse))

    def last_solution(self, scale: float) -> TipCompliance:
        """Return the last compliance on a mesh of a scale [mm/N]."""
        return self._last[scale].compliance

    def begin_solid(self, housing: Housing) -> None:
        """Begin the solid of a housing, which may be the last one, beside the solves that come."""
        if self._begin_solid is not None and (self._solid is None or self._solid[0] != housing):
            self._solid = (housing, self._begin_solid(housing))

    def fitted(self, housing: Housing, pair: MeshPair, stiffness: HousingStiffness) -> FittedHousing:
        """Return the housing with its stiffness [N/mm], its fine mesh compared with its solid; raises MeshError."""
        self.begin_solid(housing)
        size = solid_size(housing) if self._solid is None else self._solid[1].result()
        check_flexure_mesh(self._last[pair.fine].mesh, size)
        info = dataclasses.replace(stiffness.info, seconds=time.perf_counter() - self._start)
        return FittedHousing(housing=housing, stiffness=dataclasses.replace(stiffness, info=info))


def stiffness_on(pair: MeshPair, housing: Housing, fine: TipCompliance, coarse: TipCompliance) -> HousingStiffness:
    """Return the stiffness [N/mm] of a housing solved on a pair of meshes, with the error bars of the pair."""
    stiffness = housing_stiffness(fine, coarse)
    stiffness = dataclasses.replace(stiffness, error=pair.errors(housing, stiffness.error))
    status = f"mesh of scale {pair.fine:g} judged by scale {pair.coarse:g} ({stiffness.info.status})"
    return _with_status(stiffness, status)


def _with_status(stiffness: HousingStiffness, status: str) -> HousingStiffness:
    return dataclasses.replace(stiffness, info=dataclasses.replace(stiffness.info, status=status))


def fit_lengths(
    housing: Housing, targets: Sequence[float], solver: HousingSolver, tolerance: float = TOLERANCE
) -> FittedHousing:
    """Return the housing whose leaf lengths give each spring its target stiffness [N/mm] to 0.1 %.

    A coarse mesh, stretched from step to step, finds the lengths; finer ones say by how much it lies high. The error
    bars are within the relative tolerance where a mesh reaches it. A tolerance beyond 0.1 % holds for the targets too,
    up to 0.5 %. Pins glued into the feet are in series with the springs. Raises InputError when a target leaves no
    leaf, SolveError when 4 fine solves do not meet the targets.
    """
    of_feet = targets_without_pins(housing, targets, solver.E, solver.poisson)
    fit = _LengthFit(solver, housing, of_feet)
    allowed_miss = min(max(tolerance, TOLERANCE), _LOOSEST)
    for pair in mesh_pairs_for(tolerance):
        fitted = fit.fit_on(pair, allowed_miss)
        if max(fitted.stiffness.error) <= tolerance:
            break
    fitted = _checked(fitted, tolerance)
    stiffness = add_pin_compliance(fitted.stiffness, fitted.housing, solver.E, solver.poisson)
    return dataclasses.replace(fitted, stiffness=stiffness)


def _checked(fitted: FittedHousing, tolerance: float) -> FittedHousing:
    """Return a result whose status says whether its error bars meet the tolerance."""
    errors = fitted.stiffness.error
    outcome = "meet" if max(errors) <= tolerance else "are the least there is, but miss"
    bars = " and ".join(f"{100.0 * error:.2g}" for error in errors)
    status = f"{fitted.stiffness.info.status}: bars of {bars} % {outcome} {100.0 * tolerance:g} %"
    return dataclasses.replace(fitted, stiffness=_with_status(fitted.stiffness, status))


@dataclass
class SecantModel:
    """Stiffness over length of one spring on the coarse mesh: nearly a straight line in K^(-1/3), as of a beam.

    `slope` is that of the length [mm] over K^(-1/3), `root` the last K^(-1/3); before the first point the beam law's.
    """

    slope: float
    length: float = math.nan
    root: float = math.nan

    @classmethod
    def of_beam(cls, leaf: Flexure, E: float) -> "SecantModel":
        """Return the model before the first point [E in MPa]."""
        return cls(slope=leaf.thickness * math.cbrt(2.0 * E * leaf.depth))

    def learn(self, length: float, K: float) -> None:
        """Put the line through a new point [mm, N/mm] and, where the last one is far enough away, through both."""
        root = K ** (-1.0 / 3.0)
        step = length - self.length
        if abs(step) > _SHORTEST_STEP * length and (root - self.root) * step > 0.0:
            self.slope = step / (root - self.root)
        self.length = length
        self.root = root

    def stiffness(self, length: float) -> float:
        """Return the stiffness [N/mm] at a length [mm]."""
        return 1.0 / (self.root + (length - self.length) / self.slope) ** 3

    def length_for(self, K: float) -> float:
        """Return the length [mm], to 0.001 mm and at most 1.6 times away from the last, at which the stiffness is K."""
        root: float = K ** (-1.0 / 3.0)
        wanted = self.length + self.slope * (root - self.root)
        return round(min(max(wanted, self.length / _LONGEST_STEP), self.length * _LONGEST_STEP), _DIGITS)


def with_length(name: str, flexure: Flexure, length: float, K: float) -> Flexure:
    """Return the leaf with another length [mm], which gives K [N/mm]; raises InputError where none is left of it."""
    key = f"flexures.{name}.length"
    if not length > 2.0 * flexure.fillet:
        bound = f"greater than 2 fillets = {2.0 * flexure.fillet:g} mm to reach {1e3 * K:.6g} N/m"
        raise validation_error(key, length, "mm", bound, "choose another process or other targets")
    return dataclasses.replace(flexure, length=length)


class _LengthFit:
    """The search for all leaf lengths at once: a coarse mesh finds them, finer ones say by how much it lies high.

    `aims` [N/mm] are the stiffnesses that the coarse mesh must have, so that the fine one has the targets.
    """

    def __init__(self, solver: HousingSolver, housing: Housing, targets: Sequence[float]) -> None:
        """Start from the beam law."""
        self._solver = solver
        self._housing = housing
        self._targets = np.array(targets)
        self._has_approached = False
        self._models = [SecantModel.of_beam(arm.flexure, solver.E) for arm in housing.arms]

    def fit_on(self, pair: MeshPair, allowed_miss: float) -> FittedHousing:
        """Return the housing that meets the targets within a relative miss [1] on the fine mesh of a pair."""
        coarse_is_fine = pair.fine == COARSE
        aims = self._targets
        if not coarse_is_fine:
            aims = aims * [_lift(arm.flexure) for arm in self._housing.arms]
        if not self._has_approached:
            self._approach(aims)
        for attempt in range(MOST_FINE_SOLVES):
            if attempt or not coarse_is_fine:  # else the coarse mesh, which is the fine one, was solved here already
                self._move(aims)
            stiffness = self._stiffness_on(pair)
            if largest_miss(stiffness.K, self._targets) <= allowed_miss:
                return self._solver.fitted(self._housing, pair, stiffness)
            aims = self._targets * self._coarse_K() / stiffness.K
        found = ", ".join(f"{K:.6g}" for K in stiffness.K)
        wanted = ", ".join(f"{K:.6g}" for K in self._targets)
        msg = (
            f"flexures: K = {found} N/mm after {MOST_FINE_SOLVES} fine solves: must be {wanted} N/mm within "
            f"{allowed_miss:g}; start from other lengths"
        )
        raise SolveError(msg)

    def _stiffness_on(self, pair: MeshPair) -> HousingStiffness:
        """Return the stiffness of the springs at the present lengths [N/mm] on a pair of meshes."""
        self._solver.begin_solid(self._housing)
        fine = self._solver.solve(self._housing, pair.fine)
        coarse = self._coarse_here() if pair.coarse == COARSE else self._solver.solve(self._housing, pair.coarse)
        return stiffness_on(pair, self._housing, fine, coarse)

    def _approach(self, aims: Floats) -> None:
        """Move to the lengths at which the coarse mesh has the aims [N/mm], stretching it from step to step."""
        for _ in range(_MOST_COARSE_SOLVES):
            K = self._solver.solve(self._housing, COARSE, stretch=True).K
            for model, arm, stiffness in zip(self._models, self._housing.arms, K, strict=True):
                model.learn(arm.flexure.length, stiffness)
            if largest_miss(K, aims) <= _LOOSEST:
                break
            self._move(aims)
        self._has_approached = True

    def _move(self, aims: Floats) -> None:
        """Give each spring the length at which the coarse mesh has its aim [N/mm]."""
        flexures = {}
        for arm, model, K in zip(self._housing.arms, self._models, aims.tolist(), strict=True):
            flexures[arm.name] = with_length(arm.name, arm.flexure, model.length_for(K), K)
        self._housing = self._housing.with_flexures(flexures)

    def _coarse_K(self) -> Floats:
        """Return the stiffnesses on the coarse mesh at the present lengths [N/mm], by the secants through its solves.

        The last step was so short that another solve would tell nothing new.
        """
        pairs = zip(self._models, self._housing.arms, strict=True)
        return np.array([model.stiffness(arm.flexure.length) for model, arm in pairs])

    def _coarse_here(self) -> TipCompliance:
        """Return the last result of the coarse mesh scaled to the present lengths."""
        last = self._solver.last_solution(COARSE)
        scale = np.sqrt(last.K / self._coarse_K())  # of a compliance, whose row and column it both scales
        sag = tuple((scale**2 * last.weight_sag).tolist())
        return dataclasses.replace(last, C=last.C * np.outer(scale, scale), weight_sag=sag)


def _lift(flexure: Flexure) -> float:
    """Return the stiffness on the coarse mesh over that on a finer one [1], before it is known: to 5e-4 as a rule.

    Fitted by tests/reference/fits/test_housing.py.
    """
    return 1.0 + 0.0035 / (1.0 + 0.55 * flexure.length / flexure.depth)


def largest_miss(stiffnesses: Sequence[float], targets: Floats) -> float:
    """Return the largest relative distance of a stiffness from its target [1]."""
    return float(np.abs(stiffnesses / targets - 1.0).max())


def targets_without_pins(housing: Housing, targets: Sequence[float], E: float, poisson: float) -> tuple[float, ...]:
    """Return the stiffnesses [N/mm] of the feet with which pins glued into them have the targets."""
    of_pin = pin_compliance(housing, E, poisson).value
    for arm, K in zip(housing.arms, targets, strict=True):
        if of_pin * K >= 1.0:
            bound = f"less than {1.0 / of_pin:.4g} N/mm, the stiffness of a pin in its foot"
            hint = "choose tips.socket = 'none' or other targets"
            key = f"flexures.{arm.name}.stiffness"
            raise validation_error(key, K, "N/mm", bound, hint)
    return tuple(K / (1.0 - of_pin * K) for K in targets)


def add_pin_compliance(stiffness: HousingStiffness, housing: Housing, E: float, poisson: float) -> HousingStiffness:
    """Return the stiffness [N/mm] at the faces of pins from that of the feet; half their span is in the error."""
    pin = pin_compliance(housing, E, poisson)
    if not pin.value:
        return stiffness
    C = stiffness.C + pin.value * np.eye(len(stiffness.C))
    K = tip_stiffnesses(C)
    errors = []
    for with_pin, foot, mesh_error in zip(K, stiffness.K, stiffness.error, strict=True):
        of_foot = with_pin / foot  # fraction of the compliance that is the foot's, and so of its error
        errors.append(of_foot * mesh_error + pin.error * with_pin)
    bars = " and ".join(f"{100.0 * error:.2g}" for error in errors)
    status = f"{stiffness.info.status}; with what pins give in their feet {bars} %"
    pinned = dataclasses.replace(stiffness, C=C, error=tuple(errors))
    return _with_status(pinned, status)
