"""The sliders compute what Python computes, in a browser, from the numbers of the page."""

import numpy as np
import pytest
from law_settings import SETTINGS, compliance_of, forces_by_python, modulus_errors, random_settings

from cad.theory.contrast_law import ContrastLaw, contrast_slopes, read_modulus
from cad.theory.two_spring_law import SOFTEST, Springs, fruit_stiffness
from pipeline.options import load_design
from pipeline.response.scene_press import TRAVELS
from pipeline.verdicts.rules import displacement_verdict
from solve.contact.linear_response import linear_response, travels

FEWER = 300  # Python solves each setting of domes; SETTINGS in the studies
pytestmark = pytest.mark.slow
EXACT = 1e-9
"""Of the modulus: both solve one set of equations; round-off over the least slope of a force."""
INTERPOLATED = 1e-3


def evaluated(page, settings):
    return page.evaluate("all => all.map(window.twintip.law.evaluate)", settings)


def test_linear_forces_are_those_of_python(flat_page, open_page, rng):
    page = open_page(flat_page.address)
    settings = random_settings(page, rng, SETTINGS)
    assert modulus_errors(page, flat_page.result, settings).max() <= EXACT


def test_forces_of_domes_are_those_of_python(dome_page, open_page, rng):
    page = open_page(dome_page.address)
    settings = random_settings(page, rng, FEWER)
    assert {"tilt", "place", "radius"} <= set(settings[0])
    assert modulus_errors(page, dome_page.result, settings).max() <= EXACT


def test_planted_wrong_law_is_found(flat_page, open_page, rng):
    page = open_page(flat_page.address)
    page.evaluate("window.twintip.law.data.S[0][0] *= 1.01")
    assert modulus_errors(page, flat_page.result, random_settings(page, rng, 50)).max() > INTERPOLATED


@pytest.mark.study
@pytest.mark.parametrize(
    "name", ["paper", "mango", "mango-sharp", "compact", "compact-sharp", "docs/examples/fouly.toml", "paper-on-mango"]
)
def test_law_of_every_preset_is_that_of_python(name, preset_page, open_page, rng):
    written = preset_page(load_design(name, {}))
    page = open_page(written.address)
    kind = page.evaluate("() => window.twintip.law.data.kind")
    errors = modulus_errors(page, written.result, random_settings(page, rng, SETTINGS))
    assert errors.max() <= (INTERPOLATED if kind == "table" else EXACT)


def known(value):
    return None if value is None or np.isnan(value) else pytest.approx(value, rel=1e-6, abs=1e-9)


def test_targets_at_a_tilt_are_judged_by_the_forces_there(flat_page, open_page, rng):
    page = open_page(flat_page.address)
    settings = random_settings(page, rng, 60)
    result, design = flat_page.result, flat_page.report.design
    x = np.array([x for x, _ in design.tips.places_mm])
    for setting in settings:
        setting["tilt"] = float(rng.uniform(-1.0, 1.0))
    for setting, found in zip(settings, evaluated(page, settings), strict=True):
        heights = ((x - x.mean()) * np.tan(np.radians(setting["tilt"]))).tolist()
        C, travel, E_max = compliance_of(result, setting), setting["travel"], design.fruit.E_max_MPa
        moduli = [SOFTEST * E_max, 0.5 * E_max, E_max]
        P = linear_response(result.contact.S, C, moduli, [travel], heights).P[:, 0]
        table = linear_response(result.contact.S, C, design.fruit.E_MPa, travels(travel, TRAVELS), heights)
        NL = (P[1] - P[0]) / (P[2] - P[0]) - 0.5
        spread = displacement_verdict(table).value
        assert (found["P_max"], found["NL"], found["spread"]) == (known(P[2]), known(NL), known(spread))


