"""The half width of a reading, and the part of it that repeated presses on the same fruit share."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from instrument.press.measuring import MeasuringUnit
from pipeline.reading.uncertainty import heat_uncertainty
from sensor.quantity import COVERAGE, UNIFORM_DEVIATION

UNKNOWN_CORRELATION = ("zero_drift", "times")
"""Errors of channels and springs that may vary from press to press or be the same in all presses.

The zero may have been wrong since the tare, or it may drift between two presses. The delay of the converter may be the
same in every press, or different in each.
"""


@dataclass(frozen=True, kw_only=True)
class Deviations:
    """Relative standard deviations of the reading of a press [1], by their correlation between presses.

    `independent` errors vary from press to press on the same fruit, and `shared` errors are the same in all presses.
    The correlation of `undetermined` errors is unknown, so they may belong to either group.
    """

    independent: Sequence[float] = ()
    undetermined: Sequence[float] = ()
    shared: Sequence[float] = ()

    @classmethod
    def with_unit(
        cls, independent: Sequence[float], unit_errors: Mapping[str, float], shared: Sequence[float] = ()
    ) -> "Deviations":
        """Return deviations to which the errors of channels and springs are added, each in the group of its cause.

        `unit_errors` maps each cause of these errors to a relative standard deviation [1]. Causes that are not in
        `UNKNOWN_CORRELATION` are the same in all presses.
        """
        undetermined = [unit_errors[cause] for cause in UNKNOWN_CORRELATION if cause in unit_errors]
        constant = [error for cause, error in unit_errors.items() if cause not in UNKNOWN_CORRELATION]
        return cls(independent=independent, undetermined=undetermined, shared=[*constant, *shared])


@dataclass(frozen=True, kw_only=True)
class HalfWidth:
    """The half widths of a modulus at 95 %, as fractions of the modulus [1], in the groups of `Deviations`.

    `bend` is the absolute value of a systematic error, which is the same in all presses.
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
        """Return the part of the half width that may vary from press to press on the same fruit [1]."""
        return math.hypot(self.independent, self.undetermined)

    @property
    def largest_shared(self) -> float:
        """Return the part of the half width that may be the same in all presses on a fruit [1], without `bend`."""
        return math.hypot(self.undetermined, self.shared)

    def with_total(self, u: float) -> "HalfWidth":
        """Return half widths with the total `u` [1], in which `independent` is increased to account for the difference.

        If `u` does not exceed the present total, the half widths are returned unchanged.
        """
        if u <= self.total:
            return self
        return replace(self, independent=math.sqrt((u - self.bend) ** 2 - self.largest_shared**2))


def half_width(sensor: MeasuringUnit, E: float, deviations: Deviations, bend: float = 0.0) -> HalfWidth:
    """Return the parts of the half width at 95 % of a reading E [MPa], as fractions of E [1].

    `deviations` are errors of the uncorrected reading due to noise, the unit and the press. `bend` [1] is the error due
    to nonlinear channels and springs; it is not random, so it is added linearly. These errors of the reading are
    multiplied by the steepness, d ln E / d ln(reading), to obtain errors of E. The errors due to the fruit, its pose
    and the temperature of the leaves are errors of E itself.
    """
    steepness = sensor.steepness(E)
    fruit_errors = sensor.fruit_deviations(E)  # maps each cause to a relative standard deviation [1]
    temperature_errors = heat_uncertainty(sensor.report.read_out.signal).values()

    def half_width_due_to(reading_errors: Sequence[float], *modulus_errors: float) -> float:
        """Return the half width due to relative standard deviations of the uncorrected reading and of E [1]."""
        return COVERAGE * math.hypot(steepness * math.hypot(*reading_errors), *modulus_errors)

    # A part of the pose error depends on the tilt and varies from press to press. Another part depends on the shape of
    # the fruit, which all presses share. So its correlation is undetermined. All other errors of the fruit are shared.
    pose = fruit_errors.pop("pose", 0.0)
    model_error = UNIFORM_DEVIATION * sensor.model_error  # uniform within its bound (JCGM 100:2008, 4.3.7)
    shared_errors_of_E = [*temperature_errors, *fruit_errors.values(), *sensor.form_deviations(E)]
    return HalfWidth(
        independent=half_width_due_to(deviations.independent, *sensor.unevenness_deviations(E)),
        undetermined=half_width_due_to(deviations.undetermined, pose),
        shared=half_width_due_to([*deviations.shared, model_error], *shared_errors_of_E),
        bend=steepness * bend,
    )
