"""Verdicts on what a sensor reads, in place of those on its force ratio: bias, uncertainty, lift, bruise."""

from collections.abc import Sequence
from dataclasses import replace

from cad.design.parameters import Design
from cad.design.reading import Reading
from cad.verdict import Verdict, failed
from pipeline.reading.assessment import ReadingAssessment
from pipeline.reading.bruising import SkinPressure
from pipeline.reading.readings import Readings
from pipeline.verdicts.rules import margin_verdict

READING_VERDICTS = ("reading.bias", "reading.uncertainty", "reading.lift")


def reading_verdicts(design: Design, readings: Readings | None) -> tuple[Verdict, ...]:
    """Return the verdicts on bias, uncertainty, lift and bruising; none for a design that is judged by its ratio."""
    if design.reading is None or readings is None:
        return ()
    bruise = (skin_verdict(readings.pressures),) if readings.pressures else ()
    return *assessed_verdicts(readings.assessed, design.reading), *bruise


def assessed_verdicts(assessed: ReadingAssessment, reading: Reading) -> tuple[Verdict, ...]:
    """Return the verdicts reading.bias and reading.uncertainty [1], and reading.lift [deg].

    A pose that occurs and has no reading fails the first two, whose values are those of the other poses.
    """
    lift_words = "tilt at which the first tip leaves the fruit, the worst direction and modulus; at least the limit"
    lift = margin_verdict("reading.lift", assessed.lift, reading.tilt_deg, lift_words)
    bias, uncertainty = assessed.bias, assessed.uncertainty
    if bias is None or uncertainty is None:
        limits = {"reading.bias": reading.bias_limit, "reading.uncertainty": reading.uncertainty_limit}
        refused = [failed(name, limit, unit="1", reference=assessed.refused or "") for name, limit in limits.items()]
        return *refused, lift
    worst, widest = assessed.worst_bias, assessed.worst_uncertainty
    largest = max(widest.sources.shares, key=lambda name: widest.sources.shares[name])
    bias_words = f"largest |E read / E - 1| without noise: at {worst.E:.3g} MPa, {worst.worst}"
    uncertainty_words = f"standard deviation of E read / E, at {widest.E:.3g} MPa; largest source: {largest}"
    found = [
        margin_verdict("reading.bias", bias, reading.bias_limit, bias_words, at_most=True),
        margin_verdict("reading.uncertainty", uncertainty, reading.uncertainty_limit, uncertainty_words, at_most=True),
    ]
    if assessed.refused is not None:
        found = [replace(one, passed=False, reference=f"{one.reference}; {assessed.refused}") for one in found]
    return *found, lift


def skin_verdict(pressures: Sequence[SkinPressure]) -> Verdict:
    """Return the verdict on the mean pressure under the worst tip [MPa], at the modulus nearest to its limit."""
    worst = max(pressures, key=lambda one: one.share)
    words = f"mean pressure over what a tip touches, at {worst.E:.3g} MPa, {worst.placed}; must be at most the limit"
    return margin_verdict("bruise", worst.pressure, worst.limit, words, at_most=True)
