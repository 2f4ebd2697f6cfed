"""Records of report.json beside the response: springs, solves, errors, readings, as they were written."""

from dataclasses import dataclass

from cad.theory.contrast_law import ContrastLaw
from cad.theory.leaf_spring import Flexure
from cad.verdict import Verdict


@dataclass(frozen=True, kw_only=True)
class StoredSpring:
    """A spring: target and stiffness by FE [N/m], the error [%], its leaves [mm]; None where it is not made."""

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
class StoredSolve:
    """What a solve cost: its method, unknowns, wall time [s], and a sentence on how it went."""

    method: str
    dofs: int
    seconds: float
    status: str


@dataclass(frozen=True, kw_only=True)
class StoredShare:
    """One share of an error [%]: of what, how much, and why."""

    effect: str
    size_percent: float
    reason: str


@dataclass(frozen=True, kw_only=True)
class StoredBudget:
    """What the error of a number is made of [%]: of the mesh, of the model, of the inputs, each with its shares."""

    discretisation_percent: float
    model_percent: float
    inputs_percent: float
    model: tuple[StoredShare, ...]
    inputs: tuple[StoredShare, ...]


@dataclass(frozen=True, kw_only=True)
class StoredModulus:
    """How well one modulus E [MPa] is read: its bias with its pose, and its standard deviation [%]."""

    E_MPa: float
    E_bias_percent: float
    worst: str
    uncertainty_percent: float


@dataclass(frozen=True, kw_only=True)
class StoredPressure:
    """The mean pressure on the skin at one modulus, and its limit [MPa], with the pose."""

    E_MPa: float
    pressure_MPa: float
    limit_MPa: float
    worst: str


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
    springs_mm_per_N: tuple[tuple[float, ...], ...]
    full_scale_N: tuple[float, ...]
    model_error_percent: float
    level: tuple[StoredLevel, ...]
    own_less_other_per_mm: float | None
    weights: tuple[float, ...] | None
    gaps_mm: tuple[float, ...] | None
    fruit_per_mm: tuple[tuple[float, ...], ...] | None
    hertz: float | None
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
class StoredReading:
    """How well a sensor reads over the poses that occur: per modulus, the lift [deg], the pressure on the skin."""

    method: str
    lift_deg: float
    moduli: tuple[StoredModulus, ...]
    skin_pressure: tuple[StoredPressure, ...]


@dataclass(frozen=True, kw_only=True)
class StoredPaper:
    """The paper's own springs [N/m] under the same contact, and their verdicts."""

    K_l_N_per_m: float
    K_h_N_per_m: float
    verdicts: tuple[Verdict, ...]


@dataclass(frozen=True, kw_only=True)
class StoredCurve:
    """P [1] at full travel [mm] over many moduli [MPa], and the moduli that may show each P, printed and calibrated.

    `P_softest` is the ratio on a fruit softer than all. None where a tip is off the fruit or no bound is.
    """

    x_mm: float
    P_softest: float | None
    E_MPa: tuple[float, ...]
    P: tuple[float | None, ...]
    E_lower_as_printed_MPa: tuple[float | None, ...]
    E_upper_as_printed_MPa: tuple[float | None, ...]
    E_lower_calibrated_MPa: tuple[float | None, ...]
    E_upper_calibrated_MPa: tuple[float | None, ...]
