"""Faults of the product as patches: what each plants, which tests must fail for it, and the source that has it."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
PRODUCT = ("sensor", "cad", "mesh", "solve", "pipeline", "instrument", "twintip")
_CAUGHT_BY = "Caught by: "


@dataclass(frozen=True, kw_only=True)
class Change:
    """Lines of a file, those around them included, and what stands there in their stead."""

    path: str
    before: str
    after: str


@dataclass(frozen=True, kw_only=True)
class Fault:
    """A fault with its name, a sentence on it, the tests that must each fail for it, and its changes."""

    name: str
    meaning: str
    tests: tuple[str, ...]
    changes: tuple[Change, ...]


def faults() -> list[Fault]:
    """Return the faults of this folder, by their names."""
    return [read_fault(path) for path in sorted(HERE.glob("*.patch"))]


def read_fault(path: Path) -> Fault:
    """Return the fault of a patch: a sentence, lines `Caught by: TEST`, and a unified diff."""
    head, _, diff = path.read_text(encoding="utf-8").partition("\n--- ")
    meaning, *others = head.strip().splitlines()
    tests = [line.removeprefix(_CAUGHT_BY) for line in others if line.startswith(_CAUGHT_BY)]
    return Fault(name=path.stem, meaning=meaning, tests=tuple(tests), changes=tuple(_changes(f"--- {diff}")))


def _changes(diff: str) -> list[Change]:
    """Return the changes of a unified diff; places are found by lines, so line numbers may be out of date."""
    changes = []
    for of_file in re.split(r"^--- ", diff, flags=re.MULTILINE)[1:]:
        head, *hunks = re.split(r"^@@.*\n", of_file, flags=re.MULTILINE)
        path = head.splitlines()[1].removeprefix("+++ b/")
        for hunk in hunks:
            lines = hunk.splitlines(keepends=True)
            before = "".join(line[1:] for line in lines if line[0] in " -")
            after = "".join(line[1:] for line in lines if line[0] in " +")
            changes.append(Change(path=path, before=before, after=after))
    return changes


def planted(fault: Fault, root: Path) -> Mapping[Path, str]:
    """Return the files below a root that the fault changes, with their new text.

    Raises ValueError if the lines of a change are not found exactly once.
    """
    texts: dict[Path, str] = {}
    for change in fault.changes:
        path = root / change.path
        text = texts.get(path) or path.read_text(encoding="utf-8")
        places = text.count(change.before)
        if places != 1:
            msg = f"{fault.name}: its lines are found {places} times in {change.path}, must be found once"
            raise ValueError(msg)
        texts[path] = text.replace(change.before, change.after)
    return texts
