"""From the targets and the fruit's compliance to the two spring stiffnesses, by the law that also judges them."""

from dataclasses import dataclass
from typing import Literal

from cad.design.parameters import Design
from cad.quantity import InputError, validation_error
from cad.theory.two_spring_law import (
    CURVE_STEPS,
    Springs,
    curve_nonlinearity,
    curve_shares,
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
    `K_m_at_largest_E` is that of the largest modulus shown, which may lie beyond E_max. `stiffening` is K_m over
    K_m,max [1] at `curve_shares` of E_max on a fruit with a skin; none where K_m goes with E.
    """

    springs: Springs
    K_m_over_E: float
    K_m_max: float
    K_m_max_contact: float
    K_m_at_largest_E: float
    stiffening: tuple[float, ...] = ()
    stiffness_ratio: float
    sizing_stiffness_ratio: float
    basis: Literal["contact", "hayes"]

    def deflections(self, travels: tuple[float, ...]) -> tuple[float, ...]:
        """Return how far each spring gives on the stiffest fruit [mm] at the full travel [mm] of its tip."""
        travel_l, travel_h = travels
        K_m = self.K_m_at_largest_E
        return (
            spring_give(self.springs.K_l, K_m, max(0.0, travel_l)),
            spring_give(self.springs.K_h, self.stiffness_ratio * K_m, max(0.0, travel_h)),
        )


def spring_sizing(design: Design, contact: FruitCompliance, options: RunOptions) -> SpringSizing:
    """Return the springs [N/mm] that meet the targets, or those that the design gives, with the fruit stiffness used.

    The basis "contact" takes K_m = E / (s11 - s12); "hayes" the paper's circular tip, whose radius is half the side.
    More tips than two are sized as the pair that stands for them. At large strain the true contact sizes at full
    travel. Raises InputError where no springs meet the targets.
    """
    fruit = design.fruit
    pair = contact.per_spring(*design.tips.spring_groups)
    stiffest = pair.at(fruit.E_max_MPa)
    by_hayes = options.fruit_stiffness == "hayes"
    if by_hayes:
        K_m_over_E = hayes_stiffness(1.0, fruit.poisson, 0.5 * design.tips.side_mm)
        ratio = 1.0
    else:
        K_m_over_E = stiffest.K_m_over_E()
        ratio = stiffest.stiffness_ratio()
    K_m_max = fruit.E_max_MPa * K_m_over_E
    stiffening = fruit_stiffening(fruit.E_max_MPa, pair)
    springs = _springs(design, K_m_max, ratio, () if by_hayes else stiffening)
    if design.press.strain == "large" and not design.springs.given:
        if by_hayes:
            raise validation_error(
                "--fruit-stiffness", "hayes", "", "contact at large strain", "leave it out, or give springs"
            )
        springs = _at_large_strain(design, contact, K_m_max, ratio, springs)
    return SpringSizing(
        springs=springs,
        K_m_over_E=K_m_over_E,
        K_m_max=K_m_max,
        K_m_max_contact=fruit.E_max_MPa * stiffest.K_m_over_E(),
        K_m_at_largest_E=design.largest_E_MPa * pair.at(design.largest_E_MPa).K_m_over_E(),
        stiffening=stiffening,
        stiffness_ratio=stiffest.stiffness_ratio(),
        sizing_stiffness_ratio=ratio,
        basis=options.fruit_stiffness,
    )


def fruit_stiffening(E_max: float, pair: FruitCompliance) -> tuple[float, ...]:
    """Return K_m over that at E_max [MPa] at `curve_shares` of it [1]; none without a skin, where K_m goes with E."""
    if pair.skin is None:
        return ()
    top = pair.at(E_max).K_m_over_E()
    return tuple(share * pair.at(share * E_max).K_m_over_E() / top for share in curve_shares(CURVE_STEPS))


def _springs(design: Design, K_m_max: float, ratio: float, stiffening: tuple[float, ...]) -> Springs:
    given = design.springs
    targets = design.nominal_targets
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
    try:
        return size_springs(targets.P_max, targets.NL, K_m_max, targets.NL_definition, ratio, stiffening)
    except ValueError as refused:
        msg = f"targets.{refused}"
        raise InputError(msg, field="targets.NL", value=targets.NL) from refused


def _at_large_strain(
    design: Design, contact: FruitCompliance, K_m_max: float, ratio: float, springs: Springs
) -> Springs:
    """Return springs whose response has the targets at full travel; raises InputError where none are found.

    The linear law is asked for other targets, by as much as the response missed the wanted ones, until it has them.
    """
    scene = scene_of(design)
    moduli = curve_moduli(scene)
    targets = design.nominal_targets
    P_max_asked = targets.P_max
    NL_asked = targets.NL
    for _ in range(MOST_ROUNDS):
        C = spring_compliance(*design.tips.each(*springs.stiffnesses))
        P = pressed_at(scene, contact, C, moduli, 1).P[:, -1]
        P_factor = float(P[-1]) / targets.P_max
        NL_miss = curve_nonlinearity(P.tolist(), moduli.tolist(), targets.NL_definition) - targets.NL
        if max(abs(P_factor - 1.0), abs(NL_miss)) <= SETTLED:
            return springs
        P_max_asked /= P_factor
        NL_asked -= NL_miss
        try:
            springs = size_springs(P_max_asked, NL_asked, K_m_max, targets.NL_definition, ratio)
        except ValueError:
            break
    bound = "one that springs meet at large strain"
    remedy = "ask for another NL or press less deep, or take press.strain = 'linear'"
    raise validation_error("targets.NL", targets.NL, "1", bound, remedy)
