"""The web page of a folder is one file that shows its bodies and asks nobody for anything."""

import re
from itertools import combinations

import numpy as np
import pytest
from browser import SECONDS, browser, different, needs_chromium, still_picture

from pipeline.cli import main


@pytest.fixture(scope="module")
def page(stand_in_folder, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "scenes.html"
    assert main(["view", str(stand_in_folder), "--html", str(path)]) == 0
    return path


def test_page_has_each_scene_with_each_field_and_its_ends(page):
    text = page.read_text(encoding="utf-8")
    names = re.findall(r"<option value=\"\d+\">([^<]+)</option>", text)
    fields = [scene for scene in ("flexure-low", "flexure-high", "fruit") for _ in range(4)]
    assert [name.partition(":")[0] for name in names] == [*fields, "assembly"]
    assert '"largest": "5"' in text
    assert '"largest": "10"' in text


def test_same_folder_gives_the_same_bytes(page, stand_in_folder, tmp_path):
    again = tmp_path / "again.html"
    assert main(["view", str(stand_in_folder), "--html", str(again)]) == 0
    assert again.read_bytes() == page.read_bytes()


def test_foreign_file_is_kept(stand_in_folder, tmp_path, capsys):
    mine = tmp_path / "mine.html"
    mine.write_text("mine", encoding="utf-8")
    assert main(["view", str(stand_in_folder), "--html", str(mine)]) == 2
    assert "--html" in capsys.readouterr().err
    assert mine.read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize("name", ["page.htm", "page", "page.png"])
def test_page_under_another_ending_is_refused(name, stand_in_folder, tmp_path, capsys):
    assert main(["view", str(stand_in_folder), "--html", str(tmp_path / name)]) == 2
    assert "must be a file name that ends in .html" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def coloured(pixels: np.ndarray) -> float:
    """Return the share of a picture that is neither white nor grey."""
    return float(np.mean(np.ptp(pixels, axis=2) > 25))


@needs_chromium
@pytest.mark.slow
@pytest.mark.parametrize("size", [(1280, 800), (390, 844)])
def test_browser_shows_bodies_and_asks_nobody(page, size):
    asked: list[str] = []
    complaints: list[str] = []
    with browser() as opened:
        tab = opened.new_page(viewport={"width": size[0], "height": size[1]})
        tab.on("request", lambda request: asked.append(request.url))
        tab.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
        tab.on("pageerror", lambda error: complaints.append(str(error)))
        tab.goto(page.as_uri())
        body = tab.locator("#view")
        shown: list[np.ndarray] = []
        for scene in ("0", "4", "8", "12"):
            tab.select_option("#scene", scene)
            tab.frame_locator("#view").locator("canvas").wait_for(timeout=1000 * SECONDS)
            shown.append(still_picture(body, shown[-1] if shown else None))
        assert tab.evaluate("document.documentElement.scrollWidth") <= size[0]
    assert [url for url in asked if not url.startswith(("file:", "data:", "blob:", "about:"))] == []
    assert complaints == []
    assert min(map(coloured, shown)) > 0.02
    assert all(different(one, other) > 1e-3 for one, other in combinations(shown, 2))
