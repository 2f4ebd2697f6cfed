"""The tasks of the benchmarks as CalculiX decks, with the elements of `reference.element_study`. Units: N, mm, MPa."""

from typing import Any

import numpy as np

from pipeline.making.flexure_deck import mean_of
from pipeline.storage.deck import Deck, LinearStep, boundary_sets, elements_of
from reference.direct_fruit import FACES, MIDDLE, SIDE
from reference.element_study import element_basis, face_mean
from solve.housing.stiffness import SPRINGS, tip_face

SkfemMesh = Any

TETRAHEDRA = ("tet P2", "C3D10")
HELD_HALF = {"mounting_holes": (1, 2, 3), "symmetry": (2,)}


def flexure_deck(mesh: SkfemMesh, choice: str, kind: str, E: float, poisson: float) -> Deck:
    """Return the deck of a housing, or of its half y >= 0 [mm], with fixed holes and 1 N on each tip in turn; E in MPa.

    `choice` names the element in `reference.element_study`, which places nodes and loads. `kind` is the same element in
    CalculiX. (The product writes decks of its own element and mount only.) Raises SolveError if both elements differ.
    """
    basis = element_basis(mesh, choice)
    elements = elements_of(basis, kind)
    means = {mean_of(spring): elements.nodal_values(basis, face_mean(basis, tip_face(spring))) for spring in SPRINGS}
    held = {name: axes for name, axes in HELD_HALF.items() if name in mesh.boundaries}
    sets = boundary_sets(elements, basis, tuple(held))
    sets["tips"] = np.flatnonzero(np.any(list(means.values()), axis=0))
    fraction = 0.5 if "symmetry" in held else 1.0  # half the force on half the part
    steps = [LinearStep(held=held, loads=fraction * mean) for mean in means.values()]
    return Deck(elements=elements, sets=sets, E=E, poisson=poisson, steps=steps, means=means, printed_set="tips")


def contact_deck(mesh: SkfemMesh, E: float, poisson: float, shift: float) -> Deck:
    """Return the deck of a fruit [mm] under rigid flat tips whose vertical displacement is `shift` [mm]; E in MPa.

    The mesh is of the quarter x, y >= 0, of the half y >= 0 or of the whole; its boundaries show which. On a quarter,
    the tips are pressed equally in the first step and oppositely in the second. Otherwise each step presses one tip.
    """
    boundaries = mesh.boundaries or {}
    tips = tuple(name for name in FACES if name in boundaries)
    planes = tuple(name for name in (SIDE, MIDDLE) if name in boundaries)
    choice, kind = TETRAHEDRA
    basis = element_basis(mesh, choice)
    elements = elements_of(basis, kind)
    sets = boundary_sets(elements, basis, ("base", *planes, *tips))
    held = {"base": (1, 2, 3)} | ({SIDE: (2,)} if SIDE in planes else {})
    if MIDDLE in planes:
        pressed = {tips[-1]: shift}
        steps = [LinearStep(held={**held, MIDDLE: fixed}, pressed=pressed) for fixed in ((1,), (2, 3))]
    else:
        steps = [LinearStep(held=held, pressed={tip: shift if tip == one else 0.0 for tip in tips}) for one in tips]
    return Deck(elements=elements, sets=sets, E=E, poisson=poisson, steps=steps, printed_set=tips[-1])
