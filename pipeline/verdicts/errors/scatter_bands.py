"""How far a print may be off before it is calibrated; the fields are keys of report.json, in its units."""

from dataclasses import dataclass

from sensor.quantity import report_field
from sensor.record import Record

Interval = tuple[float | None, float | None]


@dataclass(frozen=True, kw_only=True, repr=False)
class ScatterBands(Record):
    """Bands that hold the middle 95 % of prints; an end is None where prints show a P that nominal springs never do."""

    K_l_N_per_m: Interval = report_field("N/m", "band of the stiffness of the low spring")
    K_h_N_per_m: Interval = report_field("N/m", "band of the stiffness of the high spring")
    P_max: Interval = report_field("1", "band of the largest force ratio")
    NL: Interval = report_field("1", "band of the nonlinearity")
    modulus_error: Interval = report_field(
        "1",
        "band of the relative error of the modulus, if it is read with the nominal stiffnesses; null where "
        "the band has no end",
    )
    calibrated_modulus_error: float | None = report_field(
        "1", "relative error of the modulus if both stiffnesses of the unit are known to 1 %"
    )
    surrogate_error: float = report_field(
        "1",
        "relative error of the approximate formula for the stiffness over the leaf thickness, from which "
        "these bands are computed",
    )
