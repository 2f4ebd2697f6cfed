"""response.csv: the scene's own forces over the travel, and bands that hold what a real unit would read."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest
from stand_ins import K_M_OVER_E, result_of, sizing_of

from pipeline.errors.budget import level_press
from pipeline.errors.sensor_errors import reading_table
from pipeline.errors.targets import ForceRatioCurve
from pipeline.report.response_table import force_columns, response_csv
from sensor.design.parameters import Design
from sensor.design.tips import Tips
from sensor.theory.two_spring_law import Springs, force_ratio, fruit_stiffness

RESULT = result_of()
SPRINGS = sizing_of(Design()).springs
ROUNDED = 2e-4  # of what is written with four digits


def rows(result=RESULT):
    table = csv.DictReader(io.StringIO(response_csv(result.errors.reading, result.design.tips)))
    return [{key: float(value) if value else None for key, value in row.items()} for row in table]


def test_rows_go_over_modulus_and_travel_to_the_largest_of_both():
    table = rows()
    assert list(table[0]) == [
        *("E_MPa", "x_mm", "F_l_N", "F_h_N", "P", "P_mesh_error_percent"),
        *("E_lower_as_printed_MPa", "E_upper_as_printed_MPa", "E_lower_calibrated_MPa", "E_upper_calibrated_MPa"),
    ]
    assert len(table) == 72 * 6
    assert (table[-1]["E_MPa"], table[-1]["x_mm"]) == (3.5, 0.6)
    assert table[-1]["P"] == pytest.approx(5.0, rel=1e-5)


@pytest.mark.parametrize("softer", [0.78, 1.22])
def test_band_as_printed_holds_what_a_print_of_another_modulus_reads(softer):
    """Two sigma of the process move both springs by 20 %: read with the nominal springs by (4)."""
    real = Springs(K_l=SPRINGS.K_l * softer, K_h=SPRINGS.K_h * softer)
    for row in rows():
        read = fruit_stiffness(SPRINGS, force_ratio(real, K_M_OVER_E * row["E_MPa"])) / K_M_OVER_E
        assert row["E_lower_as_printed_MPa"] <= read <= (row["E_upper_as_printed_MPa"] or np.inf)


def test_band_after_calibrating_holds_springs_known_to_one_per_cent_and_no_more():
    for row in rows():
        if row["E_MPa"] < 0.5:
            continue
        for low, high in ((1.01, 0.99), (0.99, 1.01)):
            real = Springs(K_l=SPRINGS.K_l * low, K_h=SPRINGS.K_h * high)
            read = fruit_stiffness(SPRINGS, force_ratio(real, K_M_OVER_E * row["E_MPa"])) / K_M_OVER_E
            assert row["E_lower_calibrated_MPa"] <= read <= (row["E_upper_calibrated_MPa"] or np.inf)
        inside = row["E_lower_as_printed_MPa"], row["E_upper_as_printed_MPa"] or np.inf
        assert inside[0] <= row["E_lower_calibrated_MPa"] * (1.0 + ROUNDED)
        assert (row["E_upper_calibrated_MPa"] or 0.0) <= inside[1] * (1.0 + ROUNDED)


def test_modulus_of_a_force_ratio_goes_on_beyond_the_table_as_the_law_does():
    E = np.array([1e-9, 1.0, 2.0, 3.5])
    P = np.array([force_ratio(SPRINGS, K_M_OVER_E * modulus) for modulus in E])
    modulus_at = ForceRatioCurve(springs=SPRINGS, K_m_max=3.5 * K_M_OVER_E).modulus_converter(P, E)
    for modulus in (1.3, 3.5, 4.2):
        assert modulus_at(force_ratio(SPRINGS, K_M_OVER_E * modulus)) == pytest.approx(modulus, rel=1e-6)
    assert modulus_at(0.9) == 0.0
    assert np.isnan(modulus_at(1.1 * SPRINGS.K_h / SPRINGS.K_l))


def test_travel_at_which_a_tip_is_off_some_fruit_has_no_bands():
    """The others keep theirs."""
    curve = RESULT.press.curve
    P = curve.P.copy()
    P[:5, 0] = np.nan
    pair = RESULT.pressed.pair
    table = reading_table(pair, replace(curve, P=P), level_press(pair, curve.E, curve.x))
    assert np.isnan(table.printed[:, 0]).all()
    np.testing.assert_array_equal(table.printed[:, 1:], RESULT.errors.reading.printed[:, 1:])


def test_forces_of_a_square_are_means_and_stand_singly_at_the_end():
    tips = Tips(layout="square")
    response = replace(
        RESULT.press.curve, F=np.arange(2.0 * 3.0 * 4.0).reshape(2, 3, 4), E=np.ones(2), x=np.arange(3.0)
    )
    columns = force_columns(response, tips)
    assert columns["F_l_N"][1].tolist() == [13.0, 17.0, 21.0]  # of the first and the third tip
    assert columns["F_h_N"][1].tolist() == [14.0, 18.0, 22.0]
