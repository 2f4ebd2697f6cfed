"""The half width of a reading, and which part of it several presses on the same fruit share."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from instrument.press.measuring import MeasuringUnit
from pipeline.reading.uncertainty import heat_uncertainty
from sensor.quantity import BOUNDED, COVERAGE

UNDETERMINED = ("zero_drift", "times")
"""Causes of channels and springs that may either vary from press to press or be the same in all presses.

A zero may be wrong since the tare or drift between two presses. A converter may be late by the same time in each press,
or by another time.
"""


@dataclass(frozen=True, kw_only=True)
class Deviations:
    """Relative standard deviations of the reading of a press [1], by their correlation between presses.

    Those in `independent` vary from press to press on a fruit, and those in `shared` are the same in all presses. Those
    in `undetermined` may be one or the other, because their correlation is unknown.
    """

    independent: Sequence[float] = ()
    undetermined: Sequence[float] = ()
    shared: Sequence[float] = ()

    @classmethod
    def with_unit(
        cls, independent: Sequence[float], unit_errors: Mapping[str, float], shared: Sequence[float] = ()
    ) -> "Deviations":
        """Return deviations that include the errors of channels and springs [1], each assigned by its cause."""
        undetermined = [unit_errors[cause] for cause in UNDETERMINED if cause in unit_errors]
        constant = [error for cause, error in unit_errors.items() if cause not in UNDETERMINED]
        return cls(independent=independent, undetermined=undetermined, shared=[*constant, *shared])


@dataclass(frozen=True, kw_only=True)
class HalfWidth:
    """The half widths of a modulus at 95 %, as fractions of it [1], by the groups of `Deviations`.

    `bend` is the size of a known error, which is the same in all presses.
    """

    independent: float
    undetermined: float
    shared: float
    bend: float = 0.0

    @property
    def total(self) -> float:
        """Return the half width of a single press [1]."""
        return math.hypot(self.independent, self.undetermined, self.shared) + self.bend

    @property
    def largest_independent(self) -> float:
        """Return the part that may differ from press to press on a fruit [1]."""
        return math.hypot(self.independent, self.undetermined)

    @property
    def largest_shared(self) -> float:
        """Return the part that may be the same in all presses on a fruit [1], without the bend."""
        return math.hypot(self.undetermined, self.shared)

    def widened_to(self, u: float) -> "HalfWidth":
        """Return the half widths for a total of `u` [1], if it is larger; the excess varies from press to press."""
        if u <= self.total:
            return self
        return replace(self, independent=math.sqrt((u - self.bend) ** 2 - self.largest_shared**2))


def half_width(sensor: MeasuringUnit, E: float, deviations: Deviations, bend: float = 0.0) -> HalfWidth:
    """Return the half width at 95 % of a reading E [MPa], as a fraction of E [1].

    `deviations` are errors of the reading due to noise, the unit and the press. `bend` [1] is the size of the error due
    to curved calibration lines; it is not random, so it adds linearly. Both are multiplied by the steepness, d ln E / d
    ln(reading). The fruit, its poses and the temperature of the leaves change E itself.
    """
    steepness = sensor.steepness(E)
    fruit = sensor.fruit_deviations(E)
    heat = heat_uncertainty(sensor.report.read_out.signal).values()

    def combine(reading_errors: Sequence[float], *modulus_errors: float) -> float:
        """Return the half width due to independent errors of the reading and of E [1]."""
        return COVERAGE * math.hypot(steepness * math.hypot(*reading_errors), *modulus_errors)

    pose = fruit.pop("pose", 0.0)  # depends on the press due to its tilt, and on the fruit due to its shape
    model_error = BOUNDED * sensor.model_error  # anywhere within its bound (JCGM 100:2008, 4.3.7)
    return HalfWidth(
        independent=combine(deviations.independent, *sensor.unevenness_deviations(E)),
        undetermined=combine(deviations.undetermined, pose),
        shared=combine([*deviations.shared, model_error], *heat, *fruit.values(), *sensor.form_deviations(E)),
        bend=steepness * bend,
    )
