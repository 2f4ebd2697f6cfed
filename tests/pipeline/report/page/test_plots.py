"""What plots say in words is what the report holds."""

import dataclasses
import re
from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.report.page.contact_picture import contact_picture
from pipeline.report.page.drawing.picture import SIZE
from pipeline.report.page.error_plots import budget_plot, pose_plot, speed_plot
from pipeline.report.page.fields import Fields, TipPressure
from pipeline.report.page.live_model import live_data, live_model
from pipeline.report.page.mangoes import seen_mangoes
from pipeline.report.page.response_plots import modulus_plot, travel_plot


def with_value(report, name, value):
    """Return a report whose verdict of a name has another value."""
    changed = (dataclasses.replace(one, value=value) if one.name == name else one for one in report.verdicts)
    return dataclasses.replace(report, verdicts=tuple(changed))


def with_moduli(report, *E_MPa):
    fruit = dataclasses.replace(report.design.fruit, E_MPa=E_MPa)
    return dataclasses.replace(report, design=dataclasses.replace(report.design, fruit=fruit))


def test_words_on_a_tilt_are_numbers_and_count_the_lines(flat_page):
    report, model = flat_page.report, live_model(flat_page.report)
    drawn = pose_plot(with_moduli(report, 0.5, 3.5), model)
    assert "nan" not in drawn.alt
    assert drawn.alt.startswith("2 lines")
    read = [model.modulus_read(E, report.design.press.travel_mm, tilt) for E in (0.5, 3.5) for tilt in (-1.0, 1.0)]
    errors = np.abs(100.0 * (np.array(read) / [0.5, 0.5, 3.5, 3.5] - 1.0))
    assert f"one degree moves E by up to {np.nanmax(errors):.3g} %" in drawn.caption


def test_lost_readings_at_one_degree_are_said(flat_page):
    def read_when_level(E, _, tilt_deg):
        return E if abs(tilt_deg) < 0.5 else float("nan")

    blind = SimpleNamespace(linear=True, by_ratio=True, modulus_read=read_when_level)
    assert "no reading at one degree" in pose_plot(flat_page.report, blind).caption


def test_NL_and_spread_of_the_plots_are_those_judged(flat_page):
    report = with_value(with_value(flat_page.report, "NL", 0.0321), "P_displacement_independent", 0.077)
    assert "NL 3.21 %" in modulus_plot(report, ()).caption
    assert "at most 7.7 %" in travel_plot(report).caption


def test_plots_of_a_design_without_these_verdicts_say_neither(flat_page):
    report = dataclasses.replace(flat_page.report, verdicts=())
    assert "NL" not in modulus_plot(report, ()).caption
    assert "varies" not in travel_plot(report).caption


def levels_of(picture, label):
    """Return how far down the texts of a picture stand that match a label [pt], in ascending order."""
    return sorted(float(level) for level in re.findall(rf' y="([-\d.]+)"[^>]*>{label}</text>', picture.svg))


def test_moduli_of_equal_P_are_named_apart_and_on_the_sheet(flat_page):
    row = flat_page.report.response[0]
    rows = tuple(dataclasses.replace(row, E_MPa=E, P=(1.1,) * len(row.P)) for E in np.arange(1.0, 8.0))
    levels = levels_of(travel_plot(dataclasses.replace(flat_page.report, response=rows)), r"\d MPa")
    assert len(levels) == len(rows)
    assert np.diff(levels).min() >= 10.99  # 11 pt apart, written to 0.01
    assert levels[0] > 0.0
    assert levels[-1] < SIZE[1]


def test_springs_of_equal_speed_and_error_are_named_apart(flat_page):
    report = flat_page.report
    springs = {
        name: dataclasses.replace(spring, seconds=0.5, error_percent=0.05) for name, spring in report.springs.items()
    }
    levels = levels_of(speed_plot(dataclasses.replace(report, springs=springs)), r"\w+ spring: 0.05 %")
    assert len(levels) == 2
    assert np.diff(levels).min() >= 10.99


def test_rows_of_the_budget_have_a_tick_each(flat_page):
    """Ticks at the middle of each row of 36 pt, below the 26 pt of the legend."""
    errors = flat_page.report.errors
    budget = next(one for one in errors.values() if one is not None)
    drawn = budget_plot(dataclasses.replace(flat_page.report, errors=dict.fromkeys(("a", "b", "c"), budget)))
    assert re.findall(r"M62\.00 ([\d.]+)h-", drawn.svg) == ["116.00", "80.00", "44.00"]


