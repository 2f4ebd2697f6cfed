"""Whether a process can make the two springs, and if not, the nearest target that it could make.

Closed form: the guided-beam law. The solve on the solid moves the leaf length by up to `LENGTH_MARGIN`, so a leaf
that near to a bound is undecided (passed is None) until its solved length is given.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from cad.design.parameters import Design
from cad.design.processes import Process
from cad.design.tip_mount import plate_depth
from cad.theory.leaf_spring import pair_length, root_strain
from cad.theory.strain_gauge import GAUGES, FoilGauge, gauged_length, sandwich_gain, shortest_gauged
from cad.theory.two_spring_law import Springs, size_springs

LENGTH_MARGIN = 0.15
STRAIN_FACTOR = 1.3  # fillet root over beam theory, measured 1.17 to 1.27 on solids
SHORTEST = 5.0  # leaf length over thickness: below it a leaf is a block, and its length no longer sets its stiffness
_CLAMPED = "the strip is clamped in a body of another material, whose give is not modelled; choose another process"


@dataclass(frozen=True, kw_only=True)
class Printable:
    """The verdict on one spring of one process; `reason` is one line, with the nearest target where it failed."""

    name: str  # "printable.low" or "printable.high"
    passed: bool | None
    reason: str
    stiffness_N_per_mm: float
    length_mm: float  # asked for, or solved
    shortest_mm: float
    longest_mm: float
    root_strain: float  # at full travel on the stiffest fruit
    strain_limit: float
    target: str  # the key that asks for this spring
    nearest: float | None  # the value of that key that could be made, unit of the key


@dataclass(frozen=True, kw_only=True)
class _Task:
    """What one spring shall do, and with which leaves."""

    side: str
    process: Process
    thickness: float
    depth: float
    travel: float
    K_m_max: float
    longest: float
    gauge: FoilGauge | None

    @property
    def shortest(self) -> float:
        """Return the least length of a leaf [mm]: that of a leaf at all, and of one with room for its gauges."""
        room = 0.0 if self.gauge is None else shortest_gauged(self.process.fillet_mm, self.gauge)
        return max(SHORTEST * self.thickness, room)

    def leaf_gain(self, length: float) -> float:
        """Return by how much gauges stiffen the leaf that carries them, and raise the moment at its roots [1]."""
        if self.gauge is None:
            return 1.0
        section, fillet = (self.depth, self.thickness), self.process.fillet_mm
        return 2.0 * sandwich_gain(self.process.E_MPa, section, length, fillet, self.gauge) - 1.0


@dataclass(frozen=True, kw_only=True)
class _Target:
    """The key that asks for a spring: its value, what else it could be, and the stiffness [N/mm] that follows."""

    key: str
    value: float
    unit: str
    others: Sequence[float]
    stiffness: Callable[[float], float]


def check_printable(
    design: Design,
    springs: Springs,
    K_m_max: float,
    process: Process,
    lengths_mm: tuple[float, float] | None = None,
    asymmetry: float = 1.0,
) -> tuple[Printable, Printable]:
    """Return the verdicts on the low and the high spring [N/mm] that K_m,max [N/mm] and the asymmetry have sized.

    Strain is that at the largest modulus shown, which may lie beyond E_max. Without `lengths_mm`, low then high as
    solved, the beam law gives the lengths and a leaf within LENGTH_MARGIN of a bound is undecided. The nearest target
    given is one whose verdict passes with that margin.
    """
    fruit = design.fruit
    stiffest = K_m_max * max(fruit.E_max_MPa, *fruit.E_MPa) / fruit.E_max_MPa
    thicknesses = (process.leaf_thickness_low_mm, process.leaf_thickness_high_mm)
    low, high = (
        _Task(
            side=side,
            process=process,
            thickness=thickness,
            depth=plate_depth(design, process),
            travel=max(0.0, travel),
            K_m_max=K_m,
            longest=design.print.max_length_mm,
            gauge=GAUGES[design.print.gauges],
        )
        for side, thickness, travel, K_m in zip(
            ("low", "high"), thicknesses, design.full_travels_mm, (stiffest, asymmetry * stiffest), strict=True
        )
    )
    solved = lengths_mm or (None, None)
    verdicts = (
        _verdict(low, _low_target(design, springs, (K_m_max, asymmetry)), springs.K_l, solved[0]),
        _verdict(high, _high_target(design, springs, (K_m_max, asymmetry)), springs.K_h, solved[1]),
    )
    if process.one_piece:
        return verdicts
    return replace(verdicts[0], passed=False, reason=_CLAMPED), replace(verdicts[1], passed=False, reason=_CLAMPED)


def _low_target(design: Design, springs: Springs, met: tuple[float, float]) -> _Target:
    if design.springs.given:
        return _given_target("springs.K_l_N_per_m", springs.K_l)
    targets, (K_m_max, asymmetry) = design.targets, met
    every = [*(i / 100 for i in range(101, 1000)), *(i / 10 for i in range(100, 1001))]
    others = [P_max for P_max in every if P_max > asymmetry]

    def stiffness(P_max: float) -> float:
        return size_springs(P_max, targets.NL, K_m_max, targets.NL_definition, asymmetry).K_l

    return _Target(key="targets.P_max", value=targets.P_max, unit="1", others=others, stiffness=stiffness)


def _high_target(design: Design, springs: Springs, met: tuple[float, float]) -> _Target:
    if design.springs.given:
        return _given_target("springs.K_h_N_per_m", springs.K_h)
    targets, (K_m_max, asymmetry) = design.targets, met
    others = [*(i / 10000 for i in range(1, 100)), *(i / 1000 for i in range(10, 500))]

    def stiffness(NL: float) -> float:
        return size_springs(targets.P_max, NL, K_m_max, targets.NL_definition, asymmetry).K_h

    return _Target(key="targets.NL", value=targets.NL, unit="1", others=others, stiffness=stiffness)


def _given_target(key: str, K: float) -> _Target:
    others = [float(f"{1e3 * K * 10.0 ** (i / 200):.3g}") for i in range(-800, 801)]
    return _Target(key=key, value=1e3 * K, unit="N/m", others=others, stiffness=lambda value: 1e-3 * value)


def _strain(task: _Task, K: float, length: float) -> float:
    deflection = task.travel * task.K_m_max / (task.K_m_max + K)
    return STRAIN_FACTOR * task.leaf_gain(length) * root_strain(task.thickness, length, deflection)


def _faults(task: _Task, K: float, length: float, margin: float) -> list[str]:
    """Return what stands against a leaf of this length, when the length may yet be wrong by the relative margin."""
    process, t = task.process, task.thickness
    strain = _strain(task, K, length / (1.0 + margin))
    found = []
    if t < process.min_wall_mm:
        found.append(f"a leaf {t:g} mm thick, must be at least the wall of {process.min_wall_mm:g} mm")
    if length < task.shortest * (1.0 + margin):
        why = f"{SHORTEST:g} thicknesses" if task.shortest <= SHORTEST * t else "room for a gauge at each root"
        found.append(f"a leaf {length:.1f} mm long, must be at least {why} = {task.shortest:g} mm")
    if task.gauge is not None and task.depth < task.gauge.backing_width_mm:
        wide = task.gauge.backing_width_mm
        found.append(f"a leaf {task.depth:g} mm deep, must be at least the gauge of {wide:g} mm")
    if length * (1.0 + margin) > task.longest:
        found.append(f"a leaf {length:.1f} mm long, must be at most print.max_length_mm = {task.longest:g} mm")
    if strain > process.strain_limit:
        found.append(f"a root strain of {strain:.2g}, must be at most {process.strain_limit:g} of {process.material}")
    return found


def _beam_length(task: _Task, K: float) -> float:
    E, section = task.process.E_MPa, (task.depth, task.thickness)
    if task.gauge is None:
        return pair_length(E, *section, K)
    return gauged_length(E, section, task.process.fillet_mm, K, task.gauge)


def _nearest(task: _Task, target: _Target) -> float | None:
    """Return the value nearest in ratio to the target's whose spring passes with the margin, if there is one."""
    made = []
    for value in target.others:
        K = target.stiffness(value)
        if not _faults(task, K, _beam_length(task, K), LENGTH_MARGIN):
            made.append(value)
    return min(made, key=lambda value: abs(math.log(value / target.value)), default=None)


