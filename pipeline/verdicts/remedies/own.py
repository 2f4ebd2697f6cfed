"""Remedies that follow from a verdict's own numbers: a finer solve, a shorter travel, a wider face."""

from cad.design.parameters import Design
from cad.verdict import Verdict
from pipeline.options import RunOptions
from pipeline.springs.fitted_springs import FittedSprings
from pipeline.verdicts.remedies.changes import rounded
from pipeline.verdicts.rules import tolerance_remedy

_CLEARANCES = (
    "geometry.frame_clearance",
    "geometry.neck_clearance",
    "geometry.cover_over_fruit",
    "geometry.mount_over_fruit",
)
_WITHIN = 0.98  # of a bound, so that rounding and error bars keep it


def own_remedy(verdict: Verdict, design: Design, springs: FittedSprings, options: RunOptions) -> str | None:
    """Return the remedy that a verdict's own numbers give, None where there is none."""
    if springs.monolithic:
        advice = tolerance_remedy(verdict, options.tolerance)
        if advice is not None:
            return advice
    travel = own_travel(verdict, design, springs)
    if travel is not None:
        return f"passes with press.travel_mm at most {travel:g}: --set press.travel_mm={travel:g}"
    return None


def own_travel(verdict: Verdict, design: Design, springs: FittedSprings) -> float | None:
    """Return the travel [mm] at which a verdict on strain or clearance passes: both change in step with the travel."""
    travel = design.press.travel_mm
    for spring in springs.springs:
        strain, limit = spring.root_strain, spring.printable.strain_limit
        if verdict.name == spring.printable.name and strain is not None and strain.value + strain.error > limit:
            share = _WITHIN * limit / (strain.value + strain.error)
            return rounded(share * travel, 0.0) if share < 1.0 else None
    if verdict.name in _CLEARANCES and verdict.value is not None and isinstance(verdict.limit, int | float):
        shorter = travel - (verdict.limit - verdict.value)
        return rounded(_WITHIN * shorter, 0.0) if 0.0 < shorter < travel else None
    return None
