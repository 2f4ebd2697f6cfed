"""The table P -> E: its modulus inverts its force ratio, and its band holds what springs inside their error read."""

import csv
import io

import pytest

from cad.theory.two_spring_law import Springs, force_ratio, fruit_stiffness, size_springs
from pipeline.report.response_csv import COLUMNS, ROWS, response_table
from pipeline.stages.verdict_rules import Judged

K_M = 3.5 * 1.32263
SPRINGS = size_springs(5.0, 0.05, K_M)


def rows(judged):
    return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(io.StringIO(response_table(judged, 3.5)))]


def test_rows_rise_to_the_largest_modulus_and_its_target():
    found = rows(Judged(springs=SPRINGS, K_m_max=K_M))
    assert tuple(found[0]) == COLUMNS
    assert len(found) == ROWS
    assert found[-1]["E_MPa"] == 3.5
    assert found[-1]["P"] == pytest.approx(5.0, rel=1e-5)
    assert found[-1]["K_m_N_per_m"] == pytest.approx(1e3 * K_M, rel=1e-5)


def test_force_ratio_reads_back_as_the_modulus():
    for row in rows(Judged(springs=SPRINGS, K_m_max=K_M)):
        assert fruit_stiffness(SPRINGS, row["P"]) / 1.32263 == pytest.approx(row["E_MPa"], rel=2e-5)


@pytest.mark.parametrize(("low", "high"), [(1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (-1.0, -1.0)])
def test_band_holds_the_modulus_that_other_springs_would_read(low, high):
    errors = (0.01 * SPRINGS.K_l, 0.01 * SPRINGS.K_h)
    real = Springs(K_l=SPRINGS.K_l + low * errors[0], K_h=SPRINGS.K_h + high * errors[1])
    for row in rows(Judged(springs=SPRINGS, K_m_max=K_M, spring_errors=errors)):
        read = fruit_stiffness(SPRINGS, force_ratio(real, 1.32263 * row["E_MPa"])) / 1.32263
        assert row["E_lower_MPa"] * 0.999 <= read <= row["E_upper_MPa"] * 1.001
