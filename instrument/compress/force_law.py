"""The force law of a compressed body: its force as a function of the travel, for given tools and a given flesh."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np

from instrument.compress.pressed_shapes import KINDS, POINT_CONTACT, BoundingPress, CompressedBody, Plunger
from pipeline.storage.plain import Plain
from pipeline.storage.stopwatch import Count, ignore_progress
from sensor.arrays import Floats
from sensor.quantity import Bounds, check_fields, check_type, quantity
from sensor.theory.hertz import force_factor
from sensor.theory.soft_tissue import FLESH_LAWS, LARGEST_POISSON
from solve.compression.flesh_law import FleshLaw
from solve.compression.force_curve import CompressionPress, fit_force_curve, force_curve

_POINTS = 400  # number of points of a force law
_HERTZ_LIMIT = 0.1  # largest depth of a contact, relative to its radius, at which Hertz's small-strain law is used
_COMPLIANCES = Bounds(at_least=0.0, at_most=1000.0)
_STRAINS = Bounds(above=0.0, at_most=50.0)
POISSON = "Poisson's ratio"
"""Name of the error share that is due to Poisson's ratio."""
_HALF_FRICTION = 0.5  # midway between frictionless tools (0) and tools without slip (1)
_NOMINAL_PARTS = 3  # cost of the nominal law in units of one variant; only the nominal law needs a fine mesh


@dataclass(frozen=True, kw_only=True)
class TestGeometry:
    """The body and the tools of a compression test.

    Parameters
    ----------
    body : Ellipsoid, CylinderOnSide, CylinderOnEnd or RectangularBlock
        The body that is pressed.
    plunger : Plunger, optional
        The plunger that presses the body instead of the upper plate.
    plates : int, optional
        2 for a body that lies on a plate, 1 for a body whose underside lies in a rigid seat.
    poisson : float, optional
        Poisson's ratio of the flesh [1].
    poisson_error : float, optional
        Largest error of Poisson's ratio [1].
    plate_area_mm2 : float, optional
        Area of the plate [mm^2]. The paper's modulus is the force divided by this area, divided by the strain.
    strains_percent : sequence of float, optional
        Strains at which secant and tangent moduli are computed, relative to the height [%]. The secant modulus at the
        first strain is the paper's modulus.
    compliance_um_per_N : float, optional
        Compliance of frame and load cell [um/N]. Their deflection is subtracted from the travel.
    compliance_error_um_per_N : float, optional
        Largest error of this compliance [um/N].

    Raises
    ------
    InputError
        If a number is outside its bounds, or if there is no solution for this body with these tools.

    Examples
    --------
    >>> fruit = twintip.Ellipsoid(height_mm=70.0, radius_mm=35.0, radius_across_mm=35.0)
    >>> twintip.TestGeometry(body=fruit, poisson=0.35).plates
    2
    """

    __test__ = False  # prevents pytest from collecting this class, whose name begins with Test

    body: CompressedBody
    plunger: Plunger | None = None
    plates: int = quantity(
        "1", Bounds(at_least=1, at_most=2), hint="write 1 for a body in a rigid seat, and else 2", default=2
    )
    poisson: float = quantity(
        "",
        Bounds(at_least=0.0, at_most=LARGEST_POISSON),
        hint="Poisson's ratio of fruit flesh is 0.3 to 0.49",
        default=0.3,
    )
    poisson_error: float = quantity("", Bounds(at_least=0.0, at_most=0.2), hint="a usual value is 0.05", default=0.05)
    plate_area_mm2: float = quantity("mm^2", Bounds(above=0.0, at_most=1e6), hint="measure the plate", default=900.0)
    strains_percent: tuple[float, ...] = quantity("%", _STRAINS, hint="write for instance 5", default=(5.0, 2.0, 10.0))
    compliance_um_per_N: float = quantity(
        "um/N", _COMPLIANCES, hint="press steel on steel to measure the compliance", default=0.0
    )
    compliance_error_um_per_N: float = quantity(
        "um/N", _COMPLIANCES, hint="a tenth of the compliance is usual", default=0.0
    )

    def __post_init__(self) -> None:
        """Raise InputError if a number is outside its bounds, or if body and tools cannot be combined."""
        bodies = ", ".join(dict.fromkeys(kind.__name__ for kind in KINDS.values()))
        check_type("body", self.body, CompressedBody, f"one of {bodies}", "make one of the sizes of the body")
        if self.plunger is not None:
            check_type("plunger", self.plunger, Plunger, "a Plunger", "make one, as in twintip.Plunger(radius_mm=4.0)")
        check_fields(self, "modulus")
        self.body.sides(self.plunger, self.plates)

    @property
    def height_mm(self) -> float:
        """Return the height of the body [mm]."""
        return 2.0 * self.body.section.half_height


