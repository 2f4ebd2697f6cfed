"""One word for one thing: the names and docstrings of the product keep to the list that is held here."""

import ast
import re
import tokenize
from collections import defaultdict
from io import StringIO
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("sensor", "cad", "mesh", "solve", "pipeline", "instrument", "twintip")
SOURCES = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]

KEY = "remedy"
"""A key of report.json, which keeps its name; everything else is a hint."""
PROSE = {
    r"\bgo(es)? with\b": "is proportional to",
    r"\A(Return|Yield) (that|those|it|its)\b": "the noun of what is returned",
}
"""Words to avoid in docstrings and comments, each with the one to write."""
NO_VERB_NO_NOUN = {"alike", "answered", "everything", "gained", "of", "on", "overall", "some", "told"}
"""Names that say neither what a function does nor what it returns."""


def wrong_names(tree):
    """Return the names in a module that another word stands for."""
    wrong = []
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and node.name in NO_VERB_NO_NOUN:
            wrong.append(node.name)
        name = getattr(node, "name", None) or getattr(node, "id", None) or getattr(node, "arg", None)
        if isinstance(name, str) and KEY in name.lower() and name != KEY:
            wrong.append(name)
    return wrong


def prose_of(tree, source):
    """Return the docstrings and the comments of a module."""
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef)
    docstrings = [ast.get_docstring(node) for node in ast.walk(tree) if isinstance(node, documented)]
    tokens = tokenize.generate_tokens(StringIO(source).readline)
    comments = [token.string.lstrip("# ") for token in tokens if token.type == tokenize.COMMENT]
    return [text for text in (*docstrings, *comments) if text]


def wrong_prose(tree, source):
    """Return what another word stands for in the docstrings and comments of a module."""
    return [match.group() for text in prose_of(tree, source) for words in PROSE if (match := re.search(words, text))]


def class_homes(sources):
    """Return for each name of a class the modules that define it."""
    homes = defaultdict(list)
    for name, source in sources.items():
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.ClassDef):
                homes[node.name].append(name)
    return homes


@pytest.mark.parametrize("package", PACKAGES)
def test_one_word(package):
    """No module uses a word that another one stands for."""
    wrong = {}
    for path in sorted((ROOT / package).rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        tree = ast.parse(source)
        wrong[path.relative_to(ROOT).as_posix()] = wrong_names(tree) + wrong_prose(tree, source)
    assert {path: words for path, words in wrong.items() if words} == {}


def test_one_class():
    """A name of a class has one home."""
    homes = class_homes({path: path.read_text(encoding="utf-8") for path in SOURCES})
    assert {name: where for name, where in homes.items() if len(where) > 1} == {}


@pytest.mark.parametrize(
    "source",
    [
        "def on(pair): ...",
        "tolerance_remedy = 1",
        "def hint(remedy_text): ...",
    ],
)
def test_planted_name(source):
    """A planted name is found; the key of report.json is none."""
    assert len(wrong_names(ast.parse(source))) == 1
    assert wrong_names(ast.parse("remedy = None")) == []


@pytest.mark.parametrize(
    "source",
    ['def section():\n    """Return that of the ball."""', "f = 1  # goes with the root", '"""K goes with E."""'],
)
def test_planted_prose(source):
    """Planted words are found; the same words that the code prints are data."""
    assert len(wrong_prose(ast.parse(source), source)) == 1
    printed = 'reason = "K goes with E"'
    assert wrong_prose(ast.parse(printed), printed) == []


def test_planted_class():
    """A planted second home is found."""
    assert class_homes({"a": "class Body: ...", "b": "class Body: ..."})["Body"] == ["a", "b"]
