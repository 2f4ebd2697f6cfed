"""The one reader of report.json: what the commands that start from an output folder take of it, typed."""

import json
import math
from dataclasses import dataclass
from pathlib import Path

from cad.design.design_file import design_from_mapping
from cad.design.parameters import Design
from cad.parts.housing import Housing
from cad.quantity import InputError
from cad.verdict import Verdict
from pipeline.report.stored_parts import inner, optional, part, record, records
from pipeline.report.stored_records import (
    StoredBudget,
    StoredCurve,
    StoredModulus,
    StoredPaper,
    StoredPressure,
    StoredReading,
    StoredReadOut,
    StoredSolve,
    StoredSpring,
)
from pipeline.storage.plain import Plain
from pipeline.storage.seal import file_digest, is_regular

SCHEMA = 1


@dataclass(frozen=True, kw_only=True)
class StoredFile:
    """A file of an output folder and its digest when it was written."""

    path: str
    sha256: str

    def is_unchanged_in(self, folder: Path) -> bool:
        """Say whether the file still lies inside the folder as it was written; a path that no file has does not."""
        path = folder / self.path
        try:
            inside = path.resolve().is_relative_to(folder.resolve())
            return inside and is_regular(path) and file_digest(path) == self.sha256
        except (OSError, ValueError, RuntimeError):  # a loop of links is the last one
            return False


@dataclass(frozen=True, kw_only=True)
class StoredResponse:
    """The response at one modulus E [MPa] over the travel [mm]: P [1] and forces [N]; None where a tip was off.

    `F_l_N` and `F_h_N` are means over the tips of a kind; `F_N` has a row for each tip, none for a pair.
    """

    E_MPa: float
    x_mm: tuple[float, ...]
    P: tuple[float | None, ...]
    F_l_N: tuple[float | None, ...] = ()
    F_h_N: tuple[float | None, ...] = ()
    F_N: tuple[tuple[float | None, ...], ...] = ()
    P_error_percent: tuple[float | None, ...] = ()

    @property
    def kind_forces(self) -> tuple[tuple[float | None, ...], ...]:
        """Return the force of a tip over the travel [N] for each spring, the low one's first; means over its tips."""
        return self.F_l_N, self.F_h_N

    @property
    def tip_forces(self) -> tuple[tuple[float | None, ...], ...]:
        """Return the forces of each tip over the travel [N], shape (tips, travels), in the order of the tips."""
        return self.F_N or (self.F_l_N, self.F_h_N)

    @property
    def last_P(self) -> float | None:
        """Return P at the deepest travel where all tips are on the fruit [1]."""
        touching = [P for P in self.P if P is not None]
        return touching[-1] if touching else None


@dataclass(frozen=True, kw_only=True)
class StoredTip:
    """A tip: its name, its place from the midpoint of the tips [mm], and on which spring it stands, low or high."""

    name: str
    x_mm: float
    y_mm: float
    spring: str


@dataclass(frozen=True, kw_only=True)
class StoredContact:
    """The compliance of the fruit under its tips times E [1/mm], shape (tips, tips), and its relative errors [%]."""

    compliance_per_mm: tuple[tuple[float, ...], ...]
    error_percent: float
    s11_error_percent: float


@dataclass(frozen=True, kw_only=True)
class StoredReport:
    """What commands take of a report: design, tips, contact, housing [mm] or None, deflections [mm], response, files.

    Tips have the order of all forces and of the compliance. `read_out` turns forces into a modulus; `tolerance` [1] and
    `fruit_stiffness` are what was asked for.
    """

    design: Design
    tips: tuple[StoredTip, ...]
    contact: StoredContact
    contact_solve: StoredSolve
    housing: Housing | None
    deflections_mm: tuple[float, ...]
    response: tuple[StoredResponse, ...]
    curve: StoredCurve
    files: tuple[StoredFile, ...]
    verdicts: tuple[Verdict, ...]
    paper: StoredPaper | None
    remedy: str | None
    springs: dict[str, StoredSpring]
    errors: dict[str, StoredBudget | None]
    read_out: StoredReadOut
    reading: StoredReading | None
    notes: tuple[str, ...]
    tolerance: float
    fruit_stiffness: str
    versions: dict[str, str]
    seconds: dict[str, float]

    @property
    def moduli(self) -> tuple[StoredModulus, ...]:
        """Return how well each modulus is read, none where the design asks for no readings."""
        return () if self.reading is None else self.reading.moduli


