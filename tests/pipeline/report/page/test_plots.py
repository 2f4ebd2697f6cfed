"""What plots say in words is what the report holds."""

import dataclasses

import numpy as np
import pytest

from pipeline.report.page.field_pictures import contact_radius, dome_pressure, flat_tip_pressure
from pipeline.report.page.live_model import live_data, live_model
from pipeline.report.page.response_plots import mean_pressures, modulus_plot, travel_plot


def with_value(report, name, value):
    """Return a report whose verdict of a name has another value."""
    changed = (dataclasses.replace(one, value=value) if one.name == name else one for one in report.verdicts)
    return dataclasses.replace(report, verdicts=tuple(changed))


def test_NL_and_spread_of_the_plots_are_those_of_the_verdicts(flat_page):
    report = with_value(with_value(flat_page.report, "NL", 0.0321), "P_displacement_independent", 0.077)
    assert "NL 3.21 %" in modulus_plot(report, ()).caption
    assert "at most 7.7 %" in travel_plot(report).caption
    without = dataclasses.replace(flat_page.report, verdicts=())
    assert "NL" not in modulus_plot(without, ()).caption
    assert "varies" not in travel_plot(without).caption


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
