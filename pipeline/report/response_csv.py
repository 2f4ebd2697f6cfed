"""The table a user of the sensor reads: force ratio to modulus, with the band that the errors leave."""

import csv
import io

from cad.theory.two_spring_law import fruit_stiffness
from pipeline.stages.verdict_rules import Characteristic

ROWS = 70
COLUMNS = ("E_MPa", "K_m_N_per_m", "P", "P_error", "E_lower_MPa", "E_upper_MPa")


def response_csv(own: Characteristic, E_max: float) -> str:
    """Return CSV text with one row per modulus, in 70 equal steps to E_max [MPa]; P of a level sensor.

    E_lower and E_upper bound the modulus at which the sensor may show this P.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    K_m_over_E = own.K_m_max / E_max
    for step in range(1, ROWS + 1):
        E = E_max * step / ROWS
        P = own.at(K_m_over_E * E).P_max()
        band = (_fruit_stiffness(own, P.value + side * P.error) / K_m_over_E for side in (-1.0, 1.0))
        # Three digits of an error: more differ from solver to solver, and the file would with them.
        limits = [f"{value:.6g}" for value in band]
        writer.writerow([f"{E:.6g}", f"{1e3 * K_m_over_E * E:.6g}", f"{P.value:.6g}", f"{P.error:.3g}", *limits])
    return out.getvalue()


def _fruit_stiffness(own: Characteristic, P: float) -> float:
    """Return K_m at P [N/mm], kept inside what the springs can show."""
    most, ratio = own.springs.K_h / own.springs.K_l, own.stiffness_ratio
    return 0.0 if ratio >= P else fruit_stiffness(own.springs, min(P, most * (1.0 - 1e-9)), ratio)
