"""Every verdict of a run: on the sensor as designed, and beside it on the paper's own springs."""

from collections.abc import Sequence

from cad.design.parameters import PAPER_TARGETS, Design
from cad.design.tips import Tips
from cad.quantity import Estimate
from cad.theory.two_spring_law import PAPER_SPRINGS, Springs
from cad.verdict import Verdict, failed
from pipeline.options import RunOptions
from pipeline.stages.response import ScenePress, mean_tip_pressure, press_scan, press_table, spring_shares
from pipeline.stages.sizing import SpringSizing
from pipeline.stages.springs import FittedSprings
from pipeline.stages.verdict_rules import (
    Characteristic,
    bruise_verdict,
    displacement_verdict,
    monotonic_verdict,
    printable_verdict,
    stiffness_verdict,
    target_verdicts,
    with_tolerance_advice,
)
from solve.contact.linear_response import spring_compliance
from solve.fruit.compliance import FruitCompliance

_NOT_MADE = failed("geometry.made", "a housing", unit="1", reference="no housing was made, see printable.low and .high")
_STIFFNESS_NAMES = ("K_l", "K_h")


def characteristic(
    contact: FruitCompliance, sizing: SpringSizing, springs: Springs, errors: tuple[float, ...] = (0.0, 0.0)
) -> Characteristic:
    """Return springs with their errors [N/mm] against the stiffest fruit under the true contact."""
    K_m = sizing.K_m_max_contact
    return Characteristic(
        springs=springs,
        K_m_max=K_m,
        spring_errors=errors,
        K_m_error=contact.error_pair * K_m,
        stiffness_ratio=sizing.stiffness_ratio,
    )


def tip_pressure(design: Design, contact: FruitCompliance, springs: FittedSprings, press: ScenePress) -> Estimate:
    """Return the largest mean pressure under a tip at the largest modulus and full travel, with its error [MPa]."""
    pressure, error = mean_tip_pressure(design, press), press.hardest.F_error[-1, -1]
    shares = spring_shares(contact, springs.C, float(press.hardest.E[-1]))
    of_springs = max(
        share * spring.error / spring.stiffness for share, spring in zip(shares, springs.springs, strict=True)
    )
    return Estimate(pressure, (of_springs + (error if error > 0.0 else 0.0)) * pressure, "MPa")


def sensor_verdicts(
    design: Design,
    contact: FruitCompliance,
    sizing: SpringSizing,
    springs: FittedSprings,
    geometry: Sequence[Verdict],
    press: ScenePress,
) -> tuple[Verdict, ...]:
    """Return the verdicts on a design's own springs, on what they read and on the part that carries them."""
    own = characteristic(contact, sizing, springs.stiffnesses, springs.errors)
    manufactured = springs.housing is not None
    limit = design.fruit.bruise_limit_MPa
    named = zip(_STIFFNESS_NAMES, springs.springs, strict=True)
    return (
        *target_verdicts(own, design.targets, manufactured=manufactured),
        *(stiffness_verdict(name, spring, monolithic=springs.monolithic) for name, spring in named),
        displacement_verdict(press.table),
        monotonic_verdict(press.scan),
        *(printable_verdict(spring) for spring in springs.springs),
        *(geometry or (_NOT_MADE,)),
        *_tip_shape(design.tips),
        *(() if limit is None else (bruise_verdict(tip_pressure(design, contact, springs, press), limit),)),
    )


def advised(verdicts: Sequence[Verdict], springs: FittedSprings, options: RunOptions) -> tuple[Verdict, ...]:
    """Return verdicts with the `--tol` that would decide each undecided one; gauges and pins have their own bars."""
    if not springs.monolithic:
        return tuple(verdicts)
    return tuple(with_tolerance_advice(verdict, options.tolerance) for verdict in verdicts)


def _tip_shape(tips: Tips) -> tuple[Verdict, ...]:
    """Return a failed verdict where the tips are not those of the housing: sharp square ones, or pins as asked for."""
    if tips.socket == "pin" or (tips.shape == "cube" and tips.fillet_mm == 0.0):
        return ()
    verdict = Verdict(
        name="geometry.tip_shape",
        value=None,
        unit="1",
        limit="cube without fillet",
        tolerance=None,
        passed=False,
        reference="the response is that of the tips asked for, the housing has sharp square ones; choose "
        "tips.socket = 'pin' for ground pins of that shape",
    )
    return (verdict,)


def paper_verdicts(design: Design, contact: FruitCompliance, sizing: SpringSizing) -> tuple[Verdict, ...] | None:
    """Return the verdicts on the paper's own springs and targets under the contact of this design.

    None where fruit or tips are not the paper's.
    """
    if not design.has_paper_scene:
        return None
    C = spring_compliance(*PAPER_SPRINGS.stiffnesses)
    return (
        *target_verdicts(characteristic(contact, sizing, PAPER_SPRINGS), PAPER_TARGETS),
        displacement_verdict(press_table(design, contact, C)),
        monotonic_verdict(press_scan(design, contact, C)),
    )
