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
from sensor.theory.two_spring_law import SOFTEST, curve_nonlinearity
from solve.contact.linear_response import SensorResponse

LEAST_CHANGE = 1e-6  # a smaller change is scaled up to this, its result down again: round-off would drown it
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


def uncertainty_budgets(sensor: LevelSensor, reached: SceneTargets, press: ScenePress) -> Budgets:
    """Return the budget of every number.

    Contributions to P_max and NL are those of a level sensor; that of the pose is the scene's own where tilted presses
    are solved.
    """
    travel = sensor.design.press.travel_mm
    on_springs = effects_on(sensor, travel, sensor.largest_deflections)
    P_max = None
    NL = None
    if sensor.design.reading is None:
        if reached.P_max is not None:
            P_max = _P_max_budget(sensor, reached.P_max, press)
        if reached.NL is not None:
            NL = _nonlinearity_budget(sensor, reached.NL)
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


def _P_max_budget(sensor: LevelSensor, P_max: Estimate, press: ScenePress) -> UncertaintyBudget:
    """Return the budget of P at E_max and full travel."""
    travel = sensor.design.press.travel_mm
    E_max = sensor.design.fruit.E_max_MPa
    budget = ratio_budget(sensor, E_max, travel, P_max.relative, effects_at(sensor, E_max, travel))
    return _with_pose(budget, P_max, [float(tilted.P[-1, -1]) for tilted in press.tilted])


def _tilted_NL(tilted: SensorResponse) -> float:
    """Return NL at mid-range [1] of a tilted press, solved at the softest, the middle and the largest modulus."""
    return curve_nonlinearity(tilted.P[:, -1].tolist(), (0.0, 0.5, 1.0), "mid-range")


def effects_at(sensor: LevelSensor, E: Floats | float, travel: Floats | float) -> tuple[Effect, ...]:
    """Return the effects on the force ratio of a level sensor at moduli [MPa] and travels [mm] that broadcast."""
    moduli = np.asarray(E, dtype=np.float64)
    K_m = [each * sensor.contact.at(each).K_m_over_E() for each in moduli.flat]
    return effects_on(sensor, travel, sensor.deflections(np.reshape(K_m, moduli.shape), travel))


def ratio_budget(
    sensor: LevelSensor, E: float, travel: float, numerical: float, effects: Sequence[Effect]
) -> UncertaintyBudget:
    """Return the budget of P at a modulus [MPa] and a travel [mm] by effects that act there."""
    return budget_of(numerical, effects, change_of_ratio(sensor, E, travel))


def change_of_ratio(sensor: LevelSensor, E: Floats | float, travel: Floats | float) -> Change:
    """Return the change of P by an effect at moduli [MPa] and travels [mm] that broadcast, once for each effect."""
    press = _level_press(sensor, E, travel)
    P = press.ratio_with(NO_EFFECT, 0.0)

    @functools.cache
    def change(effect: Effect, sign: float) -> Floats:
        factor = _magnified(effect, travel)
        moved = press.ratio_with(effect, sign * factor)
        return np.where(np.isfinite(moved), (moved / P - 1.0) / factor, sign * LIFTED)

    return change


@dataclass(frozen=True, kw_only=True, eq=False)
class _LevelPress:
    """Presses of a level sensor at moduli E [MPa] and travels [mm] that broadcast.

    K are the stiffnesses of the springs [N/mm]. `crosstalk` is the compliance of the fruit between both tips, times E
    [1/mm], of the shape of E. `own` is its compliance under each tip less the crosstalk, likewise, (2, ...).
    """

    E: Floats
    travel: Floats
    K: tuple[float, ...]
    own: Floats
    crosstalk: Floats

    def ratio_with(self, effect: Effect, times: Floats | float) -> Floats:
        """Return P [1] with a multiple of an effect; nan where that takes a tip off the fruit.

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


def _level_press(sensor: LevelSensor, E: Floats | float, travel: Floats | float) -> _LevelPress:
    """Return the presses of a sensor; flesh of no modulus is taken as next to none."""
    moduli = np.asarray(E, dtype=np.float64)
    softest = SOFTEST * sensor.design.fruit.E_max_MPa
    at_E = [sensor.contact.at(max(each, softest)) for each in moduli.flat]
    crosstalk = np.array([contact.crosstalk for contact in at_E])
    own = np.array([np.diag(contact.S) for contact in at_E]).T - crosstalk
    return _LevelPress(
        E=moduli,
        travel=np.asarray(travel, dtype=np.float64),
        K=sensor.characteristic.springs.stiffnesses,
        own=own.reshape(-1, *moduli.shape),
        crosstalk=crosstalk.reshape(moduli.shape),
    )


def _nonlinearity_budget(sensor: LevelSensor, NL: Estimate) -> UncertaintyBudget:
    """Return the budget of NL, which is (7): the fraction of its rise that P has made at the fruit stiffness of NL.

    An effect may be of another size there than at P_max. On the softest fruit only height offsets move P.
    """
    travel = sensor.design.press.travel_mm
    E_max = sensor.design.fruit.E_max_MPa
    K_m_max = sensor.characteristic.K_m_max
    K_m = sensor.characteristic.K_m_of_NL(sensor.design.nominal_targets)
    E_middle = E_max * sensor.characteristic.modulus_fraction(K_m)
    effects = effects_on(sensor, travel, sensor.deflections(K_m_max, travel))
    in_middle = {effect.name: effect for effect in effects_on(sensor, travel, sensor.deflections(K_m, travel))}
    softest, middle, top = (_level_press(sensor, E, travel) for E in (0.0, E_middle, E_max))
    scale = abs(NL.value) or 1.0

    def fraction_of_rise(effect: Effect, times: Floats | float) -> Floats:
        P_softest = softest.ratio_with(effect, times)
        P_middle = middle.ratio_with(in_middle[effect.name], times)
        return (P_middle - P_softest) / (top.ratio_with(effect, times) - P_softest)

    def change(effect: Effect, sign: float) -> Floats:
        factor = np.maximum(_magnified(in_middle[effect.name], travel), _magnified(effect, travel))
        moved = (fraction_of_rise(effect, sign * factor) - fraction_of_rise(effect, 0.0)) / factor
        return np.where(np.isfinite(moved), moved, sign * LIFTED) / scale

    return budget_of(NL.relative, effects, change)


def _magnified(effect: Effect, travel: Floats | float) -> Floats:
    """Return the factor [1] that enlarges an effect until its largest change is one that round-off does not drown."""
    sizes = [np.abs(change).max(axis=0) for change in (effect.springs, effect.fruit, effect.height_offsets)]
    largest = np.maximum(np.maximum(sizes[0], sizes[1]), sizes[2] / travel)
    enlarged: Floats = np.divide(LEAST_CHANGE, largest, out=np.ones_like(largest), where=largest > 0.0)
    return np.maximum(1.0, enlarged)


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
        if size == 0.0:
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
