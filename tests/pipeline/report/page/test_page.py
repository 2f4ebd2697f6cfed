"""The page says what report.json says, its answer first, and needs nothing but itself."""

import base64
import dataclasses
import html
import json
import re
import zlib

import pytest
from stand_ins import result_of

from pipeline.report.outputs import PAGE, listed_files, write_outputs
from pipeline.report.page.page import make_page
from pipeline.report.page.page_answer import closest_to_limit, short_value
from pipeline.report.page.page_template import finite
from pipeline.report.report import read_data
from pipeline.storage.digests import file_digest
from pipeline.verdicts.in_words import failed_or_undecided, limit_text, overall_sentence
from sensor.verdict import Verdict
from sensor.words import value_with_bar

MOST_BYTES = 2_500_000
IN_PERCENT = (
    "P_monotonic",
    "NL",
    "P_displacement_independent",
    "reading.bias",
    "reading.uncertainty",
    "reading.touch",
    "reading.relaxation",
)
SCRIPT = re.compile(r'<script(?: type="text/plain")?>.*?</script>', re.DOTALL)  # libraries name places, ask none
OUTSIDE = re.compile(
    r"""(?:src|href|action|data|poster)\s*=\s*["']?\s*(?:https?:)?//|url\(\s*["']?(?:https?:)?//|@import"""
)


def text_of(page):
    """Return the text of a page that is read."""
    return " ".join(html.unescape(re.sub(r"<(script|style)\b.*?</\1>|<[^>]*>", " ", page, flags=re.DOTALL)).split())


def data_of(text):
    """Return the data that the scripts of a page read."""
    (data,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)
    return json.loads(data)


@pytest.fixture(params=["flat_page", pytest.param("dome_page", marks=pytest.mark.slow)])
def page(request):
    return request.getfixturevalue(request.param)


def test_page_needs_nothing_from_elsewhere_and_no_name_twice(page):
    written = SCRIPT.sub("", page.text)
    ids = re.findall(r'<[^>]* id="([^"]+)"', written)
    assert len(ids) == len(set(ids)) > 0
    assert OUTSIDE.findall(written) == []
    assert len(page.text.encode()) < MOST_BYTES


def test_numbers_of_the_page_are_those_of_the_report(page):
    data = json.loads((page.folder / "report.json").read_text(encoding="utf-8"))
    text = text_of(page.text)
    for verdict in data["verdicts"]:
        scale = 100.0 if verdict["name"] in IN_PERCENT else 1.0
        value, bar = verdict["value"], verdict["error"]
        if value is not None and abs(value) > 1e-12:  # round-off is 0
            assert value_with_bar(scale * value, scale * bar if bar else None) in text
    for note in data["notes"]:
        assert " ".join(note.split()) in text
    assert all(f"{name} {version}" in text for name, version in data["versions"].items())
    entries = [f"{entry['path']} {entry['sha256']}" for entry in data["files"] if entry["path"] != PAGE]
    assert len(entries) > 1
    assert all(entry in text for entry in entries)


def test_page_is_a_listed_file_and_the_same_every_time(page, tmp_path):
    (entry,) = (file for file in page.report.files if file.path == PAGE)
    assert entry.sha256 == file_digest(page.folder / PAGE)
    write_outputs(page.result, tmp_path, page=True)
    assert (tmp_path / PAGE).read_bytes() == (page.folder / PAGE).read_bytes()


def planted(name, **changes):
    given = {"value": 2.0, "unit": "MPa", "limit": 1.0, "tolerance": 0.0, "passed": False, "reference": "planted"}
    return Verdict(name=name, **(given | changes))


@pytest.mark.parametrize(
    ("outcomes", "names", "answer", "counts"),
    [
        ((True, None), ["1"], "Not decided", [1, 2]),
        ((None, True, False, None, False), ["2", "4", "0", "3"], "No", [2, 5]),
    ],
)
def test_answer_names_what_failed_first(outcomes, names, answer, counts):
    verdicts = tuple(planted(str(index), passed=passed) for index, passed in enumerate(outcomes))
    assert [verdict.name for verdict in failed_or_undecided(verdicts)] == names
    sentence = overall_sentence("mine", verdicts)
    assert sentence.startswith(f"{answer}: ")
    assert [int(number) for number in re.findall(r"\d+", sentence)] == counts


