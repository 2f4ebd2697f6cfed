"""The verdicts on a sensor that need no files, with the rule for each, and the verdicts on the springs of the paper."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from pipeline.errors.targets import SceneTargets, evaluate_targets, force_errors_of_springs
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.response.scene_press import ScenePress, mean_tip_pressure, press_scene, scene_of
from pipeline.springs.fitted_springs import FittedSprings
from pipeline.springs.spring import MadeSpring
from pipeline.verdicts.rules import (
    NL_verdict,
    P_max_verdict,
    bias_verdict,
    calibration_verdict,
    displacement_verdict,
    monotonic_verdict,
    printable_verdict,
    relaxation_verdict,
    skin_verdict,
    stiffness_verdict,
    tip_face_verdict,
    touch_verdict,
    uncertainty_verdict,
)
from sensor.design.parameters import PAPER_TARGETS, Targets
from sensor.quantity import Estimate
from sensor.theory.two_spring_law import PAPER_SPRINGS
from sensor.verdict import Verdict, judge

if TYPE_CHECKING:
    from pipeline.reading.analysis import ReadingAccuracy
    from pipeline.sensor import Sensor
    from sensor.design.reading import ReadingRequirements

Rule = Callable[["Sensor"], Verdict | None]
"""A function that judges a sensor, or returns None if its verdict does not apply to the design."""


def _judge_readings(
    judge_accuracy: "Callable[[ReadingAccuracy, ReadingRequirements], Verdict | None]", sensor: "Sensor"
) -> Verdict | None:
    """Judge the readings of a sensor by the function `judge_accuracy`; return None for a design without readings."""
    requirements = sensor.design.reading
    if requirements is None:
        return None
    readings = sensor.readings
    return None if readings is None else judge_accuracy(readings, requirements)


def _judge_ratio(
    name: str, judge_value: Callable[[Estimate | None, Targets, str], Verdict], sensor: "Sensor"
) -> Verdict | None:
    """Judge P_max or NL of a sensor, whichever `name` selects, by the function `judge_value`.

    The result is None for a design with readings or without targets. The verdict is undecided if the stiffnesses of the
    springs are unknown, because the springs could not be made.
    """
    targets = sensor.design.targets
    if targets is None or sensor.design.reading is not None:
        return None
    reached = sensor.reached  # raises an error for a scene that cannot be pressed
    springs = sensor.springs.as_pair
    scene_text = ratio_in_words(springs, level=sensor.is_level, reached=reached)
    value = {"P_max": reached.P_max, "NL": reached.NL}[name]
    verdict = judge_value(value, targets, scene_text)
    return verdict if springs.known else replace(verdict, passed=None)


def _judge_stiffness(name: str, kind: str, sensor: "Sensor") -> Verdict | None:
    """Judge the stiffness of a spring; return None for ideal springs, which are as stiff as sized."""
    springs = sensor.springs.as_pair
    return None if springs.ideal else stiffness_verdict(name, springs.springs[kind], monolithic=springs.monolithic)


def _judge_displacement(sensor: "Sensor") -> Verdict | None:
    """Judge the variation of P over the travel; return None for a design with readings."""
    return None if sensor.design.reading is not None else displacement_verdict(sensor.press.table)


def _judge_increase(sensor: "Sensor") -> Verdict | None:
    """Judge the increase of P with E; return None for a design with readings."""
    return None if sensor.design.reading is not None else monotonic_verdict(sensor.press.scan)


def _judge_print(kind: str, sensor: "Sensor") -> Verdict | None:
    """Judge whether a spring can be printed; return None for a layout without a housing."""
    springs = sensor.springs
    has_housing = sensor.design.tips.tip_layout.has_housing
    return printable_verdict(springs.printable[kind], springs.springs[kind]) if has_housing else None


def _judge_tip_faces(sensor: "Sensor") -> Verdict | None:
    """Judge whether the domes touch only within their faces; return None for other tips, and without a housing."""
    tips = sensor.design.tips
    has_domes = tips.tip_layout.has_housing and tips.tip_shape.touches_beside_centre
    return tip_face_verdict(sensor.design, sensor.press) if has_domes else None


def _judge_pressure(sensor: "Sensor") -> Verdict | None:
    """Judge the largest pressure of a sensor that reads a force ratio.

    The result is None if the fruit has no bruise limit, and for a design with readings, for which `skin_verdict` covers
    all poses.
    """
    limits = sensor.design.fruit.bruise_limits_MPa
    if sensor.design.reading is not None or not limits:
        return None
    reference = "largest force over the face of a tip, at the largest E and full travel; must be at most the limit"
    return judge("bruise", tip_pressure(sensor.pressed, sensor.press), reference, limit=max(limits))


def _judge_relaxation(sensor: "Sensor") -> Verdict | None:
    """Judge the change of a reading while the flesh relaxes; return None for elastic flesh."""
    over_time = sensor.over_time
    return None if over_time is None else relaxation_verdict(sensor.design, over_time)


RULES: tuple[tuple[str, Rule], ...] = (
    ("reading.bias", partial(_judge_readings, bias_verdict)),
    ("reading.uncertainty", partial(_judge_readings, uncertainty_verdict)),
    ("reading.touch", partial(_judge_readings, touch_verdict)),
    ("reading.calibration", partial(_judge_readings, calibration_verdict)),
    ("bruise", partial(_judge_readings, skin_verdict)),
    ("P_max", partial(_judge_ratio, "P_max", P_max_verdict)),
    ("NL", partial(_judge_ratio, "NL", NL_verdict)),
    ("K_l", partial(_judge_stiffness, "K_l", "low")),
    ("K_h", partial(_judge_stiffness, "K_h", "high")),
    ("P_displacement_independent", _judge_displacement),
    ("P_monotonic", _judge_increase),
    ("printable.low", partial(_judge_print, "low")),
    ("printable.high", partial(_judge_print, "high")),
    ("geometry.tip_face", _judge_tip_faces),
    ("bruise", _judge_pressure),
    ("reading.relaxation", _judge_relaxation),
)
"""The verdicts in the order of a report, and the rule for each. A rule returns None if it does not apply."""


def tip_pressure(sensor: PressedSensor, press: ScenePress) -> Estimate:
    """Return the largest mean pressure under a tip [MPa] at the largest modulus and full travel, with its error."""
    spring_error = float(force_errors_of_springs(sensor.pair, float(press.at_largest_E.E[-1])).max())
    contact_error = float(press.at_largest_E.F_error[-1, -1])  # nan if no tip touches the fruit
    relative_error = spring_error + (contact_error if contact_error > 0.0 else 0.0)  # nan > 0 is false
    pressure = mean_tip_pressure(sensor.design, press)
    return Estimate(pressure, relative_error * pressure, "MPa")


def ratio_in_words(springs: FittedSprings, *, level: bool, reached: SceneTargets) -> str:
    """Return text that describes the springs or the scene of P_max and NL. `level` is true for a level press."""
    if springs.ideal:
        return "of springs exactly as they were sized or given"
    if springs.housing is None:
        return "of the target stiffnesses, which were not made"
    return _scene_in_words(level=level, reached=reached)


def _scene_in_words(*, level: bool, reached: SceneTargets) -> str:
    """Return text that describes the scene.

    `level` is true for a level press. Otherwise the text includes P_max and NL of a level sensor, from `reached`.
    """
    if level:
        return "of a level sensor on flat fruit"
    level_text = f"P_max {reached.level.P_max:.4g}, NL {reached.level.NL:.3g}"
    return f"at full travel in this scene; a level sensor on flat fruit has {level_text}"


def paper_verdicts(sensor: PressedSensor) -> tuple[Verdict, ...] | None:
    """Judge the springs of the paper against its targets, with the contact between fruit and tips of this design.

    The result is None if the fruit or the tips differ from the paper.
    """
    if not sensor.design.has_paper_scene:
        return None
    paper = _on_paper_springs(sensor)
    press = press_scene(scene_of(paper.design), paper.contact, paper.C)
    reached = evaluate_targets(paper, PAPER_TARGETS, press)
    scene_text = _scene_in_words(level=press.level, reached=reached)
    return (
        P_max_verdict(reached.P_max, PAPER_TARGETS, scene_text),
        NL_verdict(reached.NL, PAPER_TARGETS, scene_text),
        displacement_verdict(press.table),
        monotonic_verdict(press.scan),
    )


def _on_paper_springs(sensor: PressedSensor) -> PressedSensor:
    """Return the sensor with ideal springs that have exactly the stiffnesses given in the paper."""
    springs = {"low": MadeSpring(target=PAPER_SPRINGS.K_l), "high": MadeSpring(target=PAPER_SPRINGS.K_h)}
    ideal = replace(sensor.springs, springs=springs, fitted=None, plate_sideways=None, ideal=True)
    return replace(sensor, springs=ideal)
