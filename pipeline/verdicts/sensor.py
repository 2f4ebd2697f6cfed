"""Every verdict of a run: on the sensor as designed, and beside it on the paper's own springs."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from cad.design.parameters import PAPER_TARGETS, Design
from cad.quantity import Estimate
from cad.theory.two_spring_law import PAPER_SPRINGS
from cad.verdict import Verdict, failed
from pipeline.reading.readings import Readings
from pipeline.response.scene_press import ScenePress, mean_pressure_estimate, press_scene, spring_shares
from pipeline.springs.fitted_springs import FittedSprings
from pipeline.springs.sizing import SpringSizing
from pipeline.verdicts.characteristic import characteristic
from pipeline.verdicts.edge_drift import edge_drift
from pipeline.verdicts.reading_rules import reading_verdicts
from pipeline.verdicts.rules import (
    bruise_verdict,
    displacement_verdict,
    monotonic_verdict,
    printable_verdict,
    stiffness_verdict,
    target_verdicts,
)
from pipeline.verdicts.scene_targets import SceneTargets, scene_targets
from pipeline.verdicts.tip_shape import tip_shape_verdicts
from solve.contact.linear_response import spring_compliance
from solve.fruit.compliance import FruitCompliance

_NOT_MADE = failed("geometry.made", "a housing", unit="1", reference="no housing was made, see printable.low and .high")
_STIFFNESS_NAMES = ("K_l", "K_h")


def tip_pressure(design: Design, contact: FruitCompliance, springs: FittedSprings, press: ScenePress) -> Estimate:
    """Return the largest mean pressure under a tip at the largest modulus and full travel, with its error [MPa]."""
    shares = spring_shares(contact, springs.C, float(press.hardest.E[-1]))
    of_springs = max(
        share * spring.error / spring.stiffness for share, spring in zip(shares, springs.springs, strict=True)
    )
    return mean_pressure_estimate(design, press, of_springs)


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """The verdicts on a sensor, and the P_max and NL that its scene reaches.

    `paper` are the verdicts on the paper's own springs, None where fruit or tips are not the paper's.
    """

    verdicts: tuple[Verdict, ...]
    reached: SceneTargets
    paper: tuple[Verdict, ...] | None


def judge(
    design: Design,
    contact: FruitCompliance,
    sizing: SpringSizing,
    springs: FittedSprings,
    geometry: Sequence[Verdict],
    press: ScenePress,
) -> Judgement:
    """Return the judgement on a design in its own scene; raises InputError or SolveError where a press fails.

    More tips than two are judged by the pair that stands for them.
    """
    contact, springs = contact.of_kinds(*design.tips.kinds), springs.as_pair
    own = characteristic(contact, sizing, springs.stiffnesses, springs.errors)
    reached = scene_targets(own, design.nominal_targets, contact, springs.C, press)
    verdicts = (
        *_sensor_verdicts(design, contact, springs, press, reached),
        *(printable_verdict(spring) for spring in springs.springs),
        *(geometry or (_NOT_MADE,)),
        *tip_shape_verdicts(design, press),
        *bruise_verdicts(design, contact, springs, press),
    )
    return Judgement(
        verdicts=verdicts,
        reached=reached,
        paper=paper_verdicts(design, contact, sizing),
    )


def _sensor_verdicts(
    design: Design,
    contact: FruitCompliance,
    springs: FittedSprings,
    press: ScenePress,
    reached: SceneTargets,
) -> tuple[Verdict, ...]:
    """Return the verdicts on the force ratio and on the springs; P_max and NL are judged where there are targets.

    A design with a reading is judged by that, not by its force ratio.
    """
    if design.reading is not None:
        return tuple(_stiffness_verdicts(springs))
    manufactured = springs.housing is not None
    of_what = (
        _of_what(press, reached, large=design.press.strain == "large")
        if manufactured
        else "of the target stiffnesses, which were not made"
    )
    targets = design.targets
    judged = (
        ()
        if targets is None
        else target_verdicts(reached.P_max, reached.NL, targets, of_what, manufactured=manufactured)
    )
    return (
        *judged,
        *_stiffness_verdicts(springs),
        displacement_verdict(press.table, _drift(design, contact, springs)),
        monotonic_verdict(press.scan),
    )


def _stiffness_verdicts(springs: FittedSprings) -> Iterator[Verdict]:
    for name, spring in zip(_STIFFNESS_NAMES, springs.springs, strict=True):
        yield stiffness_verdict(name, spring, monolithic=springs.monolithic)


def bruise_verdicts(
    design: Design, contact: FruitCompliance, springs: FittedSprings, press: ScenePress
) -> tuple[Verdict, ...]:
    """Return the verdict on the pressure under the tips, where the fruit has a limit and no reading judges it."""
    limits = design.fruit.bruise_limits_MPa
    if not limits or design.reading is not None:
        return ()
    return (bruise_verdict(tip_pressure(design, contact, springs, press), max(limits)),)


def _of_what(press: ScenePress, reached: SceneTargets, *, large: bool) -> str:
    """Return in words whose P_max and NL are judged."""
    if press.level:
        return "of a level sensor on flat fruit"
    P_max, NL = reached.level
    what = "the same sensor at small strain" if large else "a level sensor on flat fruit"
    return f"at full travel in this scene; {what} has P_max {P_max.value:.4g}, NL {NL.value:.3g}"


def _drift(design: Design, contact: FruitCompliance, springs: FittedSprings) -> str:
    """Return in words how far an edge as round as the process makes it lets P drift over the travel."""
    if springs.housing is None or not design.tips.tip_shape.is_flat or design.press.strain == "large":
        return ""
    radius = springs.edge_radius(design.tips)
    drift = edge_drift(design, contact, springs.stiffnesses, radius)
    return f"; edges rounded by {radius:g} mm, as the process makes them, let P drift by {100.0 * drift:.2g} %"


def all_verdicts(
    design: Design, readings: Readings | None, judged: Judgement, making: Sequence[Verdict]
) -> tuple[Verdict, ...]:
    """Return the verdicts on readings, where there are any, those of the judgement, and those on what is made."""
    return *reading_verdicts(design, readings), *judged.verdicts, *making


def paper_verdicts(design: Design, contact: FruitCompliance, sizing: SpringSizing) -> tuple[Verdict, ...] | None:
    """Return the verdicts on the paper's own springs and targets under the contact of this design.

    None where fruit or tips are not the paper's.
    """
    if not design.has_paper_scene:
        return None
    C = spring_compliance(*PAPER_SPRINGS.stiffnesses)
    press = press_scene(design, contact, C)
    reached = scene_targets(characteristic(contact, sizing, PAPER_SPRINGS), PAPER_TARGETS, contact, C, press)
    return (
        *target_verdicts(
            reached.P_max, reached.NL, PAPER_TARGETS, _of_what(press, reached, large=design.press.strain == "large")
        ),
        displacement_verdict(press.table),
        monotonic_verdict(press.scan),
    )
