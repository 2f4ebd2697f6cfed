"""Strips of sheet glued into slots of a printed frame: what the clamp gives, by the beam on an elastic foundation.

M. Hetenyi, Beams on Elastic Foundation, 1946, chapter II: the end of a long beam on a foundation of modulus k gives as
if it were 1 / beta longer, beta = (k / 4 EI)^(1/4).
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from sensor.quantity import MODULUS, Bounds, check_fields, quantity, validation_error

_POSITIVE = Bounds(above=0.0)
_POISSON = Bounds(above=-1.0, below=0.5)
_HINT = "take print.leaves = 'printed', or another print.clamp_mm"
LEAST_LENGTH = 4.0  # clamped length over 1 / beta: e^-4 of what bends a strip at the shoulder is left at its end
GLUE_FRACTION = 0.45  # of what clamps give, in the glue: 0.31 to 0.43 by FE of two designs
_STEPS = 60  # of the iteration for beta, which halves its error with each


@dataclass(frozen=True, kw_only=True)
class StripClamp:
    """How strips are held: glued into slots through the whole depth, shoulders of the print at their mouths [mm].

    A slot is as long as `length` and `end_room`, and as wide as a strip and `gap` on both faces. The numbers of the
    strip and of the glue are theirs, beside those of the print around them.
    """

    length: float = quantity("mm", _POSITIVE, hint=_HINT, meaning="length that is glued at each end of a strip")
    end_room: float = quantity("mm", _POSITIVE, hint=_HINT, meaning="free length in a slot beyond the end of its strip")
    gap: float = quantity(
        "mm", _POSITIVE, hint=_HINT, meaning="thickness of the glue between each face of a strip and its slot"
    )
    wall: float = quantity("mm", _POSITIVE, hint=_HINT, meaning="thickness of the solid above and below a slot")
    corner: float = quantity("mm", _POSITIVE, hint=_HINT, meaning="radius of the inner corners of the frame")
    strip_E_MPa: float = quantity("MPa", MODULUS, hint=_HINT, meaning="modulus of the strips")
    strip_poisson: float = quantity("1", _POISSON, hint=_HINT, meaning="Poisson's ratio of the strips")
    strip_over_print_density: float = quantity(
        "1", _POSITIVE, hint=_HINT, meaning="density of the strips divided by that of the print"
    )
    glue_E_MPa: float = quantity("MPa", MODULUS, hint=_HINT, meaning="modulus of the glue")
    glue_poisson: float = quantity("1", _POISSON, hint=_HINT, meaning="Poisson's ratio of the glue")

    def __post_init__(self) -> None:
        """Check each field."""
        check_fields(self, "clamp")

    @property
    def reach(self) -> float:
        """Return how far a slot reaches into wall or shuttle [mm]."""
        return self.length + self.end_room

    def slot_width(self, thickness: float) -> float:
        """Return the width of the slot of a strip of a thickness [mm]."""
        return thickness + 2.0 * self.gap

    def give(self, thickness: float, E: float, poisson: float) -> float:
        """Return 1 / beta [mm], by which an end of a strip counts as longer in a print of E [MPa].

        The foundation is two layers of glue that cannot spread, each on a half-space of the print pressed in waves of
        the number beta. See K. L. Johnson, Contact Mechanics, 1985, section 13.2. It is good to a fifth.
        """
        nu = self.glue_poisson
        glue = self.gap * (1.0 + nu) * (1.0 - 2.0 * nu) / (self.glue_E_MPa * (1.0 - nu))  # [mm/MPa], of one layer
        bending = self.strip_E_MPa * thickness**3 / 12.0  # of a strip 1 mm wide
        give = thickness
        for _ in range(_STEPS):
            foundation = 2.0 / (glue + 2.0 * (1.0 - poisson**2) / E * give)
            give = (4.0 * bending / foundation) ** 0.25
        return give

    def holds(self, give: float) -> bool:
        """Say whether the end of a strip whose clamp has this 1 / beta [mm] is not felt at the shoulder."""
        return self.length >= LEAST_LENGTH * give

    def check_length(self, thickness: float, E: float, poisson: float) -> None:
        """Raise InputError for a clamped length in which the end of a strip would still be felt."""
        give = self.give(thickness, E, poisson)
        least = LEAST_LENGTH * give
        if not self.holds(give):
            bound = f"at least {least:.2g} mm to hold a strip {thickness:g} mm thick"
            raise validation_error("print.clamp_mm", self.length, "mm", bound, "take a thinner sheet, or clamp more")


def unbonded_loss(length: float, give: float, unbonded: float) -> float:
    """Return the fraction of K that is lost where the last part [mm] of the glue at each shoulder does not hold.

    `length` is the free length of the leaf, `give` the 1 / beta of a clamp [mm].
    """
    half = 0.5 * length
    return 1.0 - (half_compliance(half, give) / half_compliance(half + unbonded, give))


def half_compliance(half: float, give: float) -> float:
    """Return the deflection of half a leaf under a unit force at its middle, over 1 / EI [mm^3]."""
    return half**3 / 3.0 + half**2 * give + half * give**2 + 0.5 * give**3


def clamp_share(length: float, give: float) -> float:
    """Return d ln K / d ln E of what clamps a strip [1], print and glue, for a free length and a give [mm].

    FE of two designs has 0.88 to 1.0 of it, three parts of five or more of them in the print.
    """
    return 2.0 * give / (length + 2.0 * give)


class ScatterCause(NamedTuple):
    """A cause of the scatter of K: its name, two sigma as a fraction of K, and whether both springs share it."""

    name: str
    size: float
    is_common: bool


@dataclass(frozen=True, kw_only=True)
class StripScatter:
    """How well the numbers of a strip are known, each two sigma: fractions [1], but lengths [mm]."""

    thickness: float
    modulus: float
    width: float
    length: float
    glue_edge: float
    print_modulus: float
    glue_modulus: float

    def causes(self, length: float, give: float) -> Iterator[ScatterCause]:
        """Yield each cause of the scatter of K for a free length and a give [mm].

        K is proportional to (length + 2 give)^-3, and the give to the cube root of the print's modulus over the
        strip's. The two shoulders are independent of each other.
        """
        in_clamps = clamp_share(length, give)
        yield ScatterCause("sheet thickness", 3.0 * self.thickness, is_common=False)
        yield ScatterCause("modulus", self.modulus, is_common=True)
        yield ScatterCause("strip width", self.width, is_common=False)
        yield ScatterCause("free length", 3.0 * self.length / (length + 2.0 * give), is_common=False)
        at_one_shoulder = 0.5 * unbonded_loss(length, give, self.glue_edge)
        yield ScatterCause("glue edge", math.sqrt(2.0) * at_one_shoulder, is_common=False)
        yield ScatterCause("print in the clamps", in_clamps * self.print_modulus, is_common=True)
        yield ScatterCause("glue in the clamps", GLUE_FRACTION * in_clamps * self.glue_modulus, is_common=True)
