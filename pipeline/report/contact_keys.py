"""What report.json says of contact, the springs that it sizes, forces and readings: what needs no solid."""

import math
from collections.abc import Mapping
from dataclasses import asdict

import numpy as np

from cad.design.tips import Tips
from pipeline.reading.assessment import ModulusReading, ReadingAssessment
from pipeline.reading.readings import Readings
from pipeline.springs.sizing import SpringSizing
from pipeline.storage.plain import Plain
from pipeline.verdicts.scene_targets import SceneTargets
from solve.contact.linear_response import SensorResponse
from solve.fruit.compliance import FruitCompliance

SIZED_KEYS = ("K_l_N_per_m", "K_h_N_per_m")


def sizing_mapping(sizing: SpringSizing) -> Plain:
    """Return the springs that were sized [N/m] and the fruit stiffness that sized them."""
    return {
        **{key: 1e3 * K for key, K in zip(SIZED_KEYS, sizing.springs.stiffnesses, strict=True)},
        "K_m_max_N_per_m": 1e3 * sizing.K_m_max,
        "K_m_over_E_mm": sizing.K_m_over_E,
        "fruit_stiffness": sizing.basis,
    }


def contact_mapping(contact: FruitCompliance) -> Plain:
    """Return the compliance of the fruit [1/mm] with its errors [%] and what it cost."""
    return {
        "error_percent": 100.0 * contact.error_pair,
        "s11_error_percent": 100.0 * contact.error_own,
        **asdict(contact.info),
        "compliance_per_mm": contact.S.tolist(),
        "K_m_over_E_mm": contact.K_m_over_E(),
    }


def response_row(table: SensorResponse, i: int, tips: Tips, of_springs: np.ndarray) -> Plain:
    """Return the response at one modulus; `of_springs` (tips,) are the errors of the forces [1] by the springs."""
    soft, stiff = (table.F[i, :, list(kind)].mean(axis=0) for kind in tips.kinds)
    columns = {
        "F_l_N": soft,
        "F_h_N": stiff,
        "P": table.P[i],
        "slope_ratio": table.slope_ratio[i],
        "F_error_percent": 100.0 * (table.F_error[i] + of_springs.max()),
        "P_error_percent": 100.0 * (table.P_error[i] + of_springs.sum()),
    }
    row = {"E_MPa": float(table.E[i]), "x_mm": _numbers(table.x)}
    row |= {name: _numbers(values) for name, values in columns.items()}
    if tips.layout != "pair":
        row["F_N"] = [_numbers(forces) for forces in table.F[i].T]
    return row


def level_mapping(reached: SceneTargets) -> Plain:
    """Return P_max and NL of a level sensor with flat sharp tips on flat fruit, whatever scene was asked for."""
    P_max, NL = reached.level
    return {"P_max": P_max.value, "P_max_error": P_max.error, "NL": NL.value, "NL_error": NL.error}


def _numbers(values: np.ndarray) -> list[float | None]:
    return [float(value) if math.isfinite(value) else None for value in values]


def assessed_mapping(readings: Readings) -> Plain:
    """Return how good readings are, in per cent of the modulus, and how hard the tips press the skin [MPa]."""
    found = readings.assessed
    return {
        **_worst(found),
        "method": found.method,
        "lift_deg": found.lift.value,
        "plates_before_zeroing_percent": 100.0 * readings.plates,
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