def test_noise_of_a_pair_is_that_of_its_ratio(flat_page, open_page, rng):
    """dE/E by P: with both noises apart, sd(P)/P is that of two forces, and dE/dP a difference of the law."""
    page = open_page(flat_page.address)
    full_scale = np.array(flat_page.report.read_out.full_scale_N)
    settings = [{**setting, "tilt": 0.0, "travel": 0.6} for setting in random_settings(page, rng, 30)]
    K_m_over_E = flat_page.result.contact.K_m_over_E()
    F = forces_by_python(flat_page.result, "linear", settings)
    for setting, found, forces in zip(settings, evaluated(page, settings), F, strict=True):
        springs = Springs(K_l=setting["K"]["low"], K_h=setting["K"]["high"])
        P = forces[1] / forces[0]
        step = 1e-6 * P
        slope = (fruit_stiffness(springs, P + step) - fruit_stiffness(springs, P - step)) / (2 * step) / K_m_over_E
        expected = slope * P * np.hypot(*(1e-2 * setting["noise"] * full_scale / forces))
        assert found["noise"] == pytest.approx(expected, rel=1e-3)


SQUARE = {"weights": [-0.5, 0.5, -0.5, 0.5], "gaps": [0.1] * 4, "hertz": 0.4}
SQUARE |= {"C": np.diag([6.7, 0.6, 6.7, 0.6]).tolist(), "S": (0.03 + 0.26 * np.eye(4)).tolist()}


def test_contrast_and_its_noise_are_read_as_python_reads_them(open_page, rng, flat_page):
    """On numbers of a square of domes, put in the place of those of a mango's square that was not solved."""
    page = open_page(flat_page.address)
    law = ContrastLaw(**SQUARE)
    springs = ["low", "high", "low", "high"]
    own = {"contrast": SQUARE, "S": SQUARE["S"], "C": SQUARE["C"], "springs": springs, "low": [0, 2], "high": [1, 3]}
    own |= {
        "lean": None,
        "x": [-3.0, 3.0, 3.0, -3.0],
        "y": [0.0] * 4,
        "heights": [0.0] * 4,
        "level": [],
        "full_scale": [2.0] * 4,
    }
    moduli = rng.uniform(0.5, 3.5, 50).tolist()
    found = page.evaluate(
        "([own, moduli]) => { const law = sensorLaw({ ...window.twintip.law.data, ...own });"
        " return moduli.map((E) => law.evaluate({ ...law.start, E, travel: 0.5, noise: 0.5 })); }",
        [own, moduli],
    )
    for numbers in found:
        E = read_modulus(law, numbers["F"])
        assert numbers["E_read"] == pytest.approx(E, rel=EXACT)
        slopes = np.array(contrast_slopes(law, numbers["F"], E).forces)
        assert numbers["noise"] == pytest.approx(E * np.linalg.norm(slopes * 0.005 * 2.0), rel=1e-4)


def test_moving_a_slider_changes_numbers_and_plots(flat_page, open_page):
    page = open_page(flat_page.address)
    before = page.inner_text("#numbers")
    plots = page.inner_html("#plots")
    page.focus("#slider-E")
    page.keyboard.press("End")
    page.wait_for_function("(before) => document.getElementById('numbers').innerText !== before", arg=before)
    last = flat_page.result.press.table.P[-1, -1]
    assert f"force ratio P\t{float(f'{last:.4g}'):g}" in page.inner_text("#numbers")
    assert page.inner_html("#plots") != plots
    page.click("#reset")
    assert page.inner_text("#numbers") == before


@pytest.mark.parametrize(("slider", "key"), [("K-low", "Home"), ("tilt", "End")])
def test_setting_that_misses_the_targets_does_not_pass(slider, key, flat_page, open_page):
    page = open_page(flat_page.address)
    assert page.locator("#numbers .failed").count() == 0
    page.focus(f"#slider-{slider}")
    page.keyboard.press(key)
    page.wait_for_selector("#numbers .failed")
    assert "P_max" in page.inner_text("#live-answer")
