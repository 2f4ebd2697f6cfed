"""The half width of a reading, and which part of it several presses of the same fruit share."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from instrument.press.measuring import MeasuringUnit
from pipeline.reading.uncertainty import by_heat
from sensor.quantity import BOUNDED, COVERAGE

# A zero may be off from the tare on, or drift between two presses. A converter may be late by the same time in each
# press, or by another one.
OF_EITHER = ("zero_drift", "times")
"""Causes among those of channels and springs that may differ from press to press, or be the same in all."""


@dataclass(frozen=True, kw_only=True)
class Deviations:
    """By how much what is read of a press may be off, each one standard deviation [1].

    `of_press` are independent from press to press of a fruit, `alike` are the same in all of them. `either` may be the
    one or the other: nothing says which.
    """

    of_press: Sequence[float] = ()
    either: Sequence[float] = ()
    alike: Sequence[float] = ()

    @classmethod
    def with_unit(
        cls, of_press: Sequence[float], by_unit: Mapping[str, float], alike: Sequence[float] = ()
    ) -> "Deviations":
        """Return deviations with those of channels and springs, by their causes [1]."""
        either = [by_unit[cause] for cause in OF_EITHER if cause in by_unit]
        of_unit = [error for cause, error in by_unit.items() if cause not in OF_EITHER]
        return cls(of_press=of_press, either=either, alike=[*of_unit, *alike])


@dataclass(frozen=True, kw_only=True)
class HalfWidth:
    """The half widths of a modulus that hold 95 %, as fractions of it [1], by the parts of `Deviations`.

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
        """Return the part that may differ from press to press of a fruit [1]."""
        return math.hypot(self.of_press, self.either)

    @property
    def that_may_be_alike(self) -> float:
        """Return the part that may be the same in all presses of a fruit, but for the bend [1]."""
        return math.hypot(self.either, self.alike)

    def widened_to(self, u: float) -> "HalfWidth":
        """Return the half widths of a press whose own one is `u` [1], by one of its samples."""
        if u <= self.of_one_press:
            return self
        return replace(self, of_press=math.sqrt((u - self.bend) ** 2 - self.that_may_be_alike**2))


def half_width(sensor: MeasuringUnit, E: float, deviations: Deviations, bend: float = 0.0) -> HalfWidth:
    """Return the half width that holds 95 % of a reading of E [MPa], as a fraction of it [1].

    E moves by the steepness of its level readings for each deviation of what is read, by noise and by the unit. So it
    does for a known error by lines that bend [1], whose size is added. Fruit, poses and the temperature of the leaves
    move E itself. An error of the contact model may lie anywhere within its bound (JCGM 100:2008, 4.3.7).
    """
    steepness = sensor.steepness(E)
    of_fruit = sensor.by_fruit(E)
    of_heat = by_heat(sensor.report.read_out.signal).values()

    def together(of_read: Sequence[float], *of_E: float) -> float:
        return COVERAGE * math.hypot(steepness * math.hypot(*of_read), *of_E)

    pose = of_fruit.pop("pose", 0.0)  # of the press by its tilt, and of the fruit by its shape
    return HalfWidth(
        of_press=together(deviations.of_press, *sensor.by_uneven(E)),
        either=together(deviations.either, pose),
        alike=together(
            [*deviations.alike, BOUNDED * sensor.model_error], *of_heat, *of_fruit.values(), *sensor.by_form(E)
        ),
        bend=steepness * bend,
    )
