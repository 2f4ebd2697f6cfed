"""What report.json says of the tips and of their readings, as plain data."""

from collections.abc import Mapping
from typing import Any

from cad.design.tips import Tips
from pipeline.reading.assessment import ModulusReading, ReadingAssessment
from pipeline.reading.readings import Readings

Plain = dict[str, Any]


def reading_mapping(tips: Tips, readings: Readings | None) -> Plain:
    """Return the tips in the order of the forces in every table, and how good their readings are.

    The reading is null where the design asks for none.
    """
    return {"tips": _tips(tips), "reading": None if readings is None else _reading(readings)}


def _tips(tips: Tips) -> list[Plain]:
    rows = zip(tips.names, tips.places_mm, tips.springs, strict=True)
    return [{"name": name, "x_mm": x, "y_mm": y, "spring": spring} for name, (x, y), spring in rows]


def _reading(readings: Readings) -> Plain:
    found = readings.assessed
    return {
        **_worst(found),
        "method": found.method,
        "lift_deg": found.lift.value,
        "noise_for_10_percent": found.noise_percent,
        "refused": found.refused,
        "moduli": [_at_modulus(row) for row in found.moduli],
        "skin_pressure": [
            {"E_MPa": one.E, "pressure_MPa": one.pressure.value, "limit_MPa": one.limit, "worst": str(one.placed)}
            for one in readings.pressures
        ],
    }


def _worst(found: ReadingAssessment) -> Plain:
    """Return the largest bias and uncertainty; null where a pose has no reading."""
    bias, uncertainty = found.bias, found.uncertainty
    return {
        "E_bias_percent": None if bias is None else 100.0 * bias.value,
        "E_bias_error_percent": None if bias is None else 100.0 * bias.error,
        "uncertainty_percent": None if uncertainty is None else 100.0 * uncertainty.value,
        "sources": {} if uncertainty is None else _percent(found.worst_uncertainty.sources.shares),
    }


def _at_modulus(row: ModulusReading) -> Plain:
    return {
        "E_MPa": row.E,
        "E_bias_percent": 100.0 * row.bias,
        "worst": str(row.worst),
        "uncertainty_percent": 100.0 * row.sources.total,
        "sources": _percent(row.sources.shares),
    }


def _percent(shares: Mapping[str, float]) -> Plain:
    return {f"{name.removesuffix('_percent')}_percent": 100.0 * share for name, share in shares.items()}
