"""What report.json holds of a result: its numbers in the units of the keys, null where there is none."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from stand_ins import CONTACT, ERRORS, relaxing_result, result_of, stored_report

from pipeline.options import RunOptions
from pipeline.reading.analysis import ModulusAccuracy, ReadingAccuracy
from pipeline.reading.poses import Placement
from pipeline.reading.reading_records import SkinPressure
from pipeline.reading.uncertainty import UncertaintySources
from pipeline.report.keys import value_at
from pipeline.report.of_result import OF_SENSOR
from pipeline.report.outputs import write_outputs
from pipeline.report.parts import ContactReport, ReadingReport, SizingReport
from pipeline.springs.sizing import spring_sizing
from pipeline.springs.spring import MadeSpring
from pipeline.storage.record_data import as_data
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.tips import PressMotion, Tips
from sensor.quantity import Estimate


@pytest.mark.parametrize(
    ("key", "error"),
    [
        *((f"flexures.{name}.error_percent", error) for name, error in zip(("low", "high"), ERRORS, strict=True)),
        ("flexures.low.root_strain_error_percent", 0.01),
        ("accuracy.springs.error_percent", max(ERRORS)),
        ("accuracy.contact.error_percent", CONTACT.difference_error),
        ("contact.s11_error_percent", CONTACT.s11_error),
    ],
)
def test_error_of_a_solve_is_in_per_cent(key, error):
    """Other numbers of a pair are frozen in tests/golden, which compares errors on one machine only."""
    assert value_at(stored_report(result_of()), key) == pytest.approx(100.0 * error)


def test_budgets_are_in_per_cent():
    report = stored_report(result_of())
    for name, budget in vars(result_of().errors.budgets).items():
        entry = report["errors"][name]
        sums = [entry[f"{part}_percent"] for part in ("discretisation", "model", "inputs")]
        assert sums == pytest.approx([100.0 * x for x in (budget.numerical, budget.model_total, budget.inputs_total)])
        sizes = [part["size_percent"] for part in (*entry["model"], *entry["inputs"])]
        assert sizes == pytest.approx([100.0 * part.size for part in (*budget.model, *budget.inputs)])


def test_reading_is_in_per_cent_of_the_modulus():
    sources = UncertaintySources(contributions={"noise_N": 0.03, "gain": 0.04}, stiffness_slope=1.0, noise_slope=1.0)
    worst = Placement(tilt_deg=(2.0, 0.0))
    bias = Estimate(-0.02, 0.001)
    row = ModulusAccuracy(E=1.5, bias=bias, worst=worst, reach=bias, sources=sources, uncertainty_limit=0.1)
    unread = ReadingAccuracy(method="rise", touch=Estimate(0.4, 0.01))
    skin = SkinPressure(E_MPa=1.5, pressure_MPa=0.05, error_MPa=0.001, limit_MPa=0.06, worst="level")
    report = ReadingReport.from_stage(dataclasses.replace(unread, moduli=(row,), pressures=(skin,)))
    assert as_data(report.skin_pressure) == [{"E_MPa": 1.5, "pressure_MPa": 0.05, "limit_MPa": 0.06, "worst": "level"}]
    assert (report.E_bias_percent, report.E_bias_error_percent) == pytest.approx((2.0, 0.1))
    assert (report.uncertainty_percent, report.touch_fraction) == pytest.approx((5.0, 0.4))
    assert report.noise_for_10_percent == pytest.approx(math.sqrt(0.1**2 - 0.04**2))  # at a slope of 1
    assert report.sources == pytest.approx({"noise_N_percent": 3.0, "gain_percent": 4.0})
    (modulus,) = report.moduli
    assert (modulus.E_MPa, modulus.E_bias_percent, modulus.uncertainty_percent) == pytest.approx((1.5, -2.0, 5.0))
    assert (modulus.sources, modulus.worst) == (report.sources, str(worst))
    without = ReadingReport.from_stage(unread)
    assert (without.E_bias_percent, without.uncertainty_percent, without.sources) == (None, None, {})


def test_springs_that_were_not_made_are_null():
    report = stored_report(result_of(made=False))
    assert (report["housing"], report["behaviour"], report["accuracy"]["springs"]) == (None, None, None)
    assert (report["errors"]["K_l"], report["errors"]["K_h"]) == (None, None)
    kept = {"target_N_per_m"}
    assert {key for key, value in report["flexures"]["low"].items() if value is not None} == kept


@pytest.mark.parametrize(
    ("tables", "paper"),
    [
        (
            {
                "fruit": Fruit(E_MPa=(1.0, 3.0)),
                "press": PressMotion(tilt_deg=0.05),
                "tips": Tips(gap_mm=1.0, socket="pin"),
            },
            True,
        ),
        ({"fruit": Fruit(height_mm=20.0)}, False),
        ({"fruit": Fruit(E_max_MPa=5.0)}, False),
        ({"tips": Tips(side_mm=1.5)}, False),
        ({"tips": Tips(spacing_mm=7.0)}, False),
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
    row = stored_report(dataclasses.replace(result, press=lifted))["response"][0]
    assert row["P"][0] is None
    assert row["P"][1] == pytest.approx(ratios[0, 1])
    assert row["x_mm"][0] > 0.0


def test_response_of_a_square():
    """It has means of its kinds and every force, and errors of its springs in the shares of their tips."""
    tips = Tips(layout="square")
    forces = np.array([[[1.0, 5.0, 2.0, 7.0]]])
    one = np.ones((1, 1))
    table = SimpleNamespace(
        E=np.array([2.0]), x=np.array([0.6]), F=forces, P=one, slope_ratio=one, F_error=0.01 * one, P_error=0.02 * one
    )
    springs = SimpleNamespace(
        springs={
            "low": MadeSpring(target=1.0, K=1.0, K_error=0.01),
            "high": MadeSpring(target=20.0, K=20.0, K_error=0.03),
        },
        C=np.diag([1.0, 0.05, 1.0, 0.05]),
    )
    contact = dataclasses.replace(CONTACT, tips=tips.names, S=np.diag([0.5] * 4), shape_change=np.zeros((4, 4)))
    design = SimpleNamespace(tips=tips)
    pressed = SimpleNamespace(design=design, contact=contact, springs=springs, C=springs.C)
    (row,) = OF_SENSOR["response"](SimpleNamespace(design=design, pressed=pressed, press=SimpleNamespace(table=table)))
    assert (row.F_l_N, row.F_h_N, row.F_N) == ((1.5,), (6.0,), ((1.0,), (5.0,), (2.0,), (7.0,)))
    low, high = 0.01 * 1.0 / (1.0 + 0.25), 0.03 * 0.05 / (0.05 + 0.25)
    assert row.F_error_percent == pytest.approx((100.0 * (0.01 + max(low, high)),))
    assert row.P_error_percent == pytest.approx((100.0 * (0.02 + 2.0 * low + 2.0 * high),))


def test_scatter_stands_only_in_reports_on_fabrication():
    assert "tolerance" not in stored_report(result_of())
    assert stored_report(result_of(options=RunOptions(fabrication=True)))["tolerance"] is None


def test_number_that_is_not_finite_is_not_written(tmp_path):
    result = result_of()
    verdicts = (dataclasses.replace(result.verdicts[0], value=math.nan),)
    with pytest.raises(ValueError, match="JSON"):
        write_outputs(dataclasses.replace(result, verdicts=verdicts), tmp_path)
    assert not (tmp_path / "report.json").exists()


def test_relaxation_has_a_row_for_each_modulus_and_the_moment_at_which_a_reading_moves_least():
    result = relaxing_result()
    over_time, report = result.over_time, stored_report(result)["relaxation"]
    assert (report["stop_s"], report["at_s"]) == (over_time.t[over_time.stop], over_time.t[over_time.at])
    moves = (report["moves_percent"], report["moves_error_percent"])
    assert moves == pytest.approx((100.0 * over_time.moves.value, 100.0 * over_time.moves.error))
    assert report["moments"][0]["moves_percent"] == over_time.steadiest.moves_percent
    for key, numbers in (
        ("P", over_time.P),
        ("E_apparent_MPa", over_time.apparent),
        ("F_N", np.swapaxes(over_time.F, 1, 2)),
    ):
        np.testing.assert_allclose(np.array([row[key] for row in report["moduli"]], dtype=float), numbers)


def test_compliance_is_read_back_with_the_error_of_each_of_its_parts():
    contact = dataclasses.replace(CONTACT, difference_error=1e-4, s11_error=3e-4)
    found = ContactReport.from_stage(contact).compliance(contact.tips)
    assert (found.difference_error, found.s11_error) == pytest.approx((1e-4, 3e-4), rel=1e-12)
    np.testing.assert_array_equal(found.S, contact.S)


def test_fruit_that_sized_the_springs_is_told_where_contact_has_another_one():
    """The paper's formula is softer than the solved contact: springs follow from it, verdicts from the contact."""
    sizing = spring_sizing(Design(), CONTACT, RunOptions(fruit_stiffness="hayes"))
    report = SizingReport.from_stage(sizing, None)
    assert report.K_m_max_N_per_m != pytest.approx(1e3 * sizing.K_m_max_contact, rel=1e-3)
    assert report.fruit_stiffness == "hayes"