def read_report(folder: Path) -> StoredReport:
    """Return the report of an output folder; raises InputError, in one line, where it holds none as it was written."""
    return report_of(folder, read_data(folder))


def read_data(folder: Path) -> Plain:
    """Return the JSON data of a folder's report, whose numbers are finite; raises InputError, in one line."""
    path = folder / "report.json"
    try:
        if path.exists() and not is_regular(path):
            raise IsADirectoryError(path)
        text = path.read_text(encoding="utf-8")
        data = json.loads(text, parse_constant=_finite, parse_float=_finite)
    except (OSError, ValueError, RecursionError) as error:
        raise refused(folder, f"must hold a report.json that can be read ({type(error).__name__})") from error
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        raise refused(folder, f"its report.json must be one of pipeline run, schema {SCHEMA}")
    return data


def report_of(folder: Path, data: Plain) -> StoredReport:
    """Return the report of a folder's JSON data; raises InputError, in one line, where it is not as it was written."""
    try:
        return _report(data)
    except ValueError as error:
        raise refused(folder, f"its report.json must be as it was written ({error})") from error


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        msg = f"{text} is no number of JSON"
        raise ValueError(msg)
    return value


def _report(data: Plain) -> StoredReport:
    """Return the report of its JSON data; raises ValueError that names the first key that does not fit."""
    housing = optional(Housing, data, "housing")
    return StoredReport(
        design=design_from_mapping(part(Plain, data, "design")),
        tips=part(tuple[StoredTip, ...], data, "tips"),
        contact=record(StoredContact, data, "contact"),
        contact_solve=record(StoredSolve, data, "contact"),
        housing=housing,
        deflections_mm=_deflections(data, housing),
        response=records(StoredResponse, data, "response"),
        curve=record(StoredCurve, data, "curve"),
        files=part(tuple[StoredFile, ...], data, "files"),
        verdicts=records(Verdict, data, "verdicts"),
        paper=_paper(data),
        remedy=optional(str, data, "remedy"),
        springs=_springs(data),
        errors=part(dict[str, StoredBudget | None], data, "errors"),
        read_out=part(StoredReadOut, data, "read_out"),
        reading=_reading(data),
        notes=part(tuple[str, ...], data, "notes"),
        tolerance=inner(float, data, "accuracy", "tolerance"),
        fruit_stiffness=inner(str, data, "springs", "fruit_stiffness"),
        versions=part(dict[str, str], data, "versions"),
        seconds=part(dict[str, float], data, "seconds"),
    )


def _deflections(data: Plain, housing: Housing | None) -> tuple[float, ...]:
    deflections = part(tuple[float, ...], data, "deflections_mm")
    if housing is not None and len(deflections) != len(housing.arms):
        msg = f"deflections_mm has {len(deflections)} numbers; must be one for each of {len(housing.arms)} springs"
        raise ValueError(msg)
    return deflections


def _springs(data: Plain) -> dict[str, StoredSpring]:
    springs = part(Plain, data, "flexures")
    return {name: record(StoredSpring, springs, name) for name in springs}


def _paper(data: Plain) -> StoredPaper | None:
    paper = optional(Plain, data, "paper")
    if paper is None:
        return None
    K = {key: part(float, paper, key) for key in ("K_l_N_per_m", "K_h_N_per_m")}
    return StoredPaper(**K, verdicts=records(Verdict, paper, "verdicts"))


def _reading(data: Plain) -> StoredReading | None:
    reading = optional(Plain, data, "reading")
    if reading is None:
        return None
    return StoredReading(
        method=part(str, reading, "method"),
        lift_deg=part(float, reading, "lift_deg"),
        moduli=records(StoredModulus, reading, "moduli"),
        skin_pressure=records(StoredPressure, reading, "skin_pressure") if "skin_pressure" in reading else (),
    )


def refused(folder: Path, bound: str) -> InputError:
    """Return the error for a folder whose report cannot be used, in one line."""
    reason = " ".join(bound.split())
    return InputError(f"PATH = {str(folder)!r}: {reason}; name an output folder, or run the design again")
