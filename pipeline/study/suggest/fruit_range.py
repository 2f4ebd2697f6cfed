"""A fruit as a person measured it, in words or in a file of `pipeline modulus`, and what its skin bears."""

import json
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cad.input_file import read_bytes
from cad.quantity import LENGTH, MODULUS, check_fields, quantity, validation_error, written_number
from pipeline.verdicts.hints import rounded

BRUISE_MPA = 0.1  # of flesh of 1 MPa: an assumption, as the exponent; apple flesh of 3.5 MPa fails at 0.29
BRUISE_EXPONENT = 0.85
_FORM = "as in 'radius 26, E 0.3 to 2' [mm, MPa], or a file of pipeline modulus --json that ends in .json"


@dataclass(frozen=True, kw_only=True)
class FruitRange:
    """A fruit as it was measured: its radius where it is pressed [mm], its softest and firmest flesh [MPa]."""

    radius_mm: float = quantity("mm", LENGTH, hint="measure the fruit")
    E_min_MPa: float = quantity("MPa", MODULUS, hint="measure the fruit")
    E_max_MPa: float = quantity("MPa", MODULUS, hint="measure the fruit")

    def __post_init__(self) -> None:
        """Refuse what is no length or no modulus, and a range that is none."""
        check_fields(self, "--fruit")
        if self.E_min_MPa >= self.E_max_MPa:
            bound = f"less than the largest, {self.E_max_MPa:g} MPa"
            raise validation_error("--fruit.E_min_MPa", self.E_min_MPa, "MPa", bound, "give the softest fruit first")

    @property
    def moduli_MPa(self) -> tuple[float, ...]:
        """Return four moduli from the softest to the firmest, each the same multiple of the one before [MPa]."""
        _, *between, _ = np.geomspace(self.E_min_MPa, self.E_max_MPa, 4).tolist()
        return (self.E_min_MPa, *(with_digits(E, 2) for E in between), self.E_max_MPa)


def fruit_range(text: str) -> FruitRange:
    """Return the fruit that a text or a file of `pipeline modulus --json` describes; raises InputError."""
    if text.endswith(".json"):
        return _measured_range(Path(text))
    found = re.fullmatch(r"\s*radius (\S+?)(?: mm)?, E (\S+) to (\S+?)(?: MPa)?\s*", text)
    numbers = [] if found is None else [written_number(word) for word in found.groups()]
    radius, softest, firmest = numbers or (None, None, None)
    if radius is None or softest is None or firmest is None:
        raise validation_error("--fruit", text, "", _FORM, "write all three numbers")
    return FruitRange(radius_mm=radius, E_min_MPa=softest, E_max_MPa=firmest)


def _measured_range(path: Path) -> FruitRange:
    """Return the range of the specimens in a file, each with its error bar, and the radius that was given for them."""
    try:
        rows = json.loads(read_bytes(path, "--fruit"))
        lowest = min(row["E_MPa"] * (1.0 - 0.01 * row["u_percent"]) for row in rows)
        highest = max(row["E_MPa"] * (1.0 + 0.01 * row["u_percent"]) for row in rows)
        radius = float(rows[0]["geometry"]["radius_mm"])
    except (ValueError, LookupError, TypeError, OverflowError, RecursionError) as error:
        raise validation_error("--fruit", str(path), "", _FORM, "give the radius to pipeline modulus too") from error
    return FruitRange(radius_mm=radius, E_min_MPa=with_digits(lowest, 2), E_max_MPa=with_digits(highest, 2))


def bruise_limit(E: float) -> float:
    """Return the mean pressure that flesh of a modulus bears [MPa, both], rounded down to three digits.

    0.1 E^0.85, an assumption of this project.
    """
    return rounded(BRUISE_MPA * E**BRUISE_EXPONENT, 0.0)


def with_digits(value: float, digits: int) -> float:
    """Return a number of so many digits [its unit]."""
    return float(f"{value:.{digits}g}")
