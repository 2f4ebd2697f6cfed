"""Fruit with a skin and its error bar, compared with solid models in which the skin consists of elements."""

from collections.abc import Sequence

import numpy as np

from benchmarks.bars.check import ReferenceCheck, make_checks
from benchmarks.harness import Reference
from sensor.design.fruit import Fruit
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance
from solve.fruit.curved_body import STEPS, shape_change
from solve.fruit.footprints import Footprint
from solve.fruit.skin import layer_on, skin_compliance
from solve.fruit.split import LEVELS, footprint_compliance
from solve.halfspace.layered import round_contact
from solve.halfspace.punch import circle_punch, square_punch

MODULI = (0.5, 1.0, 3.5)  # moduli of the flesh [MPa]
DOME = 10.0  # radius of the dome [mm]
LARGEST_ERROR = 3e-3  # relative error allowed here; the bars of a skin are wider, because they cover all tips
WIDEST_RADIUS = 6.0  # largest radius of a contact [mm]
INFO = SolveInfo(method="", dofs=0, seconds=0.0, status="")


def compliances(fruit: Fruit, footprint: Footprint) -> tuple[FruitCompliance, FruitCompliance]:
    """Return the compliances of a fruit under one tip, without its skin and with it."""
    change = np.zeros((1, 1))  # the effect of the fruit's shape, for a single tip
    if fruit.radius_mm is not None:
        change = shape_change(fruit, [footprint], STEPS, along_normals=True).change
    S = footprint_compliance(fruit.equivalent_block, [footprint], LEVELS[0]).S + change
    skinless = FruitCompliance(tips=("tip",), S=S, difference_error=0.0, s11_error=0.0, info=INFO, shape_change=change)
    return skinless, skin_compliance(skinless, fruit, [footprint], along_normals=True)


def skin_checks(fruit: Fruit, radius: float, truth: Reference) -> Sequence[ReferenceCheck]:
    """Return the checks of a round contact of this `radius` [mm], at three moduli of the flesh.

    The first three check the stiffness under a flat circle, relative to its value without a skin [1]. The last three
    check the force on a dome divided by the modulus [mm^2].
    """
    skinless, skinned = compliances(fruit, Footprint(0.0, 0.0, 2.0 * radius, circle_punch))
    true_forces = truth.values[len(MODULI) :]  # these values follow the true ratios
    ratios, forces = [], []
    for E, true_force in zip(MODULI, true_forces, strict=True):
        skinned_compliance = skinned.at(E).S[0, 0]
        ratios.append(float(skinless.S[0, 0] / skinned_compliance))
        forces.append(_force_over_modulus(fruit, E, radius, skinned_compliance, true_force))
    names = [f"{quantity} at {E:g} MPa" for quantity in ("stiffness", "force") for E in MODULI]
    return _check_skin(names, ratios + forces, skinned, truth)


def _force_over_modulus(fruit: Fruit, E: float, radius: float, compliance: float, true_force: float) -> float:
    """Return the force on a dome divided by the modulus E of the flesh [mm^2], for a fruit with a skin.

    The travel of the dome is such that its contact would have this `radius` [mm] without a skin. `compliance` [1/mm] is
    the compliance of the fruit under a flat circle of the same radius, times E. The deflection of the finite body is
    computed from the true force over the modulus, `true_force` [mm^2], so that only the local contact is checked.
    """
    curvature = 1.0 / DOME + (1.0 / fruit.radius_mm if fruit.radius_mm else 0.0)  # relative curvature [1/mm]
    depth = radius**2 * curvature  # by Hertz's law [mm]
    contact = round_contact(layer_on(fruit, E), WIDEST_RADIUS)
    # What the finite body adds to the compliance of a layered half-space, times E [1/mm].
    body_compliance = compliance - 1.0 / contact.flat_stiffness(radius)
    # The table of contacts takes the depth times the radius of curvature, and returns the force times this radius.
    scaled_depth = np.array((depth - body_compliance * true_force) / curvature)
    _, scaled_force, _ = contact.press(scaled_depth)
    return float(scaled_force) * curvature


def cube_checks(fruit: Fruit, truth: Reference) -> Sequence[ReferenceCheck]:
    """Return the checks of the stiffness under a cube at three moduli, relative to its value without a skin [1]."""
    skinless, skinned = compliances(fruit, Footprint(0.0, 0.0, 1.0, square_punch))
    ratios = [float(skinless.S[0, 0] / skinned.at(E).S[0, 0]) for E in MODULI]
    return _check_skin([f"stiffness at {E:g} MPa" for E in MODULI], ratios, skinned, truth)


def _check_skin(
    names: Sequence[str], values: Sequence[float], skinned: FruitCompliance, truth: Reference
) -> Sequence[ReferenceCheck]:
    """Return the checks of values with the error bar of the skinned compliance, limited to `LARGEST_ERROR`."""
    return make_checks(names, values, (min(skinned.s11_error, LARGEST_ERROR),) * len(names), truth)
