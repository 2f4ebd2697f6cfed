"""Records of targets and errors that are parts of report.json. This module can be imported without the solvers."""

from dataclasses import dataclass

from sensor.quantity import report_field
from sensor.record import Record

Interval = tuple[float | None, float | None]


@dataclass(frozen=True, kw_only=True)
class LevelTargets:
    """P_max and NL of a level sensor with sharp flat tips at the centre of a flat fruit, by the two-spring law."""

    P_max: float = report_field("1", "force ratio on the firmest fruit")
    P_max_error: float = report_field("1", "half width of the error bar of P_max")
    NL: float = report_field("1", "nonlinearity of the force ratio as a function of the modulus")
    NL_error: float = report_field("1", "half width of the error bar of NL")


@dataclass(frozen=True, kw_only=True)
class Contribution:
    """The effect of a cause on a result: its relative size [1], its reason, and advice for the user."""

    effect: str = report_field("", "name of the effect")
    size: float = report_field("%", "relative change of the number due to this effect", key="size_percent", times=100.0)
    reason: str = report_field("", "how this change was found")
    advice: str = report_field("", "what a user can do about it", default="", has_key=False)


@dataclass(frozen=True, kw_only=True, repr=False)
class UncertaintyBudget(Record):
    """The relative error of a result [1], divided into its sources.

    The effects of the model act together, so their sizes add. The inputs are independent, so their squares add.
    """

    numerical: float = report_field(
        "%",
        "numerical error of the number: the half width of the error bar",
        key="discretisation_percent",
        times=100.0,
    )
    model: tuple[Contribution, ...] = report_field("", "effects that the model leaves out")
    inputs: tuple[Contribution, ...] = report_field(
        "", "inputs that are known within a range: of the print, the pose and the fruit"
    )
    model_total: float = report_field("%", "sum of the sizes of all model effects", key="model_percent", times=100.0)
    inputs_total: float = report_field(
        "%",
        "root sum of squares of all input effects, two standard deviations",
        key="inputs_percent",
        times=100.0,
    )

    @property
    def total(self) -> float:
        """Return the total error [1] due to the mesh, the model and the inputs."""
        return self.numerical + self.model_total + self.inputs_total


@dataclass(frozen=True, kw_only=True, repr=False)
class ScatterBands(Record):
    """Intervals that contain the middle 95 % of prints.

    An end of an interval is None if some prints produce a P that the nominal springs cannot produce.
    """

    K_l_N_per_m: Interval = report_field("N/m", "band of the stiffness of the low spring")
    K_h_N_per_m: Interval = report_field("N/m", "band of the stiffness of the high spring")
    P_max: Interval = report_field("1", "band of the largest force ratio")
    NL: Interval = report_field("1", "band of the nonlinearity")
    modulus_error: Interval = report_field(
        "1",
        "band of the relative error of the modulus, if it is read with the nominal stiffnesses; null if an end of "
        "the band is not finite",
    )
    calibrated_modulus_error: float | None = report_field(
        "1", "relative error of the modulus if both stiffnesses of the unit are known to 1 %"
    )
    surrogate_error: float = report_field("1", "always 0; this key will be removed in 0.4", default=0.0)
