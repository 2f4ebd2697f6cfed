"""The docstrings of the public names: parsed from numpydoc form, and written as Markdown for docs/python-names.md."""

import inspect
import re
from collections.abc import Iterator
from typing import NamedTuple

import twintip

SECTIONS = ("Parameters", "Attributes", "Methods", "Returns", "Yields", "Raises", "Warns", "Examples")
"""The sections of a docstring in the order of numpydoc."""
HEADS = {
    "Parameters": ("parameter", "type", "meaning"),
    "Attributes": ("attribute", "type", "meaning"),
    "Methods": ("method", "meaning"),
    "Returns": ("returns", "meaning"),
    "Yields": ("yields", "meaning"),
    "Raises": ("raises", "reason"),
    "Warns": ("warns", "reason"),
}
"""The head of the table of a section."""
GROUPS = {
    "Design and run": ("load_design", "Design", "run", "evaluate", "RunOptions", "SensorResult", "Verdict"),
    "Parts in CadQuery": ("housing", "cover", "mount", "assembly", "stiffness", "PartStiffness"),
    "Reports and presses": ("read_report", "Report", "read_press", "FruitReading"),
    "Calibration and firmware": ("calibrate", "Calibration", "PrintedUnit", "c_header", "micropython"),
    "Studies": ("read_study", "Study", "process_engine", "run_study", "StudySummary"),
    "Compression tests": (
        *("modulus", "TestGeometry", "Ellipsoid", "CylinderOnSide", "CylinderOnEnd", "RectangularBlock", "Plunger"),
        "CompressionResult",
    ),
    "Springs in closed form": ("size_springs", "Springs", "force_ratio", "fruit_stiffness"),
    "Errors": ("InputError",),
}
"""The public names in the order in which a reader needs them."""
_TITLE = re.compile(r"\n\n(\w+)\n-+\n")
_PAGE = re.compile(r"`docs/([\w-]+\.md)`")
_PUBLIC = re.compile(rf"\b({'|'.join(twintip.__all__)})\b")


class Entry(NamedTuple):
    """One parameter, attribute, result or error of a section; `kind` is its type, empty for a result or an error."""

    name: str
    kind: str
    meaning: str


class Docstring(NamedTuple):
    """The parts of a docstring: its first line, its prose, the entries of its sections by title, and its examples."""

    summary: str
    prose: str
    sections: dict[str, list[Entry]]
    examples: str


def docstring(name: str) -> Docstring:
    """Parse the docstring of a public name."""
    text, *parts = _TITLE.split(inspect.getdoc(getattr(twintip, name)) or "")  # then titles and bodies in turn
    summary, _, prose = text.partition("\n\n")
    bodies = dict(zip(parts[::2], parts[1::2], strict=True))
    sections = {title: list(entries(body)) for title, body in bodies.items() if title != "Examples"}
    return Docstring(summary, prose, sections, bodies.get("Examples", ""))


def entries(body: str) -> Iterator[Entry]:
    """Yield the entries of a section. The name of an entry has a line of its own; its meaning is indented below."""
    for entry in re.split(r"\n(?=\S)", body):
        head, *lines = entry.splitlines()
        name, _, kind = head.partition(" : ")
        yield Entry(name, kind, " ".join(line.strip() for line in lines))


def signature(name: str) -> str:
    """Return the signature of a public name without types; empty for a record that users do not create."""
    value = getattr(twintip, name)
    if inspect.isclass(value) and "Parameters" not in docstring(name).sections:
        return ""
    called = inspect.signature(value)
    plain = [each.replace(annotation=inspect.Parameter.empty) for each in called.parameters.values()]
    return f"twintip.{name}{inspect.Signature(plain)}"


def reference() -> str:
    """Return the description of all public names in their groups, as Markdown."""
    parts = []
    for group, names in GROUPS.items():
        parts += [f"## {group}", *(part for name in names for part in of_name(name))]
    return "\n\n".join(parts) + "\n"


def of_name(name: str) -> Iterator[str]:
    """Yield the paragraphs and tables that describe a public name."""
    parts = docstring(name)
    yield f"### twintip.{name}"
    yield linked_pages(parts.summary)
    if called := signature(name):
        yield f"```text\n{called}\n```"
    if parts.prose:
        yield linked_pages(parts.prose)
    for title, entries in parts.sections.items():
        yield table_of(title, entries)
    yield f"```pycon\n{parts.examples}\n```"


def table_of(title: str, entries: list[Entry]) -> str:
    """Return a section of a docstring as a Markdown table."""
    head = HEADS[title]
    rows = [head, ["---"] * len(head), *(cells(title, entry) for entry in entries)]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def cells(title: str, entry: Entry) -> list[str]:
    """Return the cells of an entry; types that are public names become links."""
    meaning = linked_pages(entry.meaning).replace("|", "\\|")
    if title in ("Parameters", "Attributes"):
        return [in_code(entry.name), linked_names(entry.kind), meaning]
    return [in_code(entry.name) if title == "Methods" else linked_names(entry.name), meaning]


def in_code(names: str) -> str:
    """Return names, which commas separate, each as code."""
    return ", ".join(f"`{name}`" for name in names.split(", "))


def linked_names(kind: str) -> str:
    """Return a type with links to the public names in it."""
    return _PUBLIC.sub(lambda name: f"[{name[0]}](#twintip{name[0].lower()})", kind)


def linked_pages(text: str) -> str:
    """Return a text with links to the pages in docs that it names."""
    return _PAGE.sub(r"[\1](\1)", text)
