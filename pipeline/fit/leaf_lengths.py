"""Leaf lengths that give both target stiffnesses, and a housing judged, by finite elements on a ladder of meshes."""

import dataclasses
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from cad.parts.housing import Housing, housing_part
from cad.quantity import fault
from cad.theory.flexure import Flexure
from mesh.housing.sweep import FlexureMesh, check_flexure_mesh, flexure_mesh, stretched
from pipeline.fit.foils import bonded_foils
from solve.housing.stiffness import (
    ERROR_SHARE,
    HousingStiffness,
    Pair,
    TipCompliance,
    housing_stiffness,
    tip_compliance,
)
from solve.linear import SolveError

COARSE = 2.0  # scale of the mesh that steers the lengths
TOLERANCE = 1e-3  # of the stiffnesses, and of their targets on the mesh that is solved
MOST_FINE = 4
_LOOSEST = 5e-3  # of the targets: where the coarse mesh has done its work
_MOST_COARSE = 10
_DIGITS = 3  # lengths are drawn to 0.001 mm
_LONGEST_STEP = 1.6  # of a length, either way
_LEAST_STEP = 2e-3  # of a length, to learn the slope from


@dataclass(frozen=True, kw_only=True)
class Rung:
    """Scales of the mesh that is solved and of the one that judges it, and how its error bar is made of the two.

    The bar is a share of their difference and a floor, both relative; `reach` is the tolerance it is taken for.
    """

    fine: float
    coarse: float
    share: float
    floor: float
    reach: float

    def bars(self, housing: Housing, errors: Pair) -> Pair:
        """Return the error bars [%] of the low and the high stiffness from those of `housing_stiffness`.

        Those of a housing with gauges stand: the edges of the foils make most of them.
        """
        if housing.gauges != "none":
            return errors
        low, high = (
            _odd(flexure) * self.share / ERROR_SHARE * error + 100.0 * self.floor
            for flexure, error in zip((housing.low, housing.high), errors, strict=True)
        )
        return low, high


DEFAULT = Rung(fine=1.0, coarse=2.0, share=ERROR_SHARE, floor=1e-4, reach=1e-3)
# Seen of the difference: 0.27 on the first, against 112 thousand dofs and 30 random designs; 0.024 on the last, against
# one arm of five designs with 2.7 times the dofs, which is 0.026 against four times.
RUNGS = (
    Rung(fine=2.0, coarse=4.0, share=0.3, floor=2e-4, reach=1e-2),
    DEFAULT,
    Rung(fine=0.5, coarse=2.0, share=0.03, floor=1e-5, reach=0.0),
)


@dataclass(frozen=True, kw_only=True)
class FittedFlexures:
    """A housing with its stiffness; `solves` counts those on its mesh and all others, `seconds` are wall by stage."""

    housing: Housing
    stiffness: HousingStiffness
    solves: tuple[int, int]
    seconds: dict[str, float]


def judge_flexures(housing: Housing, E: float, poisson: float, tolerance: float = TOLERANCE) -> FittedFlexures:
    """Return the stiffness of a housing as it is [N/mm from MPa, mm], its bars within a tolerance where a mesh has it.

    Raises MeshError or SolveError.
    """
    bench = _Bench(E=E, poisson=poisson)
    return _cheapest(_rungs(housing, tolerance), tolerance, lambda rung: bench.judged(housing, rung))


def judge_on(rung: Rung, housing: Housing, E: float, poisson: float) -> FittedFlexures:
    """Return the stiffness of a housing [N/mm from MPa, mm] on one rung of the ladder; raises as `judge_flexures`."""
    return _Bench(E=E, poisson=poisson).judged(housing, rung)


def fit_flexures(
    housing: Housing, K_low: float, K_high: float, E: float, poisson: float, tolerance: float = TOLERANCE
) -> FittedFlexures:
    """Return the housing with both leaf lengths changed so that its stiffnesses are the targets within 0.1 %.

    A coarse mesh, stretched from step to step, finds the lengths; finer ones say by how much it lies high. The bars
    are within the tolerance where a mesh has it; a tolerance beyond 0.1 % holds for the targets too, up to 0.5 %.
    Raises InputError when a target leaves no leaf, SolveError when the targets are not met after 4 fine solves.
    """
    fit = _Fit(_Bench(E=E, poisson=poisson), housing, (K_low, K_high))
    met = min(max(tolerance, TOLERANCE), _LOOSEST)
    return _cheapest(_rungs(housing, tolerance), tolerance, lambda rung: fit.on(rung, met))


