"""The columns of response.csv: forces, P and error bands of the modulus, for each modulus and travel."""

import csv
import io
import math
from typing import TYPE_CHECKING

import numpy as np

from sensor.arrays import Floats
from sensor.design.tips import Tips
from sensor.words import value_text

if TYPE_CHECKING:
    from pipeline.errors.sensor_errors import ReadingTable
    from solve.contact.linear_response import SensorResponse

Columns = dict[str, Floats]
"""Arrays of shape (moduli, travels), keyed by the name of a column; nan if there is no number."""
# Number of significant digits of forces and P, of the ends of error bands, and of errors in response.csv. Further
# digits of an error differ between machines.
_FORCE_DIGITS, _BAND_DIGITS, _ERROR_DIGITS = 6, 4, 3


def force_columns(response: "SensorResponse", tips: Tips) -> Columns:
    """Return the modulus, the travel, the mean force on the tips of each spring, and the force ratio P."""
    E, x = np.meshgrid(response.E, response.x, indexing="ij")
    # The forces F have the shape (moduli, travels, tips), and a group holds the indices of the tips on one spring.
    low, high = (response.F[:, :, list(kind)].mean(axis=2) for kind in tips.spring_groups)
    return {"E_MPa": E, "x_mm": x, "F_l_N": low, "F_h_N": high, "P": response.P}


def band_columns(table: "ReadingTable") -> Columns:
    """Return the ends of the error band of the modulus for each P, as printed and for a calibrated unit."""
    bands = {"as_printed": table.printed, "calibrated": table.calibrated}
    ends = {"lower": 0, "upper": 1}  # indices along the last axis of a band
    return {f"E_{end}_{name}_MPa": bands[name][..., ends[end]] for name in bands for end in ends}


def response_csv(table: "ReadingTable", tips: Tips) -> str:
    """Return the text of response.csv: forces, P and error bands, with a row for each modulus and travel.

    Cells without a number are empty. For layouts other than a pair, further columns hold the force on each tip.
    """
    response = table.response
    bands = band_columns(table)
    columns = {
        **force_columns(response, tips),
        "P_mesh_error_percent": 100.0 * response.P_error,
        **bands,
        **{f"F_{tip + 1}_N": response.F[:, :, tip] for tip in tips.own_columns},  # tips are counted from 1 in the file
    }
    digits = {**dict.fromkeys(columns, _FORCE_DIGITS), **dict.fromkeys(bands, _BAND_DIGITS)}
    digits["P_mesh_error_percent"] = _ERROR_DIGITS
    cells = []
    for name, grid in columns.items():
        # Row 0 of a grid (moduli, travels) is for the softest possible fruit, which is only a limit and not written.
        written_values = grid[1:].flat
        cells.append([value_text(value, digits=digits[name]) for value in written_values])
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*cells, strict=True))  # from columns to rows
    return file.getvalue()


def numbers(values: Floats) -> tuple[float | None, ...]:
    """Return an array (n,) as a tuple for report.json, with None for numbers that are not finite."""
    return tuple(value if math.isfinite(value) else None for value in values.tolist())
