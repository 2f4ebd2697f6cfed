"""The parts of each error bar: the numerical error, effects that the model leaves out, and unknown inputs.

The three parts follow ASME V&V 20. A verdict asks whether the design meets its targets in the model, so it uses only
the numerical error, which a finer mesh reduces. No mesh reduces the model error or the scatter of a process, but the
calibration of a printed unit does.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.errors.causes import NO_CAUSE, POSE, Cause, all_causes
from pipeline.errors.error_records import Contribution, UncertaintyBudget
from pipeline.errors.targets import SceneTargets, force_ratio_curve
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.response.scene_press import ScenePress
from sensor.arrays import Floats
from sensor.record import Record
from sensor.theory.two_spring_law import Definition, curve_nonlinearity
from solve.contact.linear_response import SensorResponse

ROUND_OFF = 1e-9  # relative changes below this are round-off
LIFTED = 1.0  # relative change entered for a cause that lifts a tip off the fruit, where no result can be computed

Change = Callable[[Cause, float], Floats]
"""A function of a cause and a multiple of its size. It returns the relative change of results [1], of any shape."""


@dataclass(frozen=True, kw_only=True, repr=False)
class Budgets(Record):
    """The error budgets of the results of a sensor. `contact` is the budget of the compliance s11 - s12 of the fruit.

    Springs that are not printed have no budget. P_max and NL have none if a tip is out of contact, or if the sensor
    does not read a force ratio. Domes have no s11 - s12, because their contact area grows.
    """

    K_l: UncertaintyBudget | None
    K_h: UncertaintyBudget | None
    P_max: UncertaintyBudget | None
    NL: UncertaintyBudget | None
    contact: UncertaintyBudget | None

    @property
    def largest_spring_error(self) -> float:
        """Return the largest stiffness error due to the inputs [1], two standard deviations; 0 without a housing."""
        springs = [budget for budget in (self.K_l, self.K_h) if budget is not None]
        return max((budget.inputs_total for budget in springs), default=0.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class LevelPress:
    """Level presses with a pair of tips, with the causes of their errors.

    They are made at moduli (moduli, 1) [MPa] and travels (travels,) [mm].

    Arrays with an entry for each tip begin with the tip on the low spring. K holds the stiffnesses of the two springs
    [N/mm]. `crosstalk` (moduli, 1) [1/mm] is the compliance of the fruit between the two tips, times E.
    `tip_compliance` (2, moduli, 1) [1/mm] is its compliance under each tip minus the crosstalk, times E.

    The changes due to all causes are computed from these presses, because the size of a cause depends on the modulus
    and the travel.
    """

    E: Floats
    travel: Floats
    K: tuple[float, ...]
    tip_compliance: Floats
    crosstalk: Floats
    causes: tuple[Cause, ...]
    NL_definition: Definition

    def ratio(self, cause: Cause = NO_CAUSE, times: float = 0.0) -> Floats:
        """Return the force ratio P [1] while a `cause` acts, shape (moduli, travels).

        `times` [1] is the factor on the size of the cause; at 0 the cause has no effect. P is nan if the cause lifts a
        tip off the fruit. The forces solve (E C + S) F = E (travel + height offset). C is the compliance of the
        springs, and S / E the compliance of the fruit.
        """
        # Diagonal of the matrix E C + S [1/mm]. Both other elements are the crosstalk.
        diagonal = []
        for i, K in enumerate(self.K):
            changed_K = K * (1.0 + times * cause.springs[i])
            fruit_under_tip = self.tip_compliance[i] / (1.0 + times * cause.fruit[i])  # a stiffer fruit yields less
            diagonal.append(self.E / changed_K + fruit_under_tip + self.crosstalk)
        travel_l, travel_h = (self.travel + times * offset for offset in cause.height_offsets)
        # By Cramer's rule, both forces have the same denominator, which cancels in their ratio and is left out.
        F_l = diagonal[1] * travel_l - self.crosstalk * travel_h
        F_h = diagonal[0] * travel_h - self.crosstalk * travel_l
        both_touch = np.minimum(F_l, F_h) > 0.0
        ratio: Floats = np.divide(F_h, F_l, out=np.full(both_touch.shape, math.nan), where=both_touch)
        return ratio

    def largest_ratio(self, cause: Cause = NO_CAUSE, times: float = 0.0) -> Floats:
        """Return P [1] at the largest modulus and full travel, which are the last ones, with a cause as in `ratio`."""
        largest: Floats = self.ratio(cause, times)[-1, -1]
        return largest

    def nonlinearity(self, cause: Cause = NO_CAUSE, times: float = 0.0) -> Floats:
        """Return NL [1] at full travel, the last travel, as the targets define it; a cause acts as in `ratio`."""
        P = self.ratio(cause, times)[:, -1]
        return np.asarray(curve_nonlinearity(P.tolist(), self.E[:, 0].tolist(), self.NL_definition))


def level_press(pair: PressedSensor, E: Floats, travel: Floats) -> LevelPress:
    """Return the level presses of a pair at the moduli `E` (moduli,) [MPa] and the travels `travel` (travels,) [mm].

    The compliances come from the solved contact. The sizes of the causes depend on the deflections of the springs,
    which come from the two-spring law.
    """
    moduli = E[:, None]  # a column, which broadcasts with the travels
    contacts = [pair.contact.at(modulus) for modulus in E.tolist()]  # under a skin, S differs from modulus to modulus
    # compliances of the fruit times E [1/mm]: between the two tips, and under each tip minus the crosstalk
    crosstalk = np.array([contact.crosstalk for contact in contacts])
    tip_compliance = np.array([np.diag(contact.S) for contact in contacts]).T - crosstalk  # (2, moduli)
    K_m = moduli * np.array([contact.K_m_over_E() for contact in contacts])[:, None]  # under the low tip [N/mm]
    law = force_ratio_curve(pair)
    return LevelPress(
        E=moduli,
        travel=travel,
        K=law.springs.stiffnesses,
        tip_compliance=tip_compliance[..., None],
        crosstalk=crosstalk[:, None],
        causes=all_causes(pair, travel, law.deflections(K_m, travel)),
        NL_definition=pair.design.nominal_targets.NL_definition,
    )


def uncertainty_budgets(
    pair: PressedSensor, targets: SceneTargets, press: ScenePress, level: LevelPress | None
) -> Budgets:
    """Return the error budgets of both springs, of P_max and NL, and of the compliance s11 - s12 of the fruit.

    `pair` is a sensor with two tips. `targets` holds P_max and NL of its scene, and `press` the solutions of the scene.
    The changes of P_max and NL are computed from the `level` presses. If `level` is None, P_max and NL have no budgets.
    Domes have no s11 - s12, so its budget is None.
    """
    travel = pair.design.press.travel_mm  # all causes are evaluated at full travel
    spring_causes = all_causes(pair, travel, _largest_deflections(pair))
    low_spring, high_spring = pair.springs.springs.values()
    K_l = _spring_budget(low_spring.K_error, spring_causes, _change_of_K_l)
    K_h = _spring_budget(high_spring.K_error, spring_causes, _change_of_K_h)
    P_max, NL = None, None
    if level is not None:
        P_max, NL = _ratio_budgets(targets, press, level)
    contact = None
    if not pair.design.tips.tip_shape.obeys_hertz:
        # The effects on the fruit are largest if the springs are rigid, because the whole travel then indents the
        # fruit. A rigid spring has the deflection 0.
        rigid_spring_causes = all_causes(pair, travel, np.zeros(2))
        contact = budget_of(pair.contact.difference_error, rigid_spring_causes, _change_of_contact)
    return Budgets(K_l=K_l, K_h=K_h, P_max=P_max, NL=NL, contact=contact)


def _spring_budget(K_error: float | None, causes: Iterable[Cause], change: Change) -> UncertaintyBudget | None:
    """Return the budget of a spring stiffness with the numerical error `K_error` [1].

    A spring that is not printed has no numerical error (None), and its budget is None.
    """
    return None if K_error is None else budget_of(K_error, causes, change)


def _ratio_budgets(
    targets: SceneTargets, press: ScenePress, level: LevelPress
) -> tuple[UncertaintyBudget | None, UncertaintyBudget | None]:
    """Return the error budgets of P_max and of NL in a scene, in this order.

    A budget is None if a tip is out of contact. The causes act on the `level` presses. If the scene was also solved at
    other tilts, the change due to the pose is computed from these solutions, `press.tilted`.
    """
    P_max = None
    if targets.P_max is not None:
        tilted_P_max = [float(response.P[-1, -1]) for response in press.tilted]  # at E_max and full travel
        change = _with_pose(relative_change(level.largest_ratio), targets.P_max.value, tilted_P_max)
        P_max = budget_of(targets.P_max.relative, level.causes, change)
    NL = None
    if targets.NL is not None:
        tilted_NL = [_tilted_NL(response) for response in press.tilted]
        change = _with_pose(relative_change(level.nonlinearity, targets.NL.value), targets.NL.value, tilted_NL)
        NL = budget_of(targets.NL.relative, level.causes, change)
    return P_max, NL


def _largest_deflections(pair: PressedSensor) -> Floats:
    """Return the deflection of each spring (2,) [mm] at full travel on the firmest fruit.

    The result is the larger one of two deflections: in a level press, and in the scene of the design. In the scene, a
    tilt or a step between the tips makes the travel of one tip longer and the travel of the other tip shorter.
    """
    in_level_press = force_ratio_curve(pair).deflections(pair.sizing.K_m_at_largest_E, pair.design.press.travel_mm)
    return np.maximum(in_level_press, pair.springs.deflections)


def _change_of_K_l(cause: Cause, sign: float) -> Floats:
    """Return the relative change of the stiffness of the low spring [1]; `sign` is the direction of the cause."""
    return np.asarray(sign * cause.springs[0])


def _change_of_K_h(cause: Cause, sign: float) -> Floats:
    """Return the relative change of the stiffness of the high spring [1]; `sign` is the direction of the cause."""
    return np.asarray(sign * cause.springs[1])


def _change_of_contact(cause: Cause, sign: float) -> Floats:
    """Return the relative change of s11 - s12 [1], which is inversely proportional to the stiffness of the fruit.

    `sign` is the direction of the cause.
    """
    return np.asarray(1.0 / (1.0 + sign * cause.fruit[0]) - 1.0)


def relative_change(results: Callable[..., Floats], scale: float | None = None) -> Change:
    """Return a function that computes the relative change of results [1] due to a cause and a factor on its size.

    Called without arguments, `results` returns the nominal results, of any shape. Called with a cause and a factor,
    such as 1 or -1, it returns the results while the cause acts. The change is divided by the magnitude of `scale`. If
    `scale` is None, the change is divided by the nominal results. If the cause lifts a tip, the results are not finite,
    and the change is `LIFTED` in magnitude.
    """
    nominal = results()
    denominator: Floats | float = nominal
    if scale is not None:
        denominator = abs(scale) or 1.0  # 1 replaces a scale of 0, which would divide by zero

    def change(cause: Cause, factor: float) -> Floats:
        changes = (results(cause, factor) - nominal) / denominator
        return np.where(np.isfinite(changes), changes, factor * LIFTED)

    return change


def _with_pose(change: Change, value: float, tilted: Sequence[float]) -> Change:
    """Return `change` with the effect of the pose taken from presses that were solved at other tilts.

    `value` is the result in its scene. `tilted` holds the result at the tilt minus its spread and at the tilt plus its
    spread. A result is nan if a tip is out of contact. If `tilted` is empty, no tilt was solved, and `change` is
    returned.
    """
    if not tilted:
        return change
    at_smaller_tilt, at_larger_tilt = tilted

    def change_in_scene(cause: Cause, sign: float) -> Floats:
        if cause.name != POSE:
            return change(cause, sign)
        tilted_result = at_smaller_tilt if sign < 0.0 else at_larger_tilt
        pose_change = tilted_result / value - 1.0
        return np.asarray(pose_change if math.isfinite(pose_change) else LIFTED)

    return change_in_scene


def _tilted_NL(tilted: SensorResponse) -> float:
    """Return NL at mid-range [1] of a tilted press at full travel.

    The press was solved at three moduli of the curve: nearly 0, half of E_max, and E_max.
    """
    fractions_of_E_max = (0.0, 0.5, 1.0)
    return curve_nonlinearity(tilted.P[:, -1].tolist(), fractions_of_E_max, "mid-range")


def budget_of(numerical: float, causes: Iterable[Cause], change: Change) -> UncertaintyBudget:
    """Return the error budget of a result, given its `numerical` error [1].

    `change` computes the relative change of the result due to a cause. Causes whose change is below `ROUND_OFF` are
    left out. The effects of the model may act together, so their sizes add. Inputs are independent, so their squares
    add.
    """
    model: list[Contribution] = []
    inputs: list[Contribution] = []
    for cause in causes:
        size = float(size_of(cause, change))
        if abs(size) >= ROUND_OFF:
            contributions = inputs if cause.scatters else model
            contributions.append(Contribution(effect=cause.name, size=size, reason=cause.reason, advice=cause.advice))
    return UncertaintyBudget(
        numerical=numerical,
        model=tuple(model),
        inputs=tuple(inputs),
        model_total=sum(abs(effect.size) for effect in model),
        inputs_total=math.hypot(*(effect.size for effect in inputs)),
    )


def total_errors(numerical: Floats, causes: Iterable[Cause], change: Change) -> Floats:
    """Return the total relative errors [1] of an array of results, in the shape of `numerical`.

    Each total is defined as in `UncertaintyBudget`: it is the numerical error, plus the sum of the model effects, plus
    the root sum of squares of the inputs. `numerical` holds the numerical errors [1]. `change` returns the relative
    changes of the results due to a cause, in the same shape.
    """
    model_sum = np.zeros_like(numerical)
    input_squares = np.zeros_like(numerical)
    for cause in causes:
        size = size_of(cause, change)
        if cause.scatters:
            input_squares = input_squares + size**2
        else:
            model_sum = model_sum + np.abs(size)
    return numerical + model_sum + np.sqrt(input_squares)


def size_of(cause: Cause, change: Change) -> Floats:
    """Return the relative change of results due to a cause [1], in the shape of the results.

    `change` computes the change for a cause and a factor on its size. An effect of the model acts in one direction and
    keeps its sign. An input scatters in both directions, so its effect has no sign. The effect of an input is half the
    difference of the changes in the two directions, except for height offsets.
    """
    up = change(cause, 1.0)
    if not cause.scatters:
        return up
    down = change(cause, -1.0)
    # A height offset changes the results much more in one direction than in the other, so the larger change is used.
    is_one_sided = (cause.height_offsets != 0.0).any(axis=0)  # the rows of the offsets belong to the tips
    return np.where(is_one_sided, np.maximum(np.abs(up), np.abs(down)), 0.5 * np.abs(up - down))
