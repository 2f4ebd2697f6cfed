"""A model with linear steps as the text of a CalculiX deck."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TextIO

import numpy as np

from pipeline.decks.elements import Elements
from solve.arrays import Floats, Ints

VERTICAL = 3  # components count from 1


@dataclass(frozen=True, kw_only=True)
class LinearStep:
    """One static step: held components by node set, prescribed u_z by node set [mm], forces along z (nodes,) [N]."""

    held: Mapping[str, Sequence[int]]
    pressed: Mapping[str, float] = field(default_factory=dict)
    loads: Floats = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, kw_only=True, eq=False)
class Deck:
    """A body of one material with its sets of nodes, E [MPa], and the steps that load it.

    The displacements of the set `asked` are printed in each step.
    """

    elements: Elements
    sets: Mapping[str, Ints]
    E: float
    poisson: float
    steps: Sequence[LinearStep]
    asked: str

    def text(self, heading: Sequence[str] = ()) -> str:
        """Return the deck, N, mm and MPa, with lines of a heading as comments before it."""
        file = io.StringIO()
        file.writelines(f"** {line}\n" for line in heading)
        supports = {f"support{number}": support_nodes(step, self.sets) for number, step in enumerate(self.steps)}
        write_model(file, self.elements, {**self.sets, **supports}, self.E, self.poisson)
        for support, step in zip(supports, self.steps, strict=True):
            _write_step(file, step, support, self.asked)
        return file.getvalue()


def write_model(file: TextIO, elements: Elements, sets: Mapping[str, Ints], E: float, poisson: float) -> None:
    """Write nodes, elements, sets and material; CalculiX reads 16 numbers of a line, and 20 characters of a number."""
    nodes = np.column_stack([np.arange(1, elements.nodes.shape[1] + 1), elements.nodes.T])
    cells = np.column_stack([np.arange(1, len(elements.cells) + 1), elements.cells + 1])
    words = np.array_split(["%d"] * cells.shape[1], range(8, cells.shape[1], 8))
    file.write("*NODE, NSET=EVERY\n")
    np.savetxt(file, nodes, "%d, %.12e, %.12e, %.12e")
    file.write(f"*ELEMENT, TYPE={elements.kind}, ELSET=SOLID\n")
    np.savetxt(file, cells, ",\n".join(", ".join(line) for line in words))
    for name, numbers in sets.items():
        file.write(f"*NSET, NSET={name.upper()}\n")
        np.savetxt(file, numbers + 1, "%d,")
    file.write(f"*MATERIAL, NAME=ONE\n*ELASTIC\n{E:.12e}, {poisson:.12e}\n")
    file.write("*SOLID SECTION, ELSET=SOLID, MATERIAL=ONE\n")


def _write_step(file: TextIO, step: LinearStep, support: str, asked: str) -> None:
    file.write("*STEP\n*STATIC\n*BOUNDARY, OP=NEW\n")
    for name, components in step.held.items():
        file.writelines(f"{name.upper()}, {component}, {component}\n" for component in components)
    for name, shift in step.pressed.items():
        file.write(f"{name.upper()}, {VERTICAL}, {VERTICAL}, {shift:.12e}\n")
    if step.loads.any():
        loaded = np.flatnonzero(step.loads)
        file.write("*CLOAD, OP=NEW\n")
        np.savetxt(file, np.column_stack([loaded + 1, step.loads[loaded]]), f"%d, {VERTICAL}, %.12e")
    for name in (support, *step.pressed):
        file.write(f"*NODE PRINT, NSET={name.upper()}, TOTALS=ONLY\nRF\n")
    file.write(f"*NODE PRINT, NSET={asked.upper()}\nU\n*END STEP\n")


def support_nodes(step: LinearStep, sets: Mapping[str, Ints]) -> Ints:
    """Return the nodes (nodes,) whose u_z is held at zero, each once: sets meet along edges."""
    held = np.concatenate([sets[name] for name, components in step.held.items() if VERTICAL in components])
    pressed = [sets[name] for name in step.pressed]
    return np.setdiff1d(held, np.concatenate(pressed) if pressed else [])
