"""Whether a print process can make the two springs, by the guided-beam law.

The solve on the solid changes the leaf length by up to `LENGTH_MARGIN`. So a leaf this close to a bound is undecided
(passed is None) until its solved length is given.
"""

from dataclasses import dataclass

from sensor.design.parameters import Design
from sensor.design.processes import Process
from sensor.design.tip_mount import plate_depth
from sensor.theory.leaf_spring import LeafProfile, pair_length, root_strain
from sensor.theory.two_spring_law import Springs, spring_give

LENGTH_MARGIN = 0.15
SHORTEST_LEAF = 5.0  # least length over thickness; the stiffness of a shorter leaf depends little on its length
FILLET_STRAIN = 1.3  # strain at the fillet over beam theory; FE of solid flexures gives 1.17 to 1.27


@dataclass(frozen=True, kw_only=True)
class Printable:
    """The verdict on one spring in one process; `reason` is one line."""

    name: str  # "printable.low" or "printable.high"
    passed: bool | None
    reason: str
    length_mm: float  # by the beam law, or as solved
    shortest_mm: float
    longest_mm: float
    root_strain: float  # at full travel on the stiffest fruit
    strain_limit: float


@dataclass(frozen=True, kw_only=True)
class _Leaf:
    """The leaves of one spring [mm], the longest allowed length, and their deflection at full travel."""

    process: Process
    profile: LeafProfile
    deflection: float
    longest: float

    @property
    def shortest(self) -> float:
        """Return the least length of a leaf [mm]."""
        return SHORTEST_LEAF * self.profile.thickness

    def length(self, K: float) -> float:
        """Return the length [mm] at which the pair has stiffness K [N/mm] by the beam law."""
        return pair_length(self.process.E_MPa, self.profile.depth, self.profile.thickness, K)

    def strain(self, length: float) -> float:
        """Return the root strain [1] at full travel."""
        return FILLET_STRAIN * root_strain(self.profile.thickness, length, self.deflection)

    def faults(self, length: float, margin: float) -> list[str]:
        """Return the objections to a length [mm] as texts, with limits stricter by the relative margin [1].

        With a negative margin the limits are laxer. Objections that remain then hold for all lengths within this error.
        """
        process = self.process
        thickness = self.profile.thickness
        strain = self.strain(length / (1.0 + margin))
        faults = []
        least = process.min_wall_mm
        if thickness < least:
            faults.append(f"a leaf {thickness:g} mm thick, must be at least the wall of {least:g} mm")
        if length < self.shortest * (1.0 + margin):
            reason = f"{SHORTEST_LEAF:g} thicknesses"
            faults.append(f"a leaf {length:.1f} mm long, must be at least {reason} = {self.shortest:g} mm")
        if length * (1.0 + margin) > self.longest:
            bound = f"print.max_length_mm = {self.longest:g} mm"
            faults.append(f"a leaf {length:.1f} mm long, must be at most {bound}")
        if strain > process.strain_limit:
            bound = f"{process.strain_limit:g} of {process.material}"
            faults.append(f"a root strain of {strain:.2g}, must be at most {bound}")
        return faults


def check_printable(
    design: Design,
    springs: Springs,
    K_m_max: float,
    lengths_mm: tuple[float, ...] | None = None,
    stiffness_ratio: float = 1.0,
) -> tuple[Printable, ...]:
    """Return the verdict on each spring, low then high, in the process of a design.

    `K_m_max` [N/mm] is the stiffness of the fruit under the low tip at E_max. `stiffness_ratio` [1] is the stiffness
    under the high tip over it. The strain is computed at the largest modulus shown, which may be above E_max. Without
    the solved `lengths_mm`, the beam law gives the lengths, and a leaf within LENGTH_MARGIN of a bound is undecided.
    """
    process = design.process
    stiffest = K_m_max * design.fruit.largest_E_MPa / design.fruit.E_max_MPa
    K_m = (stiffest, stiffness_ratio * stiffest)
    keys = _determining_keys(design, springs)
    verdicts = []
    for i, (name, K) in enumerate(zip(("low", "high"), springs.stiffnesses, strict=True)):
        leaf = _Leaf(
            process=process,
            profile=LeafProfile(
                depth=plate_depth(design, process),
                thickness=process.leaf_thicknesses_mm[i],
                fillet=process.fillet_mm,
            ),
            deflection=spring_give(K, K_m[i], max(0.0, design.full_travels_mm[i])),
            longest=design.print.max_length_mm,
        )
        length = leaf.length(K) if lengths_mm is None else lengths_mm[i]
        passed, reason = _judged(leaf, length, LENGTH_MARGIN if lengths_mm is None else 0.0)
        if passed is not True:
            hint = "choose another process, or see what pipeline suggest finds"
            reason = f"{keys[i]}: asks {process.name} for {reason}; {hint}"
        verdicts.append(
            Printable(
                name=f"printable.{name}",
                passed=passed,
                reason=reason or f"{process.name} can make the {name} leaf",
                length_mm=length,
                shortest_mm=leaf.shortest,
                longest_mm=leaf.longest,
                root_strain=leaf.strain(length),
                strain_limit=process.strain_limit,
            )
        )
    return tuple(verdicts)


def _determining_keys(design: Design, springs: Springs) -> tuple[str, str]:
    """Return the key of [springs] or [targets] that determines each spring, low then high, with its value."""
    if design.springs.given:
        return f"springs.K_l_N_per_m = {1e3 * springs.K_l:g} N/m", f"springs.K_h_N_per_m = {1e3 * springs.K_h:g} N/m"
    targets = design.nominal_targets
    return f"targets.P_max = {targets.P_max:g}", f"targets.NL = {targets.NL:g}"


def _judged(leaf: _Leaf, length: float, margin: float) -> tuple[bool | None, str]:
    """Return whether leaves of a length [mm] can be made, and the objections as text, which is empty if they can.

    The error of the length is at most the relative margin [1]. The first value is None if the margin decides.
    """
    # In the laxest case the true length differs by the factor 1 + margin, so the limits relax by 1 / (1 + margin).
    certain = leaf.faults(length, -margin / (1.0 + margin))
    possible = leaf.faults(length, margin)
    if not possible:
        return True, ""
    if certain:
        return False, " and ".join(certain)
    undecided = f", near enough ({LENGTH_MARGIN:.0%} of length) that only the solved length decides"
    return None, f"{' and '.join(possible)}{undecided}"