def test_only_what_is_drawn_is_explained(flat_page):
    report = flat_page.report
    nothing = (None,) * len(report.curve.P)
    unknown = {f"E_{end}_{kind}_MPa": nothing for end in ("lower", "upper") for kind in ("as_printed", "calibrated")}
    bare = dataclasses.replace(report, curve=dataclasses.replace(report.curve, **unknown))
    drawn = modulus_plot(bare, ())
    assert "mangoes" not in drawn.caption
    assert "E that may show P" not in drawn.svg
    assert "E that may show P" in modulus_plot(report, ()).svg
    assert "mangoes" in modulus_plot(report, seen_mangoes(report)).caption


@pytest.mark.parametrize("times", [1.0, 50.0])
def test_contact_shows_tips_at_any_depth_in_their_proportions(flat_page, times):
    """A flat tip is drawn from its depth, the compliance times force over modulus, to one side above the skin."""
    report = flat_page.report
    compliance = tuple(tuple(times * value for value in row) for row in report.contact.compliance_per_mm)
    deep = dataclasses.replace(report, contact=dataclasses.replace(report.contact, compliance_per_mm=compliance))
    pressure = TipPressure(places=np.array([-0.1, 0.1]), pressure=np.array([1.0, 1.0]))
    drawn = contact_picture(deep, Fields(flexure=None, pressures=(pressure, pressure))).svg
    box = re.search(r'section-low-clip"><rect x="[\d.]+" y="([\d.]+)" .*?height="([\d.]+)"', drawn)
    top, height = (float(text) for text in box.groups())
    tip = re.search(r'id="section-low-clip".*?d="(M[-\d. L]+)" style="fill:none', drawn, re.DOTALL)[1]
    places = np.array([pair.split() for pair in tip[1:].split("L")], dtype=float)
    row = max(report.response, key=lambda one: one.E_MPa)
    depth = compliance[0][0] * row.tip_forces[0][-1] / row.E_MPa
    side = report.design.tips.side_mm
    foot = places[:, 1].max()
    assert top < foot < top + height
    assert (foot - places[:, 1].min()) / np.ptp(places[:, 0]) == pytest.approx((side + depth) / side, rel=1e-3)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, "true proportions, the"),
        ({"roll_deg": 0.5}, "true proportions (drawn level), the"),
        ({"tilt_deg": 0.5, "strain": "large"}, "(drawn level and as deep as by the linear law), the"),
    ],
)
def test_contact_says_how_tips_are_drawn(flat_page, changes, said):
    design = flat_page.report.design
    pressed = dataclasses.replace(design, press=dataclasses.replace(design.press, **changes))
    pressure = TipPressure(places=np.array([-0.1, 0.1]), pressure=np.array([1.0, 1.0]))
    fields = Fields(flexure=None, pressures=(pressure, pressure))
    assert said in contact_picture(dataclasses.replace(flat_page.report, design=pressed), fields).caption


def test_sliders_judge_by_the_verdicts_of_the_report(flat_page):
    data = live_data(flat_page.report, live_model(flat_page.report))["judged"]
    assert set(data) == {"P_max", "NL", "P_displacement_independent"}
    for verdict in flat_page.report.verdicts:
        if verdict.name in data:
            assert data[verdict.name]["limit"] == pytest.approx(verdict.limit)
            assert data[verdict.name]["tolerance"] == pytest.approx(verdict.tolerance)
    nothing = dataclasses.replace(flat_page.report, verdicts=())
    assert live_data(nothing, live_model(nothing))["judged"] == {}


def test_sliders_read_by_the_read_out_of_the_report(flat_page):
    """Gaps that weight has changed, which do not follow from the design alone."""
    known = {"weights": (-0.5, 0.5), "gaps_mm": (0.17, 0.2), "fruit_per_mm": ((0.7, 0.1), (0.1, 0.7)), "hertz": 0.4}
    read_out = dataclasses.replace(flat_page.report.read_out, **known)
    report = dataclasses.replace(flat_page.report, read_out=read_out)
    data = live_data(report, live_model(report))
    assert data["C"] == [list(row) for row in read_out.springs_mm_per_N]
    assert (data["contrast"]["gaps"], data["contrast"]["S"]) == (known["gaps_mm"], known["fruit_per_mm"])
    assert (data["contrast"]["weights"], data["contrast"]["hertz"]) == (known["weights"], known["hertz"])
