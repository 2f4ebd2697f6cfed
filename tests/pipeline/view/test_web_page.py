"""Web pages of folders show their bodies, and ask nobody for anything."""

import json
import re

import pytest
from browser import grave_findings, validator_findings
from deadline import DEADLINE_S
from refusal import refusal
from stand_ins import result_of

from pipeline.report.outputs import write_outputs
from pipeline.view.web_page import write_web_page
from twintip.cli import main


def data_of(path):
    return json.loads(re.search(r'id="data">(.*?)</script>', path.read_text(encoding="utf-8"))[1])


@pytest.fixture(scope="module")
def scenes_page(stand_in_folder, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "scenes.html"
    assert main(["view", str(stand_in_folder), "--html", str(path)]) == 0
    return path


def test_page_has_each_scene_with_each_field_and_its_ends(scenes_page):
    bodies = data_of(scenes_page)["bodies"]
    fields = [scene for scene in ("flexure-low", "flexure-high", "fruit") for _ in range(4)]
    assert [body["name"].partition(":")[0] for body in bodies] == fields
    highest = {body["name"]: body["legend"]["high"] for body in bodies}
    assert highest["flexure-low: von Mises stress [MPa]"] == pytest.approx(5.0)
    assert highest["flexure-high: von Mises stress [MPa]"] == pytest.approx(10.0)


def test_user_file_is_kept(stand_in_folder, tmp_path):
    mine = tmp_path / "mine.html"
    mine.write_text("mine", encoding="utf-8")
    assert main(["view", str(stand_in_folder), "--html", str(mine)]) == 2
    assert mine.read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize("name", ["page.htm", "page", "page.png"])
def test_page_under_another_ending_is_refused(name, stand_in_folder, tmp_path):
    assert refusal(write_web_page, stand_in_folder, tmp_path / name).field == "--html"
    assert list(tmp_path.iterdir()) == []


def test_folder_without_a_body_is_refused(tmp_path):
    write_outputs(result_of(), tmp_path)
    assert refusal(write_web_page, tmp_path, tmp_path.parent / "scenes.html").field == "DIR"


@pytest.mark.slow
@pytest.mark.parametrize("width", [pytest.param(1280, marks=pytest.mark.study), 390])
def test_browser_shows_bodies_and_asks_nobody(scenes_page, width, open_page):
    page = open_page(scenes_page.as_uri(), width)
    for index in ("0", "11"):
        page.select_option("select", index)
        page.wait_for_function("() => document.querySelector('model-viewer')?.loaded", timeout=1000 * DEADLINE_S)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert [url for url in page.requested if not url.startswith(("file:", "data:", "blob:"))] == []
    assert page.complaints == []
    assert grave_findings(page) == []


@pytest.mark.slow
def test_validator_finds_no_error(scenes_page):
    assert validator_findings(scenes_page) == ""
