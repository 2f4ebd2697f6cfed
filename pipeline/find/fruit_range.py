"""A range of fruits, from a text or a file written by `pipeline modulus`, and the pressure at which fruits bruise."""

import json
import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sensor.design.fruits import FRUITS, ranges_in_words
from sensor.input_file import read_bytes
from sensor.quantity import (
    LENGTH,
    MODULUS,
    InputError,
    check_fields,
    nearest,
    parse_number,
    quantity,
    validation_error,
)
from sensor.words import rounded

# Pressure at which flesh of 1 MPa bruises [MPa], and exponent of its increase with the modulus. These two assumptions
# agree with apple flesh of 3.5 MPa, which fails at 0.29 MPa.
BRUISE_MPA = 0.1
BRUISE_EXPONENT = 0.85
BALL_SPREAD = 0.2  # relative spread of the radius of a round fruit, because no fruit is a perfect ball
_FORM = (
    "as in 'radius 26, E 0.3 to 2' or 'radius 24 to 31 by 40 to 51, flesh 14 to 27, E 0.3 to 2' [mm, MPa]. It may also "
    "be a file of pipeline modulus --json that ends in .json, or the name of a fruit, as pear, also before its own "
    "ranges: 'pear, radius 26, E 0.3 to 2'"
)
# A number is any text without a space. `parse_number` decides later whether it is a number.
_NUMBER = r"(\S+?)"
_RANGE = rf"{_NUMBER} to {_NUMBER}"
_NAME = r"\s*(?:([a-z]+), )?"
_BALL = re.compile(rf"{_NAME}radius {_NUMBER}(?: mm)?, E {_RANGE}(?: MPa)?\s*")
_FLESH = rf"(?:, flesh {_RANGE}(?: mm)?)?"
_ANY_SHAPE = re.compile(rf"{_NAME}radius {_RANGE} by {_RANGE}(?: mm)?{_FLESH}, E {_RANGE}(?: MPa)?\s*")

_RADIUS_ENDS = 4  # number of ends of the two ranges of radii
Ends = tuple[float, float]
"""The smallest and the largest value of a range."""


@dataclass(frozen=True, kw_only=True)
class FruitRange:
    """A range of fruits: the radii of curvature where they are pressed, the flesh thickness, and the moduli.

    A single number as `radius_mm` describes fruits that are nearly balls. Otherwise `radius_mm` and `radius_across_mm`
    are the ranges of the two principal radii. `thickness_mm` is the range of the flesh thickness, if it is known.
    `name` is a fruit in the table of fruits, whose bruise limit is used.
    """

    name: str | None = None
    radius_mm: float | Ends = quantity("mm", LENGTH, hint="measure the fruit")
    radius_across_mm: Ends | None = quantity("mm", LENGTH, default=None, hint="measure the fruit")
    thickness_mm: Ends | None = quantity("mm", LENGTH, default=None, hint="cut the fruit")
    E_min_MPa: float = quantity("MPa", MODULUS, hint="measure the fruit")
    E_max_MPa: float = quantity("MPa", MODULUS, hint="measure the fruit")

    def __post_init__(self) -> None:
        """Raise InputError for an invalid length or modulus, or a range whose ends are in the wrong order."""
        check_fields(self, "--fruit")
        if self.E_min_MPa >= self.E_max_MPa:
            bound = f"less than the largest, {self.E_max_MPa:g} MPa"
            raise validation_error("--fruit.E_min_MPa", self.E_min_MPa, "MPa", bound, "give the softest fruit first")
        for key in ("radius_mm", "radius_across_mm", "thickness_mm"):
            ends = getattr(self, key)
            if isinstance(ends, tuple) and ends[0] > ends[1]:
                name = f"--fruit.{key}"
                bound = "two numbers in ascending order"
                raise validation_error(name, list(ends), "mm", bound, "give the smaller number first")

    @property
    def radii_mm(self) -> tuple[Ends, Ends]:
        """Return the ranges of the two principal radii [mm]; for a ball, the radius minus and plus 20 %."""
        radius = self.radius_mm
        if not isinstance(radius, tuple):
            radius = (rounded((1.0 - BALL_SPREAD) * radius), rounded((1.0 + BALL_SPREAD) * radius))
        return radius, self.radius_across_mm or radius

    @property
    def mean_curvature(self) -> float:
        """Return the mean of the curvatures at the ends of both ranges of radii [1/mm]."""
        radii = [radius for ends in self.radii_mm for radius in ends]
        return math.fsum(1.0 / radius for radius in radii) / len(radii)

    @property
    def moduli_MPa(self) -> tuple[float, ...]:
        """Return four moduli [MPa] in geometric progression, from the softest to the firmest flesh.

        Only the two inner moduli are rounded.
        """
        _, *inner, _ = np.geomspace(self.E_min_MPa, self.E_max_MPa, 4).tolist()
        return (self.E_min_MPa, *(rounded(E, 2) for E in inner), self.E_max_MPa)

    @property
    def in_words(self) -> str:
        """Return the range as text that `fruit_range` can parse."""
        E = (self.E_min_MPa, self.E_max_MPa)
        name = "" if self.name is None else f"{self.name}, "
        if not isinstance(self.radius_mm, tuple):
            return f"{name}radius {self.radius_mm:g}, E {E[0]:g} to {E[1]:g}"
        return name + ranges_in_words(*self.radii_mm, self.thickness_mm, E)


