"""How one printed spring behaves at full travel; the fields are keys of report.json, in its units."""

from dataclasses import dataclass

from sensor.quantity import report_field


@dataclass(frozen=True, kw_only=True)
class ArmBehaviour:
    """One spring at full travel."""

    tilt_at_full_force_rad: float = report_field(
        "rad", "rotation of the tip's face in the plane of the plate, at full travel"
    )
    large_deflection_stiffening: float = report_field(
        "1", "increase of the stiffness by large deflection at full travel, as a fraction of the stiffness"
    )
    natural_frequency_Hz: float = report_field(
        "Hz", "first natural frequency of the free spring by Rayleigh's quotient, accurate to some per cent"
    )
