"""The sliders compute what Python computes, in a browser, from the numbers of the report."""

import math

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from cad.theory.contrast_law import read_modulus
from cad.theory.two_spring_law import SOFTEST, Springs, force_ratio, fruit_stiffness, nonlinearity
from pipeline.report.page.live_model import live_data, live_model
from pipeline.response.scene_press import TRAVELS
from pipeline.verdicts.rules import displacement_verdict
from solve.contact.linear_response import linear_response, travels

pytestmark = pytest.mark.slow
RELATIVE = 1e-9
NEAR_LIFT = 1e-6  # [N]: a force so near to nothing is a difference of numbers of order 1
NAMES = ("low", "high")


def inputs(rng, report, count):
    """Return random settings over the whole range of the sliders."""
    K = [1e-3 * report.flexures[name].K_N_per_m for name in NAMES]
    rows = rng.uniform(size=(count, 5))
    return [
        {
            "E": 0.5 + 3.0 * a,
            "travel": 0.05 + 0.55 * b,
            "tilt": -8.0 + 16.0 * c,
            "K": {"low": K[0] * (0.5 + 1.5 * d), "high": K[1] * (0.5 + 1.5 * e)},
        }
        for a, b, c, d, e in rows
    ]


def evaluated(page, settings):
    return page.evaluate("settings => settings.map(window.twintip.evaluate)", settings)


def by_python(model, one):
    C = model.C.copy()
    np.fill_diagonal(C, [1.0 / one["K"][name] for name in NAMES])
    ahead = model.along * math.tan(math.radians(one["tilt"])) + model.ahead
    return C, linear_response(model.S, C, [one["E"]], [one["travel"]], ahead.tolist()).F[0, 0]


def scene_of_python(model, report, one, C):
    """Return P_max, NL and the worst spread of P that linear forces give at a travel and a tilt."""
    ahead = (model.along * math.tan(math.radians(one["tilt"])) + model.ahead).tolist()
    E_max, E = report.design.fruit.E_max_MPa, report.design.fruit.E_MPa
    P = linear_response(model.S, C, [SOFTEST * E_max, 0.5 * E_max, E_max], [one["travel"]], ahead).P[:, 0]
    table = linear_response(model.S, C, E, travels(one["travel"], TRAVELS), ahead)
    NL = (P[1] - P[0]) / (P[2] - P[0]) - 0.5
    return P[2], NL, displacement_verdict(table).value


def known(value):
    return None if value is None or math.isnan(value) else pytest.approx(value, rel=1e-6, abs=1e-9)


def test_targets_at_a_tilt_are_judged_by_the_forces_there(flat_page, open_page, rng):
    model, settings = live_model(flat_page.report), inputs(rng, flat_page.report, 60)
    tilts = rng.uniform(-1.0, 1.0, len(settings))
    settings = [{**one, "tilt": tilt} for one, tilt in zip(settings, tilts.tolist(), strict=True)]
    found = evaluated(open_page(flat_page.address), settings)
    assert sum(numbers["NL"] is not None for numbers in found) > 10
    for one, numbers in zip(settings, found, strict=True):
        C, _ = by_python(model, one)
        P_max, NL, spread = scene_of_python(model, flat_page.report, one, C)
        assert (numbers["P_max"], numbers["NL"], numbers["spread"]) == (known(P_max), known(NL), known(spread))


@pytest.mark.parametrize("tilt", [1.0, -2.0])
def test_tilt_that_ruins_the_reading_does_not_pass(flat_page, open_page, tilt):
    page = open_page(flat_page.address)
    assert "Everything judged here passes" in page.inner_text("#live-answer")
    page.evaluate(
        "tilt => { const one = document.getElementById('live-tilt'); one.value = tilt;"
        " one.dispatchEvent(new Event('input')); }",
        tilt,
    )
    answer = page.inner_text("#live-answer")
    assert "P at the largest modulus, P_max" in answer
    assert "spread of P over the travel" in answer


def test_linear_forces_are_those_of_python(flat_page, open_page, rng):
    model, settings = live_model(flat_page.report), inputs(rng, flat_page.report, 400)
    found = evaluated(open_page(flat_page.address), settings)
    lifted = 0
    for one, numbers in zip(settings, found, strict=True):
        C, F = by_python(model, one)
        lifted += not (F > 0.0).all()
        assert numbers["F"] == pytest.approx(F, rel=RELATIVE, abs=RELATIVE * NEAR_LIFT)
        springs = Springs(K_l=1.0 / C[0, 0], K_h=1.0 / C[1, 1])
        if (F > 0.0).all():
            assert numbers["P"] == pytest.approx(F[1] / F[0], rel=RELATIVE)
            if 1.0 < F[1] / F[0] < springs.K_h / springs.K_l and numbers["E_read"] < 100.0:
                read = fruit_stiffness(springs, F[1] / F[0]) / model.K_m_over_E
                assert numbers["E_read"] == pytest.approx(read, rel=1e-6)  # near K_h / K_l it loses digits
        else:
            assert numbers["P"] is None
    assert 20 < lifted < 380


