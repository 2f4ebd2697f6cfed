"""The table P -> E: its modulus inverts its force ratio, and its band holds what springs inside their error read."""

import csv
import io

import pytest
from stand_ins import K_M_OVER_E

from cad.theory.two_spring_law import Springs, force_ratio, fruit_stiffness, size_springs
from pipeline.report.response_csv import COLUMNS, ROWS, response_csv
from pipeline.stages.verdict_rules import Characteristic

K_M = 3.5 * K_M_OVER_E
SPRINGS = size_springs(5.0, 0.05, K_M)
EXACT = Characteristic(springs=SPRINGS, K_m_max=K_M)


def rows(own):
    table = csv.DictReader(io.StringIO(response_csv(own, 3.5)))
    return [{key: float(value) for key, value in row.items()} for row in table]


def test_rows_rise_to_the_largest_modulus_and_its_target():
    table = rows(EXACT)
    assert tuple(table[0]) == COLUMNS
    assert len(table) == ROWS
    assert table[-1]["E_MPa"] == 3.5
    assert table[-1]["P"] == pytest.approx(5.0, rel=1e-5)
    assert table[-1]["K_m_N_per_m"] == pytest.approx(1e3 * K_M, rel=1e-5)


def test_force_ratio_reads_back_as_the_modulus():
    for row in rows(EXACT):
        assert fruit_stiffness(SPRINGS, row["P"]) / K_M_OVER_E == pytest.approx(row["E_MPa"], rel=2e-5)


@pytest.mark.parametrize(("low", "high"), [(1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (-1.0, -1.0)])
def test_band_holds_the_modulus_that_other_springs_would_read(low, high):
    errors = (0.01 * SPRINGS.K_l, 0.01 * SPRINGS.K_h)
    real = Springs(K_l=SPRINGS.K_l + low * errors[0], K_h=SPRINGS.K_h + high * errors[1])
    for row in rows(Characteristic(springs=SPRINGS, K_m_max=K_M, spring_errors=errors)):
        read = fruit_stiffness(SPRINGS, force_ratio(real, K_M_OVER_E * row["E_MPa"])) / K_M_OVER_E
        assert row["E_lower_MPa"] * 0.999 <= read <= row["E_upper_MPa"] * 1.001
