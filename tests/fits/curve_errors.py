"""PENALTY, FAR_ELEMENTS, STEPS and GRIP_OF_STEPS of solve/large_strain/curve_error.py.

`python tests/fits curve_errors` (1 minute) prints by how much a finer choice of each moves a curve.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType

import numpy as np
from fits.comparison import Comparison, covering

from solve.large_strain import grid, newton
from solve.large_strain.curve_error import FAR_ELEMENTS, GRIP_OF_STEPS, PENALTY, STEPS
from solve.large_strain.flesh_law import FleshLaw
from solve.large_strain.force_curve import DEPTH_FRACTIONS, REFINEMENTS
from solve.large_strain.press import PressedForces, TipPress, pressed
from solve.large_strain.tip_profile import RoundTip

RADIUS, DEEPEST = 1.0 / math.sqrt(math.pi), 0.4
LAWS = (
    FleshLaw(),
    FleshLaw(poisson=0.49),
    FleshLaw(name="hencky", poisson=0.05),
    FleshLaw(name="foam", poisson=0.15),
)
EDGES = (0.02, 0.07)
DEPTHS = tuple(DEEPEST * share for share in DEPTH_FRACTIONS)
HALVED = tuple(0.5 * (before + after) for before, after in zip((0.0, *DEPTHS), DEPTHS, strict=False))


def factors(edge: float, law: FleshLaw, depths: tuple[float, ...] = DEPTHS) -> tuple[np.ndarray, PressedForces]:
    """Return the forces over the linear ones [1] on the finer mesh of a curve, and all that was found."""
    press = TipPress(tip=RoundTip(radius=RADIUS, edge=edge), law=law, refinement=REFINEMENTS[-1])
    found = pressed(press, depths)
    return found.forces / (found.sharp * found.depths), found


@contextmanager
def instead(module: ModuleType, name: str, value: float) -> Iterator[None]:
    """Let a number of a module be another one."""
    usual = getattr(module, name)
    setattr(module, name, value)
    try:
        yield
    finally:
        setattr(module, name, usual)


def compared(laws: tuple[FleshLaw, ...] = LAWS, edges: tuple[float, ...] = EDGES) -> list[Comparison]:
    """Return each constant beside what it covers; sharp edges at nu < 0.3 are left to the step between the meshes."""
    penalty, far, steps = [], [], []
    for law in laws[:2]:
        with instead(newton, "PENALTY", 10.0 * newton.PENALTY):
            stiffer = factors(0.0, law)[0]
        penalty.append(_most(stiffer - factors(0.0, law)[0]))
    for law in laws:
        for edge in edges:
            usual, found = factors(edge, law)
            with instead(grid, "GROWTH", 1.0 + 0.5 * (grid.GROWTH - 1.0)):
                far.append(_most(factors(edge, law)[0] - usual))
            halved = factors(edge, law, tuple(sorted((*DEPTHS, *HALVED))))[0][1::2]
            of_grip = (found.sharp / found.sliding - 1.0) * edge / RADIUS
            steps.append(_most(halved - usual) / (STEPS + GRIP_OF_STEPS * of_grip))
    return [
        covering("PENALTY", PENALTY, penalty),
        covering("FAR_ELEMENTS", FAR_ELEMENTS, far),
        covering("STEPS and GRIP_OF_STEPS, over what they say", 1.0, steps),
    ]


def _most(difference: np.ndarray) -> float:
    return float(np.abs(difference).max())
