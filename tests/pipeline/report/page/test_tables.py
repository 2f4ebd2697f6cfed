"""The sliders play presses of the run: between them the page agrees with a solve, and it holds no others."""

import dataclasses
import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from stand_ins import result_of

from pipeline.options import load_design
from pipeline.reading.measurement import rise_model
from pipeline.reading.poses import Placement
from pipeline.reading.read_out import LevelReading
from pipeline.report.page.tables import noise_percent, page_tables, press_reader, ratio_reader, read_presses
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.reading import PRESS_SAMPLES, ReadingRequirements
from sensor.theory.two_spring_law import fruit_stiffness
from solve.contact.response import scene_response

AGREEMENT = 2e-3
"""Of every number, as the page promises: a tenth of what the forces of a design may be off by its fruit."""
ONE_SAMPLE = 1.0 / 8.0
"""Of the noise of a press: its 16 samples count from the touch of the last tip, which comes by half of the travel."""
SIDE = 16  # random values of each of two sliders, one in each sixteenth of its range: 256 settings
SLOPE_STEP = 1e-6  # of P, for the slope of the two-spring law


def random_settings(page, rng, key):
    """Return random moduli and values of another slider over their whole ranges, and a setting for each pair."""
    ends = page.evaluate("() => Object.fromEntries(window.twintip.sliders.map((s) => [s.key, [s.min, s.max]]))")
    moduli, values = (
        least + (np.arange(SIDE) + rng.random(SIDE)) / SIDE * (largest - least)
        for least, largest in (ends["E"], ends[key])
    )
    settings = [{"E": E, key: value} for E, value in itertools.product(moduli.tolist(), values.tolist())]
    return moduli, values, settings


def evaluated(page, settings):
    """Return the numbers of the page as arrays, each (settings,) or (settings, tips), nan where there is none."""
    found = page.evaluate("all => all.map((one) => window.twintip.at(one))", settings)
    return {key: np.array([one[key] for one in found], dtype=float) for key in found[0]}


def off(found, expected):
    """Return by how much numbers are off at most, over those of a solve, for each setting [1]."""
    errors = np.abs(found / expected - 1.0)
    return errors.reshape(len(errors), -1).max(axis=1)


def pair_over_noise(result, F):
    """Return a modulus over its deviation by one per cent of noise [1]: by the slope of the two-spring law over P."""
    P = F[:, 1] / F[:, 0]
    springs = result.springs.stiffnesses
    one_percent = 0.01 * np.array(result.read_out.full_scale_N)
    noise = []
    for ratio, forces in zip(P.tolist(), F, strict=True):
        above, below = (fruit_stiffness(springs, ratio * (1.0 + side * SLOPE_STEP)) for side in (1.0, -1.0))
        slope = (above - below) / (2.0 * SLOPE_STEP) / fruit_stiffness(springs, ratio)
        noise.append(slope * np.linalg.norm(one_percent / forces))
    return 1.0 / np.array(noise)


def solved_over_travel(result, moduli, travels):
    """Return the numbers of presses, on the cells of the run where there are any."""
    full = result.design.press.travel_mm  # the cells follow from the farthest travel
    solved = scene_response(result.press.scene, result.contact, result.springs.C, moduli, [*travels, full])
    pressure = solved.F / result.design.tips.face_mm2 if solved.mean_pressure is None else solved.mean_pressure
    count = len(moduli) * len(travels)
    numbers = {name: each[:, :-1].reshape(count, -1) for name, each in (("F", solved.F), ("pressure", pressure))}
    numbers["P"] = solved.P[:, :-1].ravel()
    if result.read_out.is_pair and result.press.level:
        numbers["E_read"] = np.repeat(moduli, len(travels))
        numbers["E_over_noise"] = pair_over_noise(result, numbers["F"])
    return numbers


