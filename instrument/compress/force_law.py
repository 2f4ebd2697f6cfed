"""The force law of a compressed body: the force as a function of the travel, for its shape, its tools and its flesh."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np

from instrument.compress.pressed_shapes import POINT_CONTACT, BoundingPress, CompressedBody, Plunger
from pipeline.storage.plain import Plain
from pipeline.storage.stopwatch import Count, silent
from sensor.arrays import Floats
from sensor.quantity import Bounds, check_fields, quantity
from sensor.theory.hertz import force_factor
from sensor.theory.soft_tissue import FLESH_LAWS, LARGEST_POISSON
from solve.compression.flesh_law import FleshLaw
from solve.compression.force_curve import CompressionPress, fit_force_curve, force_curve

_STEPS = 400  # number of points of a law
# largest depth of each contact for Hertz's law, as a fraction of the relative radius; beyond it strains are large
_HERTZ_HOLDS = 0.1
_COMPLIANCES = Bounds(at_least=0.0, at_most=1000.0)
_STRAINS = Bounds(above=0.0, at_most=50.0)
POISSON = "Poisson's ratio"
"""The name of its part of the error."""
_MIDWAY = 0.5  # between frictionless tools (0) and tools that grip (1)
_NOMINAL_PARTS = 3  # parts of the work: the nominal law also needs a fine mesh, and costs as much as three variants


@dataclass(frozen=True, kw_only=True)
class TestGeometry:
    """The body and the tools of a compression test.

    Parameters
    ----------
    body : Ellipsoid, CylinderOnSide, CylinderOnEnd or RectangularBlock
        The body that is pressed.
    plunger : Plunger, optional
        The plunger in place of the upper plate.
    plates : int, optional
        2 for a body on a plate, 1 for a body whose underside lies in a rigid seat.
    poisson : float, optional
        Poisson's ratio of the flesh [1].
    poisson_error : float, optional
        Largest error of Poisson's ratio [1].
    plate_area_mm2 : float, optional
        Area of the plate [mm^2], by which the paper divides the force.
    strains_percent : tuple of float, optional
        Strains of the secant and tangent moduli, relative to the height [%]. The first one gives the paper's modulus.
    compliance_um_per_N : float, optional
        Compliance of frame and load cell [um/N], by which the travel is corrected.
    compliance_error_um_per_N : float, optional
        Largest error of this compliance [um/N].

    Raises
    ------
    InputError
        If a number is outside its bounds, or the body cannot be solved with these tools.

    Examples
    --------
    >>> fruit = twintip.Ellipsoid(height_mm=70.0, radius_mm=35.0, radius_across_mm=35.0)
    >>> twintip.TestGeometry(body=fruit, poisson=0.35).plates
    2
    """

    __test__ = False  # not a test class, although pytest would collect it by its name

    body: CompressedBody
    plunger: Plunger | None = None
    plates: int = 2
    poisson: float = quantity(
        "", Bounds(at_least=0.0, at_most=LARGEST_POISSON), hint="flesh has 0.3 to 0.49", default=0.3
    )
    poisson_error: float = quantity("", Bounds(at_least=0.0, at_most=0.2), hint="a usual value is 0.05", default=0.05)
    plate_area_mm2: float = quantity("mm^2", Bounds(above=0.0, at_most=1e6), hint="measure the plate", default=900.0)
    strains_percent: tuple[float, ...] = quantity("%", _STRAINS, hint="write for instance 5", default=(5.0, 2.0, 10.0))
    compliance_um_per_N: float = quantity("um/N", _COMPLIANCES, hint="press steel on steel and measure it", default=0.0)
    compliance_error_um_per_N: float = quantity("um/N", _COMPLIANCES, hint="a tenth of it is usual", default=0.0)

    def __post_init__(self) -> None:
        """Check the numbers, and that the combination of body and tools is solved; raises InputError."""
        check_fields(self, "modulus")
        self.body.sides(self.plunger, self.plates)

    @property
    def height_mm(self) -> float:
        """Return the height of the body [mm]."""
        return 2.0 * self.body.section.half_height


def geometry_data(test: TestGeometry) -> Plain:
    """Return the body and the tools of a test as data of an answer; the sizes of the body are on the top level."""
    return {
        **vars(test.body),
        "poisson": test.poisson,
        "plate_area_mm2": test.plate_area_mm2,
        "plates": test.plates,
        "poisson_error": test.poisson_error,
        "compliance_um_per_N": test.compliance_um_per_N,
        "compliance_error_um_per_N": test.compliance_error_um_per_N,
        "body": test.body.kind,
        "plunger": None if test.plunger is None else asdict(test.plunger),
    }


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceLaw:
    """The force of a body as a function of the travel by which its tools have approached since the touch.

    `forces` [N] at E = 1 MPa belong to `travels` [mm], both (points,). The force begins as travel^`exponent`. `error`
    [1] is the relative error of the curve itself. `others` are laws with another assumption about the test, by the name
    of the assumption.
    """

    exponent: float
    travels: Floats
    forces: Floats
    error: float
    others: Mapping[str, Sequence["ForceLaw"]]

    @property
    def deepest(self) -> float:
        """Return the travel up to which the law holds [mm]."""
        return float(self.travels[-1])

    @property
    def stiffness(self) -> float:
        """Return F / (E D^n) at the end of the law [mm^(2 - n)]."""
        return float(self.forces[-1] / self.travels[-1] ** self.exponent)

    def depth(self, force: Floats, E: float) -> Floats:
        """Return the travel [mm] at a force [N] for a modulus E [MPa]; extrapolated linearly beyond the end."""
        roots = self.forces ** (1.0 / self.exponent)  # the travel is nearly a linear function of these roots
        root = (force / E) ** (1.0 / self.exponent)
        slope = (self.travels[-1] - self.travels[-2]) / (roots[-1] - roots[-2])
        excess = np.maximum(root - roots[-1], 0.0)
        return np.asarray(np.interp(root, roots, self.travels) + slope * excess)


def hertz_law(test: TestGeometry) -> ForceLaw | None:
    """Return the law of ASAE S368 for convex food: Hertz's law of half-spaces, whose modulus is an apparent one.

    The depths of the contacts add up to D = (F / (4/3 E*))^(2/3) sum R^(-1/3). None if no tool touches at a point.
    """
    radii = np.array(test.body.hertz_radii(test.plunger, test.plates))
    if not radii.size:
        return None
    travels = np.array([0.0, _HERTZ_HOLDS * radii.sum()])
    series_radius = float((radii ** (-1.0 / 3.0)).sum()) ** -3  # of a single contact with the same law
    stiffness = force_factor(1.0 / (1.0 - test.poisson**2), series_radius)
    return ForceLaw(
        exponent=POINT_CONTACT, travels=travels, forces=stiffness * travels**POINT_CONTACT, error=0.0, others={}
    )


def solved_law(test: TestGeometry, count: Count = silent) -> ForceLaw:
    """Return the law of a body that is compressed at finite strain, with laws of other assumptions for its error.

    At equal force the travels of its sides add up. The friction of the tools is midway between none and full grip. The
    other assumptions are another constitutive law of the flesh, another Poisson's ratio, no friction and full grip, and
    bounds of a simplified body. `count` is called with the number of finished parts of the work and their total. Raises
    SolveError if no equilibrium is found.
    """
    sides = [replace(side, law=FleshLaw(poisson=test.poisson)) for side in test.body.sides(test.plunger, test.plates)]

    def with_flesh(flesh: FleshLaw) -> ForceLaw:
        return _combine_sides(sides, [_scaled_forces(side, replace(side, law=flesh)) for side in sides])

    # Poisson's ratio is increased by its error, unless the flesh would be too nearly incompressible.
    increased = test.poisson + test.poisson_error
    poisson = increased if increased <= LARGEST_POISSON else max(test.poisson - test.poisson_error, 0.0)

    def with_bounds(presses: Sequence[BoundingPress]) -> ForceLaw:
        forces = [factor * _scaled_forces(side, press) for side, (press, factor) in zip(sides, presses, strict=True)]
        return _combine_sides(sides, forces)

    def with_grip(grip: float) -> ForceLaw:
        return _combine_sides(sides, [_scaled_forces(side, side, grip) for side in sides])

    variants: dict[str, list[Callable[[], ForceLaw]]] = {
        "law of flesh": [partial(with_flesh, FleshLaw(name=name, poisson=test.poisson)) for name in FLESH_LAWS[1:]],
        POISSON: [partial(with_flesh, FleshLaw(poisson=poisson))],
        "friction": [partial(with_grip, grip) for grip in (0.0, 1.0)],
    }
    for name, bounds in test.body.bounds(sides).items():
        variants[name] = [partial(with_bounds, presses) for presses in bounds]
    parts = _NOMINAL_PARTS + sum(map(len, variants.values()))
    count(0, parts)
    nominal = with_grip(_MIDWAY)
    others: dict[str, list[ForceLaw]] = {name: [] for name in variants}
    for name, solves in variants.items():
        for solve in solves:
            count(_NOMINAL_PARTS + sum(map(len, others.values())), parts)
            others[name].append(solve())
    return replace(nominal, error=max(force_curve(side).error for side in sides), others=others)


def _scaled_forces(side: CompressionPress, variant: CompressionPress, grip: float = _MIDWAY) -> Floats:
    """Return the forces [N] of one side at its travels, multiplied by the relative change of a `variant` of the press.

    `grip` is the friction of the variant, from frictionless tools (0) to tools that grip (1). Only the side itself is
    solved on a fine mesh. The change comes from coarse meshes, whose errors nearly cancel in the ratio.
    """
    travels = _travels(side)
    nonzero = np.maximum(travels, travels[1])  # the ratio of two zero forces is undefined
    frictionless = fit_force_curve(variant).force(nonzero)
    gripping = fit_force_curve(replace(variant, grips=True)).force(nonzero)
    change = (frictionless + grip * (gripping - frictionless)) / fit_force_curve(side).force(nonzero)
    return np.asarray(force_curve(side).force(travels) * change)


def _combine_sides(sides: Sequence[CompressionPress], forces: Sequence[Floats]) -> ForceLaw:
    """Return the law of a body whose sides carry the same force, so that their travels add up.

    `forces` [N] are the forces of each side at its travels. The law ends at the largest force that all sides reach.
    """
    exponent = max(side.exponent for side in sides)
    largest = min(float(force[-1]) for force in forces)
    # The travels are nearly linear functions of these roots, which are dense near the touch.
    roots = np.linspace(0.0, 1.0, _STEPS) ** 2 * largest ** (1.0 / exponent)
    travels = np.zeros(_STEPS)
    for force, side in zip(forces, sides, strict=True):
        travels += np.interp(roots, force ** (1.0 / exponent), _travels(side))
    return ForceLaw(exponent=exponent, travels=travels, forces=roots**exponent, error=0.0, others={})


def _travels(side: CompressionPress) -> Floats:
    """Return the travels of one side [mm] at which its forces are tabulated, dense near the touch."""
    return np.asarray(np.linspace(0.0, 1.0, _STEPS) ** 2 * side.deepest)
