"""Every verdict that a command can give and every word of the glossary is explained, each with a source that exists."""

import math
import re
from pathlib import Path

import pytest

from cad.quantity import InputError
from pipeline.report.explain.closed_form import default_numbers
from pipeline.report.explain.entries import Entry, entries, entry_names, entry_of

ROOT = Path(__file__).parents[4]
REPORT_PAGE = (ROOT / "docs" / "report-json.md").read_text(encoding="utf-8")
THEORY = (ROOT / "docs" / "theory.md").read_text(encoding="utf-8")
NAMED = re.compile(r"\"((?:geometry|printable|sideways|files|report)\.[a-z0-9_]+)\"")
NO_VERDICTS = {"report.json", "report.html"}


def verdict_names():
    """Return the names of the page's table of verdicts, which a test of the docs holds complete, and of the sources."""
    table = re.search(r"^\| verdict \| when \|.*\n\|.*\n((?:\|.*\n)+)", REPORT_PAGE, flags=re.MULTILINE)
    of_page = {
        name.replace("SPRING", spring)
        for row in table[1].splitlines()
        for name in re.findall(r"`([^`]+)`", row.split("|")[1])
        for spring in ("low", "high")
    }
    sources = [path.read_text(encoding="utf-8") for room in ("cad", "pipeline") for path in (ROOT / room).rglob("*.py")]
    in_code = {name for text in sources for name in NAMED.findall(text)} - NO_VERDICTS
    return sorted(of_page | in_code)


def glossary():
    """Return the words and symbols of the glossary of docs/theory.md."""
    table = re.search(r"^\| word \| meaning \|\n\|.*\n((?:\|.*\n)+)", THEORY, flags=re.MULTILINE)
    cells = [row.split("|")[1] for row in table[1].splitlines()]
    return [word.strip(" `") for cell in cells for word in cell.split(",")]


def test_every_verdict_has_an_entry():
    assert {"P_max", "printable.low", "reading.lift", "geometry.tip_face"} <= set(verdict_names())
    assert [name for name in verdict_names() if not _explained(name, verdict=True)] == []


def test_every_word_of_the_glossary_has_an_entry():
    assert {"E", "ν", "K_m", "NL", "x", "scene"} <= set(glossary())
    assert [word for word in glossary() if not _explained(word)] == []


def _explained(name, verdict=None):
    try:
        return verdict is None or entry_of(name).is_verdict is verdict
    except InputError:
        return False


def test_no_entry_is_of_a_verdict_that_nothing_gives():
    known = set(verdict_names())
    assert [
        name for entry in entries() if entry.is_verdict for name in entry.each or (entry.name,) if name not in known
    ] == []


@pytest.mark.parametrize("entry", entries(), ids=lambda entry: entry.name)
def test_source_is_a_page_with_its_heading_or_is_published(entry):
    page = re.match(r"(docs/[\w-]+\.md)(?:#([\w-]+))?", entry.source)
    assert page is not None
    text = (ROOT / page[1]).read_text(encoding="utf-8")
    headings = re.findall(r"^#+ (.+)$", text, flags=re.MULTILINE)
    assert page[2] is None or page[2] in [re.sub(r"[^\w\- ]", "", one.lower()).replace(" ", "-") for one in headings]
    assert entry.meaning.endswith((".", "?"))


def test_names_are_told_apart():
    names = entry_names()
    assert len(set(names)) == len(names)
    assert {"printable.low", "printable.high", "NL"} <= set(names)
    assert all(isinstance(entry_of(name), Entry) for name in names)


@pytest.mark.parametrize(
    ("word", "near"), [("prntable.low", "printable.low"), ("nl", "NL"), ("safety", "safety_factor")]
)
def test_unknown_name_is_answered_with_the_nearest(word, near):
    with pytest.raises(InputError, match=rf"^NAME = '{word}': must be a verdict or a symbol; did you mean {near}\?"):
        entry_of(word)


def test_numbers_of_the_default_design_are_those_of_the_paper():
    """K_m of (6) at 3.5 MPa is 3846 N/m; the springs of (10), (12) are 752.5 and 17308 N/m."""
    numbers = default_numbers()
    assert numbers["K_m"].startswith("3846 N/m")
    K_l, K_h = (float(text.split()[0]) for name, text in numbers.items() if name in ("K_l", "K_h"))
    assert math.isclose(K_l, 752.5, rel_tol=1e-3)
    assert math.isclose(K_h, 17308.0, rel_tol=1e-3)
    assert numbers["P_max"] == "5"
    assert {entry_of(name).name for name in numbers} == numbers.keys()
