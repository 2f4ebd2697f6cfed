"""The page says what report.json says, its answer first, and needs nothing but itself."""

import dataclasses
import json
import re
from html.parser import HTMLParser

import pytest
from stand_ins import result_of

from cad.design.fruit import Fruit
from cad.design.reading import Reading
from cad.verdict import Verdict
from pipeline.report.outputs import PAGE, write_outputs
from pipeline.report.page.answer import answer_of, bar_of, verdict_rows
from pipeline.report.page.page import page_of_folder, page_of_run
from pipeline.report.page.solid_pictures import SolidPictures
from pipeline.storage.seal import file_digest

MOST_BYTES = 3_000_000
VOID = {"meta", "input", "br", "link", "img", "hr"}
OUTSIDE = re.compile(
    r"""(?:src|href|action|data|poster)\s*=\s*["']?\s*(?:https?:)?//|url\(\s*["']?(?:https?:)?//|@import"""
)


class Outline(HTMLParser):
    """Checks that elements close in order, and keeps their attributes and the text that is read."""

    def __init__(self, text):
        super().__init__()
        self.open, self.faults, self.elements, self.words = [], [], [], []
        self.feed(text)
        self.faults += [f"{tag} is not closed" for tag in self.open]

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.faults.append(f"{tag} closes another element")

    def handle_data(self, data):
        if not {"script", "style"} & set(self.open):
            self.words.append(data)

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())


@pytest.fixture(params=["flat_page", pytest.param("dome_page", marks=pytest.mark.slow)])
def page(request):
    return request.getfixturevalue(request.param)


