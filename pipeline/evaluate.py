"""From a design to every number, verdict and error of its sensor: the one place where they are put together."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Literal

from pipeline.options import RunOptions
from pipeline.reading.analysis import analyse_readings, reading_constants, tilted_presses
from pipeline.reading.over_time import reading_over_time, refuse_unsolvable_time
from pipeline.reading.poses import refuse_unsolvable_poses
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.response.contact import fruit_compliance
from pipeline.response.scene_press import press_scene
from pipeline.result import Evaluation, SensorResult, with_solids
from pipeline.springs.behaviour import spring_behaviour
from pipeline.springs.fitted_springs import BeginSolid, fit_springs, with_sideways_give
from pipeline.springs.sizing import spring_sizing
from pipeline.storage.stopwatch import Stopwatch
from pipeline.verdicts.errors.effects import level_sensor
from pipeline.verdicts.errors.sensor_errors import sensor_errors
from pipeline.verdicts.hints import with_hints
from pipeline.verdicts.rules import reading_verdicts, relaxation_verdicts, target_verdicts
from pipeline.verdicts.sensor import (
    paper_verdicts,
    printable_verdicts,
    ratio_in_words,
    ratio_targets,
    response_verdicts,
    stiffness_verdicts,
    tip_verdicts,
)
from pipeline.verdicts.targets import reached_targets
from sensor.design.parameters import Design
from sensor.design.tip_mount import plate_depth
from sensor.turns import in_turn
from sensor.verdict import Verdict

Part = Literal["response", "reading"]
PARTS: tuple[Part, ...] = ("response", "reading")


def refuse_unsolvable(design: Design) -> None:
    """Raise InputError for a scene or a pose that cannot be solved, or tips that leave no plate; solves nothing."""
    refuse_unsolvable_poses(design)
    refuse_unsolvable_time(design)
    plate_depth(design, design.process)


def fitted_sensor(design: Design, options: RunOptions, timed: Stopwatch | None = None) -> PressedSensor:
    """Return the sensor of a design, ready to be pressed; raises as `housed_sensor`."""
    timed = timed or Stopwatch()
    return with_leaning_tips(housed_sensor(design, options, timed), options, timed)


def housed_sensor(
    design: Design, options: RunOptions, timed: Stopwatch, begin_solid: BeginSolid | None = None
) -> PressedSensor:
    """Return the sensor of a design: its contact solved, its springs sized in closed form and fitted by FE.

    The housing is final. What tips give sideways is left to `with_leaning_tips`. `begin_solid` begins the solid of each
    housing that may be the last one, beside the solves. Raises InputError for a scene that cannot be used, MeshError or
    SolveError where a solve is not to be believed.
    """
    refuse_unsolvable(design)
    with timed.stage("contact"):
        contact = fruit_compliance(design, options)
    with timed.stage("sizing"):
        sizing = spring_sizing(design, contact, options)
    with timed.stage("springs"):
        springs = fit_springs(design, sizing, options, begin_solid)
    return PressedSensor(design=design, contact=contact, sizing=sizing, springs=springs)


def with_leaning_tips(sensor: PressedSensor, options: RunOptions, timed: Stopwatch) -> PressedSensor:
    """Return the sensor with what its tips give sideways, where forces lean."""
    with timed.stage("springs"):
        springs = with_sideways_give(sensor.springs, sensor.design, options)
    return replace(sensor, springs=springs)


@in_turn
def evaluate(design: Design, options: RunOptions | None = None, *, timed: Stopwatch | None = None) -> SensorResult:
    """Return every number, verdict and error of a design but the verdicts on its files; raises as `fitted_sensor`."""
    options = options or RunOptions()
    timed = timed or Stopwatch()
    checked = check_targets(fitted_sensor(design, options, timed), options, timed=timed)
    return complete_evaluation(checked, timed)


def check_targets(
    sensor: PressedSensor,
    options: RunOptions | None = None,
    *,
    parts: Collection[str] = PARTS,
    timed: Stopwatch | None = None,
) -> Evaluation:
    """Return the verdicts on a sensor with what they follow from; errors and files are left out.

    Of the forces over travel and modulus, and the readings over all poses, those named in `parts` are solved. P_max and
    NL of a level sensor on flat fruit need neither. Raises as `fitted_sensor`.
    """
    timed = timed or Stopwatch()
    design = sensor.design
    press = None
    if "response" in parts:
        with timed.stage("response"):
            press = press_scene(sensor.scene, sensor.contact, sensor.C)
    readings = None
    over_time = None
    if "reading" in parts:
        with timed.stage("reading"):
            readings = analyse_readings(sensor)
            over_time = reading_over_time(sensor)
    with timed.stage("verdicts"):
        reached = reached_targets(sensor, design.nominal_targets, press)
        springs = sensor.springs.per_spring
        verdicts = [*reading_verdicts(design, readings)]
        targets = ratio_targets(design, press)
        if targets is not None:
            words = ratio_in_words(springs, press, reached)
            verdicts += target_verdicts(reached.P_max, reached.NL, targets, words, manufactured=springs.known)
        verdicts += stiffness_verdicts(springs)
        verdicts += response_verdicts(design, press)
        verdicts += printable_verdicts(design, springs)
        verdicts += tip_verdicts(sensor, press)
        verdicts += relaxation_verdicts(design, over_time)
    return Evaluation(
        options=options or RunOptions(),
        sensor=sensor,
        press=press,
        readings=readings,
        over_time=over_time,
        reached=reached,
        verdicts=tuple(verdicts),
    )


def complete_evaluation(checked: Evaluation, timed: Stopwatch) -> SensorResult:
    """Return an evaluation with all that its verdicts do not need: behaviour, constants of the read-out, errors.

    Raises ValueError where the response was not evaluated.
    """
    sensor = checked.sensor
    options = checked.options
    springs = sensor.springs
    press = checked.solved_press
    left_out = []
    if options.rough:
        left_out.append(
            "a rough answer: the solid and what pipeline design adds to a run are left out; --tol 0.001 has them"
        )
    with timed.stage("behaviour"):
        behaviour = spring_behaviour(springs, press)
    with timed.stage("reading"):
        readings = checked.readings
        if readings is not None and sensor.design.reading is not None:
            readings = replace(readings, tilted=tilted_presses(sensor, sensor.design.reading))
        read_out = reading_constants(sensor, press, readings)
    with timed.stage("errors"):
        errors = sensor_errors(level_sensor(sensor), checked.reached, press, options, readings)
    with timed.stage("verdicts"):
        paper = paper_verdicts(sensor)
    return SensorResult(
        options=options,
        sensor=sensor,
        press=press,
        readings=readings,
        over_time=checked.over_time,
        reached=checked.reached,
        verdicts=checked.verdicts,
        paper=paper,
        behaviour=behaviour,
        read_out=read_out,
        errors=errors,
        left_out=tuple(left_out),
        seconds=timed.seconds(),
    )


def with_file_verdicts(
    result: SensorResult, geometry: Sequence[Verdict], making: Sequence[Verdict]
) -> tuple[Verdict, ...]:
    """Return the verdicts of a result with those on its solids and its fabrication; what did not pass has a hint."""
    verdicts = result.verdicts
    if result.design.tips.tip_layout.has_housing:
        verdicts = (*with_solids(verdicts, geometry), *making)
    return with_hints(verdicts, result.design, result.springs, result.options)
