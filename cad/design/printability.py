"""Whether a process can make the two springs, and if not, the nearest target that it could make.

Closed form: the guided-beam law. The solve on the solid moves the leaf length by up to `LENGTH_MARGIN`, so a leaf
that near to a bound is undecided (passed is None) until its solved length is given.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from cad.design.parameters import Design
from cad.design.processes import Process
from cad.design.tip_mount import plate_depth
from cad.theory.leaf_spring import pair_length, root_strain
from cad.theory.strain_gauge import GAUGES, FoilGauge, gauged_length, sandwich_gain, shortest_gauged
from cad.theory.two_spring_law import Springs, size_springs

LENGTH_MARGIN = 0.15
STRAIN_FACTOR = 1.3  # fillet root over beam theory, 1.17 to 1.27 by FE of solid flexures
SHORTEST = 5.0  # leaf length over thickness: below it a leaf is a block, and its length no longer sets its stiffness
# Fractions of the bending that shear of a rectangle (nu = 0.4) and yielding roots add to a leaf of SHORTEST
# thicknesses; the roots are those of W. J. O'Donnell 1960, a half-plane turned by 16.67 M / (pi E w t^2), without
# their fillets.
_SHEAR = 2.4 * (1.0 + 0.4) / SHORTEST**2
_ROOTS = 0.5 * 16.67 / math.pi / SHORTEST
NEAREST_MARGIN = math.cbrt(1.0 + _SHEAR + _ROOTS) - 1.0  # of length; what is offered can be made wherever it is solved
# Round values that are offered in place of a target that cannot be made.
_P_MAX_VALUES = (*(i / 100 for i in range(101, 1000)), *(i / 10 for i in range(100, 1001)))
_NL_VALUES = (*(i / 10000 for i in range(1, 100)), *(i / 1000 for i in range(10, 500)))
_FACTORS = tuple(10.0 ** (i / 200) for i in range(-800, 801))


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
class _Leaf:
    """The leaves of one spring in a process [mm], and the travel and the fruit stiffness [N/mm] that bend them."""

    spring: str
    process: Process
    thickness: float
    depth: float
    travel: float
    K_m: float
    longest: float
    gauge: FoilGauge | None

    @property
    def shortest(self) -> float:
        """Return the least length of a leaf [mm]: that of a leaf at all, and of one with room for its gauges."""
        room = 0.0 if self.gauge is None else shortest_gauged(self.process.fillet_mm, self.gauge)
        return max(SHORTEST * self.thickness, room)

    @property
    def least_depth(self) -> float:
        """Return the depth that a gauge on the leaf needs [mm]; 0 without gauges."""
        return 0.0 if self.gauge is None else self.gauge.backing_width_mm

    def length(self, K: float) -> float:
        """Return the length [mm] at which the pair has a stiffness [N/mm] by the beam law."""
        E = self.process.E_MPa
        if self.gauge is None:
            return pair_length(E, self.depth, self.thickness, K)
        return gauged_length(E, self.depth, self.thickness, self.process.fillet_mm, K, self.gauge)

    def strain(self, K: float, length: float) -> float:
        """Return the root strain [1] at full travel; gauges stiffen the leaf that carries them and strain its root."""
        deflection = self.travel * self.K_m / (self.K_m + K)
        gain = 1.0
        if self.gauge is not None:
            E = self.process.E_MPa
            fillet = self.process.fillet_mm
            gain = 2.0 * sandwich_gain(E, self.depth, self.thickness, length, fillet, self.gauge) - 1.0
        return STRAIN_FACTOR * gain * root_strain(self.thickness, length, deflection)

    def faults(self, K: float, length: float, margin: float) -> list[str]:
        """Return what stands against a length [mm] that may yet be off by the relative margin."""
        process = self.process
        strain = self.strain(K, length / (1.0 + margin))
        faults = []
        if self.thickness < process.min_wall_mm:
            faults.append(
                f"a leaf {self.thickness:g} mm thick, must be at least the wall of {process.min_wall_mm:g} mm"
            )
        if length < self.shortest * (1.0 + margin):
            is_block = self.shortest <= SHORTEST * self.thickness
            reason = f"{SHORTEST:g} thicknesses" if is_block else "room for a gauge at each root"
            faults.append(f"a leaf {length:.1f} mm long, must be at least {reason} = {self.shortest:g} mm")
        if self.depth < self.least_depth:
            faults.append(f"a leaf {self.depth:g} mm deep, must be at least the gauge of {self.least_depth:g} mm")
        if length * (1.0 + margin) > self.longest:
            bound = f"print.max_length_mm = {self.longest:g} mm"
            faults.append(f"a leaf {length:.1f} mm long, must be at most {bound}")
        if strain > process.strain_limit:
            bound = f"{process.strain_limit:g} of {process.material}"
            faults.append(f"a root strain of {strain:.2g}, must be at most {bound}")
        return faults


@dataclass(frozen=True, kw_only=True)
class _Target:
    """The key that asks for a spring: its value, what else it could be, and the stiffness [N/mm] that follows."""

    key: str
    value: float
    others: tuple[float, ...]
    stiffness: Callable[[float], float]
    unit: str = ""  # as it stands behind a number

    def nearest(self, leaf: _Leaf) -> float | None:
        """Return the value nearest in ratio whose spring passes with NEAREST_MARGIN, if there is one."""
        for value in sorted(self.others, key=lambda value: abs(math.log(value / self.value))):
            K = self.stiffness(value)
            if not leaf.faults(K, leaf.length(K), NEAREST_MARGIN):
                return value
        return None


def check_printable(
    design: Design,
    springs: Springs,
    K_m_max: float,
    process: Process,
    lengths_mm: tuple[float, ...] | None = None,
    stiffness_ratio: float = 1.0,
) -> tuple[Printable, ...]:
    """Return the verdict on each spring [N/mm], low then high, that K_m,max [N/mm] and the stiffness ratio have sized.

    Strain is that at the largest modulus shown, which may lie beyond E_max. Without `lengths_mm`, as solved, the beam
    law gives the lengths and a leaf within LENGTH_MARGIN of a bound is undecided. The nearest target that is named
    passes with NEAREST_MARGIN.
    """
    fruit = design.fruit
    stiffest = K_m_max * max(fruit.E_max_MPa, *fruit.E_MPa) / fruit.E_max_MPa
    depth = plate_depth(design, process)
    K_m = (stiffest, stiffness_ratio * stiffest)
    targets = _targets(design, springs, K_m_max, stiffness_ratio)
    verdicts = []
    for i, (spring, K) in enumerate((("low", springs.K_l), ("high", springs.K_h))):
        leaf = _Leaf(
            spring=spring,
            process=process,
            thickness=process.leaf_thicknesses_mm[i],
            depth=depth,
            travel=max(0.0, design.full_travels_mm[i]),
            K_m=K_m[i],
            longest=design.print.max_length_mm,
            gauge=GAUGES[design.print.gauges],
        )
        verdicts.append(_verdict(leaf, targets[i], K, None if lengths_mm is None else lengths_mm[i]))
    return tuple(verdicts)


def _targets(design: Design, springs: Springs, K_m_max: float, stiffness_ratio: float) -> tuple[_Target, _Target]:
    """Return what asks for the low and for the high spring: given stiffnesses, or P_max and NL."""
    if design.springs.given:
        low = _given_stiffness("springs.K_l_N_per_m", springs.K_l)
        high = _given_stiffness("springs.K_h_N_per_m", springs.K_h)
        return low, high
    targets = design.nominal_targets
    definition = targets.NL_definition

    def low_spring(P_max: float) -> float:
        return size_springs(P_max, targets.NL, K_m_max, definition, stiffness_ratio).K_l

    def high_spring(NL: float) -> float:
        return size_springs(targets.P_max, NL, K_m_max, definition, stiffness_ratio).K_h

    # Under a skin other targets ask for other springs than this law says: none is named.
    bare = design.fruit.skin_mm is None
    ratios = tuple(ratio for ratio in _P_MAX_VALUES if bare and ratio > stiffness_ratio)
    return (
        _Target(key="targets.P_max", value=targets.P_max, others=ratios, stiffness=low_spring),
        _Target(key="targets.NL", value=targets.NL, others=_NL_VALUES if bare else (), stiffness=high_spring),
    )


def _given_stiffness(key: str, K: float) -> _Target:
    """Return the key that gives a stiffness [N/mm] in N/m, and stiffnesses of three digits around it."""
    others = tuple(float(f"{1e3 * K * factor:.3g}") for factor in _FACTORS)
    return _Target(key=key, value=1e3 * K, unit=" N/m", others=others, stiffness=lambda N_per_m: 1e-3 * N_per_m)


def _verdict(leaf: _Leaf, target: _Target, K: float, solved: float | None) -> Printable:
    length = leaf.length(K) if solved is None else solved
    margin = LENGTH_MARGIN if solved is None else 0.0
    certain = leaf.faults(K, length, -margin / (1.0 + margin))
    possible = leaf.faults(K, length, margin)
    nearest = target.nearest(leaf) if possible else None
    return Printable(
        name=f"printable.{leaf.spring}",
        passed=False if certain else None if possible else True,
        reason=_reason(leaf, target, certain or possible, nearest, undecided=bool(possible) and not certain),
        stiffness_N_per_mm=K,
        length_mm=length,
        shortest_mm=leaf.shortest,
        longest_mm=leaf.longest,
        root_strain=leaf.strain(K, length),
        strain_limit=leaf.process.strain_limit,
        target=target.key,
        nearest=nearest,
    )


def _reason(leaf: _Leaf, target: _Target, faults: list[str], nearest: float | None, *, undecided: bool) -> str:
    name = leaf.process.name
    unit = target.unit
    if not faults:
        return f"{name} can make the {leaf.spring} leaf"
    asks = f"{target.key} = {target.value:g}{unit}: asks {name} for {' and '.join(faults)}"
    if undecided:
        asks += f", near enough ({LENGTH_MARGIN:.0%} of length) that only the solved length decides"
    short = target.key.partition(".")[2]
    if nearest is None:
        return f"{asks}; no {short} helps, choose another process"
    return f"{asks}; the nearest {short} that it can make is {nearest:g}{unit}, or choose another process"
