"""The firmness that another instrument measures, as an increasing function of the modulus that a unit reads."""

from dataclasses import dataclass

import numpy as np

from sensor.quantity import COVERAGE, Bounds, Estimate, check_fields, choice, quantity, validation_error

CURVES = ("factor", "power", "rising")
"""Forms of the function: a constant factor on E (only version 0.2), a power of E, or any increasing curve."""
_HINT = "take the numbers that pipeline calibrate wrote"
_POSITIVE = Bounds(above=0.0, at_most=1e6)
_RANGE_TOLERANCE = 1e-6  # relative tolerance for E at an end of the curve, because of round-off


@dataclass(frozen=True, kw_only=True)
class FruitScale:
    """The firmness of fruit in `unit` as a function of the modulus E [MPa], interpolated linearly in both logarithms.

    `percent` is the half width of an interval that contains 95 % of all fruit, from leave-one-out cross-validation.
    """

    unit: str = choice(("N", "MPa"), default="N", hint=_HINT)
    curve: str = choice(CURVES, default="factor", hint=_HINT)
    percent: float = quantity("%", _POSITIVE, hint=_HINT)
    E_MPa: tuple[float, ...] = quantity("MPa", _POSITIVE, hint=_HINT)
    firmness: tuple[float, ...] = quantity("", _POSITIVE, hint=_HINT)

    def __post_init__(self) -> None:
        """Raise InputError for an invalid field, for lists of different lengths, and for a list that decreases."""
        check_fields(self, "unit.scale")
        if len(self.firmness) != len(self.E_MPa):
            bound = f"a list of {len(self.E_MPa)} numbers, one for each modulus"
            raise validation_error("unit.scale.firmness", list(self.firmness), self.unit, bound, _HINT)
        for name, values in (("unit.scale.E_MPa", self.E_MPa), ("unit.scale.firmness", self.firmness)):
            if list(values) != sorted(values):  # equal numbers are allowed
                raise validation_error(name, list(values), "", "a list of increasing numbers", _HINT)

    def firmness_of(self, E: float) -> Estimate | None:
        """Return the firmness of fruit of modulus E [MPa] with its standard deviation, or None beyond the curve."""
        if not self.E_MPa[0] * (1.0 - _RANGE_TOLERANCE) <= E <= self.E_MPa[-1] * (1.0 + _RANGE_TOLERANCE):
            return None
        value = float(np.exp(np.interp(np.log(E), np.log(self.E_MPa), np.log(self.firmness))))
        return Estimate(value, 0.01 * self.percent / COVERAGE * value, self.unit)