def geometry_data(test: TestGeometry) -> Plain:
    """Return the body and the tools of a test as JSON data."""
    return {
        **vars(test.body),  # the sizes of the body, one key for each
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
    """The force on a body as a function of the travel, the distance by which its tools have approached since contact.

    `forces` [N] at `travels` [mm], both (points,), are for E = 1 MPa; the force is proportional to E. For small travels
    the force is proportional to travel^`exponent`. `error` [1] is the relative error of the numerical solution.
    `variants` holds the laws that result from other assumptions about the test, keyed by the name of the assumption.
    """

    exponent: float
    travels: Floats
    forces: Floats
    error: float
    variants: Mapping[str, Sequence["ForceLaw"]]

    @property
    def deepest(self) -> float:
        """Return the largest travel in the law [mm]."""
        return float(self.travels[-1])

    @property
    def stiffness(self) -> float:
        """Return F / (E D^n) at the largest travel D, with the exponent n of the law [mm^(2 - n)]."""
        return float(self.forces[-1] / self.travels[-1] ** self.exponent)

    def depth(self, force: Floats, E: float) -> Floats:
        """Return the travel [mm] at each force [N] for a modulus E [MPa]; beyond the last point it is extrapolated."""
        # The travel is almost linear in the n-th root of the force, so it is interpolated at this root.
        roots = self.forces ** (1.0 / self.exponent)
        root = (force / E) ** (1.0 / self.exponent)
        end_slope = (self.travels[-1] - self.travels[-2]) / (roots[-1] - roots[-2])
        excess = np.maximum(root - roots[-1], 0.0)
        return np.asarray(np.interp(root, roots, self.travels) + end_slope * excess)


def hertz_force_law(test: TestGeometry) -> ForceLaw | None:
    """Return the force law of ASAE S368 for convex food, which is Hertz's law; its modulus is an apparent modulus.

    The depths of all contacts add up to the travel

        D = (F / (4/3 E*))^(2/3) sum R^(-1/3),    E* = E / (1 - nu^2),

    with the force F and the relative radius R of each contact. Returns None if no tool touches the body at a point.
    """
    radii = np.array(test.body.hertz_radii(test.plunger, test.plates))  # one for each point contact [mm]
    if not radii.size:
        return None
    # Two points suffice, because the law is a power of the travel.
    travels = np.array([0.0, _HERTZ_LIMIT * radii.sum()])
    series_radius = float((radii ** (-1.0 / 3.0)).sum()) ** -3  # radius of a single contact with the same force law
    stiffness = force_factor(1.0 / (1.0 - test.poisson**2), series_radius)
    return ForceLaw(
        exponent=POINT_CONTACT, travels=travels, forces=stiffness * travels**POINT_CONTACT, error=0.0, variants={}
    )


def solve_force_law(test: TestGeometry, count: Count = ignore_progress) -> ForceLaw:
    """Solve the force law of a body that is compressed at finite strain, and the laws that determine its error.

    All sides of the body carry the same force, so their travels add up. The nominal law assumes friction midway between
    frictionless tools and tools without slip. `variants` of the result holds the laws with other assumptions.

    `count` is called with the number of finished parts of the work and with the number of all parts. Raises SolveError
    if no equilibrium is found.
    """
    flesh = FleshLaw(poisson=test.poisson)
    sides = [replace(side, law=flesh) for side in test.body.sides(test.plunger, test.plates)]
    solvers = _law_variants(test, sides)
    parts = _NOMINAL_PARTS + sum(map(len, solvers.values()))
    count(0, parts)
    nominal = _law_with_friction(sides, _HALF_FRICTION)
    finished = _NOMINAL_PARTS
    variants: dict[str, list[ForceLaw]] = {assumption: [] for assumption in solvers}
    for assumption, variant_solvers in solvers.items():
        for solve in variant_solvers:
            count(finished, parts)
            variants[assumption].append(solve())
            finished += 1
    return replace(nominal, error=max(force_curve(side).error for side in sides), variants=variants)


def _law_variants(
    test: TestGeometry, sides: Sequence[CompressionPress]
) -> Mapping[str, Sequence[Callable[[], ForceLaw]]]:
    """Return functions that solve the force law with another assumption, keyed by the name of the assumption.

    The assumptions are other constitutive laws of the flesh, another Poisson's ratio, tools without friction or without
    slip, and bodies that bound a simplified body. `sides` are the presses of the nominal law. The functions defer the
    work, so that the caller can report its progress.
    """

    def with_flesh(flesh: FleshLaw) -> ForceLaw:
        return _combine_sides(sides, [_variant_forces(side, replace(side, law=flesh)) for side in sides])

    def with_bounds(presses: Sequence[BoundingPress]) -> ForceLaw:
        forces = [factor * _variant_forces(side, press) for side, (press, factor) in zip(sides, presses, strict=True)]
        return _combine_sides(sides, forces)

    # Poisson's ratio is increased by its error, unless this would make the flesh almost incompressible.
    poisson = test.poisson + test.poisson_error
    if poisson > LARGEST_POISSON:
        poisson = max(test.poisson - test.poisson_error, 0.0)
    other_laws = FLESH_LAWS[1:]  # the first one is the nominal law
    variants: dict[str, list[Callable[[], ForceLaw]]] = {
        "law of flesh": [partial(with_flesh, FleshLaw(name=name, poisson=test.poisson)) for name in other_laws],
        POISSON: [partial(with_flesh, FleshLaw(poisson=poisson))],
        "friction": [partial(_law_with_friction, sides, friction) for friction in (0.0, 1.0)],
    }
    for simplification, bounds in test.body.bounds(sides).items():
        variants[simplification] = [partial(with_bounds, presses) for presses in bounds]
    return variants


def _law_with_friction(sides: Sequence[CompressionPress], friction: float) -> ForceLaw:
    """Return the force law with `friction` [1] from 0 (frictionless tools) to 1 (tools without slip)."""
    return _combine_sides(sides, [_variant_forces(side, side, friction) for side in sides])


def _variant_forces(side: CompressionPress, variant: CompressionPress, friction: float = _HALF_FRICTION) -> Floats:
    """Return the forces [N] on one side of the body in a `variant` of its press, shape (points,).

    `variant` is the press `side` itself, or this press with other flesh or another section. `friction` [1] is between 0
    (frictionless tools) and 1 (tools without slip); the forces of these two limits are interpolated linearly. Only
    `side` is solved on a fine mesh. The ratio of the forces in `variant` and `side` comes from coarse meshes, whose
    errors nearly cancel in it.
    """
    travels = _travels(side)
    nonzero = np.maximum(travels, travels[1])  # at zero travel both forces are zero, so their ratio is undefined
    frictionless = fit_force_curve(variant).force(nonzero)
    without_slip = fit_force_curve(replace(variant, grips=True)).force(nonzero)
    ratio = (frictionless + friction * (without_slip - frictionless)) / fit_force_curve(side).force(nonzero)
    return np.asarray(force_curve(side).force(travels) * ratio)


def _combine_sides(sides: Sequence[CompressionPress], forces: Sequence[Floats]) -> ForceLaw:
    """Return the force law of a body whose sides carry the same force, so that their travels add up.

    `forces` [N] are the forces of each side at its travels, each (points,). The law ends at the largest force that all
    sides reach. The exponent n of the law is the largest exponent of a side.
    """
    exponent = max(side.exponent for side in sides)
    largest = min(float(force[-1]) for force in forces)
    # The travels are almost linear in the n-th root of the force, so they are interpolated at such roots. The squares
    # make the roots dense near zero.
    roots = np.linspace(0.0, 1.0, _POINTS) ** 2 * largest ** (1.0 / exponent)
    travels = np.zeros(_POINTS)
    for force, side in zip(forces, sides, strict=True):
        travels += np.interp(roots, force ** (1.0 / exponent), _travels(side))
    return ForceLaw(exponent=exponent, travels=travels, forces=roots**exponent, error=0.0, variants={})


def _travels(side: CompressionPress) -> Floats:
    """Return the travels of one side [mm] at which its forces are tabulated; they are dense near zero."""
    return np.asarray(np.linspace(0.0, 1.0, _POINTS) ** 2 * side.deepest)
