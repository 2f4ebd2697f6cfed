"""What plots say in words is what the report holds."""

import dataclasses
import re
from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.report.page.drawing.picture import SIZE
from pipeline.report.page.error_plots import budget_plot, pose_plot, speed_plot
from pipeline.report.page.field_pictures import contact_radius, dome_pressure, flat_tip_pressure, flexure_picture
from pipeline.report.page.live_model import live_data, live_model
from pipeline.report.page.mangoes import seen_mangoes
from pipeline.report.page.response_plots import mean_pressures, modulus_plot, travel_plot


def with_value(report, name, value):
    """Return a report whose verdict of a name has another value."""
    changed = (dataclasses.replace(one, value=value) if one.name == name else one for one in report.verdicts)
    return dataclasses.replace(report, verdicts=tuple(changed))


def test_words_on_a_tilt_are_the_readings_at_one_degree(flat_page):
    report = flat_page.report
    fruit = dataclasses.replace(report.design.fruit, E_MPa=(0.5, 3.5))
    report = dataclasses.replace(report, design=dataclasses.replace(report.design, fruit=fruit))
    model = live_model(flat_page.report)
    read = [model.modulus_read(E, report.design.press.travel_mm, tilt) for E in (0.5, 3.5) for tilt in (-1.0, 1.0)]
    errors = np.abs(100.0 * (np.array(read) / [0.5, 0.5, 3.5, 3.5] - 1.0))
    assert f" {np.nanmax(errors):.3g} %" in pose_plot(report, model).caption


def test_lost_readings_at_one_degree_are_said(flat_page):
    def read_when_level(E, _, tilt_deg):
        return E if abs(tilt_deg) < 0.5 else float("nan")

    blind = SimpleNamespace(linear=True, by_ratio=True, modulus_read=read_when_level)
    assert "no reading at one degree" in pose_plot(flat_page.report, blind).caption


def test_NL_and_spread_of_the_plots_are_those_of_the_verdicts(flat_page):
    report = with_value(with_value(flat_page.report, "NL", 0.0321), "P_displacement_independent", 0.077)
    assert "NL 3.21 %" in modulus_plot(report, ()).caption
    assert "at most 7.7 %" in travel_plot(report).caption
    without = dataclasses.replace(flat_page.report, verdicts=())
    assert "NL" not in modulus_plot(without, ()).caption
    assert "varies" not in travel_plot(without).caption


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
    assert levels[-1] < SIZE.height


def test_springs_of_equal_speed_and_error_are_named_apart(flat_page):
    report = flat_page.report
    springs = {
        name: dataclasses.replace(spring, seconds=0.5, error_percent=0.05) for name, spring in report.flexures.items()
    }
    levels = levels_of(speed_plot(dataclasses.replace(report, flexures=springs)), r"\w+ spring: 0.05 %")
    assert np.diff(levels) == pytest.approx([11.0], abs=0.011)


def test_rows_of_the_budget_have_a_tick_each(flat_page):
    """Ticks at the middle of each row of 36 pt, below the 26 pt of the legend."""
    budget = next(one for one in flat_page.report.errors.values() if one is not None)
    drawn = budget_plot(dataclasses.replace(flat_page.report, errors=dict.fromkeys(("a", "b", "c"), budget)))
    assert re.findall(r"M62\.00 ([\d.]+)h-", drawn.svg) == ["116.00", "80.00", "44.00"]


def test_only_what_is_drawn_is_explained(flat_page):
    report = flat_page.report
    nothing = (None,) * len(report.curve.P)
    unknown = {f"E_{end}_{kind}_MPa": nothing for end in ("lower", "upper") for kind in ("as_printed", "calibrated")}
    bare = dataclasses.replace(report, curve=dataclasses.replace(report.curve, **unknown))
    assert "E that may show P" not in modulus_plot(bare, ()).svg
    assert "E that may show P" in modulus_plot(report, ()).svg
    assert "mangoes" in modulus_plot(report, seen_mangoes(report)).caption


def test_pressure_of_a_flat_tip_carries_its_force(flat_page):
    """Under a punch the pressure is least in the middle and its mean is force over face."""
    row = flat_page.report.response[-1]
    force = row.tip_forces[1][-1]
    tip = flat_tip_pressure(flat_page.result, 1, force)
    side = flat_page.report.design.tips.side_mm
    assert tip.mean == pytest.approx(force / side**2)
    assert tip.pressure.argmin() == pytest.approx(len(tip.x) / 2, abs=2)
    assert tip.pressure.min() < tip.mean < tip.pressure.max()
    assert mean_pressures(flat_page.report, row)[-1] == pytest.approx(tip.mean)


@pytest.mark.slow
def test_pressure_of_a_dome_carries_its_force(dome_page):
    row = dome_page.report.response[-1]
    force = max(forces[-1] for forces in row.tip_forces)
    tip = dome_pressure(dome_page.report, row.E_MPa, force)
    radius = contact_radius(dome_page.report, row.E_MPa, force)
    right = tip.x >= 0.0
    carried = 2.0 * np.pi * np.trapezoid(tip.x[right] * tip.pressure[right], tip.x[right])
    assert (tip.x[-1], carried) == (pytest.approx(radius), pytest.approx(force, rel=2e-3))
    assert mean_pressures(dome_page.report, row)[-1] == pytest.approx(tip.mean)


def test_flexure_is_coloured_over_its_whole_middle_plane(flat_page):
    """The polygons of all colours cover what the part covers at rest, as its deflection is small."""

    def area(path):
        polygons = [np.array([pair.split() for pair in part[1:].split("L")], float) for part in path.split("Z")[:-1]]
        x, y = np.array(polygons).transpose(2, 0, 1)
        return np.abs(0.5 * (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1)).sum()

    drawn = flexure_picture(flat_page.report, flat_page.result)
    paths = re.findall(r'<path d="(M[^"]+Z)" style="fill:(var\(--muted\)|#\w+)', drawn.svg)
    at_rest = sum(area(path) for path, colour in paths if colour == "var(--muted)")
    bent = sum(area(path) for path, colour in paths[1:] if path.count("Z") > 1)
    assert bent == pytest.approx(at_rest, rel=0.02)


def test_sliders_use_the_verdicts_and_the_read_out_of_the_report(flat_page):
    """Gaps that weight has changed do not follow from the design alone."""
    law = {"weights": (-0.5, 0.5), "gaps_mm": (0.17, 0.2), "fruit_per_mm": ((0.7, 0.1), (0.1, 0.7)), "hertz": 0.4}
    read_out = dataclasses.replace(flat_page.report.read_out, **law)
    report = dataclasses.replace(flat_page.report, read_out=read_out)
    data = live_data(report, live_model(report))
    assert data["C"] == [list(row) for row in read_out.springs_mm_per_N]
    contrast = data["contrast"]
    assert [contrast[key] for key in ("weights", "gaps", "S", "hertz")] == list(law.values())
    limits = {verdict.name: (verdict.limit, verdict.tolerance) for verdict in report.verdicts}
    assert set(data["judged"]) == {"P_max", "NL", "P_displacement_independent"}
    for name, verdict in data["judged"].items():
        assert (verdict["limit"], verdict["tolerance"]) == limits[name]