def solved_over_tilt(result, moduli, tilts):
    """Return the numbers of whole presses, whose readings have as much less noise as a hand takes more samples."""
    solved = result.pressed.presses(moduli.tolist(), [Placement(tilt_deg=(tilt, 0.0)) for tilt in tilts])
    count = len(moduli) * len(tilts)
    F, pressure = (each[:, :, -1].reshape(count, -1) for each in (solved.F, solved.mean_pressure))
    model, noises = rise_model(result.pressed), 0.01 * np.array(result.read_out.full_scale_N)
    found = [model.read(press, noises) for press in solved.F.reshape(count, *solved.F.shape[2:])]
    springs = np.array(result.design.tips.springs)
    return {
        "F": F,
        "P": F[:, springs == "high"].sum(axis=1) / F[:, springs == "low"].sum(axis=1),
        "pressure": pressure,
        "E_read": np.array([each.E for each in found]),
        "E_over_noise": np.sqrt(PRESS_SAMPLES / solved.F.shape[2]) / np.array([each.noise for each in found]),
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "key", "solved"),
    [
        ("paper", "travel", solved_over_travel),
        ("mango", "tilt", solved_over_tilt),
        pytest.param("mango", "travel", solved_over_travel, marks=pytest.mark.study),
        pytest.param("kiwi", "travel", solved_over_travel, marks=pytest.mark.study),
        pytest.param("docs/examples/fouly.toml", "travel", solved_over_travel, marks=pytest.mark.study),
    ],
)
def test_numbers_over_a_slider_are_those_of_a_solve(name, key, solved, preset_page, open_page, rng):
    written = preset_page(load_design(name))
    page = open_page(written.address, webgl=False)
    moduli, values, settings = random_settings(page, rng, key)
    found = evaluated(page, settings)
    for number, of_solve in solved(written.result, moduli, values).items():
        bar = ONE_SAMPLE if (key, number) == ("tilt", "E_over_noise") else AGREEMENT
        assert off(found[number], of_solve).max() <= bar, number


@pytest.mark.slow
def test_tilt_takes_the_travel_to_the_full_one_and_the_travel_the_tilt_back(preset_page, open_page):
    written = preset_page(load_design("mango"))
    design = written.result.design
    page = open_page(written.address, webgl=False)
    page.focus("#slider-travel")
    page.keyboard.press("Home")
    page.locator("details:has(#more-sliders) summary").click()
    page.focus("#slider-tilt")
    for key, tilt in (("Home", -design.reading.tilt_deg), ("End", design.reading.tilt_deg)):
        page.keyboard.press(key)
        state = page.evaluate("() => ({ ...window.twintip.setting })")
        assert (state["travel"], state["tilt"]) == (design.press.travel_mm, tilt)
    assert float(page.input_value("#slider-travel")) == design.press.travel_mm
    page.focus("#slider-travel")
    page.keyboard.press("Home")
    assert page.evaluate("() => window.twintip.setting.tilt") == 0.0


@pytest.mark.slow
def test_nothing_is_told_beyond_a_table(flat_page, open_page):
    page = open_page(flat_page.address, webgl=False)
    beyond = [{"E": 4.0}, {"travel": 0.61}, {"travel": 0.05}, {"tilt": 0.5}]
    for found in page.evaluate("all => all.map((one) => window.twintip.at(one))", beyond):
        assert found == {"F": [None, None], "pressure": [None, None], "P": None, "E_read": None, "E_over_noise": None}


def tables_of(written):
    return page_tables(written.report, written.result)


def test_table_is_the_curve_of_the_run(flat_page):
    (table,) = tables_of(flat_page)["tables"]
    curve = flat_page.result.press.curve
    moduli, travels = table["axes"]
    assert (moduli["key"], moduli["nodes"]) == ("E", curve.E[1:].tolist())
    assert (travels["key"], travels["nodes"]) == ("travel", curve.x.tolist())
    assert table["numbers"]["F"][1] == curve.F[1:, :, 1].tolist()
    np.testing.assert_allclose(table["numbers"]["E_read"], np.tile(curve.E[1:, None], len(curve.x)), rtol=1e-9)


def test_modulus_over_its_noise(flat_page):
    """Of a pair by the slope of the two-spring law, of a press by the slopes that its reading tells."""
    (table,) = tables_of(flat_page)["tables"]
    F = flat_page.result.press.curve.F[1:, -1]
    over_noise = np.array(table["numbers"]["E_over_noise"])[:, -1]
    np.testing.assert_allclose(over_noise, pair_over_noise(flat_page.result, F), rtol=1e-6)
    found = SimpleNamespace(E=2.0, slopes=SimpleNamespace(noise=(3.0, 0.5)))
    model = SimpleNamespace(read=lambda *_: found)
    presses = np.ones((1, 2, 15, 2))
    presses[0, 1, 3, 0] = np.nan
    (read,) = read_presses(presses, press_reader(model), SimpleNamespace(full_scale_N=(1.0, 8.0)))
    by_noise = np.hypot(0.03, 0.04) * np.sqrt(15.0 / PRESS_SAMPLES)
    assert read[0].tolist() == pytest.approx([2.0, 1.0 / by_noise])
    assert np.isnan(read[1]).all()


