"""The table [reading] of a design: poses of the sensor on the fruit, noise of the forces, and limits for the error.

A design with this table is judged by the modulus that it reads, instead of by its force ratio.
"""

import bisect
import math
from collections.abc import Sequence
from dataclasses import dataclass

from sensor.quantity import DURATION, LENGTH, Bounds, check_fields, choice, quantity, validation_error

_TILT = Bounds(at_least=0.0, at_most=15.0)
_PLACE = Bounds(at_least=0.0, at_most=10.0)
_SHARE = Bounds(at_least=0.0, at_most=0.5)
_PERCENT = Bounds(at_least=0.0, at_most=50.0)
_FORCE = Bounds(at_least=0.0, at_most=10.0)
_LIMIT = Bounds(at_least=1e-3, at_most=1.0)
_PRESSES = Bounds(at_least=1.0, at_most=100.0)

_ENDS = 2  # number of ends of a range
RANGES = ("radius_mm", "radius_across_mm", "thickness_mm")
# largest fraction of the travel at which the last tip may touch; above it, too little rise remains
LARGEST_TOUCH_FRACTION = 0.5
PRESS_SAMPLES = 60
"""Number of samples of a press over which its noise is averaged: `PRESS_S` at 20 samples per second."""
PRESS_S = 3.0
"""Duration of a press by hand [s]. The effect of timing errors of the channels is inversely proportional to it."""
WEIGHED_AFTER_S = 30.0
"""Time for which a weight usually hangs before its deflection is read [s]; the default if no time is given."""
CALIBRATED_BY = ("weights", "plate", "ball")
AMPLIFIER_GAIN_PERCENT = 0.5
"""Standard uncertainty of a gain without calibration [%], by judgement on amplifiers."""
LEAST_OVER_NOISE = 4.0  # minimum force of a tip in contact, as a multiple of the standard deviation of its noise
LEAST_OF_SCALE = 0.01  # minimum force of a tip in contact, as a fraction of its largest force; above the zero error


