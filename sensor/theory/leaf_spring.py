"""Dimensions and beam-theory stiffness of a flexure: two parallel leaves that guide a shuttle."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from sensor.quantity import Bounds, check_fields, quantity, validation_error

_POSITIVE = Bounds(above=0.0)
_NOT_NEGATIVE = Bounds(at_least=0.0)
_HINT = "choose another process or other targets"


class LeafProfile(NamedTuple):
    """The cross-section of a leaf [mm]: its depth, its thickness, and the radius of the fillets at its roots."""

    depth: float
    thickness: float
    fillet: float


@dataclass(frozen=True, kw_only=True)
class Flexure:
    """Two equal parallel leaves at a distance `separation` [mm]."""

    thickness: float = quantity("mm", _POSITIVE, hint=_HINT, meaning="thickness of a leaf")
    length: float = quantity("mm", _POSITIVE, hint=_HINT, meaning="length of a leaf, including its fillets")
    depth: float = quantity("mm", _POSITIVE, hint=_HINT, meaning="width of a leaf, which is the depth of the plate")
    separation: float = quantity(
        "mm", _POSITIVE, hint=_HINT, meaning="distance between the two leaves, centre to centre"
    )
    fillet: float = quantity(
        "mm", _NOT_NEGATIVE, hint=_HINT, meaning="radius of the inner corners at the roots of a leaf"
    )

    def __post_init__(self) -> None:
        """Check each field. The fillets must leave a straight part of each leaf, and a gap between the leaves."""
        check_fields(self, "flexure")
        if self.length <= 2.0 * self.fillet:
            bound = f"greater than 2 fillets = {2.0 * self.fillet:g} mm"
            raise validation_error("flexure.length", self.length, "mm", bound, _HINT)
        if self.separation <= self.thickness + 2.0 * self.fillet:
            bound = f"greater than thickness + 2 fillets = {self.thickness + 2.0 * self.fillet:g} mm"
            raise validation_error("flexure.separation", self.separation, "mm", bound, _HINT)

    @property
    def profile(self) -> LeafProfile:
        """Return the depth, the thickness and the fillet radius of the leaves [mm]."""
        return LeafProfile(depth=self.depth, thickness=self.thickness, fillet=self.fillet)


def pair_stiffness(E: float, depth: float, thickness: float, length: float) -> float:
    """Return K = 24 E I / L^3 = 2 E w t^3 / L^3 of two clamped-guided leaves [N/mm from MPa, mm].

    The leaves are Euler-Bernoulli beams with rigid ends: S. Timoshenko, Strength of Materials I, 1930, art. 34.
    """
    return 2.0 * E * depth * (thickness / length) ** 3


def pair_length(E: float, depth: float, thickness: float, stiffness: float) -> float:
    """Return the leaf length [mm] at which a pair has the given stiffness [N/mm]."""
    return thickness * math.cbrt(2.0 * E * depth / stiffness)


def root_strain(thickness: float, length: float, deflection: float) -> float:
    """Return the bending strain 3 t d / L^2 at the root of a clamped-guided leaf [1 from mm]."""
    return 3.0 * thickness * deflection / length**2


def natural_frequency(stiffness: float, shuttle_mass: float, leaf_mass: float) -> float:
    """Return the first natural frequency of a shuttle on a pair of leaves [Hz from N/mm, g].

    `leaf_mass` is the mass of one leaf. By Rayleigh's quotient with the static shape, each leaf contributes 13/35 of
    its mass: S. Timoshenko, Vibration Problems in Engineering, 1937, art. 16.
    """
    mass = shuttle_mass + 2.0 * (13.0 / 35.0) * leaf_mass
    return math.sqrt(1e6 * stiffness / mass) / (2.0 * math.pi)
