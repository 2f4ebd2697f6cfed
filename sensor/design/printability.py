"""Whether a print process can make the two springs, by the law of a guided beam.

The leaf length that finite elements give for the solid differs from beam theory by up to `LENGTH_MARGIN`. So a leaf
whose length is this close to a bound is undecided (`passed` is None) until its solved length is given.
"""

from dataclasses import dataclass

from sensor.design.parameters import Design
from sensor.design.processes import Process
from sensor.design.tip_mount import plate_depth
from sensor.theory.leaf_spring import LeafProfile, pair_length, root_strain
from sensor.theory.two_spring_law import Springs, spring_deflection

LENGTH_MARGIN = 0.15  # largest relative error of a leaf length by beam theory
SHORTEST_LEAF = 5.0
"""Minimum length of a leaf divided by its thickness. The stiffness of a shorter leaf depends little on its length."""
FILLET_STRAIN = 1.3
"""Strain at the fillet divided by the strain of beam theory. Finite elements give 1.17 to 1.27."""


@dataclass(frozen=True, kw_only=True)
class Printable:
    """The verdict on whether a process can make a spring. `reason` is a single line."""

    name: str  # "printable.low" or "printable.high"
    passed: bool | None
    reason: str
    length_mm: float  # the solved length, or the length by beam theory if no length is solved
    shortest_mm: float
    longest_mm: float
    root_strain: float  # root strain at full travel on the stiffest fruit [1]
    strain_limit: float


@dataclass(frozen=True, kw_only=True)
class _Leaf:
    """The leaves of one spring: profile, deflection at full travel, and maximum length `longest` [mm]."""

    process: Process
    profile: LeafProfile
    deflection: float
    longest: float

    @property
    def shortest(self) -> float:
        """Return the minimum length of a leaf [mm]."""
        return SHORTEST_LEAF * self.profile.thickness

    def length(self, K: float) -> float:
        """Return the length [mm] at which the pair of leaves has the stiffness `K` [N/mm] according to beam theory."""
        return pair_length(self.process.E_MPa, self.profile.depth, self.profile.thickness, K)

    def strain(self, length: float) -> float:
        """Return the root strain [1] of leaves of this length [mm] at full travel."""
        return FILLET_STRAIN * root_strain(self.profile.thickness, length, self.deflection)

    def violations(self, length: float, margin: float) -> list[str]:
        """Return a text for each limit that leaves of this `length` [mm] violate.

        The limits that depend on the length are tightened by the factor 1 + `margin` [1], or relaxed if the margin is
        negative. If a leaf violates even the relaxed limits, the violation is certain, although the true length may
        differ by this factor.
        """
        process = self.process
        thickness = self.profile.thickness
        strain = self.strain(length / (1.0 + margin))  # a shorter leaf has a larger strain
        violations = []
        min_wall = process.min_wall_mm
        if thickness < min_wall:
            violations.append(f"a leaf {thickness:g} mm thick, must be at least the wall of {min_wall:g} mm")
        if length < self.shortest * (1.0 + margin):
            bound = f"{SHORTEST_LEAF:g} thicknesses = {self.shortest:g} mm"
            violations.append(f"a leaf {length:.1f} mm long, must be at least {bound}")
        if length * (1.0 + margin) > self.longest:
            bound = f"print.max_length_mm = {self.longest:g} mm"
            violations.append(f"a leaf {length:.1f} mm long, must be at most {bound}")
        if strain > process.strain_limit:
            bound = f"{process.strain_limit:g} of {process.material}"
            violations.append(f"a root strain of {strain:.2g}, must be at most {bound}")
        return violations


