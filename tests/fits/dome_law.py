"""OVER_CONTACT, NEXT_MOMENT and OF_DEPTH of the law of domes: its forces against contact on fine cells.

`python tests/fits dome_law` (1 minute): error over bar of squares on deep and shallow flesh. The fruits are blunt,
so that what the cells leave out, squares of slopes, is small: radii and domes are 25 times those of a mango, travel and
tilt as many times less.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from unittest.mock import patch

import numpy as np
from fits.comparison import Comparison, covering

from cad.design.fruit import Fruit
from cad.design.tips import Press, Tips
from solve.contact.domes.law import domes_on
from solve.contact.linear_response import spring_compliance
from solve.contact.scene import Scene
from solve.contact.scene_cells import scene_cells
from solve.contact.unilateral import UnilateralContact
from solve.fruit.compliance import FruitCompliance
from solve.fruit.split import split_compliance

BLUNT = 25.0
FINER = (16, 24)  # cells a side
ORDER = 1.5
OWN = 1e-3  # of a force: what the fine cells may be off after extrapolation
SPARE = 12.0  # bars hold where terms do not cancel as they do here
MODULI = (0.5, 3.5)


@dataclass(frozen=True)
class Square:
    """Dome radius and width, spacing, springs, travel and tilts of a square, and the height and nu of the flesh."""

    dome: float
    side: float
    spacing: float
    springs: tuple[float, float]
    travel: float
    height: float = 12.0
    poisson: float = 0.3
    tilt: tuple[float, float] = (2.0, 0.0)

    def scene(self) -> Scene:
        fruit = Fruit(
            shape="sphere",
            radius_mm=35.0 * BLUNT,
            thickness_mm=self.height,
            length_mm=52.0,
            width_mm=52.0,
            poisson=self.poisson,
        )
        tips = Tips(
            layout="square",
            shape="dome",
            dome_radius_mm=self.dome * BLUNT,
            side_mm=self.side,
            spacing_mm=self.spacing,
        )
        along, across = (angle / BLUNT for angle in self.tilt)
        return Scene(
            fruit=fruit, tips=tips, press=Press(travel_mm=self.travel / BLUNT, tilt_deg=along, roll_deg=across)
        )


GENTLE = Square(10.0, 5.8, 6.0, (1.2, 20.0), 0.4)
COMPACT = Square(1.0, 1.9, 4.0, (0.753, 17.3), 0.6)
SHALLOW = Square(10.0, 5.8, 6.0, (1.2, 20.0), 0.4, height=6.0)
NEARLY = Square(10.0, 5.8, 6.0, (1.2, 20.0), 0.4, poisson=0.45)


def of_bar(square: Square) -> float:
    """Return the largest error of a force over its bar [1]."""
    scene = square.scene()
    low, high = square.springs
    C = spring_compliance(low, high, low, high)
    known = split_compliance(scene.fruit, scene.tips, 1e-4)
    E, travel = np.array(MODULI), np.full(len(MODULI), scene.press.travel_mm)
    found = domes_on(scene, known, C, [scene] * len(E), E, travel)
    truth = np.array([on_cells(scene, known, C, modulus) for modulus in MODULI])
    return float((np.abs(found.F - truth) / (found.error + OWN * truth)).max())


def on_cells(scene: Scene, known: FruitCompliance, C: np.ndarray, E: float) -> np.ndarray:
    """Return the forces [N] on cells, extrapolated from two grids."""
    x = scene.press.travel_mm
    with patch("solve.contact.scene_cells.WHOLE_CELLS", FINER):
        grids = scene_cells(scene, known, x)
    coarse, fine = (
        E * UnilateralContact(grid.cells).solve(grid.interference(scene, x), E * C + grid.compliance_correction).F
        for grid in grids
    )
    return fine + (fine - coarse) / ((FINER[1] / FINER[0]) ** ORDER - 1.0)


def compared(squares: Sequence[Square] = (GENTLE, COMPACT, SHALLOW, NEARLY)) -> list[Comparison]:
    return [covering("bar of the law of domes", 1.0, [of_bar(square) for square in squares], SPARE)]