def test_page_is_well_formed_and_ids_are_given_once(page):
    outline = Outline(page.text)
    assert outline.faults == []
    ids = [attributes["id"] for _, attributes in outline.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    named = [
        value for _, attributes in outline.elements for key, value in attributes.items() if key == "aria-labelledby"
    ]
    assert set(named) <= set(ids)


def test_planted_open_element_is_found():
    assert Outline("<p><b>x</p>").faults != []


def test_page_needs_nothing_from_elsewhere(page):
    assert OUTSIDE.findall(page.text) == []
    assert "http://" not in page.text
    assert "https://" not in page.text
    assert len(page.text.encode()) < MOST_BYTES
    assert OUTSIDE.search('<script src="//cdn/x.js">')


def test_every_picture_has_words_for_who_cannot_see_it(page):
    outline = Outline(page.text)
    pictures = [attributes for tag, attributes in outline.elements if tag == "svg"]
    assert len(pictures) > 6
    assert all(attributes["role"] == "img" and attributes["aria-label"] for attributes in pictures)
    figures = [attributes for attributes in pictures if attributes["class"] == "picture"]
    assert all(len(attributes["aria-label"]) > 40 for attributes in figures)


def test_numbers_of_the_page_are_those_of_the_report(page):
    data = json.loads((page.folder / "report.json").read_text(encoding="utf-8"))
    text = Outline(page.text).text
    for verdict in data["verdicts"]:
        for number in (verdict["value"], verdict["error"]):
            assert number is None or f"{number:.5g}" in text
    for note in data["notes"]:
        assert " ".join(note.split()) in text
    for name, version in data["versions"].items():
        assert f"{name} {version}" in text
    others = [entry for entry in data["files"] if entry["path"] != PAGE]
    assert len(others) > 1
    assert all(f"{entry['path']} {entry['sha256']}" in text for entry in others)


def test_page_is_a_listed_file_with_its_digest(page):
    (entry,) = (file for file in page.report.files if file.path == PAGE)
    assert entry.sha256 == file_digest(page.folder / PAGE)


def test_same_result_gives_the_same_page(page, tmp_path):
    write_outputs(page.result, tmp_path, page_of_run(page.result, SolidPictures()))
    assert (tmp_path / PAGE).read_bytes() == (page.folder / PAGE).read_bytes()


def planted(name, **changes):
    given = {"value": 2.0, "unit": "MPa", "limit": 1.0, "tolerance": 0.0, "passed": False, "reference": "planted"}
    return Verdict(name=name, **(given | changes))


def test_limits_on_one_side_have_their_sign_and_a_missing_reading_its_reason(flat_page):
    """A bias of 0.02 keeps its limit of 0.05, and fails for the poses that have no reading."""
    bias = planted("reading.bias", value=0.02, limit=0.05, unit="1")
    lift = planted("reading.lift", value=3.0, limit=4.0, unit="deg")
    report = dataclasses.replace(flat_page.report, verdicts=(bias, lift, planted("K_l", tolerance=0.1)))
    (unread, lifted, target), _ = verdict_rows(report)
    assert [row.limit for row in (unread, lifted, target)] == ["≤ 0.05", "≥ 4", "1"]
    assert [row.more for row in (unread, lifted, target)] == ["some poses have no reading", "", ""]
    assert (unread.bar.passing[0], lifted.bar.passing[1]) == (0.0, 100.0)
    text = Outline(page_of_folder(report, flat_page.folder, SolidPictures())).text
    assert "reading.bias failed some poses have no reading 0.02 ≤ 0.05" in text


def test_answer_of_a_good_sensor_is_yes(flat_page):
    passing = tuple(dataclasses.replace(verdict, passed=True) for verdict in flat_page.report.verdicts)
    answer = answer_of(dataclasses.replace(flat_page.report, verdicts=passing))
    assert answer.headline == f"Yes: paper passes all {len(passing)} verdicts in the scene asked for."
    assert answer.wrong == ()


def scene_of_design(report, design):
    return answer_of(dataclasses.replace(report, design=design)).scene


def test_scene_tells_every_pose_that_a_reading_is_judged_in(flat_page):
    reading = Reading(tilt_deg=3.5, off_centre_mm=0.7, radius_spread=0.15)
    design = dataclasses.replace(flat_page.report.design, reading=reading)
    scene = scene_of_design(flat_page.report, design)
    words = "at tilts up to 3.5 degrees in any direction, up to 0.7 mm off centre, on radii that differ by up to 15 %"
    assert words in scene
    assert "at a tilt of 0" not in scene


@pytest.mark.parametrize(
    ("table", "changes", "words"),
    [
        ("press", {"roll_deg": 1.5}, ", rolled by 1.5 degrees into"),
        ("press", {"attitude": "down"}, ", tips pointing down into"),
        ("press", {"strain": "large"}, ", at large strain into"),
        ("tips", {"offset_mm": 2.0}, ", 2 mm off the apex), pressed"),
        ("tips", {"fillet_mm": 0.1}, ", edges rounded by 0.1 mm), pressed"),
        ("tips", {"socket": "pin"}, ", socket pin), pressed"),
        ("tips", {"shape": "dome", "dome_radius_mm": 9.0}, ", dome radius 9 mm), pressed"),
    ],
)
def test_scene_tells_keys_that_are_not_the_default(flat_page, table, changes, words):
    design = flat_page.report.design
    assert words not in scene_of_design(flat_page.report, design)
    changed = dataclasses.replace(getattr(design, table), **changes)
    assert words in scene_of_design(flat_page.report, dataclasses.replace(design, **{table: changed}))


def test_scene_tells_both_radii_of_a_fruit(flat_page):
    fruit = Fruit(shape="ellipsoid", radius_mm=40.0, radius_across_mm=35.0, thickness_mm=12.0)
    scene = scene_of_design(flat_page.report, dataclasses.replace(flat_page.report.design, fruit=fruit))
    assert "of 40 mm radius, 35 mm across the tips, " in scene


def test_planted_failed_verdict_is_said_first_with_its_remedy(flat_page):
    good = tuple(verdict for verdict in flat_page.report.verdicts if verdict.passed)
    wrong = planted("bruise", remedy="travel at most 0.05 mm")
    report = dataclasses.replace(flat_page.report, verdicts=(*good, planted("x", passed=None), wrong))
    text = Outline(page_of_folder(report, flat_page.folder, SolidPictures())).text
    first, *_ = text.split("Verdicts", maxsplit=1)
    assert f"No: paper fails 1 of {len(good) + 2} verdicts" in first
    assert first.index("bruise failed: 2 MPa, asked for ≤ 1 MPa") < first.index("x is undecided")
    assert "What would help: travel at most 0.05 mm" in first


def test_undecided_is_not_passed(flat_page):
    report = dataclasses.replace(flat_page.report, verdicts=(planted("x", passed=None),))
    assert answer_of(report).headline.startswith("Not decided: 1 of 1 verdicts")


def test_names_that_look_like_markup_stay_text(flat_page):
    report = dataclasses.replace(flat_page.report, notes=("<script>alert(1)</script>",))
    text = page_of_folder(report, flat_page.folder, SolidPictures())
    assert "&lt;script&gt;alert(1)" in text
    assert "<script>alert" not in text


@pytest.mark.parametrize(
    ("verdict", "value", "passing", "limit"),
    [
        # three tolerances to each side are 100 units: one is 100 / 6
        (planted("P_max", value=5.05, limit=5.0, tolerance=0.01, relative=True), 50 + 100 / 6, (100 / 3, 200 / 3), 50),
        (planted("NL", value=0.049, limit=0.05, tolerance=0.001), 50 - 100 / 6, (100 / 3, 200 / 3), 50),
        # one and a half limits are 100 units
        (planted("bruise", value=1.2, limit=1.0), 80, (0, 200 / 3), 200 / 3),
        (planted("reading.lift", value=1.2, limit=1.0, passed=True), 80, (200 / 3, 100), 200 / 3),
        (planted("bruise", value=9.0, limit=1.0), 100, (0, 200 / 3), 200 / 3),
    ],
)
def test_bar_shows_value_limit_and_what_passes(verdict, value, passing, limit):
    bar = bar_of(verdict)
    assert bar.value == pytest.approx(value)
    assert bar.passing == pytest.approx(passing)
    assert bar.limit == pytest.approx(limit)


@pytest.mark.parametrize("changes", [{"value": None}, {"limit": "greater than 0"}, {"limit": 0.0}])
def test_verdict_without_a_scale_has_no_bar(changes):
    assert bar_of(planted("x", **changes)) is None


def test_page_of_springs_that_were_not_made_says_what_is_left_out(tmp_path):
    result = result_of(made=False)
    write_outputs(result, tmp_path, page_of_run(result, SolidPictures()))
    text = Outline((tmp_path / PAGE).read_text(encoding="utf-8")).text
    assert "No housing can be made." in text
    assert "picture of the part: no part is made" in text
    assert "picture of the flexures under load: no part is made" in text


def test_page_of_a_folder_without_fields_leaves_their_pictures_out(flat_page):
    text = Outline(page_of_folder(flat_page.report, flat_page.folder, SolidPictures())).text
    assert "picture of the flexures under load: the folder holds no stress: run the design again with --fields" in text
