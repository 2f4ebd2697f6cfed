"""From the targets and the fruit's compliance to the two spring stiffnesses, by the law that also judges them."""

from dataclasses import dataclass
from typing import Literal

from cad.design.parameters import Design
from cad.quantity import fault
from cad.theory.two_spring_law import Springs, hayes_stiffness, size_springs, spring_give
from pipeline.options import RunOptions
from solve.fruit.compliance import FruitCompliance


@dataclass(frozen=True, kw_only=True)
class SpringSizing:
    """The springs a design asks for and the fruit stiffness that sized them [N/mm; K_m / E in mm].

    `K_m_max` and `sizing_stiffness_ratio` sized the springs. `K_m_max_contact` and `stiffness_ratio`, of the high tip
    over the low one, are those of the true contact, which judges whatever the `basis` of the sizing.
    `K_m_at_largest_E` is that of the largest modulus shown, which may lie beyond E_max.
    """

    springs: Springs
    K_m_over_E: float
    K_m_max: float
    K_m_max_contact: float
    K_m_at_largest_E: float
    stiffness_ratio: float
    sizing_stiffness_ratio: float
    basis: Literal["contact", "hayes"]

    def deflections(self, travels: tuple[float, ...]) -> tuple[float, ...]:
        """Return how far each spring gives on the stiffest fruit [mm] at the full travel [mm] of its tip."""
        fruit = (self.K_m_at_largest_E, self.stiffness_ratio * self.K_m_at_largest_E)
        return tuple(
            spring_give(K, K_m, max(0.0, travel))
            for travel, K, K_m in zip(travels, self.springs.stiffnesses, fruit, strict=True)
        )


def spring_sizing(design: Design, contact: FruitCompliance, options: RunOptions) -> SpringSizing:
    """Return the springs [N/mm] that meet the targets, or those that the design gives, with the fruit stiffness used.

    The basis "contact" takes K_m = E / (s11 - s12); "hayes" the paper's circular tip, whose radius is half the side.
    More tips than two are sized as the pair that stands for them. Raises InputError where no springs meet the targets.
    """
    fruit, tips = design.fruit, design.tips
    contact = contact.of_kinds(*tips.kinds)
    by_hayes = options.fruit_stiffness == "hayes"
    K_m_over_E = hayes_stiffness(1.0, fruit.poisson, 0.5 * tips.side_mm) if by_hayes else contact.K_m_over_E()
    ratio = 1.0 if by_hayes else contact.stiffness_ratio()
    K_m_max = fruit.E_max_MPa * K_m_over_E
    return SpringSizing(
        springs=_springs(design, K_m_max, ratio),
        K_m_over_E=K_m_over_E,
        K_m_max=K_m_max,
        K_m_max_contact=fruit.E_max_MPa * contact.K_m_over_E(),
        K_m_at_largest_E=design.largest_E_MPa * contact.K_m_over_E(),
        stiffness_ratio=contact.stiffness_ratio(),
        sizing_stiffness_ratio=ratio,
        basis=options.fruit_stiffness,
    )


def _springs(design: Design, K_m_max: float, ratio: float) -> Springs:
    given, targets = design.springs, design.nominal_targets
    if given.K_l_N_per_m is not None and given.K_h_N_per_m is not None:
        return Springs(K_l=1e-3 * given.K_l_N_per_m, K_h=1e-3 * given.K_h_N_per_m)
    if targets.P_max <= ratio:
        bound = f"greater than {ratio:.4g}, the ratio of the fruit under the two tips"
        raise fault("targets.P_max", targets.P_max, "1", bound, "bring the tips to the middle of the fruit")
    return size_springs(targets.P_max, targets.NL, K_m_max, targets.NL_definition, ratio)
