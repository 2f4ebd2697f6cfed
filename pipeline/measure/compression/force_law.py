"""The law of the body that is pressed: the force of a fruit between plates over the travel, by its shape."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cad.quantity import LENGTH, Bounds, check_fields, quantity
from cad.theory.hertz import equivalent_radius, plate_stiffness

Floats = NDArray[np.float64]

_HERTZ_HOLDS = 0.1  # of the radius, on each side that is pressed in: Hertz's strain is small up to there
_MEASURE = "measure it on the fruit"
_STRAINS = Bounds(above=0.0, at_most=50.0)


@dataclass(frozen=True, kw_only=True)
class TestGeometry:
    """The fruit and the plates of a test.

    `radius_mm` and `radius_across_mm` are the radii of curvature of the fruit where a plate touches it. `plates` is 2
    for a fruit between two plates, alike at both; 1 where its underside lies in a rigid seat. `strains_percent`, of
    `height_mm`, are those of secant and tangent, the first that of the paper's modulus.
    """

    __test__ = False  # no class of tests, though its name begins so

    height_mm: float = quantity("mm", LENGTH, hint=_MEASURE)
    radius_mm: float = quantity("mm", LENGTH, hint=_MEASURE)
    radius_across_mm: float = quantity("mm", LENGTH, hint=_MEASURE)
    poisson: float = quantity("", Bounds(above=-1.0, below=0.5), hint="0.3 to 0.49 is flesh", default=0.3)
    plate_area_mm2: float = quantity("mm^2", Bounds(above=0.0, at_most=1e6), hint="measure the plate", default=900.0)
    plates: int = 2
    strains_percent: tuple[float, ...] = quantity("%", _STRAINS, hint="for instance 5", default=(5.0, 2.0, 10.0))

    def __post_init__(self) -> None:
        """Refuse numbers that no fruit has."""
        check_fields(self, "modulus")


@dataclass(frozen=True, kw_only=True)
class ForceLaw:
    """F = k D^n of a body that plates have come nearer by D [mm] since the touch, with k = c E / (1 - nu^2).

    `exponent` is n, `stiffness` c [mm^(2 - n)], `deepest` the D up to which the law holds [mm].
    """

    exponent: float
    stiffness: float
    deepest: float

    def depth(self, force: Floats, factor: float) -> Floats:
        """Return D [mm] at forces [N] for a factor k [N/mm^n]."""
        return np.asarray((force / factor) ** (1.0 / self.exponent))


def force_law(body: TestGeometry) -> ForceLaw:
    """Return the law of a convex fruit: Hertz's, as ASAE S368 has it."""
    radius = equivalent_radius(body.radius_mm, body.radius_across_mm)
    return ForceLaw(
        exponent=1.5,
        stiffness=plate_stiffness(radius, body.plates),
        deepest=body.plates * _HERTZ_HOLDS * radius,
    )
