"""The web page of a folder is one file that shows its bodies and asks nobody for anything."""

import re
from itertools import pairwise

import numpy as np
import pytest
from browser import SECONDS, browser, different, needs_chromium, still_picture

from cad.quantity import InputError
from pipeline.cli import main
from pipeline.view.web_page import write_web_page


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
    assert '"highest": "5"' in text
    assert '"highest": "10"' in text


@pytest.mark.parametrize("name", ["page.htm", "page", "page.png"])
def test_page_under_another_ending_is_refused(name, stand_in_folder, tmp_path):
    with pytest.raises(InputError) as caught:
        write_web_page(stand_in_folder, tmp_path / name)
    assert caught.value.field == "--html"
    assert list(tmp_path.iterdir()) == []


@needs_chromium
@pytest.mark.slow
@pytest.mark.parametrize("size", [(1280, 800), (390, 844)])
def test_browser_shows_bodies_and_asks_nobody(page, size):
    requests: list[str] = []
    errors: list[str] = []
    with browser() as opened:
        tab = opened.new_page(viewport={"width": size[0], "height": size[1]})
        tab.on("request", lambda request: requests.append(request.url))
        tab.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        tab.on("pageerror", lambda error: errors.append(str(error)))
        tab.goto(page.as_uri())
        pictures: list[np.ndarray] = []
        for scene in ("0", "4", "8", "12"):
            tab.select_option("#scene", scene)
            tab.frame_locator("#view").locator("canvas").wait_for(timeout=1000 * SECONDS)
            pictures.append(still_picture(tab.locator("#view"), pictures[-1] if pictures else None))
        assert tab.evaluate("document.documentElement.scrollWidth") <= size[0]
    assert [url for url in requests if not url.startswith(("file:", "data:", "blob:", "about:"))] == []
    assert errors == []
    for picture in pictures:
        assert np.mean(np.ptp(picture, axis=2) > 25) > 0.02  # neither white nor grey
    assert all(different(*pair) > 1e-3 for pair in pairwise(pictures))