def _rungs(housing: Housing, tolerance: float) -> tuple[Rung, ...]:
    """Return the rungs to climb; with gauges the one whose pair of meshes their edges are extrapolated from."""
    return tuple(rung for rung in RUNGS if rung.reach <= tolerance) if housing.gauges == "none" else (DEFAULT,)


def _cheapest(rungs: Sequence[Rung], tolerance: float, work: Callable[[Rung], FittedFlexures]) -> FittedFlexures:
    """Return the result of the first rung whose bars meet the tolerance, else the last; its status says which."""
    for rung in rungs:
        found = work(rung)
        low, high = found.stiffness.error_percent
        if max(low, high) <= 100.0 * tolerance:
            break
    end = "meet" if max(low, high) <= 100.0 * tolerance else "are the least there is, but miss"
    words = f"{found.stiffness.status}: bars of {low:.2g} and {high:.2g} % {end} {100.0 * tolerance:g} %"
    return dataclasses.replace(found, stiffness=dataclasses.replace(found.stiffness, status=words))


@dataclass
class _Bench:
    """The solves of one fit, with what they cost."""

    E: float
    poisson: float
    counts: dict[float, int] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=lambda: {"mesh": 0.0, "solve": 0.0, "compare": 0.0})
    made: dict[float, tuple[Housing, FlexureMesh]] = field(default_factory=dict)
    known: dict[float, tuple[Housing, TipCompliance]] = field(default_factory=dict)

    def solved(self, housing: Housing, scale: float, *, steering: bool = False) -> TipCompliance:
        """Return the compliance on a mesh of this scale: where it only steers, one stretched from an earlier one."""
        if scale in self.known and self.known[scale][0] == housing:
            return self.known[scale][1]
        start = time.perf_counter()
        mesh = None
        if steering and scale in self.made:
            before, earlier = self.made[scale]
            mesh = stretched(earlier, before, housing)
        if mesh is None:
            mesh = flexure_mesh(housing, scale)
        self.made[scale] = housing, mesh
        meshed = time.perf_counter()
        found = tip_compliance(mesh, self.E, self.poisson, bonded_foils(housing))
        self.known[scale] = housing, found
        self.counts[scale] = self.counts.get(scale, 0) + 1
        self.seconds["mesh"] += meshed - start
        self.seconds["solve"] += time.perf_counter() - meshed
        return found

    def stiffness(self, housing: Housing, rung: Rung, coarse: TipCompliance | None = None) -> HousingStiffness:
        """Return the stiffness with its bars, the coarse mesh solved unless its result is given."""
        found = housing_stiffness(self.solved(housing, rung.fine), coarse or self.solved(housing, rung.coarse))
        status = f"mesh of scale {rung.fine:g} judged by scale {rung.coarse:g} ({found.status})"
        return dataclasses.replace(found, error_percent=rung.bars(housing, found.error_percent), status=status)

    def judged(self, housing: Housing, rung: Rung, coarse: TipCompliance | None = None) -> FittedFlexures:
        """Return the housing with its stiffness, the mesh compared with the solid."""
        found = self.stiffness(housing, rung, coarse)
        start = time.perf_counter()
        check_flexure_mesh(self.made[rung.fine][1], housing_part(housing))
        self.seconds["compare"] += time.perf_counter() - start
        here = self.counts[rung.fine]
        return FittedFlexures(
            housing=housing,
            stiffness=dataclasses.replace(found, seconds=sum(self.seconds.values())),
            solves=(here, sum(self.counts.values()) - here),
            seconds=dict(self.seconds),
        )


def _odd(flexure: Flexure) -> float:
    """Return by how much the difference of two meshes is a worse guide in a leaf of an odd shape.

    All meshes have like fans at the roots, whose error shows where a leaf is not much deeper than thick; and few
    layers for the bending across one that is deeper than long. Seen: 2 of the 2.5 for one as thick as deep or more.
    """
    shallow = min(1.0, flexure.thickness / flexure.depth)
    short = max(0.0, 1.0 - flexure.length / (0.8 * flexure.depth))
    return 1.0 + 1.5 * shallow + 2.0 * short