def test_pair_is_read_with_what_shape_and_skin_add_taken_off(flat_page):
    F = flat_page.result.press.curve.F[1:, -1:]
    constants = flat_page.result.read_out
    level = tuple(LevelReading(E_MPa=E, read_MPa=1.25 * E) for E in (0.1, 10.0))
    with_skin = dataclasses.replace(constants, level=level)
    plain, corrected = (read_presses(F, ratio_reader(each), each) for each in (constants, with_skin))
    np.testing.assert_allclose(corrected[..., 0], 0.8 * plain[..., 0], rtol=1e-12)
    np.testing.assert_array_equal(corrected[..., 1], plain[..., 1])


def test_noise_of_the_sliders(flat_page):
    """Half a per cent without a reading, else its own, or the worst channel of a named read-out; four times at most."""
    data = tables_of(flat_page)
    (noise,) = (slider for slider in data["sliders"] if slider["key"] == "noise")
    assert (data["start"]["noise"], noise["min"], noise["max"]) == (0.5, 0.0, 2.0)
    shown = flat_page.report.design.fruit.E_MPa
    assert data["start"]["E"] == shown[len(shown) // 2]
    asked = SimpleNamespace(reading=ReadingRequirements(noise_percent=0.2))
    signal = SimpleNamespace(errors_N=(0.001, 0.006))
    for named, expected in ((None, 0.2), (signal, 0.3)):
        read_out = SimpleNamespace(signal=named, full_scale_N=(0.5, 2.0))
        assert noise_percent(SimpleNamespace(design=asked, read_out=read_out)) == pytest.approx(expected)


def test_domes_are_interpolated_in_logarithms_and_have_their_own_pressure(dome_page):
    (table,) = tables_of(dome_page)["tables"]
    assert [axis["log"] for axis in table["axes"]] == [True, True]
    F, pressure = (np.array(table["numbers"][key]) for key in ("F", "pressure"))
    contact = np.sqrt(F / pressure / np.pi)  # [mm]
    assert (contact < 0.5 * dome_page.report.design.tips.side_mm).all()


@pytest.mark.slow
def test_moving_a_slider_changes_numbers_and_plots(flat_page, open_page):
    page = open_page(flat_page.address, webgl=False)
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


@pytest.mark.slow
def test_pressure_above_its_limit_does_not_pass(open_page, tmp_path, written_page):
    limit = 1.6  # MPa: more than at 2 MPa, where the sliders start, less than at 3.5 MPa
    fruit = Fruit(bruise_limit_MPa=(limit,) * len(Fruit().E_MPa))
    page = open_page(written_page(result_of(Design(fruit=fruit)), tmp_path).address, webgl=False)
    assert page.locator("#numbers .failed").count() == 0
    page.focus("#slider-E")
    page.keyboard.press("End")
    page.wait_for_selector("#numbers .failed")
    assert "pressure" in page.inner_text("#live-answer")


BETWEEN = (
    ([1.0, 4.0, 9.0, 16.0, 25.0], 0.5, 12.25),
    ([None, 4.0, 9.0, 16.0, None], 0.5, 12.25),
    ([None, 4.0, 9.0, None, None], -0.5, 6.5),
    ([None, 4.0, 9.0, 16.0, None], 1.5, None),
    ([None, 4.0, None, 16.0, None], 0.0, None),
)
"""Numbers at the nodes -2 to 2, a place, and the number there."""


@pytest.mark.slow
def test_between_known_numbers_the_page_has_one_whatever_lies_beyond(dome_page, open_page):
    """A parabola through three numbers, a straight line through two; nothing beside a number that is not known."""
    page = open_page(dome_page.address, webgl=False)
    axis = {"nodes": [-2.0, -1.0, 0.0, 1.0, 2.0], "log": False}
    for numbers, at, expected in BETWEEN:
        found = page.evaluate("([axis, numbers, at]) => between(axis, numbers, at)", [axis, numbers, at])
        assert found == (None if expected is None else pytest.approx(expected)), (numbers, at)
