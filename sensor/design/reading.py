"""The table [reading] of a design: poses of the sensor on the fruit, noise of the forces, and limits of the error.

A design with this table is judged by the modulus that it reads, and not by its force ratio.
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

_ENDS = 2
RANGES = ("radius_mm", "radius_across_mm", "thickness_mm")
LARGEST_TOUCH_FRACTION = 0.5  # touch of the last tip over the travel; if larger, too little rise remains
PRESS_SAMPLES = 60
"""Samples of a press that reduce its noise: `PRESS_S` at 20 samples a second."""
PRESS_S = 3.0
"""Duration of a press by hand [s], which scales the effect of time errors of the channels."""
WEIGHED_AFTER_S = 30.0
"""Time after which the deflection under a weight is read [s], unless it is given."""
CALIBRATED_BY = ("weights", "plate", "ball")
AMPLIFIER_GAIN_PERCENT = 0.5
"""Standard uncertainty of a gain without calibration [%]: a judgement on amplifiers."""
LEAST_OVER_NOISE = 4.0  # least force of a tip that touches, in standard deviations of its noise
LEAST_OF_SCALE = 0.01  # least force of a tip that touches, over its largest one; above the error of a zero


@dataclass(frozen=True, kw_only=True)
class ReadingRequirements:
    """The poses that occur, the noise of the forces (one standard deviation), and the limits for a reading.

    `tilt_deg` is the largest tilt against the normal of the skin, in any direction. It may change by `tilt_change_deg`
    during a press. `off_centre_mm` is the largest distance of a press from the apex. `radius_mm` and `radius_across_mm`
    are the ranges of the principal radii of the fruits, at any azimuth. `thickness_mm` is the range of the thickness of
    their flesh. Without them, the radius of a ball may differ by the fraction `radius_spread`. `noise_percent` is a
    fraction of the largest force of each tip. `stiffness_percent` and `gain_percent` are uncertainties after
    calibration. With weights, they belong to each spring and to each force. A hard plate moves all tips equally; they
    then belong to each force at a known deflection, and to each deflection. If they are None, they follow from the
    bench of the design. `bias_limit` is the largest |E read / E - 1| without noise, `uncertainty_limit` the largest
    standard uncertainty.
    """

    tilt_deg: float = quantity(
        "deg",
        _TILT,
        default=4.0,
        hint="a hand keeps within 4",
        meaning="largest angle between the sensor and the normal of the skin, in any direction",
    )
    tilt_change_deg: float = quantity(
        "deg",
        _TILT,
        default=0.0,
        hint="a hand keeps within 0.5",
        meaning="largest change of the tilt during a press, in any direction",
    )
    off_centre_mm: float = quantity(
        "mm",
        _PLACE,
        default=1.0,
        hint="a hand keeps within 1",
        meaning="largest distance of a press from the apex, in any direction",
    )
    radius_spread: float = quantity(
        "1",
        _SHARE,
        default=0.2,
        hint="mangoes differ by 0.2",
        meaning="largest deviation of the radius of a fruit from the radius of the design, as a fraction; used without "
        "`radius_mm`",
    )
    radius_mm: tuple[float, float] | None = quantity(
        "mm",
        LENGTH,
        default=None,
        hint="mangoes have 42 to 53",
        meaning="smallest and largest value of one principal radius of the fruits, which may have any azimuth "
        "(ellipsoid)",
    )
    radius_across_mm: tuple[float, float] | None = quantity(
        "mm",
        LENGTH,
        default=None,
        hint="mangoes have 86 to 144",
        meaning="smallest and largest value of the other principal radius (ellipsoid)",
    )
    thickness_mm: tuple[float, float] | None = quantity(
        "mm",
        LENGTH,
        default=None,
        hint="flesh over a mango's stone has 8 to 20",
        meaning="smallest and largest thickness of the flesh under the skin (domes on a curved fruit)",
    )
    noise_percent: float = quantity(
        "%",
        _PERCENT,
        default=0.5,
        hint="a load cell has 0.5 of full scale",
        meaning="noise of each force, one standard deviation, as a fraction of the largest force of its tip",
    )
    noise_N: float = quantity(
        "N",
        _FORCE,
        default=0.0,
        hint="give 0 where noise_percent is the whole noise",
        meaning="further noise of each force, one standard deviation, independent of the force",
    )
    stiffness_percent: float | None = quantity(
        "%",
        _PERCENT,
        default=None,
        hint="leave it out to compute it from the bench",
        meaning="standard uncertainty of each spring after calibration; by default computed from the bench, see "
        "[what a bench leaves](read-a-fruit.md#what-a-bench-leaves)",
    )
    gain_percent: float | None = quantity(
        "%",
        _PERCENT,
        default=None,
        hint="leave it out to compute it from the bench",
        meaning="standard uncertainty of the gain of each channel after calibration; by default from the bench",
    )
    calibrated_by: str | None = choice(
        CALIBRATED_BY,
        default=None,
        meaning="weights calibrate the force of each channel; a press on a hard plate also calibrates its deflection; "
        "`ball` is a plate, and presses on a ball of known modulus, which calibrate the form of domes",
    )
    ball_percent: float = quantity(
        "%",
        _PERCENT,
        default=2.0,
        hint="pipeline modulus measures that of a ball",
        meaning="standard uncertainty of a reference ball, by its modulus and the presses on it; it is the "
        'same in all readings of a unit (`calibrated_by = "ball"`). The default is a judgement',
    )
    bias_limit: float = quantity(
        "1",
        _LIMIT,
        default=0.05,
        hint="give a fraction, for 5 % write 0.05",
        meaning="largest allowed error of the modulus over all poses, without noise",
    )
    uncertainty_limit: float | tuple[float, ...] = quantity(
        "1",
        _LIMIT,
        default=0.1,
        hint="give a fraction, for 10 % write 0.1",
        meaning="largest allowed standard uncertainty of the modulus, or a list with one for each of `fruit.E_MPa`",
    )
    at_s: float | None = quantity(
        "s",
        DURATION,
        default=None,
        hint="travel / speed is when the press stops",
        meaning="time from the first touch at which a reading is taken on flesh that relaxes; by default the end of "
        "the travel",
    )
    presses: float = quantity(
        "1",
        _PRESSES,
        default=3.0,
        hint="three presses, each at another place, are usual",
        meaning="number of presses, each at another place, that are read as one fruit",
    )

    def __post_init__(self) -> None:
        """Raise InputError for an invalid field, a missing principal radius, or a range in the wrong order."""
        check_fields(self, "reading")
        if (self.radius_mm is None) != (self.radius_across_mm is None):
            missing = "reading.radius_mm" if self.radius_mm is None else "reading.radius_across_mm"
            bound = "given with the other principal radius"
            raise validation_error(missing, None, "mm", bound, "give both from and to")
        for key in RANGES:
            ends = getattr(self, key)
            if ends is not None and not (len(ends) == _ENDS and ends[0] <= ends[1]):
                name = f"reading.{key}"
                raise validation_error(
                    name, list(ends), "mm", "two numbers, from and to", "list the smaller number first"
                )
        if self.presses != int(self.presses):
            bound = "a whole number"
            raise validation_error("reading.presses", self.presses, "", bound, "count the presses of one fruit")

    @property
    def on_plate(self) -> bool:
        """Return whether a hard plate calibrates the unit, with or without a ball."""
        return self.calibrated_by in ("plate", "ball")

    @property
    def uncalibrated_gain_percent(self) -> float:
        """Return the standard uncertainty of a gain before a calibration [%]."""
        return AMPLIFIER_GAIN_PERCENT if self.gain_percent is None else self.gain_percent

    @property
    def least_uncertainty_limit(self) -> float:
        """Return the smallest limit [1] of the standard uncertainty at any modulus."""
        limits = self.uncertainty_limit
        return min(limits) if isinstance(limits, tuple) else limits

    def uncertainty_limit_at(self, E: float, moduli: Sequence[float]) -> float:
        """Return the limit of the standard uncertainty [1] at the modulus `E` [MPa].

        A list of limits has one for each of `moduli` [MPa]. Between them the limit is interpolated linearly in log E,
        and beyond them it is the limit at the nearest one.
        """
        limits = self.uncertainty_limit
        if not isinstance(limits, tuple):
            return limits
        rows = sorted(zip(moduli, limits, strict=True))
        upper = bisect.bisect_left(rows, (E, 0.0))  # index of the first modulus that is not below E
        if upper in (0, len(rows)):
            return rows[min(upper, len(rows) - 1)][1]
        (E_low, limit_low), (E_high, limit_high) = rows[upper - 1 : upper + 1]
        return limit_low + (limit_high - limit_low) * math.log(E / E_low) / math.log(E_high / E_low)
