"""response.csv: the scene's own table of forces, P and the modulus over the travel, with two bands."""

import csv
import io
from collections.abc import Iterator, Sequence

from pipeline.verdicts.errors.sensor_errors import ReadingTable
from sensor.design.tips import Tips
from sensor.words import shown

COLUMNS = (
    "E_MPa",
    "x_mm",
    "F_l_N",
    "F_h_N",
    "P",
    "P_mesh_error_percent",
    "E_lower_as_printed_MPa",
    "E_upper_as_printed_MPa",
    "E_lower_calibrated_MPa",
    "E_upper_calibrated_MPa",
)


def response_csv(table: ReadingTable, tips: Tips) -> str:
    """Return CSV text with one row for each modulus and travel; a cell is empty where a tip is off or no bound is.

    Forces are means over the tips of a kind; layouts other than a pair have a column for each tip at the end.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    single_tips = tips.own_columns
    writer.writerow((*COLUMNS, *(f"F_{tip + 1}_N" for tip in single_tips)))
    writer.writerows(_rows(table, tips, single_tips))
    return out.getvalue()


def _rows(table: ReadingTable, tips: Tips, single_tips: Sequence[int]) -> Iterator[list[str]]:
    """Yield the cells of each row, with the forces of single tips, by their indices, at its end."""
    response = table.response
    for i, E in enumerate(response.E.tolist()):
        if i == 0:
            continue  # stands for the softest fruit, a limit and no fruit
        for j, x in enumerate(response.x.tolist()):
            forces = response.F[i, j]
            soft, stiff = (forces[list(kind)].mean() for kind in tips.spring_groups)
            numbers = (E, x, soft, stiff, response.P[i, j])
            # Three digits of an error: more differ from solver to solver, and the file would with them.
            error = shown(100.0 * response.P_error[i, j], digits=3)
            bounds = (*table.printed[i, j], *table.calibrated[i, j])
            yield [
                *(shown(one, digits=6) for one in numbers),
                error,
                *(shown(one, digits=4) for one in bounds),
                *(shown(forces[tip], digits=6) for tip in single_tips),
            ]
