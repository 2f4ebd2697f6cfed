"""The law of the body that is pressed: the force of a fruit between plates over the travel, by its shape."""

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cad.quantity import LENGTH, Bounds, check_fields, quantity
from cad.theory.hertz import equivalent_radius, plate_stiffness
from cad.theory.soft_tissue import FLESH_LAWS, LARGEST_POISSON, FleshLawName
from solve.arrays import Floats
from solve.compression.body import RoundSection
from solve.compression.force_curve import ForceCurve, Press, fitted_curve, force_curve
from solve.large_strain.flesh_law import FleshLaw

_POINT_CONTACT = 1.5  # exponent of Hertz's law, with which every convex fruit begins
_DEEPEST = 0.15  # of half the height, or of the radius: most fruit have failed before
_LEAST_TRAVEL = 0.01  # of the deepest: below, laws of flesh agree
_STEPS = 400
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
    poisson: float = quantity(
        "", Bounds(at_least=0.0, at_most=LARGEST_POISSON), hint="0.3 to 0.49 is flesh", default=0.3
    )
    plate_area_mm2: float = quantity("mm^2", Bounds(above=0.0, at_most=1e6), hint="measure the plate", default=900.0)
    plates: int = 2
    strains_percent: tuple[float, ...] = quantity("%", _STRAINS, hint="for instance 5", default=(5.0, 2.0, 10.0))

    def __post_init__(self) -> None:
        """Refuse numbers that no fruit has."""
        check_fields(self, "modulus")


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceLaw:
    """The force at E = 1 MPa, `forces` [N], over the `travels` by which plates have come nearer since the touch [mm].

    It begins as travel^`exponent`. `error` [1] is how far the curve itself may be off, `departures` [1], of the shape
    of the travels, how far it moves where what is not known of a test is otherwise, each by its name.
    """

    exponent: float
    travels: Floats
    forces: Floats
    error: float
    departures: Mapping[str, Floats]

    @property
    def deepest(self) -> float:
        """Return the travel up to which the law holds [mm]."""
        return float(self.travels[-1])

    @property
    def stiffness(self) -> float:
        """Return F / (E D^n) at the end of the law [mm^(2 - n)]."""
        return float(self.forces[-1] / self.travels[-1] ** self.exponent)

    def depth(self, force: Floats, E: float) -> Floats:
        """Return the travel [mm] at forces [N] of flesh of a modulus [MPa]; on as at the end beyond it."""
        roots = self.forces ** (1.0 / self.exponent)  # the travel is nearly straight over them
        root = (force / E) ** (1.0 / self.exponent)
        slope = (self.travels[-1] - self.travels[-2]) / (roots[-1] - roots[-2])
        beyond = np.maximum(root - roots[-1], 0.0)
        return np.asarray(np.interp(root, roots, self.travels) + slope * beyond)

    def shares(self, travel: float) -> dict[str, float]:
        """Return what a modulus found up to a travel [mm] owes to each thing that is not known [1]."""
        shares = {name: float(np.interp(travel, self.travels, curve)) for name, curve in self.departures.items()}
        return {"force curve": self.error, **shares}


def hertz_law(body: TestGeometry) -> ForceLaw:
    """Return the law of ASAE S368 for convex food: Hertz's, of two half-spaces; its modulus is an apparent one."""
    radius = equivalent_radius(body.radius_mm, body.radius_across_mm)
    travels = np.array([0.0, body.plates * _HERTZ_HOLDS * radius])
    stiffness = plate_stiffness(radius, body.plates) / (1.0 - body.poisson**2)
    return ForceLaw(exponent=_POINT_CONTACT, travels=travels, forces=stiffness * travels**1.5, error=0.0, departures={})


def solved_law(body: TestGeometry) -> ForceLaw:
    """Return the law of a fruit that plates press at finite strain; raises SolveError.

    Two unlike radii are taken as their equivalent one. Plates share the travel; of a seat, which gives nothing, the
    fruit takes it on one side.
    """
    half_height = 0.5 * body.height_mm
    radius = equivalent_radius(body.radius_mm, body.radius_across_mm) / half_height
    curve = _unit_curve(radius, body.poisson)
    nominal = _unit_curve(radius, body.poisson, accurate=False)
    travels = np.linspace(0.0, 1.0, _STEPS) ** 2 * curve.deepest
    inner = np.maximum(travels, _LEAST_TRAVEL * curve.deepest)

    def departure(*others: ForceCurve) -> Floats:
        """Return how far curves are from the nominal one at most [1]."""
        ratios = np.array([other.force(inner) for other in others]) / nominal.force(inner)
        return np.asarray(np.abs(ratios - 1.0).max(axis=0))

    laws = [_unit_curve(radius, body.poisson, name, accurate=False) for name in FLESH_LAWS[1:]]
    grip = _unit_curve(radius, body.poisson, accurate=False, grips=True)
    return ForceLaw(
        exponent=_POINT_CONTACT,
        travels=body.plates * half_height * travels,
        forces=half_height**2 * curve.force(travels),
        error=curve.error,
        departures={"law of flesh": departure(*laws), "friction": departure(grip)},
    )


@functools.lru_cache(maxsize=64)
def _unit_curve(
    radius: float, poisson: float, law: FleshLawName = "neo-hooke", *, accurate: bool = True, grips: bool = False
) -> ForceCurve:
    """Return the force on one side of a fruit of half height 1, over the travel of its plate towards the middle."""
    deepest = _DEEPEST * min(1.0, radius)
    press = Press(
        section=RoundSection(half_height=1.0, radius=radius),
        law=FleshLaw(name=law, poisson=poisson),
        deepest=deepest,
        contact=math.sqrt(radius * deepest),
        exponent=_POINT_CONTACT,
        grips=grips,
    )
    return force_curve(press) if accurate else fitted_curve(press)
