"""A sensor: a design whose stages are solved when they are first asked for, each of them once."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property, wraps
from typing import Literal, TypeVar

from pipeline.errors.records import LevelTargets
from pipeline.errors.sensor_errors import SensorErrors, sensor_errors
from pipeline.errors.targets import SceneTargets, reached_targets
from pipeline.options import RunOptions
from pipeline.reading.analysis import Readings, analyse_readings, reading_constants, tilted_presses
from pipeline.reading.bench import refuse_bench_that_cannot_weigh
from pipeline.reading.over_time import ReadingOverTime, reading_over_time, refuse_unsolvable_time
from pipeline.reading.poses import refuse_unsolvable_poses
from pipeline.reading.pressed_sensor import PressedSensor, Presses
from pipeline.reading.read_out import ReadingConstants
from pipeline.response.contact import fruit_compliance
from pipeline.response.scene_press import ScenePress, press_scene
from pipeline.response.unit_scene import scene_compliance, unit_scene
from pipeline.springs.behaviour import spring_behaviour
from pipeline.springs.behaviour_record import SpringBehaviour
from pipeline.springs.fitted_springs import BeginSolid, FittedSprings, springs_for, with_sideways_give
from pipeline.springs.sizing import SpringSizing, spring_sizing
from pipeline.storage.stopwatch import Stopwatch
from pipeline.verdicts.sensor import RULES, paper_verdicts
from sensor.design.parameters import Design
from sensor.design.tip_mount import plate_depth
from sensor.verdict import Group, Verdict, row_of
from solve.fruit.compliance import FruitCompliance

Solved = TypeVar("Solved")
SpringsAs = Literal["fitted", "sized"]
"""Springs fitted to the housing by finite elements, or exactly as stiff as they were sized, which a search tries."""


def refuse_unsolvable(design: Design) -> None:
    """Raise InputError for a scene or a pose that cannot be solved, or tips that leave no plate; solves nothing."""
    refuse_unsolvable_poses(design)
    refuse_unsolvable_time(design)
    plate_depth(design, design.process)


def stage(name: str) -> Callable[[Callable[["Sensor"], Solved]], "cached_property[Solved]"]:
    """Return a decorator for a property that is solved once, whose seconds count to a stage of the run."""

    def decorated(solve: Callable[["Sensor"], Solved]) -> "cached_property[Solved]":
        @wraps(solve)
        def timed(sensor: "Sensor") -> Solved:
            with sensor.timed.stage(name):
                return solve(sensor)

        return cached_property(timed)

    return decorated


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Sensor:
    """A design with its stages: each property solves what it needs.

    The springs are `fitted` to the housing by finite elements, or taken as `sized`. `begin_solid` begins the solid of
    each housing that may be the last one, beside the solves. A search gives a contact that is known from a design with
    the same scene, and for sized springs the height offsets of the tips [mm]. Each property raises InputError for a
    scene that cannot be used, MeshError or SolveError for a solve that must not be believed.
    """

    design: Design
    options: RunOptions = field(default_factory=RunOptions)
    springs_as: SpringsAs = "fitted"
    timed: Stopwatch = field(default_factory=Stopwatch)
    begin_solid: BeginSolid | None = None
    known_contact: FruitCompliance | None = None
    known_offsets_mm: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a scene that cannot be pressed; sized springs may be asked for in any, until they are pressed.

        What will be made must be calibrated too. A search goes on from a bench that cannot.
        """
        if self.springs_as == "fitted":
            refuse_unsolvable(self.design)
            refuse_bench_that_cannot_weigh(self.design)

    def solve(self, *stages: str) -> None:
        """Solve stages in this order; each solves by itself what it needs."""
        for name in stages:
            getattr(self, name)

    @stage("contact")
    def contact(self) -> FruitCompliance:
        """Return the compliance of the fruit under the tips; designs of one shape share that of sized springs."""
        if self.known_contact is not None:
            return self.known_contact
        if self.springs_as == "sized":
            return scene_compliance(unit_scene(self.design), self.options.tolerance)
        return fruit_compliance(self.design, self.options)

    @stage("sizing")
    def sizing(self) -> SpringSizing:
        """Return the springs that the targets require, or that the design gives."""
        return spring_sizing(self.design, self.contact, self.options)

    @stage("springs")
    def upright_springs(self) -> FittedSprings:
        """Return the springs in their final housing, without what their tips give sideways."""
        if self.springs_as == "sized":
            return replace(springs_for(self.design, self.sizing, "sized"), ideal_offsets_mm=self.known_offsets_mm)
        return springs_for(self.design, self.sizing, "fitted", self.options.tolerance, self.begin_solid)

    @stage("springs")
    def springs(self) -> FittedSprings:
        """Return the springs with what their tips give sideways, where forces lean."""
        if self.springs_as == "sized":
            leaning = springs_for(self.design, self.sizing, "leaning")
            return replace(leaning, ideal_offsets_mm=self.known_offsets_mm)
        return with_sideways_give(self.upright_springs, self.design, self.options)

    @cached_property
    def pressed(self) -> PressedSensor:
        """Return what is pressed and read: the tips on their springs over the fruit."""
        if self.springs_as == "sized":
            refuse_unsolvable(self.design)
        return PressedSensor(design=self.design, contact=self.contact, sizing=self.sizing, springs=self.springs)

    @stage("response")
    def press(self) -> ScenePress:
        """Return the forces over travel and modulus."""
        pressed = self.pressed
        return press_scene(pressed.scene, pressed.contact, pressed.C)

    @stage("reading")
    def readings(self) -> Readings | None:
        """Return the errors of the readings over all poses; None for a design without readings."""
        return analyse_readings(self.pressed)

    @stage("reading")
    def tilted(self) -> Presses | None:
        """Return presses at tilts along the tips; None for a design without readings or without a tilt."""
        return tilted_presses(self.pressed)

    @stage("reading")
    def over_time(self) -> ReadingOverTime | None:
        """Return the reading over time; None for flesh that does not relax."""
        return reading_over_time(self.pressed)

    @cached_property
    def upright(self) -> PressedSensor:
        """Return what is pressed as long as no force leans."""
        return PressedSensor(design=self.design, contact=self.contact, sizing=self.sizing, springs=self.upright_springs)

    @cached_property
    def is_level(self) -> bool:
        """Return whether flat sharp tips touch a flat fruit all at once, so that the two-spring law is exact."""
        return self.upright.scene.touches_at_once

    @stage("verdicts")
    def level(self) -> LevelTargets:
        """Return P_max and NL of a level sensor on flat fruit, by the two-spring law."""
        return reached_targets(self.upright, self.design.nominal_targets, None).level

    @stage("verdicts")
    def reached(self) -> SceneTargets:
        """Return P_max and NL in the scene of the design, for which a level one needs no press."""
        if self.is_level:
            return reached_targets(self.upright, self.design.nominal_targets, None)
        return reached_targets(self.pressed, self.design.nominal_targets, self.press)

    @stage("verdicts")
    def verdicts(self) -> tuple[Verdict, ...]:
        """Return the verdicts on the sensor that need no file."""
        return self._judged(name for name, _ in RULES)

    def verdict(self, name: str) -> Verdict | None:
        """Return the verdict of a name, for which only its own rules are asked; None if this design has none."""
        return next(iter(self._judged([name])), None)

    def verdicts_on(self, group: Group) -> tuple[Verdict, ...]:
        """Return the verdicts of a group, for which only their own rules are asked."""
        return self._judged(name for name, _ in RULES if row_of(name).group == group)

    def _judged(self, names: Iterable[str]) -> tuple[Verdict, ...]:
        asked = set(names)
        with self.timed.stage("verdicts"):
            verdicts = [rule(self) for name, rule in RULES if name in asked]
        return tuple(verdict for verdict in verdicts if verdict is not None)

    @stage("behaviour")
    def behaviour(self) -> SpringBehaviour | None:
        """Return the tilt, stiffening, frequency and crosstalk of the springs; None where no housing is made."""
        return spring_behaviour(self.springs, self.press)

    @stage("reading")
    def read_out(self) -> ReadingConstants:
        """Return the constants by which a finished sensor is read."""
        return reading_constants(self.pressed, self.press, self.readings)

    @stage("errors")
    def errors(self) -> SensorErrors:
        """Return the budget of each number, and the table with its bands of the modulus."""
        return sensor_errors(self.pressed, self.reached, self.press, self.options, self.readings)

    @stage("verdicts")
    def paper(self) -> tuple[Verdict, ...] | None:
        """Return the verdicts on the paper's own springs; None where fruit or tips are not the paper's."""
        return paper_verdicts(self.pressed)
