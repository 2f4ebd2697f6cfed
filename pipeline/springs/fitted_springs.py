"""The springs as printed: their leaves fitted to the targets, or the reason why the process cannot print them."""

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property, partial
from typing import Literal

import numpy as np

from cad.parts.housing import Housing, PartSize
from cad.parts.layout import housing_for
from cad.parts.pin import pin_mass
from mesh.session import MeshError
from pipeline.options import RunOptions
from pipeline.springs.leaf_lengths import TOLERANCE, FittedHousing, HousingSolver, fit_lengths
from pipeline.springs.mounts import solve_lateral_compliance
from pipeline.springs.sizing import SpringSizing
from pipeline.springs.spring import MadeSpring
from pipeline.storage.cache import load_or_compute
from sensor.arrays import Floats
from sensor.design.parameters import Design
from sensor.design.printability import Printable, check_printable
from sensor.design.processes import Process
from sensor.design.signal_path import SpringToRead
from sensor.design.tips import Attitude, Tips
from sensor.quantity import STANDARD_GRAVITY, Estimate, InputError
from sensor.record import Record
from sensor.theory.creep import CreepLaw
from sensor.theory.two_spring_law import Springs
from solve.contact.linear_response import spring_compliance
from solve.contact.scene import LateralCompliance
from solve.linear import SolveError

SpringAccuracy = Literal["sized", "leaning", "fitted"]
BeginSolid = Callable[[Housing, tuple[float, ...]], Future[PartSize]]
"""A function that starts making the solid of a housing for given deflections [mm], and returns a future of its size."""

GRAVITY = 1e-6 * STANDARD_GRAVITY  # specific weight [N/mm^3] of a material with a density of 1 g/cm^3


def printable_leaves(
    design: Design, sizing: SpringSizing, lengths_mm: tuple[float, ...] | None = None
) -> dict[str, Printable]:
    """Check for each spring whether the process can print its leaves; return the results by the name of the spring.

    A result also holds the length of the leaves, and the reason if they cannot be printed. `lengths_mm` are the leaf
    lengths [mm], low spring first. By default they follow from the beam law.
    """
    low, high = check_printable(design, sizing.springs, sizing.K_m_max, lengths_mm, sizing.sizing_stiffness_ratio)
    return {"low": low, "high": high}


