"""The nearest demand that passes: a fruit whose ranges are a little narrower where a sensor for all of it fails."""

import math
from collections.abc import Collection
from dataclasses import replace

from pipeline.find.fruit_design import fruit_suggestion
from pipeline.find.fruit_range import Ends, FruitRange
from pipeline.storage.stopwatch import Progress, silent
from sensor.design.parameters import Design
from sensor.design.reading import Reading
from sensor.verdict import Verdict
from sensor.words import rounded

MOST_ROUNDS = 6
EASED = 0.12  # of the logarithm of a range, that a round takes from each of its ends

OF_SHAPE = ("reading.bias", "reading.touch", "geometry.tip_face")
"""Verdicts that fail because cheeks and flesh differ too much."""

OF_SOFTEST = ("bruise", "reading.calibration", "printable.low", "printable.high", "K_l", "K_h")
"""Verdicts that fail for the softest flesh: it bears too little, or needs springs too soft to print or to calibrate."""


def nearest_demand(
    fruit: FruitRange,
    failed: Collection[Verdict],
    preset: Design,
    fixed: frozenset[str] = frozenset(),
    progress: Progress = silent,
) -> FruitRange | None:
    """Return the fruit nearest to one for which a design passes, where none passes for that one; None in six rounds.

    `failed` are the verdicts that fail for the whole fruit. Each round narrows the ranges that failing verdicts depend
    on, from the ends they fail at. Raises as `fruit_suggestion`.
    """
    asked = fruit
    for number in range(1, MOST_ROUNDS + 1):
        fruit = eased(fruit, asked, failed, preset)
        found = fruit_suggestion(fruit, preset, fixed, _in_round(number, fruit, progress))
        if found.changes is not None:
            return fruit
        failed = [verdict for verdict in found.verdicts if verdict.passed is not True]
    return None


def _in_round(number: int, fruit: FruitRange, progress: Progress) -> Progress:
    """Return what tells the work on the fruit of a round with that fruit."""
    return lambda work: progress(f"narrower ranges, at most {MOST_ROUNDS}, number {number}: {fruit.in_words}: {work}")


def eased(fruit: FruitRange, asked: FruitRange, failed: Collection[Verdict], preset: Design) -> FruitRange:
    """Return a fruit with ranges that are narrower by a step of those `asked`, where verdicts failed.

    An uncertainty over the limit that the preset has for the softest flesh is taken for that of the softest, any other
    for that of the firmest; both, where the preset has one limit for all.
    """
    names = {verdict.name for verdict in failed}
    over = {verdict.limit for verdict in failed if verdict.name == "reading.uncertainty"}
    limit_at = (preset.reading or Reading()).uncertainty_limit_at
    softest, firmest = (limit_at(end(preset.fruit.E_MPa), preset.fruit.E_MPa) for end in (min, max))
    at_softest = bool(names.intersection(OF_SOFTEST)) or softest in over
    at_firmest = bool(over - {softest}) or firmest in over
    of_shape = bool(names.intersection(OF_SHAPE)) or not (at_softest or at_firmest)
    step = (asked.E_max_MPa / asked.E_min_MPa) ** EASED
    if of_shape:
        radius, across = (_narrower(ends, of) for ends, of in zip(fruit.radii_mm, asked.radii_mm, strict=True))
        flesh = fruit.thickness_mm
        if flesh is not None and asked.thickness_mm is not None:
            flesh = _narrower(flesh, asked.thickness_mm)
        fruit = replace(fruit, radius_mm=radius, radius_across_mm=across, thickness_mm=flesh)
    return replace(
        fruit,
        E_min_MPa=rounded(fruit.E_min_MPa * step) if at_softest else fruit.E_min_MPa,
        E_max_MPa=rounded(fruit.E_max_MPa / step) if at_firmest else fruit.E_max_MPa,
    )


def _narrower(ends: Ends, asked: Ends) -> Ends:
    """Return ends nearer to their middle by a step of the range that was asked for, never past it."""
    step = (asked[1] / asked[0]) ** EASED
    middle = math.sqrt(ends[0] * ends[1])
    return rounded(min(ends[0] * step, middle)), rounded(max(ends[1] / step, middle))
