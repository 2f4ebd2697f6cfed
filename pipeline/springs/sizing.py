"""Size the two springs from the targets and the fruit's compliance, by the law that is also used to check them."""

from dataclasses import dataclass
from typing import Literal

from pipeline.options import RunOptions
from sensor.design.parameters import Design, Targets
from sensor.quantity import InputError, validation_error
from sensor.theory.two_spring_law import (
    CURVE_STEPS,
    Springs,
    curve_shares,
    force_ratio,
    hayes_stiffness,
    size_springs,
    spring_deflection,
)
from solve.fruit.compliance import FruitCompliance

MIN_RISE = 1e-9  # smallest relative rise of P with the modulus; a smaller rise is lost in round-off


@dataclass(frozen=True, kw_only=True)
class SpringSizing:
    """The springs that a design requires, and the fruit stiffnesses used to size and check them [N/mm; K_m / E in mm].

    K_m is the stiffness of the fruit under one tip, the low tip unless stated otherwise. A stiffness ratio is the
    stiffness under the high tip divided by the stiffness under the low tip. The springs are sized from `K_m_max`, the
    value of K_m at E_max, and from `sizing_stiffness_ratio`. The springs are checked with `K_m_max_contact` and
    `stiffness_ratio` from the solved contact, whatever the `basis` of the sizing. `K_m_at_largest_E` is K_m at the
    largest modulus of the design, which may exceed E_max. `stiffening` is K_m / K_m,max [1] at the fractions
    `curve_shares` of E_max, on a fruit with a skin. `stiffening` is empty if K_m is proportional to E.
    """

    springs: Springs
    K_m_over_E: float
    K_m_max: float
    K_m_max_contact: float
    K_m_at_largest_E: float
    stiffening: tuple[float, ...]
    stiffness_ratio: float
    sizing_stiffness_ratio: float
    basis: Literal["contact", "hayes"]

    def deflections(self, travels: tuple[float, ...]) -> tuple[float, ...]:
        """Return the deflection [mm] of each spring, low then high, on the firmest fruit of the design.

        `travels` [mm] are the full travels of the low and the high tip. A negative travel means that the tip does not
        reach the fruit, so its spring is not deflected.
        """
        travel_l, travel_h = travels
        K_m = self.K_m_at_largest_E
        return (
            spring_deflection(self.springs.K_l, K_m, max(0.0, travel_l)),
            spring_deflection(self.springs.K_h, self.stiffness_ratio * K_m, max(0.0, travel_h)),
        )


def spring_sizing(design: Design, contact: FruitCompliance, options: RunOptions) -> SpringSizing:
    """Size the springs so that they meet the targets, or use the stiffnesses that the design gives [N/mm].

    The stiffnesses depend on K_m, the stiffness of the fruit under one tip. `options` select how K_m is computed, which
    is the `basis` of the sizing. With the basis "contact", K_m = E / (s11 - s12), where s11 and s12 [1/mm] are elements
    of the compliance matrix `contact`. A force F on one tip makes this tip sink by s11 F / E, and the other tip by s12
    F / E. With the basis "hayes", K_m follows from the paper's formula for a circular tip, whose radius is half the
    side of a tip.

    A layout of more than two tips is represented by a pair. Raises InputError if no springs meet the targets.
    """
    fruit = design.fruit
    pair = contact.as_pair(*design.tips.spring_groups)
    at_E_max = pair.at(fruit.E_max_MPa)
    is_hayes = options.fruit_stiffness == "hayes"
    if is_hayes:
        K_m_over_E = hayes_stiffness(1.0, fruit.poisson, 0.5 * design.tips.side_mm)
        sizing_ratio = 1.0  # the formula is for a half-space, which is equally stiff under both tips
    else:
        K_m_over_E = at_E_max.K_m_over_E()
        sizing_ratio = at_E_max.stiffness_ratio()
    K_m_max = fruit.E_max_MPa * K_m_over_E
    stiffening = fruit_stiffening(fruit.E_max_MPa, pair)
    sizing_stiffening = () if is_hayes else stiffening  # the formula has no skin, so K_m is proportional to E
    springs = _choose_springs(design, K_m_max, sizing_ratio, sizing_stiffening)
    return SpringSizing(
        springs=springs,
        K_m_over_E=K_m_over_E,
        K_m_max=K_m_max,
        K_m_max_contact=fruit.E_max_MPa * at_E_max.K_m_over_E(),
        K_m_at_largest_E=fruit.largest_E_MPa * pair.at(fruit.largest_E_MPa).K_m_over_E(),
        stiffening=stiffening,
        stiffness_ratio=at_E_max.stiffness_ratio(),
        sizing_stiffness_ratio=sizing_ratio,
        basis=options.fruit_stiffness,
    )


