"""What each error bar is made of: the numerical error, what the model leaves out, what is not known of the inputs.

The three parts are those of ASME V&V 20. A verdict asks whether the design meets its targets in the model, so it uses
the numerical error alone, which a finer mesh decides. No mesh takes away the model's part or the scatter of a process:
calibrating the printed unit does.
"""

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.response.scene_press import ScenePress
from pipeline.verdicts.errors.effects import NO_EFFECT, Effect, LevelSensor, effects_on
from pipeline.verdicts.targets import SceneTargets
from sensor.arrays import Floats
from sensor.quantity import Estimate
from sensor.record import Record
from sensor.theory.two_spring_law import Definition, curve_nonlinearity
from solve.contact.linear_response import SensorResponse

LEAST = 1e-9  # a smaller relative change of a number is round-off
LIFTED = 1.0  # relative change that counts for an effect which takes a tip off the fruit

Change = Callable[[Effect, float], Floats]
"""The relative change of numbers of any shape by an effect times a sign [1]."""


@dataclass(frozen=True, kw_only=True)
class Contribution:
    """What acts, by how much of the number it moves it [1], and why by this much."""

    effect: str
    size: float
    reason: str


@dataclass(frozen=True, kw_only=True, repr=False)
class UncertaintyBudget(Record):
    """The error of one number by its sources, each relative to the number [1]."""

    numerical: float
    model: tuple[Contribution, ...]
    input: tuple[Contribution, ...]

    @property
    def model_total(self) -> float:
        """Return the error of the model [1]: its effects act together, so their sizes add."""
        return sum(abs(contribution.size) for contribution in self.model)

    @property
    def input_total(self) -> float:
        """Return the error of the inputs [1], two sigma: they scatter apart, so their squares add."""
        return math.hypot(*(contribution.size for contribution in self.input))

    @property
    def total(self) -> float:
        """Return the whole error [1]: of the mesh, of the model and of the inputs."""
        return self.numerical + self.model_total + self.input_total


@dataclass(frozen=True, kw_only=True, repr=False)
class Budgets(Record):
    """The budget of each number; `contact` is that of s11 - s12.

    Springs that are not made have none. Nor have P_max and NL of a scene in which a tip is off the fruit or of a sensor
    that reads no force ratio. Domes touch by a part that grows: no s11 - s12 is theirs.
    """

    K_l: UncertaintyBudget | None
    K_h: UncertaintyBudget | None
    P_max: UncertaintyBudget | None
    NL: UncertaintyBudget | None
    contact: UncertaintyBudget | None

    @property
    def widest_spring(self) -> float:
        """Return the largest error of a spring by the inputs [1], two sigma; 0 where none is made."""
        springs = [budget for budget in (self.K_l, self.K_h) if budget is not None]
        return max((budget.input_total for budget in springs), default=0.0)


def uncertainty_budgets(
    sensor: LevelSensor, reached: SceneTargets, press: ScenePress, level: "LevelPress | None"
) -> Budgets:
    """Return the budget of every number; `level` is the level press that P_max and NL of a force ratio need.

    Contributions to P_max and NL are those of a level sensor; that of the pose is the scene's own where tilted presses
    are solved.
    """
    travel = sensor.design.press.travel_mm
    on_springs = effects_on(sensor, travel, sensor.largest_deflections)
    P_max = None
    NL = None
    if level is not None and reached.P_max is not None:
        P_max = budget_of(reached.P_max.relative, level.effects, relative_change(level.largest_ratio))
        P_max = _with_pose(P_max, reached.P_max, [float(tilted.P[-1, -1]) for tilted in press.tilted])
    if level is not None and reached.NL is not None:
        NL = budget_of(reached.NL.relative, level.effects, relative_change(level.nonlinearity, reached.NL.value))
        NL = _with_pose(NL, reached.NL, [_tilted_NL(tilted) for tilted in press.tilted])
    contact = None
    if not sensor.design.tips.tip_shape.obeys_hertz:
        rigid = effects_on(sensor, travel, np.zeros(2))
        contact = _contact_budget(sensor, rigid)
    return Budgets(
        K_l=_spring_budget(sensor, 0, on_springs),
        K_h=_spring_budget(sensor, 1, on_springs),
        P_max=P_max,
        NL=NL,
        contact=contact,
    )


