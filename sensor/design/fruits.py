"""Fruits by name, from fruits.toml: their shape where they are pressed, and their moduli."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from sensor.input_file import read_toml
from sensor.quantity import LENGTH, MODULUS, Bounds, Sourced, quantity, validation_error

_ENDS = 2  # number of ends of a range
_SHARE = Bounds(above=0.0, below=1.0)


@dataclass(frozen=True, kw_only=True)
class NamedFruit(Sourced):
    """A fruit of the table: its principal radii where it is pressed, its flesh thickness, and its moduli.

    All numbers except `relaxes_to` are ranges: the smallest and the largest value. Raises InputError for a range that
    does not increase, or for a number without a source.
    """

    LABEL: ClassVar[str] = "fruit"

    radius_mm: tuple[float, float] = quantity("mm", LENGTH, meaning="the smaller principal radius of the cheek")
    radius_across_mm: tuple[float, float] = quantity("mm", LENGTH, meaning="the other principal radius")
    thickness_mm: tuple[float, float] = quantity(
        "mm", LENGTH, meaning="thickness of the flesh over the stone, core or hollow"
    )
    E_MPa: tuple[float, float] = quantity("MPa", MODULUS, meaning="modulus of ripe and of unripe flesh")
    bruise_limit_MPa: tuple[float, float] = quantity(
        "MPa", MODULUS, meaning="mean pressure under a tip at which flesh of these moduli bruises"
    )
    relaxes_to: float = quantity("1", _SHARE, meaning="fraction of a force that ripe flesh retains in the long term")

    def __post_init__(self) -> None:
        """Raise InputError for a range that is not two increasing numbers."""
        super().__post_init__()
        for key in RANGES:
            ends = getattr(self, key)
            if len(ends) != _ENDS or ends[0] >= ends[1]:
                name = f"fruit {self.name}.{key}"
                raise validation_error(name, list(ends), "", "two increasing numbers", self.HINT)

    def bruise_limit(self, E: float) -> float:
        """Return the mean pressure [MPa] at which flesh of modulus `E` [MPa] bruises.

        The pressure is a power law of the modulus through both ends of the ranges.
        """
        (softest, firmest), (lowest_limit, highest_limit) = self.E_MPa, self.bruise_limit_MPa
        fraction = math.log(E / softest) / math.log(firmest / softest)
        return lowest_limit * math.pow(highest_limit / lowest_limit, fraction)

    @property
    def in_words(self) -> str:
        """Return the ranges as text that `pipeline suggest --fruit` accepts."""
        return ranges_in_words(self.radius_mm, self.radius_across_mm, self.thickness_mm, self.E_MPa)


def ranges_in_words(
    radius_mm: Sequence[float],
    radius_across_mm: Sequence[float],
    thickness_mm: Sequence[float] | None,
    E_MPa: Sequence[float],
) -> str:
    """Return ranges as text that `pipeline suggest --fruit` accepts. `thickness_mm` is None if it is unknown."""
    flesh = "" if thickness_mm is None else f", flesh {_ends(thickness_mm)}"
    return f"radius {_ends(radius_mm)} by {_ends(radius_across_mm)}{flesh}, E {_ends(E_MPa)}"


def _ends(ends: Sequence[float]) -> str:
    return " to ".join(f"{end:g}" for end in ends)


RANGES = ("radius_mm", "radius_across_mm", "thickness_mm", "E_MPa", "bruise_limit_MPa")

FRUITS = NamedFruit.from_tables(read_toml(Path(__file__).with_name("fruits.toml"), "fruits"))
