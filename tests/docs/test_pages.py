"""The documents are true of the tree: links lead somewhere, generated pages are up to date, rooms exist."""

import json
import re
import sys
import threading
from pathlib import Path

import pytest
from scripts import loaded_script

from pipeline.storage import workers
from sensor.design.bench import PRESSED
from sensor.design.design_file import TABLE_TYPES
from sensor.design.processes import PROCESSES
from sensor.design.tip_mount import pad_height
from sensor.quantity import STANDARD_GRAVITY
from solve.contact.scene import STEEPEST_DEG
from twintip.cli import main

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
PACKAGES = ("sensor", "cad", "mesh", "solve", "pipeline", "instrument", "twintip")
LINK = re.compile(r"\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.+)$", flags=re.MULTILINE)
SOURCE = re.compile(
    r"`((?:sensor|cad|mesh|solve|pipeline|instrument|twintip|tests|docs|designs|reference|benchmarks|examples)/[\w/.-]+)`"
)
NAME_IN_FILE = re.compile(r"`([A-Za-z_][\w.]*)` (?:of|in|beside) `([\w/-]+\.\w+)`")
ROW = re.compile(r"^\| (`[a-z_/`, ]+) \|", flags=re.MULTILINE)
MACHINE = re.compile(r"(?<![\w.:/-])/(?:work|tmp|home|root|usr|opt|var|mnt|media|Users)\b|[A-Z]:\\")
GENERATOR = loaded_script(ROOT / "docs" / "pages.py")
ARCHITECTURE = ROOT / "docs" / "architecture.md"


def text_of(page):
    return page.read_text(encoding="utf-8")


def anchors(page):
    """Return the anchors of a page's headings: lower case, punctuation dropped, spaces as hyphens."""
    titles = (re.sub(r"[^\w\- ]", "", title.lower()) for title in HEADING.findall(text_of(page)))
    return {title.replace(" ", "-") for title in titles}


def broken_links(page):
    """Return the relative links of a page that lead to no file, or to no heading of it."""
    broken = []
    for link in LINK.findall(text_of(page)):
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        if "://" not in link and (not target.exists() or (anchor and anchor not in anchors(target))):
            broken.append(link)
    return broken


def machine_paths(text):
    return MACHINE.findall(text)


def missing_sources(text):
    """Return the paths of the tree that a text names and that do not exist."""
    return [path for path in SOURCE.findall(text) if not (ROOT / path).exists()]


def named_in_files(text):
    """Return the names with their files, in the order of a text that says `NAME` of `FILE`."""
    return NAME_IN_FILE.findall(" ".join(text.split()))


def missing_names(text):
    """Return the names that a text says are in a file of the tree, and that are not in it."""
    return [
        (name, file)
        for name, file in named_in_files(text)
        if (ROOT / file).exists() and not re.search(rf"\b{name.rpartition('.')[2]}\b", text_of(ROOT / file))
    ]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_page_is_true_of_the_tree(page):
    assert broken_links(page) == []
    assert machine_paths(text_of(page)) == []
    assert missing_sources(text_of(page)) == []
    assert missing_names(text_of(page)) == []


@pytest.mark.parametrize("page", [page for page in PAGES if page.parent.name == "docs"], ids=lambda page: page.name)
def test_page_is_reached_from_the_readme(page):
    """Directly, or by one page that the README links."""
    linked = {link.partition("#")[0] for link in LINK.findall(text_of(ROOT / "README.md"))}
    beyond = {f"docs/{link.partition('#')[0]}" for near in linked if near.startswith("docs/") and near.endswith(".md")
              for link in LINK.findall(text_of(ROOT / near))}  # fmt: skip
    assert f"docs/{page.name}" in linked | beyond


@pytest.mark.parametrize("name", GENERATOR.PAGES)
def test_tables_of_a_page_are_up_to_date(name):
    """Else run `python docs/pages.py`."""
    assert text_of(ROOT / "docs" / name) == GENERATOR.page(name)


