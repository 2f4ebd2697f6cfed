"""Hints: for each verdict that did not pass, one sentence on what to change. No solver is needed."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from string import Formatter

from pipeline.options import TOLERANCES, RunOptions
from pipeline.springs.fitted_springs import FittedSprings
from sensor.design.bench import Bench
from sensor.design.parameters import Design
from sensor.tips.shapes import OPTIONAL_KEYS
from sensor.verdict import Verdict
from sensor.words import rounded

SEARCH = "`pipeline suggest` searches the nearest design that passes"
CONTACT_SIZES = "`--fruit-stiffness contact` sizes the springs for the true contact"
UNDECIDED = "the error bar is too wide to decide"
# Minimum travel divided by the height error of printed tips. With less travel, a reading would depend on the print.
LEAST_OVER_HEIGHT_ERROR = 5.0
_MARGIN = 0.98  # factor on a bound, so that a rounded value and its error bar stay within it


def with_hints(
    verdicts: Iterable[Verdict], design: Design, springs: FittedSprings, options: RunOptions
) -> tuple[Verdict, ...]:
    """Return the verdicts, with a hint in the field `remedy` of each verdict that did not pass."""
    with_remedies = []
    for verdict in verdicts:
        if verdict.passed is not True:
            verdict = replace(verdict, remedy=hint(verdict, design, springs, options))
        with_remedies.append(verdict)
    return tuple(with_remedies)


@dataclass(frozen=True, kw_only=True)
class _HintContext:
    """A verdict that did not pass, and the design, springs and options that its hint depends on."""

    verdict: Verdict
    design: Design
    springs: FittedSprings
    options: RunOptions


def hint(verdict: Verdict, design: Design, springs: FittedSprings, options: RunOptions) -> str:
    """Return the hint for a verdict that did not pass: one sentence on how it could pass.

    A verdict that is undecided because of its error bar gets advice on the tolerance of the run. Otherwise, the
    template of the sentence is the `hint` of the verdict in `sensor/verdicts.toml`. A name in braces in the template is
    a key of `PARTS`, and the function there returns the text for this place. If the function has no advice, or if there
    is no template, the hint suggests a search.
    """
    # Without glued pins, a finer mesh reduces the error bar. No mesh reduces the error that glued pins cause.
    if springs.monolithic:
        finer_mesh_hint = tolerance_hint(verdict, options.tolerance)
        if finer_mesh_hint is not None:
            return finer_mesh_hint
    row = verdict.row
    template = row.hint
    if verdict.value is None and row.hint_without_value:
        template = row.hint_without_value
    context = _HintContext(verdict=verdict, design=design, springs=springs, options=options)
    sentence = ""
    # The parser yields each text with the name in braces after it. There is no name after the last text.
    for text, part_name, *_ in Formatter().parse(template):
        part = PARTS[part_name](context) if part_name else ""
        if part is None:
            return SEARCH
        sentence += text + part
    return sentence or SEARCH


def tolerance_hint(verdict: Verdict, run_tolerance: float) -> str | None:
    """Return the hint for a verdict that is undecided because of its error bar, or None for any other verdict.

    The hint recommends a tolerance of the run, `--tol`, that would decide the verdict, or states that there is none.
    `run_tolerance` [1] is the present relative tolerance of the run.
    """
    limit = verdict.limit
    tolerance = verdict.tolerance
    error = verdict.error
    is_decided = verdict.passed is not None
    if is_decided or error is None or not isinstance(limit, float) or not isinstance(tolerance, float):
        return None
    scale = abs(limit) or 1.0  # a limit of 0 cannot be a scale
    relative_error = error / scale
    # With an error bar wider than the tolerance, the verdict is undecided.
    largest_error = tolerance if verdict.relative else tolerance / scale
    if relative_error <= largest_error:
        return None
    # The error is a sum of this number of errors, each of which may be as large as the tolerance of a run.
    error_parts = verdict.row.error_parts
    # If the error exceeds this sum, no mesh met the tolerance of the run, and a smaller tolerance does not help.
    if largest_error > 0.0 and relative_error <= error_parts * run_tolerance:
        tighter_tolerance = rounded(largest_error / error_parts, 1, towards=0.0)
        if tighter_tolerance < run_tolerance and TOLERANCES.hold(tighter_tolerance):
            return f"{UNDECIDED}; `--tol {tighter_tolerance:g}` narrows it enough"
    return f"{UNDECIDED}, and no `--tol` narrows it enough"


def least_travel(design: Design) -> float:
    """Return the minimum travel [mm] at which a reading depends on the fruit, not on the height error of the tips."""
    return LEAST_OVER_HEIGHT_ERROR * design.process.accuracy_mm


def find_shorter_travel(verdict: Verdict, design: Design, springs: FittedSprings) -> float | None:
    """Return a shorter travel [mm] at which a verdict on a strain, a clearance or a pressure would pass.

    The result is None for any other verdict, if a shorter travel does not help, or if it would be too short for a
    reading.
    """
    travel = design.press.travel_mm
    largest_travel = _largest_passing_travel(verdict, design, springs)
    if largest_travel >= travel:  # the failure does not depend on the travel, for example if a leaf is too short
        return None
    shorter = rounded(_MARGIN * largest_travel, towards=0.0)
    return shorter if least_travel(design) <= shorter < travel else None


def _largest_passing_travel(verdict: Verdict, design: Design, springs: FittedSprings) -> float:
    """Return the largest travel [mm] at which a failed verdict would pass, or the travel of the design if unknown.

    `by_travel` of the verdict states how its value depends on the travel. A strain is proportional to the travel, and a
    pressure to a power of it. A clearance ("distance") decreases by as much as the travel increases.
    """
    travel = design.press.travel_mm
    by_travel = verdict.row.by_travel
    if by_travel == "strain":
        for kind, spring in springs.springs.items():  # finds the spring that the verdict is about
            printable = springs.printable[kind]
            if printable.name == verdict.name and spring.highest_strain > 0.0:
                return travel * printable.strain_limit / spring.highest_strain
    if not isinstance(verdict.limit, int | float) or verdict.value is None:
        return travel
    if by_travel == "pressure" and verdict.value > 0.0:
        upper_end = verdict.value + (verdict.error or 0.0)  # the end of the error bar
        pressure_ratio = verdict.limit / upper_end
        travel_ratio: float = pressure_ratio ** (1.0 / design.tips.tip_shape.pressure_exponent)
        return travel * travel_ratio
    if by_travel == "distance":
        deficit = verdict.limit - verdict.value
        return travel - deficit
    return travel


def _shorter_travel_text(context: _HintContext) -> str | None:
    """Return a shorter travel [mm], as text, at which the verdict passes, or None if there is none."""
    travel = find_shorter_travel(context.verdict, context.design, context.springs)
    return None if travel is None else f"{travel:g}"


def _longer_travel_text(context: _HintContext) -> str | None:
    """Return a travel [mm], as text, at which the verdict on the last touch passes, or None without a value.

    The value of this verdict is the travel at the last touch divided by the whole travel, which must be at most the
    limit.
    """
    verdict = context.verdict
    if verdict.value is None or not isinstance(verdict.limit, float):
        return None
    travel = context.design.press.travel_mm
    shortest = (verdict.value + (verdict.error or 0.0)) * travel / (_MARGIN * verdict.limit)
    return f"{rounded(shortest, towards=math.inf):g}"


def _sized_springs_clause(context: _HintContext) -> str | None:
    """Return a clause on how to get springs with the sized stiffnesses, or else how to get a level press of flat tips.

    The targets presuppose such springs and such a press. The result is None if the design has both.
    """
    design, springs = context.design, context.springs
    if context.options.fruit_stiffness == "hayes":
        return CONTACT_SIZES
    if springs.housing is None and not springs.ideal:
        return "the springs were not made: see printable.low and printable.high"
    if design.springs.given and design.tips.tip_layout.takes_targets:
        return "leave the springs to the targets: `--set springs.K_l_N_per_m= --set springs.K_h_N_per_m=`"
    return _level_flat_clause(context)


def _level_flat_clause(context: _HintContext) -> str | None:
    """Return a clause on how to get a level press of sharp flat tips on flat fruit, in which P does not vary.

    The clause is about the first property of the design that differs from such a press. If no property differs, the
    result is None.
    """
    press = context.design.press
    tips = context.design.tips
    if press.tilt_deg != 0.0 or press.roll_deg != 0.0:
        return "press level: `--set press.tilt_deg=0 --set press.roll_deg=0`"
    # The shape comes first, because a tip of another shape is not flat even without a fillet.
    if not tips.tip_shape.has_flat_face:
        keys = [key for key in OPTIONAL_KEYS if getattr(tips, key) is not None]
        unset = "".join(f" --set tips.{key}=" for key in keys)
        return f"take flat tips: `--set tips.shape=cube{unset}`"
    if tips.fillet_mm != 0.0:
        return "take sharp edges: `--set tips.fillet_mm=0`"
    if context.design.fruit.shape != "block":
        return "take smaller tips, under which the fruit is flatter: `tips.side_mm`"
    return None


def _finer_bench_clause(context: _HintContext) -> str | None:
    """Return a clause with the resolution of the balance or dial at which the verdict passes, and an alternative.

    All errors caused by a bench, except noise, are proportional to its resolution. The reference text of the verdict,
    written by `calibration_verdict`, states the main cause of the error. The result is None if this cause is noise, or
    if the value of the verdict is missing or 0.
    """
    verdict = context.verdict
    bench = context.design.bench or Bench()
    if not isinstance(verdict.limit, float) or not verdict.value:
        return None
    factor = _MARGIN * verdict.limit / verdict.value  # ratio of the passing resolution to the present one
    causes = (
        ("by the balance", "bench.balance_g", bench.balance_g, "a stiffer spring"),
        ("by the dial", "bench.dial_mm", bench.dial_mm, "a longer travel"),
    )
    for cause, key, resolution, alternative in causes:
        if cause in verdict.reference:
            finer = rounded(factor * resolution, 1, towards=0.0)
            return f"would pass with a finer one, `--set {key}={finer:g}`, or with {alternative}"
    return None


def _steadier_press_clause(context: _HintContext) -> str:
    """Return a clause on a press in which the flesh relaxes less; for readings, also on the best time of a reading."""
    if context.design.reading is None:
        return "press with less speed or hold for less time: `press.speed_mm_per_s`, `press.hold_s`"
    return (
        "read at the moment that moves least, press with less speed or hold for less time: `reading.at_s`, "
        "`press.speed_mm_per_s`, `press.hold_s`"
    )


PARTS: Mapping[str, Callable[[_HintContext], str | None]] = {
    "less_travel": _shorter_travel_text,
    "more_travel": _longer_travel_text,
    "as_sized": _sized_springs_clause,
    "level_flat_tips": _level_flat_clause,
    "steadier": _steadier_press_clause,
    "finer_bench": _finer_bench_clause,
}
"""Functions for the names in braces in `sensor/verdicts.toml`. A function returns None if it does not apply."""
