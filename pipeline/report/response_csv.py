"""The table a user of the sensor reads: force ratio to modulus, with the band that the errors leave."""

import csv
import io

from cad.theory.two_spring_law import fruit_stiffness
from pipeline.stages.verdict_rules import Judged

ROWS = 70
COLUMNS = ("E_MPa", "K_m_N_per_m", "P", "P_error", "E_lower_MPa", "E_upper_MPa")


def response_table(judged: Judged, E_max: float) -> str:
    """Return CSV text with one row per modulus, in 70 equal steps to E_max [MPa]; P of a level sensor.

    E_lower and E_upper bound the modulus at which the sensor may show this P.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    K_m_over_E = judged.K_m_max / E_max
    for step in range(1, ROWS + 1):
        E = E_max * step / ROWS
        here = judged.at(K_m_over_E * E)
        P, error = here.P_max()
        band = (_modulus(judged, P + side * error) / K_m_over_E for side in (-1.0, 1.0))
        # Three digits of an error: more differ from solver to solver, and the file would with them.
        rest = [f"{value:.6g}" for value in band]
        writer.writerow([f"{E:.6g}", f"{1e3 * K_m_over_E * E:.6g}", f"{P:.6g}", f"{error:.3g}", *rest])
    return out.getvalue()


def _modulus(judged: Judged, P: float) -> float:
    """Return K_m at P, kept inside what the springs can show."""
    most, q = judged.springs.K_h / judged.springs.K_l, judged.asymmetry
    return 0.0 if q >= P else fruit_stiffness(judged.springs, min(P, most * (1.0 - 1e-9)), q)
