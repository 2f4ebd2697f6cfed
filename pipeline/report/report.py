"""Write and read report.json, as a tree of records in which each field is a key with its unit and meaning.

pipeline/report/of_result.py computes the keys from the stages of a sensor, and pipeline/report/keys.py looks up a key.
docs/report-json.md is generated from these records.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, is_dataclass
from enum import Enum
from pathlib import Path
from typing import get_origin, get_type_hints

import numpy as np

from cad.parts.housing import Housing
from pipeline.errors.error_records import LevelTargets, ScatterBands, UncertaintyBudget
from pipeline.notebook import answer_html
from pipeline.reading.read_out import ReadingConstants
from pipeline.report.parts import (
    AccuracyReport,
    ContactReport,
    CurveReport,
    MaterialReport,
    ModulusReport,
    PaperReport,
    ReadingReport,
    RelaxationReport,
    ResponseReport,
    SizingReport,
    TipReport,
)
from pipeline.springs.behaviour_record import SpringBehaviour
from pipeline.springs.spring import MadeSpring
from pipeline.storage.digests import KEY, content_digest, has_digest, is_regular, with_digest
from pipeline.storage.plain import Plain, from_plain, strict_converter
from pipeline.storage.record_data import as_data, structure_hook
from sensor.attributes import with_attributes
from sensor.design.design_file import design_from_mapping
from sensor.design.parameters import Design
from sensor.gone import REPORT_KEYS
from sensor.input_file import path_of
from sensor.quantity import InputError, check_type, report_field, validation_error
from sensor.record import Record
from sensor.theory.creep import CreepLaw
from sensor.verdict import Verdict
from solve.fruit.compliance import FruitCompliance

SCHEMA = 1


class LeftOut(Enum):
    """The value of a key that a report does not have; needed because None means that the key is null."""

    LEFT_OUT = "left out"


@dataclass(frozen=True, kw_only=True)
class ListedFile:
    """A file of an output folder, and the digest that it had when it was written."""

    path: str = report_field("", "path of the file in the folder")
    sha256: str = report_field("", "sha256 digest of the file, which `pipeline check` compares")

    def is_unchanged_in(self, folder: Path) -> bool:
        """Return whether the file is inside the folder and unchanged; False if the path is invalid."""
        path = folder / self.path
        try:
            is_inside = path.resolve().is_relative_to(folder.resolve())
        except (OSError, ValueError, RuntimeError):  # RuntimeError is raised if links form a loop
            return False
        return is_inside and has_digest(path, self.sha256)


@with_attributes
@dataclass(frozen=True, kw_only=True, repr=False)
class Report(Record):
    """All numbers of a run: the content of `report.json`, as returned by `read_report`.

    The tips are in the same order in all forces and in the compliance. `docs/report-json.md` lists the keys below each
    attribute.

    Examples
    --------
    >>> report = twintip.read_report(Path("outputs/mine"))  # written by pipeline run --out outputs/mine
    >>> [tip.name for tip in report.tips]
    ['low', 'high']
    """

    schema: int = report_field("1", f"version of this layout, {SCHEMA}", default=SCHEMA)
    design: Design = report_field(
        "",
        "every input of the run, as in [the design file](design-file.md); keys that are not set are left out",
        each="KEY",
    )
    springs: SizingReport = report_field("", "the springs that the targets or the design require", level="contact")
    flexures: dict[str, MadeSpring] = report_field(
        "", "the springs as fitted to the housing; left out for a line of tips", default_factory=dict, left_out=True,
        level="flexures", each="SPRING",
    )  # fmt: skip
    housing: Housing | None = report_field("", "the printed part; null if none can be made, and for a line of tips")
    deflections_mm: tuple[float, ...] = report_field(
        "mm", "deflection of the low and of the high spring at full travel on the firmest fruit", level="flexures"
    )
    material: MaterialReport = report_field("", "material of the print process")
    behaviour: SpringBehaviour | None = report_field(
        "", "properties of the fitted springs; null if `housing` is null", level="files"
    )
    contact: ContactReport = report_field("", "compliance of the fruit under the tips", level="contact")
    response: tuple[ResponseReport, ...] = report_field(
        "", "forces as functions of the travel, with one entry for each of `design.fruit.E_MPa`", level="contact"
    )
    curve: CurveReport = report_field("", "P at full travel as a function of the modulus, in fine steps")
    tips: tuple[TipReport, ...] = report_field("", "the tips, in the order of the forces in every table")
    read_out: ReadingConstants = report_field(
        "", "the constants from which [`pipeline read`](read-a-fruit.md) computes a modulus; every design has them"
    )
    reading: ReadingReport | None = report_field(
        "", "accuracy of the modulus that the sensor reads; null without `[reading]` in the design", level="contact"
    )
    level: LevelTargets = report_field("", "the design as a level sensor, by the two-spring law", level="contact")
    verdicts: tuple[Verdict, ...] = report_field("", "all verdicts on the design")
    remedy: str | None = report_field("", "the hint of the first verdict that did not pass; null if all pass")
    errors: dict[str, UncertaintyBudget | None] = report_field(
        "", "the error budget of each number; null if the number has none", level="files", each="NUMBER"
    )
    paper: PaperReport | None = report_field(
        "",
        "the springs of the paper, judged by the same rules; null if fruit or tips are not the paper's",
        level="files",
    )
    accuracy: AccuracyReport = report_field("", "the accuracy that was requested, and the accuracy that was reached")
    notes: tuple[str, ...] = report_field("", "sentences with advice for the user, in addition to the verdicts")
    versions: dict[str, str] = report_field("", "version of each package that affects a number", each="PACKAGE")
    files: tuple[ListedFile, ...] = report_field("", "the files of the output folder")
    seconds: dict[str, float] = report_field(
        "s",
        "wall time of each stage, and `total`. The stages `solids` and `fabrication` run parallel to the "
        "others, so the sum of all stages may exceed `total`",
        each="STAGE",
    )
    cpu_seconds: dict[str, float] = report_field(
        "s", "processor time of each stage, and `total`, of the process that solves", each="STAGE"
    )
    relaxation: RelaxationReport | None = report_field(
        "",
        "a press as a function of time, on flesh that relaxes; left out unless the design has `fruit.relaxation`",
        default=None,
        left_out=True,
    )
    tolerance: ScatterBands | LeftOut | None = report_field(
        "",
        "scatter of prints before calibration; only in reports of `pipeline design`; null if no housing can be made",
        default=LeftOut.LEFT_OUT,
        left_out=True,
    )
    key: str = report_field(
        "",
        "digest of design, options, program and packages. A run whose key is already in the folder solves "
        "nothing again",
    )
    digest: str = report_field(
        "",
        "sha256 of the report without this key, with sorted keys, no spaces, UTF-8. In a report that was "
        "changed, it does not match",
        default="",
        left_out=True,
    )

    def __post_init__(self) -> None:
        """Raise InputError if a layout with a housing has no flexures, or if deflections do not match the housing."""
        if self.design.tips.tip_layout.has_housing and not self.flexures:
            bound = f"given for tips.layout = {self.design.tips.layout!r}"
            raise validation_error("flexures", None, "", bound, "run the design again")
        if self.housing is not None and len(self.deflections_mm) != len(self.housing.arms):
            bound = f"one number for each of {len(self.housing.arms)} springs"
            raise validation_error("deflections_mm", list(self.deflections_mm), "mm", bound, "run the design again")

    def _repr_html_(self) -> str:
        """Return the answer, the verdicts, the springs and P as a function of the modulus as HTML for notebooks."""
        E, P = (np.array(values, dtype=np.float64) for values in (self.curve.E_MPa, self.curve.P))
        return answer_html(self.design.name, self.verdicts, self.flexures, E, P, self.design.fruit.E_MPa)

    @property
    def creep(self) -> CreepLaw:
        """Return the creep law of the print material."""
        return self.design.process.creep

    @property
    def moduli(self) -> tuple[ModulusReport, ...]:
        """Return the bias and the uncertainty of readings at each modulus; empty if the design has no readings."""
        return () if self.reading is None else self.reading.moduli

    @property
    def compliance(self) -> FruitCompliance:
        """Return the compliance of the fruit under the tips [1/mm], with its errors."""
        return self.contact.compliance(tuple(tip.name for tip in self.tips))


_CONVERTER = strict_converter()
_CONVERTER.register_structure_hook_factory(is_dataclass, lambda kind: structure_hook(kind, _CONVERTER))
_CONVERTER.register_structure_hook(Design, lambda data, _: design_from_mapping(data))
_CONVERTER.register_structure_hook(ScatterBands | LeftOut, lambda data, _: _CONVERTER.structure(data, ScatterBands))


def report_data(report: Report) -> Plain:
    """Return the JSON data of a report with their digest; raises ValueError if a number is nan or infinite."""
    return with_digest(as_data(report))


def read_report(folder: str | Path) -> Report:
    """Read the report of a run from its output folder.

    Parameters
    ----------
    folder : str or Path
        The output folder of a run.

    Returns
    -------
    Report
        The report, whose fields are the keys of `report.json`.

    Raises
    ------
    InputError
        If the folder has no `report.json`, or if the file was changed after the run.

    Examples
    --------
    >>> report = twintip.read_report(Path("outputs/mine"))  # written by pipeline run --out outputs/mine
    >>> report.design.tips.layout
    'pair'
    """
    path = path_of(folder, "folder")
    return report_from_data(path, written_data(path))


def check_report(report: object) -> None:
    """Raise InputError for an argument `report` that is no report, such as the path of its folder."""
    check_type("report", report, Report, "a Report, as twintip.read_report returns it", "read the folder first")


def written_data(folder: Path) -> Plain:
    """Return the JSON data of a folder's report; raises InputError if the file was changed after the run."""
    data = read_data(folder)
    if not is_as_written(data):
        raise _report_error(folder, "its report.json must be unchanged since the run, but its digest differs")
    return data


