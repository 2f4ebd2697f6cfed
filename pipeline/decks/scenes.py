"""The two scenes that are written as decks: the flexures under a force on each tip, the fruit under rigid tips."""

from dataclasses import dataclass

import numpy as np

from pipeline.decks.deck import Deck, LinearStep
from pipeline.decks.elements import SkfemMesh, boundary_sets, peer_elements
from solve.arrays import Floats
from solve.fruit.direct import FACES, MIDDLE, SIDE
from solve.housing.element_study import face_load
from solve.housing.stiffness import SPRINGS, tip_face

TETRAHEDRA = ("tet P2", "C3D10")
HEXAHEDRA = ("hex 20, reduced", "C3D20R")
HELD_HALF = {"mounting_holes": (1, 2, 3), "symmetry": (2,)}


@dataclass(frozen=True, kw_only=True, eq=False)
class FlexureDeck:
    """The deck of the half housing with half a newton on each tip in turn, and the forces of 1 N by tip (nodes,) [N].

    The mean displacement of a tip's face is the product of displacements with the forces of 1 N.
    """

    deck: Deck
    forces: tuple[Floats, ...]


def flexure_deck(mesh: SkfemMesh, choice: str, kind: str, E: float, poisson: float) -> FlexureDeck:
    """Return the deck of the half housing y >= 0 [mm], its holes held, E [MPa].

    `choice` names the element of `solve.housing.element_study` whose nodes and loads are taken, `kind` that of
    CalculiX. Raises SolveError where they do not fit.
    """
    elements = peer_elements(mesh, choice, kind)
    sets = boundary_sets(elements, mesh, choice, tuple(HELD_HALF))
    faces = [face_load(mesh, choice, tip) for tip in map(tip_face, SPRINGS)]
    count = elements.nodes.shape[1]
    forces = tuple(
        np.asarray(np.bincount(elements.at(face.places), face.forces, minlength=count), dtype=np.float64)
        for face in faces
    )
    sets["tips"] = np.flatnonzero(np.any(forces, axis=0))
    # Half the force on half the part.
    steps = [LinearStep(held=HELD_HALF, loads=np.asarray(0.5 * force)) for force in forces]
    return FlexureDeck(
        deck=Deck(elements=elements, sets=sets, E=E, poisson=poisson, steps=steps, asked="tips"), forces=forces
    )


def contact_deck(mesh: SkfemMesh, E: float, poisson: float, shift: float) -> Deck:
    """Return the deck of the fruit [mm] under its rigid flat tips, whose u_z is prescribed [mm], E [MPa].

    The mesh is of the quarter x, y >= 0, of the half y >= 0 or of the whole, told by its boundaries. On a quarter the
    tips press alike in the first step, and against each other in the second; else one tip presses in each step.
    """
    boundaries = mesh.boundaries or {}
    tips = tuple(name for name in FACES if name in boundaries)
    planes = tuple(name for name in (SIDE, MIDDLE) if name in boundaries)
    elements = peer_elements(mesh, *TETRAHEDRA)
    sets = boundary_sets(elements, mesh, TETRAHEDRA[0], ("base", *planes, *tips))
    held = {"base": (1, 2, 3)} | ({SIDE: (2,)} if SIDE in planes else {})
    if MIDDLE in planes:
        pressed = {tips[-1]: shift}
        steps = [LinearStep(held={**held, MIDDLE: fixed}, pressed=pressed) for fixed in ((1,), (2, 3))]
    else:
        steps = [LinearStep(held=held, pressed={tip: shift if tip == one else 0.0 for tip in tips}) for one in tips]
    return Deck(elements=elements, sets=sets, E=E, poisson=poisson, steps=steps, asked=tips[-1])
