"""Forces, P and the modulus over modulus and travel, as the columns of response.csv and report.json."""

import csv
import io
import math
from typing import TYPE_CHECKING

import numpy as np

from sensor.arrays import Floats
from sensor.design.tips import Tips
from sensor.words import shown

if TYPE_CHECKING:
    from pipeline.errors.sensor_errors import ReadingTable
    from solve.contact.linear_response import SensorResponse

Columns = dict[str, Floats]
"""Numbers of shape (moduli, travels) by name; nan if there is no number."""
# Digits of a number in response.csv. Further digits of an error differ between solvers, and the file would differ.
_DIGITS = {"P_mesh_error_percent": 3}
_FORCE_DIGITS, _BAND_DIGITS = 6, 4


def force_columns(response: "SensorResponse", tips: Tips) -> Columns:
    """Return modulus, travel, forces and P; forces are means over the tips of a kind."""
    E, x = np.meshgrid(response.E, response.x, indexing="ij")
    low, high = (response.F[:, :, list(kind)].mean(axis=2) for kind in tips.spring_groups)
    return {"E_MPa": E, "x_mm": x, "F_l_N": low, "F_h_N": high, "P": response.P}


def band_columns(table: "ReadingTable") -> Columns:
    """Return the bands of the modulus for each P, on a sensor as printed and on a calibrated unit."""
    bands = {"as_printed": table.printed, "calibrated": table.calibrated}
    ends = {"lower": 0, "upper": 1}
    return {f"E_{end}_{name}_MPa": bands[name][..., ends[end]] for name in bands for end in ends}


def response_csv(table: "ReadingTable", tips: Tips) -> str:
    """Return CSV text with one row for each modulus and travel; cells without a number are empty.

    Layouts other than a pair have a column for each tip at the end.
    """
    response = table.response
    bands = band_columns(table)
    columns = {
        **force_columns(response, tips),
        "P_mesh_error_percent": 100.0 * response.P_error,
        **bands,
        **{f"F_{tip + 1}_N": response.F[:, :, tip] for tip in tips.own_columns},
    }
    digits = {**dict.fromkeys(columns, _FORCE_DIGITS), **dict.fromkeys(bands, _BAND_DIGITS), **_DIGITS}
    # The first modulus represents the softest possible fruit, which is a limit.
    cells = [[shown(value, digits=digits[name]) for value in grid[1:].flat] for name, grid in columns.items()]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*cells, strict=True))
    return out.getvalue()


def numbers(values: Floats) -> tuple[float | None, ...]:
    """Return numbers as in report.json; None for one that is not finite."""
    return tuple(value if math.isfinite(value) else None for value in values.tolist())
