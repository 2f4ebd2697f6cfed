"""A CalculiX deck of the half housing in its mount, with a force on each tip, for an independent check."""

from pathlib import Path

import numpy as np

from cad.parts.pin import pin_compliance
from pipeline.springs.fitted_springs import FittedSprings
from pipeline.storage.deck import GROUND, Deck, LinearStep, boundary_sets, elements_of
from solve.housing.clamped_half import HOLES, PRESS_AXIS, SIDES, ClampedHalf
from solve.housing.stiffness import SPRINGS, leaf_faces, tip_face, tip_means

NAME = "flexure.inp"
KIND = "C3D20R"  # 20-node hexahedra with 2^3 Gauss points, as in the solver of this project
_SYMMETRY = "symmetry"
_HEADING = """\
The half y >= 0 of a housing in its mount: N, mm, MPa, 20-node hexahedra with 2^3 Gauss points.
Solve it by CalculiX: ccx -i flexure. Step 1 presses the low tip with 1 N, half of it on the half, step 2 the high one.
K [N/mm] is 1 over the third displacement that flexure.dat has for {means}.
Springs are the layers of the mount, integrated over the side face: some between neighbours are negative."""
_SPRING_LINE = "{name}: K = {K:.6g} N/mm within {error:.2g} N/mm by the run."
_PINS = "Pins are left out here: with one, 1 / K is larger by {compliance:.6g} mm/N."


def mean_of(spring: str) -> str:
    """Return the name of the additional node whose displacement u_z is the mean u_z of the tip face of a spring."""
    return f"{tip_face(spring)}_mean"


def write_flexure_deck(springs: FittedSprings, half: ClampedHalf, path: Path) -> None:
    """Write the CalculiX deck of a housing to `path`, so that its stiffness can be checked by another program.

    The comments of the deck state the stiffness K of both springs with error bars, and how to compare it. `half` is the
    finite-element model of half the housing in its mount. Raises OSError if the file cannot be written.
    """
    process = springs.process
    lines = _HEADING.format(means=" and ".join(mean_of(spring).upper() for spring in SPRINGS)).splitlines()
    for name, spring in springs.springs.items():
        lines.append(_SPRING_LINE.format(name=name, K=spring.stiffness, error=spring.error))
    housing = springs.housing
    if housing is not None and housing.pin is not None:
        pin = pin_compliance(housing.pin, process.E_MPa, process.poisson)
        lines.append(_PINS.format(compliance=pin.value))
    path.write_text(flexure_deck(half, process.E_MPa, process.poisson).text(lines), encoding="ascii")


def flexure_deck(half: ClampedHalf, E: float, poisson: float) -> Deck:
    """Return the deck of a half housing [mm] with Young's modulus `E` [MPa], which presses one tip in each step.

    The low tip is pressed first. The force on half a tip is 0.5 N, so the force on the whole tip is 1 N. K [N/mm] is
    therefore 1 divided by the mean displacement u_z [mm] of the tip face. The elastic layers of the mount are replaced
    by springs.
    """
    elements = elements_of(half.basis, KIND)
    boundary_names = (HOLES, SIDES, _SYMMETRY, *map(tip_face, SPRINGS), *map(leaf_faces, SPRINGS))
    sets = boundary_sets(elements, half.basis, boundary_names)
    # Without elastic layers, the mounting holes are fixed. Otherwise the springs end at an additional node that is
    # fixed.
    if half.ground is None:
        fixed_components = {HOLES: (1, 2, 3)}  # components 1 to 3 are x, y and z
    else:
        sets[GROUND] = np.array([elements.count])  # the number of the node after all nodes of the mesh
        fixed_components = {GROUND: (1, 2, 3)}
    # The product of these weights with the displacements is the mean u_z of a tip face. By the principle of virtual
    # work, the same weights are the nodal forces of an even pressure with the resultant 1 N.
    tip_weights = tip_means(half.basis, PRESS_AXIS).T
    means = {
        mean_of(spring): elements.nodal_values(half.basis, weights)
        for spring, weights in zip(SPRINGS, tip_weights, strict=True)
    }
    # In the plane of symmetry, y = 0, the displacement along y (component 2) is 0.
    held = {**fixed_components, _SYMMETRY: (2,)}
    return Deck(
        elements=elements,
        sets=sets,
        E=E,
        poisson=poisson,
        steps=[LinearStep(held=held, loads=0.5 * weights) for weights in means.values()],  # 0.5 N on half a tip
        springs=half.ground,
        means=means,
    )
