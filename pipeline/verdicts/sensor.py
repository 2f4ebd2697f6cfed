"""The verdicts on a sensor that need no file, by what they judge, and those on the paper's own springs."""

from dataclasses import replace

from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.response.scene_press import ScenePress, mean_tip_pressure, press_scene, scene_of
from pipeline.springs.fitted_springs import FittedSprings
from pipeline.verdicts.rules import (
    bruise_verdict,
    displacement_verdict,
    monotonic_verdict,
    printable_verdict,
    stiffness_verdict,
    target_verdicts,
    tip_face_verdict,
)
from pipeline.verdicts.targets import SceneTargets, force_errors_of_springs, reached_targets
from sensor.design.parameters import PAPER_TARGETS, Design
from sensor.quantity import Estimate
from sensor.theory.two_spring_law import PAPER_SPRINGS
from sensor.verdict import Verdict


def stiffness_verdicts(springs: FittedSprings) -> tuple[Verdict, ...]:
    """Return the verdicts K_l and K_h; none on springs that are taken just as stiff as they were sized."""
    if springs.ideal:
        return ()
    rows = zip(("K_l", "K_h"), springs.springs, strict=True)
    return tuple(stiffness_verdict(name, spring, monolithic=springs.monolithic) for name, spring in rows)


def response_verdicts(press: ScenePress) -> tuple[Verdict, ...]:
    """Return the verdicts on P over travel and modulus."""
    return displacement_verdict(press.table), monotonic_verdict(press.scan)


def printable_verdicts(design: Design, springs: FittedSprings) -> tuple[Verdict, ...]:
    """Return the verdicts on whether each spring can be printed; none for a line of tips, which has no housing."""
    if not design.tips.tip_layout.has_housing:
        return ()
    return tuple(printable_verdict(spring) for spring in springs.springs)


def tip_verdicts(sensor: PressedSensor, press: ScenePress) -> tuple[Verdict, ...]:
    """Return the verdicts on the faces of printed domes and on bruising.

    A design with readings has its verdict on bruising among those on its readings.
    """
    design = sensor.design
    verdicts = []
    if design.tips.tip_layout.has_housing and design.tips.tip_shape.touches_beside_centre:
        verdicts.append(tip_face_verdict(design, press))
    limits = design.fruit.bruise_limits_MPa
    if design.reading is None and limits:
        verdicts.append(bruise_verdict(tip_pressure(sensor, press), max(limits)))
    return tuple(verdicts)


def tip_pressure(sensor: PressedSensor, press: ScenePress) -> Estimate:
    """Return the largest mean pressure under a tip at the largest modulus and full travel, with its error [MPa]."""
    of_springs = float(force_errors_of_springs(sensor.pair, float(press.at_largest_E.E[-1])).max())
    of_contact = float(press.at_largest_E.F_error[-1, -1])
    relative = of_springs + (of_contact if of_contact > 0.0 else 0.0)  # nan where no tip is on the fruit
    pressure = mean_tip_pressure(sensor.design, press)
    return Estimate(pressure, relative * pressure, "MPa")


def ratio_in_words(springs: FittedSprings, *, level: bool, reached: SceneTargets) -> str:
    """Return the words that say of which springs, or in which scene, P_max and NL are; `level` is that of the press."""
    if springs.ideal:
        return "of springs exactly as they were sized or given"
    if springs.housing is None:
        return "of the target stiffnesses, which were not made"
    return _scene_in_words(level=level, reached=reached)


def _scene_in_words(*, level: bool, reached: SceneTargets) -> str:
    """Return the words for the scene, with P_max and NL of a level sensor where it is another one."""
    if level:
        return "of a level sensor on flat fruit"
    P_max, NL = reached.level
    of_level = f"P_max {P_max.value:.4g}, NL {NL.value:.3g}"
    return f"at full travel in this scene; a level sensor on flat fruit has {of_level}"


def paper_verdicts(sensor: PressedSensor) -> tuple[Verdict, ...] | None:
    """Return the verdicts on the paper's own springs and targets under the contact of this design.

    None where fruit or tips are not the paper's.
    """
    if not sensor.design.has_paper_scene:
        return None
    paper = _on_paper_springs(sensor)
    press = press_scene(scene_of(paper.design), paper.contact, paper.C)
    reached = reached_targets(paper, PAPER_TARGETS, press)
    return (
        *target_verdicts(reached.P_max, reached.NL, PAPER_TARGETS, _scene_in_words(level=press.level, reached=reached)),
        displacement_verdict(press.table),
        monotonic_verdict(press.scan),
    )


def _on_paper_springs(sensor: PressedSensor) -> PressedSensor:
    """Return the sensor on springs exactly as stiff as those of the paper, which are not made."""
    springs = []
    for spring, K in zip(sensor.springs.springs, PAPER_SPRINGS.stiffnesses, strict=True):
        springs.append(replace(spring, target=K, flexure=None, K=None, root_strain=None))
    ideal = replace(sensor.springs, springs=tuple(springs), fitted=None, of_plate=None, ideal=True)
    return replace(sensor, springs=ideal)