def _verdict(task: _Task, target: _Target, K: float, solved: float | None) -> Printable:
    length = _beam_length(task, K) if solved is None else solved
    margin = LENGTH_MARGIN if solved is None else 0.0
    sure = _faults(task, K, length, -margin / (1.0 + margin))
    doubts = _faults(task, K, length, margin)
    nearest = _nearest(task, target) if doubts else None
    return Printable(
        name=f"printable.{task.side}",
        passed=False if sure else None if doubts else True,
        reason=_reason(task, target, (sure or doubts), nearest, undecided=bool(doubts) and not sure),
        stiffness_N_per_mm=K,
        length_mm=length,
        shortest_mm=task.shortest,
        longest_mm=task.longest,
        root_strain=_strain(task, K, length),
        strain_limit=task.process.strain_limit,
        target=target.key,
        nearest=nearest,
    )


def _reason(task: _Task, target: _Target, faults: list[str], nearest: float | None, *, undecided: bool) -> str:
    name = task.process.name
    if not faults:
        return f"{name} can make the {task.side} leaf"
    unit = "" if target.unit == "1" else f" {target.unit}"
    asks = f"{target.key} = {target.value:g}{unit}: asks {name} for {' and '.join(faults)}"
    if undecided:
        asks += f", near enough ({LENGTH_MARGIN:.0%} of length) that only the solved length decides"
    short = target.key.partition(".")[2]
    if nearest is None:
        return f"{asks}; no {short} helps, choose another process"
    return f"{asks}; the nearest {short} that it can make is {nearest:g}{unit}, or choose another process"
