"""A study as described in a study file: a base design, the varied keys, the sampling, and the requested outputs.

All keys are checked when the file is read.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

from cattrs.gen import mapping_structure_factory

from pipeline.options import DEFAULT_TOLERANCE, TOLERANCES, design_tables
from pipeline.study.toml_records import check_table, file_converter, is_instance_of, record_of
from pipeline.study.variation import Choices, Setting, Variation, is_number, setting_of_cell, variation_of
from pipeline.study.wanted import LEVELS, VERDICT_FIELDS, Level, level_of
from pipeline.tables.number_formats import as_number, decimal_sign
from pipeline.tables.rows import single_sheet
from pipeline.tables.table import check_row_length
from sensor.design.design_file import every_key
from sensor.design.design_tables import DesignTables
from sensor.design.parameters import TABLES, Design
from sensor.gone import refuse_removed
from sensor.input_file import path_of, read_toml
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
MAX_POINTS = 10_000_000  # maximum number of points of a study
REFUSED = "reading.refused"  # key of the reason why forces cannot be read
UNCERTAINTY_KEYS = ("verdicts.reading.uncertainty.value", "reading.uncertainty_percent")
"""Keys of the uncertainty of a reading, at the modulus with the largest ratio of uncertainty to limit."""
UNCERTAINTY_LIMIT = "verdicts.reading.uncertainty.limit"
"""Key of the uncertainty limit at the same modulus."""
_PROCESS_FILE = "print.process_file"
_MIDDLE = 0.5  # the middle of a varied key's range, as a fraction of the range
# Last parts of the keys whose values are strings or Booleans
_NO_NUMBERS = ("passed", "fruit_stiffness", "method", "status", "refused")


@dataclass(frozen=True, kw_only=True)
class Goal:
    """The goal of `pipeline optimise`: the key to minimise, the verdicts that must pass, and the number of points.

    A Pareto `front` shows the best design as a function of one key. The search is repeated for each value listed for
    this key.
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
        hint="list the names of verdicts",
    )
    evaluations: int = quantity("", Bounds(at_least=1), default=600, hint="the default is 600")
    front: dict[str, Variation] | None = None

    def __post_init__(self) -> None:
        """Raise InputError if the objective is not a number in report.json, or if another key is invalid."""
        check_fields(self, "")
        if self.minimise.rpartition(".")[2] in _NO_NUMBERS:
            bound = "a key whose value is a number"
            raise validation_error("minimise", self.minimise, "", bound, "name another key of report.json")
        level_of("minimise", [self.minimise])
        level_of("under", verdict_keys(self))
        if self.front is not None:
            _check_front(self.front)

    @property
    def front_key(self) -> str:
        """Return the key of the front, or an empty string if there is no front."""
        return "".join(self.front or ())  # a front has exactly one key


def _check_front(front: Mapping[str, Variation]) -> None:
    """Raise InputError unless `front` has exactly one key, with a list of at least two different numbers.

    If the values are themselves lists, their first numbers must differ. A range or a distribution is rejected, because
    a search is run for each listed value.
    """
    if len(front) != 1:
        bound = "one key of the design file with a list of values"
        raise validation_error("front", ", ".join(front), "", bound, "make a study file for each front")
    ((key, varied),) = front.items()
    numbers = list(map(front_number, varied.grid())) if isinstance(varied, Choices) else []
    all_differ = len(numbers) > 1 and len(numbers) == len(set(numbers))
    if not all(map(is_number, numbers)) or not all_differ:
        bound = "a list of at least two different numbers, or of lists whose first numbers differ"
        raise validation_error("front", f"{key} {numbers}", "", bound, "list the values of this key")


@dataclass(frozen=True, kw_only=True)
class StudyKeys:
    """The keys that define a study: the varied keys, the sampling, and the requested outputs (`wanted`).

    `tol` is the relative tolerance [1] of the spring stiffnesses. `level` is the lowest level to which each point is
    solved.
    """

    vary: dict[str, Variation] = field(default_factory=dict)
    wanted: tuple[str, ...] = text_field(default=(), hint='for instance ["springs.K_l_N_per_m"]')
    samples: int = quantity("", Bounds(at_least=0, at_most=MAX_POINTS), default=0, hint="give the number of points")
    seed: int = quantity("", Bounds(at_least=0), default=0, hint="choose any whole number")
    tol: float = quantity("1", TOLERANCES, default=DEFAULT_TOLERANCE, hint=f"the default is {DEFAULT_TOLERANCE:g}")
    level: Level = choice(LEVELS, default="contact")
    goal: Goal = field(default_factory=Goal, metadata={"key": "optimise"})

    def __post_init__(self) -> None:
        """Raise InputError for a number outside its bounds, or for an unknown choice."""
        check_fields(self, "")