@dataclass(frozen=True, kw_only=True, repr=False)
class FittedSprings(Record):
    """The springs by name, low first, with their process, their deflections at full travel [mm] and their housing.

    Each of the two springs represents all tips on springs of its kind. `printable` holds for each spring whether the
    process can print it. `fitted` is the housing with its solution, or None if no housing is solved.

    `ideal` springs have exactly the stiffness for which they were sized. Ideal springs are not printed, and
    `ideal_offsets_mm` are the heights of their tips relative to the foremost tip. `plate_sideways` is the lateral
    compliance of the tips on one plate. This compliance is None until it is solved. For flat tips on a flat fruit it
    stays None, because their forces are not inclined.
    """

    springs: dict[str, MadeSpring]
    printable: dict[str, Printable]
    process: Process
    deflections: tuple[float, ...]
    fitted: FittedHousing | None
    tips: Tips = field(default_factory=Tips)
    ideal: bool = False
    ideal_offsets_mm: tuple[float, ...] = ()
    plate_sideways: LateralCompliance | None = None

    @property
    def housing(self) -> Housing | None:
        """Return the housing, or None if a spring cannot be printed."""
        return None if self.fitted is None else self.fitted.housing

    @property
    def known(self) -> bool:
        """Return whether the stiffnesses are known, by finite elements (FE) or because the springs are ideal."""
        return self.ideal or self.fitted is not None

    @property
    def monolithic(self) -> bool:
        """Return whether the springs are printed in one piece, without glued pins."""
        return self.housing is None or self.housing.pin is None

    @property
    def stiffnesses(self) -> Springs:
        """Return the stiffnesses by FE [N/mm], or the targets if nothing is printed."""
        K_l, K_h = (spring.stiffness for spring in self.springs.values())
        return Springs(K_l=K_l, K_h=K_h)

    @property
    def errors(self) -> tuple[float, ...]:
        """Return the error of each stiffness [N/mm]; 0 for a target."""
        return tuple(spring.error for spring in self.springs.values())

    @property
    def creep(self) -> CreepLaw:
        """Return the creep law of the print material."""
        return self.process.creep

    def undecided(self, reason: str) -> "FittedSprings":
        """Return a copy of the springs whose verdicts on printability are undecided; the user is shown the `reason`."""
        verdicts = {name: replace(verdict, passed=None, reason=reason) for name, verdict in self.printable.items()}
        return replace(self, printable=verdicts)

    @cached_property
    def as_pair(self) -> "FittedSprings":
        """Return the springs of a sensor that has only one tip on each of the two springs."""
        return replace(self, tips=self.tips.as_pair)

    @property
    def C(self) -> Floats:
        """Return the compliance matrix of the springs under all tips [mm/N], shape (tips, tips).

        Tips on one plate are slightly coupled through its frame. Tips on different plates, and springs without a
        housing, are not coupled.
        """
        if self.fitted is None:
            return spring_compliance(*self.tips.each(*self.stiffnesses.stiffnesses))
        plate_compliance = self.fitted.stiffness.C
        plates = len(self.tips.springs) // len(plate_compliance)
        return np.asarray(np.kron(np.eye(plates), plate_compliance))  # a block for each plate on the diagonal

    @property
    def sideways(self) -> LateralCompliance | None:
        """Return the lateral compliance of all tips under inclined forces; None if it was not solved for a plate.

        Its `compliance` has the shape (tips, tips, 3, 3), with the directions x, y, z on the last two axes; z is the
        press axis. Tips on different plates are not coupled. Each plate is rotated by 180 degrees about z relative to
        the previous plate, which reverses the signs of x and y.
        """
        if self.plate_sideways is None:
            return None
        tips_per_plate = len(self.plate_sideways.compliance)
        tips = len(self.tips.springs)
        compliance = np.zeros((tips, tips, 3, 3))
        signs = np.array([1.0, 1.0, 1.0])  # signs of x, y and z on a plate, relative to the first plate
        for first in range(0, tips, tips_per_plate):
            plate = slice(first, first + tips_per_plate)
            compliance[plate, plate] = self.plate_sideways.compliance * np.outer(signs, signs)
            signs = signs * [-1.0, -1.0, 1.0]
        return replace(self.plate_sideways, compliance=compliance)


def springs_for(
    design: Design,
    sizing: SpringSizing,
    accuracy: SpringAccuracy,
    tolerance: float = TOLERANCE,
    begin_solid: BeginSolid | None = None,
) -> FittedSprings:
    """Return the springs of a design at one of three levels of accuracy, from the cheapest to the most expensive.

    - "sized" springs have exactly the stiffness that the targets or the design require.
    - "leaning" springs of sensors with domes also have the lateral compliance of their housing. It is computed on one
      rough mesh, with the leaf lengths of the beam law.
    - "fitted" springs have leaves whose stiffness by FE meets the target within a relative `tolerance` [1].
      `with_lateral_compliance` adds their lateral compliance.

    `begin_solid` is called with each housing that may be the final one. A line of tips has no housing, so its springs
    are ideal. If the beam law shows that a spring cannot be printed, nothing is solved. If meshing or fitting fails,
    the verdicts on all springs are undecided, and no error is raised.
    """
    process = design.process
    has_housing = design.tips.tip_layout.has_housing
    springs = _unsolved_springs(design, sizing, ideal=accuracy != "fitted" or not has_housing)
    # the lateral compliance of "leaning" springs matters only under domes
    needs_housing = accuracy == "fitted" or (accuracy == "leaning" and design.tips.tip_shape.obeys_hertz)
    is_unprintable = any(leaves.passed is False for leaves in springs.printable.values())
    if is_unprintable or not (has_housing and needs_housing):
        return springs
    lengths = tuple(leaves.length_mm for leaves in springs.printable.values())  # by the beam law [mm]
    targets = sizing.springs.stiffnesses  # low then high [N/mm]
    try:
        housing = housing_for(design, process, lengths, springs.deflections)
        if accuracy == "leaning":
            plate_sideways = solve_lateral_compliance(housing, process.E_MPa, process.poisson, targets, rough=True)
            return replace(springs, plate_sideways=plate_sideways)
        solver = HousingSolver(process.E_MPa, process.poisson, _with_deflections(begin_solid, springs.deflections))
        fitted = _fit_housing(housing, targets, solver, tolerance)
    except (InputError, MeshError, SolveError) as error:
        return springs.undecided(str(error))
    return _add_solution(springs, design, sizing, fitted)


