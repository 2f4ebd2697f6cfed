"""A fruit that is read by several presses: one modulus, and its uncertainty from their scatter.

A press cannot detect what is local, such as a soft spot below one tip or an uneven skin. Turn the sensor between
presses so that low tips stand where high ones stood (`Layout.turn_deg`). A soft spot then shifts the readings in
opposite directions.

The modulus is the Hodges-Lehmann estimate of ln E (`press_core.middle_of`). It needs no scale, so firmware computes the
same one. The standard deviation s between n presses has n - 1 degrees of freedom. The deviation v that the presses
themselves state has a relative error of about one half, equal to two degrees of freedom (JCGM 100:2008, G.4.2). Pooled,
they are (2 v^2 + (n - 1) s^2) / (n + 1), with Student's factor for n + 1. If the presses disagree, v is wrong, and only
s with its n - 1 degrees of freedom is used. Errors that all presses share are added; more presses do not reduce them.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from instrument.press import press_core
from instrument.press.fruit_reading import (
    FruitReading,
    causes_of_modulus,
    firmness_data,
    firmness_text,
)
from instrument.press.measuring import MeasuringUnit
from sensor.quantity import COVERAGE, Estimate, report_field
from sensor.theory.student import student
from sensor.words import with_bar

FALSE_ALARMS = 0.01
"""Share of fruits flagged as disagreeing although the errors of their presses are normal and as large as stated."""
PRIOR_FREEDOM = 2
"""Degrees of freedom of the error that a press states: half of the inverse square of its relative error, 0.5."""
LEAST_OWN = 0.01
"""Least standard deviation of ln E between presses, a judgement."""
OWN_ROWS = 8  # number of moduli in the table for firmware

PRESS_AGAIN = {
    "presses_disagree": "press this place again in a pair, {turn}; where pairs disagree too, the fruit is uneven there",
    "few_presses": "press again, {turn}",
}
"""Advice for a flag of a fruit, by the way the sensor is turned; the first flag that applies is used."""
TURN = {
    True: "the second press turned by {turn:g} degrees",
    False: "the second press one spacing farther along the tips",
}
"""How to exchange low and high tips between two presses, by whether turning the sensor does it."""


@dataclass(frozen=True, kw_only=True)
class FruitAnswer:
    """The answer for one fruit from several presses: E [MPa] and its half width `u` [1], both None without a modulus.

    `alike` and `scatter` are fractions [1]. Each field is a key of the answer.
    """

    fruit: str = report_field("", "the fruit, by its column or by its number", line=lambda it: f"fruit {it.fruit}")
    presses: tuple[FruitReading, ...] = report_field(
        "",
        "its presses, each with the keys of a press",
        line=lambda it: f"{it.counted} of {len(it.presses)} presses",
    )
    counted: int = report_field("1", "number of presses that count in E; a much less certain press does not")
    turn: float | None = report_field(
        "deg",
        "angle by which to turn the sensor between presses. Low tips then stand where high ones stood, and a soft spot "
        "moves the readings apart; null for a line, which is moved by its spacing instead",
        key="turned_deg",
    )
    E: float | None = report_field(
        "MPa",
        "the middle of the moduli of its presses",
        key="E_MPa",
        default=None,
        line=lambda it: f"E {with_bar(it.E, it.u * it.E, 'MPa', in_percent=True)} (95 %)",
        absent="no modulus",
    )
    reduced: float | None = report_field("MPa", "as for a press", key="E_over_1_minus_nu2_MPa", default=None)
    u: float | None = report_field(
        "%", "half width that holds the true E in 95 of 100 fruits", key="u_percent", times=100.0, default=None
    )
    alike: float | None = report_field(
        "%",
        "the part of `u_percent` that may be the same in all presses, which no number of presses lowers",
        key="u_alike_percent",
        times=100.0,
        default=None,
        line=lambda it: f"of which common to all presses {100.0 * it.alike:.2g} %",
    )
    scatter: float | None = report_field(
        "%",
        "standard deviation of E from press to press; null for one press",
        key="scatter_percent",
        times=100.0,
        default=None,
        line=lambda it: f"scatter {100.0 * it.scatter:.2g} %",
    )
    ripeness: str | None = report_field(
        "", "as for a press", key="class", default=None, line=lambda it: f"class {it.ripeness}"
    )
    firmness: Estimate | None = report_field(
        "N or MPa, %",
        "as for a press",
        key="`firmness_N` or `firmness_MPa`, `firmness_u_percent`",
        inline=lambda it: firmness_data(it.firmness),
        left_out=True,
        default=None,
        line=lambda it: firmness_text(it.firmness),
    )
    flags: tuple[str, ...] = report_field(
        "",
        "flags of the fruit and of its presses, each a reason to doubt the answer",
        default=(),
        line=lambda it: f"flags: {', '.join(it.flags)}",
    )
    hint: str | None = report_field(
        "", "what to do about it", left_out=True, default=None, line=lambda it: f"hint: {it.hint}"
    )


FRUIT_LINE = ("fruit", "presses", "E", "alike", "scatter", "firmness", "ripeness", "flags", "hint")
"""The fields of a fruit in their order on the screen."""


def chi_square_limit(presses: int) -> float:
    """Return the sum of squares that agreeing presses of a fruit exceed with probability `FALSE_ALARMS` [1]."""
    from scipy.special import chdtri  # slow to import, and a single press does not need it

    return float(chdtri(presses - 1, FALSE_ALARMS))


def own_constants(sensor: MeasuringUnit) -> dict[str, list[float]]:
    """Return the constants `own_logs` and `own_deviations` of `press_core.Unit`.

    They are the deviations of ln E that differ between presses of a fruit, without noise. Their causes are uneven skin
    and flesh, the pose, and the zeros and times of a press of the design.
    """
    least, largest = sensor.range_MPa
    moduli = np.geomspace(least, max(largest, 1.01 * least), OWN_ROWS)
    rows = sensor.report.moduli
    deviations = []
    for E in moduli.tolist():
        of_press = list(sensor.by_uneven(E))
        for source in ("pose", "zero_drift", "times") if rows else ():
            of_press.append(sensor.between_moduli(E, [row.sources.get(f"{source}_percent", 0.0) for row in rows]))
        deviations.append(max(math.hypot(*of_press), LEAST_OWN))
    return {"own_logs": np.log(moduli).tolist(), "own_deviations": deviations}


def fruits_of(
    sensor: MeasuringUnit, readings: Iterable[FruitReading], presses: int, *, named: bool = False
) -> Iterator[FruitAnswer]:
    """Yield one answer for each group of `presses` readings, or with `named` for each fruit.

    A group is complete after `presses` readings. With 0, all readings belong to one fruit.
    """
    number = 0
    row: list[FruitReading] = []
    for reading in readings:
        if named and row and reading.fruit != row[0].fruit:
            yield fruit_answer(sensor, row, row[0].fruit)
            row = []
        row.append(reading)
        if len(row) == presses:
            number += 1
            yield fruit_answer(sensor, row, str(number), presses)
            row = []
    if row:
        yield fruit_answer(sensor, row, row[0].fruit if named else str(number + 1), presses)


def fruit_answer(sensor: MeasuringUnit, presses: Sequence[FruitReading], name: str, asked: int = 0) -> FruitAnswer:
    """Return the answer for one fruit from its presses.

    `asked` is the number of presses that the answer requires, 0 for at least two.
    """
    read = [press for press in presses if press.E is not None]
    own = _own_deviations(sensor, read)
    that_count = press_core.that_count(own) if read else []
    counted = [read[press] for press in that_count]
    turn = sensor.report.design.tips.tip_layout.turn_deg
    causes = {"few_presses": len(counted) < (asked or 2)}
    answer = FruitAnswer(fruit=name, presses=tuple(presses), counted=len(counted), turn=turn)
    if counted:
        logs = [math.log(press.E) for press in counted if press.E is not None]
        E = math.exp(press_core.middle_of(logs))
        parts = [press.parts.widened_to(press.u) for press in counted if press.parts and press.u is not None]
        u = parts[0].of_one_press
        alike = _mean_square([part.that_may_be_alike for part in parts])
        bend = math.fsum(part.bend for part in parts) / len(parts)
        scatter = None
        if len(counted) > 1:
            scatter = press_core.scatter_of(logs)
            # A press may be less certain than firmware knows, for instance if the times of its channels are unknown.
            by_parts = [part.that_may_differ / COVERAGE for part in parts]
            allowed = list(map(max, by_parts, [own[press] for press in that_count]))
            disagree = causes["presses_disagree"] = press_core.disagree(logs, allowed, chi_square_limit(len(logs)))
            said = _mean_square([part.of_press / COVERAGE for part in parts])
            u = math.hypot(_by_scatter(scatter, said, len(logs), disagree=disagree), alike) + bend
        causes |= causes_of_modulus(sensor, E, u)
        answer = replace(
            answer,
            E=E,
            reduced=sensor.reduced(E),
            u=u,
            alike=alike + bend,
            scatter=scatter,
            ripeness=None if sensor.classes is None else sensor.classes.class_of(E),
            firmness=None if sensor.unit.scale is None else sensor.unit.scale.firmness_of(E),
        )
    of_fruit = [flag for flag, holds in causes.items() if holds]
    # A press outside of the range or of the scale does not flag a fruit that is inside.
    of_presses = dict.fromkeys(flag for press in presses for flag in press.flags if flag not in causes)
    again = next((told for flag, told in PRESS_AGAIN.items() if flag in of_fruit), None)
    hint = None if again is None else again.format(turn=TURN[turn is not None].format(turn=turn))
    return replace(answer, flags=(*of_fruit, *of_presses), hint=hint)


def _own_deviations(sensor: MeasuringUnit, read: Sequence[FruitReading]) -> list[float]:
    """Return the standard deviations of ln E between presses [1] as firmware computes them, from noise and design.

    Unknown noise is taken as 0.
    """
    table = own_constants(sensor)
    logs, own = table["own_logs"], table["own_deviations"]
    return [
        press_core.own_deviation(logs, own, press.E, (press.noise or 0.0) / COVERAGE)
        for press in read
        if press.E is not None
    ]


def _mean_square(values: Sequence[float]) -> float:
    return math.sqrt(math.fsum(value**2 for value in values) / len(values))


def _by_scatter(scatter: float, said: float, presses: int, *, disagree: bool) -> float:
    """Return the half width [1] of the middle of presses, from their scatter [1].

    `said` is the standard deviation that the presses themselves state; it is pooled as `PRIOR_FREEDOM` additional
    presses. If the presses disagree, the scatter is used without it, if that gives a larger half width.
    """
    freedom = presses - 1
    both = freedom + PRIOR_FREEDOM
    deviation = math.sqrt((PRIOR_FREEDOM * said**2 + freedom * scatter**2) / both)
    half = student(both) * deviation
    if disagree:
        half = max(half, student(freedom) * scatter)
    return half / math.sqrt(presses)
