"""Verdicts on what a sensor reads, in place of those on its force ratio: bias, uncertainty, lift, bruise."""

from collections.abc import Sequence
from dataclasses import replace

from cad.design.parameters import Design
from cad.design.reading import Reading
from cad.verdict import Verdict, failed
from pipeline.reading.assessment import ReadingAssessment
from pipeline.reading.bruising import SkinPressure
from pipeline.reading.readings import Readings
from pipeline.storage.plain import first_largest
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
    words = "tilt at which the first tip leaves the fruit, the worst direction and modulus; at least the limit"
    lift = margin_verdict("reading.lift", assessed.lift, reading.tilt_deg, words)
    bias, uncertainty = _bias_verdict(assessed, reading.bias_limit), _uncertainty_verdict(assessed, reading)
    if assessed.refused is not None:
        bias, uncertainty = (_refused(one, assessed.refused) for one in (bias, uncertainty))
    return bias, uncertainty, lift


def _bias_verdict(assessed: ReadingAssessment, limit: float) -> Verdict:
    name, words = "reading.bias", "largest |E read / E - 1| without noise"
    if assessed.bias is None:
        return failed(name, limit, unit="1", reference=words)
    worst = assessed.worst_bias
    return margin_verdict(name, assessed.bias, limit, f"{words}: at {worst.E:.3g} MPa, {worst.worst}", at_most=True)


def _uncertainty_verdict(assessed: ReadingAssessment, reading: Reading) -> Verdict:
    name, limit, words = (
        "reading.uncertainty",
        reading.uncertainty_limit,
        "standard deviation of E read / E, level and in the middle",
    )
    if assessed.uncertainty is None:
        return failed(name, limit, unit="1", reference=words)
    widest = assessed.worst_uncertainty
    shares = widest.sources.shares
    source = list(shares)[first_largest(shares.values())]
    words = f"{words}, at {widest.E:.3g} MPa; largest source: {source}"
    return margin_verdict(name, assessed.uncertainty, limit, words, at_most=True)


def _refused(verdict: Verdict, reason: str) -> Verdict:
    of_others = "" if verdict.value is None else "of the others: "
    return replace(verdict, passed=False, reference=f"{reason}; {of_others}{verdict.reference}")


def skin_verdict(pressures: Sequence[SkinPressure]) -> Verdict:
    """Return the verdict on the mean pressure under the worst tip [MPa], at the modulus nearest to its limit."""
    worst = pressures[first_largest(one.share for one in pressures)]
    words = f"mean pressure over what a tip touches, at {worst.E:.3g} MPa, {worst.placed}; must be at most the limit"
    return margin_verdict("bruise", worst.pressure, worst.limit, words, at_most=True)
