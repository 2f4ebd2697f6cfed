"""Read one fruit from several presses: its modulus, and the uncertainty from the scatter between the presses.

A single press cannot detect local effects, such as a soft spot below one tip or an uneven skin. Turn the sensor between
presses so that the low tips touch where the high tips touched before (`Layout.turn_deg`). A soft spot then shifts the
two readings in opposite directions.

The modulus is the Hodges-Lehmann estimate of ln E (`press_core.hodges_lehmann`), which needs no estimate of the scatter
and is therefore also computed by the firmware. The standard deviation s between n presses has n - 1 degrees of freedom.
The standard deviation v that the presses themselves state has a relative error of about one half, which corresponds to
two degrees of freedom (JCGM 100:2008, G.4.2). The pooled variance is (2 v^2 + (n - 1) s^2) / (n + 1), with Student's
factor for n + 1 degrees of freedom. If the presses disagree, v is too small. The half width is then at least the value
that follows only from s, with n - 1 degrees of freedom. Errors that all presses share are added, because more presses
do not reduce them.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from instrument.press import press_core
from instrument.press.fruit_reading import (
    FruitReading,
    causes_of_modulus,
    firmness_data,
    firmness_text,
)
from instrument.press.half_width import HalfWidth
from instrument.press.measuring import MeasuringUnit
from sensor.quantity import COVERAGE, Estimate, report_field
from sensor.theory.student import student_quantile
from sensor.words import value_with_bar

FALSE_ALARMS = 0.01
"""Probability that `presses_disagree` is set although the errors are normally distributed and as large as stated."""
PRIOR_FREEDOM = 2
"""Degrees of freedom of the standard deviation that a press states: 1 / (2 * 0.5^2), for a relative error of 0.5."""
MIN_PRESS_DEVIATION = 0.01
"""Smallest standard deviation of ln E between presses; an estimate from experience."""
TABLE_ROWS = 8  # number of moduli in the table for the firmware

PRESS_AGAIN = {
    "presses_disagree": "press this place again in a pair, {turn}; where pairs disagree too, the fruit is uneven there",
    "few_presses": "press again, {turn}",
}
"""Advice for flags of a fruit, most important flag first; `{turn}` is replaced by how to place the second press."""
TURN = {
    True: "the second press turned by {turn:g} degrees",
    False: "the second press one spacing farther along the tips",
}
"""How the low and high tips change places between two presses: by turning the sensor (True) or moving it (False)."""


@dataclass(frozen=True, kw_only=True)
class FruitAnswer:
    """The reading of one fruit from several presses: E [MPa] and its half width `u` [1], both None without a modulus.

    `shared` and `scatter` are fractions of E [1]. Each field is a key of the JSON answer.
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
        line=lambda it: f"E {value_with_bar(it.E, it.u * it.E, 'MPa', in_percent=True)} (95 %)",
        absent="no modulus",
    )
    reduced: float | None = report_field("MPa", "as for a press", key="E_over_1_minus_nu2_MPa", default=None)
    u: float | None = report_field(
        "%", "half width that holds the true E in 95 of 100 fruits", key="u_percent", times=100.0, default=None
    )
    shared: float | None = report_field(
        "%",
        "the part of `u_percent` that may be the same in all presses, which no number of presses lowers",
        key="u_alike_percent",
        times=100.0,
        default=None,
        line=lambda it: f"of which common to all presses {100.0 * it.shared:.2g} %",
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


FRUIT_LINE = ("fruit", "presses", "E", "shared", "scatter", "firmness", "ripeness", "flags", "hint")
"""The fields of a fruit in their order on the screen."""


def chi_square_limit(presses: int) -> float:
    """Return the limit of chi-squared [1] that consistent presses of a fruit exceed with probability `FALSE_ALARMS`.

    Chi-squared has one degree of freedom less than there are `presses`, because their mean is estimated.
    """
    from scipy.special import chdtri  # SciPy is slow to import, and a single press does not need it

    return float(chdtri(presses - 1, FALSE_ALARMS))


def press_deviation_constants(sensor: MeasuringUnit) -> dict[str, list[float]]:
    """Return the table of errors that presses of a fruit do not share, for the firmware and for `fruit_answer`.

    The dict has two keys. `own_logs` are the logarithms of moduli [MPa] over the range of the design, and
    `own_deviations` are the standard deviations of ln E between presses at these moduli, without noise. They are due to
    uneven skin and flesh, the pose, zero errors, and sampling times.
    """
    softest, firmest = sensor.range_MPa
    # A design may have only one modulus; 1.01 keeps the logarithms distinct.
    moduli = np.geomspace(softest, max(firmest, 1.01 * softest), TABLE_ROWS)
    rows = sensor.report.moduli  # one row per modulus of the error analysis; empty if the design has none
    varying_sources = ("pose", "zero_drift", "times") if rows else ()
    deviations = []
    for E in moduli.tolist():
        contributions = list(sensor.unevenness_deviations(E))
        for source in varying_sources:
            percent = [row.sources.get(f"{source}_percent", 0.0) for row in rows]
            contributions.append(sensor.interpolate_percent(E, percent))
        deviations.append(max(math.hypot(*contributions), MIN_PRESS_DEVIATION))
    return {"own_logs": np.log(moduli).tolist(), "own_deviations": deviations}


def fruit_answers(
    sensor: MeasuringUnit, readings: Iterable[FruitReading], presses: int, *, named: bool = False
) -> Iterator[FruitAnswer]:
    """Yield one answer per fruit from consecutive readings.

    A fruit ends after `presses` readings; if `presses` is 0, it may have any number of them. With `named`, a fruit also
    ends where the fruit's name in the readings changes. A fruit that ends there, or with the last reading, keeps that
    name in its answer. All other answers have a running number, which begins with 1.
    """
    complete_fruits = 0  # number of fruits that ended because all their presses were read
    fruit_readings: list[FruitReading] = []
    for reading in readings:
        if named and fruit_readings and reading.fruit != fruit_readings[0].fruit:
            yield fruit_answer(sensor, fruit_readings, fruit_readings[0].fruit)
            fruit_readings = []
        fruit_readings.append(reading)
        if len(fruit_readings) == presses:
            complete_fruits += 1
            yield fruit_answer(sensor, fruit_readings, str(complete_fruits), presses)
            fruit_readings = []
    if fruit_readings:  # the last fruit, which ends with the readings
        last_name = fruit_readings[0].fruit if named else str(complete_fruits + 1)
        yield fruit_answer(sensor, fruit_readings, last_name, presses)


def fruit_answer(sensor: MeasuringUnit, presses: Sequence[FruitReading], name: str, required: int = 0) -> FruitAnswer:
    """Return the answer for the fruit `name` from its presses.

    The modulus is the Hodges-Lehmann estimate from all presses, except those whose standard deviation is more than
    twice the smallest one. The half width follows from the scatter of the presses, the errors that they state, and the
    errors that they share. If no press has a modulus, the answer has none. The flag `few_presses` is set if fewer than
    `required` presses are used; if `required` is 0, at least two are required.
    """
    presses_with_modulus = [press for press in presses if press.E is not None]
    unshared_deviations = _unshared_deviations(sensor, presses_with_modulus)
    used_indices = press_core.counted_presses(unshared_deviations) if presses_with_modulus else []
    used_presses = [presses_with_modulus[index] for index in used_indices]
    turn = sensor.report.design.tips.tip_layout.turn_deg  # None if the layout is moved instead of turned
    causes = {"few_presses": len(used_presses) < (required or 2)}  # maps each flag to whether it applies
    answer = FruitAnswer(fruit=name, presses=tuple(presses), counted=len(used_presses), turn=turn)
    if used_presses:
        used_deviations = [unshared_deviations[index] for index in used_indices]
        answer, modulus_causes = _add_modulus(sensor, answer, used_presses, used_deviations)
        causes |= modulus_causes
    fruit_flags = [flag for flag, applies in causes.items() if applies]
    # Flags that depend on the modulus are evaluated for the fruit, so the same flags of its presses are left out.
    press_flags = dict.fromkeys(flag for press in presses for flag in press.flags if flag not in causes)
    return replace(answer, flags=(*fruit_flags, *press_flags), hint=_hint_of(fruit_flags, turn))


def _hint_of(fruit_flags: Sequence[str], turn: float | None) -> str | None:
    """Return the advice for the most important flag of a fruit, or None if no flag has advice.

    `turn` [deg] is the angle between two presses, or None if the sensor is moved instead.
    """
    advice = next((text for flag, text in PRESS_AGAIN.items() if flag in fruit_flags), None)
    second_press = TURN[turn is not None].format(turn=turn)  # how to place the second press
    return None if advice is None else advice.format(turn=second_press)


def _add_modulus(
    sensor: MeasuringUnit, answer: FruitAnswer, presses: Sequence[FruitReading], unshared_deviations: Sequence[float]
) -> tuple[FruitAnswer, dict[str, bool]]:
    """Return a copy of the answer with the modulus of some presses, and its flags.

    The flags are the keys of a dict, whose values state whether they apply. All of the `presses` have a modulus.
    `unshared_deviations` holds one standard deviation of ln E per press [1], without the errors that all presses share.
    """
    # The conditions below hold for all presses. They only narrow the types.
    ln_moduli = [math.log(press.E) for press in presses if press.E is not None]
    E = math.exp(press_core.hodges_lehmann(ln_moduli))
    # The half width of a press may be larger than its parts imply, for instance after an uneven pace.
    parts = [press.parts.with_total(press.u) for press in presses if press.parts and press.u is not None]
    error = _combine_half_widths(ln_moduli, parts, unshared_deviations)
    answer_with_modulus = replace(
        answer,
        E=E,
        reduced=sensor.reduced(E),
        u=error.u,
        shared=error.shared,
        scatter=error.scatter,
        ripeness=sensor.ripeness_of(E),
        firmness=sensor.firmness_of(E),
    )
    return answer_with_modulus, {"presses_disagree": error.disagree, **causes_of_modulus(sensor, E, error.u)}


class _FruitError(NamedTuple):
    """The error of a modulus from one or more presses.

    `u` is the half width of E [1], and `shared` is its part that may be the same in all presses [1]. `scatter` is the
    standard deviation of ln E between the presses [1], or None for one press. `disagree` states whether the presses
    differ by more than their errors allow.
    """

    u: float
    shared: float
    scatter: float | None
    disagree: bool


def _combine_half_widths(
    ln_moduli: Sequence[float], parts: Sequence[HalfWidth], unshared_deviations: Sequence[float]
) -> _FruitError:
    """Return the error of the modulus that follows from several presses.

    The arguments are as in `_presses_disagree`. A single press keeps its own half width.
    """
    shared = _root_mean_square([part.largest_shared for part in parts])
    bend = math.fsum(part.bend for part in parts) / len(parts)
    if len(ln_moduli) == 1:
        return _FruitError(u=parts[0].total, shared=shared + bend, scatter=None, disagree=False)
    scatter = press_core.standard_deviation(list(ln_moduli))
    disagree = _presses_disagree(ln_moduli, parts, unshared_deviations)
    independent = _half_width_by_scatter(scatter, parts, disagree=disagree)
    # More presses do not reduce shared errors. The bend is not a random error, so it is added linearly.
    u = math.hypot(independent, shared) + bend
    return _FruitError(u=u, shared=shared + bend, scatter=scatter, disagree=disagree)


def _presses_disagree(
    ln_moduli: Sequence[float], parts: Sequence[HalfWidth], unshared_deviations: Sequence[float]
) -> bool:
    """Return whether the moduli of presses differ by more than their errors allow.

    The arguments hold one value per press: ln E, the parts of its half width, and the standard deviation of ln E that
    the firmware uses [1]. The last one does not include all errors of a press, for instance if its sampling times are
    unknown. So the error that a press states is used if it is larger.
    """
    stated_deviations = [part.largest_independent / COVERAGE for part in parts]
    deviations = list(map(max, stated_deviations, unshared_deviations))
    return press_core.are_inconsistent(list(ln_moduli), deviations, chi_square_limit(len(ln_moduli)))


def _unshared_deviations(sensor: MeasuringUnit, presses: Sequence[FruitReading]) -> list[float]:
    """Return for each press with a modulus the standard deviation of ln E due to errors that presses do not share [1].

    As in the firmware, it is computed from the noise of the press and from the design. Unknown noise is taken as 0.
    """
    table = press_deviation_constants(sensor)
    logs, deviations = table["own_logs"], table["own_deviations"]
    return [
        press_core.unshared_deviation(logs, deviations, press.E, (press.noise or 0.0) / COVERAGE)
        for press in presses
        if press.E is not None
    ]


def _root_mean_square(values: Sequence[float]) -> float:
    """Return the root mean square of some values."""
    return math.sqrt(math.fsum(value**2 for value in values) / len(values))


def _half_width_by_scatter(scatter: float, parts: Sequence[HalfWidth], *, disagree: bool) -> float:
    """Return the half width at 95 % [1] of the mean of several presses, whose standard deviation is `scatter` [1].

    `parts` holds the half width that each press itself states. The standard deviation that follows from them has
    `PRIOR_FREEDOM` degrees of freedom, and is pooled with the scatter. If the presses `disagree`, the stated value is
    too small. The half width is then at least the value that follows only from the scatter. The module docstring gives
    the formula and its source.
    """
    presses = len(parts)
    prior = _root_mean_square([part.independent / COVERAGE for part in parts])  # stated standard deviation [1]
    freedom = presses - 1  # degrees of freedom of the scatter
    pooled_freedom = freedom + PRIOR_FREEDOM
    deviation = math.sqrt((PRIOR_FREEDOM * prior**2 + freedom * scatter**2) / pooled_freedom)
    half_width = student_quantile(pooled_freedom) * deviation
    if disagree:
        half_width = max(half_width, student_quantile(freedom) * scatter)
    return half_width / math.sqrt(presses)
