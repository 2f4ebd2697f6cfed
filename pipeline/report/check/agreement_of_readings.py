"""Whether what report.json says of readings agrees with itself."""

import math
from collections.abc import Iterator, Mapping, Sequence

from cad.design.parameters import Design
from cad.verdict import Verdict
from pipeline.storage.plain import Plain, first_largest, from_plain, number_at, same_number, value_at

_PERCENT = 0.01


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
