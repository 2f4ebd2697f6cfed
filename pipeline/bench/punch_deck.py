"""Rigid flat tips that press a body under contact, as the text of a CalculiX deck.

The tips are blocks whose nodes are all prescribed; they start above the body. A linear law of pressure over overlap
stands for the rigid contact, face to face.
"""

import io
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TextIO

import numpy as np

from pipeline.decks.deck import Deck, support_nodes, write_model
from solve.arrays import Floats

START_MM = 0.15  # how far the tips stand above where they first touch
THICKNESS_MM = 0.3
STIFF = 1e3  # pressure over overlap, and modulus of the tips, over E: [1/mm] and [1]
PULL = 1e-4  # the largest tension at which faces part [MPa]
# The corners of each face of a tetrahedron in CalculiX's order, and those of a tip in its plan, counter-clockwise.
_FACES = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))


@dataclass(frozen=True, kw_only=True)
class Punch:
    """A rigid tip: the corners of its face at the end of its way, shape (3, 4) [mm], counter-clockwise from above."""

    face: Floats


def punch_deck_text(deck: Deck, punches: Mapping[str, Punch], travel: float) -> str:
    """Return the deck of a body of tetrahedra under punches, by the names of the sets that they may touch.

    The punches move down by `travel` [mm] and the way before. The forces of the supports and of the punches are asked
    for, the latter under the names of the sets, and the displacements of the deck's own set.
    """
    (step,) = deck.steps
    file = io.StringIO()
    body = {name: numbers for name, numbers in deck.sets.items() if name not in punches}
    write_model(file, deck.elements, {**body, "support0": support_nodes(step, deck.sets)}, deck.E, deck.poisson)
    file.write(f"*MATERIAL, NAME=HARD\n*ELASTIC\n{STIFF * deck.E:.6e}, 0.3\n*SURFACE INTERACTION, NAME=TOUCH\n")
    file.write(f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{STIFF * deck.E:.6e}, {PULL:.6e}\n")
    way = travel + START_MM
    for number, (name, punch) in enumerate(punches.items()):
        _write_punch(file, deck, name, number, punch.face + np.array([[0.0], [0.0], [way]]))
        _write_touched(file, deck, name)
    _write_step(file, deck, tuple(punches), way)
    return file.getvalue()


def _write_step(file: TextIO, deck: Deck, punches: tuple[str, ...], way: float) -> None:
    """Write the step in which the punches move down their way [mm], and what is printed at its end."""
    file.write("*STEP, INC=200\n*STATIC\n0.5, 1.0, 1.0e-4, 0.5\n*BOUNDARY\n")
    for name, components in deck.steps[0].held.items():
        file.writelines(f"{name.upper()}, {component}, {component}\n" for component in components)
    for name in punches:
        file.write(f"{name.upper()}, 1, 2\n{name.upper()}, 3, 3, {-way:.12e}\n")
    for name in ("support0", *punches):
        file.write(f"*NODE PRINT, NSET={name.upper()}, TOTALS=ONLY, FREQUENCY=1000\nRF\n")
    file.write(f"*NODE PRINT, NSET={deck.asked.upper()}, FREQUENCY=1000\nU\n*END STEP\n")


def _write_punch(file: TextIO, deck: Deck, name: str, number: int, face: Floats) -> None:
    """Write a tip as one brick over its face, and its face as a surface."""
    first = deck.elements.nodes.shape[1] + 8 * number + 1
    element = len(deck.elements.cells) + number + 1
    nodes = np.hstack([face, face + np.array([[0.0], [0.0], [THICKNESS_MM]])])
    file.write(f"*NODE, NSET={name.upper()}\n")
    np.savetxt(file, np.column_stack([np.arange(first, first + 8), nodes.T]), "%d, %.12e, %.12e, %.12e")
    numbers = ", ".join(map(str, range(first, first + 8)))
    file.write(f"*ELEMENT, TYPE=C3D8, ELSET=TIP{number}\n{element}, {numbers}\n")
    file.write(f"*SOLID SECTION, ELSET=TIP{number}, MATERIAL=HARD\n")
    file.write(f"*SURFACE, NAME=FACE_{name.upper()}, TYPE=ELEMENT\n{element}, S1\n")


def _write_touched(file: TextIO, deck: Deck, name: str) -> None:
    """Write the faces of the body whose corners all lie in a set, and that the tip of this name may touch them."""
    touched = np.isin(deck.elements.cells[:, :4], deck.sets[name])
    file.write(f"*SURFACE, NAME=SKIN_{name.upper()}, TYPE=ELEMENT\n")
    for side, corners in enumerate(_FACES, start=1):
        cells = np.flatnonzero(touched[:, corners].all(axis=1))
        file.writelines(f"{cell + 1}, S{side}\n" for cell in cells)
    file.write("*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE\n")
    file.write(f"SKIN_{name.upper()}, FACE_{name.upper()}\n")
