"""What later commands and the page take of report.json: its keys as typed fields, in their units.

docs/report-json.md says what each key means, pipeline/report/mapping.py writes them all.
"""

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_origin, get_type_hints

import numpy as np

from cad.arrays import Floats
from cad.design.design_file import design_as_mapping, design_from_mapping, former_keys, without_former_defaults
from cad.design.parameters import Design
from cad.parts.housing import Housing
from cad.quantity import InputError, validation_error
from cad.theory.leaf_spring import Flexure
from cad.verdict import Verdict
from pipeline.reading.read_out import Matrix, ReadOut
from pipeline.storage.digests import KEY, content_digest, has_digest, is_regular
from pipeline.storage.plain import Plain, from_plain, is_array, leave_out_default, strict_converter
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance, SkinTable

SCHEMA = 1

Numbers = tuple[float | None, ...]
"""Numbers over the travel or over moduli; None where a tip is off the fruit or no bound is."""


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
        except (OSError, ValueError, RuntimeError):  # a loop of links is the last one
            return False
        return inside and has_digest(path, self.sha256)


@dataclass(frozen=True, kw_only=True)
class StoredSpring:
    """The leaves of a spring [mm] and their safety against the strain limit [1]; None where they are not made."""

    dimensions_mm: Flexure | None
    safety_factor: float | None


@dataclass(frozen=True, kw_only=True)
class StoredSkin:
    """The compliance of the fruit under a skin times E [1/mm], (tips, tips), at moduli of its flesh E [MPa]."""

    E_MPa: tuple[float, ...]
    compliance_per_mm: tuple[Matrix, ...]


@dataclass(frozen=True, kw_only=True)
class StoredContact:
    """The compliance of the fruit under its tips times E [1/mm], shape (tips, tips), its errors [%] and its cost.

    On a fruit with a `skin` it is that of the flesh alone.
    """

    error_percent: float
    s11_error_percent: float
    method: str
    dofs: int
    seconds: float
    compliance_per_mm: Matrix
    skin: StoredSkin | None = None


@dataclass(frozen=True, kw_only=True)
class StoredResponse:
    """The response at one modulus E [MPa] over the travel [mm]: forces [N].

    `F_l_N` and `F_h_N` are means over the tips of a spring; `F_N` has a row for each tip, none for a pair.
    """

    E_MPa: float
    x_mm: tuple[float, ...]
    F_l_N: Numbers
    F_h_N: Numbers
    F_N: tuple[Numbers, ...] = ()

    @property
    def tip_forces(self) -> tuple[Numbers, ...]:
        """Return the forces of each tip over the travel [N], shape (tips, travels), in the order of the tips."""
        return self.F_N or (self.F_l_N, self.F_h_N)


@dataclass(frozen=True, kw_only=True)
class StoredCurve:
    """P [1] at full travel [mm] over many moduli [MPa], and the moduli that may show each P, printed and calibrated."""

    x_mm: float
    E_MPa: tuple[float, ...]
    P: Numbers
    E_lower_as_printed_MPa: Numbers
    E_upper_as_printed_MPa: Numbers
    E_lower_calibrated_MPa: Numbers
    E_upper_calibrated_MPa: Numbers


@dataclass(frozen=True, kw_only=True)
class StoredTip:
    """A tip: its name, its position from the midpoint of the tips [mm], and on which spring it stands, low or high."""

    name: str
    x_mm: float
    y_mm: float
    spring: str


@dataclass(frozen=True, kw_only=True)
class StoredModulus:
    """How well one modulus E [MPa] is read: the sources of its standard uncertainty [%], by name."""

    E_MPa: float
    sources: dict[str, float]


@dataclass(frozen=True, kw_only=True)
class StoredReading:
    """How a sensor reads."""

    moduli: tuple[StoredModulus, ...]