@dataclass(frozen=True, kw_only=True)
class ReadingRequirements:
    """The poses that occur, the noise of the forces (one standard deviation), and the limits for a reading.

    `tilt_deg` is the largest tilt against the normal of the skin, in any direction, and `tilt_change_deg` is its
    largest change during a press. `off_centre_mm` is the largest distance of a press from the apex. `radius_mm` and
    `radius_across_mm` are the ranges of the principal radii of the fruits, at any azimuth. `thickness_mm` is the range
    of the thickness of their flesh. If `radius_mm` is None, the radius of a fruit may differ from the radius of the
    design by the fraction `radius_spread`. `noise_percent` is a percentage of the largest force of each tip.

    `stiffness_percent` and `gain_percent` are uncertainties after calibration; if they are None, they are computed from
    the bench of the design. If weights calibrate the unit, these two keys are the uncertainties of each spring and each
    force. A hard plate, which moves all tips equally, may calibrate the unit instead. The keys are then the
    uncertainties of each force at a known deflection, and of each deflection. `bias_limit` is the largest |E read / E -
    1| without noise, and `uncertainty_limit` the largest standard uncertainty.
    """

    tilt_deg: float = quantity(
        "deg",
        _TILT,
        default=4.0,
        hint="a hand keeps the tilt within 4",
        meaning="largest angle between the sensor and the normal of the skin, in any direction",
    )
    tilt_change_deg: float = quantity(
        "deg",
        _TILT,
        default=0.0,
        hint="a hand keeps the change within 0.5",
        meaning="largest change of the tilt during a press, in any direction",
    )
    off_centre_mm: float = quantity(
        "mm",
        _PLACE,
        default=1.0,
        hint="a hand keeps the distance within 1",
        meaning="largest distance of a press from the apex, in any direction",
    )
    radius_spread: float = quantity(
        "1",
        _SHARE,
        default=0.2,
        hint="the radii of mangoes differ by 0.2",
        meaning="largest deviation of the radius of a fruit from the radius of the design, as a fraction; used only if "
        "`radius_mm` is not set",
    )
    radius_mm: tuple[float, float] | None = quantity(
        "mm",
        LENGTH,
        default=None,
        hint="the radius of a mango is 42 to 53",
        meaning="smallest and largest value of one principal radius of the fruits, which may have any azimuth "
        "(ellipsoid)",
    )
    radius_across_mm: tuple[float, float] | None = quantity(
        "mm",
        LENGTH,
        default=None,
        hint="the other radius of a mango is 86 to 144",
        meaning="smallest and largest value of the other principal radius (ellipsoid)",
    )
    thickness_mm: tuple[float, float] | None = quantity(
        "mm",
        LENGTH,
        default=None,
        hint="the flesh over the stone of a mango is 8 to 20 thick",
        meaning="smallest and largest thickness of the flesh under the skin (domes on a curved fruit)",
    )
    noise_percent: float = quantity(
        "%",
        _PERCENT,
        default=0.5,
        hint="a load cell has 0.5 of full scale",
        meaning="noise of each force, one standard deviation, in per cent of the largest force of its tip",
    )
    noise_N: float = quantity(
        "N",
        _FORCE,
        default=0.0,
        hint="give 0 if noise_percent is the whole noise",
        meaning="additional noise of each force, one standard deviation, which does not depend on the force",
    )
    stiffness_percent: float | None = quantity(
        "%",
        _PERCENT,
        default=None,
        hint="omit it to compute it from the bench",
        meaning="standard uncertainty of each spring stiffness after calibration; by default computed from the bench, "
        "see [what a bench leaves](read-a-fruit.md#what-a-bench-leaves)",
    )
    gain_percent: float | None = quantity(
        "%",
        _PERCENT,
        default=None,
        hint="omit it to compute it from the bench",
        meaning="standard uncertainty of each channel gain after calibration; by default computed from the bench",
    )
    calibrated_by: str | None = choice(
        CALIBRATED_BY,
        default=None,
        meaning="weights calibrate the force of each channel; a press on a hard plate also calibrates its deflection; "
        "with `ball`, presses on a ball of known modulus also calibrate the form of the domes",
    )
    ball_percent: float = quantity(
        "%",
        _PERCENT,
        default=2.0,
        hint="pipeline modulus measures the modulus of a ball",
        meaning="standard uncertainty due to a reference ball, from its modulus and the presses on it; it is the "
        'same in all readings of a unit (`calibrated_by = "ball"`). The default is a judgement',
    )
    bias_limit: float = quantity(
        "1",
        _LIMIT,
        default=0.05,
        hint="give a fraction: for 5 % write 0.05",
        meaning="largest allowed error of the modulus over all poses, without noise",
    )
    uncertainty_limit: float | tuple[float, ...] = quantity(
        "1",
        _LIMIT,
        default=0.1,
        hint="give a fraction: for 10 % write 0.1",
        meaning="largest allowed standard uncertainty of the modulus, or a list with one for each of `fruit.E_MPa`",
    )
    at_s: float | None = quantity(
        "s",
        DURATION,
        default=None,
        hint="the press stops at travel / speed",
        meaning="time from the first touch to a reading on flesh that relaxes; by default the time at the end of the "
        "travel",
    )
    presses: float = quantity(
        "1",
        _PRESSES,
        default=3.0,
        hint="three presses, each at a different place, are usual",
        meaning="number of presses, each at a different place, that are read as one fruit",
    )

    def __post_init__(self) -> None:
        """Raise InputError for an invalid field, or for fields that do not belong together.

        One principal radius must not be given without the other. The ends of a range must be in increasing order, or
        equal. The number of presses must be a whole number.
        """
        check_fields(self, "reading")
        if (self.radius_mm is None) != (self.radius_across_mm is None):
            missing = "reading.radius_mm" if self.radius_mm is None else "reading.radius_across_mm"
            bound = "given with the other principal radius"
            raise validation_error(missing, None, "mm", bound, "give the smallest and the largest value of both radii")
        for key in RANGES:
            ends = getattr(self, key)
            if ends is not None and not (len(ends) == _ENDS and ends[0] <= ends[1]):
                name = f"reading.{key}"
                raise validation_error(
                    name, list(ends), "mm", "two numbers, the smaller first", "list the smaller number first"
                )
        if self.presses != int(self.presses):
            bound = "a whole number"
            raise validation_error("reading.presses", self.presses, "", bound, "count the presses of one fruit")

    @property
    def on_plate(self) -> bool:
        """Return whether a hard plate is used to calibrate the unit, with or without a ball."""
        return self.calibrated_by in ("plate", "ball")

    @property
    def uncalibrated_gain_percent(self) -> float:
        """Return the standard uncertainty of a gain before calibration [%]."""
        return AMPLIFIER_GAIN_PERCENT if self.gain_percent is None else self.gain_percent

    @property
    def least_uncertainty_limit(self) -> float:
        """Return the smallest of the limits for the standard uncertainty [1]."""
        limits = self.uncertainty_limit
        return min(limits) if isinstance(limits, tuple) else limits

    def uncertainty_limit_at(self, E: float, moduli: Sequence[float]) -> float:
        """Return the limit for the standard uncertainty [1] at the modulus `E` [MPa].

        A list of limits has one limit for each of `moduli` [MPa]. The limit is linear in log E between two moduli, and
        constant beyond the first and the last.
        """
        limits = self.uncertainty_limit
        if not isinstance(limits, tuple):
            return limits
        points = sorted(zip(moduli, limits, strict=True))  # pairs (modulus, limit), the smallest modulus first
        # Index of the first modulus that is at least E. The 0 sorts before every limit at the same modulus.
        upper = bisect.bisect_left(points, (E, 0.0))
        if upper == 0:  # no modulus is below E
            return points[0][1]
        if upper == len(points):  # all moduli are below E
            return points[-1][1]
        (E_low, limit_low), (E_high, limit_high) = points[upper - 1 : upper + 1]
        return limit_low + (limit_high - limit_low) * math.log(E / E_low) / math.log(E_high / E_low)
