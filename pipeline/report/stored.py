"""The one reader of report.json: what the commands that start from an output folder take of it, typed."""

import json
import math
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, TypeVar

from cad.design.design_file import design_from_mapping
from cad.design.parameters import Design
from cad.parts.housing import Housing
from cad.quantity import InputError
from pipeline.storage.plain import Plain, from_plain
from pipeline.storage.seal import file_digest, is_regular

T = TypeVar("T")
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
    """The response at one modulus E [MPa]: P [1] over the travel [mm]; None where a tip was off the fruit.

    Forces [N] are those of a low and a high tip, means where there are more.
    """

    E_MPa: float
    x_mm: tuple[float, ...]
    P: tuple[float | None, ...]
    F_l_N: tuple[float, ...] = ()
    F_h_N: tuple[float, ...] = ()

    @property
    def forces_N(self) -> tuple[tuple[float, ...], ...]:
        """Return the force of a tip over the travel [N] for each spring, the low one's first."""
        return self.F_l_N, self.F_h_N

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
class StoredLevel:
    """What a level sensor reads [MPa] of a fruit of modulus E [MPa]."""

    E_MPa: float
    read_MPa: float


@dataclass(frozen=True, kw_only=True)
class StoredReadOut:
    """What turns forces into a modulus, in the terms of the contrast law or, for a pair, of the line over a press.

    `springs_mm_per_N` and `fruit_per_mm` (times E) have shape (tips, tips), `full_scale_N`, `weights` [1] and `gaps_mm`
    (tips,). A pair has `own_less_other_per_mm` and None for the terms of a contrast; other layouts the other way round.
    """

    method: str
    springs_mm_per_N: tuple[tuple[float, ...], ...]
    full_scale_N: tuple[float, ...]
    model_error_percent: float
    level: tuple[StoredLevel, ...]
    own_less_other_per_mm: float | None
    weights: tuple[float, ...] | None
    gaps_mm: tuple[float, ...] | None
    fruit_per_mm: tuple[tuple[float, ...], ...] | None
    hertz: float | None


@dataclass(frozen=True, kw_only=True)
class StoredModulus:
    """The largest bias of a reading over all poses at a modulus [%], and what its standard deviation is made of [%]."""

    E_MPa: float
    E_bias_percent: float
    uncertainty_percent: float


@dataclass(frozen=True, kw_only=True)
class StoredFlexure:
    """A spring: its stiffness [N/m], the strain at its root [1] with its error [%]; None where it is not made."""

    stiffness_N_per_m: float | None
    root_strain: float | None
    root_strain_error_percent: float | None


@dataclass(frozen=True, kw_only=True)
class StoredReport:
    """What commands take of a report: design, tips, contact, springs, housing [mm] or None, response, files.

    Tips have the order of all forces and of the compliance; `flexures` are by the name of the spring, and deflections
    [mm] those at which their strain is judged. `read_out` turns forces into a modulus; `moduli` say how good it is, none
    where the design asks for no readings.
    """

    design: Design
    tips: tuple[StoredTip, ...]
    contact: StoredContact
    flexures: dict[str, StoredFlexure]
    housing: Housing | None
    deflections_mm: tuple[float, ...]
    response: tuple[StoredResponse, ...]
    files: tuple[StoredFile, ...]
    read_out: StoredReadOut
    moduli: tuple[StoredModulus, ...]


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
    housing = None if data.get("housing", "") is None else _part(Housing, data, "housing")
    deflections = _part(tuple[float, ...], data, "deflections_mm")
    if housing is not None and len(deflections) != len(housing.arms):
        msg = f"deflections_mm has {len(deflections)} numbers; must be one for each of {len(housing.arms)} springs"
        raise ValueError(msg)
    rows = _part(tuple[Plain, ...], data, "response")
    return StoredReport(
        design=design_from_mapping(_part(Plain, data, "design")),
        tips=_part(tuple[StoredTip, ...], data, "tips"),
        contact=from_plain(StoredContact, _taken(_part(Plain, data, "contact"), StoredContact), "contact"),
        flexures={name: _flexure(row, name) for name, row in _part(Plain, data, "flexures").items()},
        housing=housing,
        deflections_mm=deflections,
        response=tuple(_response(row, f"response[{place}]") for place, row in enumerate(rows)),
        files=_part(tuple[StoredFile, ...], data, "files"),
        read_out=_part(StoredReadOut, data, "read_out"),
        moduli=_moduli(data),
    )


def _moduli(data: Plain) -> tuple[StoredModulus, ...]:
    """Return how good readings are at each modulus; nothing where the design asks for none."""
    if data.get("reading") is None:
        return ()
    rows = _part(tuple[Plain, ...], _part(Plain, data, "reading"), "moduli")
    return tuple(
        from_plain(StoredModulus, _taken(row, StoredModulus), f"reading.moduli[{place}]")
        for place, row in enumerate(rows)
    )


def _part(kind: type[T], data: Plain, key: str) -> T:
    if key not in data:
        msg = f"{key} is missing"
        raise ValueError(msg)
    return from_plain(kind, data[key], key)


def _flexure(row: Plain, name: str) -> StoredFlexure:
    return from_plain(StoredFlexure, _taken(row, StoredFlexure), f"flexures.{name}")


def _response(row: Plain, name: str) -> StoredResponse:
    """Return what is read of a row; its other keys stay where they are."""
    return from_plain(StoredResponse, _taken(row, StoredResponse), name)


def _taken(row: Plain, kind: type[Any]) -> Plain:
    """Return of a record the keys that a type has."""
    return {field.name: row[field.name] for field in fields(kind) if field.name in row}


def refused(folder: Path, bound: str) -> InputError:
    """Return the error for a folder whose report cannot be used, in one line."""
    reason = " ".join(bound.split())
    return InputError(f"PATH = {str(folder)!r}: {reason}; name an output folder, or run the design again")
