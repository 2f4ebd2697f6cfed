"""Records of readings that are parts of report.json. The records import no solver, so that a report is read quickly."""

from dataclasses import dataclass

from sensor.quantity import report_field


@dataclass(frozen=True, kw_only=True)
class SkinPressure:
    """The pressure on the skin at one modulus, which is the largest mean pressure under a tip."""

    E_MPa: float = report_field("MPa", "modulus of the fruit")
    pressure_MPa: float = report_field("MPa", "largest force of a tip divided by its contact area")
    error_MPa: float = report_field("MPa", "half width of the error bar of the pressure", default=0.0, has_key=False)
    limit_MPa: float = report_field("MPa", "pressure at which a fruit of this modulus bruises")
    worst: str = report_field("", "the pose with the largest pressure")

    @property
    def over_limit(self) -> float:
        """Return the pressure divided by its limit [1]."""
        return self.pressure_MPa / self.limit_MPa


@dataclass(frozen=True, kw_only=True)
class UnevenFruit:
    """The additional uncertainty of a modulus due to uneven skin and flesh, beyond the uncertainty on an even fruit."""

    skin_percent: float = report_field(
        "%", "standard uncertainty of one press due to waves of the skin, `fruit.roughness_mm` high"
    )
    flesh_percent: float = report_field(
        "%",
        "standard uncertainty of one press due to flesh that differs from tip to tip, `fruit.flesh_scatter_percent`",
    )
    one_press_percent: float = report_field("%", "standard uncertainty of one press due to both together")
    presses: float = report_field("1", "number of presses of each fruit in the design, `reading.presses`")
    presses_percent: float = report_field(
        "%",
        "standard uncertainty of the mean of this number of presses due to both: `one_press_percent` divided by the "
        "square root of this number",
    )


@dataclass(frozen=True, kw_only=True)
class CalibrationErrors:
    """The errors that remain in springs and gains after calibration on a bench, and the resolution of the bench."""

    balance_g: float = report_field("g", "last digit of the balance")
    balance_max_g: float = report_field("g", "largest load of the balance")
    dial_mm: float = report_field("mm", "last digit of the dial")
    stiffness_percent: tuple[float, ...] = report_field(
        "%", "standard uncertainty of the spring stiffness of each tip, in the order of `tips`"
    )
    gain_percent: tuple[float, ...] = report_field(
        "%",
        "standard uncertainty of the gain of each channel; if the sensor is calibrated on a plate, of the deflection "
        "that the channel measures",
    )
    typed: tuple[str, ...] = report_field(
        "", "which of the two percentages are given in the design, instead of computed for the bench"
    )
    worst_tip: str = report_field(
        "", "the tip whose spring stiffness has the largest error after calibration on the bench"
    )
    by: str = report_field("", "the largest cause of this error: `balance`, `dial` or `noise` of the channel")

    @property
    def largest_stiffness(self) -> float:
        """Return the largest relative standard uncertainty of a spring stiffness [1]."""
        return 0.01 * max(self.stiffness_percent)


@dataclass(frozen=True, kw_only=True)
class Moment:
    """The moment in a hold at which the reading changes least, for one speed of the press."""

    speed_mm_per_s: float = report_field("mm/s", "speed of the press")
    at_s: float = report_field("s", "time of the reading at which the apparent modulus changes least during the hold")
    moves_percent: float | None = report_field(
        "%",
        "largest change of the apparent modulus during the hold, relative to a reading at that time; null "
        "if a tip is off the fruit",
    )