def check_printable(
    design: Design,
    springs: Springs,
    K_m_max: float,
    lengths_mm: tuple[float, ...] | None = None,
    stiffness_ratio: float = 1.0,
) -> tuple[Printable, ...]:
    """Return whether the process of a design can make each spring, the low spring first.

    `K_m_max` [N/mm] is the stiffness of the fruit under the low tip at E_max. `stiffness_ratio` [1] is the stiffness
    under the high tip divided by `K_m_max`. The strain is computed at the largest modulus of the design, which may be
    above E_max. `lengths_mm` are the solved lengths of the leaves, the low spring first. Without `lengths_mm`, the
    lengths follow from beam theory, and a leaf within LENGTH_MARGIN of a bound is undecided.
    """
    largest_K_m = K_m_max * design.fruit.largest_E_MPa / design.fruit.E_max_MPa
    K_m = (largest_K_m, stiffness_ratio * largest_K_m)  # under the low and the high tip
    margin = LENGTH_MARGIN if lengths_mm is None else 0.0  # relative error of a length
    determining_keys = _determining_keys(design, springs)
    verdicts = []
    for i, (name, K) in enumerate(zip(("low", "high"), springs.stiffnesses, strict=True)):
        # A tip that does not reach the fruit has a negative travel, and its spring is not deflected.
        travel = max(0.0, design.full_travels_mm[i])
        leaf = _leaf_of(design, i, spring_deflection(K, K_m[i], travel))
        length = leaf.length(K) if lengths_mm is None else lengths_mm[i]
        verdicts.append(_printable(name, leaf, length, margin, determining_keys[i]))
    return tuple(verdicts)


def _printable(name: str, leaf: _Leaf, length: float, margin: float, determining_key: str) -> Printable:
    """Return the verdict on the leaves of the spring `name`, "low" or "high", with this `length` [mm].

    The true length differs from `length` by at most the factor 1 + `margin` [1]. `determining_key` is the key that
    determines the stiffness of the spring, with its value. The reason of a verdict that does not pass begins with it.
    """
    process = leaf.process
    passed, reason = _judge_leaf(leaf, length, margin)
    if passed is not True:
        hint = "choose another process, or see what pipeline suggest finds"
        reason = f"{determining_key}: asks {process.name} for {reason}; {hint}"
    return Printable(
        name=f"printable.{name}",
        passed=passed,
        reason=reason or f"{process.name} can make the {name} leaf",
        length_mm=length,
        shortest_mm=leaf.shortest,
        longest_mm=leaf.longest,
        root_strain=leaf.strain(length),
        strain_limit=process.strain_limit,
    )


def _leaf_of(design: Design, index: int, deflection: float) -> _Leaf:
    """Return the leaves of the low (index 0) or the high (index 1) spring with this deflection [mm]."""
    process = design.process
    profile = LeafProfile(
        depth=plate_depth(design, process),
        thickness=process.leaf_thicknesses_mm[index],
        fillet=process.fillet_mm,
    )
    return _Leaf(process=process, profile=profile, deflection=deflection, longest=design.print.max_length_mm)


def _determining_keys(design: Design, springs: Springs) -> tuple[str, str]:
    """Return the key of [springs] or [targets] that determines each spring, with its value; the low spring first."""
    if design.springs.given:
        return f"springs.K_l_N_per_m = {1e3 * springs.K_l:g} N/m", f"springs.K_h_N_per_m = {1e3 * springs.K_h:g} N/m"
    targets = design.nominal_targets
    return f"targets.P_max = {targets.P_max:g}", f"targets.NL = {targets.NL:g}"


def _judge_leaf(leaf: _Leaf, length: float, margin: float) -> tuple[bool | None, str]:
    """Return whether leaves of this `length` [mm] can be made, and the limits that they violate as text.

    The true length differs from `length` by at most the factor 1 + `margin` [1]. If this difference could change the
    answer, the answer is None. The text is empty if no limit is violated.
    """
    # A violation is certain if it remains after the limits are relaxed by the factor 1 / (1 + margin). `violations`
    # tightens the limits by the factor 1 plus its argument, which is therefore 1 / (1 + margin) - 1 here.
    certain_violations = leaf.violations(length, -margin / (1.0 + margin))
    possible_violations = leaf.violations(length, margin)
    if not possible_violations:
        return True, ""
    if certain_violations:
        return False, " and ".join(certain_violations)
    undecided = f", near enough ({margin:.0%} of length) that only the solved length decides"
    return None, f"{' and '.join(possible_violations)}{undecided}"
