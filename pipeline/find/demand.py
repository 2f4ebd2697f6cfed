"""The nearest demand that passes: a fruit with narrower ranges if a sensor for the whole range fails."""

import math
from collections.abc import Collection
from dataclasses import replace

from pipeline.find.fruit_design import fruit_suggestion
from pipeline.find.fruit_range import Ends, FruitRange
from pipeline.storage.stopwatch import Progress, silent
from sensor.design.parameters import Design
from sensor.design.reading import ReadingRequirements
from sensor.verdict import Verdict
from sensor.words import rounded

MOST_ROUNDS = 6
EASED = 0.12  # share of the logarithm of a range that a round removes from each end

OF_SHAPE = ("reading.bias", "reading.touch", "geometry.tip_face")
"""Verdicts that fail because shapes and flesh vary too much."""

OF_SOFTEST = ("bruise", "reading.calibration", "printable.low", "printable.high", "K_l", "K_h")
"""Verdicts that fail for the softest flesh: it bruises, or needs springs too soft to print or to calibrate."""


def nearest_demand(
    fruit: FruitRange,
    failed: Collection[Verdict],
    preset: Design,
    fixed: frozenset[str] = frozenset(),
    progress: Progress = silent,
) -> FruitRange | None:
    """Return the fruit nearest to the given one for which a design passes; None after six rounds.

    `failed` are the verdicts that fail for the whole fruit. Each round narrows the ranges that failing verdicts depend
    on, at the ends where they fail. Raises like `fruit_suggestion`.
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
    """Return a progress function that prefixes the fruit of a round."""
    return lambda work: progress(f"narrower ranges, at most {MOST_ROUNDS}, number {number}: {fruit.in_words}: {work}")


def eased(fruit: FruitRange, asked: FruitRange, failed: Collection[Verdict], preset: Design) -> FruitRange:
    """Return a fruit whose ranges are narrower by a step of the requested ones, depending on failed verdicts.

    An uncertainty above the preset's limit for the softest flesh is attributed to the softest, and any other to the
    firmest. It is attributed to both if the preset has one limit.
    """
    names = {verdict.name for verdict in failed}
    over = {verdict.limit for verdict in failed if verdict.name == "reading.uncertainty"}
    limit_at = (preset.reading or ReadingRequirements()).uncertainty_limit_at
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
    """Return ends that move by a step of the requested range towards their middle, and not past it."""
    step = (asked[1] / asked[0]) ** EASED
    middle = math.sqrt(ends[0] * ends[1])
    return rounded(min(ends[0] * step, middle)), rounded(max(ends[1] / step, middle))
