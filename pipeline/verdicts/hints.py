"""Hints: one sentence for each verdict that did not pass, from its own numbers. Nothing is solved."""

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
UNDECIDED = "undecided by its error bar"
# minimum travel relative to the height error of printed tips; with less, a reading would show the print
LEAST_OVER_HEIGHT_ERROR = 5.0
_MARGIN = 0.98  # factor on a bound, so that rounding and error bars stay within it


def with_hints(
    verdicts: Iterable[Verdict], design: Design, springs: FittedSprings, options: RunOptions
) -> tuple[Verdict, ...]:
    """Return the verdicts, with a hint as `remedy` for each that did not pass."""
    hinted = []
    for verdict in verdicts:
        if verdict.passed is not True:
            verdict = replace(verdict, remedy=hint(verdict, design, springs, options))
        hinted.append(verdict)
    return tuple(hinted)


@dataclass(frozen=True, kw_only=True)
class _Missed:
    """A verdict that did not pass, with the design, springs and options on which its hint depends."""

    verdict: Verdict
    design: Design
    springs: FittedSprings
    options: RunOptions


def hint(verdict: Verdict, design: Design, springs: FittedSprings, options: RunOptions) -> str:
    """Return the hint for a verdict that did not pass: one sentence on what would make it pass.

    It is the `hint` of the verdict's row, filled with the numbers and clauses that it names in braces. If one of them
    does not apply, it refers to the search.
    """
    if springs.monolithic:  # glued pins cause errors that no finer mesh removes
        tolerance = tolerance_hint(verdict, options.tolerance)
        if tolerance is not None:
            return tolerance
    row = verdict.row
    template = (row.hint_without_value if verdict.value is None else "") or row.hint
    missed = _Missed(verdict=verdict, design=design, springs=springs, options=options)
    words = ""
    for text, part, *_ in Formatter().parse(template):
        found = PARTS[part](missed) if part else ""
        if found is None:
            return SEARCH
        words += text + found
    return words or SEARCH


def tolerance_hint(verdict: Verdict, run_tolerance: float) -> str | None:
    """Return a hint for a verdict that is undecided by its error bar: the `--tol` that would decide it, if any.

    `run_tolerance` [1] is the relative tolerance of the run. The result is None for any other verdict.
    """
    limit = verdict.limit
    tolerance = verdict.tolerance
    error = verdict.error
    if verdict.passed is not None or error is None or not isinstance(limit, float) or not isinstance(tolerance, float):
        return None
    scale = abs(limit) or 1.0  # a limit of 0 gives no scale
    relative_error = error / scale
    allowed = tolerance if verdict.relative else tolerance / scale
    if relative_error <= allowed:
        return None
    # An error above the sum allowed at the run's tolerance was met by no mesh, so a smaller tolerance does not help.
    parts = verdict.row.error_parts
    if allowed > 0.0 and relative_error <= parts * run_tolerance:
        tighter = rounded(allowed / parts, 1, towards=0.0)
        if tighter < run_tolerance and TOLERANCES.hold(tighter):
            return f"{UNDECIDED}, `--tol {tighter:g}` would decide"
    return f"{UNDECIDED}, no `--tol` would decide"


def least_travel(design: Design) -> float:
    """Return the minimum travel [mm] at which the fruit, and not the height error of the tips, decides a reading."""
    return LEAST_OVER_HEIGHT_ERROR * design.process.accuracy_mm


def shorter_travel(verdict: Verdict, design: Design, springs: FittedSprings) -> float | None:
    """Return the travel [mm] at which a verdict on strain, clearance or pressure passes.

    None for any other verdict, and for one that passes at the travel of the design. None also if the travel would be
    too short for a reading.
    """
    travel = design.press.travel_mm
    bound = travel
    if isinstance(verdict.limit, int | float) and verdict.value is not None:
        if verdict.row.by_travel == "pressure" and verdict.value > 0.0:
            fraction = verdict.limit / (verdict.value + (verdict.error or 0.0))
            bound = travel * fraction ** (1.0 / design.tips.tip_shape.pressure_exponent)
        elif verdict.row.by_travel == "distance":  # it decreases by as much as the travel increases
            missing = verdict.limit - verdict.value
            bound = travel - missing
    for kind, spring in springs.springs.items() if verdict.row.by_travel == "strain" else ():
        printable = springs.printable[kind]
        if printable.name == verdict.name and spring.highest_strain > 0.0:  # the strain is proportional to the travel
            bound = travel * printable.strain_limit / spring.highest_strain
    if bound >= travel:  # the failure does not depend on the travel, for instance the length of a leaf
        return None
    shorter = rounded(_MARGIN * bound, towards=0.0)
    return shorter if least_travel(design) <= shorter < travel else None


