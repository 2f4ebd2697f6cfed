"""The half width of a reading, and which part of it several presses on the same fruit share."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from instrument.press.measuring import MeasuringUnit
from pipeline.reading.uncertainty import by_heat
from sensor.quantity import BOUNDED, COVERAGE

# A zero may be wrong since the tare or drift between two presses. A converter may be late by the same time in each
# press, or by another time.
OF_EITHER = ("zero_drift", "times")
"""Causes of channels and springs that may either vary from press to press or be the same in all presses."""


@dataclass(frozen=True, kw_only=True)
class Deviations:
    """Relative standard deviations of the reading of a press [1], by their correlation between presses.

    Those in `of_press` are independent from press to press on a fruit, and those in `alike` are the same in all
    presses. Those in `either` may be one or the other, because their correlation is unknown.
    """

    of_press: Sequence[float] = ()
    either: Sequence[float] = ()
    alike: Sequence[float] = ()

    @classmethod
    def with_unit(
        cls, of_press: Sequence[float], by_unit: Mapping[str, float], alike: Sequence[float] = ()
    ) -> "Deviations":
        """Return deviations to which the causes of channels and springs [1] are added by their names."""
        either = [by_unit[cause] for cause in OF_EITHER if cause in by_unit]
        of_unit = [error for cause, error in by_unit.items() if cause not in OF_EITHER]
        return cls(of_press=of_press, either=either, alike=[*of_unit, *alike])


@dataclass(frozen=True, kw_only=True)
class HalfWidth:
    """The half widths of a modulus at 95 %, as fractions of it [1], by the groups of `Deviations`.

    `bend` is the size of a known error, which is the same in all presses.
    """

    of_press: float
    either: float
    alike: float
    bend: float = 0.0

    @property
    def of_one_press(self) -> float:
        """Return the half width of a single press [1]."""
        return math.hypot(self.of_press, self.either, self.alike) + self.bend

    @property
    def that_may_differ(self) -> float:
        """Return the part that may differ from press to press on a fruit [1]."""
        return math.hypot(self.of_press, self.either)

    @property
    def that_may_be_alike(self) -> float:
        """Return the part that may be the same in all presses on a fruit [1], without the bend."""
        return math.hypot(self.either, self.alike)

    def widened_to(self, u: float) -> "HalfWidth":
        """Return the half widths for a total of `u` [1], if it is larger; the excess varies from press to press."""
        if u <= self.of_one_press:
            return self
        return replace(self, of_press=math.sqrt((u - self.bend) ** 2 - self.that_may_be_alike**2))


def half_width(sensor: MeasuringUnit, E: float, deviations: Deviations, bend: float = 0.0) -> HalfWidth:
    """Return the half width at 95 % of a reading E [MPa], as a fraction of it [1].

    Errors of the reading, by noise and by the unit, are multiplied by the steepness of the level readings. So is a
    known error by curved lines [1], whose size is added. Fruit, poses and the temperature of the leaves change E
    itself. The error of the contact model may lie anywhere within its bound (JCGM 100:2008, 4.3.7).
    """
    steepness = sensor.steepness(E)
    of_fruit = sensor.by_fruit(E)
    of_heat = by_heat(sensor.report.read_out.signal).values()

    def together(of_read: Sequence[float], *of_E: float) -> float:
        return COVERAGE * math.hypot(steepness * math.hypot(*of_read), *of_E)

    pose = of_fruit.pop("pose", 0.0)  # depends on the press by its tilt and on the fruit by its shape
    return HalfWidth(
        of_press=together(deviations.of_press, *sensor.by_uneven(E)),
        either=together(deviations.either, pose),
        alike=together(
            [*deviations.alike, BOUNDED * sensor.model_error], *of_heat, *of_fruit.values(), *sensor.by_form(E)
        ),
        bend=steepness * bend,
    )