def _with_deflections(
    begin_solid: BeginSolid | None, deflections: tuple[float, ...]
) -> Callable[[Housing], Future[PartSize]] | None:
    """Return `begin_solid` as a function of the housing only, with the given deflections [mm]; None stays None.

    A solver of housings does not know the deflections.
    """
    if begin_solid is None:
        return None
    return lambda housing: begin_solid(housing, deflections)


def _unsolved_springs(design: Design, sizing: SpringSizing, *, ideal: bool) -> FittedSprings:
    """Return the springs as sized: with their target stiffnesses, and with printability checked by the beam law.

    `ideal` springs have exactly these stiffnesses. Other springs are solved later.
    """
    return FittedSprings(
        springs={"low": MadeSpring(target=sizing.springs.K_l), "high": MadeSpring(target=sizing.springs.K_h)},
        printable=printable_leaves(design, sizing),
        process=design.process,
        deflections=sizing.deflections(design.full_travels_mm),
        fitted=None,
        tips=design.tips,
        ideal=ideal,
    )


def with_lateral_compliance(springs: FittedSprings, design: Design, options: RunOptions) -> FittedSprings:
    """Return the springs with the lateral compliance of their plate; unchanged if no force on the tips is inclined.

    Forces are inclined under domes and on a curved fruit. If `options` request a rough answer, the compliance is solved
    on a rough mesh. The result is cached on disk. If it cannot be solved, the verdicts on the springs are undecided,
    and no error is raised. The housing does not depend on this compliance, so the solids can be started before this
    function is called.
    """
    fitted = springs.fitted
    is_inclined = design.tips.tip_shape.obeys_hertz or design.fruit.radius_mm is not None
    if fitted is None or not is_inclined:
        return springs
    E = springs.process.E_MPa
    poisson = springs.process.poisson
    K = fitted.stiffness.K
    rough = options.rough
    # all inputs of the solution, from which the key of the cache is made
    inputs = {"housing": asdict(fitted.housing), "E": E, "poisson": poisson, "K": K, "rough": rough}
    solve = partial(solve_lateral_compliance, fitted.housing, E, poisson, K, rough=rough)
    try:
        return replace(springs, plate_sideways=load_or_compute("sideways give", inputs, solve, LateralCompliance))
    except (MeshError, SolveError) as error:
        return springs.undecided(str(error))


def _fit_housing(guess: Housing, targets: tuple[float, ...], solver: HousingSolver, tolerance: float) -> FittedHousing:
    """Fit the leaves of the housing `guess` to the target stiffnesses [N/mm], low then high.

    The result is cached on disk. Raises the same errors as `fit_lengths`.
    """
    # all inputs of the fit, from which the key of the cache is made
    inputs = {
        "guess": asdict(guess),
        "targets": targets,
        "E": solver.E,
        "poisson": solver.poisson,
        "tolerance": tolerance,
    }
    return load_or_compute("flexures", inputs, partial(fit_lengths, guess, targets, solver, tolerance), FittedHousing)


