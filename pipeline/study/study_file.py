"""A study as written in its file: a base design, what varies and how, and the wanted keys; checked when it is read."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

from cattrs.gen import mapping_structure_factory

from pipeline.options import DEFAULT_TOLERANCE, TOLERANCES, design_tables
from pipeline.study.toml_records import check_table, file_converter, is_of, record_of
from pipeline.study.variation import Choices, Setting, Variation, is_number, setting_of_cell, variation
from pipeline.study.wanted import LEVELS, VERDICT_FIELDS, Level, level_of
from pipeline.tables.rows import single_sheet
from pipeline.tables.table import refuse_length
from sensor.design.design_file import every_key
from sensor.design.design_tables import DesignTables
from sensor.design.parameters import TABLES, Design
from sensor.gone import refuse_gone
from sensor.input_file import read_toml
from sensor.quantity import (
    Bounds,
    InputError,
    check_fields,
    choice,
    quantity,
    text_field,
    unknown_name,
    validation_error,
)
from sensor.verdict import row_of

Row = tuple[Setting, ...]
How = Literal["sobol", "grid", "points", "search", "sensitivity"]

HOW = ("sobol", "grid", "points", "search", "sensitivity")
MOST_POINTS = 10_000_000
REFUSED = "reading.refused"
UNCERTAINTY_KEYS = ("verdicts.reading.uncertainty.value", "reading.uncertainty_percent")
"""Keys of the uncertainty at the modulus with the largest ratio to its limit."""
UNCERTAINTY_LIMIT = "verdicts.reading.uncertainty.limit"
"""The limit at that modulus."""
_PROCESS_FILE = "print.process_file"
_MIDDLE = 0.5  # middle of a varied key [1]
_NO_NUMBERS = ("passed", "fruit_stiffness", "method", "status", "refused")


@dataclass(frozen=True, kw_only=True)
class Goal:
    """The goal of `pipeline optimise`: the key to minimise, the number of points, and the verdicts that must pass.

    A `front` has one key with a list of values. The search is repeated for each of them.
    """

    minimise: str = text_field(default="verdicts.reading.uncertainty.value", hint="name a key of report.json")
    under: tuple[str, ...] = text_field(
        default=(
            "reading.bias",
            "reading.uncertainty",
            "reading.touch",
            "reading.calibration",
            "bruise",
            "printable.low",
            "printable.high",
        ),
        hint="name verdicts of a run",
    )
    evaluations: int = quantity("", Bounds(at_least=1), default=600, hint="the default is 600")
    front: dict[str, Variation] | None = None

    def __post_init__(self) -> None:
        """Refuse a goal that is no number of a report, too few points for a search, and a front without values."""
        check_fields(self, "")
        if self.minimise.rpartition(".")[2] in _NO_NUMBERS:
            bound = "a key whose value is a number"
            raise validation_error("minimise", self.minimise, "", bound, "name another key of report.json")
        level_of("minimise", [self.minimise])
        level_of("under", verdict_keys(self))
        if self.front is not None:
            _refuse_no_front(self.front)

    @property
    def front_key(self) -> str:
        """Return the key of the front, or an empty string."""
        return "".join(self.front or ())


def _refuse_no_front(front: Mapping[str, Variation]) -> None:
    """Raise InputError unless a front has one key with a list of different numbers.

    For values that are lists, the first numbers must differ.
    """
    if len(front) != 1:
        bound = "one key of the design file with a list of values"
        raise validation_error("front", ", ".join(front), "", bound, "make a study file for each front")
    for key, varied in front.items():
        numbers = list(map(front_number, varied.grid())) if isinstance(varied, Choices) else []
        all_differ = len(numbers) > 1 and len(numbers) == len(set(numbers))
        if not all(map(is_number, numbers)) or not all_differ:
            bound = "a list of at least two numbers that differ, or of lists whose first numbers do"
            raise validation_error(
                "front", f"{key} {numbers}", "", bound, "list the values that the front is drawn over"
            )


@dataclass(frozen=True, kw_only=True)
class StudyKeys:
    """The keys of a study in its file: what varies, how points are drawn, and the wanted keys.

    `tol` is the allowed relative error [1] of the springs, and `level` the least that is solved.
    """

    vary: dict[str, Variation] = field(default_factory=dict)
    wanted: tuple[str, ...] = text_field(default=(), hint='for instance ["springs.K_l_N_per_m"]')
    samples: int = quantity("", Bounds(at_least=0, at_most=MOST_POINTS), default=0, hint="give the number of points")
    seed: int = quantity("", Bounds(at_least=0), default=0, hint="any whole number will do")
    tol: float = quantity("1", TOLERANCES, default=DEFAULT_TOLERANCE, hint=f"the default is {DEFAULT_TOLERANCE:g}")
    level: Level = choice(LEVELS, default="contact")
    goal: Goal = field(default_factory=Goal, metadata={"key": "optimise"})

    def __post_init__(self) -> None:
        """Check every number and word; raises InputError."""
        check_fields(self, "")


@dataclass(frozen=True, kw_only=True)
class StudyFile(StudyKeys):
    """The keys of a study file: the keys of its study, and the sources of base and points."""

    base: str = text_field(default="paper", hint="name a preset, or a design file that ends in .toml")
    set: dict[str, Any] = field(default_factory=dict)
    how: How | None = choice(HOW, default=None)
    points: str | None = text_field(default=None, hint="name a CSV file beside the study file")


@dataclass(frozen=True, kw_only=True)
class Study(StudyKeys):
    """A study: many designs around a base design, and the numbers that are wanted of each.

    `docs/studies.md` explains the keys of a study file.

    Attributes
    ----------
    name : str
        Name of the study, from its file.
    base : DesignTables
        Tables of the base design. They may need the varied keys to be a whole design.
    how : "sobol", "grid", "points", "search" or "sensitivity"
        How points are drawn.
    vary : dict of str to Variation
        Range or list of values of each varied key.
    rows : tuple of tuple
        Values of each point that a file of points gives; empty for others.
    wanted : tuple of str
        Keys of report.json that are stored for each point.
    samples : int
        Number of points to draw.
    seed : int
        Seed of the random numbers.
    tol : float
        Allowed relative error of the springs [1].
    level : "contact", "flexures" or "files"
        The least that is solved for each point.
    goal : Goal
        What `pipeline optimise` minimises, and the verdicts that must pass.

    Raises
    ------
    InputError
        If a value is not allowed, or does not agree with another one.

    Examples
    --------
    >>> study = twintip.read_study(Path("springs.toml"))
    >>> list(study.vary), study.wanted
    (['targets.P_max'], ('springs.K_l_N_per_m',))
    """

    name: str
    base: DesignTables
    how: How = choice(HOW, default="sobol")
    rows: tuple[Row, ...] = ()

    def __post_init__(self) -> None:
        """Check every number and word, and their combination; raises InputError."""
        super().__post_init__()
        if self.how == "sobol" and self.samples == 0:
            raise validation_error("samples", self.samples, "", "at least 1", "give the number of points")
        if self.how == "sensitivity" and (self.samples < 2 or self.samples.bit_count() != 1):  # noqa: PLR2004
            hint = "choose a power of 2; the study has samples * (keys + 2) points"
            raise validation_error("samples", self.samples, "", "a power of 2, at least 2", hint)
        if not self.wanted:
            bound = "a list of keys of report.json"
            raise validation_error("wanted", "[]", "", bound, "for instance springs.K_l_N_per_m")
        level_of("wanted", self.wanted)
        if not self.vary.keys() - {self.goal.front_key}:
            hint = "name a key of the design file under [vary]"
            raise validation_error("vary", "{}", "", "a table of at least one key", hint)
        if self.how == "sensitivity" and len(self.vary) == 1:
            hint = "one key makes all of the scatter; name another one under [vary]"
            raise validation_error("vary", next(iter(self.vary)), "", "a table of at least two keys", hint)
        refuse_gone(*self.vary)
        for key in self.vary:
            if key not in every_key():
                raise unknown_name("key", f"vary.{key}", every_key(), key)
        if _PROCESS_FILE in self.vary:
            hint = "put the processes into one file, give it in the base or under [set], and vary print.process"
            name = f"vary.{_PROCESS_FILE}"
            raise validation_error(name, "", "", "left out", hint)
        if self.design is None:
            self.base.design(self.completing)

    @cached_property
    def design(self) -> Design | None:
        """Return the base as a design; None if it needs varied keys to be one."""
        try:
            return self.base.design()
        except InputError:
            return None

    @property
    def completing(self) -> dict[str, Setting]:
        """Return the middle of all varied keys if the base needs them to be a design; else nothing."""
        return {} if self.design is not None else self.settings_at([_MIDDLE] * len(self.vary))

    def settings_at(self, fractions: Iterable[float]) -> dict[str, Setting]:
        """Return the value of each varied key at a fraction [1] from 0 to 1, in the order of the study file."""
        return {key: varied.at(fraction) for (key, varied), fraction in zip(self.vary.items(), fractions, strict=True)}

    @property
    def front(self) -> tuple[Setting, ...]:
        """Return the values of the front's key, one search each; empty without a front."""
        return self.vary[self.goal.front_key].grid() if self.how == "search" and self.goal.front else ()

    @property
    def keys(self) -> tuple[str, ...]:
        """Return the varied and the wanted keys, each once."""
        return tuple(dict.fromkeys((*self.vary, *self.wanted)))


