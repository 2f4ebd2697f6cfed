"""What each error bar is made of: the numerical error, what the model leaves out, what is not known of the inputs.

The three shares are those of ASME V&V 20. A verdict asks whether the design meets its targets in the model, so it uses
the numerical error alone, which a finer mesh decides. No mesh takes away the model's share or the scatter of a process:
calibrating the printed unit does.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from cad.quantity import Estimate
from pipeline.stages.response import ScenePress
from pipeline.uncertainty.cause import Cause, Sensor
from pipeline.uncertainty.causes import calibrated_causes, input_causes, model_causes
from pipeline.uncertainty.force_ratio import (
    LIFTED,
    Pressed,
    change_of_nonlinearity,
    change_of_ratio,
)
from pipeline.verdicts.scene_targets import SceneTargets
from solve.contact.linear_response import SensorResponse

Change = Callable[[int, float], float]


@dataclass(frozen=True, kw_only=True)
class Contribution:
    """One share of an error: what acts, by how much of the number it moves it [1], and why by this much."""

    effect: str
    size: float
    reason: str

    def __post_init__(self) -> None:
        """Refuse a contribution without a name, a size or a reason: something would be left out unsaid."""
        if not (math.isfinite(self.size) and self.size != 0.0 and self.effect and self.reason):
            msg = (
                f"effect {self.effect!r} = {100.0 * self.size:g} %, reason {self.reason!r}: must have a name, a finite "
                "size other than 0 and a reason; compute it"
            )
            raise ValueError(msg)


@dataclass(frozen=True, kw_only=True)
class UncertaintyBudget:
    """The error of one number by its sources, every share relative to the number [1]."""

    numerical: float
    model: tuple[Contribution, ...]
    input: tuple[Contribution, ...]

    def __post_init__(self) -> None:
        """Refuse a number without an error bar, or with nothing said of the model or of the inputs."""
        if not (0.0 <= self.numerical < math.inf and self.model and self.input):
            msg = (
                f"numerical error = {100.0 * self.numerical:g} %, {len(self.model)} effects, {len(self.input)} inputs: "
                "must be finite and at least one of each; complete the budget"
            )
            raise ValueError(msg)

    @property
    def model_total(self) -> float:
        """Return the model's share [1]: its effects act together, so their sizes add."""
        return sum(abs(one.size) for one in self.model)

    @property
    def input_total(self) -> float:
        """Return the inputs' share [1], two sigma: they scatter apart, so their squares add."""
        return math.hypot(*(one.size for one in self.input))

    @property
    def total(self) -> float:
        """Return the whole error [1]: of the mesh, of the model and of the inputs."""
        return self.numerical + self.model_total + self.input_total


@dataclass(frozen=True, kw_only=True)
class Budgets:
    """The budget of each number; `contact` is that of s11 - s12.

    Springs that are not made have none, nor have P_max and NL of a scene in which a tip is off the fruit.
    """

    K_l: UncertaintyBudget | None
    K_h: UncertaintyBudget | None
    P_max: UncertaintyBudget | None
    NL: UncertaintyBudget | None
    contact: UncertaintyBudget


def uncertainty_budgets(sensor: Sensor, reached: SceneTargets, press: ScenePress) -> Budgets:
    """Return the budget of every number; raises ValueError where a size is not a number.

    Shares of P_max and NL are those of a level sensor; that of the pose is the scene's own where cells are solved.
    """
    of_P = None if reached.P_max is None else ratio_budget(sensor, _full(sensor), reached.P_max.relative)
    of_NL = None if reached.NL is None else _nonlinearity_budget(sensor, reached.NL)
    if press.tilted:
        of_P, of_NL = _with_scene_pose(of_P, of_NL, reached, press)
    return Budgets(
        K_l=_spring_budget(sensor, 0),
        K_h=_spring_budget(sensor, 1),
        P_max=of_P,
        NL=of_NL,
        contact=_contact_budget(sensor),
    )


def ratio_budget(sensor: Sensor, at: Pressed, numerical: float, *, calibrated: bool = False) -> UncertaintyBudget:
    """Return the budget of P at a modulus and a travel, as printed or after calibrating the unit."""
    gives = sensor.gives(at.E * sensor.contact.K_m_over_E(), at.travel)
    model, inputs = model_causes(sensor, at.travel, gives), input_causes(sensor, at.travel, gives)
    if calibrated:
        model = tuple(cause for cause in model if not cause.calibrated)
        inputs = calibrated_causes(inputs)

    def change(causes: Sequence[Cause]) -> Change:
        return lambda i, sign: change_of_ratio(sensor, at, causes[i], sign)

    return _budget(numerical, (model, inputs), (change(model), change(inputs)))


