"""The page in a real browser: no request, no complaint, nothing too wide, nothing that a reader cannot reach."""

import dataclasses
import itertools

import pytest
from browser import NO_WEBGL, grave_findings, validator_findings
from deadline import DEADLINE_S

from pipeline.report.outputs import PAGE, listed_files
from pipeline.report.page.page import make_page

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", params=["run", "domes"])
def address(request, default_run, dome_page):
    """Return the page of a whole run with its pictures, and that of another scene."""
    return (default_run.folder / "report.html").as_uri() if request.param == "run" else dome_page.address


def test_page_asks_for_nothing_and_nothing_complains(address, open_page):
    page = open_page(address)
    page.wait_for_load_state("networkidle")
    # What it holds itself, drawings and bodies, it reads from memory.
    assert [url for url in page.requested if not url.startswith(("data:", "blob:"))] == [address]
    assert page.complaints == []


@pytest.mark.parametrize("width", [1280, 390])
def test_page_is_not_wider_than_its_window(address, width, open_page):
    page = open_page(address, width)
    assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_answer_comes_before_settings_on_a_phone(address, open_page):
    """What limits the design before the controls of the picture, numbers before their sliders."""
    page = open_page(address, 390, webgl=False)
    places = ("#answer .said", "#answer .limiting", "#part", "#verdicts", "#numbers", "#sliders")
    tops = [page.locator(place).bounding_box()["y"] for place in places]
    assert tops == sorted(tops)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_grave(address, scheme, open_page):
    page = open_page(address, scheme=scheme)
    page.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
    assert grave_findings(page) == []


def test_plots_and_bodies_are_drawn(address, open_page):
    page = open_page(address)
    figures = page.locator("#plots figure:has(> h3)")
    drawn = [figures.nth(i) for i in range(figures.count()) if figures.nth(i).is_visible()]
    assert len(drawn) >= 5
    assert all(figure.locator("svg[role=img]").count() == 1 for figure in drawn)  # no heading with nothing under it
    page.wait_for_function("() => document.querySelector('model-viewer')?.loaded", timeout=1000 * DEADLINE_S)


def disjoint(one, other):
    return (
        one["x"] + one["width"] <= other["x"]
        or other["x"] + other["width"] <= one["x"]
        or one["y"] + one["height"] <= other["y"]
        or other["y"] + other["height"] <= one["y"]
    )


def test_labels_of_bodies_are_words_that_cover_no_other(address, open_page):
    page = open_page(address, webgl=False)
    shown = {}
    for name in page.locator("#bodies option").all_inner_texts():
        page.locator("#bodies select").select_option(label=name)
        labels = page.locator("#bodies .still .label").all()
        shown[name] = {label.inner_text() for label in labels}
        pairs = itertools.combinations([label.bounding_box() for label in labels], 2)
        assert all(disjoint(*pair) for pair in pairs)
    parts = {"housing", "cover", "screw", "washer", "nut", "fruit"}
    assert shown.get("Sensor over its fruit", parts) == parts


def test_every_circle_of_a_force_lies_on_its_line(address, open_page):
    page = open_page(address, webgl=False)
    figure = page.locator("#plots > figure", has=page.get_by_role("heading", name="Force of each tip"))
    image = figure.locator("svg[role=img]")
    circles = image.locator("circle[stroke]").evaluate_all("all => all.map((one) => one.cx.baseVal.value)")
    boxes = image.locator("path").evaluate_all(
        "all => all.map((one) => one.getBBox()).map(({ x, width }) => [x, width])"
    )
    lines = [x for x, width in boxes if width > 100.0]  # the others are arrows of the axes
    assert min(circles) >= min(lines) - 1.0


def test_bill_is_not_wider_than_a_phone(flat_page, tmp_path, open_page):
    """A table that scrolls sideways hides its last column."""
    row = "8,thermometer,0.05-degrees,thermometer.stl,in MicroPython\n"
    (tmp_path / "bom.csv").write_text(f"count,part,size,standard,note\n{3 * row}", encoding="utf-8")
    report = dataclasses.replace(flat_page.report, files=tuple(listed_files(tmp_path)))
    (tmp_path / PAGE).write_text(make_page(report, flat_page.result, tmp_path), encoding="utf-8")
    bill = open_page((tmp_path / PAGE).as_uri(), 390, webgl=False).locator(".wide:has(> .bill)")
    assert bill.evaluate("(wide) => wide.scrollWidth <= wide.clientWidth")


FILLED = """(canvas) => {
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  return data.filter((value, i) => i % 4 === 3 && value > 0).length / (canvas.width * canvas.height);
}"""


def test_still_of_a_body_is_printed_and_shown_without_webgl(dome_page, open_page):
    page = open_page(dome_page.address)
    page.wait_for_selector("model-viewer")
    page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    printed = page.locator(".printed canvas").evaluate(FILLED)
    page.add_init_script(NO_WEBGL)
    page.reload()
    shown = page.wait_for_selector("#bodies .still canvas").evaluate(FILLED)
    assert 0.05 < shown == printed
    labels = page.locator("#bodies .still .label").all_inner_texts()
    assert labels == ["low tip", "low spring", "high tip", "high spring"]
    assert page.locator("model-viewer").count() == 0
    assert page.complaints == []


@pytest.mark.parametrize("written", ["default_run", pytest.param("dome_page", marks=pytest.mark.study)])
def test_validator_finds_no_error(written, request):
    assert validator_findings(request.getfixturevalue(written).folder / "report.html") == ""