def verdict_keys(goal: Goal) -> tuple[str, ...]:
    """Return the keys of report.json that decide whether the verdicts of a goal pass."""
    return tuple(f"verdicts.{name}.{field_name}" for name in goal.under for field_name in VERDICT_FIELDS)


def front_number(value: object) -> object:
    """Return the number that places and names a value of a front; the first one of a list."""
    return value[0] if isinstance(value, list | tuple) else value


def read_study(path: Path) -> Study:
    """Return the study of a study file.

    Parameters
    ----------
    path : Path
        The study file, in TOML.

    Returns
    -------
    Study
        The study, whose keys are all checked.

    Raises
    ------
    InputError
        If there is no such file, a key is unknown, or a value is not allowed.

    Examples
    --------
    >>> twintip.read_study(Path("springs.toml")).how
    'grid'
    """
    data = read_toml(path, "FILE.toml")
    folder = path.parent  # folder of the files that it names
    file = record_of(StudyFile, data, _CONVERTER)
    how = file.how or _default_how(data)
    goal = file.goal
    keys = {item.name: getattr(file, item.name) for item in fields(StudyKeys)}
    rows: tuple[Row, ...] = ()
    needed = file.wanted
    if how == "points":
        keys["vary"], rows = _points_file(folder / (file.points or ""))
    if how == "search":
        front = goal.front or {}
        for key in front.keys() & file.vary.keys():
            hint = "leave it out under [vary], or name another key in the front"
            raise validation_error("optimise.front", key, "", "a key that does not vary", hint)
        keys["vary"] = {**file.vary, **front}
        keys["wanted"] = _with_goal(file.wanted, goal)
        # A search needs only to know whether a verdict passes; it follows the value if there is one.
        needed = (*needed, goal.minimise, *(f"verdicts.{name}.passed" for name in goal.under))
    keys["level"] = max(file.level, level_of("wanted", needed), key=LEVELS.index)
    return Study(name=path.stem, base=_base(file, folder), how=how, rows=rows, **keys)


