"""A study as a person writes it: a base design, what varies, how, and what is wanted; checked when it is read."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

from cad.design.design_file import TABLE_TYPES, design_from_mapping, overridden, read_design, with_process_file
from cad.design.parameters import TABLES
from cad.design.tips import Tips
from cad.quantity import InputError, nearest, validation_error
from pipeline.options import DEFAULT_TOLERANCE, TOLERANCES, design_path
from pipeline.storage.plain import Plain
from pipeline.study.file_values import real_at, refuse_unknown_keys, text_at, texts, whole_at
from pipeline.study.levels.printed import PRINTED_KEYS
from pipeline.study.points_file import Row, columns_of, read_rows
from pipeline.study.report_keys import LEVELS, Level, Stage, level_of, refuse_unknown, stages_of
from pipeline.study.variation import Choices, Variation, variation

How = Literal["sobol", "grid", "points", "search", "sensitivity"]
Contact = Literal["auto", "solve", "surrogate"]

HOW = ("sobol", "grid", "points", "search", "sensitivity")
CONTACT = ("auto", "solve", "surrogate")
MOST_POINTS = 10_000_000
_PROCESS_FILE = "print.process_file"
_FILE_KEYS = (
    "base", "samples", "seed", "wanted", "vary", "set", "how", "points", "tol", "level", "contact", "audit", "optimise"
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Goal:
    """What `pipeline optimise` makes least, in how many points, and the names of the verdicts that must pass."""

    minimise: str = "verdicts.reading.uncertainty.value"
    under: tuple[str, ...] = (
        "reading.bias",
        "reading.uncertainty",
        "reading.lift",
        "bruise",
        *(f"printable.{name}" for name in Tips().names),
    )
    evaluations: int = 600

    def __post_init__(self) -> None:
        """Refuse a goal that is no key of a report, and too few points to search with."""
        refuse_unknown("optimise.minimise", (self.minimise,))
        refuse_unknown("optimise.under", verdict_keys(self))
        if self.evaluations < 1:
            raise validation_error("optimise.evaluations", self.evaluations, "", "at least 1", "600 is the default")


@dataclass(frozen=True, kw_only=True)
class Study:
    """A base design [as nested tables], the keys that vary, how points are drawn, and the keys of report.json wanted.

    `tol` is the relative error [1] allowed to the springs, and to the contact where a surrogate stands for it. `audit`
    is the share of points [1] that are solved in full beside the surrogate. `rows` are the points of a CSV file.
    """

    name: str
    base: Mapping[str, object]
    vary: Mapping[str, Variation]
    wanted: tuple[str, ...]
    how: How = "sobol"
    samples: int = 0
    seed: int = 0
    tol: float = DEFAULT_TOLERANCE
    level: Level = "contact"
    contact: Contact = "auto"
    audit: float = 0.001
    rows: tuple[Row, ...] = ()
    goal: Goal = field(default_factory=Goal)

    def __post_init__(self) -> None:
        """Check every number and word; raises InputError."""
        for name, value, known in (
            ("how", self.how, HOW),
            ("level", self.level, LEVELS),
            ("contact", self.contact, CONTACT),
        ):
            _check_word(name, value, known)
        self._check_keys()
        self._check_numbers()

    @cached_property
    def base_tables(self) -> Mapping[str, object]:
        """Return the tables of the base design as records: a point checks again only those that its settings change."""
        design = design_from_mapping(self.base)
        return {key: getattr(design, key) if key in TABLE_TYPES else value for key, value in self.base.items()}

    @cached_property
    def stages(self) -> frozenset[Stage]:
        """Return the stages that what is wanted needs."""
        return stages_of(self.wanted)

    @property
    def without_rows(self) -> "Study":
        """Return the study without the points of its file, as tasks have it that bring their own points."""
        first = (
            {key: Choices(values=varied.grid()[:1]) for key, varied in self.vary.items()} if self.rows else self.vary
        )
        return replace(self, rows=(), vary=first)

    def _check_keys(self) -> None:
        if not self.wanted:
            raise validation_error(
                "wanted", "[]", "", "a list of keys of report.json", "for instance springs.K_l_N_per_m"
            )
        for key in self.wanted:
            if not key.replace(".", "").replace("_", "").isalnum():
                raise validation_error("wanted", key, "", "letters, digits, _ and dots", "write it as in report.json")
        refuse_unknown("wanted", self.wanted)
        if not self.vary:
            raise validation_error(
                "vary", "{}", "", "a table of at least one key", "name a key of the design file under [vary]"
            )
        for key in self.vary:
            _check_design_key(key)
            if key in PRINTED_KEYS and self.level != "contact":
                bound = f"contact where {key} varies: the springs of a print follow the beam law"
                raise validation_error("level", self.level, "", bound, "ask for keys of that level")

    def _check_numbers(self) -> None:
        if self.how == "sobol" and not 0 < self.samples <= MOST_POINTS:
            raise validation_error(
                "samples", self.samples, "", f"at least 1 and at most {MOST_POINTS}", "say how many points"
            )
        power_of_two = 1 < self.samples <= MOST_POINTS and self.samples & (self.samples - 1) == 0
        if self.how == "sensitivity" and not power_of_two:
            bound = f"a power of 2, at least 2 and at most {MOST_POINTS}"
            raise validation_error(
                "samples", self.samples, "", bound, "there are this many times the keys and two more points"
            )
        if self.seed < 0:
            raise validation_error("seed", self.seed, "", "at least 0", "any whole number will do")
        if not TOLERANCES.hold(self.tol):
            raise validation_error("tol", self.tol, "1", str(TOLERANCES), f"the default is {DEFAULT_TOLERANCE:g}")
        if not (math.isfinite(self.audit) and 0.0 <= self.audit <= 1.0):
            raise validation_error(
                "audit", self.audit, "1", "from 0 to 1", "0.001 solves one point in a thousand in full"
            )


def read_study(path: Path) -> Study:
    """Return the study of a TOML file; raises InputError for an unknown key, which names the nearest known one."""
    data = read_design(path, "study file")
    refuse_unknown_keys(data, _FILE_KEYS, of_what=" of a study")
    return study_of(path.stem, data, path.parent)


def study_of(name: str, data: Mapping[str, Any], folder: Path) -> Study:
    """Return the study that the tables of a study file describe; files that it names lie beside it, in the folder."""
    vary = {key: variation(key, given) for key, given in _flat("vary", data).items()}
    how: How = data.get("how", _how(data))
    goal = _goal(data.get("optimise", {}))
    wanted = _wanted(data, goal if how == "search" else None)
    header, rows = read_rows(folder / text_at(data, "points", "")) if how == "points" else ((), ())
    asked: Level = data.get("level", "contact")
    return Study(
        name=name,
        base=_base(data, folder),
        vary=columns_of(header, rows) or vary,
        wanted=wanted,
        how=how,
        samples=whole_at(data, "samples", 0),
        seed=whole_at(data, "seed", 0),
        tol=real_at(data, "tol", DEFAULT_TOLERANCE),
        level=max(asked, level_of(wanted), key=LEVELS.index) if asked in LEVELS else asked,
        contact=data.get("contact", "auto"),
        audit=real_at(data, "audit", 0.001),
        rows=rows,
        goal=goal,
    )


def _wanted(data: Mapping[str, Any], goal: Goal | None) -> tuple[str, ...]:
    """Return the keys that are wanted, and those that a goal of a search needs."""
    asked = tuple(texts("wanted", data.get("wanted", [])))
    return asked if goal is None else tuple(dict.fromkeys((*asked, goal.minimise, *verdict_keys(goal))))


def _how(data: Mapping[str, Any]) -> How:
    """Return how points come about where the file does not say."""
    if "points" in data:
        return "points"
    return "search" if "optimise" in data and "samples" not in data else "sobol"


def verdict_keys(goal: Goal) -> tuple[str, ...]:
    """Return the keys of report.json that say whether the verdicts of a goal pass."""
    return tuple(f"verdicts.{name}.{word}" for name in goal.under for word in ("value", "limit", "tolerance", "passed"))


def _base(data: Mapping[str, Any], folder: Path) -> Plain:
    """Return the tables of the base design with `[set]` on top; refuses a base that is no design itself."""
    base = text_at(data, "base", "paper")
    path = folder / base if base.endswith(".toml") else design_path(base)
    settings = {key: _as_text(key, value) for key, value in _flat("set", data).items()}
    if settings.get(_PROCESS_FILE):  # under [set] its path starts beside the study file
        settings[_PROCESS_FILE] = str((folder / settings[_PROCESS_FILE]).absolute())
    tables = dict(with_process_file(overridden({"name": path.stem, **read_design(path)}, settings), path.parent))
    design_from_mapping(tables)
    return tables


def _goal(given: object) -> Goal:
    known = tuple(item.name for item in fields(Goal))
    if not isinstance(given, Mapping):
        raise validation_error("optimise", str(given), "", "a table", "write [optimise] and its keys below it")
    refuse_unknown_keys(given, known, table="optimise.")
    under = tuple(texts("optimise.under", given.get("under", Goal.under)))
    return Goal(
        minimise=text_at(given, "minimise", Goal.minimise), under=under, evaluations=whole_at(given, "evaluations", 600)
    )


def _as_text(key: str, value: object) -> str:
    """Return a value under `[set]` as the text of a setting; raises InputError for a date and for nan."""
    if isinstance(value, str):
        return value
    try:
        return json.dumps(value, allow_nan=False)
    except (TypeError, ValueError) as error:
        name, bound = f"set {key}", "a finite number, a list, a truth value or text"
        raise validation_error(name, str(value), "", bound, "mend that value") from error


def _flat(name: str, data: Mapping[str, Any]) -> dict[str, object]:
    """Return a table of a study file whose keys are `table.key`, quoted or not, by these names."""
    given = data.get(name, {})
    if not isinstance(given, Mapping):
        raise validation_error(name, str(given), "", "a table", f"write [{name}] and the keys below it")
    found: dict[str, object] = {}
    for key, value in given.items():
        if key in TABLES and isinstance(value, Mapping):
            found |= {f"{key}.{inner}": held for inner, held in value.items()}
        else:
            found[key] = value
    return found


def _check_design_key(key: str) -> None:
    known = [f"{table}.{item.name}" for table, kind in TABLE_TYPES.items() for item in fields(kind)]
    known += PRINTED_KEYS
    if key not in known:
        msg = f"vary {key}: unknown key of a design; must be table.key; did you mean {nearest(key, known)}?"
        raise InputError(msg)


def _check_word(name: str, value: object, known: tuple[str, ...]) -> None:
    if value not in known:
        bound = f"one of {', '.join(known)}"
        raise validation_error(name, str(value), "", bound, f"did you mean {nearest(str(value), known)}?")
