"""Every verdict on a sensor that needs no file, and beside them those on the paper's own springs."""

import numpy as np

from pipeline.reading.analysis import Readings
from pipeline.reading.sensor import Sensor
from pipeline.response.scene_press import ScenePress, mean_tip_pressure, press_scene, scene_of, spring_shares
from pipeline.springs.fitted_springs import FittedSprings
from pipeline.verdicts.rules import (
    bruise_verdict,
    displacement_verdict,
    monotonic_verdict,
    printable_verdict,
    reading_verdicts,
    stiffness_verdict,
    target_verdicts,
    tip_face_verdict,
)
from pipeline.verdicts.targets import SceneTargets, characteristic, scene_targets
from sensor.design.parameters import PAPER_TARGETS
from sensor.quantity import Estimate
from sensor.theory.two_spring_law import PAPER_SPRINGS
from sensor.verdict import Verdict
from solve.contact.linear_response import spring_compliance


def reached_targets(sensor: Sensor, press: ScenePress | None) -> SceneTargets:
    """Return P_max and NL of a sensor in its own scene; those of a level sensor where it was not pressed.

    More tips than two are evaluated by the pair that stands for them.
    """
    pair = sensor.pair
    law = characteristic(pair.contact, pair.sizing, pair.springs.stiffnesses, pair.springs.errors)
    return scene_targets(law, sensor.design.nominal_targets, pair.contact, pair.C, press)


def sensor_verdicts(
    sensor: Sensor, press: ScenePress | None, readings: Readings | None, reached: SceneTargets
) -> tuple[Verdict, ...]:
    """Return the verdicts on readings or force ratio, springs and tips; without a press none that needs it.

    A design with a reading is evaluated by that, not by its force ratio. A line gets no verdicts on
    parts.
    """
    design = sensor.design
    springs = sensor.springs.per_spring
    by_ratio = design.reading is None
    verdicts = list(reading_verdicts(design, readings))
    if by_ratio and design.targets is not None and (press is not None or scene_of(design).linear):
        manufactured = springs.ideal or springs.housing is not None
        what = _of_what(springs, press, reached)
        verdicts += target_verdicts(reached.P_max, reached.NL, design.targets, what, manufactured=manufactured)
    if not springs.ideal:
        for name, spring in zip(("K_l", "K_h"), springs.springs, strict=True):
            verdicts.append(stiffness_verdict(name, spring, monolithic=springs.monolithic))
    if by_ratio and press is not None:
        verdicts.append(displacement_verdict(press.table))
        verdicts.append(monotonic_verdict(press.scan))
    has_housing = design.tips.tip_layout.has_housing
    if has_housing:
        verdicts += [printable_verdict(spring) for spring in springs.springs]
    if press is not None:
        if has_housing and design.tips.tip_shape.touches_beside_centre:
            verdicts.append(tip_face_verdict(design, press))
        limits = design.fruit.bruise_limits_MPa
        if by_ratio and limits:
            verdicts.append(bruise_verdict(tip_pressure(sensor, press), max(limits)))
    return tuple(verdicts)


def tip_pressure(sensor: Sensor, press: ScenePress) -> Estimate:
    """Return the largest mean pressure under a tip at the largest modulus and full travel, with its error [MPa]."""
    pair = sensor.pair
    springs = pair.springs
    shares = spring_shares(pair.contact, pair.C, float(press.at_largest_E.E[-1]))
    of_springs = float(np.max(shares * np.divide(springs.errors, springs.stiffnesses.stiffnesses)))
    of_contact = float(press.at_largest_E.F_error[-1, -1])
    relative = of_springs + (of_contact if of_contact > 0.0 else 0.0)  # nan where no tip is on the fruit
    pressure = mean_tip_pressure(sensor.design, press)
    return Estimate(pressure, relative * pressure, "MPa")


def _of_what(springs: FittedSprings, press: ScenePress | None, reached: SceneTargets) -> str:
    """Return in words whose P_max and NL the verdicts are on."""
    if springs.ideal:
        return "of springs exactly as they were sized or given"
    if springs.housing is None:
        return "of the target stiffnesses, which were not made"
    return _of_scene(press, reached)


def _of_scene(press: ScenePress | None, reached: SceneTargets) -> str:
    if press is None or press.level:
        return "of a level sensor on flat fruit"
    P_max, NL = reached.level
    level = f"P_max {P_max.value:.4g}, NL {NL.value:.3g}"
    return f"at full travel in this scene; a level sensor on flat fruit has {level}"


def paper_verdicts(sensor: Sensor) -> tuple[Verdict, ...] | None:
    """Return the verdicts on the paper's own springs and targets under the contact of this design.

    None where fruit or tips are not the paper's.
    """
    design, contact = sensor.design, sensor.contact
    if not design.has_paper_scene:
        return None
    C = spring_compliance(*PAPER_SPRINGS.stiffnesses)
    press = press_scene(scene_of(design), contact, C)
    reached = scene_targets(characteristic(contact, sensor.sizing, PAPER_SPRINGS), PAPER_TARGETS, contact, C, press)
    return (
        *target_verdicts(reached.P_max, reached.NL, PAPER_TARGETS, _of_scene(press, reached)),
        displacement_verdict(press.table),
        monotonic_verdict(press.scan),
    )