@dataclass(frozen=True, kw_only=True)
class StoredReport:
    """What is read back of report.json; what is shown and not computed with is left as plain data.

    Tips have the order of all forces and of the compliance. `housing` and the numbers of springs are None where nothing
    can be made; a line of tips has no `flexures`. `reading` is None where the design asks for none, `paper` where fruit
    or tips are not the paper's. `stale` are files that were kept from another design, by name, with the digest of that
    design.
    """

    design: Design
    housing: Housing | None
    deflections_mm: tuple[float, ...]
    contact: StoredContact
    response: tuple[StoredResponse, ...]
    curve: StoredCurve
    tips: tuple[StoredTip, ...]
    read_out: ReadOut
    reading: StoredReading | None
    verdicts: tuple[Verdict, ...]
    paper: Plain | None
    notes: tuple[str, ...]
    versions: dict[str, str]
    files: tuple[StoredFile, ...]
    seconds: dict[str, float]
    flexures: dict[str, StoredSpring] = field(default_factory=dict)
    stale: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse a layout with a housing without its flexures, and deflections of other springs than the housing's."""
        if self.design.tips.tip_layout.has_housing and not self.flexures:
            bound = f"given for tips.layout = {self.design.tips.layout!r}"
            raise validation_error("flexures", None, "", bound, "run the design again")
        if self.housing is not None and len(self.deflections_mm) != len(self.housing.arms):
            bound = f"one number for each of {len(self.housing.arms)} springs"
            raise validation_error("deflections_mm", list(self.deflections_mm), "mm", bound, "run the design again")

    @property
    def moduli(self) -> tuple[StoredModulus, ...]:
        """Return how well each modulus is read, none where the design asks for no readings."""
        return () if self.reading is None else self.reading.moduli

    @property
    def compliance(self) -> FruitCompliance:
        """Return the compliance of the fruit under the tips [1/mm] with its errors."""
        contact = self.contact
        skin = None
        if contact.skin is not None:
            skin = SkinTable(E=np.array(contact.skin.E_MPa), S=np.array(contact.skin.compliance_per_mm))
        return FruitCompliance(
            skin=skin,
            tips=tuple(tip.name for tip in self.tips),
            S=np.array(contact.compliance_per_mm),
            error_pair=0.01 * contact.error_percent,
            error_own=0.01 * contact.s11_error_percent,
            info=SolveInfo(
                method=contact.method, dofs=contact.dofs, seconds=contact.seconds, status="read from report.json"
            ),
        )


def _finite_or_none(array: Floats) -> Any:  # noqa: ANN401 - lists of any depth
    values = array.astype(object)
    values[~np.isfinite(array)] = None
    return values.tolist()


_CONVERTER = strict_converter(forbid_extra_keys=False)
_CONVERTER.register_structure_hook(Design, lambda data, _: design_from_mapping(without_former_defaults(data)))
_CONVERTER.register_unstructure_hook(Design, design_as_mapping)
_CONVERTER.register_unstructure_hook_func(is_array, _finite_or_none)
leave_out_default(_CONVERTER, ReadOut, "lean_mm_per_N", "signal", "rise_level", "fastest_press_s")


def as_data(value: object) -> Any:  # noqa: ANN401 - JSON data of any kind
    """Return records, in lists and mappings of any depth, as JSON data; what is not finite in an array is None."""
    return _CONVERTER.unstructure(value)


def read_report(folder: Path) -> StoredReport:
    """Return the report of an output folder; raises InputError, in one line, where it holds none as it was written."""
    data = read_data(folder)
    if not is_as_written(data):
        raise refused(folder, "its report.json must be as the run wrote it, and its digest is another")
    return report_of(folder, data)


def is_as_written(data: Plain) -> bool:
    """Say whether a report's JSON data have the digest that they had when they were written."""
    return bool(data.get(KEY) == content_digest(data))


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
    """Return the report of a folder's JSON data; raises InputError, in one line, where it is not as it was written.

    Reports of older versions are read where keys of their design that left did nothing.
    """
    design = data.get("design")
    for name in former_keys(without_former_defaults(design)) if isinstance(design, dict) else ():
        raise refused(folder, f"its design sets {name}, a key that is gone since 0.2")
    try:
        design_from_mapping(without_former_defaults(design) if isinstance(design, dict) else {})
    except InputError as error:
        raise refused(folder, f"its design must be one of today: {error}") from error
    try:
        for key, kind in get_type_hints(StoredReport).items():
            if get_origin(kind) is tuple and not isinstance(data.get(key, []), list):
                msg = f"expected a JSON list @ report.{key}"
                raise ValueError(msg)
        return from_plain(StoredReport, data, "report", _CONVERTER)
    except ValueError as error:
        raise refused(folder, f"its report.json must be as it was written ({error})") from error


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        msg = f"{text} is no number of JSON"
        raise ValueError(msg)
    return value


def refused(folder: Path, bound: str) -> InputError:
    """Return the error for a folder whose report cannot be used, in one line."""
    reason = " ".join(bound.split())
    message = f"PATH = {str(folder)!r}: {reason}; name an output folder, or run the design again"
    return InputError(message, field="PATH", value=str(folder), bound=reason)
