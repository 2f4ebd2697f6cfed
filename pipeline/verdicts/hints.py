"""One sentence for each verdict that did not pass, from its own numbers: what would make it pass. Nothing is solved."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

from pipeline.options import RunOptions
from pipeline.springs.fitted_springs import FittedSprings
from pipeline.verdicts.rules import tolerance_hint
from sensor.design.parameters import Design
from sensor.tips.shapes import OPTIONAL_KEYS
from sensor.verdict import Verdict
from sensor.words import rounded

Hint = Callable[[Verdict, Design, FittedSprings], str | None]

SEARCH = "`pipeline suggest` searches the nearest design that passes"
CONTACT_SIZES = "`--fruit-stiffness contact` sizes the springs for the true contact"
LEAST_OVER_HEIGHT_ERROR = 5.0  # travel over how far apart tips of a printed part may stand: less reads the print
_WITHIN = 0.98  # of a bound, so that rounding and error bars keep it


def with_hints(
    verdicts: Iterable[Verdict], design: Design, springs: FittedSprings, options: RunOptions
) -> tuple[Verdict, ...]:
    """Return verdicts, those that did not pass with their hint as `remedy`."""
    hinted = []
    for verdict in verdicts:
        if verdict.passed is not True:
            verdict = replace(verdict, remedy=hint(verdict, design, springs, options))
        hinted.append(verdict)
    return tuple(hinted)


def hint(verdict: Verdict, design: Design, springs: FittedSprings, options: RunOptions) -> str:
    """Return the hint for a verdict that did not pass: one sentence on what would make it pass."""
    if springs.monolithic:  # glued pins bring errors that no finer mesh removes
        tolerance = tolerance_hint(verdict, options.tolerance)
        if tolerance is not None:
            return tolerance
    if options.fruit_stiffness == "hayes" and verdict.name in ("P_max", "NL"):
        return CONTACT_SIZES
    rule = HINTS.get(verdict.name, SEARCH)
    if isinstance(rule, str):
        return rule
    return rule(verdict, design, springs) or SEARCH


def least_travel(design: Design) -> float:
    """Return the travel [mm] under which the heights of tips as made, not the fruit, would decide a reading."""
    return LEAST_OVER_HEIGHT_ERROR * design.process.accuracy_mm


def shorter_travel(verdict: Verdict, design: Design, springs: FittedSprings) -> float | None:
    """Return the travel [mm] at which a verdict on strain, clearance or pressure passes.

    None for any other verdict, for one that passes at the travel of the design, and where no travel is long enough to
    be read.
    """
    travel = design.press.travel_mm
    bound = travel
    if isinstance(verdict.limit, int | float) and verdict.value is not None:
        if verdict.name == "bruise" and verdict.value > 0.0:
            fraction = verdict.limit / (verdict.value + (verdict.error or 0.0))
            bound = travel * fraction ** (1.0 / design.tips.tip_shape.pressure_exponent)
        elif verdict.name in CLEARANCES:  # which shrink by as much as the travel grows
            missing = verdict.limit - verdict.value
            bound = travel - missing
    for spring in springs.springs:
        strain = spring.root_strain
        if spring.printable.name == verdict.name and strain is not None:  # proportional to the travel
            bound = travel * spring.printable.strain_limit / (strain.value + strain.error)
    if bound >= travel:  # what failed does not depend on the travel, as the length of a leaf
        return None
    shorter = rounded(_WITHIN * bound, towards=0.0)
    return shorter if least_travel(design) <= shorter < travel else None


def _less_travel(verdict: Verdict, design: Design, springs: FittedSprings) -> str | None:
    travel = shorter_travel(verdict, design, springs)
    return None if travel is None else f"would pass with less travel: `--set press.travel_mm={travel:g}`"


def _as_sized(verdict: Verdict, design: Design, springs: FittedSprings) -> str | None:
    """Return a hint that leads back to the springs, and the level flat tips, for which the law meets the targets."""
    if springs.housing is None and not springs.ideal:
        return "the springs were not made: see printable.low and printable.high"
    if design.springs.given and design.tips.tip_layout.takes_targets:
        return "leave the springs to the targets: `--set springs.K_l_N_per_m= --set springs.K_h_N_per_m=`"
    return _level_flat_tips(verdict, design, springs)


def _level_flat_tips(_verdict: Verdict, design: Design, _springs: FittedSprings) -> str | None:
    """Return a hint that leads back to a level press of sharp flat tips on a flat fruit, on which P is one number."""
    press = design.press
    tips = design.tips
    if press.tilt_deg != 0.0 or press.roll_deg != 0.0:
        return "press level: `--set press.tilt_deg=0 --set press.roll_deg=0`"
    # The shape first: without its fillet a shape that is not flat stays one.
    if not tips.tip_shape.has_flat_face:
        keys = [key for key in OPTIONAL_KEYS if getattr(tips, key) is not None]
        unset = "".join(f" --set tips.{key}=" for key in keys)
        return f"take flat tips: `--set tips.shape=cube{unset}`"
    if tips.fillet_mm != 0.0:
        return "take sharp edges: `--set tips.fillet_mm=0`"
    if design.fruit.shape != "block":
        return "take smaller tips, under which the fruit is flatter: `tips.side_mm`"
    return None


def _not_made(verdict: Verdict, _design: Design, _springs: FittedSprings) -> str | None:
    if verdict.value is not None:
        return None
    return "make both springs printable first: see printable.low and printable.high"


def _more_travel(verdict: Verdict, design: Design, _springs: FittedSprings) -> str | None:
    """Return the hint with the travel of which all tips touch over a small enough fraction; None without a number."""
    if verdict.value is None or not isinstance(verdict.limit, float):
        return None
    travel = design.press.travel_mm
    least = (verdict.value + (verdict.error or 0.0)) * travel / (_WITHIN * verdict.limit)
    return f"would pass with more travel: `--set press.travel_mm={rounded(least, towards=math.inf):g}`"


def _steadier(_verdict: Verdict, design: Design, _springs: FittedSprings) -> str:
    if design.reading is None:
        return "press with less speed or hold for less time: `press.speed_mm_per_s`, `press.hold_s`"
    return (
        "read at the moment that moves least, press with less speed or hold for less time: `reading.at_s`, "
        "`press.speed_mm_per_s`, `press.hold_s`"
    )


CLEARANCES = (
    "geometry.frame_clearance",
    "geometry.neck_clearance",
    "geometry.cover_over_fruit",
    "geometry.mount_over_fruit",
)
HINTS: Mapping[str, Hint | str] = {
    "P_max": _as_sized,
    "NL": _as_sized,
    "P_displacement_independent": _level_flat_tips,
    "P_monotonic": _level_flat_tips,
    "K_l": _not_made,
    "K_h": _not_made,
    "geometry.made": _not_made,
    "printable.low": _less_travel,
    "printable.high": _less_travel,
    "bruise": _less_travel,
    **dict.fromkeys(CLEARANCES, _less_travel),
    "reading.touch": _more_travel,
    "reading.relaxation": _steadier,
}
"""The hint of each verdict, or what computes it; a verdict that is not listed, or gets None, is left to the search."""
