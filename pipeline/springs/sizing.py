"""From the targets and the fruit's compliance to the two spring stiffnesses, by the law that also judges them."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Literal

from cad.design.parameters import Design
from cad.quantity import validation_error
from cad.theory.two_spring_law import (
    Springs,
    curve_nonlinearity,
    force_ratio,
    hayes_stiffness,
    size_springs,
    spring_give,
)
from pipeline.options import RunOptions
from pipeline.response.scene_press import curve_moduli, pressed_at, scene_of
from solve.contact.linear_response import spring_compliance
from solve.fruit.compliance import FruitCompliance

MOST_ROUNDS = 20
SETTLED = 1e-7  # of P_max, and of NL
LEAST_RISE = 1e-9  # of P over the moduli, as a fraction of P: of a smaller one round-off leaves too few digits


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
    More tips than two are sized as the pair that stands for them. At large strain the true contact sizes at full
    travel. Raises InputError where no springs meet the targets.
    """
    fruit, tips, of_tips = design.fruit, design.tips, contact
    contact = contact.per_spring(*tips.spring_groups)
    by_hayes = options.fruit_stiffness == "hayes"
    K_m_over_E = hayes_stiffness(1.0, fruit.poisson, 0.5 * tips.side_mm) if by_hayes else contact.K_m_over_E()
    ratio = 1.0 if by_hayes else contact.stiffness_ratio()
    K_m_max = fruit.E_max_MPa * K_m_over_E
    springs = _springs(design, K_m_max, ratio)
    if design.press.strain == "large" and not design.springs.given:
        if by_hayes:
            raise validation_error(
                "--fruit-stiffness", "hayes", "", "contact at large strain", "leave it out, or give springs"
            )
        law = partial(size_springs, K_m_max=K_m_max, stiffness_ratio=ratio)
        springs = _at_large_strain(design, of_tips, law, springs)
    return SpringSizing(
        springs=springs,
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
        springs = Springs(K_l=1e-3 * given.K_l_N_per_m, K_h=1e-3 * given.K_h_N_per_m)
        if force_ratio(springs, K_m_max, ratio) < (1.0 + LEAST_RISE) * ratio:
            bound = f"so far under springs.K_h_N_per_m that P rises by {LEAST_RISE:g} on the stiffest fruit"
            hint = "take a softer low spring"
            raise validation_error("springs.K_l_N_per_m", given.K_l_N_per_m, "N/m", bound, hint)
        return springs
    if targets.P_max <= ratio:
        bound = f"greater than {ratio:.4g}, the ratio of the fruit under the two tips"
        raise validation_error("targets.P_max", targets.P_max, "1", bound, "bring the tips to the middle of the fruit")
    return size_springs(targets.P_max, targets.NL, K_m_max, targets.NL_definition, ratio)


def _at_large_strain(
    design: Design, contact: FruitCompliance, law: Callable[..., Springs], springs: Springs
) -> Springs:
    """Return springs whose response has the targets at full travel; raises InputError where none are found.

    The linear law is asked for other targets until the response has the wanted ones.
    """
    scene, targets = scene_of(design), design.nominal_targets
    moduli, sized = curve_moduli(scene), springs
    P_max, NL = targets.P_max, targets.NL
    for _ in range(MOST_ROUNDS):
        C = spring_compliance(*design.tips.each(*sized.stiffnesses))
        P = pressed_at(scene, contact, C, moduli, 1).P[:, -1]
        NL_found = curve_nonlinearity(P.tolist(), moduli.tolist(), targets.NL_definition)
        times, off = float(P[-1]) / targets.P_max, NL_found - targets.NL
        if max(abs(times - 1.0), abs(off)) <= SETTLED:
            return sized
        P_max, NL = P_max / times, NL - off
        try:
            sized = law(P_max, NL, definition=targets.NL_definition)
        except ValueError:
            break
    bound = "one that springs meet at large strain"
    remedy = "ask for another NL or press less deep, or take press.strain = 'linear'"
    raise validation_error("targets.NL", targets.NL, "1", bound, remedy)
