"""The force ratio of a level sensor whose springs, fruit or tips are a little off: what every share is made from."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from pipeline.verdicts.errors.cause import Cause, Sensor

FELT = 1e-6  # a smaller move is scaled up to this, its answer down again: round-off would drown it
NO_CAUSE = Cause(effect="", reason="")
LIFTED = 1.0  # of the ratio: the share of a cause that takes a tip off the fruit


@dataclass(frozen=True, kw_only=True)
class Pressed:
    """A modulus of the fruit [MPa] and a travel of the sensor [mm]."""

    E: float
    travel: float


def moved_ratio(sensor: Sensor, at: Pressed, cause: Cause, times: float) -> float:
    """Return P [1] with a multiple of the changes of a cause; nan where that takes a tip off the fruit.

    From (C + S / E) F = travel + lead, times E: the fruit under each tip has the stiffness 1 / (s_ii - crosstalk).
    """
    K, S, across = sensor.own.springs.stiffnesses, sensor.contact.S, sensor.contact.crosstalk
    own = [
        at.E / (K[i] * (1.0 + times * cause.springs[i]))
        + (float(S[i, i]) - across) / (1.0 + times * cause.fruit[i])
        + across
        for i in range(len(K))
    ]
    travel = [at.travel + times * lead for lead in cause.lead]
    forces = own[1] * travel[0] - across * travel[1], own[0] * travel[1] - across * travel[0]
    return forces[1] / forces[0] if min(forces) > 0.0 else math.nan


def change_of_ratio(sensor: Sensor, at: Pressed, still: float, cause: Cause, sign: float) -> float:
    """Return the relative change of P by a cause with a sign [1], from P where nothing moves it."""
    factor = _magnified(cause, at.travel)
    moved = moved_ratio(sensor, at, cause, sign * factor)
    return (moved / still - 1.0) / factor if math.isfinite(moved) else sign * LIFTED


def change_of_nonlinearity(sensor: Sensor, at: Sequence[Pressed], causes: Sequence[Cause], sign: float) -> float:
    """Return the change of NL by a cause with a sign [1]: of the share of its rise that P has made at one place, (7).

    `at` are the place of NL and that of P_max; the cause may act otherwise at each. The softest fruit leaves P as it
    is but for the leads of the tips.
    """
    factor = max(_magnified(cause, pressed.travel) for cause, pressed in zip(causes, at, strict=True))
    shares = []
    for times in (0.0, sign * factor):
        softest = moved_ratio(sensor, Pressed(E=0.0, travel=at[1].travel), causes[1], times)
        middle, top = (moved_ratio(sensor, pressed, cause, times) for pressed, cause in zip(at, causes, strict=True))
        shares.append((middle - softest) / (top - softest))
    change = (shares[1] - shares[0]) / factor
    return change if math.isfinite(change) else sign * LIFTED


def _magnified(cause: Cause, travel: float) -> float:
    largest = max(map(abs, (*cause.springs, *cause.fruit, *(lead / travel for lead in cause.lead))))
    return max(1.0, FELT / largest) if largest > 0.0 else 1.0
