"""What report.json holds of a result: its numbers in the units of the keys, null where there is none."""

import dataclasses
import math

import numpy as np
import pytest
from stand_ins import CONTACT, result_of

from cad.design.fruit import Fruit
from cad.design.parameters import Design
from cad.design.tips import Press, Tips
from pipeline.options import RunOptions
from pipeline.report.mapping import report_mapping
from pipeline.report.outputs import write_outputs


def test_stiffnesses_are_in_newtons_per_metre_and_errors_in_per_cent():
    result = result_of()
    report = report_mapping(result)
    low = result.springs.springs[0]
    entry = report["flexures"]["low"]
    assert entry["target_N_per_m"] == pytest.approx(1e3 * low.target)
    assert entry["stiffness_N_per_m"] == pytest.approx(1e3 * low.K.value)
    assert entry["error_percent"] == pytest.approx(100.0 * low.K.error / low.K.value)
    assert entry["safety_factor"] == pytest.approx(low.printable.strain_limit / 2e-3)
    assert report["springs"]["K_l_N_per_m"] == pytest.approx(1e3 * result.sizing.springs.K_l)
    assert report["contact"]["error_percent"] == pytest.approx(100.0 * CONTACT.error_pair)


def test_springs_that_were_not_made_are_null():
    report = report_mapping(result_of(made=False))
    assert (report["housing"], report["behaviour"], report["accuracy"]["springs"]) == (None, None, None)
    assert (report["errors"]["K_l"], report["errors"]["K_h"]) == (None, None)
    kept = {"target_N_per_m"}
    assert {key for key, value in report["flexures"]["low"].items() if value is not None} == kept


@pytest.mark.parametrize(
    ("tables", "paper"),
    [
        ({}, True),
        (
            {"fruit": Fruit(E_MPa=(1.0, 3.0)), "press": Press(tilt_deg=0.05), "tips": Tips(gap_mm=1.0, socket="pin")},
            True,
        ),
        ({"fruit": Fruit(height_mm=20.0)}, False),
        ({"fruit": Fruit(poisson=0.45)}, False),
        ({"fruit": Fruit(E_max_MPa=5.0)}, False),
        ({"tips": Tips(side_mm=1.5)}, False),
        ({"tips": Tips(shape="cylinder", socket="pin")}, False),
        ({"tips": Tips(spacing_mm=7.0)}, False),
        ({"tips": Tips(fillet_mm=0.1, socket="pin")}, False),
    ],
    ids=str,
)
def test_paper_is_null_unless_fruit_and_tips_are_the_papers(tables, paper):
    """Whatever moduli are shown, however it is pressed, and by pins of the same face."""
    design = Design(**tables)
    assert design.has_paper_scene is paper


def test_force_ratio_is_null_where_a_tip_is_off_the_fruit():
    result = result_of()
    ratios = result.press.table.P.copy()
    ratios[0, 0] = np.nan
    lifted = dataclasses.replace(result.press, table=dataclasses.replace(result.press.table, P=ratios))
    row = report_mapping(dataclasses.replace(result, press=lifted))["response"][0]
    assert row["P"][0] is None
    assert row["P"][1] == pytest.approx(ratios[0, 1])
    assert row["x_mm"][0] > 0.0


def test_error_of_a_force_is_that_of_its_spring_in_its_share():
    """At E the spring has the share (1/K) / (1/K + 1/K_m) of the force; both tips add up in P; the contact's adds."""
    result = result_of()
    table = result.press.table
    row = report_mapping(result)["response"][-1]
    K_m = 3.5 * CONTACT.K_m_over_E()
    parts = [
        100.0 * spring.K.relative * (1.0 / spring.stiffness) / (1.0 / spring.stiffness + 1.0 / K_m)
        for spring in result.springs.springs
    ]
    assert row["F_error_percent"] == pytest.approx(100.0 * table.F_error[-1] + max(parts), rel=1e-9)
    assert row["P_error_percent"] == pytest.approx(100.0 * table.P_error[-1] + sum(parts), rel=1e-9)


def test_scatter_stands_only_in_reports_on_fabrication():
    assert "tolerance" not in report_mapping(result_of())
    assert report_mapping(result_of(options=RunOptions(fabrication=True)))["tolerance"] is None


def test_number_that_is_not_finite_is_not_written(tmp_path):
    result = result_of()
    verdicts = (dataclasses.replace(result.verdicts[0], value=math.nan),)
    with pytest.raises(ValueError, match="JSON"):
        write_outputs(dataclasses.replace(result, verdicts=verdicts), tmp_path)
    assert not (tmp_path / "report.json").exists()