def test_closest_to_its_limit():
    """Of one-sided limits the one that is taken most: 0.9 of at most, 0.8 of at least; no target, no failure."""
    bias = planted("reading.bias", value=0.045, limit=0.05, passed=True)
    wall = planted("geometry.min_wall", value=5.0, limit=4.0, passed=True)
    others = [planted("bruise", passed=False), planted("K_l", value=1.0, tolerance=0.1, passed=True)]
    found = closest_to_limit([*others, wall, bias])
    assert found is not None
    assert (found.verdict, found.fraction) == (bias, pytest.approx(0.9))
    assert closest_to_limit(others) is None


@pytest.mark.parametrize(
    ("value", "passed", "text"),
    [
        (8.174, False, "8.2 %"),
        (4.32, True, "4.3 %"),
        (4.996, True, "5 %"),
        (4.8, None, "4.80 ± 0.24 %"),
        (None, False, ""),
    ],
)
def test_an_error_of_the_reading_has_two_digits_unless_they_would_cross_its_limit(value, passed, text):
    assert short_value(planted("reading.bias", value=value, error=0.24, limit=5.0, passed=passed, unit="%")) == text
    assert short_value(planted("bruise", value=0.04354, error=0.00071)) == "0.04354 ± 0.00071 MPa"


def test_page_shows_planted_verdicts_with_their_sign_and_hint_and_no_markup(flat_page):
    unread = planted("reading.bias", value=0.02, limit=0.05, unit="1")
    wrong = planted("bruise", remedy="travel at most 0.05 mm", reference="<script>alert(1)</script>")
    report = dataclasses.replace(flat_page.report, verdicts=(unread, wrong))
    page = make_page(report, flat_page.result, flat_page.folder)
    text = text_of(page)
    assert "≤ 5 %" in text
    assert "travel at most 0.05 mm" in text
    assert "<script>alert" not in page
    wall = planted("geometry.min_wall", value=3.0, limit=4.0, unit="mm")
    assert [limit_text(one, "") for one in (unread, wall, planted("K_l", tolerance=0.1))] == ["≤ 0.05", "≥ 4", "1"]


def test_body_that_cannot_be_drawn_is_named_and_loses_no_file(tmp_path):
    """Springs that were not made bend no flexure."""
    write_outputs(result_of(made=False), tmp_path, page=True)
    text = text_of((tmp_path / PAGE).read_text(encoding="utf-8"))
    assert "springs under load, no part is made" in text
    assert "assembly, no part is made" in text
    assert "pipeline design" not in text  # which would make no part either


@pytest.mark.parametrize(("failed", "sliders"), [("bruise", True), ("reading.uncertainty", False)])
def test_a_failed_design_is_sent_to_the_sliders_only_if_they_judge_what_failed(failed, sliders, flat_page):
    report = dataclasses.replace(flat_page.report, verdicts=(planted(failed, value=2.0, limit=1.0, passed=False),))
    page = make_page(report, flat_page.result, flat_page.folder)
    assert page.count('href="#live"') == 1 + sliders  # one of them is in the contents


def test_drawings_of_this_design_are_in_the_page_the_housing_first(flat_page, tmp_path):
    texts = {"wiring.svg": "<svg/>", "drawing.svg": "<svg>1</svg>"}
    for name, text in texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "bom.csv").write_text("count,part,size\n2,cover,6.1 g each\n4,nut,M3\n1,housing,13.9 g each\n")
    files = tuple(listed_files(tmp_path))
    report = dataclasses.replace(flat_page.report, files=files)
    page = make_page(report, flat_page.result, tmp_path)
    drawings = data_of(page)["drawings"]
    assert [drawing["name"] for drawing in drawings] == ["drawing.svg", "wiring.svg"]
    assert zlib.decompress(base64.b64decode(drawings[0]["content"])) == b"<svg>1</svg>"
    (cost,) = re.findall(r'<[^>]*id="print-cost"[^>]*>', page)
    mass, printed = (float(re.search(rf'data-{name}="(.+?)"', cost)[1]) for name in ("mass", "printed"))
    assert mass == pytest.approx(2 * 6.1 + 13.9)
    assert printed == pytest.approx(mass / report.design.process.density_g_per_cm3)


def test_numbers_that_are_not_finite_are_none_in_the_data_of_the_page():
    data = {"a": [1.0, float("nan"), (2, float("inf"))], "b": {"c": -float("inf"), "d": "nan", "e": None}}
    assert finite(data) == {"a": [1.0, None, [2, None]], "b": {"c": None, "d": "nan", "e": None}}


def test_data_of_the_page_is_the_report(page):
    shown = data_of(page.text)["report"]
    stored = read_data(page.folder)
    assert {**shown, "files": None, "digest": None} == {**stored, "files": None, "digest": None}
    assert len(shown["files"]) == len(stored["files"]) - 1
