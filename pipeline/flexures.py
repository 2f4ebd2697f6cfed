"""Leaf lengths that give both target stiffnesses, and the judgement of a housing, by finite elements."""

import dataclasses
import time
from dataclasses import dataclass, field

from cad.flexure import Flexure
from cad.housing import Housing, housing_part
from cad.quantity import fault
from mesh.flexure import FlexureMesh, check_flexure_mesh, flexure_mesh, stretched
from solve.flexure import HousingStiffness, Pair, TipCompliance, housing_stiffness, tip_compliance
from solve.linear import SolveError

COARSE = 2.0  # scale of the mesh that steers the lengths and judges the error
TOLERANCE = 1e-3  # of both targets, on the fine mesh of the final housing
MOST_FINE = 4
_STEER = 5e-3  # of the targets, where the coarse mesh has done its work
_MOST_COARSE = 10
_DIGITS = 3  # lengths are drawn to 0.001 mm
_LONGEST_STEP = 1.6  # of a length, either way
_LEAST_STEP = 2e-3  # of a length, to learn the slope from


@dataclass(frozen=True, kw_only=True)
class FittedFlexures:
    """A housing with its stiffness; `solves` counts the fine and the coarse ones, `seconds` are wall time by stage."""

    housing: Housing
    stiffness: HousingStiffness
    solves: tuple[int, int]
    seconds: dict[str, float]


@dataclass
class _Bench:
    """The coarse and fine solves of one fit, with what they cost."""

    E: float
    poisson: float
    counts: dict[float, int] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=lambda: {"mesh": 0.0, "solve": 0.0})
    made: dict[float, tuple[Housing, FlexureMesh]] = field(default_factory=dict)

    def solved(self, housing: Housing, scale: float, *, fresh: bool = False) -> TipCompliance:
        """Return the compliance on a mesh of this scale: stretched from an earlier one unless it must be fresh."""
        mesh = None
        start = time.perf_counter()
        if scale in self.made and not fresh:
            before, known = self.made[scale]
            mesh = stretched(known, before, housing)
        if mesh is None:
            mesh = flexure_mesh(housing, scale)
            self.made[scale] = housing, mesh
        meshed = time.perf_counter()
        found = tip_compliance(mesh, self.E, self.poisson)
        self.counts[scale] = self.counts.get(scale, 0) + 1
        self.seconds["mesh"] += meshed - start
        self.seconds["solve"] += time.perf_counter() - meshed
        return found

    def judged(self, housing: Housing) -> FittedFlexures:
        """Return the housing with its stiffness on fresh meshes, the fine one compared with the solid."""
        start = time.perf_counter()
        fine, coarse = (self.solved(housing, scale, fresh=True) for scale in (1.0, COARSE))
        compared = time.perf_counter()
        check_flexure_mesh(self.made[1.0][1], housing_part(housing))
        self.seconds["compare"] = self.seconds.get("compare", 0.0) + time.perf_counter() - compared
        stiffness = dataclasses.replace(housing_stiffness(fine, coarse), seconds=time.perf_counter() - start)
        return FittedFlexures(
            housing=housing,
            stiffness=stiffness,
            solves=(self.counts[1.0], self.counts[COARSE]),
            seconds=dict(self.seconds),
        )


def judge_flexures(housing: Housing, E: float, poisson: float) -> FittedFlexures:
    """Return the stiffness of a housing as it is [N/mm from MPa, mm]; raises MeshError or SolveError."""
    return _Bench(E=E, poisson=poisson).judged(housing)


def fit_flexures(housing: Housing, K_low: float, K_high: float, E: float, poisson: float) -> FittedFlexures:
    """Return the housing with both leaf lengths changed so that its stiffnesses are the targets within 0.1 %.

    A coarse mesh, stretched from step to step, finds the lengths and the slope; the fine mesh corrects them.
    Raises InputError when a target leaves no leaf, SolveError when the targets are not met after 4 fine solves.
    """
    targets = (K_low, K_high)
    bench = _Bench(E=E, poisson=poisson)
    steer = _Secant(E=E, targets=targets)
    for _ in range(_MOST_COARSE):
        found = bench.solved(housing, COARSE).K
        if _miss(found, targets) < _STEER:
            break
        housing = steer.step(housing, found)
    found = bench.solved(housing, 1.0).K
    while bench.counts[1.0] < MOST_FINE:
        housing = steer.step(housing, found)
        fitted = bench.judged(housing)
        found = fitted.stiffness.K
        if _miss(found, targets) <= TOLERANCE:
            return fitted
    msg = (
        f"flexures: K = {found[0]:.6g}, {found[1]:.6g} N/mm after {MOST_FINE} fine solves: must be {K_low:.6g}, "
        f"{K_high:.6g} N/mm within {TOLERANCE:g}; start from other lengths"
    )
    raise SolveError(msg)


def _miss(found: Pair, targets: Pair) -> float:
    return max(abs(K / target - 1.0) for K, target in zip(found, targets, strict=True))


@dataclass
class _Secant:
    """Steps of both leaf lengths at once; each length is nearly linear in K^(-1/3), as of a beam."""

    E: float
    targets: Pair
    known: dict[str, tuple[float, float]] = field(default_factory=dict)  # length, K^(-1/3)
    slopes: dict[str, float] = field(default_factory=dict)

    def step(self, housing: Housing, found: Pair) -> Housing:
        """Return the housing with the lengths at which both targets are expected, to 0.001 mm."""
        low = self._next("low", housing.low, found[0], self.targets[0])
        return dataclasses.replace(housing, low=low, high=self._next("high", housing.high, found[1], self.targets[1]))

    def _next(self, side: str, flexure: Flexure, K: float, target: float) -> Flexure:
        length, place = flexure.length, K ** (-1.0 / 3.0)
        beam = flexure.thickness * (2.0 * self.E * flexure.depth) ** (1.0 / 3.0)
        slope = self.slopes.get(side, beam)
        if side in self.known:
            before, there = self.known[side]
            # A shorter step would measure the meshes' scatter.
            if abs(length - before) > _LEAST_STEP * length and (place - there) * (length - before) > 0.0:
                slope = (length - before) / (place - there)
        self.slopes[side], self.known[side] = slope, (length, place)
        wanted = length + slope * (target ** (-1.0 / 3.0) - place)
        wanted = round(min(max(wanted, length / _LONGEST_STEP), length * _LONGEST_STEP), _DIGITS)
        if not wanted > 2.0 * flexure.fillet:
            bound = f"greater than 2 fillets = {2.0 * flexure.fillet:g} mm to reach {1e3 * target:.6g} N/m"
            name = f"flexures.{side}.length"
            raise fault(name, wanted, "mm", bound, "choose another process or other targets")
        return dataclasses.replace(flexure, length=wanted)