@dataclass(frozen=True, kw_only=True)
class StudyFile(StudyKeys):
    """The keys of a study file: those that define the study, and those that name its base design and points."""

    base: str = text_field(default="paper", hint="name a preset, or a design file that ends in .toml")
    set: dict[str, Any] = field(default_factory=dict)
    how: How | None = choice(HOW, default=None)
    points: str | None = text_field(default=None, hint="name a CSV file beside the study file")


@dataclass(frozen=True, kw_only=True)
class Study(StudyKeys):
    """A study: variations of a base design, and the outputs that are stored for each of them.

    `docs/studies.md` explains the keys of a study file.

    Attributes
    ----------
    name : str
        Name of the study, which is the name of its file.
    base : DesignTables
        Tables of the base design. They may lack varied keys; the values of a point then complete the design.
    how : "sobol", "grid", "points", "search" or "sensitivity"
        Method by which points are drawn.
    vary : dict of str to Variation
        Range or list of values of each varied key.
    rows : tuple of tuple
        Values of each point in a file of points; empty for other methods.
    wanted : tuple of str
        Keys of report.json whose values are stored for each point.
    samples : int
        Number of points to draw.
    seed : int
        Seed of the random numbers.
    tol : float
        Relative tolerance of the spring stiffnesses [1].
    level : "contact", "flexures" or "files"
        Lowest level to which each point is solved.
    goal : Goal
        The key that `pipeline optimise` minimises, and the verdicts that must pass.

    Raises
    ------
    InputError
        If a value is invalid, or contradicts another value.

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
        """Raise InputError for an invalid value, or for keys that contradict each other."""
        super().__post_init__()
        self._check_samples()
        if not self.wanted:
            bound = "a list of keys of report.json"
            raise validation_error("wanted", "[]", "", bound, "for instance springs.K_l_N_per_m")
        level_of("wanted", self.wanted)  # raises InputError for an unknown key
        self._check_varied_keys()
        if self.design is None:
            self.base.design(self.completing_settings)  # raises InputError if the varied keys do not complete the base

    def _check_samples(self) -> None:
        """Raise InputError if the number of samples does not suit the method by which points are drawn."""
        if self.how == "sobol" and self.samples == 0:
            raise validation_error("samples", self.samples, "", "at least 1", "give the number of points")
        if self.how == "sensitivity" and (self.samples < 2 or self.samples.bit_count() != 1):  # noqa: PLR2004
            hint = "choose a power of 2; the study has samples * (keys + 2) points"
            raise validation_error("samples", self.samples, "", "a power of 2, at least 2", hint)

    def _check_varied_keys(self) -> None:
        """Raise InputError for too few varied keys, and for a key that is unknown or cannot be varied.

        The key of a Pareto front is not counted as a varied key, because it does not vary within a search.
        """
        if not self.vary.keys() - {self.goal.front_key}:
            hint = "name a key of the design file under [vary]"
            raise validation_error("vary", "{}", "", "a table of at least one key", hint)
        if self.how == "sensitivity" and len(self.vary) == 1:
            hint = "name another key under [vary], because a single key causes all of the variance"
            raise validation_error("vary", next(iter(self.vary)), "", "a table of at least two keys", hint)
        refuse_removed(*self.vary)  # a key of an earlier version gets its own message
        for key in self.vary:
            if key not in every_key():
                raise unknown_name("key", f"vary.{key}", every_key(), key)
        if _PROCESS_FILE in self.vary:
            hint = "define all processes in one file, name it in the base or under [set], and vary print.process"
            name = f"vary.{_PROCESS_FILE}"
            raise validation_error(name, "", "", "left out", hint)

    @cached_property
    def design(self) -> Design | None:
        """Return the base design, or None if the base tables lack some of the varied keys."""
        try:
            return self.base.design()
        except InputError:
            return None

    @property
    def completing_settings(self) -> dict[str, Setting]:
        """Return the settings that complete the base design, with each varied key at the middle of its range.

        The settings are empty if the base design is complete without them.
        """
        return {} if self.design is not None else self.settings_at([_MIDDLE] * len(self.vary))

    def settings_at(self, fractions: Iterable[float]) -> dict[str, Setting]:
        """Return the value of each varied key at a fraction [1] of its range, from 0 to 1.

        `fractions` holds one fraction for each key, in the order of the keys in the study file.
        """
        return {key: varied.at(fraction) for (key, varied), fraction in zip(self.vary.items(), fractions, strict=True)}

    @property
    def front(self) -> tuple[Setting, ...]:
        """Return the values of the front's key; one search is run for each. Empty if there is no front."""
        has_front = self.how == "search" and bool(self.goal.front)
        return self.vary[self.goal.front_key].grid() if has_front else ()

    @property
    def keys(self) -> tuple[str, ...]:
        """Return the varied keys and the keys of the requested outputs, without duplicates."""
        return tuple(dict.fromkeys((*self.vary, *self.wanted)))