def _add_solution(springs: FittedSprings, design: Design, sizing: SpringSizing, fitted: FittedHousing) -> FittedSprings:
    """Return the springs with stiffness and root strain by FE, and with printability checked for the fitted lengths.

    `fitted` is the housing with its solution. The root strain is the strain at full travel on the firmest fruit. A
    spring that is not deflected has the strain 0 and no safety factor.
    """
    solution = fitted.stiffness
    arms = fitted.housing.arms  # the low spring first, as in all arrays of the solution
    springs_by_name = {}
    for i, arm in enumerate(arms):
        # the force, K times the deflection [N], is multiplied by the strain per force
        strain = solution.K[i] * springs.deflections[i] * solution.strain_per_N[i]
        springs_by_name[arm.name] = replace(
            springs.springs[arm.name],
            K=solution.K[i],
            K_error=solution.error[i],
            flexure=arm.flexure,
            root_strain=strain,
            root_strain_error=solution.strain_error[i] if strain else 0.0,
            safety_factor=springs.process.strain_limit / strain if strain else None,
            dofs=solution.info.dofs,
            seconds=solution.info.seconds,
        )
    printable = printable_leaves(design, sizing, tuple(arm.flexure.length for arm in arms))
    return replace(springs, springs=springs_by_name, printable=printable, fitted=fitted)


def springs_to_read(springs: FittedSprings) -> tuple[SpringToRead, ...]:
    """Return the stiffness [N/mm] and the deflection at full travel [mm] of each spring, as input for a read-out."""
    pairs = zip(springs.springs.items(), springs.deflections, strict=True)
    return tuple(
        SpringToRead(name=name, K=spring.stiffness, deflection=deflection) for (name, spring), deflection in pairs
    )


def weight_sag(springs: FittedSprings, attitude: Attitude) -> tuple[Estimate, ...]:
    """Return the displacement of each tip towards the fruit due to the weight of its parts [mm], with its error.

    The displacement is positive if the sensor presses down, and negative if it presses up. If the sensor is held
    sideways, its weight acts across the press, in an unknown direction. Weight along the plate may then move a tip
    either way. The displacement is therefore 0, and its error is the largest movement. By symmetry, weight across the
    plate does not move the tip. The result has one entry for each spring, low first, and is empty without a housing.
    """
    fitted = springs.fitted
    if fitted is None:
        return ()
    density = springs.process.density_g_per_cm3
    specific_weight = GRAVITY * density  # [N/mm^3]
    solution = fitted.stiffness  # the sags are for a specific weight of 1 N/mm^3, and their errors are relative
    if attitude == "side":
        return tuple(Estimate(0.0, specific_weight * abs(sag), "mm") for sag in solution.weight_sag_lengthwise)
    pin = fitted.housing.pin
    pin_weight = 0.0 if pin is None else GRAVITY * pin_mass(pin, density)
    sign = 1.0 if attitude == "down" else -1.0
    sags = []
    for unit_sag, K, error in zip(solution.weight_sag, solution.K, solution.weight_sag_error, strict=True):
        sag = specific_weight * unit_sag + pin_weight / K  # due to the weight of the flexure, and of a pin at its end
        sags.append(Estimate(sign * sag, error * sag, "mm"))
    return tuple(sags)


def height_difference_down(springs: FittedSprings) -> float:
    """Return the height difference of the tips [mm] that weight causes if the sensor points down.

    A sensor that is held sideways has level tips. Without a housing, the result is 0.
    """
    sags = [sag.value for sag in weight_sag(springs, "down")]
    return max(sags) - min(sags) if sags else 0.0


def tip_height_offsets(springs: FittedSprings, attitude: Attitude) -> tuple[float, ...]:
    """Return the height of each tip relative to the foremost tip [mm], due to the weight of the parts.

    The tips are in the order of the layout. The height is 0 for the foremost tips, and negative for all other tips. The
    result is empty if all tips are level. Ideal springs have no parts, so their offsets are given with them.
    """
    if springs.ideal:
        return springs.ideal_offsets_mm
    sags = [sag.value for sag in weight_sag(springs, attitude)]  # one for each of the two springs
    if not any(sags):
        return ()
    offsets = {spring: sag - max(sags) for spring, sag in zip(springs.springs, sags, strict=True)}
    return tuple(offsets[spring] for spring in springs.tips.springs)  # the kind of spring under each tip
