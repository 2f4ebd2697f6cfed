"""What report.json says of the tips and of their readings, and whether it agrees with itself."""

import math
from collections.abc import Iterator, Mapping, Sequence

from cad.design.parameters import Design
from cad.design.tips import Tips
from cad.verdict import Verdict
from pipeline.reading.read_out import LineReadOut
from pipeline.reading.readings import Readings
from pipeline.reading.sensor_read_out import SensorReadOut
from pipeline.report.contact_keys import assessed_mapping
from pipeline.storage.plain import Plain, first_largest, from_plain, number_at, same_number, value_at
from pipeline.verdicts.errors.reading_table import ReadingTable
from solve.arrays import Floats

_PERCENT = 0.01


def reading_mapping(tips: Tips, read_out: SensorReadOut, readings: Readings | None) -> Plain:
    """Return the tips in the order of the forces in every table, what reads them, and how good their readings are.

    The last is null where the design asks for none.
    """
    reading = None if readings is None else assessed_mapping(readings)
    return {"tips": _tips(tips), "read_out": _read_out(read_out), "reading": reading}


def _read_out(known: SensorReadOut) -> Plain:
    """Return the numbers that turn forces into a modulus: those of the contrast, or of the line through a press."""
    read_out = known.read_out
    shared = {
        "method": read_out.method,
        "full_scale_N": list(known.full_scale),
        "model_error_percent": 100.0 * known.model_error,
        "level": [{"E_MPa": row.E, "read_MPa": row.read} for row in known.level],
        "large_strain": [
            {"depth_sides": row.depth, "factor": row.factor, "error_percent": 100.0 * row.error} for row in known.deep
        ],
    }
    if isinstance(read_out, LineReadOut):
        springs = {"springs_mm_per_N": _rows(read_out.C), "own_less_other_per_mm": read_out.own_less_other}
        return {**shared, **springs, "weights": None, "gaps_mm": None, "fruit_per_mm": None, "hertz": None}
    law = read_out.law
    return {
        **shared,
        "springs_mm_per_N": _rows(law.C),
        "own_less_other_per_mm": None,
        "weights": list(law.weights),
        "gaps_mm": list(law.gaps),
        "fruit_per_mm": _rows(law.S),
        "hertz": law.hertz,
    }


def _rows(matrix: Sequence[Sequence[float]]) -> list[list[float]]:
    return [list(row) for row in matrix]


def curve_mapping(table: ReadingTable) -> Plain:
    """Return P at full travel over the modulus, with the moduli that may show it; null where a tip is off the fruit."""
    response = table.response
    bands = {"as_printed": table.printed, "calibrated": table.calibrated}
    return {
        "x_mm": float(response.x[-1]),
        "P_softest": _numbers(response.P[:1, -1])[0],
        "E_MPa": _numbers(response.E[1:]),
        "P": _numbers(response.P[1:, -1]),
        **{
            f"E_{end}_{name}_MPa": _numbers(band[1:, -1, place])
            for name, band in bands.items()
            for place, end in enumerate(("lower", "upper"))
        },
    }


def _numbers(values: Floats) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in values.tolist()]


def _tips(tips: Tips) -> list[Plain]:
    rows = zip(tips.names, tips.places_mm, tips.springs, strict=True)
    return [{"name": name, "x_mm": x, "y_mm": y, "spring": spring} for name, (x, y), spring in rows]


def other_readings(report: Plain, design: Design, stored: Sequence[Verdict]) -> Iterator[str]:
    """Yield the names of verdicts and keys on readings that do not follow from the rows of the report and the design.

    Raises ValueError that names a key which is missing or of another kind.
    """
    asked = design.reading
    if asked is None:
        return
    verdicts = {verdict.name: verdict for verdict in stored}
    rows = from_plain(tuple[Plain, ...], value_at(report, "reading.moduli"), "reading.moduli")
    totals = [math.hypot(*from_plain(dict[str, float], row["sources"], "sources").values()) for row in rows]
    yield from (
        f"reading.moduli[{place}].uncertainty_percent"
        for place, (row, total) in enumerate(zip(rows, totals, strict=True))
        if not same_number(number_at(row, "uncertainty_percent"), total)
    )
    biases = [abs(number_at(row, "E_bias_percent")) for row in rows]
    expected = {
        "reading.bias": (_PERCENT * max(biases) if biases else None, asked.bias_limit),
        "reading.uncertainty": (_PERCENT * max(totals) if totals else None, asked.uncertainty_limit),
        "reading.lift": (number_at(report, "reading.lift_deg"), asked.tilt_deg),
        **_bruise(report, design),
    }
    yield from _other_verdicts(expected, verdicts)


def _bruise(report: Plain, design: Design) -> dict[str, tuple[float | None, float]]:
    """Return pressure and limit [MPa] of the row nearest to its limit; nothing where the fruit has none."""
    if not design.fruit.bruise_limits_MPa:
        return {}
    rows = from_plain(tuple[Plain, ...], value_at(report, "reading.skin_pressure"), "reading.skin_pressure")
    pairs = [
        (number_at(row, "pressure_MPa"), limit) for row, limit in zip(rows, design.fruit.bruise_limits_MPa, strict=True)
    ]
    return {"bruise": pairs[first_largest(pressure / limit for pressure, limit in pairs)]}


def _other_verdicts(
    expected: Mapping[str, tuple[float | None, float]], verdicts: Mapping[str, Verdict]
) -> Iterator[str]:
    for name, (value, limit) in expected.items():
        given = verdicts.get(name)
        if given is None or not (same_number(given.value, value) and same_number(given.limit, limit)):
            yield name
