"""CalculiX decks for the tasks of the benchmarks, with the elements of `reference.element_study`; N, mm and MPa."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pipeline.making.flexure_deck import mean_of
from pipeline.storage.deck import Deck, LinearStep, boundary_sets, elements_of
from reference.direct_fruit import FACES, MIDDLE, SIDE
from reference.element_study import element_basis, face_mean
from solve.housing.stiffness import SPRINGS, tip_face

SkfemMesh = Any

TETRAHEDRA = ("tet P2", "C3D10")  # quadratic tetrahedra in `reference.element_study` and in CalculiX
# The displacement components held at 0 on each boundary of half a housing: 1, 2 and 3 are x, y and z.
HELD_HALF = {"mounting_holes": (1, 2, 3), "symmetry": (2,)}


def flexure_deck(mesh: SkfemMesh, choice: str, kind: str, E: float, poisson: float) -> Deck:
    """Return the deck of a housing with fixed holes and a load of 1 N on each tip in turn; E in MPa.

    `mesh` [mm] is the whole housing, or its half y >= 0 with a boundary "symmetry". `choice` names the element in
    `reference.element_study`, which places nodes and loads. `kind` is the same element in CalculiX. The product writes
    decks only for its own element and mounts. Raises SolveError if the two elements differ.
    """
    basis = element_basis(mesh, choice)
    elements = elements_of(basis, kind)
    # The nodal weights of u_z in the mean over the face of a tip. They are also the nodal forces of 1 N on this face.
    means = {mean_of(spring): elements.nodal_values(basis, face_mean(basis, tip_face(spring))) for spring in SPRINGS}
    held = {name: axes for name, axes in HELD_HALF.items() if name in mesh.boundaries}
    sets = boundary_sets(elements, basis, tuple(held))
    sets["tips"] = np.flatnonzero(np.any(list(means.values()), axis=0))  # all nodes with a weight
    fraction = 0.5 if "symmetry" in held else 1.0  # half of the force acts on half of the part
    steps = [LinearStep(held=held, loads=fraction * mean) for mean in means.values()]
    return Deck(elements=elements, sets=sets, E=E, poisson=poisson, steps=steps, means=means, printed_set="tips")


def contact_deck(mesh: SkfemMesh, E: float, poisson: float, shift: float) -> Deck:
    """Return the deck of a fruit [mm] under rigid flat tips whose vertical displacement is `shift` [mm]; E in MPa.

    The mesh is the quarter x, y >= 0, the half y >= 0 or the whole fruit, as its boundaries show. On a quarter, both
    tips are pressed equally in the first step, and oppositely in the second. Otherwise each step presses one tip, and
    the other tip is held.
    """
    boundaries = mesh.boundaries or {}
    tips = tuple(name for name in FACES if name in boundaries)
    planes = tuple(name for name in (SIDE, MIDDLE) if name in boundaries)
    choice, kind = TETRAHEDRA
    basis = element_basis(mesh, choice)
    elements = elements_of(basis, kind)
    sets = boundary_sets(elements, basis, ("base", *planes, *tips))
    steps = _contact_steps(tips, planes, shift)
    return Deck(elements=elements, sets=sets, E=E, poisson=poisson, steps=steps, printed_set=tips[-1])


def _contact_steps(tips: Sequence[str], planes: Sequence[str], shift: float) -> list[LinearStep]:
    """Return the load steps of `contact_deck`, which presses `tips` by `shift` [mm].

    `planes` are the planes of symmetry at which the mesh of the fruit is cut.
    """
    # Displacement components that are held at 0: 1, 2 and 3 are x, y and z.
    held = {"base": (1, 2, 3)} | ({SIDE: (2,)} if SIDE in planes else {})
    if MIDDLE in planes:
        # A quarter has one tip. The plane between the tips holds x if its mirror image moves equally, and y and z if
        # its mirror image moves oppositely.
        pressed = {tips[-1]: shift}
        return [LinearStep(held={**held, MIDDLE: fixed}, pressed=pressed) for fixed in ((1,), (2, 3))]
    steps = []
    for pressed_tip in tips:
        pressed = {tip: shift if tip == pressed_tip else 0.0 for tip in tips}
        steps.append(LinearStep(held=held, pressed=pressed))
    return steps