@dataclass
class _Curve:
    """Length and stiffness of one flexure on the coarse mesh: nearly a line in K^(-1/3), as of a beam."""

    name: str
    slope: float
    length: float = math.nan
    place: float = math.nan

    def learn(self, length: float, K: float) -> None:
        """Put the line through a new point, and where the last one is far enough, through both."""
        step, place = length - self.length, K ** (-1.0 / 3.0)
        # A shorter step would measure the meshes' scatter.
        if abs(step) > _LEAST_STEP * length and (place - self.place) * step > 0.0:
            self.slope = step / (place - self.place)
        self.length, self.place = length, place

    def stiffness(self, length: float) -> float:
        """Return the stiffness [N/mm] that the coarse mesh would find at a length [mm]."""
        return 1.0 / (self.place + (length - self.length) / self.slope) ** 3

    def fitted(self, flexure: Flexure, K: float) -> Flexure:
        """Return the flexure with the length at which the coarse mesh would find a stiffness, to 0.001 mm."""
        wanted = self.length + self.slope * (K ** (-1.0 / 3.0) - self.place)
        wanted = min(max(wanted, self.length / _LONGEST_STEP), self.length * _LONGEST_STEP)
        wanted = round(wanted, _DIGITS)
        if not wanted > 2.0 * flexure.fillet:
            bound = f"greater than 2 fillets = {2.0 * flexure.fillet:g} mm to reach {1e3 * K:.6g} N/m"
            name = f"flexures.{self.name}.length"
            raise fault(name, wanted, "mm", bound, "choose another process or other targets")
        return dataclasses.replace(flexure, length=wanted)


class _Fit:
    """Both leaf lengths at once: what the coarse mesh says of them, and by how much it lies above a finer one."""

    def __init__(self, bench: _Bench, housing: Housing, targets: Pair) -> None:
        """Start from the beam law."""
        self._bench, self._housing, self._targets = bench, housing, targets
        self._steered = False
        self._low, self._high = (
            _Curve(name, flexure.thickness * (2.0 * bench.E * flexure.depth) ** (1.0 / 3.0))
            for name, flexure in (("low", housing.low), ("high", housing.high))
        )

    def on(self, rung: Rung, met: float) -> FittedFlexures:
        """Return the housing that meets the targets within a share of them on the mesh of a rung."""
        aim = (
            self._targets if rung.fine == COARSE else self._lifted(_lift(self._housing.low), _lift(self._housing.high))
        )
        if not self._steered:
            self._steer(aim)
        for attempt in range(MOST_FINE):
            # The mesh that steers is already where it should be.
            if attempt or rung.fine != COARSE:
                self._move(aim)
            coarse = self._carried() if rung.coarse == COARSE else None
            found = self._bench.stiffness(self._housing, rung, coarse).K
            if _miss(found, self._targets) <= met:
                return self._bench.judged(self._housing, rung, coarse)
            low, high = self._coarse_K
            aim = self._lifted(low / found[0], high / found[1])
        msg = (
            f"flexures: K = {found[0]:.6g}, {found[1]:.6g} N/mm after {MOST_FINE} fine solves: must be "
            f"{self._targets[0]:.6g}, {self._targets[1]:.6g} N/mm within {met:g}; start from other lengths"
        )
        raise SolveError(msg)

    def _steer(self, aim: Pair) -> None:
        """Move the lengths until the coarse mesh is near its aim."""
        self._steered = True
        for _ in range(_MOST_COARSE):
            found = self._bench.solved(self._housing, COARSE, steering=True).K
            self._low.learn(self._housing.low.length, found[0])
            self._high.learn(self._housing.high.length, found[1])
            if _miss(found, aim) <= _LOOSEST:
                break
            self._move(aim)

    def _move(self, aim: Pair) -> None:
        low, high = self._low.fitted(self._housing.low, aim[0]), self._high.fitted(self._housing.high, aim[1])
        self._housing = dataclasses.replace(self._housing, low=low, high=high)

    def _lifted(self, low: float, high: float) -> Pair:
        return low * self._targets[0], high * self._targets[1]

    @property
    def _coarse_K(self) -> Pair:
        """What the coarse mesh would find here: its last step was so short that another solve tells nothing new."""
        return self._low.stiffness(self._housing.low.length), self._high.stiffness(self._housing.high.length)

    def _carried(self) -> TipCompliance | None:
        """Return the coarse mesh's last result, carried from the lengths it was solved at to these.

        None with gauges, whose strain needs its own.
        """
        last = self._bench.known[COARSE][1]
        if last.gauge_strain_per_N is not None:
            return None
        share = np.sqrt(np.array(last.K) / np.array(self._coarse_K))
        return dataclasses.replace(last, C=last.C * np.outer(share, share))


def _lift(flexure: Flexure) -> float:
    """Return the stiffness on the coarse mesh over that on a finer one, before it is known: within 5e-4 as a rule."""
    return 1.0 + 0.0035 / (1.0 + 0.55 * flexure.length / flexure.depth)


def _miss(found: Pair, targets: Pair) -> float:
    return max(abs(K / target - 1.0) for K, target in zip(found, targets, strict=True))
