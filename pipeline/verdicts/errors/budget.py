"""What each error bar is made of: the numerical error, what the model leaves out, what is not known of the inputs.

The three shares are those of ASME V&V 20. A verdict asks whether the design meets its targets in the model, so it uses
the numerical error alone, which a finer mesh decides. No mesh takes away the model's share or the scatter of a process:
calibrating the printed unit does.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from cad.quantity import Estimate
from pipeline.response.scene_press import ScenePress
from pipeline.verdicts.errors.cause import Cause, Sensor
from pipeline.verdicts.errors.causes import Causes, causes_of
from pipeline.verdicts.errors.force_ratio import (
    LIFTED,
    NO_CAUSE,
    Pressed,
    change_of_nonlinearity,
    change_of_ratio,
    moved_ratio,
)
from pipeline.verdicts.scene_targets import SceneTargets
from solve.contact.linear_response import SensorResponse

Change = Callable[[Cause, float], float]


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

    Springs that are not made have none, nor have P_max and NL of a scene in which a tip is off the fruit or of a sensor
    that reads no force ratio. Domes touch by a part that grows: no s11 - s12 is theirs.
    """

    K_l: UncertaintyBudget | None
    K_h: UncertaintyBudget | None
    P_max: UncertaintyBudget | None
    NL: UncertaintyBudget | None
    contact: UncertaintyBudget | None

    @property
    def widest_spring(self) -> float:
        """Return the larger share by which the inputs leave a spring unknown [1], two sigma; 0 where none is made."""
        return max((one.input_total for one in (self.K_l, self.K_h) if one is not None), default=0.0)


def uncertainty_budgets(sensor: Sensor, reached: SceneTargets, press: ScenePress) -> Budgets:
    """Return the budget of every number; raises ValueError where a size is not a number.

    Shares of P_max and NL are those of a level sensor; that of the pose is the scene's own where cells are solved.
    """
    reads = sensor.design.reading is not None
    of_P = None if reads or reached.P_max is None else _largest_ratio_budget(sensor, reached.P_max)
    of_NL = None if reads or reached.NL is None else _nonlinearity_budget(sensor, reached.NL)
    if press.tilted:
        of_P, of_NL = _with_scene_pose(of_P, of_NL, reached, press)
    return Budgets(
        K_l=_spring_budget(sensor, 0),
        K_h=_spring_budget(sensor, 1),
        P_max=of_P,
        NL=of_NL,
        contact=None if sensor.design.tips.tip_shape.obeys_hertz else _contact_budget(sensor),
    )


def ratio_budget(sensor: Sensor, at: Pressed, numerical: float, causes: Causes) -> UncertaintyBudget:
    """Return the budget of P at a modulus and a travel by causes that act there."""
    still = moved_ratio(sensor, at, NO_CAUSE, 0.0)

    def change(cause: Cause, sign: float) -> float:
        return change_of_ratio(sensor, at, still, cause, sign)

    return _budget(numerical, causes, change)


def causes_at(sensor: Sensor, at: Pressed) -> Causes:
    """Return what moves the force ratio of a level sensor at a modulus and a travel."""
    return causes_of(sensor, at.travel, sensor.gives(at.E * sensor.contact.K_m_over_E(), at.travel))


def _largest_ratio_budget(sensor: Sensor, P_max: Estimate) -> UncertaintyBudget:
    full = _full(sensor)
    return ratio_budget(sensor, full, P_max.relative, causes_at(sensor, full))


def _full(sensor: Sensor) -> Pressed:
    return Pressed(E=sensor.design.fruit.E_max_MPa, travel=sensor.design.press.travel_mm)


def _nonlinearity_budget(sensor: Sensor, NL: Estimate) -> UncertaintyBudget:
    """Return the budget of NL, whose causes act at its own place and at that of P_max."""
    own, full = sensor.own, _full(sensor)
    K_m = own.K_m_of_NL(sensor.design.nominal_targets)
    at = Pressed(E=full.E * K_m / own.K_m_max, travel=full.travel), full
    there, top = (causes_of(sensor, full.travel, sensor.gives(each, full.travel)) for each in (K_m, own.K_m_max))
    middle = {cause.effect: cause for cause in (*there.model, *there.input)}
    scale = abs(NL.value) or 1.0

    def change(cause: Cause, sign: float) -> float:
        return change_of_nonlinearity(sensor, at, (middle[cause.effect], cause), sign) / scale

    return _budget(NL.relative, top, change)


def _spring_budget(sensor: Sensor, spring: int) -> UncertaintyBudget | None:
    K = sensor.springs.springs[spring].K
    if K is None:
        return None

    def change(cause: Cause, sign: float) -> float:
        return sign * cause.springs[spring]

    causes = causes_of(sensor, sensor.design.press.travel_mm, sensor.largest_gives)
    return _budget(K.relative, causes.that_move("springs"), change)


def _contact_budget(sensor: Sensor) -> UncertaintyBudget:
    """Return the budget of s11 - s12, the reciprocal of the fruit's stiffness, at full travel between rigid springs."""

    def change(cause: Cause, sign: float) -> float:
        return 1.0 / (1.0 + sign * cause.fruit[0]) - 1.0

    causes = causes_of(sensor, sensor.design.press.travel_mm, (0.0, 0.0))
    return _budget(sensor.contact.error_pair, causes.that_move("fruit"), change)


def _budget(numerical: float, causes: Causes, change: Change) -> UncertaintyBudget:
    """Return the budget of a number from its relative change by each cause with a sign; inputs go either way."""

    def spread(cause: Cause) -> float:
        up, down = change(cause, 1.0), change(cause, -1.0)
        # A lead of one tip acts far more to one side than to the other: the larger side counts.
        return max(abs(up), abs(down)) if any(cause.lead) else 0.5 * abs(up - down)

    left_out = [(cause, change(cause, 1.0)) for cause in causes.model]
    unknown = [(cause, spread(cause)) for cause in causes.input]
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
