"""The documents are true of the tree: links lead somewhere, generated pages are up to date, rooms exist."""

import re
from pathlib import Path

import pytest
from scripts import loaded_script

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
    near = [ROOT / link for link in linked if re.fullmatch(r"docs/[\w-]+\.md", link)]
    beyond = {f"docs/{link.partition('#')[0]}" for each in near for link in LINK.findall(text_of(each))}
    assert f"docs/{page.name}" in linked | beyond


@pytest.mark.parametrize("name", GENERATOR.PAGES)
def test_tables_of_a_page_are_up_to_date(name):
    """Else run `python docs/pages.py`."""
    assert text_of(ROOT / "docs" / name) == GENERATOR.page(name)


def test_table_of_the_architecture_has_every_folder():
    section = text_of(ARCHITECTURE).partition("\n## Where is what\n")[2].partition("\n## ")[0]
    named = {room for row in ROW.findall(section) for room in re.findall(r"`([a-z_/]+)`", row)}
    folders = {path.parent.relative_to(ROOT) for name in PACKAGES for path in (ROOT / name).rglob("*.py")}
    rooms = {folder.as_posix() for folder in folders if len(folder.parts) == 2}
    assert named - set(PACKAGES) == rooms
