"""Leaf lengths that give the springs their target stiffness, and the stiffness of a housing as it is, by FE."""

import dataclasses
import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from cad.parts.housing import Housing
from cad.quantity import validation_error
from cad.theory.leaf_spring import Flexure
from pipeline.springs.mesh_pairs import COARSE, MeshPair, mesh_pairs_for
from pipeline.springs.solve_memo import FittedHousing, SolveMemo
from solve.housing.stiffness import TipCompliance
from solve.linear import SolveError

TOLERANCE = 1e-3  # of the stiffnesses, and of their targets on the mesh that is solved
MOST_FINE_SOLVES = 4
_LOOSEST = 5e-3  # of the targets: where the coarse mesh has done its work
_MOST_COARSE_SOLVES = 10
_DIGITS = 3  # lengths are drawn to 0.001 mm
_LONGEST_STEP = 1.6  # of a length, either way
_SHORTEST_STEP = 2e-3  # of a length, to learn the slope from: a shorter one would measure the scatter of the meshes


def solve_housing(housing: Housing, E: float, poisson: float, tolerance: float = TOLERANCE) -> FittedHousing:
    """Return the stiffness of a housing as it is [N/mm from mm, E in MPa], to a relative tolerance where a mesh has it.

    Raises MeshError or SolveError.
    """
    memo = SolveMemo(E=E, poisson=poisson)
    return _cheapest(mesh_pairs_for(housing, tolerance), tolerance, lambda pair: memo.fitted(housing, pair))


def solve_on(pair: MeshPair, housing: Housing, E: float, poisson: float) -> FittedHousing:
    """Return the stiffness of a housing [N/mm from mm, E in MPa] on one pair of meshes; raises as `solve_housing`."""
    return SolveMemo(E=E, poisson=poisson).fitted(housing, pair)


def fit_lengths(
    housing: Housing,
    targets: Sequence[float],
    E: float,
    poisson: float,
    tolerance: float = TOLERANCE,
    executor: Executor | None = None,
) -> FittedHousing:
    """Return the housing whose leaf lengths give each spring its target stiffness [N/mm from mm, E in MPa] to 0.1 %.

    A coarse mesh, stretched from step to step, finds the lengths; finer ones say by how much it lies high. The error
    bars are within the relative tolerance where a mesh has it; a tolerance beyond 0.1 % holds for the targets too, up
    to 0.5 %. Raises InputError when a target leaves no leaf, SolveError when 4 fine solves do not meet the targets.
    """
    memo = SolveMemo(E=E, poisson=poisson, executor=executor)
    memo.begin_solid(housing)  # a worker imports the CAD kernel for it while lengths are looked for
    fit = _Fit(memo, housing, tuple(targets))
    allowed_miss = min(max(tolerance, TOLERANCE), _LOOSEST)
    return _cheapest(mesh_pairs_for(housing, tolerance), tolerance, lambda pair: fit.on(pair, allowed_miss))


def _cheapest(pairs: Sequence[MeshPair], tolerance: float, work: Callable[[MeshPair], FittedHousing]) -> FittedHousing:
    """Return the result of the first pair whose bars meet the tolerance, else of the last; its status says which."""
    for pair in pairs:
        fitted = work(pair)
        errors = fitted.stiffness.error
        if max(errors) <= tolerance:
            break
    outcome = "meet" if max(errors) <= tolerance else "are the least there is, but miss"
    bars = " and ".join(f"{100.0 * error:.2g}" for error in errors)
    info = fitted.stiffness.info
    status = f"{info.status}: bars of {bars} % {outcome} {100.0 * tolerance:g} %"
    stiffness = dataclasses.replace(fitted.stiffness, info=dataclasses.replace(info, status=status))
    return dataclasses.replace(fitted, stiffness=stiffness)


@dataclass
class SecantModel:
    """Stiffness over length of one spring on the coarse mesh: nearly a straight line in K^(-1/3), as of a beam.

    `slope` is that of the length [mm] over K^(-1/3), `root` the last K^(-1/3); before the first point the beam law's.
    """

    slope: float
    length: float = math.nan
    root: float = math.nan

    def learn(self, length: float, K: float) -> None:
        """Put the line through a new point [mm, N/mm] and, where the last one is far enough away, through both."""
        step, root = length - self.length, K ** (-1.0 / 3.0)
        if abs(step) > _SHORTEST_STEP * length and (root - self.root) * step > 0.0:
            self.slope = step / (root - self.root)
        self.length, self.root = length, root

    def stiffness(self, length: float) -> float:
        """Return the stiffness [N/mm] at a length [mm]."""
        return 1.0 / (self.root + (length - self.length) / self.slope) ** 3

    def length_for(self, K: float) -> float:
        """Return the length [mm], to 0.001 mm and at most 1.6 times away from the last, at which the stiffness is K."""
        root: float = K ** (-1.0 / 3.0)
        wanted = self.length + self.slope * (root - self.root)
        return round(min(max(wanted, self.length / _LONGEST_STEP), self.length * _LONGEST_STEP), _DIGITS)


