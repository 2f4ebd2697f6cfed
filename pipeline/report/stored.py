"""Every number of report.json, stated once: the records that a run writes and that later commands read back.

The fields are the keys of the file, in their units; docs/report-json.md says what each means.
"""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_origin, get_type_hints

from cattrs.gen import make_dict_unstructure_fn, override

from cad.design.design_file import design_as_mapping, design_from_mapping
from cad.design.parameters import Design
from cad.parts.housing import Housing
from cad.quantity import InputError, validation_error
from cad.theory.contrast_law import ContrastLaw
from cad.theory.leaf_spring import Flexure
from cad.verdict import Verdict
from pipeline.storage.digests import has_digest, is_regular
from pipeline.storage.plain import Plain, from_plain, strict_converter

SCHEMA = 1

Numbers = tuple[float | None, ...]
"""Numbers over the travel or over moduli; None where a tip is off the fruit or no bound is."""
Matrix = tuple[tuple[float, ...], ...]


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
class StoredSizing:
    """The springs that were sized [N/m], and the fruit stiffness under one tip that sized them."""

    K_l_N_per_m: float
    K_h_N_per_m: float
    K_m_max_N_per_m: float
    K_m_over_E_mm: float
    fruit_stiffness: str


@dataclass(frozen=True, kw_only=True)
class StoredSpring:
    """A spring: target and stiffness by FE [N/m], errors [%], its leaves [mm]; None where it is not made."""

    target_N_per_m: float
    stiffness_N_per_m: float | None
    error_percent: float | None
    dimensions_mm: Flexure | None
    root_strain: float | None
    root_strain_error_percent: float | None
    safety_factor: float | None
    dofs: int | None
    seconds: float | None

    @property
    def K_N_per_m(self) -> float:
        """Return the stiffness by FE, the target where it is not made [N/m]."""
        return self.target_N_per_m if self.stiffness_N_per_m is None else self.stiffness_N_per_m


@dataclass(frozen=True, kw_only=True)
class StoredMaterial:
    """What the sensor is made of, and by which process."""

    name: str
    E_MPa: float
    poisson: float
    process: str


@dataclass(frozen=True, kw_only=True)
class StoredMode:
    """A mode of the sensor in its mount: what moves how, at which frequency."""

    frequency_Hz: float
    error_percent: float
    shape: str


@dataclass(frozen=True, kw_only=True)
class StoredArm:
    """One spring at full travel; the bridge output is given at each modulus."""

    tilt_at_full_force_rad: float
    large_deflection_stiffening: float
    natural_frequency_Hz: float
    bridge_mV_per_V: Numbers
    bridge_error_percent: float | None


@dataclass(frozen=True, kw_only=True)
class StoredBehaviour:
    """The behaviour of both springs, one tip under the force of the other [1], and the lowest modes."""

    crosstalk_C12_over_C22: float
    gauge_factor: float
    gauge_grid_mm: float
    gauges: str
    modes: tuple[StoredMode, ...]
    low: StoredArm
    high: StoredArm


@dataclass(frozen=True, kw_only=True)
class StoredContact:
    """The compliance of the fruit under its tips times E [1/mm], shape (tips, tips), its errors [%] and its cost."""

    error_percent: float
    s11_error_percent: float
    method: str
    dofs: int
    seconds: float
    status: str
    compliance_per_mm: Matrix
    K_m_over_E_mm: float