def _tilted_NL(tilted: SensorResponse) -> float:
    """Return NL at mid-range [1] of a tilted press, solved at the softest, the middle and the largest modulus."""
    return curve_nonlinearity(tilted.P[:, -1].tolist(), (0.0, 0.5, 1.0), "mid-range")


@dataclass(frozen=True, kw_only=True, eq=False)
class LevelPress:
    """Presses of a level sensor over moduli [MPa] (moduli, 1) and travels [mm] (travels,), and the effects on them.

    K are the stiffnesses of the springs [N/mm]. `crosstalk` is the compliance of the fruit between both tips, times E
    [1/mm], (moduli, 1). `own` is its compliance under each tip less the crosstalk, likewise, (2, moduli, 1). Every
    number takes its changes from the same presses, so an effect acts on a fruit by its size on that fruit.
    """

    E: Floats
    travel: Floats
    K: tuple[float, ...]
    own: Floats
    crosstalk: Floats
    effects: tuple[Effect, ...]
    NL_definition: Definition

    def ratio(self, effect: Effect = NO_EFFECT, times: float = 0.0) -> Floats:
        """Return P [1], (moduli, travels), with a multiple of an effect; nan where that takes a tip off the fruit.

        The forces solve (E C + S) F = E (travel + height offset). C is the compliance of the springs, and S / E is the
        compliance of the fruit.
        """
        own = []  # diagonal of E C + S [1/mm]; beside it stands the crosstalk
        for i, K in enumerate(self.K):
            spring = K * (1.0 + times * effect.springs[i])
            own.append(self.E / spring + self.own[i] / (1.0 + times * effect.fruit[i]) + self.crosstalk)
        travel_l, travel_h = (self.travel + times * offset for offset in effect.height_offsets)
        # Cramer's rule: the determinant is the same for both forces, and their ratio needs none of it.
        F_l = own[1] * travel_l - self.crosstalk * travel_h
        F_h = own[0] * travel_h - self.crosstalk * travel_l
        both_touch = np.minimum(F_l, F_h) > 0.0
        ratio: Floats = np.divide(F_h, F_l, out=np.full(both_touch.shape, math.nan), where=both_touch)
        return ratio

    def largest_ratio(self, effect: Effect = NO_EFFECT, times: float = 0.0) -> Floats:
        """Return P [1] at the largest modulus and full travel, as `ratio` does."""
        largest: Floats = self.ratio(effect, times)[-1, -1]
        return largest

    def nonlinearity(self, effect: Effect = NO_EFFECT, times: float = 0.0) -> Floats:
        """Return NL [1] at full travel by its definition, as `ratio` does."""
        P = self.ratio(effect, times)[:, -1]
        return np.asarray(curve_nonlinearity(P.tolist(), self.E[:, 0].tolist(), self.NL_definition))


def level_press(sensor: LevelSensor, E: Floats, travel: Floats) -> LevelPress:
    """Return the presses of a level sensor at moduli [MPa] (moduli,) and travels [mm] (travels,)."""
    moduli = E[:, None]
    at_E = [sensor.contact.at(each) for each in E.tolist()]
    crosstalk = np.array([contact.crosstalk for contact in at_E])
    own = np.array([np.diag(contact.S) for contact in at_E]).T - crosstalk
    K_m = moduli * np.array([contact.K_m_over_E() for contact in at_E])[:, None]
    return LevelPress(
        E=moduli,
        travel=travel,
        K=sensor.characteristic.springs.stiffnesses,
        own=own[..., None],
        crosstalk=crosstalk[:, None],
        effects=effects_on(sensor, travel, sensor.deflections(K_m, travel)),
        NL_definition=sensor.design.nominal_targets.NL_definition,
    )