def test_every_generated_table_stands_on_a_page():
    text = "".join(text_of(ROOT / "docs" / name) for name in GENERATOR.PAGES)
    shown = dict.fromkeys(re.findall(r"<!-- (\w+: .+?) -->\n\| ", text))
    asked = {f"design: {name}" for name in TABLE_TYPES} | {"fruits: numbers", "fruits: sources"}
    asked |= {"processes: numbers", "processes: sources"}
    asked |= {
        "words: verdicts",
        "words: main job",
        "words: symbols",
        "answer: calibrate",
        "answer: read",
        "answer: fruit",
        "answer: modulus",
        "answer: prove",
        "answer: readings",
        "answer: simulate",
        "names: twintip",
    }
    assert {comment for comment in shown if not comment.startswith("keys: ")} == asked


def test_page_on_the_design_has_the_numbers_of_the_code():
    """Which its tables do not hold: the steepest tip, the pads of a square, the lines of a leaf of PETG."""
    text = text_of(ROOT / "docs" / "design-file.md")
    petg = PROCESSES["fdm-petg"]
    leaves = (petg.leaf_thickness_low_mm, petg.leaf_thickness_high_mm)
    low, high = (f"{leaf / petg.line_width_mm:g}" for leaf in leaves)
    pads = sorted({2.0 * pad_height(process) for process in PROCESSES.values()})
    for sentence in (
        f"must be at most {STEEPEST_DEG:g} degrees; a run refuses",
        f"the pads between the plates, {', '.join(f'{pad:g}' for pad in pads[:-1])} or {pads[-1]:g} mm.",
        f"A leaf of the low spring has {low} lines of {petg.line_width_mm:g} mm, a leaf of the high spring {high}.",
    ):
        assert sentence in " ".join(text.split())


def test_table_of_the_architecture_has_every_folder():
    section = text_of(ARCHITECTURE).partition("\n## Where is what\n")[2].partition("\n## ")[0]
    named = {room for row in ROW.findall(section) for room in re.findall(r"`([a-z_/]+)`", row)}
    folders = {path.parent.relative_to(ROOT) for name in PACKAGES for path in (ROOT / name).rglob("*.py")}
    rooms = {folder.as_posix() for folder in folders if len(folder.parts) == 2}
    assert named - set(PACKAGES) == rooms


@pytest.mark.slow
def test_walk_of_the_architecture_is_the_order_of_a_run(tmp_path, monkeypatch):
    """On one core, where this process makes the solids too; nothing is remembered, so that every stage is solved."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(workers, "available_cores", lambda: 1)
    section = text_of(ARCHITECTURE).partition("\n## From `--nl 0.05`")[2].partition("\n## ")[0]
    walk = [(str(ROOT / file), name) for name, file in named_in_files(section)]
    asked = set(walk)
    calls = []

    def profile(frame, event, _):
        call = (frame.f_code.co_filename, frame.f_code.co_qualname)
        if event == "call" and call in asked:
            calls.append(call)

    threading.setprofile(profile)
    sys.setprofile(profile)
    try:
        code = main(["run", "--nl", "0.05", "--out", str(tmp_path / "run"), "--json"])
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
    assert code == 0
    remaining = iter(calls)
    missing = [step for step in walk if step not in remaining]  # each step is looked for behind the one before
    assert len(walk) >= 20
    assert missing == []
    assert (tmp_path / "run" / "housing.step").exists()


def test_page_on_installing_names_the_libraries_that_the_setup_installs():
    setup = (ROOT / ".ci" / "setup").read_text(encoding="utf-8")
    page = (ROOT / "docs" / "install.md").read_text(encoding="utf-8")
    [installed] = re.findall(r"LIBRARIES=\(([^)]+)\)", setup)
    [named] = re.findall(r"apt-get install --no-install-recommends ((?:.+\\\n)*.+)", page)
    assert named.replace("\\", " ").split() == installed.split()


def test_steps_of_the_calibration_in_make_one_are_those_of_the_sheet_of_paper():
    """The largest deflection and weight of each spring, low first, from the frozen numbers of the default design."""
    paper = json.loads((ROOT / "tests/golden/numbers/paper.json").read_text(encoding="utf-8"))["numbers"]
    expected = []
    for i, name in enumerate(("low", "high")):
        deflection = PRESSED * paper[f"deflections_mm.{i}"]
        grams = paper[f"flexures.{name}.stiffness_N_per_m"] * deflection / STANDARD_GRAVITY  # N/m mm is mN
        expected.append((f"{deflection:.3g}", f"{grams:.3g}"))
    text = text_of(ROOT / "docs/make-one.md")
    assert re.findall(r"to ([\d.]+) mm for tip [LH] \(([\d.]+) g\)", text) == expected
