"""The behaviour of printed springs beyond their stiffness; the fields are keys of report.json, in its units."""

from dataclasses import dataclass

from sensor.quantity import report_field


@dataclass(frozen=True, kw_only=True)
class ArmBehaviour:
    """The behaviour of one spring at full travel."""

    tilt_at_full_force_rad: float = report_field(
        "rad", "rotation of the tip's face in the plane of the plate, at full travel"
    )
    large_deflection_stiffening: float = report_field(
        "1", "increase of the stiffness due to the large deflection at full travel, as a fraction of the stiffness"
    )
    natural_frequency_Hz: float = report_field(
        "Hz", "first natural frequency of the free spring by Rayleigh's quotient, accurate to a few per cent"
    )


@dataclass(frozen=True, kw_only=True)
class SpringBehaviour:
    """The behaviour of the two springs, and the crosstalk between them."""

    crosstalk_C12_over_C22: float = report_field(
        "1",
        "crosstalk through the frame that carries both springs: movement of one tip when the other one is "
        "pressed, divided by the deflection of the pressed one",
    )
    low: ArmBehaviour = report_field("", "the low spring at full travel")
    high: ArmBehaviour = report_field("", "the high spring at full travel")