def fruit_stiffening(E_max: float, pair: FruitCompliance) -> tuple[float, ...]:
    """Return K_m divided by K_m at E_max [1], at the fractions `curve_shares` of `E_max` [MPa].

    `pair` is the compliance under a low and a high tip. Under a skin, K_m increases less than in proportion to E,
    because the stiffness of the skin itself is constant. Without a skin, K_m is proportional to E, and the result is
    empty.
    """
    if pair.skin is None:
        return ()
    K_m_over_E_max = pair.at(E_max).K_m_over_E()
    return tuple(
        fraction * pair.at(fraction * E_max).K_m_over_E() / K_m_over_E_max for fraction in curve_shares(CURVE_STEPS)
    )


def _choose_springs(design: Design, K_m_max: float, stiffness_ratio: float, stiffening: tuple[float, ...]) -> Springs:
    """Return the springs that the design gives, or else size springs for its targets.

    `K_m_max` [N/mm] is the stiffness of the firmest fruit under the low tip. `stiffness_ratio` [1] is its stiffness
    under the high tip divided by `K_m_max`. On a very soft fruit, the force ratio P equals this ratio. On firmer fruit
    it must be larger. `stiffening` is the result of `fruit_stiffening`. Raises InputError if P of the given springs
    does not rise noticeably with the modulus, or if no springs meet the targets.
    """
    given = design.springs
    if given.K_l_N_per_m is not None and given.K_h_N_per_m is not None:
        springs = Springs(K_l=1e-3 * given.K_l_N_per_m, K_h=1e-3 * given.K_h_N_per_m)
        if force_ratio(springs, K_m_max, stiffness_ratio) < (1.0 + MIN_RISE) * stiffness_ratio:
            bound = f"small enough that P rises by {MIN_RISE:g} with this springs.K_h_N_per_m on the stiffest fruit"
            hint = "choose a softer low spring"
            raise validation_error("springs.K_l_N_per_m", given.K_l_N_per_m, "N/m", bound, hint)
        return springs
    return _size_for_targets(design.nominal_targets, K_m_max, stiffness_ratio, stiffening)


def _size_for_targets(
    targets: Targets, K_m_max: float, stiffness_ratio: float, stiffening: tuple[float, ...]
) -> Springs:
    """Return the springs that meet the `targets`; raise InputError if no springs meet them.

    `K_m_max` [N/mm] is the stiffness of the firmest fruit under the low tip. `stiffness_ratio` [1] is its stiffness
    under the high tip divided by `K_m_max`. `stiffening` is the result of `fruit_stiffening`.
    """
    if targets.P_max <= stiffness_ratio:
        bound = (
            f"greater than {stiffness_ratio:.4g}, the ratio of the fruit's stiffness under the high tip to that under "
            "the low tip"
        )
        raise validation_error("targets.P_max", targets.P_max, "1", bound, "move the tips to the middle of the fruit")
    try:
        return size_springs(targets.P_max, targets.NL, K_m_max, targets.NL_definition, stiffness_ratio, stiffening)
    except ValueError as error:
        msg = f"targets.{error}"  # the message begins with the key of the target, NL or P_max
        raise InputError(msg, field="targets.NL", value=targets.NL) from error