def verdict_keys(goal: Goal) -> tuple[str, ...]:
    """Return the report.json keys of all fields of the verdicts in a goal."""
    return tuple(f"verdicts.{name}.{field_name}" for name in goal.under for field_name in VERDICT_FIELDS)


def front_number(value: object) -> object:
    """Return the number that represents a value of a front: the value itself, or the first item of a list.

    Any other value is returned unchanged; `_check_front` rejects it.
    """
    return value[0] if isinstance(value, list | tuple) else value


def read_study(path: str | Path) -> Study:
    """Read and check a study file.

    Parameters
    ----------
    path : str or Path
        The study file, in TOML.

    Returns
    -------
    Study
        The study, with all keys checked.

    Raises
    ------
    InputError
        If the file does not exist, a key is unknown, or a value is invalid.

    Examples
    --------
    >>> twintip.read_study(Path("springs.toml")).how
    'grid'
    """
    path = path_of(path, "path")
    data = read_toml(path, "FILE.toml")
    folder = path.parent  # paths in the study file are relative to this folder
    study_file = record_of(StudyFile, data, _CONVERTER)
    how = study_file.how or _default_sampling(data)
    study_keys = {item.name: getattr(study_file, item.name) for item in fields(StudyKeys)}
    rows: tuple[Row, ...] = ()
    level_keys = study_file.wanted  # the keys that determine the lowest level to which each point is solved
    if how == "points":
        study_keys["vary"], rows = _read_points(folder / (study_file.points or ""))
    if how == "search":
        goal = study_file.goal
        study_keys["vary"] = _vary_with_front(study_file)
        study_keys["wanted"] = _extend_wanted(study_file.wanted, goal)
        # A search only needs to know whether a verdict passes. Computing the value of a verdict may need a higher
        # level, so the keys that `_extend_wanted` adds do not determine the level.
        level_keys = (*level_keys, goal.minimise, *(f"verdicts.{name}.passed" for name in goal.under))
    study_keys["level"] = max(study_file.level, level_of("wanted", level_keys), key=LEVELS.index)
    return Study(name=path.stem, base=_base_tables(study_file, folder), how=how, rows=rows, **study_keys)


def _vary_with_front(study_file: StudyFile) -> dict[str, Variation]:
    """Return the varied keys of a search, followed by the key of its Pareto front, if it has one.

    Raises InputError if the key of the front varies too.
    """
    front = study_file.goal.front or {}
    for key in front.keys() & study_file.vary.keys():
        hint = "remove the key from [vary], or choose another key for the front"
        raise validation_error("optimise.front", key, "", "a key that does not vary", hint)
    return {**study_file.vary, **front}


def _extend_wanted(wanted: tuple[str, ...], goal: Goal) -> tuple[str, ...]:
    """Return the requested outputs together with the outputs that a search needs, without duplicates.

    A search needs its objective and its verdicts. If a verdict judges readings, it also needs the reason why forces
    cannot be read. If the search minimises an uncertainty, it also needs the limit of this uncertainty.
    """
    further_keys = []
    if any(row_of(name).needs == "reading" for name in goal.under):
        further_keys.append(REFUSED)
    if goal.minimise in UNCERTAINTY_KEYS:
        further_keys.append(UNCERTAINTY_LIMIT)
    return tuple(dict.fromkeys((*wanted, goal.minimise, *verdict_keys(goal), *further_keys)))


