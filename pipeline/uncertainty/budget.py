"""What each error bar is made of: the numerical error, what the model leaves out, what is not known of the inputs.

The three shares are those of ASME V&V 20. A verdict asks whether the design meets its targets in the model, so it uses
the numerical error alone, which a finer mesh decides. No mesh takes away the model's share or the scatter of a process:
calibrating the printed unit does.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from cad.design.parameters import Design
from cad.quantity import Estimate
from pipeline.stages.sizing import SpringSizing
from pipeline.stages.springs import FittedSprings
from pipeline.stages.verdict_rules import Characteristic
from pipeline.stages.verdicts import characteristic
from pipeline.uncertainty.causes import BEAM_SLOPES, Cause, Moved, flesh_causes, print_causes, spring_causes
from solve.contact.linear_response import SensorResponse
from solve.fruit.compliance import FruitCompliance

FELT = 1e-6  # a smaller move is scaled up to this, its answer down again: round-off would drown it


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
        if not (0.0 < self.numerical < math.inf and self.model and self.input):
            msg = (
                f"numerical error = {100.0 * self.numerical:g} %, {len(self.model)} effects, {len(self.input)} inputs: "
                "must be greater than 0 and at least one of each; complete the budget"
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


@dataclass(frozen=True, kw_only=True)
class Budgets:
    """The budget of each number; `contact` is that of s11 - s12. Springs that are not made have none."""

    K_l: UncertaintyBudget | None
    K_h: UncertaintyBudget | None
    P_max: UncertaintyBudget
    NL: UncertaintyBudget
    contact: UncertaintyBudget


def uncertainty_budgets(
    design: Design,
    contact: FruitCompliance,
    sizing: SpringSizing,
    springs: FittedSprings,
    table: SensorResponse,
    slopes: Sequence[float] = BEAM_SLOPES,
) -> Budgets:
    """Return the budget of every number; `slopes` are those of ln K over ln t of the leaves of each spring [1].

    The response of the scene tells how far its own force ratio lies from that of a level sensor. Raises ValueError
    where a share is empty or a size is not a number.
    """
    own = characteristic(contact, sizing, springs.stiffnesses, springs.errors)
    left_out = (*spring_causes(design, sizing, springs, own, slopes), *flesh_causes(design, own))
    causes = _Causes(left_out, print_causes(design, springs, slopes))
    P_max, NL = own.P_max(), own.NL(design.targets)
    of_P = _budget(P_max.relative, causes, lambda cause, sign: _change_of_P(own, cause, sign) / P_max.value)
    return Budgets(
        K_l=_spring_budget(springs.springs[0].K, causes, 0),
        K_h=_spring_budget(springs.springs[1].K, causes, 1),
        P_max=_with_scene(of_P, P_max.value, table),
        NL=_budget(NL.relative, causes, lambda cause, sign: _change_of_NL(own, design, cause, sign) / NL.value),
        contact=_budget(contact.error_pair, causes.only(of_springs=False), _change_of_compliance),
    )


@dataclass(frozen=True)
class _Causes:
    """What the model leaves out, and what is not known of the inputs."""

    model: tuple[Cause, ...]
    input: tuple[Cause, ...]

    def only(self, *, of_springs: bool) -> "_Causes":
        """Return the causes that move the springs, or those that move the fruit."""
        kept = (tuple(c for c in causes if c.of_springs is of_springs) for causes in (self.model, self.input))
        return _Causes(*kept)


def _spring_budget(K: Estimate | None, causes: _Causes, spring: int) -> UncertaintyBudget | None:
    if K is None:
        return None
    return _budget(K.relative, causes.only(of_springs=True), lambda cause, sign: sign * cause.most[spring])


def _budget(numerical: float, causes: _Causes, change: Callable[[Cause, float], float]) -> UncertaintyBudget:
    """Return the budget of a number from its relative change by a cause with a sign; inputs go either way."""

    def half_range(cause: Cause) -> float:
        return 0.5 * abs(change(cause, 1.0) - change(cause, -1.0))

    return UncertaintyBudget(
        numerical=numerical,
        model=tuple(Contribution(effect=c.effect, size=change(c, 1.0), reason=c.reason) for c in causes.model),
        input=tuple(Contribution(effect=c.effect, size=half_range(c), reason=c.reason) for c in causes.input),
    )


def _change_of_compliance(cause: Cause, sign: float) -> float:
    """Return the relative change of s11 - s12, the reciprocal of the fruit's stiffness [1]."""
    return -sign * cause.most[2] / (1.0 + sign * cause.most[2])


def _change_of_P(own: Characteristic, cause: Cause, sign: float) -> float:
    """Return the change of P_max by a cause [1]."""
    factor = _magnified(cause)
    still, moved = (
        _rise(own, own.K_m_max, cause.at_largest, 0.0),
        _rise(own, own.K_m_max, cause.at_largest, sign * factor),
    )
    return (moved - still) / factor


def _change_of_NL(own: Characteristic, design: Design, cause: Cause, sign: float) -> float:
    """Return the change of NL by a cause [1]: of the share of its rise that P has made at one place, (7)."""
    factor = _magnified(cause)
    middle = own.K_m_of_NL(design.targets)
    shares = []
    for times in (0.0, sign * factor):
        top = _rise(own, own.K_m_max, cause.at_largest, times)
        shares.append(_rise(own, middle, cause.at_middle, times) / top)
    return (shares[1] - shares[0]) / factor


def _magnified(cause: Cause) -> float:
    return max(1.0, FELT / max(map(abs, cause.most)))


def _rise(own: Characteristic, K_m: float, moved: Moved, times: float) -> float:
    """Return P - P(0) at a fruit stiffness [N/mm] with all stiffnesses moved by a multiple of their changes."""
    factors = [1.0 + times * change for change in moved]
    return own.force_ratio_with(K_m, factors[:2], factors[2:]) - own.stiffness_ratio


def _with_scene(P_max: UncertaintyBudget, level: float, table: SensorResponse) -> UncertaintyBudget:
    """Return the budget with what curved fruit, tilt and the tips' shape do to P at full travel, where they act."""
    last = float(table.P[-1, -1])
    if not table.cells or not math.isfinite(last) or last == level:
        return P_max
    reason = f"the scene's own response at {table.E[-1]:g} MPa and full travel is {last:.4g}"
    return replace(
        P_max, model=(*P_max.model, Contribution(effect="shape and pose", size=last / level - 1.0, reason=reason))
    )
