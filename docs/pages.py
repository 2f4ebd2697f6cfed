"""Write the tables of the pages from the program's own data; a comment above each table says what it holds.

`python docs/pages.py` writes them. The meaning of a key stands beside its field.
"""

import dataclasses
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS.parent))


from docs.docstrings import GROUPS, docstring, linked_pages, reference  # noqa: E402
from instrument.calibrate.calibration import Calibration  # noqa: E402
from instrument.compress.modulus import CompressionResult  # noqa: E402
from instrument.press.fruit_of_presses import FruitAnswer  # noqa: E402
from instrument.press.fruit_reading import FruitReading  # noqa: E402
from instrument.proof import ProvedDesign, ProvedReading  # noqa: E402
from pipeline.report.explain.entries import entries  # noqa: E402
from pipeline.report.keys import report_keys  # noqa: E402
from sensor.design.design_file import TABLE_TYPES, value_as_toml  # noqa: E402
from sensor.design.fruits import FRUITS, RANGES  # noqa: E402
from sensor.design.processes import PROCESSES, Process  # noqa: E402
from twintip.commands.simulate import Simulation  # noqa: E402

PAGES = (
    *("design-file.md", "words.md", "report-json.md", "read-a-fruit.md", "modulus.md", "presets.md", "simulate.md"),
    *("python.md", "python-names.md"),
)
NAMES_MARK = "<!-- public names -->\n"
"""The comment in python-names.md before the first name."""
_TABLE = re.compile(r"(<!-- (\w+): (.+) -->\n)(?:\|.*\n)*")

Rows = Iterator[tuple[str, ...]]
"""The rows of a table, its head first."""


def page(name: str) -> str:
    """Return the text of a page with its tables written anew."""
    text = _TABLE.sub(table, (DOCS / name).read_text(encoding="utf-8"))
    before, mark, _ = text.partition(NAMES_MARK)
    return f"{before}{mark}\n{reference()}" if mark else text


def table(match: re.Match[str]) -> str:
    """Return a matched comment, followed by the Markdown table that it specifies."""
    comment, kind, argument = match.groups()
    head, *rows = TABLES[kind](argument)
    lines = (head, ["---"] * len(head), *rows)
    return comment + "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def design_keys(name: str) -> Rows:
    """Yield the keys of a table of the design file."""
    yield "key", "bounds", "default", "meaning"
    for item in dataclasses.fields(TABLE_TYPES[name]):
        data = item.metadata
        choices = ", ".join(data.get("options", ()))
        bounds = f"one of {choices}" if choices else str(data.get("bounds") or data["text"])
        default = "not set" if item.default is None else value_as_toml(item.default)
        yield f"`{item.name}`", bounds, default, data["meaning"]


def processes(content: str) -> Rows:
    """Yield the properties of all print processes, or if `content` is "sources" the sources of each property."""
    numbers = [item for item in dataclasses.fields(Process) if "unit" in item.metadata]
    if content == "sources":
        yield "number", "source"
        for item in numbers:
            yield f"`{item.name}`", sources_of(item.name)
        return
    yield "", *PROCESSES, "meaning"
    yield "material", *(process.material for process in PROCESSES.values()), ""
    for item in numbers:
        values = (getattr(process, item.name) for process in PROCESSES.values())
        yield f"`{item.name}`", *("-" if value is None else f"{value:g}" for value in values), item.metadata["meaning"]


def fruits(content: str) -> Rows:
    """Yield the ranges of all fruits, or if `content` is "sources" the sources of each fruit."""
    if content == "sources":
        yield "fruit", "source"
        for fruit in FRUITS.values():
            yield fruit.name, "; ".join(f"`{key}`: {text}" for key, text in fruit.sources)
        return
    yield "fruit", *(f"`{key}`" for key in RANGES), "`relaxes_to`"
    for fruit in FRUITS.values():
        ranges = (" to ".join(f"{end:g}" for end in getattr(fruit, key)) for key in RANGES)
        yield fruit.name, *ranges, f"{fruit.relaxes_to:g}"


def sources_of(key: str) -> str:
    """Return the sources of a property of print processes, each once, with the processes that use it."""
    users: dict[str, list[str]] = {}
    for name, process in PROCESSES.items():
        source = dict(process.sources).get(key)
        if source is not None:
            users.setdefault(source, []).append(name)
    if len(users) == 1:
        return next(iter(users))
    return " · ".join(f"{', '.join(names)}: {source}" for source, names in users.items())


def words(content: str) -> Rows:
    """Yield the verdicts with their questions and conditions, the nouns of the main job, or the other words.

    `content` is "verdicts", "main job" or anything else.
    """
    verdicts = content == "verdicts"
    nouns = content == "main job"
    yield ("name", "question", "passes when") if verdicts else ("name", "meaning")
    for entry in entries():
        if entry.is_verdict is verdicts and entry.in_main_job is nouns:
            names = ", ".join(f"`{name}`" for name in entry.each or (entry.name, *entry.aliases))
            formula = (entry.formula.replace("|", "\\|"),) if verdicts else ()
            yield names, re.split(r"(?<=[.?]) ", entry.meaning, maxsplit=1)[0], *formula


def keys_of_report(first_parts: str) -> Rows:
    """Yield the keys of report.json that begin with one of these parts, which spaces separate."""
    yield "key", "unit", "meaning"
    for first in first_parts.split():
        for key in report_keys():
            if re.split(r"[.\[]", key.name)[0] == first:
                yield f"`{key.name}`", key.unit, key.meaning


def keys_of_answer(command: str) -> Rows:
    """Yield the keys that a command prints as JSON; "fruit" means the answer from several presses on one fruit."""
    yield "key of `--json`", "unit", "meaning"
    answers = {
        "calibrate": Calibration,
        "modulus": CompressionResult,
        "read": FruitReading,
        "fruit": FruitAnswer,
        "prove": ProvedDesign,
        "readings": ProvedReading,
        "simulate": Simulation,
    }
    for item in dataclasses.fields(answers[command]):
        key = item.metadata.get("key", item.name)
        if item.metadata.get("has_key", True):  # a field with several keys writes them itself
            yield key if "`" in key else f"`{key}`", item.metadata["unit"], item.metadata["meaning"]


def public_names(package: str) -> Rows:
    """Yield the public names of a package, each with the first line of its docstring."""
    yield "name", "what it is"
    for name in (name for names in GROUPS.values() for name in names):
        link = f"[`{package}.{name}`](python-names.md#{package}{name.lower()})"
        yield link, linked_pages(docstring(name).summary)


TABLES: dict[str, Callable[[str], Rows]] = {
    "design": design_keys,
    "processes": processes,
    "fruits": fruits,
    "words": words,
    "keys": keys_of_report,
    "answer": keys_of_answer,
    "names": public_names,
}
"""The function that yields a table, by the word before the colon in the comment."""


def main() -> None:
    """Write every page."""
    for name in PAGES:
        (DOCS / name).write_text(page(name), encoding="utf-8")


if __name__ == "__main__":
    main()