def fruit_range(text: str) -> FruitRange:
    """Parse the range of fruits from `text`, the value of the flag `--fruit`.

    The value is the path of a file written by `pipeline modulus --json`, or the name of a fruit in the table. The value
    may also be a description such as 'radius 26, E 0.3 to 2'. Raises InputError for any other text.
    """
    if text.endswith(".json"):
        return _measured_range(Path(text))
    if text.isalpha():
        return _named_range(text)
    ball = _BALL.fullmatch(text)
    match = ball or _ANY_SHAPE.fullmatch(text)
    if match is None:
        raise _invalid_text(text)
    # The first group is the name, and the others are the numbers as text, in the order of the description. A group that
    # is left out is None.
    name, *number_texts = match.groups()
    numbers = [parse_number(number_text) for number_text in number_texts if number_text is not None]
    if None in numbers:
        raise _invalid_text(text)
    if name is not None:
        _refuse_unknown(name)
    *lengths, softest, firmest = (number for number in numbers if number is not None)  # the moduli come last
    if ball is not None:
        return FruitRange(name=name, radius_mm=lengths[0], E_min_MPa=softest, E_max_MPa=firmest)
    return FruitRange(
        name=name,
        radius_mm=(lengths[0], lengths[1]),
        radius_across_mm=(lengths[2], lengths[3]),
        # the thickness of the flesh follows the radii, but may be left out
        thickness_mm=(lengths[4], lengths[5]) if len(lengths) > _RADIUS_ENDS else None,
        E_min_MPa=softest,
        E_max_MPa=firmest,
    )


def _invalid_text(text: str) -> InputError:
    """Return the error for a text that does not have a form of the flag `--fruit`, or contains an invalid number."""
    return validation_error("--fruit", text, "", _FORM, "write all numbers")


def _named_range(name: str) -> FruitRange:
    """Return the range of the fruit `name` in the table of fruits; raise InputError for an unknown name."""
    _refuse_unknown(name)
    fruit = FRUITS[name]
    return FruitRange(
        name=name,
        radius_mm=fruit.radius_mm,
        radius_across_mm=fruit.radius_across_mm,
        thickness_mm=fruit.thickness_mm,
        E_min_MPa=fruit.E_MPa[0],
        E_max_MPa=fruit.E_MPa[1],
    )


def _refuse_unknown(name: str) -> None:
    """Raise InputError for the name of a fruit that is not in the table of fruits."""
    if name not in FRUITS:
        ranges = "leave the name out and give ranges, as in 'radius 26, E 0.3 to 2' [mm, MPa]"
        hint = f"did you mean {nearest(name, tuple(FRUITS))}? Or {ranges}"
        raise validation_error("--fruit", name, "", f"one of {', '.join(FRUITS)}", hint)


def _measured_range(path: Path) -> FruitRange:
    """Read the range of the specimens from a file written by `pipeline modulus --json`.

    The file holds a row for each specimen. The range of moduli includes their error bars, `u_percent`. The radii are
    the radii of the tested specimens. A specimen without a second radius is a ball. If all specimens are balls, the
    radius of the first one is used. Raises InputError if the file was not written by this command.
    """
    try:
        rows = json.loads(read_bytes(path, "--fruit"))
        lowest = min(row["E_MPa"] * (1.0 - 0.01 * row["u_percent"]) for row in rows)
        highest = max(row["E_MPa"] * (1.0 + 0.01 * row["u_percent"]) for row in rows)
        # rounded outwards to two digits, as `pipeline modulus` prints them
        E_min = rounded(lowest, 2, towards=0.0)
        E_max = rounded(highest, 2, towards=math.inf)
        radii = [float(row["geometry"]["radius_mm"]) for row in rows]
        across = [
            float(row["geometry"].get("radius_across_mm") or radius) for row, radius in zip(rows, radii, strict=True)
        ]
    except (ValueError, LookupError, TypeError, OverflowError, RecursionError) as error:
        raise validation_error("--fruit", str(path), "", _FORM, "give the radius to pipeline modulus too") from error
    if radii == across:
        return FruitRange(radius_mm=radii[0], E_min_MPa=E_min, E_max_MPa=E_max)
    return FruitRange(
        radius_mm=(min(radii), max(radii)),
        radius_across_mm=(min(across), max(across)),
        E_min_MPa=E_min,
        E_max_MPa=E_max,
    )


def bruise_limit(E: float, name: str | None = None) -> float:
    """Return the mean pressure [MPa] at which flesh of modulus `E` [MPa] bruises, rounded down to three digits.

    If `name` is a fruit in the table, the limit of this fruit is used. If it is None, the limit is 0.1 E^0.85, which is
    an assumption of this project.
    """
    limit = BRUISE_MPA * E**BRUISE_EXPONENT if name is None else FRUITS[name].bruise_limit(E)
    return rounded(limit, towards=0.0)