def _with_goal(wanted: tuple[str, ...], goal: Goal) -> tuple[str, ...]:
    """Return the wanted keys, extended by those that a search follows: its number, its verdicts, and why they fail."""
    reasons = []
    if any(row_of(name).needs == "reading" for name in goal.under):
        reasons.append(REFUSED)
    if goal.minimise in UNCERTAINTY_KEYS:
        reasons.append(UNCERTAINTY_LIMIT)
    return tuple(dict.fromkeys((*wanted, goal.minimise, *verdict_keys(goal), *reasons)))


def _default_how(data: Mapping[str, Any]) -> How:
    """Return how points are drawn if the file does not state it."""
    if "points" in data:
        return "points"
    return "search" if "optimise" in data and "samples" not in data else "sobol"


def _base(file: StudyFile, folder: Path) -> DesignTables:
    """Return the tables of the base design with `[set]` on top."""
    settings = file.set
    if settings.get(_PROCESS_FILE):  # the path is relative to the study file
        settings = {**settings, _PROCESS_FILE: str(folder / str(settings[_PROCESS_FILE]))}
    return design_tables(folder / file.base if file.base.endswith(".toml") else file.base, settings, "base")


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
    # The rows hold the values. The varied keys only need names, so each gets its first value.
    return {key: Choices(values=(value,)) for key, value in zip(keys, rows[0], strict=True)}, tuple(rows)


def _by_keys_hook(kind: Any) -> Callable[[object, Any], dict[str, Any]]:  # noqa: ANN401 - a type of dict
    """Return cattrs' function for a table of design keys, written as `table.key` with or without quotes."""
    structure = mapping_structure_factory(kind, _CONVERTER)

    def structure_flat(given: object, _: Any) -> dict[str, Any]:  # noqa: ANN401 - the type of dict
        flat: dict[str, object] = {}
        for key, value in check_table(given).items():
            if key in TABLES and isinstance(value, Mapping):
                flat |= {f"{key}.{inner}": setting for inner, setting in value.items()}
            else:
                flat[key] = value
        return dict(structure(flat, kind))

    return structure_flat


_CONVERTER = file_converter()
_CONVERTER.register_structure_hook(Variation, lambda given, _: variation(given, _CONVERTER))
_CONVERTER.register_structure_hook_factory(lambda kind: is_of(kind, dict), _by_keys_hook)