@dataclass(frozen=True, kw_only=True)
class StoredResponse:
    """The response at one modulus E [MPa] over the travel [mm]: P [1] and forces [N].

    `F_l_N` and `F_h_N` are means over the tips of a spring; `F_N` has a row for each tip, none for a pair.
    """

    E_MPa: float
    x_mm: tuple[float, ...]
    P: Numbers
    F_l_N: Numbers = ()
    F_h_N: Numbers = ()
    slope_ratio: Numbers = ()
    F_error_percent: Numbers = ()
    P_error_percent: Numbers = ()
    F_N: tuple[Numbers, ...] = ()

    @property
    def kind_forces(self) -> tuple[Numbers, ...]:
        """Return the force of a tip over the travel [N] for each spring, the low one's first; means over its tips."""
        return self.F_l_N, self.F_h_N

    @property
    def tip_forces(self) -> tuple[Numbers, ...]:
        """Return the forces of each tip over the travel [N], shape (tips, travels), in the order of the tips."""
        return self.F_N or self.kind_forces

    @property
    def last_P(self) -> float | None:
        """Return P at the deepest travel where all tips are on the fruit [1]."""
        touching = [P for P in self.P if P is not None]
        return touching[-1] if touching else None


@dataclass(frozen=True, kw_only=True)
class StoredCurve:
    """P [1] at full travel [mm] over many moduli [MPa], and the moduli that may show each P, printed and calibrated.

    `P_softest` is the ratio on a fruit softer than all.
    """

    x_mm: float
    P_softest: float | None
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
class StoredLevel:
    """What a level sensor reads [MPa] of a fruit of modulus E [MPa]."""

    E_MPa: float
    read_MPa: float


@dataclass(frozen=True, kw_only=True)
class StoredDepth:
    """The force of a tip over the linear one [1] at a depth [tip sides], and its relative error [%]."""

    depth_sides: float
    factor: float
    error_percent: float


@dataclass(frozen=True, kw_only=True)
class StoredReadOut:
    """What turns forces into a modulus, in the terms of the contrast law or, for a pair, of the line through a press.

    `springs_mm_per_N` and `fruit_per_mm` (times E) have shape (tips, tips), `full_scale_N`, `weights` [1] and `gaps_mm`
    (tips,). A pair has `own_less_other_per_mm` and None for the terms of a contrast; other layouts the other way round.
    `large_strain` is the curve of a tip over rising depths; none where the flesh is linear.
    """

    method: str
    springs_mm_per_N: Matrix
    full_scale_N: tuple[float, ...]
    model_error_percent: float
    level: tuple[StoredLevel, ...]
    own_less_other_per_mm: float | None = None
    weights: tuple[float, ...] | None = None
    gaps_mm: tuple[float, ...] | None = None
    fruit_per_mm: Matrix | None = None
    hertz: float | None = None
    large_strain: tuple[StoredDepth, ...] = ()

    @property
    def contrast(self) -> ContrastLaw | None:
        """Return the contrast law of the tips with the springs of the report; None for a pair."""
        if self.weights is None or self.gaps_mm is None or self.fruit_per_mm is None:
            return None
        return ContrastLaw(
            weights=self.weights,
            gaps=self.gaps_mm,
            C=self.springs_mm_per_N,
            S=self.fruit_per_mm,
            hertz=self.hertz or 0.0,
        )


@dataclass(frozen=True, kw_only=True)
class StoredModulus:
    """How well one modulus E [MPa] is read: its bias with its pose, and its standard deviation with its sources [%]."""

    E_MPa: float
    E_bias_percent: float
    worst: str
    uncertainty_percent: float
    sources: dict[str, float]


@dataclass(frozen=True, kw_only=True)
class StoredPressure:
    """The mean pressure on the skin at one modulus, and its limit [MPa], with the pose."""

    E_MPa: float
    pressure_MPa: float
    limit_MPa: float
    worst: str


@dataclass(frozen=True, kw_only=True)
class StoredReading:
    """How well a sensor reads over the poses that occur [%]; None where a level press has no reading."""

    E_bias_percent: float | None
    E_bias_error_percent: float | None
    uncertainty_percent: float | None
    sources: dict[str, float]
    method: str
    lift_deg: float
    plates_before_zeroing_percent: float
    noise_for_10_percent: float | None
    refused: str | None
    moduli: tuple[StoredModulus, ...]
    skin_pressure: tuple[StoredPressure, ...]


