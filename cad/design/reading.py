"""What a reading has to stand: poses of the sensor on the fruit, noise of its forces, and how good it must be.

A design that has this table is judged by the modulus that it reads, not by its force ratio.
"""

import math
from dataclasses import dataclass

from cad.quantity import DURATION, Bounds, check_fields, choice, quantity

_TILT = Bounds(at_least=0.0, at_most=15.0)
_PLACE = Bounds(at_least=0.0, at_most=10.0)
_SHARE = Bounds(at_least=0.0, at_most=0.5)
_PERCENT = Bounds(at_least=0.0, at_most=50.0)
_FORCE = Bounds(at_least=0.0, at_most=10.0)
_LIMIT = Bounds(at_least=1e-3, at_most=1.0)

CALIBRATED_BY = ("weights", "plate")
LEAST_OVER_NOISE = 4.0  # standard deviations: a tip with less force on it counts as off the fruit


@dataclass(frozen=True, kw_only=True)
class Reading:
    """Poses that occur and noise of the forces, one standard deviation, with the limits that the reading must keep.

    `tilt_deg` is the largest tilt, in any direction; `off_centre_mm` how far the sensor stands from the apex at most;
    `radius_spread` by how much of it the fruit's radius may differ. `noise_percent` is a share of the largest force of
    each tip. `stiffness_percent` and `gain_percent` are what calibration leaves: by weights of each spring and of each
    force; by a hard plate too, which moves all tips alike, of each force at a known deflection and of each deflection.
    `bias_limit` bounds the largest |E read / E - 1| without noise, `uncertainty_limit` its standard deviation.
    """

    tilt_deg: float = quantity(
        "deg", _TILT, default=4.0, hint="a hand keeps within 4", meaning="largest tilt of a press, in any direction"
    )
    off_centre_mm: float = quantity(
        "mm",
        _PLACE,
        default=1.0,
        hint="a hand keeps within 1",
        meaning="how far from the apex a press may be, in any direction",
    )
    radius_spread: float = quantity(
        "1",
        _SHARE,
        default=0.2,
        hint="mangoes differ by 0.2",
        meaning="by how much of it the radius of a fruit may differ from the design's",
    )
    noise_percent: float = quantity(
        "%",
        _PERCENT,
        default=0.5,
        hint="a strain gauge has 0.5 of full scale",
        meaning="noise of each force, one sigma, as a share of the largest force of its tip",
    )
    noise_N: float = quantity(
        "N",
        _FORCE,
        default=0.0,
        hint="0 where noise_percent says it all",
        meaning="noise of each force, one sigma, in addition",
    )
    stiffness_percent: float = quantity(
        "%",
        _PERCENT,
        default=1.0,
        hint="weighing a unit leaves 1",
        meaning="how far calibration leaves each spring unknown, one sigma",
    )
    gain_percent: float = quantity(
        "%",
        _PERCENT,
        default=0.5,
        hint="an amplifier has 0.5",
        meaning="how far calibration leaves each channel unknown, one sigma",
    )
    calibrated_by: str | None = choice(
        CALIBRATED_BY,
        default=None,
        meaning="weights: they calibrate the force of each channel; plate: a press on a hard plate its deflection too",
    )
    bias_limit: float = quantity(
        "1",
        _LIMIT,
        default=0.05,
        hint="give a fraction, for 5 % write 0.05",
        meaning="largest error of the modulus over all poses, without noise",
    )
    uncertainty_limit: float = quantity(
        "1",
        _LIMIT,
        default=0.1,
        hint="give a fraction, for 10 % write 0.1",
        meaning="largest standard deviation of the modulus, all causes together",
    )
    at_s: float | None = quantity(
        "s",
        DURATION,
        default=None,
        hint="travel / speed is when the press stops",
        meaning="when flesh that relaxes is read, from the first touch; when the press stops where it is not set",
    )

    def __post_init__(self) -> None:
        """Check each field."""
        check_fields(self, "reading")

    def force_noise(self, full_scale: float) -> float:
        """Return the standard deviation of the noise of a channel [N] from its largest force [N]."""
        return math.hypot(0.01 * self.noise_percent * full_scale, self.noise_N)