def test_level_settings_are_the_rows_of_the_report(flat_page, open_page):
    report = flat_page.report
    page = open_page(flat_page.address)
    K = {name: 1e-3 * report.flexures[name].K_N_per_m for name in NAMES}
    for row in report.response:
        settings = [{"E": row.E_MPa, "travel": x, "tilt": 0.0, "K": K} for x in row.x_mm]
        found = evaluated(page, settings)
        assert [one["P"] for one in found] == pytest.approx(row.P, rel=RELATIVE)
        for tip, force in enumerate(row.tip_forces):
            assert [one["F"][tip] for one in found] == pytest.approx(force, rel=RELATIVE)
        assert [one["E_read"] for one in found] == pytest.approx([row.E_MPa] * len(found), rel=1e-6)


def test_level_targets_are_those_of_the_two_spring_law(flat_page, open_page, rng):
    model = live_model(flat_page.report)
    settings = [{**one, "tilt": 0.0} for one in inputs(rng, flat_page.report, 50)]
    for one, numbers in zip(settings, evaluated(open_page(flat_page.address), settings), strict=True):
        springs = Springs(K_l=one["K"]["low"], K_h=one["K"]["high"])
        K_m = 3.5 * model.K_m_over_E
        assert numbers["P_max"] == pytest.approx(force_ratio(springs, K_m), rel=RELATIVE)
        assert numbers["NL"] == pytest.approx(nonlinearity(springs, K_m), rel=1e-8)  # a difference of numbers near 1
        assert numbers["spread"] < RELATIVE


def test_table_is_read_between_its_rows(dome_page, open_page, rng):
    report = dome_page.report
    table = live_data(report, live_model(report))["table"]
    settings = inputs(rng, report, 100)
    found = evaluated(open_page(dome_page.address), settings)
    places = [(one["E"], one["travel"]) for one in settings]
    for tip in range(len(report.tips)):
        values = np.array([row[tip] for row in table["F"]])
        expected = RegularGridInterpolator((table["E"], table["x"]), values)(places)
        assert [one["F"][tip] for one in found] == pytest.approx(expected, rel=RELATIVE)


def test_moving_a_slider_changes_what_is_shown(flat_page, open_page):
    page = open_page(flat_page.address)
    before = page.inner_text("#live-numbers")
    page.focus("#live-E")
    page.keyboard.press("End")
    after = page.inner_text("#live-numbers")
    last = flat_page.report.response[-1].last_P
    assert before != after
    assert f"force ratio P\t{float(f'{last:.4g}'):g}" in after
    page.click("#live-reset")
    assert page.inner_text("#live-numbers") == before


def test_a_softer_spring_fails_its_target_at_once(flat_page, open_page):
    page = open_page(flat_page.address)
    assert "failed" not in page.inner_text("#live-numbers")
    page.focus("#live-K-low")
    page.keyboard.press("Home")
    assert "P at the largest modulus, P_max" in page.inner_text("#live-answer")


def test_what_the_table_does_not_cover_cannot_be_moved(dome_page, open_page):
    page = open_page(dome_page.address)
    assert page.is_enabled("#live-E")
    assert page.is_enabled("#live-travel")
    assert [page.is_disabled(f"#live-{key}") for key in ("tilt", "K-low", "K-high")] == [True] * 3
    assert "interpolated in the table" in page.inner_text("#live")


def test_contrast_is_read_as_python_reads_it(flat_page, open_page, rng):
    """On numbers of a square of domes, put in the place of the page's own."""
    S = 0.03 + 0.26 * np.eye(4)
    C = np.diag([6.7, 0.6, 6.7, 0.6])
    law = {"weights": [-0.5, 0.5, -0.5, 0.5], "gaps": [0.1] * 4, "C": C.tolist(), "S": S.tolist(), "hertz": 0.4}
    from cad.theory.contrast_law import ContrastLaw

    known = ContrastLaw(**law)
    page = open_page(flat_page.address)
    springs = ["low", "high", "low", "high"]
    own = {"contrast": law, "S": law["S"], "C": law["C"], "springs": springs, "soft": [0, 2], "stiff": [1, 3]}
    own |= {"along": [-3.0, 3.0, 3.0, -3.0], "ahead": [0.0] * 4, "names": springs}
    page.evaluate("own => Object.assign(window.twintip.data, own)", own)
    settings = [
        {"E": E, "travel": 0.5, "tilt": 0.0, "K": {"low": 1 / 6.7, "high": 1 / 0.6}} for E in rng.uniform(0.5, 3.5, 50)
    ]
    found = evaluated(page, settings)
    expected = [read_modulus(known, one["F"]) for one in found]
    assert [one["E_read"] for one in found] == pytest.approx(expected, rel=RELATIVE)