@dataclass(frozen=True, kw_only=True)
class StoredTargets:
    """P_max and NL [1] of a level sensor with flat sharp tips on flat fruit, with their errors [1]."""

    P_max: float
    P_max_error: float
    NL: float
    NL_error: float


@dataclass(frozen=True, kw_only=True)
class StoredContribution:
    """One contribution to an error [%]: of what, how much, and why."""

    effect: str
    size_percent: float
    reason: str


@dataclass(frozen=True, kw_only=True)
class StoredBudget:
    """What the error of a number is made of [%]: of the mesh, of the model, of the inputs."""

    discretisation_percent: float
    model: tuple[StoredContribution, ...]
    inputs: tuple[StoredContribution, ...]
    model_percent: float
    inputs_percent: float


@dataclass(frozen=True, kw_only=True)
class StoredPaper:
    """The paper's own springs [N/m] under the same contact, and their verdicts."""

    K_l_N_per_m: float
    K_h_N_per_m: float
    verdicts: tuple[Verdict, ...]


@dataclass(frozen=True, kw_only=True)
class StoredChoice:
    """The error that was reached [%], and which model and mesh was chosen for it."""

    error_percent: float
    choice: str


@dataclass(frozen=True, kw_only=True)
class StoredAccuracy:
    """What accuracy was asked for [1], and what was reached; `springs` is None where none are made."""

    tolerance: float
    springs: StoredChoice | None
    contact: StoredChoice


@dataclass(frozen=True, kw_only=True)
class StoredReport:
    """All of report.json but its digest.

    Tips have the order of all forces and of the compliance. `housing`, `behaviour` and the numbers of springs are None
    where nothing can be made, `reading` where the design asks for none, `paper` where fruit or tips are not the
    paper's. `tolerance` is how far prints scatter, known where files for fabrication were asked for.
    """

    schema: int = SCHEMA
    design: Design
    springs: StoredSizing
    flexures: dict[str, StoredSpring]
    housing: Housing | None
    deflections_mm: tuple[float, ...]
    material: StoredMaterial
    behaviour: StoredBehaviour | None
    contact: StoredContact
    response: tuple[StoredResponse, ...]
    curve: StoredCurve
    tips: tuple[StoredTip, ...]
    read_out: StoredReadOut
    reading: StoredReading | None
    level: StoredTargets
    verdicts: tuple[Verdict, ...]
    remedy: str | None
    errors: dict[str, StoredBudget | None]
    paper: StoredPaper | None
    accuracy: StoredAccuracy
    notes: tuple[str, ...]
    versions: dict[str, str]
    files: tuple[StoredFile, ...]
    seconds: dict[str, float]
    cpu_seconds: dict[str, float]
    tolerance: Plain | None = None

    def __post_init__(self) -> None:
        """Refuse deflections of other springs than those of the housing."""
        if self.housing is not None and len(self.deflections_mm) != len(self.housing.arms):
            bound = f"one number for each of {len(self.housing.arms)} springs"
            raise validation_error("deflections_mm", list(self.deflections_mm), "mm", bound, "run the design again")

    @property
    def moduli(self) -> tuple[StoredModulus, ...]:
        """Return how well each modulus is read, none where the design asks for no readings."""
        return () if self.reading is None else self.reading.moduli


_CONVERTER = strict_converter(forbid_extra_keys=False)
_CONVERTER.register_structure_hook(Design, lambda data, _: design_from_mapping(data))
_CONVERTER.register_unstructure_hook(Design, design_as_mapping)
_CONVERTER.register_unstructure_hook(
    StoredResponse,
    make_dict_unstructure_fn(StoredResponse, _CONVERTER, F_N=override(omit_if_default=True)),
)


def as_data(record: object) -> Any:  # noqa: ANN401 - JSON data of any kind
    """Return a record of a report as JSON data."""
    return _CONVERTER.unstructure(record)


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