def is_as_written(data: Plain) -> bool:
    """Return whether a report's JSON data match their digest."""
    return bool(data.get(KEY) == content_digest(data))


def read_data(folder: Path) -> Plain:
    """Return the JSON data of a folder's report; neither its digest nor its keys are checked.

    Raises InputError if the file cannot be read, is not JSON, has a different schema, or contains nan or infinity.
    """
    path = folder / "report.json"
    try:
        if path.exists() and not is_regular(path):  # a pipe, for example, would block the reading
            raise IsADirectoryError(path)  # reported below like any other error of the file system
        text = path.read_text(encoding="utf-8")
        data = json.loads(text, parse_constant=_finite_number, parse_float=_finite_number)
    except (OSError, ValueError, RecursionError) as error:
        raise _report_error(folder, f"must hold a report.json that can be read ({type(error).__name__})") from error
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        raise _report_error(folder, f"its report.json must be written by pipeline run, with schema {SCHEMA}")
    return data


def report_from_data(folder: Path, data: Plain) -> Report:
    """Build a report from the JSON data of a folder's report.json.

    A report of version 0.2 may have keys that no longer exist; these are ignored. Raises InputError if the data are
    invalid; the message names the `folder`.
    """
    design = data.get("design")
    design_tables = design if isinstance(design, dict) else {}
    try:
        # This call only gives an invalid design its own error message. The design of the report is built below,
        # together with all other keys.
        design_from_mapping(design_tables)
    except InputError as error:
        raise _report_error(folder, f"its design must be valid in this version: {error}") from error
    try:
        # cattrs would turn a string into a tuple of characters, so each list is checked first.
        for key, field_type in get_type_hints(Report).items():
            if get_origin(field_type) is tuple and not isinstance(data.get(key, []), list):
                msg = f"expected a JSON list @ report.{key}"
                raise ValueError(msg)
        return from_plain(Report, _drop_removed_keys(data), "report", _CONVERTER)
    except ValueError as error:
        raise _report_error(folder, f"its report.json must be valid ({error})") from error


def _drop_removed_keys(data: Plain) -> Plain:
    """Return the JSON data of a report without the keys that only older versions wrote."""
    for name in REPORT_KEYS:
        data = _drop_key(data, name.split("."))
    return data


def _drop_key(data: Plain, path: Sequence[str]) -> Plain:
    """Return JSON data without the key at a path of nested keys; the data are unchanged if there is no such key."""
    first, *rest = path
    if not rest:
        return {key: value for key, value in data.items() if key != first}
    table = data.get(first)
    return {**data, first: _drop_key(table, rest)} if isinstance(table, dict) else data


def _finite_number(text: str) -> float:
    """Parse a number in a JSON text; raises ValueError for nan and infinity, which JSON does not allow."""
    value = float(text)
    if not math.isfinite(value):
        msg = f"{text} is not a JSON number"
        raise ValueError(msg)
    return value


def _report_error(folder: Path, bound: str) -> InputError:
    """Return the error for a folder whose report cannot be used; `bound` states the requirement on the report."""
    reason = " ".join(bound.split())
    message = f"PATH = {str(folder)!r} {reason}. Name an output folder, or run the design again."
    return InputError(message, field="PATH", value=str(folder), bound=reason)