def _full(sensor: Sensor) -> Pressed:
    return Pressed(E=sensor.design.fruit.E_max_MPa, travel=sensor.design.press.travel_mm)


def _nonlinearity_budget(sensor: Sensor, NL: Estimate) -> UncertaintyBudget:
    """Return the budget of NL, whose causes act at its own place and at that of P_max."""
    own, full = sensor.own, _full(sensor)
    K_m = own.K_m_of_NL(sensor.design.targets)
    at = Pressed(E=full.E * K_m / own.K_m_max, travel=full.travel), full
    gives = [sensor.gives(stiffness, full.travel) for stiffness in (K_m, own.K_m_max)]
    model, inputs = (
        list(zip(*(of(sensor, full.travel, give) for give in gives), strict=True))
        for of in (model_causes, input_causes)
    )
    scale = abs(NL.value) or 1.0

    def change(pairs: Sequence[tuple[Cause, ...]]) -> Change:
        return lambda i, sign: change_of_nonlinearity(sensor, at, pairs[i], sign) / scale

    causes = [pair[1] for pair in model], [pair[1] for pair in inputs]
    return _budget(NL.relative, causes, (change(model), change(inputs)))


def _spring_budget(sensor: Sensor, spring: int) -> UncertaintyBudget | None:
    K = sensor.springs.springs[spring].K
    if K is None:
        return None
    travel, gives = sensor.design.press.travel_mm, sensor.largest_gives
    model, inputs = (
        [cause for cause in of(sensor, travel, gives) if any(cause.springs)] for of in (model_causes, input_causes)
    )

    def change(causes: Sequence[Cause]) -> Change:
        return lambda i, sign: sign * causes[i].springs[spring]

    return _budget(K.relative, (model, inputs), (change(model), change(inputs)))


def _contact_budget(sensor: Sensor) -> UncertaintyBudget:
    """Return the budget of s11 - s12, the reciprocal of the fruit's stiffness, at full travel between rigid springs."""
    travel, gives = sensor.design.press.travel_mm, (0.0, 0.0)
    model, inputs = (
        [cause for cause in of(sensor, travel, gives) if any(cause.fruit)] for of in (model_causes, input_causes)
    )

    def change(causes: Sequence[Cause]) -> Change:
        return lambda i, sign: 1.0 / (1.0 + sign * causes[i].fruit[0]) - 1.0

    return _budget(sensor.contact.error_pair, (model, inputs), (change(model), change(inputs)))


def _budget(
    numerical: float, causes: tuple[Sequence[Cause], Sequence[Cause]], changes: tuple[Change, Change]
) -> UncertaintyBudget:
    """Return the budget of a number from its relative change by each cause with a sign; inputs go either way."""
    model, inputs = causes

    def spread(i: int) -> float:
        up, down = changes[1](i, 1.0), changes[1](i, -1.0)
        # A lead of one tip acts far more to one side than to the other: the larger side counts.
        return max(abs(up), abs(down)) if any(inputs[i].lead) else 0.5 * abs(up - down)

    left_out = [(cause, changes[0](i, 1.0)) for i, cause in enumerate(model)]
    unknown = [(cause, spread(i)) for i, cause in enumerate(inputs)]
    return UncertaintyBudget(
        numerical=numerical, model=tuple(_contributions(left_out)), input=tuple(_contributions(unknown))
    )


def _contributions(sizes: Sequence[tuple[Cause, float]]) -> Iterator[Contribution]:
    """Yield the contribution of each cause that moves the number."""
    for cause, size in sizes:
        if size != 0.0:
            yield Contribution(effect=cause.effect, size=size, reason=cause.reason)


def _with_scene_pose(
    of_P: UncertaintyBudget | None, of_NL: UncertaintyBudget | None, reached: SceneTargets, press: ScenePress
) -> tuple[UncertaintyBudget | None, UncertaintyBudget | None]:
    """Return the budgets with what the tilt's spread does in this scene, where a level sensor's share stood."""
    scene = reached.P_max, reached.NL
    numbers = [(float(one.P[-1, -1]), _middle_share(one)) for one in press.tilted]
    budgets = []
    for place, budget in enumerate((of_P, of_NL)):
        value = scene[place]
        if budget is None or value is None:
            budgets.append(budget)
            continue
        moves = [abs(number[place] / value.value - 1.0) for number in numbers]
        size = max(move if math.isfinite(move) else LIFTED for move in moves)
        share = [replace(one, size=size) if one.effect == "pose" else one for one in budget.input]
        budgets.append(replace(budget, input=tuple(share)))
    return budgets[0], budgets[1]


def _middle_share(response: SensorResponse) -> float:
    """Return the departure of P in the middle of the range from its straight line [1]; nan where a tip is off."""
    softest, middle, top = (float(P) for P in response.P[:, -1])
    return (middle - softest) / (top - softest) - 0.5
