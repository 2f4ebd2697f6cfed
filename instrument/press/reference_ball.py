"""The correction of a unit by presses on a ball of known modulus: one factor for all its readings."""

from dataclasses import dataclass

from sensor.quantity import Bounds, check_fields, quantity

_HINT = "take the numbers that pipeline calibrate wrote"
FACTOR = Bounds(at_least=0.5, at_most=2.0)
MODULUS = Bounds(above=0.0, at_most=1e4)
RADIUS = Bounds(at_least=1.0, at_most=1e4)
_TIME = Bounds(above=0.0, at_most=1e4)
_ERROR = Bounds(at_least=0.0, at_most=50.0)
_SLOPE = Bounds(at_least=-1e3, at_most=1e3)


@dataclass(frozen=True, kw_only=True)
class BallCorrection:
    """The factor by which readings of a unit are multiplied, and its standard deviation, which all readings share.

    `E_MPa` is the modulus of a fruit on which the forces would be the same as on the ball of radius `radius_mm`. The
    presses lasted `press_s`, from the first touch to the deepest point. The slopes (tips,) are the relative changes of
    E on the ball per relative change of a spring stiffness or a gain. `form_percent` is the change of E on the ball due
    to one standard deviation of each form error of the domes, as in `reading.moduli` of a report. The factor corrects
    these errors in all readings.
    """

    factor: float = quantity("1", FACTOR, hint=_HINT)
    percent: float = quantity("%", _ERROR, hint=_HINT)
    E_MPa: float = quantity("MPa", MODULUS, hint=_HINT)
    radius_mm: float = quantity("mm", RADIUS, hint=_HINT)
    press_s: float = quantity("s", _TIME, hint=_HINT)
    spring_slopes: tuple[float, ...] = quantity("1", _SLOPE, hint=_HINT)
    gain_slopes: tuple[float, ...] = quantity("1", _SLOPE, hint=_HINT)
    form_percent: tuple[float, ...] = quantity("%", _SLOPE, hint=_HINT)

    def __post_init__(self) -> None:
        check_fields(self, "unit.ball")