def _with_length(name: str, flexure: Flexure, length: float, K: float) -> Flexure:
    if not length > 2.0 * flexure.fillet:
        bound = f"greater than 2 fillets = {2.0 * flexure.fillet:g} mm to reach {1e3 * K:.6g} N/m"
        key = f"flexures.{name}.length"
        raise validation_error(key, length, "mm", bound, "choose another process or other targets")
    return dataclasses.replace(flexure, length=length)


class _Fit:
    """All leaf lengths at once: what the coarse mesh says of them, and by how much it lies above a finer one."""

    def __init__(self, memo: SolveMemo, housing: Housing, targets: tuple[float, ...]) -> None:
        """Start from the beam law."""
        self._memo, self._housing, self._targets = memo, housing, targets
        self._near = False
        self._models = [
            SecantModel(slope=arm.flexure.thickness * math.cbrt(2.0 * memo.E * arm.flexure.depth))
            for arm in housing.arms
        ]

    def on(self, pair: MeshPair, allowed_miss: float) -> FittedHousing:
        """Return the housing that meets the targets within a share of them on the fine mesh of a pair."""
        found_by_itself = pair.fine == COARSE
        aims = self._targets if found_by_itself else self._raised([_lift(arm.flexure) for arm in self._housing.arms])
        if not self._near:
            self._approach(aims)
        for attempt in range(MOST_FINE_SOLVES):
            if attempt or not found_by_itself:
                self._move(aims)
            coarse = self._coarse_here() if pair.coarse == COARSE else None
            K = self._memo.stiffness(self._housing, pair, coarse).K
            if _miss(K, self._targets) <= allowed_miss:
                return self._memo.fitted(self._housing, pair, coarse)
            aims = self._raised([a / b for a, b in zip(self._coarse_K(), K, strict=True)])
        shown, wanted = (", ".join(f"{value:.6g}" for value in values) for values in (K, self._targets))
        msg = (
            f"flexures: K = {shown} N/mm after {MOST_FINE_SOLVES} fine solves: must be {wanted} N/mm within "
            f"{allowed_miss:g}; start from other lengths"
        )
        raise SolveError(msg)

    def _approach(self, aims: Sequence[float]) -> None:
        """Move the lengths until the coarse mesh is near its aims."""
        self._near = True
        for _ in range(_MOST_COARSE_SOLVES):
            K = self._memo.solve(self._housing, COARSE, stretch=True).K
            for model, arm, stiffness in zip(self._models, self._housing.arms, K, strict=True):
                model.learn(arm.flexure.length, stiffness)
            if _miss(K, aims) <= _LOOSEST:
                break
            self._move(aims)

    def _move(self, aims: Sequence[float]) -> None:
        moved = {
            arm.name: _with_length(arm.name, arm.flexure, model.length_for(K), K)
            for arm, model, K in zip(self._housing.arms, self._models, aims, strict=True)
        }
        self._housing = self._housing.with_flexures(moved)

    def _raised(self, factors: Sequence[float]) -> tuple[float, ...]:
        return tuple(factor * target for factor, target in zip(factors, self._targets, strict=True))

    def _coarse_K(self) -> tuple[float, ...]:
        """Return what the coarse mesh would give here: its last step was so short that a solve tells nothing new."""
        pairs = zip(self._models, self._housing.arms, strict=True)
        return tuple(model.stiffness(arm.flexure.length) for model, arm in pairs)

    def _coarse_here(self) -> TipCompliance | None:
        """Return the coarse mesh's last result, carried to these lengths; None with gauges, which need their own."""
        last = self._memo.solutions[COARSE][1]
        if last.gauge_strain_per_N is not None:
            return None
        share = np.sqrt(np.array(last.K) / np.array(self._coarse_K()))
        sag = tuple((share**2 * np.array(last.weight_sag)).tolist())
        return dataclasses.replace(last, C=last.C * np.outer(share, share), weight_sag=sag)


def _lift(flexure: Flexure) -> float:
    """Return the stiffness on the coarse mesh over that on a finer one [1], before it is known: to 5e-4 as a rule.

    Fitted by tests/fits/coarse_mesh.py.
    """
    return 1.0 + 0.0035 / (1.0 + 0.55 * flexure.length / flexure.depth)


def _miss(stiffnesses: Sequence[float], targets: Sequence[float]) -> float:
    return max(abs(K / target - 1.0) for K, target in zip(stiffnesses, targets, strict=True))