def relative_change(number: Callable[..., Floats], scale: float | None = None) -> Change:
    """Return the change of numbers by a multiple of an effect, over the scale or else over themselves [1].

    An effect that takes a tip off the fruit counts as `LIFTED`.
    """
    nominal = number()
    over = nominal if scale is None else abs(scale) or 1.0

    @functools.cache
    def change(effect: Effect, sign: float) -> Floats:
        moved = (number(effect, sign) - nominal) / over
        return np.where(np.isfinite(moved), moved, sign * LIFTED)

    return change


def _spring_budget(sensor: LevelSensor, spring: int, effects: Sequence[Effect]) -> UncertaintyBudget | None:
    """Return the budget of the stiffness of a spring; None where it is not made."""
    K = sensor.springs.springs[spring].K
    if K is None:
        return None
    return budget_of(K.relative, effects, lambda effect, sign: sign * effect.springs[spring])


def _contact_budget(sensor: LevelSensor, effects: Sequence[Effect]) -> UncertaintyBudget:
    """Return the budget of s11 - s12, the reciprocal of the fruit's stiffness, at full travel between rigid springs."""
    return budget_of(
        sensor.contact.error_pair, effects, lambda effect, sign: 1.0 / (1.0 + sign * effect.fruit[0]) - 1.0
    )


def budget_of(numerical: float, effects: Sequence[Effect], change: Change) -> UncertaintyBudget:
    """Return the budget of a number from its relative change by each effect; inputs go either way."""
    model: list[Contribution] = []
    inputs: list[Contribution] = []
    for effect in effects:
        size = float(_size_of(effect, change))
        if abs(size) < LEAST:
            continue
        contribution = Contribution(effect=effect.name, size=size, reason=effect.reason)
        if effect.scatters:
            inputs.append(contribution)
        else:
            model.append(contribution)
    return UncertaintyBudget(numerical=numerical, model=tuple(model), input=tuple(inputs))


def total_errors(numerical: Floats, effects: Sequence[Effect], change: Change) -> Floats:
    """Return the whole errors of many numbers [1], each as that of its `UncertaintyBudget`."""
    by_model = np.zeros_like(numerical)
    squares_of_inputs = np.zeros_like(numerical)
    for effect in effects:
        size = _size_of(effect, change)
        if effect.scatters:
            squares_of_inputs = squares_of_inputs + size**2
        else:
            by_model = by_model + np.abs(size)
    return numerical + by_model + np.sqrt(squares_of_inputs)


def _size_of(effect: Effect, change: Change) -> Floats:
    """Return by how much an effect moves numbers [1]; an input goes either way, and counts without a sign."""
    size = change(effect, 1.0)
    if not effect.scatters:
        return size
    down = change(effect, -1.0)
    # A height offset acts far more to one side than to the other: the larger side counts.
    one_sided = (effect.height_offsets != 0.0).any(axis=0)
    return np.where(one_sided, np.maximum(np.abs(size), np.abs(down)), 0.5 * np.abs(size - down))


def _with_pose(budget: UncertaintyBudget, number: Estimate, tilted: Sequence[float]) -> UncertaintyBudget:
    """Return the budget with its "pose" contribution replaced by what the spread of the tilt does in this scene.

    `tilted` is the number at the tilt less and plus its spread, nan where a tip is off; empty, it changes nothing.
    """
    if not tilted:
        return budget
    size = 0.0
    for value in tilted:
        change = abs(value / number.value - 1.0)
        size = max(size, change if math.isfinite(change) else LIFTED)
    inputs = []
    for contribution in budget.input:
        inputs.append(replace(contribution, size=size) if contribution.effect == "pose" else contribution)
    return replace(budget, input=tuple(inputs))
