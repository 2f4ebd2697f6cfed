"""A study as a person writes it: a base design, what varies, how, and what is wanted; checked when it is read."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

from pipeline.options import DEFAULT_TOLERANCE, TOLERANCES, design_tables
from pipeline.study.variation import Choices, Setting, Variation, is_number, setting_of_cell, variation
from pipeline.study.wanted import LEVELS, VERDICT_FIELDS, Level, level_of
from pipeline.tables.rows import single_sheet
from pipeline.tables.table import refuse_length
from sensor.design.design_file import every_key
from sensor.design.design_tables import DesignTables
from sensor.design.parameters import TABLES, Design
from sensor.gone import refuse_gone
from sensor.input_file import read_toml
from sensor.quantity import Bounds, InputError, check_fields, choice, nearest, quantity, text_field, validation_error

Row = tuple[Setting, ...]
How = Literal["sobol", "grid", "points", "search", "sensitivity"]

HOW = ("sobol", "grid", "points", "search", "sensitivity")
MOST_POINTS = 10_000_000
REFUSED = "reading.refused"
UNCERTAINTY_KEYS = ("verdicts.reading.uncertainty.value", "reading.uncertainty_percent")
"""The uncertainty at the modulus where it is largest over its limit."""
UNCERTAINTY_LIMIT = "verdicts.reading.uncertainty.limit"
"""The limit there."""
_PROCESS_FILE = "print.process_file"
_MIDDLE = 0.5  # of what varies [1]
_NO_NUMBERS = ("passed", "fruit_stiffness", "method", "status", "refused")
_FILE_KEYS = ("base", "samples", "seed", "wanted", "vary", "set", "how", "points", "tol", "level", "optimise")


@dataclass(frozen=True, kw_only=True)
class Goal:
    """What `pipeline optimise` makes least, in how many points, and the names of the verdicts that must pass.

    `front` is a key, or empty. The search is repeated for each of its values.
    """

    minimise: str = text_field(default="verdicts.reading.uncertainty.value", hint="name a key of report.json")
    under: tuple[str, ...] = (
        "reading.bias",
        "reading.uncertainty",
        "reading.touch",
        "bruise",
        "printable.low",
        "printable.high",
    )
    evaluations: int = quantity("", Bounds(at_least=1), default=600, hint="the default is 600")
    front: str = ""

    def __post_init__(self) -> None:
        """Refuse a goal that is no number of a report, and too few points to search with."""
        check_fields(self, "optimise")
        if self.minimise.rpartition(".")[2] in _NO_NUMBERS:
            bound = "a key whose value is a number"
            raise validation_error("optimise.minimise", self.minimise, "", bound, "name another key of report.json")
        level_of("optimise.minimise", [self.minimise])
        level_of("optimise.under", verdict_keys(self))


@dataclass(frozen=True, kw_only=True)
class Study:
    """The tables of a base, the keys that vary, how points are drawn, and the keys of report.json wanted.

    The base may need what varies to be a design. `tol` is the relative error [1] allowed to the springs. `rows` are the
    points of a CSV file.
    """

    name: str
    base: DesignTables
    vary: Mapping[str, Variation]
    wanted: tuple[str, ...]
    how: How = choice(HOW, default="sobol")
    samples: int = quantity("", Bounds(at_least=0, at_most=MOST_POINTS), default=0, hint="say how many points")
    seed: int = quantity("", Bounds(at_least=0), default=0, hint="any whole number will do")
    tol: float = quantity("1", TOLERANCES, default=DEFAULT_TOLERANCE, hint=f"the default is {DEFAULT_TOLERANCE:g}")
    level: Level = choice(LEVELS, default="contact")
    rows: tuple[Row, ...] = ()
    goal: Goal = field(default_factory=Goal)

    def __post_init__(self) -> None:
        """Check every number and word; raises InputError."""
        check_fields(self, "study")
        if self.how == "sobol" and self.samples == 0:
            raise validation_error("samples", self.samples, "", "at least 1", "say how many points")
        if self.how == "sensitivity" and (self.samples < 2 or self.samples.bit_count() != 1):  # noqa: PLR2004
            hint = "choose a power of 2; the study has samples * (keys + 2) points"
            raise validation_error("samples", self.samples, "", "a power of 2, at least 2", hint)
        if not self.wanted:
            bound = "a list of keys of report.json"
            raise validation_error("wanted", "[]", "", bound, "for instance springs.K_l_N_per_m")
        level_of("wanted", self.wanted)
        if not set(self.vary) - {self.goal.front}:
            hint = "name a key of the design file under [vary]"
            raise validation_error("vary", "{}", "", "a table of at least one key", hint)
        if self.how == "sensitivity" and len(self.vary) == 1:
            hint = "one key makes all of the scatter; name another one under [vary]"
            raise validation_error("vary", next(iter(self.vary)), "", "a table of at least two keys", hint)
        refuse_gone(*self.vary)
        _refuse_unknown("vary ", self.vary, every_key())
        if _PROCESS_FILE in self.vary:
            hint = "put the processes into one file, give it in the base or under [set], and vary print.process"
            name = f"vary {_PROCESS_FILE}"
            raise validation_error(name, "", "", "left out", hint)
        if self.design is None:
            self.base.design(self.completing)

    @cached_property
    def design(self) -> Design | None:
        """Return the base as a design; None where it is one only with keys that vary."""
        try:
            return self.base.design()
        except InputError:
            return None

    @property
    def completing(self) -> dict[str, Setting]:
        """Return the middle of all that varies where the base needs it to be a design; nothing where it is one."""
        return {} if self.design is not None else self.settings_at([_MIDDLE] * len(self.vary))

    def settings_at(self, fractions: Iterable[float]) -> dict[str, Setting]:
        """Return the value of each key at fractions [1] from 0 to 1 of what varies, in the order of the study file."""
        return {key: varied.at(fraction) for (key, varied), fraction in zip(self.vary.items(), fractions, strict=True)}

    @property
    def front(self) -> tuple[Setting, ...]:
        """Return the values that the key of a front has, one search after the other; none without a front."""
        return self.vary[self.goal.front].grid() if self.goal.front else ()

    @property
    def keys(self) -> tuple[str, ...]:
        """Return the keys that vary and those that are wanted, each once."""
        return tuple(dict.fromkeys((*self.vary, *self.wanted)))


def verdict_keys(goal: Goal) -> tuple[str, ...]:
    """Return the keys of report.json that say whether the verdicts of a goal pass."""
    return tuple(f"verdicts.{name}.{field_name}" for name in goal.under for field_name in VERDICT_FIELDS)


def front_number(value: object) -> object:
    """Return the number by which a value of a front is drawn and named: of a list the first."""
    return value[0] if isinstance(value, list | tuple) else value


def read_study(path: Path) -> Study:
    """Return the study of a TOML file; raises InputError for an unknown key, which names the nearest known one."""
    data = read_toml(path, "FILE.toml")
    folder = path.parent  # of the files that it names
    _refuse_unknown("", data, _FILE_KEYS)
    how = data.get("how", _default_how(data))
    goal, front = _goal(data.get("optimise", {}))
    wanted = _texts("wanted", data.get("wanted", []))
    needed = wanted
    if how == "search":
        wanted = _with_goal(wanted, goal)
        # Whether a verdict passes is enough for a search: its value is followed where there is one.
        needed = (*needed, goal.minimise, *(f"verdicts.{name}.passed" for name in goal.under))
    level = data.get("level", "contact")
    if level in LEVELS:  # else the study refuses it
        level = max(level, level_of("wanted", needed), key=LEVELS.index)
    rows: tuple[Row, ...] = ()
    if how == "points":
        vary, rows = _points_file(folder / _text("points", data.get("points", "")))
    else:
        vary = {key: variation(key, varied) for key, varied in _flat("vary", data).items()}
    if how == "search":
        for key in front.keys() & vary.keys():
            hint = "leave it out under [vary], or name another key in the front"
            raise validation_error("optimise.front", key, "", "a key that does not vary", hint)
        vary |= front
    plain = {key: data[key] for key in ("samples", "seed", "tol") if key in data}
    base = _base(data, folder)
    return Study(
        name=path.stem, base=base, vary=vary, wanted=wanted, how=how, level=level, rows=rows, goal=goal, **plain
    )


def _with_goal(wanted: tuple[str, ...], goal: Goal) -> tuple[str, ...]:
    """Return the wanted keys with those that a search follows: its number, its verdicts, and why these fail."""
    reasons = []
    if any(name.startswith("reading.") for name in goal.under):
        reasons.append(REFUSED)
    if goal.minimise in UNCERTAINTY_KEYS:
        reasons.append(UNCERTAINTY_LIMIT)
    return tuple(dict.fromkeys((*wanted, goal.minimise, *verdict_keys(goal), *reasons)))


def _default_how(data: Mapping[str, Any]) -> str:
    """Return the way in which points are drawn where the file does not say."""
    if "points" in data:
        return "points"
    return "search" if "optimise" in data and "samples" not in data else "sobol"


def _goal(table: object) -> tuple[Goal, dict[str, Variation]]:
    """Return the goal of a table and the key of its front with the values, none where there is no front."""
    if not isinstance(table, Mapping):
        raise validation_error("optimise", str(table), "", "a table", "write [optimise] and its keys below it")
    _refuse_unknown("optimise.", table, [item.name for item in fields(Goal)])
    values = dict(table)
    if "under" in table:
        values["under"] = _texts("optimise.under", table["under"])
    front = _front(table) if "front" in table else {}
    values["front"] = "".join(front)
    return Goal(**values), front


def _front(table: Mapping[str, Any]) -> dict[str, Variation]:
    """Return the one key of a front with its values; raises InputError unless they are numbers that differ.

    Of values that are lists the first numbers must differ.
    """
    name = "optimise.front"
    front = {key: variation(key, values) for key, values in _flat(name, {name: table["front"]}).items()}
    if len(front) != 1:
        bound = "one key of the design file with a list of values"
        raise validation_error(name, ", ".join(front), "", bound, "make a study file for each front")
    for key, varied in front.items():
        numbers = list(map(front_number, varied.grid())) if isinstance(varied, Choices) else []
        all_differ = len(numbers) > 1 and len(numbers) == len(set(numbers))
        if not all(map(is_number, numbers)) or not all_differ:
            bound = "a list of at least two numbers that differ, or of lists whose first numbers do"
            raise validation_error(name, f"{key} {numbers}", "", bound, "list the values that the front is drawn over")
    return front


def _base(data: Mapping[str, Any], folder: Path) -> DesignTables:
    """Return the tables of the base design with `[set]` on top."""
    base = _text("base", data.get("base", "paper"))
    settings = _flat("set", data)
    if settings.get(_PROCESS_FILE):  # its path starts beside the study file
        settings[_PROCESS_FILE] = str(folder / str(settings[_PROCESS_FILE]))
    return design_tables(folder / base if base.endswith(".toml") else base, settings, "base")


def _points_file(path: Path) -> tuple[dict[str, Variation], tuple[Row, ...]]:
    """Return the keys of a CSV file of points, each with its first value, and its rows; raises InputError."""
    sheet = single_sheet(path)
    header, *points = [row for row in sheet.rows if not row.empty]
    if not points:
        raise validation_error("points", path.name, "", "a header of keys and at least one row", "add a point")
    keys = header.cells
    if len(set(keys)) < len(keys):
        bound = "each key in the header once"
        raise validation_error("points", ",".join(keys), "", bound, f"leave a column out of {path.name}")
    rows = []
    for row in points:
        refuse_length(sheet.source, row, len(keys))
        rows.append(tuple(setting_of_cell(key, cell) for key, cell in zip(keys, row.cells, strict=True)))
    # The rows hold the values; what varies only names the keys, each with a first value in its place.
    return {key: Choices(values=(value,)) for key, value in zip(keys, rows[0], strict=True)}, tuple(rows)


def _flat(name: str, data: Mapping[str, Any]) -> dict[str, object]:
    """Return a table of a study file whose keys are `table.key`, quoted or not, by these names."""
    table = data.get(name, {})
    if not isinstance(table, Mapping):
        raise validation_error(name, str(table), "", "a table", f"write [{name}] and the keys below it")
    flat: dict[str, object] = {}
    for key, value in table.items():
        if key in TABLES and isinstance(value, Mapping):
            flat |= {f"{key}.{inner}": setting for inner, setting in value.items()}
        else:
            flat[key] = value
    return flat


def _text(name: str, value: object) -> str:
    if not isinstance(value, str) or not value:
        raise validation_error(name, str(value), "", "text", "write it in quotes")
    return value


def _texts(name: str, value: object) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(word, str) for word in value):
        raise validation_error(name, str(value), "", "a list of texts", 'for instance ["springs.K_l_N_per_m"]')
    return tuple(value)


def _refuse_unknown(table: str, keys: Iterable[str], names: Iterable[str]) -> None:
    """Raise InputError for the first key that is none of some names, with these names and the nearest."""
    known = list(names)
    for key in keys:
        if key not in known:
            bound = f"one of {', '.join(known)}"
            msg = f"{table}{key} is an unknown key; it must be {bound}. Did you mean {nearest(key, known)}?"
            raise InputError(msg, field=f"{table}{key}", value=key, bound=bound)
