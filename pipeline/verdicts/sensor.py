"""Every verdict on a sensor that needs no file, and beside them those on the paper's own springs."""

from cad.design.parameters import PAPER_TARGETS, Design
from cad.quantity import Estimate
from cad.theory.rounded_edge import edge_loss
from cad.theory.two_spring_law import PAPER_SPRINGS, Springs, series_ratio, spring_give
from cad.verdict import Verdict
from pipeline.reading.analysis import Readings
from pipeline.response.scene_press import (
    TRAVELS,
    ScenePress,
    mean_pressure_estimate,
    press_scene,
    scene_of,
    spring_shares,
)
from pipeline.springs.fitted_springs import FittedSprings
from pipeline.springs.sizing import SpringSizing
from pipeline.verdicts.rules import (
    bruise_verdict,
    displacement_verdict,
    monotonic_verdict,
    printable_verdict,
    reading_verdicts,
    stiffness_verdict,
    target_verdicts,
    tip_shape_verdicts,
)
from pipeline.verdicts.targets import SceneTargets, characteristic, scene_targets
from solve.contact.linear_response import spring_compliance, travels
from solve.fruit.compliance import FruitCompliance

_STIFFNESS_NAMES = ("K_l", "K_h")


def reached_targets(
    design: Design, contact: FruitCompliance, sizing: SpringSizing, springs: FittedSprings, press: ScenePress | None
) -> SceneTargets:
    """Return P_max and NL of a sensor in its own scene; those of a level sensor where it was not pressed.

    More tips than two are evaluated by the pair that stands for them.
    """
    contact = contact.per_spring(*design.tips.spring_groups)
    springs = springs.per_spring
    pair = characteristic(contact, sizing, springs.stiffnesses, springs.errors)
    return scene_targets(pair, design.nominal_targets, contact, springs.C, press)


def sensor_verdicts(
    design: Design,
    contact: FruitCompliance,
    springs: FittedSprings,
    press: ScenePress | None,
    readings: Readings | None,
    reached: SceneTargets,
) -> tuple[Verdict, ...]:
    """Return the verdicts on readings or force ratio, springs and tips; without a press none that needs it.

    A design with a reading is evaluated by that, not by its force ratio.
    """
    contact = contact.per_spring(*design.tips.spring_groups)
    springs = springs.per_spring
    by_ratio = design.reading is None
    verdicts = list(reading_verdicts(design, readings))
    if by_ratio and design.targets is not None and (press is not None or scene_of(design).linear):
        manufactured = springs.ideal or springs.housing is not None
        what = _of_what(design, springs, press, reached)
        verdicts += target_verdicts(reached.P_max, reached.NL, design.targets, what, manufactured=manufactured)
    if not springs.ideal:
        for name, spring in zip(_STIFFNESS_NAMES, springs.springs, strict=True):
            verdicts.append(stiffness_verdict(name, spring, monolithic=springs.monolithic))
    if by_ratio and press is not None:
        verdicts.append(displacement_verdict(press.table, _drift(design, contact, springs)))
        verdicts.append(monotonic_verdict(press.scan))
    verdicts += [printable_verdict(spring) for spring in springs.springs]
    if press is not None:
        verdicts += tip_shape_verdicts(design, press)
        verdicts += bruise_verdicts(design, contact, springs, press)
    return tuple(verdicts)


def bruise_verdicts(
    design: Design, contact: FruitCompliance, springs: FittedSprings, press: ScenePress
) -> tuple[Verdict, ...]:
    """Return the verdict on the pressure under the tips, where the fruit has a limit and no reading is evaluated."""
    limits = design.fruit.bruise_limits_MPa
    if not limits or design.reading is not None:
        return ()
    return (bruise_verdict(tip_pressure(design, contact, springs, press), max(limits)),)


def tip_pressure(design: Design, contact: FruitCompliance, springs: FittedSprings, press: ScenePress) -> Estimate:
    """Return the largest mean pressure under a tip at the largest modulus and full travel, with its error [MPa]."""
    shares = spring_shares(contact, springs.C, float(press.at_largest_E.E[-1]))
    of_springs = 0.0
    for share, spring in zip(shares.tolist(), springs.springs, strict=True):
        of_springs = max(of_springs, share * spring.error / spring.stiffness)
    return mean_pressure_estimate(design, press, of_springs)


def _of_what(design: Design, springs: FittedSprings, press: ScenePress | None, reached: SceneTargets) -> str:
    """Return in words whose P_max and NL the verdicts are on."""
    if springs.ideal:
        return "of springs exactly as they were sized or given"
    if springs.housing is None:
        return "of the target stiffnesses, which were not made"
    return _of_scene(design, press, reached)


def _of_scene(design: Design, press: ScenePress | None, reached: SceneTargets) -> str:
    if press is None or press.level:
        return "of a level sensor on flat fruit"
    P_max, NL = reached.level
    large = design.press.strain == "large"
    what = "the same sensor at small strain" if large else "a level sensor on flat fruit"
    return f"at full travel in this scene; {what} has P_max {P_max.value:.4g}, NL {NL.value:.3g}"


def _drift(design: Design, contact: FruitCompliance, springs: FittedSprings) -> str:
    """Return in words how far an edge as round as the process makes it lets P drift over the travel."""
    if springs.housing is None or not design.tips.tip_shape.is_flat or design.press.strain == "large":
        return ""
    radius = springs.edge_radius(design.tips)
    drift = edge_drift(design, contact, springs.stiffnesses, radius)
    return f"; edges rounded by {radius:g} mm, as the process makes them, let P drift by {100.0 * drift:.2g} %"


def edge_drift(design: Design, contact: FruitCompliance, springs: Springs, radius: float) -> float:
    """Return (max P - min P) / mean P over the travel of tips with an edge radius [mm], the worst of all E [1].

    A rounded edge touches less far out at a small depth: it lowers the fruit's stiffness under each tip the more, the
    less deep the tip stands.
    """
    worst = 0.0
    for E in design.fruit.E_MPa:
        flesh = contact.at(E)
        fruit = (E * flesh.K_m_over_E(0), E * flesh.K_m_over_E(-1))  # under low and high tip [N/mm]
        ratios = []
        for travel in travels(design.press.travel_mm, TRAVELS).tolist():
            softer = []
            for K, K_m in zip(springs.stiffnesses, fruit, strict=True):
                depth = travel - spring_give(K, K_m, travel)
                loss = edge_loss(depth, design.tips.side_mm, radius)
                softer.append(K_m * (1.0 - loss))
            ratios.append(series_ratio(*springs.stiffnesses, *softer))
        mean = sum(ratios) / len(ratios)
        worst = max(worst, (max(ratios) - min(ratios)) / mean)
    return worst


def paper_verdicts(design: Design, contact: FruitCompliance, sizing: SpringSizing) -> tuple[Verdict, ...] | None:
    """Return the verdicts on the paper's own springs and targets under the contact of this design.

    None where fruit or tips are not the paper's.
    """
    if not design.has_paper_scene:
        return None
    springs: Springs = PAPER_SPRINGS
    C = spring_compliance(*springs.stiffnesses)
    press = press_scene(design, contact, C)
    reached = scene_targets(characteristic(contact, sizing, springs), PAPER_TARGETS, contact, C, press)
    return (
        *target_verdicts(reached.P_max, reached.NL, PAPER_TARGETS, _of_scene(design, press, reached)),
        displacement_verdict(press.table),
        monotonic_verdict(press.scan),
    )