def _default_sampling(data: Mapping[str, Any]) -> How:
    """Return the method by which points are drawn if the study file, with the content `data`, has no key `how`.

    A file of points is used if one is given. A table `[optimise]` without `samples` means a search.
    """
    if "points" in data:
        return "points"
    return "search" if "optimise" in data and "samples" not in data else "sobol"


def _base_tables(study_file: StudyFile, folder: Path) -> DesignTables:
    """Return the tables of the base design, after applying the settings under `[set]`.

    Paths in the study file are relative to `folder`. A base whose name does not end in .toml is a preset.
    """
    base = study_file.base
    settings = study_file.set
    if settings.get(_PROCESS_FILE):
        settings = {**settings, _PROCESS_FILE: str(folder / str(settings[_PROCESS_FILE]))}
    return design_tables(folder / base if base.endswith(".toml") else base, settings, "base")


def _read_points(path: Path) -> tuple[dict[str, Variation], tuple[Row, ...]]:
    """Read a CSV file of points, which has a header of keys and one row of values for each point.

    Returns the varied keys, and the values of each point in the order of the keys. Raises InputError if there is no
    row, if a key occurs twice, if a row is not as long as the header, and for an invalid value. The numbers of the file
    share one decimal sign, as in a measured table; it is refused if commas may separate thousands.
    """
    sheet = single_sheet(path)
    header, *points = [row for row in sheet.rows if not row.is_empty]
    if not points:
        raise validation_error("points", path.name, "", "a file with a header and at least one row", "add a point")
    keys = header.cells
    if len(set(keys)) < len(keys):
        bound = "a header without repeated keys"
        raise validation_error("points", ",".join(keys), "", bound, f"remove a column from {path.name}")
    for row in points:
        check_row_length(sheet.source, row, len(keys))
    columns = [[(row.line, row.cells[index]) for row in points] for index in range(len(keys))]
    decimal = decimal_sign(sheet.source, columns)
    rows = []
    for row in points:
        cells = [_with_decimal_point(cell, decimal) for cell in row.cells]
        rows.append(tuple(setting_of_cell(key, cell) for key, cell in zip(keys, cells, strict=True)))
    # The points come from `rows`, so a study uses only the names of the varied keys. A key must have a variation, which
    # is here the value of the first point.
    vary: dict[str, Variation] = {key: Choices(values=(value,)) for key, value in zip(keys, rows[0], strict=True)}
    return vary, tuple(rows)


def _with_decimal_point(cell: str, decimal: str) -> str:
    """Return a cell with its number in Python's notation if the file has decimal commas; other text is unchanged."""
    number = as_number(cell) if decimal == "," else None
    return cell if number is None or number.unit else number.plain(decimal) or cell


def _design_keys_hook(kind: Any) -> Callable[[object, Any], dict[str, Any]]:  # noqa: ANN401 - a type of dict
    """Return the cattrs structure hook for a table of design keys, as under `[vary]` and `[set]`.

    TOML reads the unquoted key `table.key` as a nested table, and the quoted key as a single key. The hook accepts both
    and returns dotted keys. For a value that is not a table, the hook raises MisfitError.
    """
    structure = mapping_structure_factory(kind, _CONVERTER)

    def structure_dotted(data: object, _: Any) -> dict[str, Any]:  # noqa: ANN401 - the type of dict
        by_dotted_key: dict[str, object] = {}
        for key, value in check_table(data).items():
            if key in TABLES and isinstance(value, Mapping):  # an unquoted key
                by_dotted_key |= {f"{key}.{inner_key}": setting for inner_key, setting in value.items()}
            else:
                by_dotted_key[key] = value
        return dict(structure(by_dotted_key, kind))

    return structure_dotted


_CONVERTER = file_converter()
_CONVERTER.register_structure_hook(Variation, lambda data, _: variation_of(data, _CONVERTER))
_CONVERTER.register_structure_hook_factory(lambda kind: is_instance_of(kind, dict), _design_keys_hook)
