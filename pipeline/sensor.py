"""A sensor: a design whose stages are each solved once, on first use."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, wraps
from typing import Literal, TypeVar

from pipeline.errors.error_records import LevelTargets
from pipeline.errors.sensor_errors import SensorErrors, sensor_errors
from pipeline.errors.targets import SceneTargets, evaluate_targets
from pipeline.options import RunOptions
from pipeline.reading.analysis import ReadingAccuracy, analyse_readings, reading_constants, tilted_presses
from pipeline.reading.bench_uncertainty import refuse_bench_that_cannot_weigh
from pipeline.reading.poses import refuse_unsolvable_poses
from pipeline.reading.pressed_sensor import PressedSensor, SampledPresses
from pipeline.reading.read_out import ReadingConstants
from pipeline.reading.reading_over_time import ReadingOverTime, reading_over_time, refuse_unsolvable_time
from pipeline.response.contact import fruit_compliance
from pipeline.response.scaled_scene import scene_compliance, unit_scene
from pipeline.response.scene_press import ScenePress, press_scene
from pipeline.springs.behaviour import spring_behaviour
from pipeline.springs.behaviour_record import SpringBehaviour
from pipeline.springs.fitted_springs import BeginSolid, FittedSprings, springs_for, with_lateral_compliance
from pipeline.springs.sizing import SpringSizing, spring_sizing
from pipeline.storage.stopwatch import Stopwatch
from pipeline.verdicts.sensor_rules import RULES, paper_verdicts
from sensor.design.parameters import Design
from sensor.design.tip_mount import plate_depth
from sensor.verdict import Group, Verdict, row_of
from solve.fruit.compliance import FruitCompliance

Solved = TypeVar("Solved")
SpringsAs = Literal["fitted", "sized"]
"""Whether the springs are fitted to the housing by finite elements, or have the sized stiffness, as in a search."""


def refuse_unsolvable(design: Design) -> None:
    """Raise InputError for a scene or pose that cannot be solved, or for tips too close together for two plates.

    This check solves nothing, so that a user learns of such an error at once.
    """
    refuse_unsolvable_poses(design)
    refuse_unsolvable_time(design)
    plate_depth(design, design.process)  # raises InputError if the plates of a square are too shallow


def stage(name: str) -> Callable[[Callable[["Sensor"], Solved]], "cached_property[Solved]"]:
    """Return a decorator that makes a method of `Sensor` a property, which is solved on first use and then cached.

    The wall-clock and CPU time of the solution are added to the stage `name` in the sensor's stopwatch. Several
    properties may belong to the same stage. The decorated method computes the value of the property.
    """

    def timed_property(solve: Callable[["Sensor"], Solved]) -> "cached_property[Solved]":
        @wraps(solve)
        def solve_and_time(sensor: "Sensor") -> Solved:
            with sensor.timed.stage(name):
                return solve(sensor)

        return cached_property(solve_and_time)

    return timed_property


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Sensor:
    """A design whose stages are properties; each is solved on first use, together with the stages that it needs.

    The springs are "fitted" to the housing by finite elements, or have the "sized" stiffness, as in a search.
    `begin_solid` is called with each housing that may be the final one, and starts making its solid in parallel with
    the solution. A search may pass the `known_contact` of a design with the same contact problem, so that it is solved
    only once. A search may also pass the height offsets [mm] of tips on sized springs, `known_offsets_mm`.

    Each property raises InputError for a scene that cannot be solved, and MeshError or SolveError for an unreliable
    solution.
    """

    design: Design
    options: RunOptions = field(default_factory=RunOptions)
    springs_as: SpringsAs = "fitted"
    timed: Stopwatch = field(default_factory=Stopwatch)
    begin_solid: BeginSolid | None = None
    known_contact: FruitCompliance | None = None
    known_offsets_mm: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Raise InputError for a scene that cannot be solved, or for a bench that cannot calibrate fitted springs.

        With sized springs, the scene is checked only before it is solved, in `pressed`. The bench is not checked.
        """
        if self.springs_as == "fitted":
            refuse_unsolvable(self.design)
            refuse_bench_that_cannot_weigh(self.design)

    def solve(self, *stages: str) -> None:
        """Solve the named stages in the given order; each stage also solves the stages that it needs."""
        for name in stages:
            getattr(self, name)  # a stage is a property, which is solved and cached when it is read

    @stage("contact")
    def contact(self) -> FruitCompliance:
        """Return the compliance of the fruit under the tips.

        With sized springs, designs that differ only in size share one solution.
        """
        if self.known_contact is not None:
            return self.known_contact
        if self.springs_as == "sized":
            return scene_compliance(unit_scene(self.design), self.options.tolerance)
        return fruit_compliance(self.design, self.options)

    @stage("sizing")
    def sizing(self) -> SpringSizing:
        """Return the spring stiffnesses that meet the targets, or the stiffnesses that the design gives."""
        return spring_sizing(self.design, self.contact, self.options)

    @stage("springs")
    def upright_springs(self) -> FittedSprings:
        """Return the springs in their final housing, without the lateral compliance of their tips."""
        if self.springs_as == "sized":
            return replace(springs_for(self.design, self.sizing, "sized"), ideal_offsets_mm=self.known_offsets_mm)
        return springs_for(self.design, self.sizing, "fitted", self.options.tolerance, self.begin_solid)

    @stage("springs")
    def springs(self) -> FittedSprings:
        """Return the springs, with the lateral compliance of their tips if forces are inclined."""
        if self.springs_as == "sized":
            leaning = springs_for(self.design, self.sizing, "leaning")
            return replace(leaning, ideal_offsets_mm=self.known_offsets_mm)
        return with_lateral_compliance(self.upright_springs, self.design, self.options)

    @cached_property
    def pressed(self) -> PressedSensor:
        """Return the sensor as it is pressed and read: its design with its contact and its springs."""
        if self.springs_as == "sized":
            refuse_unsolvable(self.design)
        return PressedSensor(design=self.design, contact=self.contact, sizing=self.sizing, springs=self.springs)

    @stage("response")
    def press(self) -> ScenePress:
        """Return the forces of the tips at all travels and moduli."""
        pressed = self.pressed
        return press_scene(pressed.scene, pressed.contact, pressed.C)

    @stage("reading")
    def readings(self) -> ReadingAccuracy | None:
        """Return the accuracy of readings over all poses; None for a design without readings."""
        return analyse_readings(self.pressed)

    @stage("reading")
    def tilted(self) -> SampledPresses | None:
        """Return presses at several tilts along the tips; None for a design without readings or without tilt."""
        return tilted_presses(self.pressed)

    @stage("reading")
    def over_time(self) -> ReadingOverTime | None:
        """Return the readings over time; None for flesh that does not relax."""
        return reading_over_time(self.pressed)

    @cached_property
    def upright(self) -> PressedSensor:
        """Return the sensor without the lateral compliance of its tips, which suffices if no force is inclined."""
        return PressedSensor(design=self.design, contact=self.contact, sizing=self.sizing, springs=self.upright_springs)

    @cached_property
    def is_level(self) -> bool:
        """Return whether all tips touch at once: flat sharp tips on flat fruit, where the two-spring law is exact."""
        return self.upright.scene.touches_at_once

    @stage("verdicts")
    def level(self) -> LevelTargets:
        """Return P_max and NL of a level sensor on flat fruit, by the two-spring law."""
        return evaluate_targets(self.upright, self.design.nominal_targets, None).level

    @stage("verdicts")
    def reached(self) -> SceneTargets:
        """Return P_max and NL in the scene of the design; if all tips touch at once, no press has to be solved."""
        if self.is_level:
            return evaluate_targets(self.upright, self.design.nominal_targets, None)
        return evaluate_targets(self.pressed, self.design.nominal_targets, self.press)

    @stage("verdicts")
    def verdicts(self) -> tuple[Verdict, ...]:
        """Return the verdicts on the sensor that do not depend on files."""
        verdicts = [rule(self) for _, rule in RULES]  # a rule returns None if it does not apply to this design
        return tuple(verdict for verdict in verdicts if verdict is not None)

    def verdict(self, name: str) -> Verdict | None:
        """Evaluate only the verdict with the given name; None if this design has no such verdict."""
        with self.timed.stage("verdicts"):
            verdicts = [rule(self) for rule_name, rule in RULES if rule_name == name]
        return next((verdict for verdict in verdicts if verdict is not None), None)

    def verdicts_on(self, group: Group) -> tuple[Verdict, ...]:
        """Evaluate only the verdicts in the given group."""
        verdicts = [self.verdict(name) for name in dict(RULES) if row_of(name).group == group]
        return tuple(verdict for verdict in verdicts if verdict is not None)

    @stage("behaviour")
    def behaviour(self) -> SpringBehaviour | None:
        """Return the tilt, stiffening, natural frequency and crosstalk of the springs; None without a housing."""
        return spring_behaviour(self.springs, self.press)

    @stage("reading")
    def read_out(self) -> ReadingConstants:
        """Return the constants from which a printed sensor computes a modulus, given its forces."""
        return reading_constants(self.pressed, self.press, self.readings)

    @stage("errors")
    def errors(self) -> SensorErrors:
        """Return the error budget of each number, and the response table with the error bands of the modulus."""
        return sensor_errors(self.pressed, self.reached, self.press, self.options, self.readings)

    @stage("verdicts")
    def paper(self) -> tuple[Verdict, ...] | None:
        """Return the verdicts on the paper's own springs; None if fruit or tips differ from the paper's."""
        return paper_verdicts(self.pressed)
