"""The range of fruits nearest to the requested range that a sensor can read, if no sensor can read the whole range."""

import math
from collections.abc import Collection
from dataclasses import replace

from pipeline.find.fruit_design import fruit_suggestion
from pipeline.find.fruit_range import Ends, FruitRange
from pipeline.storage.stopwatch import Progress, ignore_progress
from sensor.design.parameters import Design
from sensor.design.reading import ReadingRequirements
from sensor.verdict import Verdict
from sensor.words import rounded

MAX_ROUNDS = 6  # maximum number of times that the ranges are narrowed
# Fraction of the range, on a logarithmic scale, that a round removes from each end. Six rounds remove 72 % from one
# end.
NARROWED_FRACTION = 0.12

SHAPE_VERDICTS = ("reading.bias", "reading.touch", "geometry.tip_face")
"""Verdicts that fail if the radii and the flesh thickness vary too much."""

SOFTEST_VERDICTS = ("bruise", "reading.calibration", "printable.low", "printable.high", "K_l", "K_h")
"""Verdicts that fail because of the softest flesh: it bruises, or needs springs too soft to print or to calibrate."""


def nearest_demand(
    fruit: FruitRange,
    failed: Collection[Verdict],
    preset: Design,
    fixed: frozenset[str] = frozenset(),
    progress: Progress = ignore_progress,
) -> FruitRange | None:
    """Return a range of fruits for which a design passes, narrowed step by step from the requested range `fruit`.

    `failed` are the verdicts that fail for the requested range. Each round narrows the ranges on which the failed
    verdicts depend, at the ends where they fail. The round then searches for a design around the `preset`, without
    changes to the keys in `fixed`. Each search reports its `progress`. Returns None if no design passes after
    `MAX_ROUNDS` rounds. Raises the same errors as `fruit_suggestion`.
    """
    narrowed = fruit
    failed_verdicts = failed
    for round_number in range(1, MAX_ROUNDS + 1):
        narrowed = narrow_ranges(narrowed, fruit, failed_verdicts, preset)
        suggestion = fruit_suggestion(narrowed, preset, fixed, _round_progress(round_number, narrowed, progress))
        if suggestion.changes is not None:
            return narrowed
        failed_verdicts = [verdict for verdict in suggestion.verdicts if verdict.passed is not True]
    return None


def _round_progress(number: int, fruit: FruitRange, progress: Progress) -> Progress:
    """Return a progress function that prefixes each text with the number of the round and its range of fruits."""
    return lambda work: progress(f"narrowed range {number} of at most {MAX_ROUNDS}, {fruit.in_words}: {work}")


def narrow_ranges(fruit: FruitRange, requested: FruitRange, failed: Collection[Verdict], preset: Design) -> FruitRange:
    """Narrow the ranges of a fruit by a fixed fraction of the `requested` ranges, on a logarithmic scale.

    The `failed` verdicts determine which ranges become narrower: the radii and the flesh thickness, or the moduli at
    their softest or firmest end. If no failed verdict belongs to an end of the moduli, the radii and the thickness
    become narrower. A failed uncertainty of the reading belongs to the end of the moduli whose limit it exceeds.
    """
    failed_names = {verdict.name for verdict in failed}
    exceeded_limits = {verdict.limit for verdict in failed if verdict.name == "reading.uncertainty"}
    exceeds_softest, fails_at_firmest = _ends_of_limits(exceeded_limits, preset)
    fails_at_softest = bool(failed_names.intersection(SOFTEST_VERDICTS)) or exceeds_softest
    fails_by_shape = bool(failed_names.intersection(SHAPE_VERDICTS)) or not (fails_at_softest or fails_at_firmest)
    step = (requested.E_max_MPa / requested.E_min_MPa) ** NARROWED_FRACTION  # factor on one end of the moduli
    narrowed = fruit
    if fails_by_shape:
        radius, across = map(_narrow_range, fruit.radii_mm, requested.radii_mm)
        thickness = fruit.thickness_mm
        if thickness is not None and requested.thickness_mm is not None:
            thickness = _narrow_range(thickness, requested.thickness_mm)
        narrowed = replace(fruit, radius_mm=radius, radius_across_mm=across, thickness_mm=thickness)
    return replace(
        narrowed,
        E_min_MPa=rounded(fruit.E_min_MPa * step) if fails_at_softest else fruit.E_min_MPa,
        E_max_MPa=rounded(fruit.E_max_MPa / step) if fails_at_firmest else fruit.E_max_MPa,
    )


def _ends_of_limits(exceeded_limits: Collection[object], preset: Design) -> tuple[bool, bool]:
    """Return whether exceeded limits of the uncertainty belong to the softest and to the firmest end of the moduli.

    The preset may have one limit for each end. If its two limits are equal, an exceeded limit belongs to both ends. A
    limit that differs from the softest one belongs to the firmest end, even at a modulus between the two ends.
    """
    limit_at = (preset.reading or ReadingRequirements()).uncertainty_limit_at
    moduli = preset.fruit.E_MPa
    softest_limit = limit_at(min(moduli), moduli)
    firmest_limit = limit_at(max(moduli), moduli)
    exceeds_firmest = bool(set(exceeded_limits) - {softest_limit}) or firmest_limit in exceeded_limits
    return softest_limit in exceeded_limits, exceeds_firmest


def _narrow_range(ends: Ends, requested: Ends) -> Ends:
    """Return a range whose ends are moved towards their geometric mean, by a fraction of the `requested` range.

    The ends do not move beyond the mean, so a narrow range becomes a single value.
    """
    step = (requested[1] / requested[0]) ** NARROWED_FRACTION
    middle = math.sqrt(ends[0] * ends[1])
    return rounded(min(ends[0] * step, middle)), rounded(max(ends[1] / step, middle))