def _less_travel(missed: _Missed) -> str | None:
    """Return the shorter travel [mm] at which the verdict passes, as text; None if there is none."""
    travel = shorter_travel(missed.verdict, missed.design, missed.springs)
    return None if travel is None else f"{travel:g}"


def _more_travel(missed: _Missed) -> str | None:
    """Return the longer travel [mm] of which all tips touch within the limit, as text; None without a number."""
    verdict = missed.verdict
    if verdict.value is None or not isinstance(verdict.limit, float):
        return None
    travel = missed.design.press.travel_mm
    least = (verdict.value + (verdict.error or 0.0)) * travel / (_MARGIN * verdict.limit)
    return f"{rounded(least, towards=math.inf):g}"


def _as_sized(missed: _Missed) -> str | None:
    """Return a clause that leads back to sized springs and level flat tips, for which the law meets the targets."""
    design, springs = missed.design, missed.springs
    if missed.options.fruit_stiffness == "hayes":
        return CONTACT_SIZES
    if springs.housing is None and not springs.ideal:
        return "the springs were not made: see printable.low and printable.high"
    if design.springs.given and design.tips.tip_layout.takes_targets:
        return "leave the springs to the targets: `--set springs.K_l_N_per_m= --set springs.K_h_N_per_m=`"
    return _level_flat_tips(missed)


def _level_flat_tips(missed: _Missed) -> str | None:
    """Return a clause that leads back to a level press of sharp flat tips on flat fruit, where P is one number."""
    press = missed.design.press
    tips = missed.design.tips
    if press.tilt_deg != 0.0 or press.roll_deg != 0.0:
        return "press level: `--set press.tilt_deg=0 --set press.roll_deg=0`"
    # The shape comes first: removing the fillet does not make a non-flat shape flat.
    if not tips.tip_shape.has_flat_face:
        keys = [key for key in OPTIONAL_KEYS if getattr(tips, key) is not None]
        unset = "".join(f" --set tips.{key}=" for key in keys)
        return f"take flat tips: `--set tips.shape=cube{unset}`"
    if tips.fillet_mm != 0.0:
        return "take sharp edges: `--set tips.fillet_mm=0`"
    if missed.design.fruit.shape != "block":
        return "take smaller tips, under which the fruit is flatter: `tips.side_mm`"
    return None


def _finer_bench(missed: _Missed) -> str | None:
    """Return a clause that names the balance or the dial with which the verdict passes, and an alternative.

    All errors due to a bench, except noise, are proportional to its resolution.
    """
    verdict = missed.verdict
    bench = missed.design.bench or Bench()
    if not isinstance(verdict.limit, float) or not verdict.value:
        return None
    finer = _MARGIN * verdict.limit / verdict.value
    clauses = {
        "by the balance": (f"bench.balance_g={rounded(finer * bench.balance_g, 1, towards=0.0):g}", "a stiffer spring"),
        "by the dial": (f"bench.dial_mm={rounded(finer * bench.dial_mm, 1, towards=0.0):g}", "a longer travel"),
    }
    for cause, (setting, other) in clauses.items():
        if cause in verdict.reference:
            return f"would pass with a finer one, `--set {setting}`, or with {other}"
    return None


def _steadier(missed: _Missed) -> str:
    """Return a clause on a press, and with readings also a moment, in which flesh relaxes less."""
    if missed.design.reading is None:
        return "press with less speed or hold for less time: `press.speed_mm_per_s`, `press.hold_s`"
    return (
        "read at the moment that moves least, press with less speed or hold for less time: `reading.at_s`, "
        "`press.speed_mm_per_s`, `press.hold_s`"
    )


PARTS: Mapping[str, Callable[[_Missed], str | None]] = {
    "less_travel": _less_travel,
    "more_travel": _more_travel,
    "as_sized": _as_sized,
    "level_flat_tips": _level_flat_tips,
    "steadier": _steadier,
    "finer_bench": _finer_bench,
}
"""Functions for the braces in hints of `sensor/verdicts.toml`: numbers and clauses, None if one does not apply."""
